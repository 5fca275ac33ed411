//! Lenses as other programs write them. The same numbers mean another lens under another model's name, so what is not read is
//! refused by its name: a model, a coefficient, a list of another length.

use super::Distortion;
use serde::Deserialize;

/// Families that the models' names belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Family {
    /// Two to five numbers of Brown and Conrady.
    Brown,
    /// OpenCV's quotient of two polynomials.
    Rational,
    /// Kannala and Brandt.
    Fisheye,
}

/// What to do about a lens that is not read.
const REMEDY: &str =
    "calibrate with plumb_bob, rational_polynomial or equidistant (a fisheye), or undistort the pictures";

impl Family {
    /// By the name that ROS, OpenCV, Kalibr, COLMAP, nerfstudio or librealsense gives the model.
    fn of(name: &str) -> Result<Self, String> {
        let plain = name.trim().to_lowercase().replace(['-', ' '], "_");
        Ok(match plain.strip_prefix("distortion.").unwrap_or(&plain) {
            "plumb_bob" | "radtan" | "brown_conrady" | "opencv" | "radial" | "simple_radial" | "pinhole"
            | "simple_pinhole" | "perspective" | "none" | "" => Self::Brown,
            "rational_polynomial" | "rational" | "full_opencv" => Self::Rational,
            "equidistant"
            | "equi"
            | "fisheye"
            | "opencv_fisheye"
            | "kannala_brandt"
            | "kannala_brandt4"
            | "radial_fisheye"
            | "simple_radial_fisheye" => Self::Fisheye,
            _ => return Err(format!("the lens model `{name}` is not known here; {REMEDY}")),
        })
    }
}

/// A lens from a list of coefficients in OpenCV's order, and the name of its model where there is one: k1, k2, p1, p2, k3, k4, k5,
/// k6 and terms of a thin prism and a tilted sensor, of which 4, 5, 8, 12 or 14 are given; or the four of a fisheye.
///
/// # Errors
/// A sentence that names what is not read.
pub fn of_list(model: Option<&str>, list: &[f64]) -> Result<Distortion, String> {
    if let Some(bad) = list.iter().find(|value| !value.is_finite()) {
        return Err(format!("a coefficient of the lens is {bad}; calibrate the camera again"));
    }
    let family = model.map(Family::of).transpose()?;
    // Some programs fill a list up with zeros.
    let said = list.iter().rposition(|value| *value != 0.0).map_or(0, |last| last + 1);
    let beyond = |most: usize, name: &str| {
        if said <= most {
            return Ok(());
        }
        Err(format!("{} numbers of distortion are given, and the lens model `{name}` has {most}; {REMEDY}", list.len()))
    };
    let mut k = [0.0; 14];
    match family {
        Some(Family::Fisheye) => {
            beyond(4, model.unwrap_or(""))?;
            if list.len() < 4 {
                return Err(format!("{} numbers of distortion are given, and a fisheye has 4", list.len()));
            }
            return Ok(Distortion::Fisheye([list[0], list[1], list[2], list[3]]));
        }
        Some(Family::Brown) => beyond(5, model.unwrap_or(""))?,
        Some(Family::Rational) | None => {}
    }
    if ![0, 4, 5, 8, 12, 14].contains(&list.len()) && said > 0 {
        return Err(format!(
            "{} numbers of distortion are given, and a list of OpenCV has 4, 5, 8, 12 or 14; {REMEDY}",
            list.len()
        ));
    }
    k[..said].copy_from_slice(&list[..said]);
    match said {
        9..=12 => Err(format!("the lens has terms of a thin prism (s1 to s4), which are not read here; {REMEDY}")),
        13.. => Err(format!("the lens has terms of a tilted sensor (tau_x, tau_y), which are not read here; {REMEDY}")),
        _ => {
            let [k1, k2, p1, p2, k3, k4, k5, k6, ..] = k;
            Ok(Distortion::Polynomial([k1, k2, p1, p2, k3, k4, k5, k6]))
        }
    }
}

/// A lens as keys of a list of pictures name it, those of nerfstudio and instant-ngp.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct Keys {
    camera_model: Option<String>,
    distortion_model: Option<String>,
    is_fisheye: Option<bool>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    k5: Option<f64>,
    k6: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

/// Keys that say something about a lens or its pinhole and are not read in lists of pictures.
const UNREAD: [&str; 24] = [
    "D",
    "K",
    "d",
    "k",
    "distortion",
    "distortion_params",
    "distortion_coefficients",
    "distortion_coeffs",
    "dist_coeffs",
    "camera_matrix",
    "intrinsics",
    "intrinsic_matrix",
    "xi",
    "s1",
    "s2",
    "s3",
    "s4",
    "k7",
    "k8",
    "p3",
    "p4",
    "tau_x",
    "tau_y",
    "skew",
];

impl Keys {
    /// These, and those of `common` where these say nothing.
    #[must_use]
    pub fn or(&self, common: &Self) -> Self {
        let text = |own: &Option<String>, other: &Option<String>| own.clone().or_else(|| other.clone());
        Self {
            camera_model: text(&self.camera_model, &common.camera_model),
            distortion_model: text(&self.distortion_model, &common.distortion_model),
            is_fisheye: self.is_fisheye.or(common.is_fisheye),
            k1: self.k1.or(common.k1),
            k2: self.k2.or(common.k2),
            k3: self.k3.or(common.k3),
            k4: self.k4.or(common.k4),
            k5: self.k5.or(common.k5),
            k6: self.k6.or(common.k6),
            p1: self.p1.or(common.p1),
            p2: self.p2.or(common.p2),
        }
    }

    /// The lens.
    ///
    /// # Errors
    /// A sentence that names what is not read.
    pub fn distortion(&self) -> Result<Distortion, String> {
        let [k1, k2, k3, k4, k5, k6, p1, p2] =
            [self.k1, self.k2, self.k3, self.k4, self.k5, self.k6, self.p1, self.p2].map(|value| value.unwrap_or(0.0));
        let model = self.distortion_model.as_deref().or(self.camera_model.as_deref());
        let family = match self.is_fisheye {
            Some(true) => Family::Fisheye,
            _ => model.map_or(Ok(Family::Brown), Family::of)?,
        };
        if family == Family::Fisheye {
            let others = [("p1", p1), ("p2", p2), ("k5", k5), ("k6", k6)];
            return match others.iter().find(|(_, value)| *value != 0.0) {
                Some((name, _)) => Err(format!("a fisheye has k1 to k4, and `{name}` is given; {REMEDY}")),
                None => of_list(Some("fisheye"), &[k1, k2, k3, k4]),
            };
        }
        // nerfstudio's own k4 is a fourth power of a polynomial, OpenCV's the first of the quotient's lower half.
        let is_quotient = family == Family::Rational || [self.k4, self.k5, self.k6].iter().all(Option::is_some);
        if !is_quotient && [k4, k5, k6] != [0.0; 3] {
            return Err(format!(
                "of `k4`, `k5` and `k6` some are given, and programs differ in what they mean: add all three for OpenCV's \
                 rational model, or `camera_model` with OPENCV_FISHEYE for a fisheye; or {REMEDY}"
            ));
        }
        of_list(Some("rational_polynomial"), &[k1, k2, p1, p2, k3, k4, k5, k6])
    }

    /// Refuses keys that speak of the lens and are not read.
    ///
    /// # Errors
    /// A sentence that names the key.
    pub fn none_unread<'a>(mut names: impl Iterator<Item = &'a str>) -> Result<(), String> {
        match names.find(|name| UNREAD.contains(name)) {
            None => Ok(()),
            Some(name) => Err(format!(
                "`{name}` is not read here: give the pinhole as `fl_x`, `fl_y`, `cx`, `cy` and the lens as `k1` to `k6`, `p1`, `p2` \
                 with `camera_model`"
            )),
        }
    }
}
