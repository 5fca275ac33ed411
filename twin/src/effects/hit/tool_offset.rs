//! The tip is not where cell.toml says.
//!
//! - Equation: `tool_real = flange + offset` in the flange frame. With `carried` 1 the tool's mass stands there too, so the
//!   arm feels it; with 0, the default, the arm's bodies stay, as where only the tip's measured place is off.
//! - Source: mounting and tool-centre calibration errors.
//! - Units: offset m, carried 1. Plausible: -0.02 to 0.02 (0.005 after calibration).
//! - Signature (H6, H7): spin after the hit in proportion to the speed; contact earlier or later; with the mass, what a
//!   payload does to the joints, by the tool's weight over the offset.
//! - Confused with: tip friction, encoder offset, camera extrinsics.

use crate::arm::ArmModel;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::{Parameter, Search};
use crate::effects::remedy::{Remedy, list, short};
use nalgebra::{Translation3, Vector3};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "tool_offset",
    stage: Stage::Hit,
    acts_on: Place::ToolContact,
    parameters: &[
        Parameter::size("offset", "m", [-0.02, 0.02], 0.0).vector(3).within(-1.0, 1.0),
        Parameter::form("carried", "1", [0.0, 1.0], 0.0)
            .within(0.0, 1.0)
            .searched(Search::Held)
            .begun_at(&[&[0.0], &[1.0]])
            .felt_by_arm(),
    ],
    confusable_with: &["tip_friction", "joint_encoder_offset", "camera_extrinsic_translation"],
    separated: &[],
    install: |values, effects| {
        let effect = ToolOffset { offset: values.vector("offset"), carried: values.number("carried") };
        effects.hit.tool_offset = Some(effect);
        effects.arm.tool_offset = effect.moves_mass().then_some(effect);
    },
    remedy: |found| {
        let offset: [f64; 3] = found.vector("offset");
        let length = found.cell().tool.as_ref().map(|tool| tool.length);
        let set = length.map_or_else(String::new, |length| {
            format!(" (along z it is enough to set length = {} under [tool] in cell.toml)", short(length + offset[2]))
        });
        let place = list(&offset.map(|x| 1e3 * x));
        Remedy::new(
            format!(
                "Mount the tool anew, or measure its tip: it sits {place} mm along x, y, z of the flange frame beside where cell.toml has it{set}."
            ),
            format!("Move the tool by {} m in the flange frame.", list(&offset)),
        )
    },
    model: |found| vec![Change::ToolShift { offset: found.vector("offset"), carried: found.number("carried") }],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct ToolOffset {
    offset: [f64; 3],
    /// The share of the tool's mass that stands at the offset.
    carried: f64,
}

impl ToolOffset {
    pub(super) fn shift(&self) -> Translation3<f64> {
        Translation3::from(self.offset)
    }

    fn moves_mass(&self) -> bool {
        self.carried != 0.0 && self.offset != [0.0; 3]
    }

    pub(in crate::effects) fn apply(&self, arm: &mut ArmModel) {
        arm.shift_tool(Vector3::from(self.offset) * self.carried);
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_hit::{all_effects, first_contact, flange_rotation, striking};
    use crate::arm::PointForce;
    use nalgebra::{Point3, Vector3};

    #[test]
    fn a_tip_that_stands_out_ahead_touches_while_the_arm_is_still_that_far_away() {
        let ahead = flange_rotation().inverse() * Vector3::new(0.0, 0.005, 0.0);
        let block =
            format!("[[effect]]\nname = \"tool_offset\"\noffset = [{:?}, {:?}, {:?}]", ahead.x, ahead.y, ahead.z);
        let ((nominal, speed), (shifted, _)) = (first_contact(""), first_contact(&block));
        let gained = nominal.y - shifted.y;
        assert!((gained - 0.005).abs() < 1.5e-3 * speed, "{gained} m at {speed} m/s");
    }

    #[test]
    fn a_tool_that_stands_off_with_its_mass_weighs_on_the_joints_and_one_without_does_not() {
        let (cell, arm) = striking();
        let (mass, q) = (cell.tool.expect("a tool").mass, *arm.ready());
        let gravity = |carried: f64| {
            let block =
                format!("[[effect]]\nname = \"tool_offset\"\noffset = [0.006, -0.004, 0.0]\ncarried = {carried:?}");
            all_effects(&block).arm.real_arm(&arm).gravity(&q)
        };
        assert_eq!(gravity(0.0), arm.gravity(&q));
        // Statics: the tool's weight at a lever that has grown by the offset.
        let flange = arm.flange(&q).isometry();
        let weight = [0.0, 0.0, -9.81 * mass];
        let at = |point: Point3<f64>| arm.torque_of(&q, &PointForce { point: (flange * point).into(), force: weight });
        let (near, far) = (at(Point3::origin()), at(Point3::new(0.006, -0.004, 0.0)));
        for (joint, more) in gravity(1.0).iter().enumerate().take(7) {
            let (added, expected) = (more - arm.gravity(&q)[joint], near[joint] - far[joint]);
            assert!((added - expected).abs() < 1e-12, "joint {joint}: {added} instead of {expected}");
        }
    }
}
