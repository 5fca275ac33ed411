//! A silhouette: which pixels show the robot, as a mask says it, and how far every pixel is from its border.

use super::distance::signed_distance;
use super::grid::Grid;
use super::outline::Place;
use super::pull::Pull;

/// A silhouette at one resolution.
#[derive(Debug, Clone)]
pub struct Silhouette {
    /// Share of every pixel that the robot covers, 0 to 1.
    share: Grid,
    /// Distance to the border [pixel], negative inside.
    distance: Grid,
    /// The share, smoothed.
    smooth: Grid,
}

/// Distances count up to this share of the picture's width in the search.
const REACH: f32 = 0.2;
/// What a place outside of the picture costs in the first look, where one far from the border costs 1.
const OUTSIDE: f64 = 0.4;

/// Smoothing: a bell with a sigma of one pixel.
const SMOOTH: usize = 2;
/// A border falls by more than this within two pixels; in a notch or at a tip it does not.
const STEEP: f64 = 0.4;

impl Silhouette {
    /// From the share of every pixel that the robot covers.
    pub fn new(share: Grid) -> Self {
        let inside: Vec<bool> = share.values.iter().map(|v| *v >= 0.5).collect();
        let distance = signed_distance(share.width, share.height, &inside);
        let smooth = share.clone().blurred(SMOOTH);
        Self { share, distance, smooth }
    }

    /// Share of wrong pixels: what the paper's binary cross-entropy of two hard masks comes to, but for a factor.
    pub fn wrong(&self, covered: impl Iterator<Item = bool>) -> f64 {
        let off = self.share.values.iter().zip(covered).map(|(m, r)| f64::from((m - f32::from(u8::from(r))).abs()));
        off.sum::<f64>() / self.share.values.len() as f64
    }

    /// How far the drawn robot and the silhouette are from each other: 0 where they agree, about 1 where they have
    /// nothing in common; falls towards the right place from far away.
    pub fn apart(&self, covered: &[bool]) -> f64 {
        let reach = REACH * self.share.width as f32;
        let drawn = super::distance::distance(self.share.width, self.share.height, |i| covered[i]);
        let (mut sum, mut pixels) = (0.0, 0.0f64);
        for ((mask, drawn), covered) in self.distance.values.iter().zip(&drawn.values).zip(covered) {
            let inside = *mask < 0.0;
            pixels += f64::from(u8::from(inside));
            match (inside, *covered) {
                (true, false) => sum += f64::from(drawn.min(reach)),
                (false, true) => sum += f64::from(mask.min(reach)),
                _ => {}
            }
        }
        sum / (f64::from(reach) * pixels.max(1.0))
    }

    /// The same from an outline alone: its mean distance to the silhouette's border.
    pub fn outline_apart(&self, outline: impl Iterator<Item = Place>) -> f64 {
        let reach = f64::from(REACH) * self.share.width as f64 / 2.0;
        let (mut sum, mut total) = (0.0, 0.0);
        for place in outline.filter(|place| place.is_outer) {
            let distance = self.distance.sample(place.pixel[0], place.pixel[1]);
            sum += place.length * distance.map_or(OUTSIDE, |d| (d.abs() / reach).min(1.0));
            total += place.length;
        }
        if total > 0.0 { sum / total } else { 1.0 }
    }

    /// What was drawn, smoothed as the silhouette is.
    pub fn smoothed(&self, covered: impl Iterator<Item = bool>) -> Grid {
        let values = covered.map(|covered| f32::from(u8::from(covered))).collect();
        Grid { width: self.share.width, height: self.share.height, values }.blurred(SMOOTH)
    }

    /// Where the border is against the drawn one, of which the place is part. Both are made of pixels in the same way, so
    /// that what pixels do to a border cancels; good to a few hundredths of a pixel, and blind beyond two.
    pub fn pull_smooth(&self, place: &Place, drawn: &Grid) -> Option<Pull> {
        let [u, v] = place.pixel;
        let [x, y] = place.outward;
        let fall = drawn.sample(u - x, v - y)? - drawn.sample(u + x, v + y)?;
        if !place.is_outer || fall < STEEP {
            return None;
        }
        let offset = 2.0 * (drawn.sample(u, v)? - self.smooth.sample(u, v)?) / fall;
        Some(Pull { offset, direction: place.outward, weight: 1.0, doubt: 0.0 })
    }

    /// Where the border is, seen from a place of the outline.
    pub fn pull(&self, place: &Place) -> Option<Pull> {
        if !place.is_outer {
            return None;
        }
        let [u, v] = place.pixel;
        let offset = self.distance.sample(u, v)?;
        let slope = [
            self.distance.sample(u + 0.5, v)? - self.distance.sample(u - 0.5, v)?,
            self.distance.sample(u, v + 0.5)? - self.distance.sample(u, v - 0.5)?,
        ];
        let steep = slope[0].hypot(slope[1]);
        (steep > 0.2).then(|| Pull {
            offset: offset / steep,
            direction: slope.map(|s| s / steep),
            weight: 1.0,
            doubt: 0.0,
        })
    }
}
