//! Cameras of a scan: pinhole with the distortions that COLMAP and nerfstudio name. Pixels count from the upper left corner of
//! the picture, so that the middle of its first pixel is (0.5, 0.5), as both have it. Axes: x right, y down, z forwards.

use nalgebra::Point3;

/// How rays bend in the lens; coefficients of COLMAP's and OpenCV's models.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Lens {
    /// They do not.
    Straight,
    /// `SIMPLE_RADIAL`, `RADIAL`: k1, k2.
    Radial([f64; 2]),
    /// `OPENCV`: k1, k2, p1, p2.
    OpenCv([f64; 4]),
}

/// One camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal lengths [pixel].
    pub focal: [f64; 2],
    /// Principal point [pixel].
    pub centre: [f64; 2],
    /// Its distortion.
    pub lens: Lens,
}

/// Rounds of the fixed-point iteration that takes a distortion back; each gains more than a digit within the picture.
const ROUNDS: usize = 20;

impl Camera {
    /// Where a point of the camera's frame appears [pixel]; `None` behind the camera.
    #[must_use]
    pub fn project(&self, point: &Point3<f64>) -> Option<[f64; 2]> {
        if point.z <= 1e-9 {
            return None;
        }
        let [x, y] = self.lens.bent([point.x / point.z, point.y / point.z]);
        Some([self.focal[0] * x + self.centre[0], self.focal[1] * y + self.centre[1]])
    }

    /// Direction of the ray through a place of the picture, as x/z and y/z, distortion taken back.
    #[must_use]
    pub fn direction(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let seen = [(u - self.centre[0]) / self.focal[0], (v - self.centre[1]) / self.focal[1]];
        let mut straight = seen;
        if self.lens == Lens::Straight {
            return straight;
        }
        for _ in 0..ROUNDS {
            let bent = self.lens.bent(straight);
            straight = [straight[0] + seen[0] - bent[0], straight[1] + seen[1] - bent[1]];
        }
        straight
    }

    /// The same camera with a picture of fewer pixels: `by` of them in each direction become one.
    #[must_use]
    pub fn reduced(&self, by: u32) -> Self {
        let share = 1.0 / f64::from(by);
        Self {
            width: self.width / by,
            height: self.height / by,
            focal: self.focal.map(|f| f * share),
            centre: self.centre.map(|c| c * share),
            lens: self.lens,
        }
    }

    /// From COLMAP's name of a model and its parameters.
    ///
    /// # Errors
    /// A sentence for a model that is not known here, or too few parameters.
    pub fn from_colmap(model: &str, [width, height]: [u32; 2], parameters: &[f64]) -> Result<Self, String> {
        let (focal, centre, lens) = match (model, parameters) {
            ("SIMPLE_PINHOLE", [f, x, y]) => ([*f; 2], [*x, *y], Lens::Straight),
            ("PINHOLE", [fx, fy, x, y]) => ([*fx, *fy], [*x, *y], Lens::Straight),
            ("SIMPLE_RADIAL", [f, x, y, k]) => ([*f; 2], [*x, *y], Lens::Radial([*k, 0.0])),
            ("RADIAL", [f, x, y, k1, k2]) => ([*f; 2], [*x, *y], Lens::Radial([*k1, *k2])),
            ("OPENCV", [fx, fy, x, y, k @ ..]) if k.len() == 4 => {
                ([*fx, *fy], [*x, *y], Lens::OpenCv([k[0], k[1], k[2], k[3]]))
            }
            ("SIMPLE_PINHOLE" | "PINHOLE" | "SIMPLE_RADIAL" | "RADIAL" | "OPENCV", _) => {
                return Err(format!("a camera of the model {model} with {} parameters", parameters.len()));
            }
            _ => {
                return Err(format!(
                    "the camera model {model} is not known here; undistort the pictures (`colmap image_undistorter`)"
                ));
            }
        };
        Self { width, height, focal, centre, lens }.checked()
    }

    /// COLMAP's name of its model, and the parameters.
    #[must_use]
    pub fn to_colmap(&self) -> (&'static str, Vec<f64>) {
        let ([fx, fy], [x, y]) = (self.focal, self.centre);
        match self.lens {
            Lens::Straight => ("PINHOLE", vec![fx, fy, x, y]),
            // Their own models have one focal length.
            Lens::Radial([k1, k2]) => ("OPENCV", vec![fx, fy, x, y, k1, k2, 0.0, 0.0]),
            Lens::OpenCv([k1, k2, p1, p2]) => ("OPENCV", vec![fx, fy, x, y, k1, k2, p1, p2]),
        }
    }

    /// Refuses a camera that cannot be one.
    ///
    /// # Errors
    /// A sentence that names what is wrong.
    pub fn checked(self) -> Result<Self, String> {
        let finite = self.focal.iter().chain(&self.centre).all(|v| v.is_finite());
        if !finite || self.focal.iter().any(|f| *f <= 0.0) || self.width == 0 || self.height == 0 {
            return Err(format!(
                "a camera of {} x {} pixels with the focal lengths {:?}",
                self.width, self.height, self.focal
            ));
        }
        Ok(self)
    }
}

impl Lens {
    fn bent(self, [x, y]: [f64; 2]) -> [f64; 2] {
        let square = x * x + y * y;
        match self {
            Self::Straight => [x, y],
            Self::Radial([k1, k2]) => {
                let factor = 1.0 + square * (k1 + square * k2);
                [x * factor, y * factor]
            }
            Self::OpenCv([k1, k2, p1, p2]) => {
                let factor = 1.0 + square * (k1 + square * k2);
                let across = 2.0 * x * y;
                [
                    x * factor + p1 * across + p2 * (square + 2.0 * x * x),
                    y * factor + p2 * across + p1 * (square + 2.0 * y * y),
                ]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_goes_back_through_the_pixel_that_it_came_from() {
        let cameras = [
            ("PINHOLE", vec![600.0, 610.0, 321.0, 239.0]),
            ("SIMPLE_RADIAL", vec![600.0, 320.0, 240.0, -0.08]),
            ("OPENCV", vec![600.0, 610.0, 321.0, 239.0, -0.1, 0.02, 0.001, -0.002]),
        ];
        for (model, parameters) in cameras {
            let camera = Camera::from_colmap(model, [640, 480], &parameters).expect("a camera");
            let (name, written) = camera.to_colmap();
            let again = Camera::from_colmap(name, [640, 480], &written).expect("a camera");
            for pixel in [[3.5, 7.5], [320.0, 240.0], [630.0, 470.0]] {
                let [x, y] = camera.direction(pixel);
                let back = again.project(&Point3::new(x * 0.4, y * 0.4, 0.4)).expect("in front");
                assert!((back[0] - pixel[0]).abs() < 1e-6 && (back[1] - pixel[1]).abs() < 1e-6, "{model} {back:?}");
            }
        }
    }

    #[test]
    fn a_model_that_is_not_known_is_refused_with_the_way_out() {
        let error = Camera::from_colmap("FOV", [640, 480], &[1.0; 5]).expect_err("not known");
        assert!(error.contains("image_undistorter"), "{error}");
        assert!(Camera::from_colmap("PINHOLE", [640, 480], &[1.0; 3]).is_err());
    }
}
