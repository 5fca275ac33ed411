//! What splats are trained on, and how well they show it.

use super::TrainError;
use crate::cloud::SplatCloud;
use crate::gradient::{COLOR_DEPTH, Frame, Parameters};
use crate::lens::Lens;
use crate::loss::Target;
use nalgebra::Isometry3;

/// Where a photograph was taken from, and by what.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// The lens [pixel].
    pub lens: Lens,
    /// The world's frame in the camera's: z forward, x right, y down [m].
    pub camera_from_world: Isometry3<f64>,
}

/// A picture with all that is known of it, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Photograph {
    /// Where from.
    pub camera: Camera,
    /// Columns and rows.
    pub size: [usize; 2],
    /// Red, green, blue.
    pub rgb: Vec<[u8; 3]>,
    /// How much of each pixel shows what is to be trained, 0 to 255; `None`: all of it, or it is not known.
    pub mask: Option<Vec<u8>>,
    /// Distance along the optical axis [m], 0 where it is not known.
    pub depth: Option<Vec<f32>>,
}

/// How near a cloud's picture comes to a photograph that it was not trained on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Peak signal-to-noise ratio over all pixels, what the mask leaves out taken as the background [dB].
    pub whole: f64,
    /// The same of pixels of which at least half is in the mask [dB].
    pub inside: f64,
}

impl Photograph {
    pub(super) fn check(&self, number: usize) -> Result<(), TrainError> {
        let wanted = self.size[0] * self.size[1];
        let parts = [
            ("picture", Some(self.rgb.len())),
            ("mask", self.mask.as_ref().map(Vec::len)),
            ("depth", self.depth.as_ref().map(Vec::len)),
        ];
        match parts.into_iter().find_map(|(what, found)| Some((what, found.filter(|found| *found != wanted)?))) {
            Some((what, found)) => Err(TrainError::Size { number, what, found, wanted }),
            None => Ok(()),
        }
    }

    /// As planes, over a background.
    pub(super) fn target(&self, background: [f32; 3], has_rays: bool) -> Target<f32> {
        let mask: Vec<f32> = self.mask.iter().flatten().map(|share| f32::from(*share) / 255.0).collect();
        let color = [0, 1, 2].map(|c| {
            let plain = self.rgb.iter().map(|rgb| f32::from(rgb[c]) / 255.0);
            if mask.is_empty() {
                plain.collect()
            } else {
                plain.zip(&mask).map(|(value, share)| value * share + background[c] * (1.0 - share)).collect()
            }
        });
        let mut depth = self.depth.clone().unwrap_or_default();
        depth.iter_mut().zip(&mask).filter(|(_, share)| **share < 0.5).for_each(|(depth, _)| *depth = 0.0);
        let rays = if has_rays { Target::rays(&self.camera.lens, self.size) } else { Vec::new() };
        Target { size: self.size, color, background, mask, depth, rays }
    }

    /// How well a cloud shows it.
    pub fn quality(&self, cloud: &SplatCloud, background: [f32; 3]) -> Quality {
        let target = self.target(background, false);
        let Camera { lens, camera_from_world } = &self.camera;
        let seen = Frame::<f32, COLOR_DEPTH>::new(&Parameters::of(cloud), camera_from_world, lens, self.size).planes();
        let (mut whole, mut inside) = ((0.0, 0usize), (0.0, 0usize));
        for at in 0..self.rgb.len() {
            let square: f64 = (0..3)
                .map(|c| {
                    let shown = seen.channels[c][at] + seen.left[at] * background[c];
                    f64::from(shown.clamp(0.0, 1.0) - target.color[c][at]).powi(2)
                })
                .sum();
            whole = (whole.0 + square, whole.1 + 3);
            if target.mask.get(at).is_none_or(|share| *share >= 0.5) {
                inside = (inside.0 + square, inside.1 + 3);
            }
        }
        let decibels = |(sum, count): (f64, usize)| -10.0 * (sum / count.max(1) as f64).max(1e-10).log10();
        Quality { whole: decibels(whole), inside: decibels(inside) }
    }
}
