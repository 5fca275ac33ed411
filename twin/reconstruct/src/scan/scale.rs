//! How many metres one unit of the poses is: said by a person, by the robot that held the camera, or by depth pictures at points
//! that COLMAP has placed.

use super::{Scan, ScanError};
use serde::Serialize;

/// Where the scale comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum ScaleSource {
    /// A person gave it.
    Given,
    /// The robot's kinematics measure in metres.
    Robot,
    /// Depth pictures at points of the COLMAP model.
    Depth,
    /// The poses are taken as metres, and the depth pictures agree.
    Poses,
}

/// Metres for one unit of the poses.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Scale {
    /// Metres for one unit.
    pub metres: f64,
    /// Who says so.
    pub source: ScaleSource,
    /// Spread of single measurements: half the middle 68 %, as a share of the scale; 0 where it was given.
    pub spread: f64,
}

/// Fewer points of a model with depth say nothing.
const MIN_POINTS: usize = 30;

impl Scan {
    /// The scan's scale.
    ///
    /// # Errors
    /// [`ScanError::Missing`] when nothing says it.
    pub fn scale(&self, given: Option<f64>) -> Result<Scale, ScanError> {
        if let Some(metres) = given {
            return Ok(Scale { metres, source: ScaleSource::Given, spread: 0.0 });
        }
        if self.says_metres {
            return Ok(Scale { metres: 1.0, source: ScaleSource::Robot, spread: 0.0 });
        }
        if !self.has_depth() {
            return Err(ScanError::Missing(format!(
                "{}: nothing says how long one unit of the poses is: give --scale METRES (1 where they are in metres), or depth pictures",
                self.folder.display()
            )));
        }
        if self.known_depths.is_empty() {
            // Whether depth agrees is looked at once there is a surface.
            return Ok(Scale { metres: 1.0, source: ScaleSource::Poses, spread: 0.0 });
        }
        self.scale_of_depth()
    }

    fn scale_of_depth(&self) -> Result<Scale, ScanError> {
        let mut ratios = Vec::new();
        let mut at = 0;
        while at < self.known_depths.len() {
            let view = self.known_depths[at].0;
            let count = self.known_depths[at..].iter().take_while(|known| known.0 == view).count();
            let known = &self.known_depths[at..at + count];
            at += count;
            if self.views[view].depth.is_none() {
                continue;
            }
            let frame = self.frame(view, 1)?;
            let (width, height) = (frame.camera.width as usize, frame.camera.height as usize);
            for (_, [u, v], z) in known {
                let inside = *u >= 0.0 && *v >= 0.0 && (*u as usize) < width && (*v as usize) < height;
                let measured = if inside { frame.depth[*v as usize * width + *u as usize] } else { 0.0 };
                if measured > 0.0 {
                    ratios.push(f64::from(measured) / z);
                }
            }
        }
        if ratios.len() < MIN_POINTS {
            return Err(ScanError::Missing(format!(
                "{}: depth was measured at {} points of the COLMAP model, too few for its scale: give --scale METRES for one unit",
                self.folder.display(),
                ratios.len()
            )));
        }
        ratios.sort_by(f64::total_cmp);
        let quantile = |share: f64| ratios[((ratios.len() - 1) as f64 * share).round() as usize];
        let (metres, half) = (quantile(0.5), 0.5 * (quantile(0.84) - quantile(0.16)));
        Ok(Scale { metres, source: ScaleSource::Depth, spread: half / metres })
    }
}
