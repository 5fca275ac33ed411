//! Lenses as other programs write them. The same numbers mean another lens under another model's name, so what is not read is
//! refused by its name: a model, a coefficient, a list of another length.

use super::Distortion;
use serde::Deserialize;

/// Families that the models' names belong to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Family {
    /// Nothing bends.
    Straight,
    /// A pinhole, which says nothing about the lens before it.
    Pinhole,
    /// Two to five numbers of Brown and Conrady.
    Brown,
    /// The same the other way round: read only where its numbers are zeros.
    Inverse,
    /// OpenCV's quotient of two polynomials.
    Rational,
    /// Kannala and Brandt.
    Fisheye,
}

/// What to do about a lens that is not read.
pub(super) const REMEDY: &str =
    "calibrate with plumb_bob, rational_polynomial or equidistant (a fisheye), or undistort the pictures";

impl Family {
    /// By the name that ROS, OpenCV, Kalibr, COLMAP, nerfstudio or librealsense gives the model.
    fn of(name: &str) -> Result<Self, String> {
        let plain = name.trim().to_lowercase().replace(['-', ' '], "_");
        let bare = ["rs2_distortion_", "distortion."].iter().find_map(|start| plain.strip_prefix(start));
        Ok(match bare.unwrap_or(&plain) {
            "none" => Self::Straight,
            "pinhole" | "simple_pinhole" | "perspective" => Self::Pinhole,
            "plumb_bob" | "radtan" | "brown_conrady" | "opencv" | "radial" | "simple_radial" => Self::Brown,
            "inverse_brown_conrady" | "modified_brown_conrady" => Self::Inverse,
            "rational_polynomial" | "rational" | "full_opencv" => Self::Rational,
            "equidistant"
            | "equi"
            | "fisheye"
            | "opencv_fisheye"
            | "kannala_brandt"
            | "kannala_brandt4"
            | "kannalabrandt8"
            | "kb4"
            | "kb8"
            | "radial_fisheye"
            | "simple_radial_fisheye" => Self::Fisheye,
            _ => return Err(format!("the lens model `{name}` is not known here; {REMEDY}")),
        })
    }

    /// The one that two names mean together; `None` where they contradict each other.
    fn and(self, other: Self) -> Option<Self> {
        match (self, other) {
            (one, other) if one == other => Some(one),
            (Self::Pinhole, lens) | (lens, Self::Pinhole) => Some(lens),
            (Self::Brown, Self::Rational) | (Self::Rational, Self::Brown) => Some(Self::Rational),
            _ => None,
        }
    }
}

/// A lens's model: its family, and the name that a file gives it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Model<'a> {
    family: Family,
    name: &'a str,
}

impl<'a> Model<'a> {
    fn of(name: &'a str) -> Result<Self, String> {
        Ok(Self { family: Family::of(name)?, name })
    }

    /// The one that all names of a file mean, each with the key that it stands under; `None` where no name says anything.
    pub(super) fn agreed(names: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Option<Self>, String> {
        let mut agreed: Option<(&str, Self)> = None;
        for (key, name) in names.into_iter().filter(|(_, name)| !name.trim().is_empty()) {
            let model = Self::of(name).map_err(|what| {
                // Two of the keys are everybody's.
                let other = if key.starts_with("model") {
                    format!("; leave `{key}` out if it is no lens's")
                } else {
                    String::new()
                };
                format!("`{key}`: {what}{other}")
            })?;
            let Some((before, other)) = agreed else {
                agreed = Some((key, model));
                continue;
            };
            let family = model.family.and(other.family).ok_or_else(|| {
                format!(
                    "`{before}` says `{}` and `{key}` says `{name}`, which are lenses of two kinds; leave the wrong one out",
                    other.name
                )
            })?;
            agreed = Some(if family == model.family { (key, model) } else { (before, other) });
        }
        Ok(agreed.map(|(_, model)| model))
    }

    /// Whether it says what the numbers of a list are.
    pub(super) fn is_of_lens(&self) -> bool {
        self.family != Family::Pinhole
    }

    /// Refuses numbers that are not zero where the model has none, or means by them what is not read.
    fn none_bent(&self, is_bent: bool) -> Result<(), String> {
        match self.family {
            Family::Straight if is_bent => Err(format!(
                "the lens model is `{}`, and numbers of distortion are given; name their model, or leave them out",
                self.name
            )),
            Family::Inverse if is_bent => Err(format!("the lens model `{}` is not read here; {REMEDY}", self.name)),
            _ => Ok(()),
        }
    }
}

/// A lens from a list of coefficients in OpenCV's order, and the name of its model where there is one: k1, k2, p1, p2, k3, k4, k5,
/// k6 and terms of a thin prism and a tilted sensor, of which 4, 5, 8, 12 or 14 are given; or the four of a fisheye.
///
/// # Errors
/// A sentence that names what is not read.
pub fn of_list(model: Option<&str>, list: &[f64]) -> Result<Distortion, String> {
    let model = model.filter(|name| !name.trim().is_empty()).map(Model::of).transpose()?;
    of_model(model.as_ref(), list)
}

/// The same of a model that is known already.
pub(super) fn of_model(model: Option<&Model<'_>>, list: &[f64]) -> Result<Distortion, String> {
    if let Some(bad) = list.iter().find(|value| !value.is_finite()) {
        return Err(format!("a coefficient of the lens is {bad}; calibrate the camera again"));
    }
    // Some programs fill a list up with zeros.
    let said = list.iter().rposition(|value| *value != 0.0).map_or(0, |last| last + 1);
    let beyond = |most: usize, name: &str| {
        if said <= most {
            return Ok(());
        }
        Err(format!("{} numbers of distortion are given, and the lens model `{name}` has {most}; {REMEDY}", list.len()))
    };
    let mut k = [0.0; 14];
    if let Some(model) = model {
        model.none_bent(said > 0)?;
        match model.family {
            Family::Fisheye => {
                beyond(4, model.name)?;
                if list.len() < 4 {
                    return Err(format!("{} numbers of distortion are given, and a fisheye has 4", list.len()));
                }
                return Ok(Distortion::Fisheye([list[0], list[1], list[2], list[3]]));
            }
            Family::Brown => beyond(5, model.name)?,
            Family::Straight | Family::Pinhole | Family::Inverse | Family::Rational => {}
        }
    }
    if ![0, 4, 5, 8, 12, 14].contains(&list.len()) && said > 0 {
        return Err(format!(
            "{} numbers of distortion are given, and a list of OpenCV has 4, 5, 8, 12 or 14; {REMEDY}",
            list.len()
        ));
    }
    k[..said.min(14)].copy_from_slice(&list[..said.min(14)]);
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
    lens_model: Option<String>,
    model: Option<String>,
    model_type: Option<String>,
    camera_type: Option<String>,
    is_fisheye: Option<bool>,
    fisheye: Option<bool>,
    k1: Option<f64>,
    k2: Option<f64>,
    k3: Option<f64>,
    k4: Option<f64>,
    k5: Option<f64>,
    k6: Option<f64>,
    p1: Option<f64>,
    p2: Option<f64>,
}

impl Keys {
    /// Keys that are a text: the name of a model.
    pub(super) const MODELS: [&str; 6] =
        ["camera_model", "distortion_model", "lens_model", "model", "model_type", "camera_type"];
    /// Keys that are true or false.
    pub(super) const FLAGS: [&str; 2] = ["is_fisheye", "fisheye"];
    /// Keys that are a number.
    pub(super) const NUMBERS: [&str; 8] = ["k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"];

    /// These, and those of `common` where these say nothing.
    #[must_use]
    pub fn or(&self, common: &Self) -> Self {
        let text = |own: &Option<String>, other: &Option<String>| own.clone().or_else(|| other.clone());
        Self {
            camera_model: text(&self.camera_model, &common.camera_model),
            distortion_model: text(&self.distortion_model, &common.distortion_model),
            lens_model: text(&self.lens_model, &common.lens_model),
            model: text(&self.model, &common.model),
            model_type: text(&self.model_type, &common.model_type),
            camera_type: text(&self.camera_type, &common.camera_type),
            is_fisheye: self.is_fisheye.or(common.is_fisheye),
            fisheye: self.fisheye.or(common.fisheye),
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

    /// The model that the names and the flags mean.
    pub(super) fn model(&self) -> Result<Option<Model<'_>>, String> {
        let texts = [
            &self.camera_model,
            &self.distortion_model,
            &self.lens_model,
            &self.model,
            &self.model_type,
            &self.camera_type,
        ];
        let names = Self::MODELS.into_iter().zip(texts).filter_map(|(key, name)| Some((key, name.as_deref()?)));
        let flags = Self::FLAGS.into_iter().zip([self.is_fisheye, self.fisheye]);
        let flags = flags.filter(|(_, is_set)| *is_set == Some(true)).map(|(key, _)| (key, "fisheye"));
        Model::agreed(names.chain(flags))
    }

    /// The lens.
    ///
    /// # Errors
    /// A sentence that names what is not read.
    pub fn distortion(&self) -> Result<Distortion, String> {
        let [k1, k2, k3, k4, k5, k6, p1, p2] =
            [self.k1, self.k2, self.k3, self.k4, self.k5, self.k6, self.p1, self.p2].map(|value| value.unwrap_or(0.0));
        let model = self.model()?;
        let family = model.map_or(Family::Brown, |model| model.family);
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
        let list = [k1, k2, p1, p2, k3, k4, k5, k6];
        if let Some(model) = &model {
            model.none_bent(list.iter().any(|value| *value != 0.0))?;
        }
        of_list(Some("rational_polynomial"), &list)
    }
}
