//! The tip is not where cell.toml says.
//!
//! - Equation: `tool_real = flange + offset` in the flange frame; the arm's bodies stay.
//! - Source: mounting and tool-centre calibration errors.
//! - Unit: m. Plausible: -0.005 to 0.005.
//! - Signature (H6, H7): spin after the hit in proportion to the speed; contact earlier or later.
//! - Confused with: tip friction, encoder offset, camera extrinsics.

use crate::effects::registry::{EffectInfo, Parameter, Place, Stage};
use nalgebra::Translation3;

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "tool_offset",
    stage: Stage::Hit,
    acts_on: Place::ToolContact,
    parameters: &[Parameter::size("offset", "m", [-0.005, 0.005], 0.0).vector(3).within(-1.0, 1.0)],
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
