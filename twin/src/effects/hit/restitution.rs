//! Tip and object part faster or slower than assumed.
//!
//! - Equation: `v_after = -e v_before` of the two surfaces along the normal.
//! - Source: Newton's law of restitution; realised by the dissipation of [`crate::physics::hit`].
//! - Unit: 1. Plausible: 0.02 to 0.9; neutral: the nominal contact's. What bounces is seldom as hard as the nominal contact:
//!   `compliance` [m/N] in series with it, up to 5e-5, a contact of 10 ms under 0.3 kg, in which the arm goes on pushing.
//! - Signature (H1): the same ratio of speeds after and before at all speeds.
//! - Confused with: the object's mass and inertia, contact compliance (depends on speed and gains), tip friction.

use crate::contact_law::{COMPLIANCE_OF_ENGINES, ContactLaw, RESTITUTION, RESTITUTION_OF_ENGINES};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, short};
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "restitution",
    stage: Stage::Hit,
    acts_on: Place::ToolContact,
    parameters: &[
        Parameter::size("restitution", "1", [0.02, 0.9], RESTITUTION)
            .within(0.0, 1.0)
            .of_engines(RESTITUTION_OF_ENGINES),
        Parameter::form("compliance", "m/N", [0.0, 5e-5], 0.0).within(0.0, 1.0).of_engines(COMPLIANCE_OF_ENGINES),
    ],
    confusable_with: &["object_inertia", "contact_compliance", "tip_friction"],
    separated: &[Separation {
        from: "contact_compliance",
        by: "strokes at half their speed beside those there are: restitution keeps the ratio of the speeds, compliance does not",
        record: &[Experiment::StrokeAgainSlower, Experiment::StrokesSlower],
    }],
    install: |values, effects| {
        let [restitution, compliance] = ["restitution", "compliance"].map(|name| values.number(name));
        effects.hit.restitution = Some(Restitution { restitution, compliance });
    },
    remedy: |found| {
        let e: f64 = found.number("restitution");
        let log = e.max(1e-6).ln();
        let ratio = -log / (std::f64::consts::PI.powi(2) + log * log).sqrt();
        let compliance = found.number("compliance");
        let softer = if compliance > 0.0 { format!(", softer by {} m/N", short(compliance)) } else { String::new() };
        Remedy::new(
            format!(
                "Nothing is broken: tip and object part with {} of the speed at which they meet. A softer or harder tip changes it.",
                short(e)
            ),
            format!(
                "Restitution {} of tip and object{softer} (SDF: <restitution_coefficient>; MuJoCo: a contact damping ratio of about {} in solref).",
                short(e),
                short(ratio)
            ),
        )
    },
    model: |found| {
        let [restitution, compliance] = ["restitution", "compliance"].map(|name| found.number(name));
        vec![Change::Restitution(restitution), Change::Compliance(compliance)]
    },
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct Restitution {
    restitution: f64,
    compliance: f64,
}

impl Restitution {
    pub(super) fn apply(&self, law: &mut ContactLaw) {
        law.restitution = self.restitution;
        law.yield_by(self.compliance);
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_hit::effects;
    use crate::contact_law::ContactLaw;

    #[test]
    fn it_takes_the_place_of_the_nominal_one_and_leaves_the_rest() {
        let nominal = ContactLaw::nominal(0.2);
        let law = effects("[[effect]]\nname = \"restitution\"\nrestitution = 0.6").real_law(nominal);
        assert_eq!(law, ContactLaw { restitution: 0.6, ..nominal });
    }

    #[test]
    fn what_bounces_may_be_softer() {
        let nominal = ContactLaw::nominal(0.2);
        let soft =
            effects("[[effect]]\nname = \"restitution\"\nrestitution = 0.6\ncompliance = 5e-7").real_law(nominal);
        assert!((soft.stiffness / nominal.stiffness - 0.5).abs() < 1e-12, "{}", soft.stiffness);
    }
}
