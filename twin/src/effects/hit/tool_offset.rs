//! The tip is not where cell.toml says.
//!
//! - Equation: `tool_real = flange + offset` in the flange frame; the arm's bodies stay.
//! - Source: mounting and tool-centre calibration errors.
//! - Unit: m. Plausible: -0.02 to 0.02 (0.005 after calibration).
//! - Signature (H6, H7): spin after the hit in proportion to the speed; contact earlier or later.
//! - Confused with: tip friction, encoder offset, camera extrinsics.

use crate::effects::registry::{EffectInfo, Parameter, Place, Stage};
use nalgebra::Translation3;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "tool_offset",
    stage: Stage::Hit,
    acts_on: Place::ToolContact,
    parameters: &[Parameter::size("offset", "m", [-0.02, 0.02], 0.0).vector(3).within(-1.0, 1.0)],
    confusable_with: &["tip_friction", "joint_encoder_offset", "camera_extrinsic_translation"],
    install: |values, effects| effects.hit.tool_offset = Some(ToolOffset { offset: values.vector("offset") }),
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct ToolOffset {
    offset: [f64; 3],
}

impl ToolOffset {
    pub(super) fn shift(&self) -> Translation3<f64> {
        Translation3::from(self.offset)
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_hit::{first_contact, flange_rotation};
    use nalgebra::Vector3;

    #[test]
    fn a_tip_that_stands_out_ahead_touches_while_the_arm_is_still_that_far_away() {
        let ahead = flange_rotation().inverse() * Vector3::new(0.0, 0.005, 0.0);
        let block =
            format!("[[effect]]\nname = \"tool_offset\"\noffset = [{:?}, {:?}, {:?}]", ahead.x, ahead.y, ahead.z);
        let ((nominal, speed), (shifted, _)) = (first_contact(""), first_contact(&block));
        let gained = nominal.y - shifted.y;
        assert!((gained - 0.005).abs() < 1.5e-3 * speed, "{gained} m at {speed} m/s");
    }
}
