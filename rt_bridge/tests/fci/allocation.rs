//! The driver's promise to the control thread: once a motion runs, a cycle allocates nothing.

use crate::counting::allocations;
use crate::motion::{command, connected};
use crate::robot::Robot;
use rt_bridge::arm::Arm;
use shared_mem::msg::arm::{ArmState, CommandInterface};

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
