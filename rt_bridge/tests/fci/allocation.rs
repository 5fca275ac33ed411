//! The driver's promise to the control thread: once a motion runs, a cycle allocates nothing.

use crate::motion::{command, connected};
use crate::robot::Robot;
use rt_bridge::arm::Arm;
use shared_mem::msg::arm::{ArmState, CommandInterface};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

/// The system's allocator, counting what each thread asks for.
struct Counting;

thread_local! {
    static ALLOCATIONS: Cell<u64> = const { Cell::new(0) };
}

// SAFETY: every call is handed on unchanged to the system's allocator; the counter is a constant-initialised thread local,
// which does not allocate.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        ALLOCATIONS.with(|count| count.set(count.get() + 1));
        // SAFETY: the caller's promises are passed on.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: the caller's promises are passed on.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Allocations of this thread so far.
pub(crate) fn allocations() -> u64 {
    ALLOCATIONS.with(Cell::get)
}

/// Allocations of `cycles` cycles of `arm`, after one.
pub(crate) fn allocations_of(arm: &mut dyn Arm, interface: CommandInterface, cycles: usize) -> u64 {
    let (mut state, command) = (ArmState::default(), command(interface));
    let mut before = 0;
    for cycle in 0..=cycles {
        if cycle == 1 {
            before = allocations();
        }
        arm.read(&mut state).expect("the robot goes on");
        arm.command(&command).expect("the robot goes on");
    }
    allocations() - before
}

#[test]
fn a_cycle_allocates_nothing() {
    for interface in [CommandInterface::Torque, CommandInterface::JointPosition] {
        let robot = Robot::new();
        let mut arm = connected(&robot);
        arm.start(interface).expect("it is idle");
        assert_eq!(allocations_of(arm.as_mut(), interface, 300), 0);
    }
}
