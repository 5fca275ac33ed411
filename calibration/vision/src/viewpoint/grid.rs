//! A picture of one number a pixel, row by row; pixel centres lie at whole numbers.

use super::lens::Lens;
use shared_mem::lens::Distortion;

#[derive(Debug, Clone, PartialEq)]
pub struct Grid {
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// `width * height` numbers.
    pub values: Vec<f32>,
}

impl Grid {
    /// From a number for every column and row.
    pub fn from_fn(width: usize, height: usize, mut value: impl FnMut(usize, usize) -> f32) -> Self {
        let values = (0..width * height).map(|i| value(i % width, i / width)).collect();
        Self { width, height, values }
    }

    /// The number of a pixel.
    pub fn at(&self, x: usize, y: usize) -> f32 {
        self.values[y * self.width + x]
    }

    /// Between pixel centres, linear in both directions; `None` outside of them.
    pub fn sample(&self, u: f64, v: f64) -> Option<f64> {
        let inside = u >= 0.0 && v >= 0.0 && u <= (self.width - 1) as f64 && v <= (self.height - 1) as f64;
        inside.then(|| {
            let (x, y) = ((u as usize).min(self.width.max(2) - 2), (v as usize).min(self.height.max(2) - 2));
            let (a, b) = (u - x as f64, v - y as f64);
            let at = |x: usize, y: usize| f64::from(self.at(x.min(self.width - 1), y.min(self.height - 1)));
            (at(x, y) * (1.0 - a) + at(x + 1, y) * a) * (1.0 - b)
                + (at(x, y + 1) * (1.0 - a) + at(x + 1, y + 1) * a) * b
        })
    }

    /// Means of squares of `factor` pixels; a rest at the right and lower border is left out.
    pub fn shrunk(&self, factor: usize) -> Self {
        if factor == 1 {
            return self.clone();
        }
        let area = (factor * factor) as f32;
        Self::from_fn(self.width / factor, self.height / factor, |x, y| {
            let rows = (y * factor..(y + 1) * factor).map(|row| {
                let from = row * self.width + x * factor;
                self.values[from..from + factor].iter().sum::<f32>()
            });
            rows.sum::<f32>() / area
        })
    }

    /// Weighted means of 3 x 3 pixels with the weights 1, 2, 1, `times` over: a bell of sigma `sqrt(times / 2)` pixels.
    pub fn blurred(mut self, times: usize) -> Self {
        let (width, height) = (self.width, self.height);
        for _ in 0..times {
            let old = self.clone();
            self = Self::from_fn(width, height, |x, y| {
                let (l, r) = (x.saturating_sub(1), (x + 1).min(width - 1));
                0.25 * (old.at(l, y) + 2.0 * old.at(x, y) + old.at(r, y))
            });
            let old = self.clone();
            self = Self::from_fn(width, height, |x, y| {
                let (u, d) = (y.saturating_sub(1), (y + 1).min(height - 1));
                0.25 * (old.at(x, u) + 2.0 * old.at(x, y) + old.at(x, d))
            });
        }
        self
    }

    /// What a lens without distortion and otherwise the same numbers would have shown; `outside` where the picture has
    /// nothing to show.
    pub fn undistorted(self, lens: &Lens, distortion: &Distortion, outside: f32) -> Self {
        if !distortion.is_bent() {
            return self;
        }
        Self::from_fn(self.width, self.height, |x, y| {
            let [u, v] = lens.bent(distortion, [x as f64, y as f64]);
            self.sample(u, v).map_or(outside, |value| value as f32)
        })
    }

    /// The same of numbers between which there is nothing: every pixel shows the one that lies nearest, 0 outside.
    pub fn undistorted_nearest(self, lens: &Lens, distortion: &Distortion) -> Self {
        if !distortion.is_bent() {
            return self;
        }
        Self::from_fn(self.width, self.height, |x, y| {
            let [u, v] = lens.bent(distortion, [x as f64, y as f64]).map(f64::round);
            let inside = u >= 0.0 && v >= 0.0 && u < self.width as f64 && v < self.height as f64;
            if inside { self.at(u as usize, v as usize) } else { 0.0 }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_is_sampled_shrunk_and_blurred_into_itself() {
        let plane = Grid::from_fn(12, 8, |x, y| 3.0 * x as f32 - 2.0 * y as f32);
        assert_eq!(plane.sample(4.25, 3.5), Some(3.0 * 4.25 - 2.0 * 3.5));
        assert_eq!(plane.sample(11.0, 7.0), Some(19.0));
        assert_eq!(plane.sample(11.1, 3.0), None);
        // Pixel 2 of the small picture is centred on 4.5 of the large one.
        assert_eq!(plane.shrunk(2).at(2, 1), 3.0 * 4.5 - 2.0 * 2.5);
        assert_eq!(plane.clone().blurred(2).at(5, 4), plane.at(5, 4));
    }
}
