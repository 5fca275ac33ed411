//! Keys of JSON files that speak of a camera's lens: which are read, which belong to a camera that stands in a table of its own, and
//! which are refused by name because they may mean a lens that is not read.

use super::coefficients::Keys;
use serde::Deserialize;
use serde::de::IgnoredAny;
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// Names of the camera's matrix.
pub(super) const MATRIX: [&str; 8] =
    ["K", "k", "cameraMatrix", "camera_matrix", "intrinsic_matrix", "intrinsics", "mtx", "cam_matrix"];
/// Names of the list of coefficients.
pub(super) const COEFFICIENTS: [&str; 9] = [
    "D",
    "d",
    "distCoeffs",
    "dist_coeffs",
    "distortion_coefficients",
    "distortion_coeffs",
    "distortion",
    "dist",
    "coeffs",
];
/// Numbers of the pinhole, one by one; librealsense has names of its own for the last two.
pub(super) const PINHOLE: [&[&str]; 4] = [&["fx"], &["fy"], &["cx", "ppx"], &["cy", "ppy"]];
/// Columns and rows.
pub(super) const SIZE: [&[&str]; 2] = [&["width", "image_width"], &["height", "image_height"]];
/// Kalibr's list of both.
pub(super) const RESOLUTION: &str = "resolution";
/// Keys of lists of pictures, whose pixels count from elsewhere.
pub(super) const ELSEWHERE: [&str; 4] = ["fl_x", "fl_y", "camera_angle_x", "camera_angle_y"];
/// Terms of lenses that are not read.
pub(super) const TERMS: [&str; 11] = ["s1", "s2", "s3", "s4", "k7", "k8", "p3", "p4", "tau_x", "tau_y", "skew"];
/// Names that are the lens's in a table of a camera, and may be anything's in another.
const COMMON: [&str; 8] = ["k", "d", "model", "model_type", "cx", "cy", "p1", "p2"];
/// The deepest table that is looked into.
const DEEPEST: usize = 4;

/// Whether a key names something of a lens, by its words: a fisheye, coefficients, intrinsics, a mirror's `xi`, a focal length.
pub(super) fn speaks_of_lens(key: &str) -> bool {
    let mut words = String::new();
    let mut was_small = false;
    for letter in key.chars() {
        if was_small && letter.is_uppercase() {
            words.push(' ');
        }
        was_small = letter.is_lowercase();
        words.extend(if letter.is_alphanumeric() { letter } else { ' ' }.to_lowercase());
    }
    words.split(' ').any(|word| {
        ["dist", "xi", "fx", "fy", "ppx", "ppy"].contains(&word)
            || ["distort", "lens", "intrin", "focal"].iter().any(|start| word.starts_with(start))
            || word.contains("coef")
            || word.contains("fisheye")
    })
}

/// Whether a key is read of a camera beside a picture.
pub(super) fn is_read(key: &str) -> bool {
    let singly = PINHOLE.iter().chain(&SIZE).any(|names| names.contains(&key));
    let listed = MATRIX.contains(&key) || COEFFICIENTS.contains(&key) || key == RESOLUTION;
    singly || listed || Keys::MODELS.contains(&key) || Keys::FLAGS.contains(&key) || Keys::NUMBERS.contains(&key)
}

/// Whether a table is of a camera: it holds a key that is a lens's everywhere.
fn is_camera(table: &Map<String, Value>, depth: usize) -> bool {
    table.iter().any(|(key, value)| {
        let is_size = SIZE.iter().any(|names| names.contains(&key.as_str())) || key == RESOLUTION;
        let is_own = is_read(key) && !is_size && !COMMON.contains(&key.as_str());
        let inside = |table: &Map<String, Value>| depth < DEEPEST && is_camera(table, depth + 1);
        is_own || speaks_of_lens(key) || ELSEWHERE.contains(&key.as_str()) || value.as_object().is_some_and(inside)
    })
}

/// The keys of a file with those of the tables in it that are of a camera.
///
/// # Errors
/// A sentence that names the key which two of them give differently.
pub(super) fn flattened(file: &Map<String, Value>) -> Result<Map<String, Value>, String> {
    let mut flat = Map::new();
    spread(file, None, 0, &mut flat)?;
    Ok(flat)
}

fn spread(
    table: &Map<String, Value>,
    name: Option<&str>,
    depth: usize,
    flat: &mut Map<String, Value>,
) -> Result<(), String> {
    for (key, value) in table.iter().filter(|(_, value)| !value.is_null()) {
        match value {
            // A matrix of OpenCV holds its numbers as `data`.
            Value::Object(inner) if !inner.contains_key("data") => {
                if depth < DEEPEST && is_camera(inner, 0) {
                    spread(inner, Some(key), depth + 1, flat)?;
                }
            }
            _ => {
                let before = flat.insert(key.clone(), value.clone());
                let is_of_camera = is_read(key) || speaks_of_lens(key);
                if is_of_camera && before.is_some_and(|before| before != *value) {
                    return Err(format!(
                        "`{key}` of `{}` differs from another `{key}` of the file; leave in the camera of the picture alone",
                        name.unwrap_or("the file")
                    ));
                }
            }
        }
    }
    Ok(())
}

/// What a list of pictures holds under a key that is none of its own.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(untagged)]
pub enum Other {
    /// A table of keys.
    Table(BTreeMap<String, IgnoredAny>),
    /// Anything else.
    Value(IgnoredAny),
}

/// Refuses keys of a list of pictures that speak of the lens or its pinhole and are not read there.
///
/// # Errors
/// A sentence that names the key.
pub fn none_unread(others: &BTreeMap<String, Other>, own: impl Fn(&str) -> bool) -> Result<(), String> {
    let is_unread = |key: &str| {
        let singly = PINHOLE[..2].iter().any(|names| names.contains(&key));
        let listed = MATRIX.contains(&key) || COEFFICIENTS.contains(&key);
        !own(key) && (singly || listed || TERMS.contains(&key) || speaks_of_lens(key))
    };
    for (key, other) in others {
        let inside = match other {
            Other::Table(table) => {
                table.keys().find(|inner| (own(inner) && !COMMON.contains(&inner.as_str())) || is_unread(inner))
            }
            Other::Value(_) => None,
        };
        if let Some(inner) = inside {
            return Err(format!(
                "`{key}` holds `{inner}`, which is read beside `frames` or in a frame alone: move it there"
            ));
        }
        if is_unread(key) {
            return Err(format!(
                "`{key}` is not read here: give the pinhole as `fl_x`, `fl_y`, `cx`, `cy` and the lens as `k1` to `k6`, `p1`, `p2` \
                 with `camera_model`"
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_of_lenses_are_known_by_their_words() {
        for key in ["distCoeffs", "my_dist", "lensModel", "isFisheye", "Intrinsics", "xi", "focal_length", "cam.coeffs"]
        {
            assert!(speaks_of_lens(key), "{key}");
        }
        for key in ["distance", "is_undistorted", "camera_label", "maximum", "O_T_EE", "fixed", "silence"] {
            assert!(!speaks_of_lens(key), "{key}");
        }
    }

    #[test]
    fn a_list_refuses_what_may_be_a_lens_and_passes_over_the_rest() {
        let refused = |text: &str| {
            let others: BTreeMap<String, Other> = serde_json::from_str(text).expect("keys");
            none_unread(&others, |key| ["fl_x", "k1", "cx"].contains(&key))
        };
        assert_eq!(
            refused(r#"{"aabb": [1], "camera": "left", "robot": {"model": "fr3"}, "fl_x": 2, "k1": 0}"#),
            Ok(())
        );
        for (text, what) in [
            (r#"{"distCoeffs": [1]}"#, "`distCoeffs`"),
            (r#"{"fx": 1}"#, "`fx`"),
            (r#"{"s1": 1}"#, "`s1`"),
            (r#"{"camera": {"fl_x": 1}}"#, "`camera` holds `fl_x`"),
            (r#"{"rig": {"distortion": 1}}"#, "`rig` holds `distortion`"),
        ] {
            assert!(refused(text).expect_err(text).contains(what), "{text}");
        }
    }
}
