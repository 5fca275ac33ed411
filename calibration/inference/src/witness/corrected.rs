//! Clips as they would have been recorded without the effects on camera, tool and encoders that are given. An effect that moves what a
//! stage measures in another way (friction, gains) is none of its business.

use super::reported::Off;
use nalgebra::{Isometry3, Translation3, Vector3};
use shared_mem::cell::Cell;
use shared_mem::msg::joints_from;
use shared_mem::recording::{Clip, JointSeries};
use shared_mem::theta::Theta;
use twin::arm::{ArmModel, Joints};
use twin::effects::Effects;
use twin::replay::in_model_order;

/// A clip's poses and joints.
pub(super) struct Corrected {
    /// When each pose was [ns].
    pub(super) stamps_ns: Vec<u64>,
    /// Of the object, base frame.
    pub(super) poses: Vec<Isometry3<f64>>,
    measured: JointSeries,
    /// What the encoders read beside the joints' positions [rad].
    encoder_offset: Joints,
    /// From the tip of cell.toml to where it is, in the flange frame.
    tool: Translation3<f64>,
}

impl Corrected {
    /// The flange at a time, between two measured rows on the straight way; with the tool's offset, so that the tool of cell.toml stands
    /// where the tool is. `None` outside of what was measured.
    pub(super) fn flange(&self, arm: &ArmModel, at_ns: f64) -> Option<Isometry3<f64>> {
        let stamps = &self.measured.stamps_ns;
        let after = stamps.partition_point(|stamp| (*stamp as f64) < at_ns);
        if after == 0 || after >= stamps.len() {
            return None;
        }
        let [low, high] = [after - 1, after].map(|row| joints_from(self.measured.q_row(row)));
        let [from, to] = [after - 1, after].map(|row| stamps[row] as f64);
        let share = (at_ns - from) / (to - from);
        let q: Joints = std::array::from_fn(|j| low[j] + share * (high[j] - low[j]) - self.encoder_offset[j]);
        Some(arm.flange(&q).isometry() * self.tool)
    }
}

/// The clip without the effects of `known`; `None` where the cell has no arm, or the clip is of another.
pub(super) fn corrected(cell: &Cell, clip: &Clip, known: &Theta) -> Option<Corrected> {
    let arm = ArmModel::from_cell(cell).ok()?;
    let effects = Effects::from_theta(&known.effects, arm.dof()).ok()?;
    let clip = in_model_order(clip.clone(), &arm).ok().filter(|clip| !clip.measured.is_empty())?;
    let shift = |sum: Vector3<f64>, by: Vec<f64>| sum + Vector3::from_iterator(by.into_iter().chain([0.0; 3]).take(3));
    let tool = Off::Tip.known(known).into_iter().fold(Vector3::zeros(), shift);
    let mut encoder_offset: Joints = joints_from(&[]);
    for offsets in Off::Encoders.known(known) {
        // One number stands for all joints.
        let of_joint = |joint: usize| offsets.get(joint).or(offsets.first()).copied().unwrap_or(0.0);
        (0..arm.dof()).for_each(|joint| encoder_offset[joint] += of_joint(joint));
    }
    // A tracker that follows at a constant speed is behind by its time constant.
    let late_ns = (1e9 * Off::Late.known(known).into_iter().flatten().sum::<f64>()) as u64;
    let poses = clip.object.poses.iter().map(|pose| effects.camera.undistorted(&pose.isometry())).collect();
    let stamps_ns = clip.object.stamps_ns.iter().map(|stamp| stamp.saturating_sub(late_ns)).collect();
    Some(Corrected { stamps_ns, poses, measured: clip.measured, encoder_offset, tool: tool.into() })
}
