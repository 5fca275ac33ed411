//! From orders in metres and newtons to the gripper's counts, and back; and when it has to find its range first. Pure.

use super::registers::{Action, Activation, Status};
use shared_mem::cell::{Gripper, GripperModel};
use shared_mem::msg::gripper::{GripperAction, GripperCommand, GripperState};

/// One gripper's scales and the last action sent to it.
#[derive(Debug, Clone)]
pub(super) struct Orders {
    widest: f64,
    counts: [f64; 2],
    /// Speeds of counts 0 and 255 [m/s].
    speeds: [f64; 2],
    /// Forces of counts 0 and 255 [N].
    forces: [f64; 2],
    sent: Action,
    waiting: Option<GripperCommand>,
    /// An activation that was asked for and is not confirmed yet.
    homing: bool,
    width_d: Option<f64>,
}

impl Orders {
    /// Speeds and forces are those of the manual's specifications.
    pub(super) fn new(gripper: &Gripper) -> Self {
        let (speeds, forces) = match gripper.model {
            GripperModel::Robotiq2F140 => ([0.030, 0.250], [10.0, 125.0]),
            GripperModel::Robotiq2F85 | GripperModel::FrankaHand => ([0.020, 0.150], [20.0, 235.0]),
        };
        Self {
            widest: gripper.widest(),
            counts: gripper.counts().map(f64::from),
            speeds,
            forces,
            sent: Action::default(),
            waiting: None,
            homing: false,
            width_d: None,
        }
    }

    /// Takes an order; the newest counts.
    pub(super) fn take(&mut self, order: &GripperCommand) {
        if order.width.is_finite() || matches!(order.action, GripperAction::Stop | GripperAction::Home) {
            self.waiting = Some(*order);
        }
    }

    /// What to write now that the gripper reports `status`; `None`: nothing.
    pub(super) fn next(&mut self, status: &Status) -> Option<Action> {
        if self.homing {
            // The activation bit has to fall before it can rise.
            let rising = Action { active: true, ..Action::default() };
            if !self.sent.active {
                return (status.activation == Activation::Reset).then(|| self.send(rising));
            }
            self.homing = status.activation != Activation::Done;
            return None;
        }
        let order = self.waiting?;
        if matches!(order.action, GripperAction::Stop) {
            self.waiting = None;
            self.width_d = Some(self.width(status.position));
            return Some(self.send(Action { active: status.activation != Activation::Reset, ..Action::default() }));
        }
        if order.action == GripperAction::Home || status.activation != Activation::Done {
            if order.action == GripperAction::Home {
                self.waiting = None;
                self.width_d = Some(self.widest);
            }
            self.homing = true;
            return Some(self.send(Action::default()));
        }
        self.waiting = None;
        self.width_d = Some(order.width.clamp(0.0, self.widest));
        let target = match order.action {
            GripperAction::Grasp => 255,
            _ => self.count(order.width),
        };
        let speed = if order.speed > 0.0 { part(order.speed, self.speeds) } else { 255 };
        let force = if order.force > 0.0 { part(order.force, self.forces) } else { 0 };
        Some(self.send(Action { active: true, go: true, position: target, speed, force }))
    }

    fn send(&mut self, action: Action) -> Action {
        self.sent = action;
        action
    }

    /// The state in SI units. The force is the one the gripper limits its motor to, while it holds something.
    pub(super) fn state(&self, status: &Status, stamp_ns: u64) -> GripperState {
        let width = self.width(status.position);
        let limit = self.forces[0] + (self.forces[1] - self.forces[0]) * f64::from(self.sent.force) / 255.0;
        GripperState {
            stamp_ns,
            width,
            width_d: self.width_d.unwrap_or(width),
            force: if status.holds() { limit } else { 0.0 },
            grasped: u32::from(status.holds()),
            fault: status.fault.into(),
        }
    }

    fn width(&self, count: u8) -> f64 {
        let [open, closed] = self.counts;
        self.widest * ((closed - f64::from(count)) / (closed - open)).clamp(0.0, 1.0)
    }

    fn count(&self, width: f64) -> u8 {
        let [open, closed] = self.counts;
        (closed - (closed - open) * (width / self.widest).clamp(0.0, 1.0)).round() as u8
    }
}

/// The count of a value on a scale from 0 to 255.
fn part(value: f64, [lo, hi]: [f64; 2]) -> u8 {
    (255.0 * ((value - lo) / (hi - lo)).clamp(0.0, 1.0)).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn status(activation: u16, position: u16) -> Status {
        Status::from_registers([(0xC0 | activation << 4 | 0b1001) << 8, 0, position << 8])
    }

    fn go(width: f64) -> GripperCommand {
        GripperCommand { width, speed: 0.085, force: 0.0, ..GripperCommand::default() }
    }

    #[test]
    fn a_gripper_that_was_just_switched_on_finds_its_range_before_it_obeys() {
        let mut orders = Orders::new(&Gripper::new(GripperModel::Robotiq2F85));
        assert_eq!(orders.next(&status(0, 0)), None, "nobody asked for anything");
        orders.take(&go(0.0425));
        assert_eq!(orders.next(&status(0, 0)), Some(Action::default()));
        assert_eq!(orders.next(&status(0, 0)), Some(Action { active: true, ..Action::default() }));
        assert_eq!(orders.next(&status(1, 40)), None);
        assert_eq!(orders.next(&status(3, 3)), None);
        let sent = Action { active: true, go: true, position: 117, speed: 128, force: 0 };
        assert_eq!(orders.next(&status(3, 3)), Some(sent));
        assert_eq!(orders.next(&status(3, 3)), None);
        let arrived = orders.state(&status(3, 117), 5);
        assert!((arrived.width - 0.0425).abs() < 2e-4 && arrived.width_d == 0.0425, "{arrived:?}");
    }

    #[test]
    fn a_stop_stops_at_once_and_a_newer_order_replaces_an_older_one() {
        let mut orders = Orders::new(&Gripper::new(GripperModel::Robotiq2F140));
        orders.take(&go(0.1));
        orders.take(&go(0.0));
        let action = orders.next(&status(3, 3)).expect("an action");
        assert_eq!((action.position, action.go), (230, true));
        orders.take(&GripperCommand { action: GripperAction::Stop, ..go(f64::NAN) });
        let action = orders.next(&status(3, 100)).expect("an action");
        assert_eq!((action.active, action.go), (true, false));
        orders.take(&go(f64::NAN));
        assert_eq!(orders.next(&status(3, 100)), None, "a width that is no number is no order");
    }

    #[test]
    fn what_it_holds_it_holds_with_the_force_asked_for() {
        let mut orders = Orders::new(&Gripper::new(GripperModel::Robotiq2F85));
        orders.take(&GripperCommand { action: GripperAction::Grasp, force: 235.0, ..go(0.03) });
        let action = orders.next(&status(3, 3)).expect("an action");
        assert_eq!((action.position, action.force), (255, 255));
        let state = orders.state(&Status::from_registers([0xB900, 0x00FF, 0xBD00]), 0);
        assert_eq!((state.grasped, state.force), (1, 235.0));
    }

    proptest! {
        #[test]
        fn a_width_comes_back_within_half_a_count(width in 0.0_f64..0.085) {
            let orders = Orders::new(&Gripper::new(GripperModel::Robotiq2F85));
            prop_assert!((orders.width(orders.count(width)) - width).abs() <= 0.5 * 0.085 / 227.0 + 1e-12);
        }

        #[test]
        fn whatever_it_reports_and_is_told_it_is_told_to_go_only_when_it_can(
            registers: [u16; 3], width: f64, speed: f64, force: f64, action in 0_u8..4,
        ) {
            let mut orders = Orders::new(&Gripper::new(GripperModel::Robotiq2F85));
            let action = [GripperAction::Move, GripperAction::Grasp, GripperAction::Stop, GripperAction::Home][usize::from(action)];
            orders.take(&GripperCommand { action, width, speed, force, ..GripperCommand::default() });
            let status = Status::from_registers(registers);
            if let Some(action) = orders.next(&status) {
                prop_assert!(!action.go || status.activation == Activation::Done);
            }
            prop_assert!((0.0..=0.085).contains(&orders.state(&status, 0).width));
        }
    }
}
