//! Free fall against gravity: another acceleration is a scale of the poses or a clock.

use super::columns::Columns;
use super::limits::{CLEAR, FALL_FITS, FALL_OFF, FALL_POSES, FALL_SIGMAS, FALL_SURE};
use super::remark::{Fault, Remark, Size};
use super::statistics::median;
use inference::likelihood::arm::noise;
use nalgebra::{Matrix3, Point3, Vector3};
use shared_mem::cell::{Cell, ClipKind, GRAVITY};

/// One sigma of a normal variable's median over its median distance from it, times the root of the number of values.
const MEDIAN_SIGMA: f64 = 1.4826 * 1.2533;

/// The fall of a clip.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Fall {
    /// Acceleration downwards [m/s²].
    pub(super) acceleration: f64,
    /// One sigma of it.
    pub(super) sigma: f64,
    /// First and last pose.
    pub(super) poses: [usize; 2],
    /// Height by time from the first pose: `a + b t + c t²`.
    pub(super) curve: [f64; 3],
}

impl Fall {
    /// How many sigmas the acceleration is from none.
    fn sure(&self) -> f64 {
        self.acceleration / self.sigma
    }
}

/// The stretch of a clip that shows most surely how an object falls that was let go.
pub(super) fn of(clip: &Columns, cell: &Cell, corners: &[Point3<f64>]) -> Option<Fall> {
    if clip.kind != ClipKind::FreeMotion {
        return None;
    }
    let reach = corners.iter().map(|c| c.coords.norm()).fold(0.0, f64::max) + CLEAR;
    let table = cell.table.as_ref().map_or(f64::NEG_INFINITY, |table| table.height);
    let z: Vec<f64> = clip.object.poses.iter().map(|pose| pose.position()[2]).collect();
    let flies = |i: &usize| z[*i] - table > reach;
    let known = cell.object().and_then(|o| o.pose_noise).map_or(0.0, |noise| noise.position);
    let sigma = noise::sigma(&z).max(0.3 * known).max(1e-5);
    let mut best: Option<Fall> = None;
    let mut from = 0;
    while from < z.len() {
        let to = from + (from..z.len()).take_while(flies).count();
        if let Some(fall) = longest(&clip.pose_t, &z, from, to, sigma)
            && best.as_ref().is_none_or(|known| fall.sure() > known.sure())
        {
            best = Some(fall);
        }
        from = to + 1;
    }
    best
}

/// The longest part of a stretch that a parabola fits: from its beginning, a quarter in, or half in, where a hand let go later.
fn longest(t: &[f64], z: &[f64], from: usize, to: usize, sigma: f64) -> Option<Fall> {
    let length = to - from;
    let starts = [0, length / 8, length / 4, length / 2].map(|skip| from + skip);
    let fits = |start: usize| {
        let lengths = (FALL_POSES..=to.saturating_sub(start)).rev();
        lengths.filter_map(|n| parabola(t, z, start, start + n, sigma)).next()
    };
    starts.into_iter().filter_map(fits).max_by(|a, b| a.sure().total_cmp(&b.sure()))
}

fn parabola(t: &[f64], z: &[f64], from: usize, to: usize, sigma: f64) -> Option<Fall> {
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    let powers = |i: usize| {
        let t = t[i] - t[from];
        Vector3::new(1.0, t, t * t)
    };
    for (i, height) in z.iter().enumerate().take(to).skip(from) {
        let p = powers(i);
        normal += p * p.transpose();
        right += p * *height;
    }
    let inverse = normal.try_inverse()?;
    let c = inverse * right;
    let left = (from..to).map(|i| (z[i] - powers(i).dot(&c)).powi(2)).sum::<f64>() / (to - from - 3) as f64;
    if left > FALL_FITS * sigma * sigma {
        return None;
    }
    let sigma = 2.0 * (inverse[(2, 2)] * left.max(0.25 * sigma * sigma)).sqrt();
    Some(Fall { acceleration: -2.0 * c[2], sigma, poses: [from, to - 1], curve: [c[0], c[1], c[2]] })
}

/// The falls of a session, together: what one clip tells is a few poses.
pub(super) fn remarks(clips: &[(&Columns, Fall)]) -> Option<Remark> {
    let sure: Vec<&(&Columns, Fall)> = clips.iter().filter(|(_, fall)| fall.sure() > FALL_SURE).collect();
    let first = sure.first()?;
    let values: Vec<f64> = sure.iter().map(|(_, fall)| fall.acceleration).collect();
    // The median: what rolls over an edge curves, too.
    let value = median(values.clone());
    let count = (values.len() as f64).sqrt();
    let scatter = MEDIAN_SIGMA * median(values.iter().map(|v| (v - value).abs()).collect()) / count;
    let own = median(sure.iter().map(|(_, fall)| fall.sigma).collect()) / count;
    let sigma = own.max(scatter);
    let off = value - GRAVITY;
    if off.abs() < FALL_OFF * GRAVITY || off.abs() < FALL_SIGMAS * sigma {
        return None;
    }
    let ratio = value / GRAVITY;
    let mut remark = Remark::new(
        Fault::FreeFall,
        &first.0.file,
        "object poses",
        format!(
            "what is let go falls with {value:.2} m/s\u{b2} (median of {} clips): lengths are {ratio:.3} times too long, or times \
             {:.3} times too short",
            values.len(),
            ratio.abs().sqrt()
        ),
    )
    .sized(Size { value, interval: [value - 1.96 * sigma, value + 1.96 * sigma], unit: "m/s^2" })
    .mended_by("measure a known length in the poses: if it is right, the stamps' clock is not, else the tracker's scale");
    remark.clips = sure.iter().map(|(clip, _)| clip.file.clone()).collect();
    Some(remark)
}
