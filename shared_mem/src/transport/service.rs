//! The flavour of iceoryx2 in use: single-threaded ports without locks, and files in shared memory that have their room
//! before they are used. All but the files is what `iceoryx2::service::ipc` takes.

use super::storage::Storage;
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use iceoryx2_bb_lock_free::mpmc::counting_bit_set::RelocatableCountingBitSet;
use iceoryx2_cal::event::trigger::{State, unix_datagram_socket::GenericUnixDatagramSocketTrigger};
use iceoryx2_cal::resizable_shared_memory::dynamic::DynamicMemory;
use iceoryx2_cal::shared_memory::common::details::{AllocatorDetails, Memory};
use iceoryx2_cal::shm_allocator::{bump_allocator::BumpAllocator, pool_allocator::PoolAllocator};
use iceoryx2_cal::zero_copy_connection::common::details::{Connection, SharedManagementData};
use iceoryx2_cal::{arc_sync_policy, bag, hash, monitoring, reactor, serialize, static_storage};
use std::fmt::Debug;

/// Marks the flavour; there are none of it.
#[derive(Debug, Clone)]
pub(super) struct Service {}

/// Memory for messages.
type Messages<Allocator> = Memory<Allocator, Storage<AllocatorDetails<Allocator>>>;

impl iceoryx2::service::Service for Service {
    type StaticStorage = static_storage::recommended::Ipc;
    type ConfigSerializer = serialize::recommended::Recommended;
    type PersistentDynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> = Storage<T>;
    type Bag = bag::recommended::Recommended;
    type DynamicStorage<T: Debug + Send + Sync + ZeroCopySend + 'static> = Storage<T>;
    type ServiceNameHasher = hash::recommended::Recommended;
    type SharedMemory = Messages<PoolAllocator>;
    type ResizableSharedMemory = DynamicMemory<PoolAllocator, Messages<PoolAllocator>>;
    type Connection = Connection<Storage<SharedManagementData>>;
    type Event =
        GenericUnixDatagramSocketTrigger<RelocatableCountingBitSet, Storage<State<RelocatableCountingBitSet, ()>>>;
    type Monitoring = monitoring::recommended::Ipc;
    type Reactor = reactor::recommended::Ipc;
    type ArcThreadSafetyPolicy<T: Send + Debug + Abandonable> = arc_sync_policy::single_threaded::SingleThreaded<T>;
    type BlackboardMgmt<T: Send + Sync + Debug + ZeroCopySend + 'static> = Storage<T>;
    type BlackboardPayload = Messages<BumpAllocator>;
    type UniqueId = iceoryx2::unique_id_generator::unique_system_id::UniqueSystemId;
}

impl iceoryx2::service::internal::ServiceInternal<Service> for Service {}
