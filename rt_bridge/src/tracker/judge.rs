//! Whether a pose is what the picture shows. Depth is averaged over small blocks first: a block's mean is sharp enough to
//! tell one face from another, where a single pixel is not.

use super::align::Scene;
use super::contour;
use super::patch::Patch;
use nalgebra::Isometry3;

/// Edge of a block [pixel].
const BLOCK: usize = 4;
/// Pixels of the object that must be seen, at least.
const MIN_PIXELS: u32 = 60;
/// A block with fewer pixels of the object says nothing.
const MIN_PIXELS_OF_BLOCK: u32 = 6;
/// A surface this far from where it is drawn is another one [m]: a D455's own error at a metre and a half.
const OTHER_SURFACE: f32 = 0.008;
/// Half length of the lines across the outline [pixel].
const REACH: usize = 8;

/// What speaks for a pose and against it.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Verdict {
    /// Pixels of the object in the picture, whatever covers it.
    pub(super) drawn: u32,
    /// Those measured where they are drawn.
    pub(super) agree: u32,
    /// Those where the picture looks through the object.
    pub(super) behind: u32,
    /// Those where something is in front.
    pub(super) covered: u32,
    /// Root mean square of how far the outline seen is from the one drawn [pixel]; large where none is seen.
    pub(super) outline_off: f64,
}

impl Verdict {
    /// From 0 (nothing fits) to 1.
    pub(super) fn score(&self) -> f64 {
        let measured = f64::from(self.agree + self.behind + self.covered / 2).max(1.0);
        f64::from(self.agree) / measured - 0.1 * self.outline_off.min(5.0)
    }

    /// Whether the object is there, and there is enough of it to say where.
    pub(super) fn holds(&self) -> bool {
        self.agree >= MIN_PIXELS
            && self.agree * 10 >= self.drawn
            && self.behind * 5 <= self.agree
            && self.outline_off < if self.behind * 20 <= self.agree { 2.5 } else { 1.8 }
    }

    /// Whether it fits so well that no other pose need be tried.
    pub(super) fn fits(&self) -> bool {
        self.holds() && self.behind * 12 <= self.agree && self.outline_off < 1.3
    }
}

impl Scene<'_> {
    /// Judges a pose.
    pub(super) fn judge(&self, patch: &mut Patch, camera_from_object: &Isometry3<f64>) -> Verdict {
        patch.draw(self.model, camera_from_object);
        let mut verdict = Verdict::default();
        for v in (0..patch.height).step_by(BLOCK) {
            for u in (0..patch.width).step_by(BLOCK) {
                self.judge_block(patch, u, v, &mut verdict);
            }
        }
        let (mut sum, mut weight) = (0.0, 0.0);
        for crossing in contour::crossings(patch, self.table, self.colors, REACH) {
            sum += crossing.off * crossing.off / crossing.variance;
            weight += 1.0 / crossing.variance;
        }
        verdict.outline_off = if weight > 10.0 { (sum / weight).sqrt() } else { 1.5 };
        verdict
    }

    fn judge_block(&self, patch: &Patch, u: usize, v: usize, verdict: &mut Verdict) {
        let (mut sum, mut count, mut drawn, mut depth) = (0.0, 0_u32, 0_u32, 0.0_f32);
        let (mut nearer, mut farther) = (0_u32, 0_u32);
        for y in v..(v + BLOCK).min(patch.height) {
            for x in u..(u + BLOCK).min(patch.width) {
                let at = y * patch.width + x;
                let m = patch.drawn()[at];
                if m == 0.0 {
                    continue;
                }
                drawn += 1;
                let seen = patch.seen[at];
                if seen == 0.0 || patch.arm[at] > m {
                    continue;
                }
                let reach = 4.0 * self.table.noise + 2.0 * OTHER_SURFACE * m * m;
                nearer += u32::from(seen - m > reach);
                farther += u32::from(m - seen > reach);
                (sum, depth, count) = (sum + (seen - m), m, count + 1);
            }
        }
        verdict.drawn += drawn;
        if count < MIN_PIXELS_OF_BLOCK {
            return;
        }
        let off = sum / count as f32;
        let reach = OTHER_SURFACE * depth * depth + 3.0 * self.table.noise / (count as f32).sqrt();
        if 2 * nearer > count || off > reach {
            verdict.covered += count;
        } else if 2 * farther > count || off < -reach {
            verdict.behind += count;
        } else {
            verdict.agree += count;
        }
    }
}
