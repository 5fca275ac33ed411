//! A photo without a mask: edges of brightness and colour, and how they fit to the robot's outline.
//!
//! From far away the outline is compared with the distance to edges of its own direction (oriented chamfer matching,
//! Shotton et al. 2008); near by, every place of it looks along its normal for the clearest edge (Harris & Stennett
//! 1990), weak edges counting nearly as much as strong ones, because a white robot before a grey wall has only weak ones.

use super::distance::distance;
use super::grid::Grid;
use super::outline::Place;
use super::profile::{Profiles, SIDE, Samples};
use super::pull::Pull;

/// A photo at one resolution.
#[derive(Debug, Clone)]
pub struct Photo {
    /// Red, green, blue, blurred, 0 to 255.
    channels: [Grid; 3],
    /// Distance to the nearest edge of each direction [pixel].
    near: Vec<Grid>,
    /// Contrast of an edge that is certainly one [1/pixel].
    clear: f64,
}

/// Directions that are distinguished, evenly over half a turn; an edge counts for those within an eighth of a turn and a half.
const DIRECTIONS: usize = 12;
const TOLERANCE: f64 = 0.30;
/// Blur: a bell with a sigma of one pixel.
const BLUR: usize = 2;
/// Distances to edges count up to this share of the picture's width in the search.
const REACH: f64 = 0.05;
/// What a place outside of the picture costs in the search, where one far from any edge costs 1.
const OUTSIDE: f64 = 0.5;
/// Share of pixels that are taken for edges at most.
const EDGES: f64 = 0.08;
/// Contrast of one grey level is noise [1/pixel].
const NOISE: f64 = 1.0;
/// Height of a step over the largest contrast that is left of it when it is blurred [pixel].
const STEEPEST: f64 = 3.0;

impl Photo {
    /// From red, green and blue, 0 to 255. `searched`: distances for a search from afar are wanted too.
    pub fn new(channels: [Grid; 3], searched: bool) -> Self {
        let channels = channels.map(|grid| grid.blurred(BLUR));
        let slopes = Slopes::of(&channels);
        let mut strengths: Vec<f32> = slopes.ridge.iter().copied().filter(|s| f64::from(*s) > NOISE).collect();
        let wanted = ((EDGES * slopes.ridge.len() as f64) as usize).min(strengths.len().saturating_sub(1));
        let weakest = if strengths.is_empty() {
            f32::INFINITY
        } else {
            *strengths.select_nth_unstable_by(wanted, |a, b| b.total_cmp(a)).1
        };
        let near = if searched { slopes.distances(&channels[0], weakest) } else { Vec::new() };
        Self { channels, near, clear: f64::from(weakest.clamp(2.0 * NOISE as f32, 8.0)) }
    }

    /// How badly an outline fits to the edges: 0 where it lies on edges of its direction, 1 where it is far from them.
    /// `whole`: what the outline's length is about when all of it is in the picture [m]; what is missing lies outside.
    pub fn apart(&self, outline: impl Iterator<Item = Place>, focal: f64, whole: f64) -> f64 {
        let reach = REACH * self.channels[0].width as f64;
        let (mut sum, mut total) = (0.0, 0.0);
        for place in outline {
            let [x, y] = place.outward;
            let direction = bin(y.atan2(x));
            let distance = self.near.get(direction).and_then(|grid| grid.sample(place.pixel[0], place.pixel[1]));
            let length = place.length * place.point.z / focal;
            sum += length * distance.map_or(OUTSIDE, |d| (d / reach).min(1.0));
            total += length;
        }
        let outside = (whole - total).max(0.0);
        (sum + OUTSIDE * outside) / (total + outside).max(1e-9)
    }

    /// The edge that explains the picture across a place that lies nearly on it: not where contrast is largest, which light
    /// shifts.
    pub fn pull_exact(&self, place: &Place) -> Option<Pull> {
        let along = |step: i32| [0, 1].map(|i| place.pixel[i] + f64::from(step) * place.outward[i]);
        let mut profile = [Samples::zeros(); 3];
        for (row, step) in (-SIDE..=SIDE).enumerate() {
            let [u, v] = along(step);
            for (samples, channel) in profile.iter_mut().zip(&self.channels) {
                samples[row] = channel.sample(u, v)?;
            }
        }
        let edge = Profiles::all().edge(&profile)?;
        // Over a blurred step contrast rises to a third of the step's height.
        let weight = edge.explained * edge.contrast / (edge.contrast + STEEPEST * self.clear);
        (edge.contrast > NOISE).then_some(Pull {
            offset: -edge.away,
            direction: place.outward,
            weight,
            doubt: -edge.otherwise,
        })
    }

    /// The clearest edge on the normal of a place, not further than `range` [pixel].
    pub fn pull(&self, place: &Place, range: f64) -> Option<Pull> {
        let steps = range.ceil() as i32;
        let at = |step: i32| {
            let contrast = |side: f64| {
                let [u, v] = [0, 1].map(|i| place.pixel[i] + (f64::from(step) + side) * place.outward[i]);
                Some([self.channels[0].sample(u, v)?, self.channels[1].sample(u, v)?, self.channels[2].sample(u, v)?])
            };
            let (beyond, before) = (contrast(1.0)?, contrast(-1.0)?);
            Some((0..3).map(|c| (beyond[c] - before[c]).powi(2)).sum::<f64>().sqrt() / 2.0)
        };
        let (mut before, mut here) = (at(-steps - 1), at(-steps));
        let mut best: Option<(f64, Pull)> = None;
        for step in -steps..=steps {
            let beyond = at(step + 1);
            if let (Some(a), Some(b), Some(c)) = (before, here, beyond)
                && b > NOISE
                && b >= a
                && b > c
            {
                let bend = a - 2.0 * b + c;
                let shift = if bend < -1e-9 { (0.5 * (a - c) / bend).clamp(-0.5, 0.5) } else { 0.0 };
                let away = f64::from(step) + shift;
                let weight = b / (b + self.clear);
                let score = weight * (-2.0 * (away / range).powi(2)).exp();
                if best.is_none_or(|(most, _)| score > most) {
                    best = Some((score, Pull { offset: -away, direction: place.outward, weight, doubt: 0.0 }));
                }
            }
            (before, here) = (here, beyond);
        }
        best.map(|(_, pull)| pull)
    }
}

/// The number of a direction; opposite directions are one.
fn bin(angle: f64) -> usize {
    (angle.rem_euclid(std::f64::consts::PI) / std::f64::consts::PI * DIRECTIONS as f64) as usize % DIRECTIONS
}

/// Contrast at every pixel.
struct Slopes {
    /// Where contrast is highest along its own direction [1/pixel]; 0 elsewhere.
    ridge: Vec<f32>,
    /// Direction of the contrast [rad].
    angle: Vec<f32>,
}

impl Slopes {
    fn of(channels: &[Grid; 3]) -> Self {
        let (width, height) = (channels[0].width, channels[0].height);
        let (mut strength, mut angle) = (vec![0.0f32; width * height], vec![0.0f32; width * height]);
        for y in 1..height.saturating_sub(1) {
            for x in 1..width.saturating_sub(1) {
                // The structure tensor of the channels (Di Zenzo 1986): its larger eigenvalue and that one's direction.
                let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
                for grid in channels {
                    let dx = 0.5 * (grid.at(x + 1, y) - grid.at(x - 1, y));
                    let dy = 0.5 * (grid.at(x, y + 1) - grid.at(x, y - 1));
                    (xx, xy, yy) = (xx + dx * dx, xy + dx * dy, yy + dy * dy);
                }
                let spread = ((xx - yy).powi(2) + 4.0 * xy * xy).sqrt();
                strength[y * width + x] = (0.5 * (xx + yy + spread)).max(0.0).sqrt();
                angle[y * width + x] = 0.5 * (2.0 * xy).atan2(xx - yy);
            }
        }
        let mut ridge = vec![0.0; width * height];
        for y in 2..height.saturating_sub(2) {
            for x in 2..width.saturating_sub(2) {
                let i = y * width + x;
                let (dy, dx) = (angle[i] as f64).sin_cos();
                let beside = |side: f64| {
                    let (u, v) = ((x as f64 + side * dx).round(), (y as f64 + side * dy).round());
                    strength[v as usize * width + u as usize]
                };
                if strength[i] > beside(-1.0) && strength[i] >= beside(1.0) {
                    ridge[i] = strength[i];
                }
            }
        }
        Self { ridge, angle }
    }

    /// Distances to edges of every direction.
    fn distances(&self, like: &Grid, weakest: f32) -> Vec<Grid> {
        let turn = std::f64::consts::PI;
        (0..DIRECTIONS)
            .map(|direction| {
                let middle = (direction as f64 + 0.5) * turn / DIRECTIONS as f64;
                distance(like.width, like.height, |i| {
                    let off = (f64::from(self.angle[i]) - middle).rem_euclid(turn);
                    self.ridge[i] >= weakest && self.ridge[i] > 0.0 && off.min(turn - off) < TOLERANCE
                })
            })
            .collect()
    }
}
