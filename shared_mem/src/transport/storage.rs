//! iceoryx2's files in shared memory, with one difference: a new one has all its room before the first byte is written.
//!
//! iceoryx2 0.10 sets the length of a file and writes to it; where there is no room, the first write kills the process.
//! Here the room comes between the two, and where there is none the file is not made. Opening, removing and listing are
//! iceoryx2's own, and so is the layout, which [`Builder::create`] has checked by opening what it made.

use super::room;
use iceoryx2::prelude::SemanticString as _;
use iceoryx2_bb_elementary::package_version::PackageVersion;
use iceoryx2_bb_elementary_traits::testing::abandonable::Abandonable;
use iceoryx2_bb_elementary_traits::zero_copy_send::ZeroCopySend;
use iceoryx2_bb_memory::bump_allocator::BumpAllocator;
use iceoryx2_bb_posix::access_mode::AccessMode;
use iceoryx2_bb_posix::creation_mode::CreationMode;
use iceoryx2_bb_posix::file_descriptor::FileDescriptorManagement as _;
use iceoryx2_bb_posix::permission::Permission;
use iceoryx2_bb_posix::shared_memory::{SharedMemory, SharedMemoryBuilder, SharedMemoryCreationError};
use iceoryx2_bb_system_types::file_name::FileName;
use iceoryx2_bb_system_types::path::Path;
use iceoryx2_cal::dynamic_storage::{
    DynamicStorage, DynamicStorageBuilder, DynamicStorageCreateError, DynamicStorageOpenError,
    DynamicStorageOpenOrCreateError, Initializer, posix_shared_memory as posix,
};
use iceoryx2_cal::named_concept::{
    NamedConcept, NamedConceptBuilder, NamedConceptConfiguration as _, NamedConceptDoesExistError,
    NamedConceptListError, NamedConceptMgmt, NamedConceptPathHintRemoveError, NamedConceptRemoveError,
};
use std::ffi::OsStr;
use std::fmt::Debug;
use std::mem::MaybeUninit;
use std::os::unix::ffi::OsStrExt as _;
use std::ptr::NonNull;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;

/// Something in shared memory that processes open by its name. What lies there holds no addresses, so that it may be mapped
/// anywhere: that is iceoryx2's own rule.
#[derive(Debug)]
pub(super) struct Storage<T: Send + Sync + Debug + ZeroCopySend>(posix::Storage<T>);

/// Makes or opens a [`Storage`].
#[derive(Debug)]
pub(super) struct Builder<'a, T: Send + Sync + Debug + ZeroCopySend> {
    name: FileName,
    config: posix::Configuration<T>,
    /// Room behind the value [bytes].
    supplement: usize,
    has_ownership: bool,
    timeout: Duration,
    initializer: Initializer<'a, T>,
}

/// How a file begins; the supplement follows.
#[repr(C)]
struct Begin<T> {
    /// iceoryx2's version, set when all else is written.
    version: AtomicU64,
    value: MaybeUninit<T>,
}

impl<T: Send + Sync + Debug + ZeroCopySend> Builder<'_, T> {
    fn open_existing(&self, access: AccessMode) -> Result<Storage<T>, DynamicStorageOpenError> {
        posix::Builder::new(&self.name).config(&self.config).timeout(self.timeout).open(access).map(Storage)
    }

    fn make(&mut self) -> Result<Storage<T>, DynamicStorageCreateError> {
        let file = self.config.path_for(&self.name).file_name();
        // Until its rights are set, nobody else takes it for finished.
        let mut made = SharedMemoryBuilder::new(&file)
            .creation_mode(CreationMode::CreateExclusive)
            .size(size_of::<Begin<T>>() + self.supplement)
            .permission(Permission::OWNER_WRITE)
            .zero_memory(false)
            .has_ownership(true)
            .create()
            .map_err(|e| match e {
                SharedMemoryCreationError::AlreadyExist => DynamicStorageCreateError::AlreadyExists,
                SharedMemoryCreationError::InsufficientPermissions => {
                    DynamicStorageCreateError::InsufficientPermissions
                }
                _ => DynamicStorageCreateError::InternalError,
            })?;
        if !room::take(OsStr::from_bytes(file.as_bytes()), made.size()) {
            return Err(DynamicStorageCreateError::InternalError);
        }
        self.fill(&made)?;
        let finished = made.set_permission(Permission::OWNER_READ_WRITE);
        finished.map_err(|_| DynamicStorageCreateError::InternalError)?;
        let opened = self.open_existing(AccessMode::ReadWrite).map_err(|_| DynamicStorageCreateError::InternalError)?;
        // From here on it is removed by whoever owns what was opened, and not when `made` is dropped.
        made.release_ownership();
        if self.has_ownership {
            opened.acquire_ownership();
        }
        Ok(opened)
    }

    /// Writes the value and what it keeps behind itself.
    fn fill(&mut self, made: &SharedMemory) -> Result<(), DynamicStorageCreateError> {
        let first = made.base_address();
        let begin = first.cast::<Begin<T>>();
        // SAFETY: the mapping begins with a page, so that it is aligned for everything, and is at least as long as a `Begin`;
        // nobody else opens the file before its rights are set.
        let begin = unsafe {
            begin.write(Begin { version: AtomicU64::new(0), value: MaybeUninit::uninit() });
            &mut *begin.as_ptr()
        };
        // SAFETY: the mapping is as long as `Begin` and the supplement together.
        let behind = unsafe { first.add(size_of::<Begin<T>>()) };
        let mut allocator = BumpAllocator::new(behind, made.size() - size_of::<Begin<T>>());
        if !self.initializer.call(&mut begin.value, &mut allocator) {
            return Err(DynamicStorageCreateError::InitializationFailed);
        }
        begin.version.store(PackageVersion::get().to_u64(), Ordering::SeqCst);
        Ok(())
    }
}

impl<T: Send + Sync + Debug + ZeroCopySend> NamedConceptBuilder<Storage<T>> for Builder<'_, T> {
    fn new(name: &FileName) -> Self {
        Self {
            name: *name,
            config: posix::Configuration::default(),
            supplement: 0,
            has_ownership: true,
            timeout: Duration::ZERO,
            initializer: Initializer::new(|_, _| false),
        }
    }

    fn config(self, config: &posix::Configuration<T>) -> Self {
        Self { config: config.clone(), ..self }
    }
}

impl<'a, T: Send + Sync + Debug + ZeroCopySend> DynamicStorageBuilder<'a, T, Storage<T>> for Builder<'a, T> {
    fn has_ownership(self, has_ownership: bool) -> Self {
        Self { has_ownership, ..self }
    }

    /// Not taken up: whoever may write a file may cut it short, and that kills its readers.
    fn enable_global_access(self, _for_everybody: bool) -> Self {
        self
    }

    fn supplementary_size(self, supplement: usize) -> Self {
        Self { supplement, ..self }
    }

    fn timeout(self, timeout: Duration) -> Self {
        Self { timeout, ..self }
    }

    fn initializer<F: FnMut(&mut MaybeUninit<T>, &mut BumpAllocator) -> bool + 'a>(self, initializer: F) -> Self {
        Self { initializer: Initializer::new(initializer), ..self }
    }

    fn create(mut self) -> Result<Storage<T>, DynamicStorageCreateError> {
        self.make()
    }

    fn open(self, access: AccessMode) -> Result<Storage<T>, DynamicStorageOpenError> {
        self.open_existing(access)
    }

    fn open_or_create(mut self) -> Result<Storage<T>, DynamicStorageOpenOrCreateError> {
        loop {
            match self.open_existing(AccessMode::ReadWrite) {
                Err(DynamicStorageOpenError::DoesNotExist) => match self.make() {
                    // Another process was faster.
                    Err(DynamicStorageCreateError::AlreadyExists) => {}
                    made => return Ok(made?),
                },
                opened => return Ok(opened?),
            }
        }
    }
}

impl<T: Send + Sync + Debug + ZeroCopySend> Abandonable for Storage<T> {
    unsafe fn abandon_in_place(mut this: NonNull<Self>) {
        // SAFETY: the caller promises a valid storage that is used no more.
        unsafe { posix::Storage::abandon_in_place(NonNull::from_mut(&mut this.as_mut().0)) };
    }
}

impl<T: Send + Sync + Debug + ZeroCopySend> NamedConcept for Storage<T> {
    fn name(&self) -> &FileName {
        self.0.name()
    }
}

impl<T: Send + Sync + Debug + ZeroCopySend> NamedConceptMgmt for Storage<T> {
    type Configuration = posix::Configuration<T>;

    fn does_exist_cfg(name: &FileName, cfg: &Self::Configuration) -> Result<bool, NamedConceptDoesExistError> {
        posix::Storage::<T>::does_exist_cfg(name, cfg)
    }

    fn list_cfg(cfg: &Self::Configuration) -> Result<Vec<FileName>, NamedConceptListError> {
        posix::Storage::<T>::list_cfg(cfg)
    }

    unsafe fn remove_cfg(name: &FileName, cfg: &Self::Configuration) -> Result<bool, NamedConceptRemoveError> {
        // SAFETY: the caller promises that nobody uses it.
        unsafe { posix::Storage::<T>::remove_cfg(name, cfg) }
    }

    fn remove_path_hint(value: &Path) -> Result<(), NamedConceptPathHintRemoveError> {
        posix::Storage::<T>::remove_path_hint(value)
    }
}

impl<T: Send + Sync + Debug + ZeroCopySend> DynamicStorage<T> for Storage<T> {
    type Builder<'a> = Builder<'a, T>;

    fn does_support_persistency() -> bool {
        posix::Storage::<T>::does_support_persistency()
    }

    fn has_ownership(&self) -> bool {
        self.0.has_ownership()
    }

    fn release_ownership(&self) {
        self.0.release_ownership();
    }

    fn acquire_ownership(&self) {
        self.0.acquire_ownership();
    }

    fn get(&self) -> &T {
        self.0.get()
    }

    unsafe fn __internal_set_type_name_in_config(config: &mut Self::Configuration, type_name: &str) {
        // SAFETY: the caller promises that the name is the type's.
        unsafe { posix::Storage::<T>::__internal_set_type_name_in_config(config, type_name) };
    }
}
