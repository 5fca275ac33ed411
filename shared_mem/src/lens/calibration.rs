//! A camera in a JSON file beside a picture, by the names of ROS (`CameraInfo`), OpenCV, librealsense and Kalibr, in the file or in a
//! table of it. The middle of the first pixel is at 0, 0.

use super::Distortion;
use super::coefficients::{Keys, Model, REMEDY, of_model};
use super::spelling::{
    COEFFICIENTS, ELSEWHERE, MATRIX, PINHOLE, RESOLUTION, SIZE, TERMS, flattened, is_read, speaks_of_lens,
};
use serde_json::{Map, Value};

/// What such a file says of its camera.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    /// fx, fy, cx, cy [pixel]; `None` where a lens is known and no pinhole.
    pub pinhole: Option<[f64; 4]>,
    /// The lens.
    pub distortion: Distortion,
    /// Columns and rows that it is for, where the file says them.
    pub size: Option<[usize; 2]>,
    /// Whether the lens is k1, k2, p1, p2 because nothing says what its four numbers are.
    pub is_unnamed: bool,
}

impl Calibration {
    /// Of the keys of a file; `None` where it says nothing about its camera.
    ///
    /// # Errors
    /// A sentence that names the key which is not read, or holds what cannot be.
    pub fn of(file: &Map<String, Value>) -> Result<Option<Self>, String> {
        let file = &flattened(file)?;
        if let Some(key) = file.keys().find(|key| ELSEWHERE.contains(&key.as_str())) {
            return Err(format!(
                "`{key}` is not read here: give the pinhole as `K` (nine numbers) or `fx`, `fy`, `cx`, `cy` and the lens as `D`"
            ));
        }
        if let Some(key) = file.keys().find(|key| speaks_of_lens(key) && !is_read(key)) {
            return Err(format!(
                "`{key}` may be of a lens that is not read here: {REMEDY}; leave `{key}` out only where it says nothing about the lens"
            ));
        }
        let (pinhole, list) = (pinhole(file)?, one(file, &COEFFICIENTS)?);
        let has_numbers = Keys::NUMBERS.iter().any(|key| file.contains_key(*key));
        // A name that stands alone may be anything's.
        if pinhole.is_none() && list.is_none() && !has_numbers {
            return Ok(None);
        }
        let keys = lens_keys(file)?;
        let model = keys.model()?;
        let coefficients = match list {
            None => Vec::new(),
            Some((key, list)) => {
                numbers(list).ok_or_else(|| format!("`{key}` is no list of numbers: the lens's coefficients"))?
            }
        };
        let distortion = match list {
            Some((key, _)) if has_numbers => {
                return Err(format!("holds `{key}` and single numbers of a lens (`k1`, ...); leave one of them out"));
            }
            None if has_numbers => keys.distortion()?,
            _ => of_model(model.as_ref(), &coefficients)?,
        };
        let is_named = model.as_ref().is_some_and(Model::is_of_lens);
        let is_unnamed = !is_named && coefficients.len() == 4 && distortion.is_bent();
        Ok(Some(Self { pinhole, distortion, size: size(file)?, is_unnamed }))
    }

    /// What is to be said about a lens whose numbers have no name.
    pub fn remark(&self) -> Option<String> {
        self.is_unnamed.then(|| {
            "four numbers of distortion stand without `distortion_model`: they were taken as k1, k2, p1, p2, as OpenCV has them; \
             say `equidistant` if they are a fisheye's"
                .to_owned()
        })
    }
}

/// The keys of the lens that stand one by one.
fn lens_keys(file: &Map<String, Value>) -> Result<Keys, String> {
    let mut own = Map::new();
    for (key, value) in file {
        let name = key.as_str();
        let (is_own, is_right, wanted) = if Keys::MODELS.contains(&name) {
            (true, value.is_string(), "text: the name of the lens's model")
        } else if Keys::FLAGS.contains(&name) {
            (true, value.is_boolean(), "`true` or `false`")
        } else {
            (Keys::NUMBERS.contains(&name), value.is_number(), "number")
        };
        if is_own && !is_right {
            return Err(format!("`{key}` is no {wanted}"));
        }
        if is_own {
            own.insert(key.clone(), value.clone());
        }
    }
    let has_numbers = Keys::NUMBERS.iter().any(|key| own.contains_key(*key));
    if let Some(term) = TERMS.iter().find(|term| has_numbers && file.contains_key(**term)) {
        return Err(format!("`{term}` is a term of the lens that is not read here; undistort the pictures"));
    }
    serde_json::from_value(Value::Object(own)).map_err(|_| "the keys of its lens are not of their kinds".to_owned())
}

/// fx, fy, cx, cy: of a matrix, of four numbers in their order, or of four keys.
fn pinhole(file: &Map<String, Value>) -> Result<Option<[f64; 4]>, String> {
    let single = PINHOLE.map(|names| one(file, names));
    let mut values = [None; 4];
    for (value, found) in values.iter_mut().zip(single) {
        *value =
            found?.map(|(key, value)| value.as_f64().ok_or_else(|| format!("`{key}` is no number"))).transpose()?;
    }
    let single = match values {
        [Some(fx), Some(fy), Some(cx), Some(cy)] => Some([fx, fy, cx, cy]),
        [None, None, ..] => None,
        _ => return Err("holds some of `fx`, `fy`, `cx` and `cy` (or `ppx`, `ppy`); give all four, or `K`".into()),
    };
    let Some((key, matrix)) = one(file, &MATRIX)? else { return Ok(single) };
    let list = numbers(matrix);
    let pinhole = match list.as_deref() {
        // Kalibr's order.
        Some(&[fx, fy, cx, cy]) => [fx, fy, cx, cy],
        Some(&[fx, skew, cx, other, fy, cy, 0.0, 0.0, 1.0]) => {
            if skew != 0.0 || other != 0.0 {
                return Err(format!("`{key}` has a skew of {skew}, which is not read here; undistort the pictures"));
            }
            [fx, fy, cx, cy]
        }
        _ => {
            return Err(format!(
                "`{key}` is no camera matrix: nine numbers, fx, 0, cx, 0, fy, cy, 0, 0, 1, or four, fx, fy, cx, cy"
            ));
        }
    };
    if single.is_some_and(|single| single != pinhole) {
        return Err(format!("`{key}` and `fx`, `fy`, `cx`, `cy` differ; leave one of them out"));
    }
    Ok(Some(pinhole))
}

/// Columns and rows.
fn size(file: &Map<String, Value>) -> Result<Option<[usize; 2]>, String> {
    let count = |names: &[&str]| -> Result<Option<usize>, String> {
        let Some((key, value)) = one(file, names)? else { return Ok(None) };
        let count = value.as_u64().and_then(|count| usize::try_from(count).ok());
        count.map(Some).ok_or_else(|| format!("`{key}` is no number of pixels"))
    };
    let singly = count(SIZE[0])?.zip(count(SIZE[1])?).map(|(width, height)| [width, height]);
    let listed = file.get(RESOLUTION).and_then(numbers);
    let listed = listed.and_then(|list| Some([*list.first()? as usize, *list.get(1)? as usize]));
    Ok(singly.or(listed))
}

/// The key of these that a file has. Two that say the same are one.
fn one<'a>(file: &'a Map<String, Value>, names: &[&'a str]) -> Result<Option<(&'a str, &'a Value)>, String> {
    let mut found = names.iter().filter_map(|name| Some((*name, file.get(*name)?)));
    let Some((key, value)) = found.next() else { return Ok(None) };
    match found.find(|(_, other)| *other != value) {
        Some((other, _)) => Err(format!("holds `{key}` and `{other}`, which differ; leave one of them out")),
        None => Ok(Some((key, value))),
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
        if ["camera_matrix", "cameraMatrix", "mtx", "fx", "intrinsics", "camera_info"]
            .iter()
            .all(|key| !file.contains_key(*key))
        {
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
        assert_eq!(ros.pinhole, Some([500.0, 505.0, 320.0, 240.0]));
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
            (json!({"D": [0.1], "d": [0.2]}), "`D` and `d`"),
            (json!({"fl_x": 500}), "`fl_x`"),
            (json!({"k1": 0.1, "s1": 0.1}), "`s1`"),
            (json!({"k1": 0.1, "D": (vec![0.1; 5])}), "`D` and single"),
            (json!({"xi": 1.2}), "`xi`"),
            (json!({"mirror_parameters": {"xi": 1.2}}), "`xi`"),
            (json!({"camera_model": "omni", "distortion_model": "radtan", "D": (vec![0.1; 4])}), "`omni`"),
            (json!({"camera_model": "ds", "distortion_model": "none", "D": []}), "`ds`"),
            (json!({"model_type": "MEI"}), "`MEI`"),
            (
                json!({"camera_model": "OPENCV_FISHEYE", "distortion_model": "plumb_bob", "D": (vec![0.1; 4])}),
                "two kinds",
            ),
            (json!({"distortion_model": "none", "D": (vec![0.1; 5])}), "`none`"),
            (json!({"lens_coefficients": [0.1]}), "`lens_coefficients`"),
            (json!({"fx": 500, "fy": 505}), "all four"),
            (json!({"left": {"D": [0.1]}, "right": {"D": [0.2]}}), "`right`"),
            (json!({"fisheye": "yes"}), "`fisheye`"),
            (json!({"camera_matrix": [500, 3, 320, 0, 505, 240, 0, 0, 1]}), "skew"),
            (json!({"camera_matrix": [500, 320]}), "no camera matrix"),
            (json!({"width": -1, "height": 480}), "`width`"),
        ] {
            let line = read(file).expect_err("it is refused");
            assert!(line.contains(what) && !line.contains('\n'), "{line}");
        }
        let alone = json!({"D": (vec![0.1; 5])});
        let alone = Calibration::of(alone.as_object().expect("keys")).expect("a file").expect("a lens");
        assert_eq!((alone.pinhole, alone.distortion), (None, Distortion::brown([0.1; 5])));
    }

    #[test]
    fn every_usual_spelling_is_read() {
        let five = [-0.3, 0.1, 6e-4, -4e-4, -0.02];
        let matrix = [[500, 0, 320], [0, 505, 240], [0, 0, 1]];
        let brown = Calibration {
            pinhole: Some([500.0, 505.0, 320.0, 240.0]),
            distortion: Distortion::brown(five),
            size: None,
            is_unnamed: false,
        };
        let pinhole = json!({"fx": 500, "fy": 505, "cx": 320, "cy": 240});
        for file in [
            json!({"cameraMatrix": matrix, "distCoeffs": [five]}),
            json!({"K": matrix, "dist": five}),
            json!({"mtx": matrix, "dist": five}),
            json!({"K": matrix, "coeffs": five, "model": "brown_conrady"}),
            json!({"ppx": 320, "ppy": 240, "fx": 500, "fy": 505, "model": "distortion.brown_conrady", "coeffs": five}),
            json!({"camera_info": {"k": matrix, "d": five, "distortion_model": "plumb_bob"}, "robot": {"model": "fr3"}}),
            json!({"intrinsics": pinhole, "distortion": {"k1": -0.3, "k2": 0.1, "p1": 6e-4, "p2": -4e-4, "k3": -0.02}}),
            json!({"camera_model": "pinhole", "intrinsics": [500, 505, 320, 240], "distortion_model": "radtan", "D": five}),
        ] {
            assert_eq!(read(file.clone()), Ok(Some(brown)), "{file}");
        }
        let four = [0.1, 0.2, 0.3, 0.4];
        for file in [
            json!({"D": four, "camera_type": "fisheye"}),
            json!({"D": four, "model": "equidistant"}),
            json!({"D": four, "fisheye": true}),
            json!({"D": four, "distortion_model": "kb4"}),
            json!({"camera_model": "pinhole", "distortion_model": "equidistant", "D": four}),
        ] {
            let camera = read(file.clone()).expect("a file").expect("a camera");
            assert_eq!((camera.distortion, camera.remark()), (Distortion::Fisheye(four), None), "{file}");
        }
        let kalibr = json!({"intrinsics": [500, 505, 320, 240], "resolution": [640, 480]});
        assert_eq!(read(kalibr).expect("a file").expect("a camera").size, Some([640, 480]));
        let zeros = json!({"D": [0, 0, 0, 0, 0], "distortion_model": "distortion.inverse_brown_conrady"});
        assert_eq!(read(zeros).expect("a file").expect("a camera").distortion, Distortion::NONE);
        // A robot's numbers beside a picture are no camera's.
        let robot = json!({"q": [0.1], "gains": {"k": [600], "d": [50]}, "robot": {"model": "fr3"}});
        assert_eq!(Calibration::of(robot.as_object().expect("keys")), Ok(None));
    }
}
