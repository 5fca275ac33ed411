//! The straight picture that meshes are drawn in, and where each pixel of a bent lens finds itself in it.

use super::lens::Lens;
use super::raster::Pinhole;
use rayon::prelude::*;

/// Pixels of each side of the border that are looked at.
const BORDER: usize = 64;
/// A pixel that sees nothing of the straight picture.
pub const NOWHERE: u32 = u32::MAX;

/// The pinhole beside a lens.
#[derive(Debug, Clone)]
pub struct Straight {
    /// Its camera.
    pub pinhole: Pinhole,
    /// Columns and rows.
    pub size: [usize; 2],
    /// For every pixel behind the lens the pixel of the straight picture, or [`NOWHERE`]; empty where the two are one.
    pub lookup: Vec<u32>,
}

/// A lens that bends sees a little more or less than its pinhole, a fisheye much more: pixels by which that one's picture is made
/// larger on every side, half its own size at most.
fn margin(lens: &Lens, seen: [usize; 2]) -> [usize; 2] {
    if !lens.is_bent() {
        return [0, 0];
    }
    let last = seen.map(|pixels| pixels.saturating_sub(1) as f64);
    let border = (0..=BORDER).map(|i| i as f64 / BORDER as f64);
    let pixels = border.flat_map(|s| {
        let [x, y] = last.map(|last| last * s);
        [[x, 0.0], [x, last[1]], [0.0, y], [last[0], y]]
    });
    let mut most = [0.0f64; 2];
    for ray in pixels.map(|pixel| lens.ray(pixel)) {
        for i in 0..2 {
            let at = ray[i] * lens.focal[i] + lens.centre[i];
            most[i] = most[i].max(-at).max(at - last[i]);
        }
    }
    [0, 1].map(|i| (most[i].ceil() as usize + 1).min(seen[i] / 2))
}

impl Straight {
    /// For pictures behind the lens of so many columns and rows.
    pub fn new(lens: &Lens, seen: [usize; 2]) -> Self {
        let margin = margin(lens, seen);
        let size = [0, 1].map(|i| seen[i] + 2 * margin[i]);
        let [fx, fy] = lens.focal.map(|f| f as f32);
        let [cx, cy] = [0, 1].map(|i| (lens.centre[i] + margin[i] as f64) as f32);
        let pixel = |i: usize| {
            let ray = lens.ray([(i % seen[0]) as f64, (i / seen[0]) as f64]);
            let u = (ray.x * f64::from(fx) + f64::from(cx)).round();
            let v = (ray.y * f64::from(fy) + f64::from(cy)).round();
            let inside = u >= 0.0 && v >= 0.0 && u < size[0] as f64 && v < size[1] as f64;
            if inside { (v as usize * size[0] + u as usize) as u32 } else { NOWHERE }
        };
        let lookup =
            if lens.is_bent() { (0..seen[0] * seen[1]).into_par_iter().map(pixel).collect() } else { Vec::new() };
        Self { pinhole: Pinhole { fx, fy, cx, cy }, size, lookup }
    }

    /// The straight picture's pixel for one behind the lens.
    pub fn at(&self, pixel: usize) -> Option<usize> {
        match self.lookup.get(pixel) {
            None => Some(pixel),
            Some(&NOWHERE) => None,
            Some(&there) => Some(there as usize),
        }
    }
}
