//! Tip or object are soft: the contact lasts longer and the arm pushes meanwhile.
//!
//! - Equation: `1 / k = 1 / k_nominal + compliance`.
//! - Source: springs in series; Hunt and Crossley 1975 for the law around it.
//! - Unit: m/N. Plausible: 0 to 1e-3, a stiffness down to 1e3 N/m; contacts of 1 to 20 ms.
//! - Signature (H8): extra impulse from the controller, which depends on its gains and on the follow-through.
//! - Confused with: restitution, tip friction, tracker smoothing (softens the corner at impact too).

use crate::effects::registry::{EffectInfo, Parameter, Place, Stage};
use crate::physics::hit::ContactLaw;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "contact_compliance",
    stage: Stage::Hit,
    acts_on: Place::ToolContact,
    parameters: &[Parameter::size("compliance", "m/N", [0.0, 1e-3], 0.0).within(0.0, 1.0)],
    confusable_with: &["restitution", "tip_friction", "tracker_smoothing"],
    install: |values, effects| {
        effects.hit.contact_compliance = Some(ContactCompliance { compliance: values.number("compliance") });
    },
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct ContactCompliance {
    compliance: f64,
}

impl ContactCompliance {
    pub(super) fn apply(&self, law: &mut ContactLaw) {
        law.stiffness = 1.0 / (1.0 / law.stiffness + self.compliance);
    }
}
