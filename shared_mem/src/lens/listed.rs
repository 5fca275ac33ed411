//! Cameras as lists of pictures hold them, those of nerfstudio, instant-ngp, Blender and their kin: beside the frames or in each of
//! them, with focal lengths or with the angles that a picture's sides are seen under. Pixels count from the picture's upper left
//! corner, so that the middle of the first is (0.5, 0.5).

use super::Distortion;
use super::coefficients::Keys;
use super::spelling::{self, Other};
use serde::Deserialize;
use std::collections::BTreeMap;

/// What a list says of a camera, for all frames or for one.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
pub struct Numbers {
    fl_x: Option<f64>,
    fl_y: Option<f64>,
    camera_angle_x: Option<f64>,
    camera_angle_y: Option<f64>,
    cx: Option<f64>,
    cy: Option<f64>,
    w: Option<f64>,
    h: Option<f64>,
    #[serde(flatten)]
    lens: Keys,
}

/// A camera of a list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ListedCamera {
    /// Focal lengths along a row and along a column [pixel].
    pub focal: [f64; 2],
    /// Principal point: column, row [pixel].
    pub centre: [f64; 2],
    /// The lens.
    pub lens: Distortion,
}

/// The keys of [`Numbers`], but for the lens's.
const OWN: [&str; 8] = ["fl_x", "fl_y", "camera_angle_x", "camera_angle_y", "cx", "cy", "w", "h"];

impl Numbers {
    /// Whether a key is read.
    pub fn is_read(key: &str) -> bool {
        let of_lens = [&Keys::MODELS[..], &Keys::FLAGS, &Keys::NUMBERS].iter().any(|keys| keys.contains(&key));
        of_lens || OWN.contains(&key)
    }

    /// Refuses keys that speak of the lens or its pinhole and are not read.
    ///
    /// # Errors
    /// A sentence that names the key.
    pub fn none_unread(others: &BTreeMap<String, Other>) -> Result<(), String> {
        spelling::none_unread(others, Self::is_read)
    }

    /// The lens of a frame: by its own keys, and those of `all` frames where it has none.
    ///
    /// # Errors
    /// A sentence that names what is not read.
    pub fn distortion(&self, all: &Self) -> Result<Distortion, String> {
        self.lens.or(&all.lens).distortion()
    }

    /// Whether something is said about a focal length.
    pub fn has_focal(&self) -> bool {
        [self.fl_x, self.fl_y, self.camera_angle_x, self.camera_angle_y].iter().any(Option::is_some)
    }

    /// Columns and rows of a frame: its own, those of `all` frames, or those of its picture where neither says them.
    ///
    /// # Errors
    /// A sentence for what is no number of pixels, and that of `picture`.
    pub fn size(&self, all: &Self, picture: impl FnOnce() -> Result<[u32; 2], String>) -> Result<[u32; 2], String> {
        match (self.w.or(all.w), self.h.or(all.h)) {
            (Some(width), Some(height)) => Ok([whole(width, "w")?, whole(height, "h")?]),
            _ => picture(),
        }
    }

    /// The camera of a frame: its own numbers, and those of `all` frames where it has none. The size of the picture is asked for where
    /// something hangs on it.
    ///
    /// # Errors
    /// A sentence that names the key that is missing, or holds what cannot be.
    pub fn camera(&self, all: &Self, size: impl Fn() -> Result<[u32; 2], String>) -> Result<ListedCamera, String> {
        let lens = self.distortion(all)?;
        let said = if self.has_focal() { self } else { all };
        let [x, y] = [
            Self::focal((said.fl_x, said.camera_angle_x), 0, &size)?,
            Self::focal((said.fl_y, said.camera_angle_y), 1, &size)?,
        ];
        // Pixels are square where nothing else is said.
        let Some(either) = x.or(y) else {
            return Err("says nothing about its focal length: add `fl_x` [pixel], or `camera_angle_x`, the angle that its width \
                        is seen under [rad]"
                .into());
        };
        if matches!(lens, Distortion::Fisheye(_)) && said.fl_x.or(said.fl_y).is_none() {
            return Err("a fisheye's angle of view says no focal length: add `fl_x` and `fl_y` [pixel]".into());
        }
        let centre = match (self.cx.or(all.cx), self.cy.or(all.cy)) {
            (Some(x), Some(y)) => [x, y],
            (x, y) => {
                let middle = size()?.map(|side| 0.5 * f64::from(side));
                [x.unwrap_or(middle[0]), y.unwrap_or(middle[1])]
            }
        };
        let focal = [x.unwrap_or(either), y.unwrap_or(either)];
        if focal.iter().any(|f| !(f.is_finite() && *f > 0.0)) || centre.iter().any(|c| !c.is_finite()) {
            return Err(format!("a camera with the focal lengths {focal:?} and the principal point {centre:?}"));
        }
        Ok(ListedCamera { focal, centre, lens })
    }

    /// A focal length along rows (0) or columns (1) [pixel], as it is or from the angle that the side is seen under; `None` where
    /// neither is given.
    fn focal(
        (length, angle): (Option<f64>, Option<f64>),
        side: usize,
        size: impl Fn() -> Result<[u32; 2], String>,
    ) -> Result<Option<f64>, String> {
        match (length, angle) {
            (None, Some(angle)) if angle > 0.0 && angle < std::f64::consts::PI => {
                Ok(Some(0.5 * f64::from(size()?[side]) / (0.5 * angle).tan()))
            }
            (None, Some(angle)) => {
                let key = ["camera_angle_x", "camera_angle_y"][side];
                Err(format!("`{key}` is {angle}; it is an angle above 0 and below pi [rad]"))
            }
            (length, _) => Ok(length),
        }
    }

    /// Whether something is said about the lens.
    pub fn has_lens(&self) -> bool {
        self.lens != Keys::default()
    }
}

fn whole(pixels: f64, key: &str) -> Result<u32, String> {
    if (1.0..=1e6).contains(&pixels) && pixels.fract() == 0.0 {
        return Ok(pixels as u32);
    }
    Err(format!("`{key}` is {pixels}; it is a number of pixels"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(all: &str, own: &str) -> Result<ListedCamera, String> {
        let numbers = |text: &str| serde_json::from_str::<Numbers>(text).expect("numbers");
        let (own, all) = (numbers(own), numbers(all));
        let size = own.size(&all, || Ok([200, 100]))?;
        own.camera(&all, || Ok(size))
    }

    #[test]
    fn an_angle_and_the_pictures_size_are_as_good_as_a_focal_length() {
        let full = read(r#"{"fl_x": 100.0, "cx": 100, "cy": 50}"#, "{}").expect("a camera");
        // A right angle sees twice the focal length.
        let angle = read(r#"{"camera_angle_x": 1.5707963267948966}"#, "{}").expect("a camera");
        assert!((angle.focal[0] - 100.0).abs() < 1e-9 && angle.focal[0] == angle.focal[1]);
        assert_eq!(ListedCamera { focal: full.focal, ..angle }, full);
        let both = read(r#"{"camera_angle_x": 1.5707963267948966, "camera_angle_y": 1.0}"#, "{}").expect("a camera");
        assert!((both.focal[1] - 50.0 / 0.5f64.tan()).abs() < 1e-9);
        // A frame's own angle stands before the focal length of all frames.
        let own = read(r#"{"fl_x": 300.0}"#, r#"{"camera_angle_x": 1.5707963267948966}"#).expect("a camera");
        assert!((own.focal[0] - 100.0).abs() < 1e-9);
        let fisheye = read(r#"{"camera_model": "OPENCV_FISHEYE", "fl_x": 90, "k1": 0.01}"#, "{}").expect("a camera");
        assert_eq!(fisheye.lens, Distortion::Fisheye([0.01, 0.0, 0.0, 0.0]));
    }

    #[test]
    fn what_is_missing_or_cannot_be_is_named() {
        for (common, what) in [
            ("{}", "add `fl_x`"),
            (r#"{"camera_angle_x": 50.0}"#, "`camera_angle_x` is 50"),
            (r#"{"fl_x": 100.0, "w": 200.5, "h": 100}"#, "`w` is 200.5"),
            (r#"{"camera_angle_x": 1.0, "is_fisheye": true}"#, "fisheye"),
            (r#"{"fl_x": 100.0, "camera_model": "EQUIRECTANGULAR"}"#, "EQUIRECTANGULAR"),
        ] {
            let line = read(common, "{}").expect_err("it is refused");
            assert!(line.contains(what), "{line}");
        }
    }
}
