//! How far, fast and hard each joint of an arm may go: for whoever plans motions and whoever lets commands pass. Units: rad,
//! s, N m.
//!
//! Ranges, speeds and torques are the model's; what a model does not say (acceleration, jerk, how fast torque may change) is
//! an FR3's. The speed of an FR3 is limited near its stops too, so that it can always be braked before it reaches one.

use super::model::ArmModel;
use super::{MAX_JOINTS, fr3};
use shared_mem::cell::Cell;

/// Limits of one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Whether the joint slides: then m stand in place of rad, and N in place of N m.
    pub slides: bool,
    /// Lowest position [rad].
    pub q_min: f64,
    /// Highest position [rad].
    pub q_max: f64,
    /// Highest speed anywhere [rad/s].
    pub velocity: f64,
    /// Highest acceleration [rad/s²].
    pub acceleration: f64,
    /// Highest jerk [rad/s³].
    pub jerk: f64,
    /// Deceleration that the position-dependent speed limit counts on [rad/s²].
    pub deceleration: f64,
    /// Speed that is taken off the position-dependent limit [rad/s].
    pub velocity_offset: f64,
    /// Highest torque [N m].
    pub torque: f64,
    /// Highest change of torque [N m/s].
    pub torque_rate: f64,
}

/// Torque rate that an FR3 accepts [N m/s]; it also serves for arms that name none.
pub const TORQUE_RATE: f64 = 1000.0;
/// Acceleration of every FR3 joint [rad/s²]; it also serves for arms that name none.
const ACCELERATION: f64 = 10.0;
/// Share of the highest acceleration that stopping counts on.
const STOPPING_SHARE: f64 = 0.9;
/// Jerk of every FR3 joint [rad/s³]; it also serves for arms that name none.
const JERK: f64 = 5000.0;

impl JointLimits {
    /// A joint without limits: for the unused entries of an array.
    pub const FREE: Self = Self {
        slides: false,
        q_min: f64::NEG_INFINITY,
        q_max: f64::INFINITY,
        velocity: f64::INFINITY,
        acceleration: ACCELERATION,
        jerk: JERK,
        deceleration: ACCELERATION,
        velocity_offset: 0.0,
        torque: f64::INFINITY,
        torque_rate: f64::INFINITY,
    };

    /// Highest speed towards `q_max` (`direction` +1) or `q_min` (-1) at position `q`, when at most `deceleration` is
    /// there for stopping: `min(v_max, max(0, -offset + sqrt(2 dec distance)))`, the FR3's own rule.
    pub fn speed_towards(&self, direction: f64, q: f64, deceleration: f64) -> f64 {
        let distance = if direction > 0.0 { self.q_max - q } else { q - self.q_min };
        let stoppable = (2.0 * deceleration * distance.max(0.0)).sqrt() - self.velocity_offset;
        stoppable.clamp(0.0, self.velocity)
    }

    /// Deceleration that whoever looks ahead counts on for stopping [rad/s²]: the position-dependent speed limit's, and a tenth
    /// less than the highest acceleration, which covers control periods being finite.
    pub fn stopping(&self) -> f64 {
        self.deceleration.min(STOPPING_SHARE * self.acceleration)
    }

    /// Slowest (most negative) and fastest speed at position `q` [rad/s].
    pub fn speed_bounds(&self, q: f64) -> [f64; 2] {
        [-self.speed_towards(-1.0, q, self.deceleration), self.speed_towards(1.0, q, self.deceleration)]
    }
}

/// Limits of an arm; entries beyond `dof` are [`JointLimits::FREE`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Joints that count.
    pub dof: usize,
    /// One entry per joint.
    pub joints: [JointLimits; MAX_JOINTS],
}

impl Limits {
    /// Franka Research 3, system image 5.9.0 and later.
    pub fn fr3() -> Self {
        Self::braked(Self::of_model(&ArmModel::fr3()))
    }

    /// The arm of a cell, whose model is `arm`. Torques may be lowered by cell.toml, never raised beyond an FR3's.
    pub fn of(cell: &Cell, arm: &ArmModel) -> Self {
        let limits = Self::of_model(arm);
        if cell.robot.as_ref().and_then(|robot| robot.model.as_deref()) != Some("fr3") {
            return limits;
        }
        let mut limits = Self::braked(limits);
        for (joint, own) in limits.joints.iter_mut().zip(Self::fr3().joints) {
            joint.torque = joint.torque.min(own.torque);
        }
        limits
    }

    /// What a model knows of its own arm.
    fn of_model(arm: &ArmModel) -> Self {
        let mut limits = Self { dof: arm.dof(), joints: [JointLimits::FREE; MAX_JOINTS] };
        for (i, joint) in limits.joints.iter_mut().enumerate().take(arm.dof()) {
            *joint = JointLimits {
                slides: arm.links[i].slides,
                q_min: arm.q_min()[i],
                q_max: arm.q_max()[i],
                velocity: arm.velocity_limit()[i],
                torque: arm.torque_limit()[i],
                torque_rate: TORQUE_RATE,
                ..JointLimits::FREE
            };
        }
        limits
    }

    /// The same with the speeds near the stops that an FR3 allows.
    fn braked(mut self) -> Self {
        for (joint, [deceleration, velocity_offset]) in self.joints.iter_mut().zip(fr3::BRAKING) {
            (joint.deceleration, joint.velocity_offset) = (deceleration, velocity_offset);
        }
        self
    }

    /// The narrower of each limit and that of `other`.
    ///
    /// # Errors
    /// The joint, counted from 1, whose ranges have nothing in common.
    pub fn within(mut self, other: &Self) -> Result<Self, usize> {
        for (number, (joint, other)) in (1..).zip(self.joints.iter_mut().zip(&other.joints)) {
            // `min` and `max` pass over a limit that is no number.
            *joint = JointLimits {
                slides: joint.slides,
                q_min: joint.q_min.max(other.q_min),
                q_max: joint.q_max.min(other.q_max),
                velocity: joint.velocity.min(other.velocity),
                acceleration: joint.acceleration.min(other.acceleration),
                jerk: joint.jerk.min(other.jerk),
                deceleration: joint.deceleration.min(other.deceleration),
                velocity_offset: joint.velocity_offset.max(other.velocity_offset),
                torque: joint.torque.min(other.torque),
                torque_rate: joint.torque_rate.min(other.torque_rate),
            };
            if number <= self.dof && joint.q_min >= joint.q_max {
                return Err(number);
            }
        }
        Ok(self)
    }

    /// The joints that count.
    pub fn counted(&self) -> impl Iterator<Item = &JointLimits> {
        self.joints.iter().take(self.dof)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::{Controller, Robot};

    #[test]
    fn an_fr3_may_go_full_speed_in_the_middle_and_none_at_the_end() {
        let joint = Limits::fr3().joints[0];
        assert!((joint.speed_towards(1.0, 0.0, joint.deceleration) - 2.62).abs() < 1e-12);
        // -0.6599 + sqrt(2 * 6 * 0.1) at a tenth of a radian from the end
        let near = joint.speed_towards(1.0, 2.8007, joint.deceleration);
        assert!((near - (1.2_f64.sqrt() - 0.6599)).abs() < 1e-9);
        assert!(joint.speed_towards(1.0, 2.9007, joint.deceleration).abs() < 1e-12);
        assert!(joint.speed_towards(-1.0, 2.9007, joint.deceleration) > 2.6);
        for joint in Limits::fr3().counted() {
            let [_, at_stop] = joint.speed_bounds(joint.q_max);
            let [at_other_stop, _] = joint.speed_bounds(joint.q_min);
            let [lo, hi] = joint.speed_bounds(0.5 * (joint.q_min + joint.q_max));
            assert_eq!((at_stop, at_other_stop.abs()), (0.0, 0.0));
            assert!(hi > 1.0 && (hi + lo).abs() < 1e-12);
        }
    }

    #[test]
    fn a_cell_may_lower_an_fr3s_torques_and_not_raise_them() {
        let robot = Some(Robot { model: Some("fr3".into()), ..Robot::default() });
        let torque_limit = vec![87.0, 50.0, 200.0, 87.0, 12.0, 12.0, 12.0];
        let controller = Some(Controller { torque_limit, ..Controller::default() });
        let cell = Cell { robot, controller, ..Cell::default() };
        let limits = Limits::of(&cell, &ArmModel::from_cell(&cell).expect("an FR3"));
        let torques: Vec<f64> = limits.counted().map(|joint| joint.torque).collect();
        assert_eq!(torques, [87.0, 50.0, 87.0, 87.0, 12.0, 12.0, 12.0]);
        assert_eq!(limits.joints[2], Limits::fr3().joints[2]);
    }

    #[test]
    fn of_two_limits_the_narrower_holds_and_ranges_must_overlap() {
        let mut wide = Limits::fr3();
        for joint in &mut wide.joints {
            *joint = JointLimits { torque: f64::NAN, deceleration: f64::INFINITY, ..JointLimits::FREE };
        }
        assert_eq!(wide.within(&Limits::fr3()).map(|limits| limits.joints[..7] == Limits::fr3().joints[..7]), Ok(true));
        (wide.joints[3].q_max, wide.joints[3].velocity, wide.joints[2].torque) = (-1.0, 0.5, 3.0);
        let both = wide.within(&Limits::fr3()).expect("ranges that overlap");
        assert_eq!((both.joints[3].q_max, both.joints[3].velocity, both.joints[2].torque), (-1.0, 0.5, 3.0));
        assert_eq!(both.joints[3].q_min, Limits::fr3().joints[3].q_min);
        wide.joints[3].q_max = -4.0;
        assert_eq!(wide.within(&Limits::fr3()), Err(4));
    }

    #[test]
    fn an_arm_of_which_only_names_are_known_has_finite_acceleration_and_no_stops() {
        let cell = Cell { robot: Some(Robot { joints: vec!["pan".into()], ..Robot::default() }), ..Cell::default() };
        let limits = Limits::of(&cell, &ArmModel::from_cell(&cell).expect("one joint"));
        assert_eq!(limits.dof, 1);
        assert_eq!(limits.joints[0].speed_bounds(1.0), [f64::NEG_INFINITY, f64::INFINITY]);
        assert!(limits.joints[0].acceleration.is_finite());
    }
}
