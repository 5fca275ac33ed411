//! The mechanics of a parallel gripper: two fingers that open and close together, one action at a time. Widths are
//! between the finger tips [m]. They close on nothing: the simulated cell has no object between them.

/// What a gripper's fingers can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Reach {
    /// Widest opening [m].
    pub(crate) widest: f64,
    /// Fastest opening or closing [m/s].
    pub(crate) fastest: f64,
}

/// How an action ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outcome {
    Success,
    /// Nothing of the asked size was there.
    Unsuccessful,
    /// It cannot be done at all.
    Impossible,
}

/// What they are asked to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Action {
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

#[derive(Debug, Clone)]
pub(crate) struct Fingers {
    reach: Reach,
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
    pub(crate) fn new(reach: Reach) -> Self {
        Self { reach, width: 0.5 * reach.widest, grasped: false, action: None }
    }

    pub(crate) fn width(&self) -> f64 {
        self.width
    }

    pub(crate) fn widest(&self) -> f64 {
        self.reach.widest
    }

    pub(crate) fn has_grasped(&self) -> bool {
        self.grasped
    }

    /// Begins an action. An impossible one fails at once.
    pub(crate) fn begin(&mut self, action: Action) -> Result<(), Outcome> {
        let fits = match action {
            Action::Homing => true,
            Action::Move { width, speed } => (0.0..=self.reach.widest).contains(&width) && speed > 0.0,
            Action::Grasp { width, epsilon, speed } => {
                (0.0..=self.reach.widest).contains(&width) && speed > 0.0 && epsilon.iter().all(|e| *e >= 0.0)
            }
        };
        if !fits {
            return Err(Outcome::Impossible);
        }
        (self.grasped, self.action) = (false, Some((action, Phase::First)));
        Ok(())
    }

    /// Stops where the fingers are; `true` where an action was cut off.
    pub(crate) fn stop(&mut self) -> bool {
        self.action.take().is_some()
    }

    /// Lets `dt` seconds pass; how the action ended where it did.
    pub(crate) fn step(&mut self, dt: f64) -> Option<Outcome> {
        let (action, phase) = self.action?;
        let (target, speed) = match (action, phase) {
            (Action::Homing, Phase::First) => (0.0, self.reach.fastest),
            (Action::Homing, Phase::Second) => (self.reach.widest, self.reach.fastest),
            (Action::Move { width, speed }, _) => (width, speed),
            (Action::Grasp { speed, .. }, _) => (0.0, speed),
        };
        let way = speed.min(self.reach.fastest) * dt;
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

    fn outcome(&mut self, action: Action) -> Outcome {
        if let Action::Grasp { width, epsilon: [inner, outer], .. } = action {
            self.grasped = width - inner < self.width && self.width < width + outer;
            return if self.grasped { Outcome::Success } else { Outcome::Unsuccessful };
        }
        Outcome::Success
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const HAND: Reach = Reach { widest: 0.08, fastest: 0.1 };

    fn done(fingers: &mut Fingers) -> (Outcome, f64) {
        for k in 1..10_000 {
            if let Some(status) = fingers.step(0.01) {
                return (status, 0.01 * f64::from(k));
            }
        }
        panic!("the action never ends: {fingers:?}");
    }

    #[test]
    fn fingers_go_where_they_are_told_at_the_speed_they_are_told() {
        let mut fingers = Fingers::new(HAND);
        fingers.begin(Action::Move { width: 0.02, speed: 0.01 }).expect("it is possible");
        let (status, took) = done(&mut fingers);
        assert_eq!((status, fingers.width()), (Outcome::Success, 0.02));
        assert!((took - 2.0).abs() < 0.03, "{took} s for 20 mm at 10 mm/s");
        assert_eq!(fingers.begin(Action::Move { width: 0.2, speed: 0.1 }), Err(Outcome::Impossible));
        assert_eq!(fingers.begin(Action::Move { width: f64::NAN, speed: 0.1 }), Err(Outcome::Impossible));
    }

    #[test]
    fn homing_ends_wide_open_and_a_grasp_of_nothing_is_unsuccessful() {
        let mut fingers = Fingers::new(HAND);
        fingers.begin(Action::Homing).expect("it is possible");
        assert_eq!((done(&mut fingers).0, fingers.width()), (Outcome::Success, HAND.widest));
        fingers.begin(Action::Grasp { width: 0.03, epsilon: [0.005; 2], speed: 0.1 }).expect("it is possible");
        assert_eq!(done(&mut fingers).0, Outcome::Unsuccessful);
        assert!(!fingers.has_grasped());
        fingers.begin(Action::Homing).expect("it is possible");
        assert!(fingers.stop() && !fingers.stop());
        assert_eq!(fingers.step(0.01), None);
    }
}
