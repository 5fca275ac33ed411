//! Where the object's outline lies in the picture, along short lines across the outline it would have in a pose.
//!
//! Each pixel of a line speaks for object or surroundings, by colour and by depth. For every place where the line could
//! be cut into object and surroundings the evidence is summed; mean and spread of that distribution are the measurement.
//! Source: Stoiber et al., *Iterative Corresponding Geometry: Fusing Region and Depth for Highly Efficient 3D Tracking of
//! Textureless Objects*, CVPR 2022, 3.2, with discrete cuts instead of smoothed ones and depth as further evidence.

use super::colors::Colors;
use super::patch::Patch;
use super::table::Table;
use nalgebra::{Vector2, Vector3};

/// Longest half of a line [pixel].
pub(super) const LONGEST: usize = 14;
/// Lines for one fit, at most: neighbours say nearly the same.
const LINES: usize = 240;
/// Depth of a pixel at an edge says no more than this, as a logarithm of odds: a stereo camera widens what is near.
const MOST_FROM_DEPTH: f32 = 0.4;
/// The same while colours are not known.
const ONLY_DEPTH: f32 = 2.5;
/// Variance of a cut beside the distribution's own [pixel²]: whole pixels, and what neighbours share.
const GRAIN: f64 = 0.5;

/// One line's measurement.
#[derive(Debug, Clone, Copy)]
pub(super) struct Crossing {
    /// Point of the object on its outline, camera frame [m].
    pub(super) point: Vector3<f64>,
    /// Outwards, in the picture.
    pub(super) normal: Vector2<f64>,
    /// How far the outline seen lies outside of the one drawn [pixel].
    pub(super) off: f64,
    /// Variance of that [pixel²].
    pub(super) variance: f64,
}

/// Looks across the drawn object's outline, `reach` pixels to both sides. Lines that say nothing are left out.
pub(super) fn crossings(patch: &Patch, table: &Table, colors: &Colors, reach: usize) -> Vec<Crossing> {
    let reach = reach.min(LONGEST);
    let outline = outline(patch);
    let every = outline.len().div_ceil(LINES).max(1);
    outline.iter().step_by(every).filter_map(|at| crossing(patch, table, colors, *at, reach)).collect()
}

/// Pixels of the drawn object with a neighbour beside it.
fn outline(patch: &Patch) -> Vec<[usize; 2]> {
    let (drawn, width) = (patch.drawn(), patch.width);
    let mut found = Vec::with_capacity(512);
    for v in 1..patch.height - 1 {
        let row = &drawn[v * width..(v + 1) * width];
        for u in 1..width - 1 {
            if row[u] > 0.0 {
                let at = v * width + u;
                let beside = [row[u - 1], row[u + 1], drawn[at - width], drawn[at + width]];
                if beside.contains(&0.0) {
                    found.push([u, v]);
                }
            }
        }
    }
    found
}

fn crossing(patch: &Patch, table: &Table, colors: &Colors, [u, v]: [usize; 2], reach: usize) -> Option<Crossing> {
    let normal = outwards(patch, u, v)?;
    let inverse_depth = patch.drawn()[v * patch.width + u];
    let step = reach as i32;
    let mut along = [0.0_f32; 2 * LONGEST + 1];
    let (mut drawn_cut, mut blind) = (None, 0);
    for k in -step..=step {
        let (x, y) = (u as f64 + f64::from(k) * normal.x, v as f64 + f64::from(k) * normal.y);
        let (x, y) = (x.round(), y.round());
        if x < 0.0 || y < 0.0 || x >= patch.width as f64 || y >= patch.height as f64 {
            return None;
        }
        let (x, y) = (x as usize, y as usize);
        if k > 0 && drawn_cut.is_none() && patch.drawn()[y * patch.width + x] == 0.0 {
            drawn_cut = Some(k);
        }
        let says = evidence(patch, table, colors, x, y, inverse_depth);
        blind += i32::from(says.is_none());
        along[(k + step) as usize] = says.unwrap_or(0.0);
    }
    // The cut lies before the pixel of its number.
    let (mean, variance) = cut(&along[..=2 * reach]);
    let off = mean - f64::from(step) - f64::from(drawn_cut?);
    let z = 1.0 / f64::from(inverse_depth);
    let sharp = variance < (reach * reach) as f64 / 6.0 && 3 * blind < 2 * step + 1;
    sharp.then(|| Crossing { point: patch.ray(u, v).cast::<f64>() * z, normal, off, variance: variance + GRAIN })
}

/// The direction in the picture in which the drawn object ends.
fn outwards(patch: &Patch, u: usize, v: usize) -> Option<Vector2<f64>> {
    const AROUND: usize = 3;
    if u < AROUND || v < AROUND || u + AROUND >= patch.width || v + AROUND >= patch.height {
        return None;
    }
    let mut sum = Vector2::zeros();
    for y in v - AROUND..=v + AROUND {
        for x in u - AROUND..=u + AROUND {
            if patch.drawn()[y * patch.width + x] == 0.0 {
                sum += Vector2::new(x as f64 - u as f64, y as f64 - v as f64);
            }
        }
    }
    let length = sum.norm();
    (length > 3.0).then(|| sum / length)
}

/// How much a pixel speaks for the object, whose inverse depth at the outline is `object`; `None` where something is in
/// the way.
fn evidence(patch: &Patch, table: &Table, colors: &Colors, u: usize, v: usize, object: f32) -> Option<f32> {
    let at = v * patch.width + u;
    if patch.arm[at] > 0.0 {
        return None;
    }
    let seen = patch.seen[at];
    let color = colors.odds(patch.bins[at]);
    if seen == 0.0 {
        return Some(color);
    }
    let sigma = 1.5 * table.noise + 0.003 * object * object;
    let (beyond, from_table) = ((seen - object) / sigma, (seen - patch.behind(table, u, v)) / sigma);
    if beyond > 6.0 {
        return None;
    }
    let most = if colors.are_known() { MOST_FROM_DEPTH } else { ONLY_DEPTH };
    let depth = 0.5 * (from_table * from_table - beyond * beyond);
    Some(color + depth.clamp(-most, most))
}

/// Mean and variance of the place of the cut, counted in pixels from the line's beginning.
fn cut(evidence: &[f32]) -> (f64, f64) {
    let mut sums = [0.0_f64; 2 * LONGEST + 2];
    let (mut sum, mut most) = (0.0, 0.0_f64);
    for (place, says) in evidence.iter().enumerate() {
        sum += f64::from(*says);
        sums[place + 1] = sum;
        most = most.max(sum);
    }
    let (mut weight, mut first, mut second) = (0.0, 0.0, 0.0);
    for (place, sum) in sums[..=evidence.len()].iter().enumerate() {
        let likely = (sum - most).exp();
        weight += likely;
        first += likely * place as f64;
        second += likely * (place * place) as f64;
    }
    let mean = first / weight;
    (mean, (second / weight - mean * mean).max(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cut_lies_where_the_evidence_turns_and_is_vague_without_any() {
        let clear: Vec<f32> = (0..20).map(|i| if i < 7 { 2.0 } else { -2.0 }).collect();
        let (mean, variance) = cut(&clear);
        assert!((mean - 7.0).abs() < 1e-6 && variance < 0.4, "{mean} {variance}");
        let (mean, variance) = cut(&[0.0; 20]);
        assert!((mean - 10.0).abs() < 1e-9 && variance > 30.0, "{mean} {variance}");
    }
}
