//! Cameras of a scan: a pinhole behind a lens, and COLMAP's names for both. Pixels count from the upper left corner of
//! the picture, so that the middle of its first pixel is (0.5, 0.5), as both have it. Axes: x right, y down, z forwards.

use nalgebra::Point3;
use shared_mem::lens::Distortion;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Camera {
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Focal lengths [pixel].
    pub focal: [f64; 2],
    /// Principal point [pixel].
    pub centre: [f64; 2],
    pub lens: Distortion,
}

impl Camera {
    /// Where a point of the camera's frame appears [pixel]; `None` behind the camera.
    pub fn project(&self, point: &Point3<f64>) -> Option<[f64; 2]> {
        if point.z <= 1e-9 {
            return None;
        }
        let seen = self.lens.bend(point.x / point.z, point.y / point.z).0;
        Some([0, 1].map(|i| self.focal[i] * seen[i] + self.centre[i]))
    }

    /// Direction of the ray through a place of the picture, as x/z and y/z, distortion taken back.
    pub fn direction(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        self.lens.direction([(u - self.centre[0]) / self.focal[0], (v - self.centre[1]) / self.focal[1]])
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
            ("SIMPLE_PINHOLE", [f, x, y]) => ([*f; 2], [*x, *y], Distortion::NONE),
            ("PINHOLE", [fx, fy, x, y]) => ([*fx, *fy], [*x, *y], Distortion::NONE),
            ("SIMPLE_RADIAL", [f, x, y, k]) => ([*f; 2], [*x, *y], Distortion::brown([*k, 0.0, 0.0, 0.0, 0.0])),
            ("RADIAL", [f, x, y, k1, k2]) => ([*f; 2], [*x, *y], Distortion::brown([*k1, *k2, 0.0, 0.0, 0.0])),
            ("OPENCV", [fx, fy, x, y, k1, k2, p1, p2]) => {
                ([*fx, *fy], [*x, *y], Distortion::brown([*k1, *k2, *p1, *p2, 0.0]))
            }
            ("FULL_OPENCV", [fx, fy, x, y, k1, k2, p1, p2, k3, k4, k5, k6]) => {
                ([*fx, *fy], [*x, *y], Distortion::Polynomial([*k1, *k2, *p1, *p2, *k3, *k4, *k5, *k6]))
            }
            ("SIMPLE_RADIAL_FISHEYE", [f, x, y, k]) => ([*f; 2], [*x, *y], Distortion::Fisheye([*k, 0.0, 0.0, 0.0])),
            ("RADIAL_FISHEYE", [f, x, y, k1, k2]) => ([*f; 2], [*x, *y], Distortion::Fisheye([*k1, *k2, 0.0, 0.0])),
            ("OPENCV_FISHEYE", [fx, fy, x, y, k1, k2, k3, k4]) => {
                ([*fx, *fy], [*x, *y], Distortion::Fisheye([*k1, *k2, *k3, *k4]))
            }
            (
                "SIMPLE_PINHOLE"
                | "PINHOLE"
                | "SIMPLE_RADIAL"
                | "RADIAL"
                | "OPENCV"
                | "FULL_OPENCV"
                | "SIMPLE_RADIAL_FISHEYE"
                | "RADIAL_FISHEYE"
                | "OPENCV_FISHEYE",
                _,
            ) => {
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
    pub fn to_colmap(&self) -> (&'static str, Vec<f64>) {
        let (model, coefficients): (_, &[f64]) = match &self.lens {
            Distortion::Polynomial([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]) => ("PINHOLE", &[]),
            // Models of fewer numbers have one focal length.
            Distortion::Polynomial([few @ .., 0.0, 0.0, 0.0, 0.0]) => ("OPENCV", few),
            Distortion::Polynomial(all) => ("FULL_OPENCV", all),
            Distortion::Fisheye(all) => ("OPENCV_FISHEYE", all),
        };
        (model, [&self.focal[..], &self.centre, coefficients].concat())
    }

    /// Refuses a camera that cannot be one.
    ///
    /// # Errors
    /// A sentence that names what is wrong.
    pub fn checked(self) -> Result<Self, String> {
        let coefficients: &[f64] = match &self.lens {
            Distortion::Polynomial(k) => k,
            Distortion::Fisheye(k) => k,
        };
        if let Some(bad) = coefficients.iter().find(|k| !k.is_finite()) {
            return Err(format!("a camera whose lens has the coefficient {bad}"));
        }
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_goes_back_through_the_pixel_that_it_came_from() {
        let cameras = [
            ("PINHOLE", vec![600.0, 610.0, 321.0, 239.0]),
            ("SIMPLE_RADIAL", vec![600.0, 320.0, 240.0, -0.08]),
            ("OPENCV", vec![600.0, 610.0, 321.0, 239.0, -0.1, 0.02, 0.001, -0.002]),
            ("FULL_OPENCV", vec![600.0, 610.0, 321.0, 239.0, 1.2, 0.35, 4e-4, -7e-4, 0.02, 1.45, 0.52, 0.06]),
            ("SIMPLE_RADIAL_FISHEYE", vec![420.0, 320.0, 240.0, -0.03]),
            ("OPENCV_FISHEYE", vec![420.0, 425.0, 321.0, 239.0, -0.03, 0.008, -0.004, 6e-4]),
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
