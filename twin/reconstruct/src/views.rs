//! Views as all reconstructions read them: all at once, those that are blurred left out, every eighth held out.

use crate::remark::Remark;
use crate::scan::{Frame, Scan, ScanError};
use rayon::prelude::*;
use shared_mem::ending;
use shared_mem::statistics::robust_sigma;
use std::sync::atomic::{AtomicU64, Ordering};

/// Every so many views one is held out.
const HOLD_OUT: usize = 8;
/// A view is blurred whose detail is so much weaker than the middle of all views'.
const BLURRED: f64 = 0.25;

/// Whether a view takes no part and shows how good the result is.
pub(crate) fn is_held_out(number: usize) -> bool {
    number % HOLD_OUT == HOLD_OUT / 2
}

/// Reads all views by `read`, which is given the view and how many pixels in each direction become one, so that no picture has an edge
/// of more than `longest`. `done` is called with the number of views that are read.
pub(crate) fn read_all(
    scan: &Scan,
    longest: u32,
    read: impl Fn(usize, u32) -> Result<Frame, ScanError> + Sync,
    done: impl Fn(u64) + Sync,
) -> Result<Vec<Frame>, ScanError> {
    let count = AtomicU64::new(0);
    let one = |view: usize| -> Result<Frame, ScanError> {
        if ending::asked() {
            return Err(ScanError::Interrupted);
        }
        let camera = &scan.views[view].camera;
        let frame = read(view, camera.width.max(camera.height).div_ceil(longest))?;
        done(count.fetch_add(1, Ordering::Relaxed) + 1);
        Ok(frame)
    };
    (0..scan.views.len()).into_par_iter().map(one).collect()
}

/// The names of the first of some frames.
pub(crate) fn named(frames: &[Frame]) -> String {
    let names: Vec<&str> = frames.iter().take(3).map(|frame| frame.name.as_str()).collect();
    let rest = if frames.len() > 3 { ", ..." } else { "" };
    format!("{}{rest}", names.join(", "))
}

/// The frames without those that have far less detail than the others.
pub(crate) fn without_blurred(frames: Vec<Frame>, remarks: &mut Vec<Remark>) -> Vec<Frame> {
    let detail: Vec<f64> = frames.par_iter().map(detail).collect();
    // The upper of two middle values, no mean of both: where half of the views are blurred, the sharp half decides.
    let mut sorted = detail.clone();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.get(sorted.len() / 2).copied().unwrap_or(0.0);
    let mut blurred = Vec::new();
    let mut kept = Vec::new();
    for (frame, detail) in frames.into_iter().zip(detail) {
        if detail < BLURRED * middle { blurred.push(frame) } else { kept.push(frame) }
    }
    if !blurred.is_empty() {
        let names = named(&blurred);
        remarks.push(Remark(format!("{} views are blurred and were left out: {names}", blurred.len())));
    }
    kept
}

/// Brightness of a pixel, 0 to 255.
pub(crate) fn grey(rgb: [u8; 3]) -> f64 {
    f64::from(u32::from(rgb[0]) + u32::from(rgb[1]) + u32::from(rgb[2])) / 3.0
}

/// Mean absolute Laplacian of the brightness within the mask: what a blurred picture has little of.
fn detail(frame: &Frame) -> f64 {
    let width = frame.camera.width as usize;
    let (mut sum, mut count) = (0.0, 0usize);
    for at in width..frame.rgb.len() - width {
        let around = [at - width, at - 1, at + 1, at + width];
        if frame.mask[at] && around.iter().all(|n| frame.mask[*n]) {
            let mean: f64 = around.iter().map(|n| grey(frame.rgb[*n])).sum::<f64>() / 4.0;
            sum += (grey(frame.rgb[at]) - mean).abs();
            count += 1;
        }
    }
    sum / count.max(1) as f64
}

/// Standard deviation of depth at one metre, growing with the square of the distance: from how single pixels differ from those on
/// both sides; `None` where too few pixels have depth.
pub(crate) fn spread(frames: &[Frame]) -> Option<f64> {
    let mut off = Vec::new();
    for frame in frames.iter().filter(|frame| !frame.depth.is_empty()) {
        for (number, three) in frame.depth.windows(3).enumerate().step_by(7) {
            let bend = 0.5 * (three[0] + three[2]) - three[1];
            let smooth = three.iter().all(|z| *z > 0.0) && (three[0] - three[2]).abs() < 0.02 * three[1];
            if smooth && frame.mask[number + 1] {
                // Of three equal variances.
                off.push(f64::from(bend.abs() / (three[1] * three[1])) / 1.5f64.sqrt());
            }
        }
    }
    if off.len() < 100 {
        return None;
    }
    robust_sigma(off).map(|sigma| sigma.clamp(2e-4, 0.05))
}
