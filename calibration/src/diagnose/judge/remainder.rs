//! What the named effects leave: whether it is small enough to believe that they are the cause.
//!
//! A substitute for a cause that the library does not know fits a part of it, grows beyond what is plausible, or helps
//! on some clips and harms on others. What is left is then more than another engine's way of integrating leaves.

use super::ends;
use super::gap::{Residuals, Typical, explained};
use crate::answer::diagnosis::{JointGap, SensorGap, Sensors};
use crate::diagnose::criteria::{
    DOUBTFUL_EXCESS, JOINTS_EXCESS, JOINTS_EXCESS_BESIDE_A_CAUSE, JOINTS_SHARE_LEFT, MOST_OF_IT, OBJECT_EXCESS,
    OBJECT_EXCESS_BESIDE_A_CAUSE, OBJECT_SHARE_LEFT, PLAIN_EXCESS, TURNS_WITHIN,
};
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::parameters;
use twin::effects::Role;

impl SensorGap {
    /// Of every group of sensors, in a clip like most.
    pub fn of_groups(before: &[Typical], after: &[Typical]) -> Vec<Self> {
        let one = |(before, after): (&Typical, &Typical)| Self {
            sensors: if before.of_object { Sensors::Object } else { Sensors::Joints },
            before: before.mean_square,
            after: after.mean_square,
            floor: before.floor,
        };
        before.iter().zip(after).map(one).collect()
    }

    pub fn of_object(&self) -> bool {
        self.sensors == Sensors::Object
    }

    /// What other reasons than a cause leave beyond the noise.
    pub fn numerics(&self) -> f64 {
        if self.of_object() { OBJECT_EXCESS_BESIDE_A_CAUSE.value } else { JOINTS_EXCESS_BESIDE_A_CAUSE.value }
    }

    /// Share of the gap that a cause may leave.
    pub fn substitute(&self) -> f64 {
        if self.of_object() { OBJECT_SHARE_LEFT.value } else { JOINTS_SHARE_LEFT.value }
    }

    /// The gap of the twin without any effect beyond the noise, in least gaps: of 1 on it is a gap.
    pub fn gaps(&self) -> f64 {
        (self.before - self.floor) / if self.of_object() { OBJECT_EXCESS.value } else { JOINTS_EXCESS.value }
    }

    /// Whether the gap of the twin without any effect is so large that a substitute for its cause does not close it.
    pub fn is_plain(&self) -> bool {
        let least = if self.of_object() { OBJECT_EXCESS } else { JOINTS_EXCESS_BESIDE_A_CAUSE };
        self.before - self.floor > PLAIN_EXCESS * least.value
    }

    /// How likely it is that nothing is there where no cause is seen.
    pub fn is_nothing(&self) -> f64 {
        1.0 / (1.0 + ((self.gaps() - DOUBTFUL_EXCESS.value) / TURNS_WITHIN.value).exp())
    }

    /// Whether something structured remains that is no numerics. `clear`: what was found stood out so much that it is
    /// believed although it leaves a rough hit rough.
    pub fn too_much(&self, clear: bool) -> bool {
        let excess = self.after - self.floor;
        // After a bouncing hit no two engines agree; what unknown causes are mistaken for leaves two thirds.
        let substitute = if clear && self.of_object() { MOST_OF_IT } else { self.substitute() };
        excess > self.numerics() && excess > substitute * (self.before - self.floor)
    }

    /// Share of the excess that is explained.
    pub fn explained(&self) -> f64 {
        explained(self.before, self.after, self.floor)
    }
}

/// What two hypotheses leave in a clip like most.
#[derive(Debug, Clone)]
pub struct Left {
    /// In every group of sensors.
    pub sensors: Vec<SensorGap>,
    /// In the arm's group, in every joint.
    pub joints: Vec<JointGap>,
}

impl Left {
    pub fn of(bench: &Bench<'_>, before: &Residuals, after: &Residuals) -> Self {
        let [in_joints, of_joints] = [before, after].map(|residuals| residuals.typical_of_joints(bench));
        let joint = |((joint, before), (_, after)): (&(usize, Typical), &(usize, Typical))| JointGap {
            joint: joint + 1,
            before: before.mean_square,
            after: after.mean_square,
            floor: before.floor,
        };
        Self {
            sensors: SensorGap::of_groups(&before.typical(), &after.typical()),
            joints: in_joints.iter().zip(&of_joints).map(joint).collect(),
        }
    }
}

/// An effect stronger than what is plausible by more than this share of that range is no cause but a substitute for
/// one.
const MAX_BEYOND_RANGE: f64 = 0.05;

/// Effects of a hypothesis that are stronger than what is plausible, whatever of their intervals is true: what stopped at an
/// end of its search is at least as strong as that.
pub fn implausible(bench: &Bench<'_>, hypothesis: &Hypothesis) -> Vec<usize> {
    let beyond = |effect: &usize| {
        let sizes = parameters::of_effect(bench, hypothesis, *effect);
        let stopped = ends::stopped(bench.library, *effect, &hypothesis.full);
        let info = bench.library.candidates[*effect].effect.parameters.iter();
        info.filter(|parameter| matches!(parameter.role, Role::Size { .. })).any(|parameter| {
            let outside = |(index, (value, ci90)): (usize, (&f64, &[f64; 2]))| {
                let [low, high] = if stopped.contains(&(parameter.name, index)) { [*value; 2] } else { *ci90 };
                let [lo, hi] = bench.library.robot().range(parameter, Some(index));
                let room = MAX_BEYOND_RANGE * (hi - lo);
                // What fades out towards infinity is met from its strongest on.
                let hi = if parameter.resting_value().is_infinite() { f64::INFINITY } else { hi };
                low > hi + room || high < lo - room
            };
            sizes.get(parameter.name).is_some_and(|size| size.values.iter().zip(&size.ci90).enumerate().any(outside))
        })
    };
    hypothesis.effects.iter().copied().filter(beyond).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_that_closes_to_a_hundredth_is_explained_and_one_that_halves_is_not() {
        let left = |after| SensorGap { sensors: Sensors::Joints, before: 1000.0, after, floor: 1.0 };
        assert!(!left(12.0).too_much(false));
        assert!(left(500.0).too_much(false));
        assert!((left(500.0).explained() - 0.5005).abs() < 1e-3);
    }

    #[test]
    fn a_clear_cause_may_leave_a_rough_hit_rough_and_an_arm_nothing() {
        let of_object = SensorGap { sensors: Sensors::Object, before: 60.0, after: 26.0, floor: 1.5 };
        assert!(of_object.too_much(false) && !of_object.too_much(true));
        assert!(SensorGap { after: 40.0, ..of_object }.too_much(true), "two thirds are left");
        assert!(SensorGap { sensors: Sensors::Joints, ..of_object }.too_much(true));
    }

    #[test]
    fn what_numerics_leave_is_no_remainder() {
        assert!(!SensorGap { sensors: Sensors::Joints, before: 2.0, after: 2.0, floor: 1.0 }.too_much(false));
    }
}
