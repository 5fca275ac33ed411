//! A camera in a JSON file beside a picture, by the names of ROS (`CameraInfo`), OpenCV and Kalibr. The middle of the first pixel is
//! at 0, 0.

use super::Distortion;
use super::coefficients::of_list;
use serde_json::{Map, Value};

/// What such a file says of its camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// fx, fy, cx, cy [pixel].
    pub pinhole: [f64; 4],
    /// The lens.
    pub distortion: Distortion,
    /// Columns and rows that it is for, where the file says them.
    pub size: Option<[usize; 2]>,
    /// Whether the lens is k1, k2, p1, p2 because nothing says what its four numbers are.
    pub is_unnamed: bool,
}

/// Names of the camera's matrix.
const MATRIX: [&str; 5] = ["K", "k", "camera_matrix", "intrinsic_matrix", "intrinsics"];
/// Names of the coefficients.
const COEFFICIENTS: [&str; 6] = ["D", "d", "distortion_coefficients", "distortion_coeffs", "dist_coeffs", "distortion"];
/// Names of the lens's model; Kalibr has one of the pinhole besides.
const MODEL: [&str; 2] = ["distortion_model", "camera_model"];
/// Keys of lists of pictures, whose pixels count from elsewhere.
const ELSEWHERE: [&str; 17] = [
    "fl_x",
    "fl_y",
    "fx",
    "fy",
    "cx",
    "cy",
    "k1",
    "k2",
    "k3",
    "k4",
    "k5",
    "k6",
    "p1",
    "p2",
    "camera_angle_x",
    "xi",
    "is_fisheye",
];

impl Calibration {
    /// Of the keys of a file; `None` where it says nothing about its camera.
    ///
    /// # Errors
    /// A sentence that names the key which is not read, or holds what cannot be.
    pub fn of(file: &Map<String, Value>) -> Result<Option<Self>, String> {
        if let Some(key) = ELSEWHERE.iter().find(|key| file.contains_key(**key)) {
            return Err(format!(
                "`{key}` is not read here: give the pinhole as `K` (nine numbers) and the lens as `D`"
            ));
        }
        let (matrix, list) = (one(file, &MATRIX)?, one(file, &COEFFICIENTS)?);
        let Some((key, matrix)) = matrix else {
            return list.map_or(Ok(None), |(key, _)| Err(format!("holds `{key}` and no `K`; add `K`, nine numbers")));
        };
        let nine = numbers(matrix);
        let Some([fx, skew, cx, zero, fy, cy, 0.0, 0.0, 1.0]) = nine.as_deref() else {
            return Err(format!("`{key}` is no camera matrix: nine numbers, fx, 0, cx, 0, fy, cy, 0, 0, 1"));
        };
        if *skew != 0.0 || *zero != 0.0 {
            return Err(format!("`{key}` has a skew of {skew}, which is not read here; undistort the pictures"));
        }
        let model = MODEL.iter().find_map(|key| file.get(*key).filter(|value| !value.is_null()));
        let model = model.map(|value| value.as_str().ok_or("the name of the lens's model is no text")).transpose()?;
        let model = model.filter(|model| !model.is_empty());
        let coefficients = match list {
            None => Vec::new(),
            Some((key, list)) => {
                numbers(list).ok_or_else(|| format!("`{key}` is no list of numbers: the lens's coefficients"))?
            }
        };
        let distortion = of_list(model, &coefficients)?;
        let count = |names: [&str; 2]| -> Result<Option<usize>, String> {
            let Some((key, value)) = one(file, &names)? else { return Ok(None) };
            let count = value.as_u64().and_then(|count| usize::try_from(count).ok());
            count.map(Some).ok_or_else(|| format!("`{key}` is no number of pixels"))
        };
        let size = count(["width", "image_width"])?.zip(count(["height", "image_height"])?);
        Ok(Some(Self {
            pinhole: [*fx, *fy, *cx, *cy],
            distortion,
            size: size.map(|(width, height)| [width, height]),
            is_unnamed: model.is_none() && coefficients.len() == 4 && distortion.is_bent(),
        }))
    }

    /// What is to be said about a lens whose numbers have no name.
    #[must_use]
    pub fn remark(&self) -> Option<String> {
        self.is_unnamed.then(|| {
            "four numbers of distortion stand without `distortion_model`: they were taken as k1, k2, p1, p2, as OpenCV has them; \
             say `equidistant` if they are a fisheye's"
                .to_owned()
        })
    }
}

/// The key of these that a file has.
fn one<'a>(file: &'a Map<String, Value>, names: &[&'a str]) -> Result<Option<(&'a str, &'a Value)>, String> {
    let mut found = names.iter().filter_map(|name| Some((*name, file.get(*name).filter(|value| !value.is_null())?)));
    match (found.next(), found.next()) {
        (Some((one, _)), Some((other, _))) => Err(format!("holds `{one}` and `{other}`; leave one of them out")),
        (found, _) => Ok(found),
    }
}

/// Numbers in one list, in rows, or as OpenCV and ROS write a matrix with its `data`.
fn numbers(value: &Value) -> Option<Vec<f64>> {
    match value {
        Value::Object(matrix) => numbers(matrix.get("data")?),
        Value::Array(list) => {
            let mut out = Vec::with_capacity(list.len());
            for element in list {
                match element {
                    Value::Array(_) => out.extend(numbers(element)?),
                    _ => out.push(element.as_f64()?),
                }
            }
            Some(out)
        }
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn read(mut more: Value) -> Result<Option<Calibration>, String> {
        let file = more.as_object_mut().expect("keys");
        if !file.contains_key("camera_matrix") {
            file.insert("K".into(), json!([500, 0, 320, 0, 505, 240, 0, 0, 1]));
        }
        Calibration::of(file)
    }

    #[test]
    fn files_of_ros_opencv_and_kalibr_say_the_same() {
        let eight = [1.2, 0.35, 4e-4, -7e-4, 0.02, 1.45, 0.52, 0.06];
        let ros = read(json!({"D": eight, "distortion_model": "rational_polynomial", "width": 640, "height": 480}));
        let ros = ros.expect("a file").expect("a camera");
        assert_eq!((ros.distortion, ros.size), (Distortion::Polynomial(eight), Some([640, 480])));
        assert_eq!(ros.pinhole, [500.0, 505.0, 320.0, 240.0]);
        let rows = json!({
            "camera_matrix": [[500, 0, 320], [0, 505, 240], [0, 0, 1]], "dist_coeffs": [eight],
            "image_width": 640, "image_height": 480
        });
        assert_eq!(read(rows), Ok(Some(ros)));
        let data = json!({
            "camera_matrix": {"rows": 3, "cols": 3, "data": [500, 0, 320, 0, 505, 240, 0, 0, 1]},
            "distortion_coefficients": {"rows": 1, "cols": 8, "data": eight}, "width": 640, "height": 480
        });
        assert_eq!(read(data), Ok(Some(ros)));
        let fisheye = read(json!({"D": [0.1, 0.2, 0.3, 0.4], "distortion_model": "equidistant"})).expect("a file");
        assert_eq!(fisheye.expect("a camera").distortion, Distortion::Fisheye([0.1, 0.2, 0.3, 0.4]));
        assert_eq!(Calibration::of(&Map::new()), Ok(None));
    }

    #[test]
    fn four_numbers_without_a_name_are_remarked_on() {
        let camera = read(json!({"D": [0.1, 0.2, 0.0, 0.0]})).expect("a file").expect("a camera");
        assert_eq!(camera.distortion, Distortion::brown([0.1, 0.2, 0.0, 0.0, 0.0]));
        assert!(camera.remark().expect("a remark").contains("equidistant"));
        let named = read(json!({"D": [0.1, 0.2, 0.0, 0.0], "distortion_model": "plumb_bob"})).expect("a file");
        assert_eq!(named.expect("a camera").remark(), None);
    }

    #[test]
    fn what_is_not_read_is_refused_by_its_name() {
        for (file, what) in [
            (json!({"D": (vec![0.1; 8]), "distortion_model": "plumb_bob"}), "`plumb_bob`"),
            (json!({"D": (vec![0.1; 4]), "distortion_model": "omni"}), "`omni`"),
            (json!({"D": (vec![0.1; 7])}), "7 numbers"),
            (json!({"D": "none"}), "`D` is no list"),
            (json!({"D": [0.1], "d": [0.1]}), "`D` and `d`"),
            (json!({"k1": 0.1}), "`k1`"),
            (json!({"camera_matrix": [500, 3, 320, 0, 505, 240, 0, 0, 1]}), "skew"),
            (json!({"camera_matrix": [500, 320]}), "no camera matrix"),
            (json!({"width": -1, "height": 480}), "`width`"),
        ] {
            let line = read(file).expect_err("it is refused");
            assert!(line.contains(what) && !line.contains('\n'), "{line}");
        }
        let alone = json!({"D": (vec![0.1; 5])});
        let line = Calibration::of(alone.as_object().expect("keys")).expect_err("no matrix");
        assert!(line.contains("no `K`"), "{line}");
    }
}
