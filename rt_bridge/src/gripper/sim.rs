//! The simulated gripper: fingers of the described kind, moved by this machine's clock.

use super::PERIOD;
use super::fingers::{Action, Fingers, Reach};
use crate::device::{Device, DeviceFault};
use shared_mem::cell::{Gripper, GripperModel};
use shared_mem::msg::gripper::{GripperAction, GripperCommand, GripperState};
use shared_mem::time::now_ns;
use std::thread;
use std::time::Instant;

/// How far the size of what is held may be from what was asked for [m].
const EPSILON: f64 = 0.005;

/// The simulated gripper.
#[derive(Debug)]
pub(super) struct SimGripper {
    fingers: Fingers,
    reach: Reach,
    width_d: f64,
    last: Option<Instant>,
}

impl SimGripper {
    pub(super) fn new(gripper: &Gripper) -> Self {
        let fastest = match gripper.model {
            GripperModel::Robotiq2F85 => 0.150,
            GripperModel::Robotiq2F140 => 0.250,
            GripperModel::FrankaHand => super::FRANKA_HAND.fastest,
        };
        let reach = Reach { widest: gripper.widest(), fastest };
        let fingers = Fingers::new(reach);
        Self { width_d: fingers.width(), fingers, reach, last: None }
    }

    fn take(&mut self, order: &GripperCommand) {
        let width = if order.width.is_finite() { order.width.clamp(0.0, self.reach.widest) } else { self.width_d };
        let speed = if order.speed > 0.0 { order.speed } else { self.reach.fastest };
        let action = match order.action {
            GripperAction::Stop => {
                self.fingers.stop();
                self.width_d = self.fingers.width();
                return;
            }
            GripperAction::Home => Action::Homing,
            GripperAction::Move => Action::Move { width, speed },
            GripperAction::Grasp => Action::Grasp { width, epsilon: [EPSILON; 2], speed },
        };
        self.width_d = if order.action == GripperAction::Home { self.reach.widest } else { width };
        // Every number was made possible above.
        let _begun = self.fingers.begin(action);
    }

    fn advance(&mut self, seconds: f64) -> GripperState {
        let _outcome = self.fingers.step(seconds);
        GripperState {
            stamp_ns: now_ns(),
            width: self.fingers.width(),
            width_d: self.width_d,
            force: 0.0,
            // The fingers met each other: whatever width was asked for, there is nothing between them.
            grasped: u32::from(self.fingers.has_grasped() && self.fingers.width() > 0.0),
            fault: 0,
        }
    }
}

impl Device for SimGripper {
    type Sample = GripperState;
    type Order = GripperCommand;

    fn round(&mut self, order: Option<&GripperCommand>) -> Result<Option<GripperState>, DeviceFault> {
        if let Some(order) = order {
            self.take(order);
        }
        thread::sleep(PERIOD);
        let now = Instant::now();
        let seconds = self.last.replace(now).map_or(0.0, |last| (now - last).as_secs_f64());
        Ok(Some(self.advance(seconds)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_goes_where_it_is_told_and_no_further_than_it_can() {
        let mut gripper = SimGripper::new(&Gripper::new(GripperModel::Robotiq2F85));
        gripper.take(&GripperCommand { width: 0.02, speed: 0.05, ..GripperCommand::default() });
        let on_the_way = gripper.advance(0.1);
        assert!((on_the_way.width - 0.0375).abs() < 1e-12 && on_the_way.width_d == 0.02, "{on_the_way:?}");
        assert_eq!(gripper.advance(10.0).width, 0.02);
        gripper.take(&GripperCommand { width: 7.0, ..GripperCommand::default() });
        assert_eq!(gripper.advance(10.0).width, 0.085);
        gripper.take(&GripperCommand { width: f64::NAN, ..GripperCommand::default() });
        assert_eq!(gripper.advance(10.0).width, 0.085);
        gripper.take(&GripperCommand { action: GripperAction::Grasp, width: 0.03, ..GripperCommand::default() });
        assert_eq!(gripper.advance(10.0).grasped, 0, "there is nothing to hold");
        gripper.take(&GripperCommand { action: GripperAction::Grasp, width: 0.002, ..GripperCommand::default() });
        assert_eq!(gripper.advance(10.0).grasped, 0, "nor anything thinner than what widths may be off");
        gripper.take(&GripperCommand { action: GripperAction::Home, ..GripperCommand::default() });
        let (_closing, open) = (gripper.advance(10.0), gripper.advance(10.0));
        assert_eq!(open.width, 0.085);
    }
}
