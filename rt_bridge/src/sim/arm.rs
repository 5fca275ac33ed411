//! The control thread's end of the simulated cell.

use crate::arm::{Arm, ArmFault, Clock, Desired, Read};
use rtrb::{Consumer, Producer};
use shared_mem::msg::arm::{ArmCommand, ArmState, CommandInterface};
use shared_mem::time::TICK_NS;
use shared_mem::time::now_ns;
use std::thread::Thread;

/// How long a tick waits for a state that is almost there [ns].
const PATIENCE_NS: u64 = 150_000;

/// The simulated arm.
#[derive(Debug)]
pub struct SimArm {
    pub(super) dof: usize,
    pub(super) states: Consumer<ArmState>,
    pub(super) commands: Producer<ArmCommand>,
    pub(super) world: Thread,
}

impl Arm for SimArm {
    fn dof(&self) -> usize {
        self.dof
    }

    fn clock(&self) -> Clock {
        Clock::Timer { period_ns: TICK_NS }
    }

    fn start(&mut self, _interface: CommandInterface) -> Result<Desired, ArmFault> {
        Ok(Desired::Commanded)
    }

    fn read(&mut self, state: &mut ArmState) -> Result<Read, ArmFault> {
        let give_up_ns = now_ns() + PATIENCE_NS;
        loop {
            if let Ok(fresh) = self.states.pop() {
                *state = fresh;
                state.stamp_ns = now_ns();
                return Ok(Read::Fresh);
            }
            if self.states.is_abandoned() {
                return Err(ArmFault::Disconnected);
            }
            if now_ns() > give_up_ns {
                return Ok(Read::Missing);
            }
            std::hint::spin_loop();
        }
    }

    fn command(&mut self, command: &ArmCommand) -> Result<(), ArmFault> {
        // The ring is never full: a command follows a state, and a state a command.
        self.commands.push(*command).map_err(|_| ArmFault::Disconnected)?;
        self.world.unpark();
        Ok(())
    }

    fn stop(&mut self) {}

    fn recover(&mut self) -> Result<(), ArmFault> {
        Ok(())
    }
}
