//! The hand's mechanics: two fingers that open and close together, one action at a time. Widths are between the finger
//! tips [m].

use super::wire::Status;

/// Widest opening [m].
const WIDEST: f64 = 0.08;
/// Fastest opening or closing [m/s]: 0.05 m/s a finger, from the hand's data sheet.
const FASTEST: f64 = 0.1;

/// What the hand is asked to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Action {
    /// Find out how wide the fingers open.
    Homing,
    /// Move the fingers apart or together.
    Move {
        /// [m].
        width: f64,
        /// [m/s].
        speed: f64,
    },
    /// Close until something is between the fingers.
    Grasp {
        /// Size of what should be there [m].
        width: f64,
        /// How much smaller and larger it may be [m].
        epsilon: [f64; 2],
        /// [m/s].
        speed: f64,
    },
}

/// The hand.
#[derive(Debug, Clone)]
pub(super) struct Fingers {
    width: f64,
    grasped: bool,
    action: Option<(Action, Phase)>,
}

/// Homing closes before it opens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Phase {
    First,
    Second,
}

impl Fingers {
    /// Half open, at rest.
    pub(super) fn new() -> Self {
        Self { width: 0.5 * WIDEST, grasped: false, action: None }
    }

    pub(super) fn width(&self) -> f64 {
        self.width
    }

    pub(super) fn widest(&self) -> f64 {
        WIDEST
    }

    pub(super) fn has_grasped(&self) -> bool {
        self.grasped
    }

    /// Begins an action. An impossible one fails at once.
    pub(super) fn begin(&mut self, action: Action) -> Result<(), Status> {
        let fits = match action {
            Action::Homing => true,
            Action::Move { width, speed } => (0.0..=WIDEST).contains(&width) && speed > 0.0,
            Action::Grasp { width, epsilon, speed } => {
                (0.0..=WIDEST).contains(&width) && speed > 0.0 && epsilon.iter().all(|e| *e >= 0.0)
            }
        };
        if !fits {
            return Err(Status::Fail);
        }
        (self.grasped, self.action) = (false, Some((action, Phase::First)));
        Ok(())
    }

    /// Stops where the fingers are; `true` where an action was cut off.
    pub(super) fn stop(&mut self) -> bool {
        self.action.take().is_some()
    }

    /// Lets `dt` seconds pass; how the action ended where it did.
    pub(super) fn step(&mut self, dt: f64) -> Option<Status> {
        let (action, phase) = self.action?;
        let (target, speed) = match (action, phase) {
            (Action::Homing, Phase::First) => (0.0, FASTEST),
            (Action::Homing, Phase::Second) => (WIDEST, FASTEST),
            (Action::Move { width, speed }, _) => (width, speed),
            (Action::Grasp { speed, .. }, _) => (0.0, speed),
        };
        let way = speed.min(FASTEST) * dt;
        self.width += (target - self.width).clamp(-way, way);
        if self.width != target {
            return None;
        }
        if (action, phase) == (Action::Homing, Phase::First) {
            self.action = Some((action, Phase::Second));
            return None;
        }
        self.action = None;
        Some(self.outcome(action))
    }

    fn outcome(&mut self, action: Action) -> Status {
        if let Action::Grasp { width, epsilon: [inner, outer], .. } = action {
            self.grasped = width - inner < self.width && self.width < width + outer;
            return if self.grasped { Status::Success } else { Status::Unsuccessful };
        }
        Status::Success
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn done(fingers: &mut Fingers) -> (Status, f64) {
        for k in 1..10_000 {
            if let Some(status) = fingers.step(0.01) {
                return (status, 0.01 * f64::from(k));
            }
        }
        panic!("the action never ends: {fingers:?}");
    }

    #[test]
    fn fingers_go_where_they_are_told_at_the_speed_they_are_told() {
        let mut fingers = Fingers::new();
        fingers.begin(Action::Move { width: 0.02, speed: 0.01 }).expect("it is possible");
        let (status, took) = done(&mut fingers);
        assert_eq!((status, fingers.width()), (Status::Success, 0.02));
        assert!((took - 2.0).abs() < 0.03, "{took} s for 20 mm at 10 mm/s");
        assert_eq!(fingers.begin(Action::Move { width: 0.2, speed: 0.1 }), Err(Status::Fail));
        assert_eq!(fingers.begin(Action::Move { width: f64::NAN, speed: 0.1 }), Err(Status::Fail));
    }

    #[test]
    fn homing_ends_wide_open_and_a_grasp_of_nothing_is_unsuccessful() {
        let mut fingers = Fingers::new();
        fingers.begin(Action::Homing).expect("it is possible");
        assert_eq!((done(&mut fingers).0, fingers.width()), (Status::Success, WIDEST));
        fingers.begin(Action::Grasp { width: 0.03, epsilon: [0.005; 2], speed: 0.1 }).expect("it is possible");
        assert_eq!(done(&mut fingers).0, Status::Unsuccessful);
        assert!(!fingers.has_grasped());
        fingers.begin(Action::Homing).expect("it is possible");
        assert!(fingers.stop() && !fingers.stop());
        assert_eq!(fingers.step(0.01), None);
    }
}
