//! The object is harder or easier to turn than a homogeneous body.
//!
//! - Equation: `I_zz = factor I_zz,homogeneous` about the object's z axis through the centre of mass.
//! - Source: rigid-body dynamics; a hollow box has up to 1.7, a core in the middle less than 1.
//! - Unit: 1. Plausible: 0.4 to 2.
//! - Signature (H11): less or more spin after an off-centre hit, and a spin that lasts longer or shorter.
//! - Confused with: tool offset and tip friction (spin after the hit), pressure distribution (decay of spin).

use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, short};
use crate::effects::separation::{Experiment, Separation};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "object_inertia",
    stage: Stage::Hit,
    acts_on: Place::Object,
    parameters: &[Parameter::size("factor", "1", [0.4, 2.0], 1.0).within(0.01, 100.0)],
    confusable_with: &["tool_offset", "tip_friction", "pressure_distribution"],
    separated: &[Separation {
        from: "pressure_distribution",
        by: "straight hits without spin and others beside the centre: inertia shows in the spin just after the hit, pressure in how it fades",
        record: &[Experiment::ObjectTurned, Experiment::Strokes],
    }],
    install: |values, effects| effects.hit.object_inertia = Some(ObjectInertia { factor: values.number("factor") }),
    remedy: |found| {
        let factor = short(found.number("factor"));
        Remedy::new(
            format!(
                "Nothing is broken: the object's mass lies otherwise than in a solid body, its inertia about the vertical is {factor} times that. Fix loose contents."
            ),
            format!("Multiply the object's inertia about its z axis (izz) by {factor}."),
        )
    },
    model: |found| vec![Change::YawInertia(found.number("factor"))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct ObjectInertia {
    pub(in crate::effects) factor: f64,
}

#[cfg(test)]
mod tests {
    use crate::effects::slide::test_slide::slid;

    #[test]
    fn a_spin_lasts_in_proportion_to_the_inertia() {
        let more = slid("[[effect]]\nname = \"object_inertia\"\nfactor = 1.5", 0.3, 0.0, 8.0, 1.0).1;
        let ratio = more / slid("", 0.3, 0.0, 8.0, 1.0).1;
        assert!((ratio - 1.5).abs() < 0.01, "{ratio}");
    }
}
