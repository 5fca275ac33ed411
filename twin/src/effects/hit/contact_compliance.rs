//! Tip or object are soft: the contact lasts longer and the arm pushes meanwhile.
//!
//! - Equation: `1 / k = 1 / k_nominal + compliance`.
//! - Source: springs in series; Hunt and Crossley 1975 for the law around it.
//! - Unit: m/N. Plausible: 0 to 1e-3, a stiffness down to 1e3 N/m; contacts of 1 to 20 ms. Rubber returns another share of the
//!   speed than what is hard does: `restitution`, by default the nominal contact's.
//! - Signature (H8): extra impulse from the controller, which depends on its gains and on the follow-through.
//! - Confused with: restitution, tip friction, tracker smoothing (softens the corner at impact too).

use crate::contact_law::{COMPLIANCE_OF_ENGINES, ContactLaw, RESTITUTION, RESTITUTION_OF_ENGINES};
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, short};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "contact_compliance",
    stage: Stage::Hit,
    acts_on: Place::ToolContact,
    parameters: &[
        Parameter::size("compliance", "m/N", [0.0, 1e-3], 0.0).within(0.0, 1.0).of_engines(COMPLIANCE_OF_ENGINES),
        Parameter::form("restitution", "1", [0.02, 0.5], RESTITUTION)
            .within(0.0, 1.0)
            .of_engines(RESTITUTION_OF_ENGINES),
    ],
    confusable_with: &["restitution", "tip_friction", "tracker_smoothing"],
    separated: &[],
    install: |values, effects| {
        let [compliance, restitution] = ["compliance", "restitution"].map(|name| values.number(name));
        effects.hit.contact_compliance = Some(ContactCompliance { compliance, restitution });
    },
    remedy: |found| {
        let compliance = found.number("compliance");
        let stiffness =
            if compliance > 0.0 { format!(", a spring of {} N/m", short(compliance.recip())) } else { String::new() };
        Remedy::new(
            format!(
                "Tighten tip and tool and look for a soft cap: the contact yields by {} mm for 100 N more than it should.",
                short(1e5 * compliance)
            ),
            format!(
                "A softer contact of tip and object: {} m/N in series with what it has{stiffness} (MuJoCo: a longer time constant in solref; SDF: a lower <kp>).",
                short(compliance)
            ),
        )
    },
    model: |found| {
        let [compliance, restitution] = ["compliance", "restitution"].map(|name| found.number(name));
        vec![Change::Compliance(compliance), Change::Restitution(restitution)]
    },
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct ContactCompliance {
    compliance: f64,
    restitution: f64,
}

impl ContactCompliance {
    pub(super) fn apply(&self, law: &mut ContactLaw) {
        law.yield_by(self.compliance);
        law.restitution = self.restitution;
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_hit::effects;
    use crate::contact_law::ContactLaw;

    #[test]
    fn a_compliance_equal_to_the_nominal_one_halves_the_stiffness() {
        let nominal = ContactLaw::nominal(0.2);
        let block = format!("[[effect]]\nname = \"contact_compliance\"\ncompliance = {:?}", 1.0 / nominal.stiffness);
        let law = effects(&block).real_law(nominal);
        assert!((law.stiffness / nominal.stiffness - 0.5).abs() < 1e-12, "{}", law.stiffness);
        assert_eq!(law, ContactLaw { stiffness: law.stiffness, ..nominal });
    }
}
