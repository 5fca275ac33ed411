//! Every lens, forward and back, against numbers of OpenCV and difference quotients.

use super::Distortion;
use super::coefficients::{Keys, of_list};

const BROWN: [f64; 5] = [-0.06, 0.05, 4e-4, -7e-4, -0.01];
const RATIONAL: [f64; 8] = [1.2, 0.35, 4e-4, -7e-4, 0.02, 1.45, 0.52, 0.06];
const FISHEYE: [f64; 4] = [-0.03, 0.008, -0.004, 6e-4];

fn lenses() -> [Distortion; 3] {
    [Distortion::brown(BROWN), Distortion::Polynomial(RATIONAL), Distortion::Fisheye(FISHEYE)]
}

/// Places in the plane z = 1, from the axis outwards.
fn places() -> impl Iterator<Item = [f64; 2]> {
    (0..200).map(|i| {
        let (turn, far) = (0.7 * f64::from(i), 0.004 * f64::from(i));
        [far * turn.cos(), far * turn.sin()]
    })
}

/// `cv2.projectPoints` and `cv2.fisheye.projectPoints` of OpenCV 5.0.0 with the camera matrix 1.
#[test]
fn points_land_where_opencv_puts_them() {
    let cases = [
        ([0.3, -0.2], [0.297_641_909, -0.198_436_606], 0),
        ([-0.45, 0.35], [-0.444_084_085_937_5, 0.345_351_789_062_5], 0),
        ([0.3, -0.2], [0.290_850_677_373_705, -0.193_909_118_249_136_7], 1),
        ([-0.45, 0.35], [-0.421_020_659_577_809_5, 0.327_413_568_560_518_45], 1),
        ([0.02, 0.01], [0.019_996_750_962_027_417, 0.009_998_750_481_013_709], 1),
        ([0.3, -0.2], [0.286_925_169_191_957_15, -0.191_283_446_127_971_43], 2),
        ([-1.6, 1.1], [-0.875_294_275_854_943_6, 0.601_764_814_650_273_8], 2),
        ([0.02, 0.01], [0.019_996_367_856_196_393, 0.009_998_183_928_098_196], 2),
    ];
    for ([x, y], there, lens) in cases {
        let found = lenses()[lens].bend(x, y).0;
        assert!((found.x - there[0]).abs() < 1e-12 && (found.y - there[1]).abs() < 1e-12, "{lens}: {found}");
    }
}

#[test]
fn backward_undoes_forward() {
    for lens in lenses() {
        for [x, y] in places() {
            let [u, v] = lens.straight(lens.bend(x, y).0.into()).expect("a ray");
            assert!((u - x).hypot(v - y) < 1e-9, "{lens:?} {x} {y}: {u} {v}");
        }
    }
    assert_eq!(Distortion::NONE.straight([0.3, 7.0]), Some([0.3, 7.0]));
}

#[test]
fn a_place_that_no_ray_reaches_has_none_and_a_direction_far_out() {
    // 2/(3 sqrt(3 * 0.3)) = 0.703 is the furthest that this lens shows anything.
    let barrel = Distortion::brown([-0.3, 0.0, 0.0, 0.0, 0.0]);
    for (lens, place) in [(barrel, [0.8, 0.0]), (Distortion::Fisheye([0.0; 4]), [0.0, 1.6])] {
        assert_eq!(lens.straight(place), None, "{lens:?}");
        let [x, y] = lens.direction(place);
        assert!(x.hypot(y) > 10.0 && x * place[0] + y * place[1] > 0.0, "{x} {y}");
    }
}

#[test]
fn slope_and_curvature_are_difference_quotients() {
    const STEP: f64 = 1e-6;
    for lens in lenses() {
        for [x, y] in places() {
            let (bent, slope) = lens.bend(x, y);
            let curvature = lens.curvature(x, y);
            for (along, [dx, dy]) in [[STEP, 0.0], [0.0, STEP]].into_iter().enumerate() {
                let (moved, turned) = lens.bend(x + dx, y + dy);
                let off = ((moved - bent) / STEP - slope.column(along)).amax();
                let bowed = ((turned - slope) / STEP - curvature[along]).amax();
                assert!(off < 1e-5 && bowed < 1e-4, "{lens:?} {x} {y}: {off} {bowed}");
            }
        }
    }
}

#[test]
fn single_precision_keeps_its_digits() {
    for lens in lenses() {
        for [x, y] in places() {
            let (wide, narrow) = (lens.bend(x, y), lens.of::<f32>().bend(x as f32, y as f32));
            assert!((wide.0 - narrow.0.map(f64::from)).amax() < 1e-6, "{lens:?} {x} {y}");
            assert!((wide.1 - narrow.1.map(f64::from)).amax() < 1e-5, "{lens:?} {x} {y}");
        }
    }
}

#[test]
fn lists_are_read_by_the_model_that_goes_with_them() {
    let read = |model: &str, list: &[f64]| of_list(Some(model), list).expect("a lens");
    assert_eq!(read("plumb_bob", &BROWN), Distortion::brown(BROWN));
    assert_eq!(read("radtan", &BROWN[..4]), Distortion::brown([BROWN[0], BROWN[1], BROWN[2], BROWN[3], 0.0]));
    assert_eq!(read("rational_polynomial", &RATIONAL), Distortion::Polynomial(RATIONAL));
    assert_eq!(read("Rational-Polynomial", &[&RATIONAL[..], &[0.0; 6]].concat()), Distortion::Polynomial(RATIONAL));
    assert_eq!(read("equidistant", &FISHEYE), Distortion::Fisheye(FISHEYE));
    assert_eq!(read("kannala_brandt4", &[&FISHEYE[..], &[0.0]].concat()), Distortion::Fisheye(FISHEYE));
    assert_eq!(of_list(None, &RATIONAL).expect("a lens"), Distortion::Polynomial(RATIONAL));
    assert_eq!(of_list(None, &[]).expect("a lens"), Distortion::NONE);
}

#[test]
fn what_is_not_read_is_refused_by_its_name() {
    let prism = [&RATIONAL[..], &[0.0, 0.0, 0.01, 0.0]].concat();
    let tilt = [&RATIONAL[..], &[0.0, 0.0, 0.0, 0.0, 0.01, 0.0]].concat();
    let cases: [(&str, &[f64], &str); 8] = [
        ("omnidirectional", &BROWN, "`omnidirectional`"),
        ("inverse_brown_conrady", &BROWN, "`inverse_brown_conrady`"),
        ("plumb_bob", &RATIONAL, "`plumb_bob` has 5"),
        ("equidistant", &BROWN, "`equidistant` has 4"),
        ("rational_polynomial", &prism, "thin prism"),
        ("rational_polynomial", &tilt, "tilted sensor"),
        ("rational_polynomial", &RATIONAL[..7], "7 numbers"),
        ("plumb_bob", &[f64::NAN; 5], "NaN"),
    ];
    for (model, list, what) in cases {
        let line = of_list(Some(model), list).expect_err("it is refused");
        assert!(line.contains(what) && !line.contains('\n'), "{line}");
    }
}

fn keys(text: &str) -> Result<Distortion, String> {
    serde_json::from_str::<Keys>(text).expect("keys").distortion()
}

#[test]
fn keys_of_a_list_of_pictures_make_the_same_lenses() {
    assert_eq!(keys("{}"), Ok(Distortion::NONE));
    let brown = r#"{"k1": -0.06, "k2": 0.05, "p1": 4e-4, "p2": -7e-4, "k3": -0.01, "k4": 0}"#;
    assert_eq!(keys(brown), Ok(Distortion::brown(BROWN)));
    let eight = r#"{"k1": 1.2, "k2": 0.35, "p1": 4e-4, "p2": -7e-4, "k3": 0.02, "k4": 1.45, "k5": 0.52, "k6": 0.06}"#;
    assert_eq!(keys(eight), Ok(Distortion::Polynomial(RATIONAL)));
    for said in [r#""camera_model": "OPENCV_FISHEYE""#, r#""is_fisheye": true"#, r#""distortion_model": "equidistant""#]
    {
        let text = format!(r#"{{{said}, "k1": -0.03, "k2": 0.008, "k3": -0.004, "k4": 6e-4}}"#);
        assert_eq!(keys(&text), Ok(Distortion::Fisheye(FISHEYE)));
    }
    let own: Keys = serde_json::from_str(r#"{"k1": 0.1}"#).expect("keys");
    let common: Keys = serde_json::from_str(r#"{"k1": 0.2, "k2": 0.3}"#).expect("keys");
    assert_eq!(own.or(&common).distortion(), Ok(Distortion::brown([0.1, 0.3, 0.0, 0.0, 0.0])));
    for (text, what) in [
        (r#"{"k1": 0.1, "k4": 0.2}"#, "`k4`"),
        (r#"{"camera_model": "OPENCV_FISHEYE", "p1": 0.2}"#, "`p1`"),
        (r#"{"camera_model": "EQUIRECTANGULAR"}"#, "`EQUIRECTANGULAR`"),
    ] {
        let line = keys(text).expect_err("it is refused");
        assert!(line.contains(what), "{line}");
    }
    let both = r#"{"camera_model": "OPENCV_FISHEYE", "distortion_model": "plumb_bob", "k1": 0.1}"#;
    assert!(keys(both).expect_err("a contradiction").contains("two kinds"));
    let omni = r#"{"camera_model": "omni", "distortion_model": "radtan", "k1": 0.1}"#;
    assert!(keys(omni).expect_err("another lens").contains("`omni`"));
    for said in [r#""camera_type": "fisheye""#, r#""fisheye": true"#] {
        let text = format!(r#"{{{said}, "k1": 0.1, "k2": 0, "k3": 0.2}}"#);
        assert_eq!(keys(&text), Ok(Distortion::Fisheye([0.1, 0.0, 0.2, 0.0])));
    }
}

#[test]
fn files_of_this_project_hold_five_numbers_eight_or_a_fisheye_by_name() {
    for (lens, text) in lenses().into_iter().zip(["[-0.06,0.05,", "[1.2,0.35,", r#"{"fisheye":[-0.03,"#]) {
        let written = serde_json::to_string(&lens).expect("JSON");
        assert!(written.starts_with(text), "{written}");
        assert_eq!(serde_json::from_str::<Distortion>(&written).expect("a lens"), lens);
    }
    let line = serde_json::from_str::<Distortion>("[1, 2, 3]").expect_err("no lens").to_string();
    assert!(line.contains("3 numbers"), "{line}");
}
