//! Moments of an episode side by side, as one picture.

use crate::rollout::Still;
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::{RigidPose, pack_picture};
use twin::task::{Task, TaskCamera};

/// Columns of each picture.
const WIDE: u32 = 150;

/// A PNG file of the moments through the task's first camera; `None` for a task without one, or without moments.
pub fn strip(task: &Task, stills: &[Still]) -> Option<Vec<u8>> {
    let camera = smaller(task.cameras().first()?);
    let [width, height] = camera.size.map(|pixels| pixels as usize);
    let mut view = task.view(&camera);
    let columns = width * stills.len();
    let mut pixels = vec![0; 3 * columns * height];
    for (i, still) in stills.iter().enumerate() {
        let pose = |[x, y, z, w, i, j, k]: [f64; 7]| RigidPose { position: [x, y, z], wxyz: [w, i, j, k] };
        let poses: Vec<RigidPose> = still.poses.iter().map(|values| pose(values.map(f64::from))).collect();
        let picture = view.draw(&poses, still.arm.as_ref());
        for (row, line) in picture.colour.chunks_exact(3 * width).enumerate() {
            let at = 3 * (row * columns + i * width);
            pixels[at..at + 3 * width].copy_from_slice(line);
        }
    }
    pack_picture(PixelEncoding::Rgb8, u32::try_from(columns).ok()?, camera.size[1], &pixels).ok()
}

fn smaller(camera: &TaskCamera) -> TaskCamera {
    let share = f64::from(WIDE) / f64::from(camera.size[0]);
    let rows = (share * f64::from(camera.size[1])).round().max(1.0) as u32;
    TaskCamera { size: [WIDE, rows], focal: share * camera.focal, ..camera.clone() }
}
