//! The tip grips the object more or less than assumed.
//!
//! - Equation: `|F_t| <= (mu_tip + change) F_n`, never below 0.
//! - Source: Coulomb.
//! - Unit: 1. Plausible: -0.3 to 0.3.
//! - Signature (H5): oblique hits deflect and spin the object more or less, up to a limit.
//! - Confused with: tool offset (turns off-centre hits), restitution.

use crate::contact_law::ContactLaw;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, short};
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "tip_friction",
    stage: Stage::Hit,
    acts_on: Place::ToolContact,
    parameters: &[Parameter::size("change", "1", [-0.3, 0.3], 0.0).within(-10.0, 10.0)],
    confusable_with: &["tool_offset", "restitution", "object_inertia"],
    separated: &[Separation {
        from: "tool_offset",
        by: "straight hits with the object turned by 0, 90 and 180 degrees, and one with the tool turned about its own axis",
        record: &[Experiment::ObjectTurned, Experiment::StrokeAgainToolTurned],
    }],
    install: |values, effects| effects.hit.tip_friction = Some(TipFriction { change: values.number("change") }),
    remedy: |found| {
        let change = found.number("change");
        let (verb, size) = (if change < 0.0 { "lower" } else { "raise" }, short(change.abs()));
        Remedy::new(
            format!("Clean or renew the tip; otherwise {verb} tip_friction under [object] in theta.toml by {size}."),
            format!("{} the friction between tip and object by {size}.", if change < 0.0 { "Lower" } else { "Raise" }),
        )
    },
    model: |found| vec![Change::TipFriction(found.number("change"))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct TipFriction {
    change: f64,
}

impl TipFriction {
    pub(super) fn apply(&self, law: &mut ContactLaw) {
        law.friction = (law.friction + self.change).max(0.0);
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_hit::effects;
    use crate::contact_law::ContactLaw;

    #[test]
    fn it_adds_to_the_known_friction_and_never_makes_it_negative() {
        let law = |change: &str| {
            let block = format!("[[effect]]\nname = \"tip_friction\"\nchange = {change}");
            effects(&block).real_law(ContactLaw::nominal(0.25)).friction
        };
        assert_eq!((law("0.25"), law("-0.125"), law("-0.3")), (0.5, 0.125, 0.0));
    }
}
