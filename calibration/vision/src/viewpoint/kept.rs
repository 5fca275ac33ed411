//! What an interrupted search goes on from, and the question that it belongs to.

use super::fit::Fit;
use super::frame::Frame;
use super::interval::Interval;
use super::picture::Pixels;
use inference::kept::Fingerprint;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion};
use serde::{Deserialize, Serialize};
use shared_mem::cell::Cell;
use shared_mem::input;
use std::path::PathBuf;

/// What the pose depends on, wherever the answer goes. `asked`: what was asked for, and the lens; `beside`: masks and the picture without
/// the robot.
pub(super) fn question<'a>(
    asked: &str,
    cell: &Cell,
    beside: impl Iterator<Item = &'a PathBuf>,
    frames: &[Frame],
    pixels: &[Pixels],
) -> Fingerprint {
    let beside: Vec<_> = beside.map(|file| input::bytes(file, input::Kind::Picture).ok()).collect();
    let asked = Fingerprint::of("viewpoint").with(&asked).with_cell(cell).with(&beside);
    let joints = asked.with_numbers(frames.iter().flat_map(|frame| &frame.q));
    let shown = pixels.iter().flat_map(|picture| &picture.channels);
    shown.fold(joints, |print, channel| print.with(&channel.values.iter().map(|v| v.to_bits()).collect::<Vec<u32>>()))
}

/// A pose as it is kept: position [m], and orientation `w, x, y, z`.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct KeptPose([f64; 3], [f64; 4]);

impl KeptPose {
    pub(super) fn of(pose: &Isometry3<f64>) -> Self {
        let turn = pose.rotation;
        Self(pose.translation.vector.into(), [turn.w, turn.i, turn.j, turn.k])
    }

    pub(super) fn pose(self) -> Isometry3<f64> {
        let Self(position, [w, x, y, z]) = self;
        // It was one when it was kept, to the last bit.
        Isometry3::from_parts(position.into(), UnitQuaternion::new_unchecked(Quaternion::new(w, x, y, z)))
    }
}

/// What a place shows: the pose that fits best there, how badly it does, and how many times the robot was drawn.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
pub(super) struct Seen {
    pub(super) best: Option<(KeptPose, f64)>,
    pub(super) drawings: usize,
}

/// A [`Fit`] as it is kept.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(super) struct KeptFit {
    camera_from_base: KeptPose,
    loss: f64,
    confirmed: f64,
    rival: Option<f64>,
    interval: Option<Interval>,
    drawings: usize,
}

impl KeptFit {
    pub(super) fn of(fit: Fit) -> Self {
        let Fit { camera_from_base, loss, confirmed, rival, interval, drawings } = fit;
        Self { camera_from_base: KeptPose::of(&camera_from_base), loss, confirmed, rival, interval, drawings }
    }

    pub(super) fn fit(self) -> Fit {
        let Self { camera_from_base, loss, confirmed, rival, interval, drawings } = self;
        Fit { camera_from_base: camera_from_base.pose(), loss, confirmed, rival, interval, drawings }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fit_comes_back_to_the_last_bit() {
        let pose =
            Isometry3::from_parts([0.1, -0.2, 1.3].into(), UnitQuaternion::from_scaled_axis([0.3, 0.1, -2.0].into()));
        let fit =
            Fit { camera_from_base: pose, loss: 0.1, confirmed: 0.9, rival: Some(0.2), interval: None, drawings: 7 };
        let back = KeptFit::of(fit.clone()).fit();
        assert_eq!(format!("{back:?}"), format!("{fit:?}"));
    }
}
