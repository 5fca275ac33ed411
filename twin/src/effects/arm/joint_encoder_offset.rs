//! The encoders' zeros are off.
//!
//! - Equation: `q_measured = q + offset`. The controller sees the measured position, and so does its gravity compensation.
//! - Source: kinematic calibration literature; a Franka's joints repeat to 0.1 mrad and are off by up to some mrad.
//! - Unit: rad. Plausible: -0.02 to 0.02 (3e-3 on a calibrated arm).
//! - Signature (C21): the tip is off by a fixed amount in joint space; the encoders themselves never tell.
//! - Confused with: camera extrinsics, tool offset, joint elasticity (follows the load).

use super::effect::ArmEffect;
use crate::arm::Joints;
use crate::effects::change::Change;
use crate::effects::info::{EffectInfo, Place, Stage};
use crate::effects::parameter::Parameter;
use crate::effects::remedy::{Remedy, degrees, short};

pub(in crate::effects) const EFFECT: EffectInfo = EffectInfo {
    name: "joint_encoder_offset",
    stage: Stage::Control,
    acts_on: Place::JointSensing,
    parameters: &[Parameter::size("offset", "rad", [-0.02, 0.02], 0.0).per_joint().moves_tip_unseen()],
    confusable_with: &["camera_extrinsic_rotation", "camera_extrinsic_translation", "tool_offset", "joint_elasticity"],
    separated: &[],
    install: |values, effects| {
        effects.arm.joint_encoder_offset = Some(JointEncoderOffset { offset: values.joints("offset") });
    },
    remedy: |found| {
        let reads = found.joints_by("offset", &|offset| format!("{} rad ({})", short(offset), degrees(offset)));
        Remedy::new(
            format!("Set the joints' zeros anew: take off the readings {reads}."),
            format!("Add to the measured joint positions {reads}; the simulated joints themselves stay."),
        )
    },
    model: |found| vec![Change::EncoderOffset(found.all("offset"))],
};

#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::effects) struct JointEncoderOffset {
    pub(super) offset: Joints,
}

impl ArmEffect for JointEncoderOffset {}

#[cfg(test)]
mod tests {
    use super::super::test_arm::{effects, joint};
    use crate::arm::JointState;

    #[test]
    fn the_arm_is_where_the_reading_less_the_offset_says() {
        let effects = effects("[[effect]]\nname = \"joint_encoder_offset\"\noffset = 0.25");
        let reading = JointState { q: [0.75; 8], dq: [0.5; 8] };
        let (state, memory) = effects.start(&joint(0.07), &reading, &reading.q, &reading.dq);
        assert_eq!((state.q[0], state.dq[0]), (0.5, 0.5));
        assert_eq!(effects.measured(&memory, &state), reading);
    }
}
