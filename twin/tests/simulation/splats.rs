//! Splats against the closed formula, meshes against rays, files against what is wrong with them.

use nalgebra::{Isometry3, Matrix2, Matrix3, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use proptest::prelude::*;
use shared_mem::lens::Distortion;
use splat::{Body, Lens, Picture, Shape, Splat, SplatCloud, Surroundings, render};
use std::path::Path;
use twin::render::{Hand, RobotSurface};

const SIZE: [usize; 2] = [160, 120];
const LENS: Lens = Lens { focal: [150.0, 140.0], centre: [81.3, 58.6], distortion: Distortion::NONE };
const DARK: Surroundings = Surroundings { background: [0.0; 3], light: Vector3::new(0.0, 0.0, -1.0) };
const BENT: Lens = Lens { distortion: Distortion::brown([-0.08, 0.04, 6e-4, -4e-4, 0.0]), ..LENS };

fn splat(centre: [f32; 3], sigma: [f32; 3], turn: [f32; 3], opacity: f32) -> Splat {
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::from(turn));
    Splat { centre: Point3::from(centre), rotation, sigma: Vector3::from(sigma), opacity }
}

fn cloud(splats: Vec<Splat>, color: [f32; 3]) -> SplatCloud {
    let harmonics = splats.iter().map(|_| color.map(|c| (c - 0.5) / 0.282_094_8)).collect();
    SplatCloud { splats, degree: 0, harmonics }
}

fn picture(lens: &Lens, clouds: &[&SplatCloud], camera_from_body: Isometry3<f64>) -> Picture {
    let bodies: Vec<Body<'_>> = (clouds.iter().enumerate())
        .map(|(number, cloud)| Body { shape: Shape::Splats(cloud), camera_from_body, instance: number as u32 + 1 })
        .collect();
    render(&bodies, lens, SIZE, &DARK)
}

#[test]
fn one_splat_is_the_gaussian_of_the_formula() {
    let (sigma, turn) = ([0.05, 0.012, 0.03], [0.4, -0.7, 0.3]);
    let one = cloud(vec![splat([0.07, -0.04, 1.2], sigma, turn, 0.8)], [0.9, 0.5, 0.2]);
    let seen = picture(&LENS, &[&one], Isometry3::identity());
    // The formula, spelled out: covariance in space, the pinhole's slope, the low-pass, the bell.
    let (x, y, z) = (0.07f32 as f64, -0.04f32 as f64, 1.2f32 as f64);
    let turn: Matrix3<f64> = one.splats[0].rotation.cast::<f64>().to_rotation_matrix().into();
    let variances = Matrix3::from_diagonal(&Vector3::from(sigma).cast::<f64>().map(|s| s * s));
    let [fx, fy] = LENS.focal;
    let slope = nalgebra::Matrix2x3::new(fx / z, 0.0, -fx * x / (z * z), 0.0, fy / z, -fy * y / (z * z));
    let covariance = slope * turn * variances * turn.transpose() * slope.transpose() + Matrix2::identity() * 0.3;
    let inverse = covariance.try_inverse().expect("a bell");
    let centre = Vector2::new(fx * x / z + LENS.centre[0], fy * y / z + LENS.centre[1]);
    for (i, (color, cover)) in seen.color.iter().zip(&seen.cover).enumerate() {
        let off = Vector2::new((i % SIZE[0]) as f64, (i / SIZE[0]) as f64) - centre;
        let bell = f64::from(0.8f32) * (-0.5 * (off.transpose() * inverse * off)[0]).exp();
        let alpha = if bell < 1.0 / 255.0 { 0.0 } else { bell };
        assert!((f64::from(*cover) - alpha).abs() < 1e-4, "{cover} instead of {alpha}");
        assert!((f64::from(color[0]) - 0.9 * alpha).abs() < 1e-4);
    }
    let middle = 53 * SIZE[0] + 90;
    assert!((seen.depth[middle] - 1.2).abs() < 1e-6 && seen.instance[middle] == 1);
}

#[test]
fn nearer_splats_hide_farther_ones_whatever_body_is_drawn_first() {
    let near = cloud(vec![splat([0.0, 0.0, 1.0], [0.05; 3], [0.0; 3], 0.9)], [1.0, 0.0, 0.0]);
    let far = cloud(vec![splat([0.0, 0.0, 2.0], [0.2; 3], [0.0; 3], 0.9)], [0.0, 1.0, 0.0]);
    let middle = 59 * SIZE[0] + 81;
    for (clouds, instance) in [([&near, &far], 1), ([&far, &near], 2)] {
        let seen = picture(&LENS, &clouds, Isometry3::identity());
        assert!((seen.color[middle][0] - 0.9).abs() < 0.01 && (seen.color[middle][1] - 0.09).abs() < 0.01);
        assert_eq!(seen.instance[middle], instance);
        assert!((f64::from(seen.cover[middle]) - 0.99).abs() < 0.01);
    }
}

#[test]
fn a_mesh_hides_the_splats_behind_it_and_shows_through_those_before_it() {
    let cell = shared_mem::cell::Cell::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml"));
    let surface = RobotSurface::new(&cell.expect("the shipped cell"), Hand::None).expect("a robot");
    let first_link = surface.links().iter().position(|link| *link == 1).expect("a link");
    let mesh = &surface.parts()[first_link];
    let camera_from_mesh = Isometry3::translation(0.0, 0.0, 1.0);
    let at = |z: f32, opacity: f32| cloud(vec![splat([0.0, 0.0, z], [0.2; 3], [0.0; 3], opacity)], [1.0, 0.0, 1.0]);
    let (front, behind) = (at(0.6, 0.5), at(2.0, 0.9));
    let with = |cloud: &SplatCloud| {
        let bodies = [
            Body { shape: Shape::Mesh(mesh), camera_from_body: camera_from_mesh, instance: 7 },
            Body { shape: Shape::Splats(cloud), camera_from_body: Isometry3::identity(), instance: 8 },
        ];
        render(&bodies, &LENS, SIZE, &DARK)
    };
    let none = SplatCloud::default();
    let (alone, hidden, veiled) = (with(&none), with(&behind), with(&front));
    let on_mesh: Vec<usize> = (0..alone.instance.len()).filter(|i| alone.instance[*i] == 7).collect();
    assert!(on_mesh.len() > 200, "{} pixels of the mesh", on_mesh.len());
    for i in on_mesh {
        assert_eq!((hidden.color[i], hidden.instance[i]), (alone.color[i], 7));
        assert!(veiled.color[i] != alone.color[i] && veiled.depth[i] < alone.depth[i]);
    }
}

#[test]
fn the_robots_silhouette_is_what_rays_hit() {
    let cell = shared_mem::cell::Cell::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml"));
    let surface = RobotSurface::new(&cell.expect("the shipped cell"), Hand::None).expect("a robot");
    let q = *surface.model().ready();
    let eye = Point3::new(1.3, 0.9, 0.9);
    let up = -Vector3::z();
    let flip = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
    let camera_from_base = flip * Isometry3::look_at_rh(&eye, &Point3::new(0.2, 0.0, 0.35), &up);
    let mut placed = Vec::new();
    surface.for_each(&q, |part, pose| placed.push((part, camera_from_base * pose)));
    let fisheye = Lens { distortion: Distortion::Fisheye([-0.03, 0.008, -0.004, 6e-4]), ..LENS };
    let rational = [1.2, 0.35, 4e-4, -7e-4, 0.02, 1.45, 0.52, 0.06];
    let rational = Lens { distortion: Distortion::Polynomial(rational), ..LENS };
    for lens in [LENS, BENT, rational, fisheye] {
        let bodies: Vec<Body<'_>> = (placed.iter())
            .map(|(part, pose)| Body {
                shape: Shape::Mesh(&surface.parts()[*part]),
                camera_from_body: *pose,
                instance: *part as u32 + 1,
            })
            .collect();
        let seen = render(&bodies, &lens, SIZE, &DARK);
        let triangles: Vec<[Point3<f64>; 3]> = (placed.iter())
            .flat_map(|(part, pose)| {
                let mesh = &surface.parts()[*part];
                mesh.triangles.iter().map(move |t| t.map(|i| pose * mesh.points[i as usize].cast::<f64>()))
            })
            .collect();
        let (mut both, mut either) = (0, 0);
        for (i, drawn) in seen.instance.iter().enumerate() {
            let ray = lens.ray([(i % SIZE[0]) as f64, (i / SIZE[0]) as f64]);
            let hit = triangles.iter().any(|t| faces_and_hits(t, &ray));
            both += u32::from(hit && *drawn > 0);
            either += u32::from(hit || *drawn > 0);
        }
        assert!(either > 300, "{either} pixels of the robot");
        // A lookup through a bent lens rounds to the nearest pixel of the pinhole's picture, and the arm is a few pixels wide.
        let least = match lens.distortion {
            _ if lens == LENS => 0.995,
            Distortion::Fisheye(_) => 0.95,
            Distortion::Polynomial(_) => 0.97,
        };
        let iou = f64::from(both) / f64::from(either);
        assert!(iou > least, "{:?}: {iou}", lens.distortion);
    }
}

/// Whether a ray from the origin meets a triangle that faces it (Moeller & Trumbore 1997).
fn faces_and_hits([a, b, c]: &[Point3<f64>; 3], ray: &Vector3<f64>) -> bool {
    let (ab, ac) = (b - a, c - a);
    let p = ray.cross(&ac);
    let volume = ab.dot(&p);
    if volume < 1e-15 {
        return false;
    }
    let u = -a.coords.dot(&p) / volume;
    let q = (-a.coords).cross(&ab);
    let v = ray.dot(&q) / volume;
    u >= 0.0 && v >= 0.0 && u + v <= 1.0 && ac.dot(&q) / volume > 0.0
}

#[test]
fn a_body_that_moves_takes_its_splats_and_their_colours_with_it() {
    let mut one = cloud(vec![splat([0.05, 0.0, 0.1], [0.04, 0.01, 0.02], [0.2, 0.1, 0.0], 0.9)], [0.6; 3]);
    one.degree = 1;
    one.harmonics.extend([[0.3, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 0.2]]);
    let pose =
        Isometry3::from_parts(Translation3::new(0.1, 0.0, 1.4), UnitQuaternion::from_euler_angles(0.4, 0.9, -0.2));
    let there = picture(&LENS, &[&one], pose);
    // The same splat, moved by hand and looked at by a camera that moved along: nothing else may change.
    let turned = Isometry3::from_parts(Translation3::identity(), UnitQuaternion::from_euler_angles(0.0, 0.0, 0.3));
    let mut moved = one.clone();
    let inner: Isometry3<f32> = turned.inverse().cast();
    moved.splats[0].centre = inner * one.splats[0].centre;
    moved.splats[0].rotation = inner.rotation * one.splats[0].rotation;
    moved.degree = 0;
    moved.harmonics.truncate(1);
    let again = picture(&LENS, &[&moved], pose * turned);
    for (a, b) in there.cover.iter().zip(&again.cover) {
        assert!((a - b).abs() < 1e-4, "{a} {b}");
    }
}

/// A PLY file with these splats: x, y, z, then one value for all other columns.
fn file(splats: &[[f32; 3]], other: f32) -> Vec<u8> {
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", splats.len());
    let names = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    names.split(' ').for_each(|name| header += &format!("property float {name}\n"));
    let mut bytes = (header + "end_header\n").into_bytes();
    for place in splats {
        place.iter().chain([other; 11].iter()).for_each(|value| bytes.extend(value.to_le_bytes()));
    }
    bytes
}

#[test]
fn a_file_is_read_as_its_columns_say() {
    let cloud = SplatCloud::parse(&file(&[[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]], -2.0)).expect("splats");
    assert_eq!(cloud.splats[1].centre, Point3::new(4.0, 5.0, 6.0));
    assert!((cloud.splats[0].opacity - 1.0 / (1.0 + 2.0f32.exp())).abs() < 1e-6);
    assert!((cloud.splats[0].sigma.x - (-2.0f32).exp()).abs() < 1e-6);
    assert_eq!((cloud.degree, cloud.harmonics.len()), (0, 2));
}

/// Three splats of the second degree, and a file of them with a header and rows as another program would write them.
fn written(change: impl Fn(&str) -> String, row: impl Fn(&[f32], &mut Vec<u8>)) -> (SplatCloud, Vec<u8>) {
    let splat = |i: usize| Splat {
        centre: Point3::new(0.1 * i as f32, -0.2, 0.3),
        rotation: UnitQuaternion::from_euler_angles(0.1 * i as f32, 0.2, -0.3),
        sigma: Vector3::new(0.01, 0.02, 0.03 + 0.01 * i as f32),
        opacity: 0.3 + 0.1 * i as f32,
    };
    let harmonics = (0..27).map(|i| [0.01 * i as f32, 0.02, -0.03 * i as f32]).collect();
    let cloud = SplatCloud { splats: (0..3).map(splat).collect(), degree: 2, harmonics };
    let bytes = cloud.ply();
    let end = bytes.windows(11).position(|window| window == b"end_header\n").expect("an end") + 11;
    let mut out = change(&String::from_utf8_lossy(&bytes[..end])).into_bytes();
    let values: Vec<f32> =
        bytes[end..].chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().expect("four"))).collect();
    values.chunks_exact(values.len() / 3).for_each(|values| row(values, &mut out));
    (cloud, out)
}

#[test]
fn files_of_other_systems_and_in_other_numbers_hold_the_same_splats() {
    let little = |values: &[f32], out: &mut Vec<u8>| values.iter().for_each(|v| out.extend(v.to_le_bytes()));
    let cases = [
        written(|header| header.replace('\n', "\r\n"), little),
        written(|header| header.replace('\n', "\r"), little),
        written(|header| header.replace("element", "comment of a trainer\nobj_info x\nelement"), little),
        written(
            |header| header.replace("little", "big"),
            |values, out| values.iter().for_each(|v| out.extend(v.to_be_bytes())),
        ),
        written(
            |header| header.replace("property float", "property double"),
            |values, out| values.iter().for_each(|v| out.extend(f64::from(*v).to_le_bytes())),
        ),
        written(
            |header| header.replace("binary_little_endian", "ascii"),
            |values, out| values.iter().for_each(|v| out.extend(format!("{v} ").into_bytes())),
        ),
        // The last column first.
        written(
            |header| {
                header
                    .replace("property float rot_3\n", "")
                    .replace("property float x\n", "property float rot_3\nproperty float x\n")
            },
            |values, out| little(&[&values[values.len() - 1..], &values[..values.len() - 1]].concat(), out),
        ),
    ];
    for (cloud, bytes) in cases {
        let read = SplatCloud::parse(&bytes).expect("splats");
        assert_eq!((read.degree, read.splats.len()), (2, 3));
        let off = |a: f32, b: f32| (a - b).abs() < 1e-5;
        for (read, splat) in read.splats.iter().zip(&cloud.splats) {
            assert!((read.centre - splat.centre).norm() < 1e-5 && (read.sigma - splat.sigma).norm() < 1e-5);
            assert!(read.rotation.angle_to(&splat.rotation) < 1e-3 && off(read.opacity, splat.opacity));
        }
        let colours = read.harmonics.as_flattened().iter().zip(cloud.harmonics.as_flattened());
        assert!(colours.into_iter().all(|(a, b)| off(*a, *b)));
    }
}

#[test]
fn a_splat_that_holds_no_number_costs_none_of_the_others() {
    let nan_in = |column: usize| {
        let nan = move |values: &[f32], out: &mut Vec<u8>| {
            let is_second = (values[0] - 0.1).abs() < 1e-6;
            for (number, value) in values.iter().enumerate() {
                let value = if is_second && number == column { f32::NAN } else { *value };
                out.extend(value.to_le_bytes());
            }
        };
        written(str::to_owned, nan)
    };
    for column in [1, 4, 10, 30, 33, 36] {
        let (cloud, bytes) = nan_in(column);
        let read = SplatCloud::parse(&bytes).expect("splats");
        let centres: Vec<Point3<f32>> = read.splats.iter().map(|splat| splat.centre).collect();
        assert_eq!(centres, [cloud.splats[0].centre, cloud.splats[2].centre], "column {column}");
        assert_eq!(read.harmonics.len(), 18);
    }
}

#[test]
fn discs_and_colours_of_a_higher_degree_are_read_as_far_as_they_are_drawn() {
    let without = |values: &[f32], out: &mut Vec<u8>| {
        let values = values.iter().enumerate().filter(|(number, _)| *number != values.len() - 5);
        values.for_each(|(_, v)| out.extend(v.to_le_bytes()));
    };
    let (cloud, bytes) = written(|header| header.replace("property float scale_2\n", ""), without);
    let read = SplatCloud::parse(&bytes).expect("discs");
    for (read, splat) in read.splats.iter().zip(&cloud.splats) {
        assert!((read.sigma.xy() - splat.sigma.xy()).norm() < 1e-5 && read.sigma.z < 0.01 * splat.sigma.x);
    }
    // The fourth degree has 24 coefficients of each colour beyond the first; here each says its own number.
    let more: String = (0..72).map(|n| format!("property float f_rest_{n}\n")).collect();
    let header = format!("ply\nformat binary_little_endian 1.0\nelement vertex 1\n{}end_header\n", {
        let names = "x y z f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
        names.split(' ').map(|name| format!("property float {name}\n")).collect::<String>() + &more
    });
    let rest = (0..72).map(|n| n as f32);
    let values: Vec<f32> = [0.5; 14].into_iter().chain(rest).collect();
    let bytes = [header.into_bytes(), values.iter().flat_map(|v| v.to_le_bytes()).collect()].concat();
    let read = SplatCloud::parse(&bytes).expect("splats");
    assert_eq!((read.degree, read.harmonics.len()), (3, 16));
    assert_eq!((read.harmonics[1], read.harmonics[15]), ([0.0, 24.0, 48.0], [14.0, 38.0, 62.0]));
}

#[test]
fn of_a_file_that_was_cut_the_whole_splats_are_read() {
    let whole = file(&[[0.0; 3], [1.0; 3], [2.0; 3]], 0.5);
    assert_eq!(SplatCloud::parse(&whole[..whole.len() - 1]).expect("two of three").splats.len(), 2);
    let text = |values: &[f32], out: &mut Vec<u8>| {
        let words: Vec<String> = values.iter().map(f32::to_string).collect();
        out.extend((words.join(" ") + "\n").into_bytes());
    };
    let (cloud, bytes) = written(|header| header.replace("binary_little_endian", "ascii"), text);
    // Its last number may have more digits than are left.
    for left in [2, 60] {
        let read = SplatCloud::parse(&bytes[..bytes.len() - left]).expect("some").splats.len();
        assert_eq!(read, if left == 2 { 3 } else { 2 }, "{left}");
    }
    assert_eq!(cloud.splats.len(), 3);
    // A table without rows behind the splats, and a blank behind the header.
    for (from, to) in [
        ("end_header\n", "element face 0\nproperty list uchar int vertex_indices\nend_header\n"),
        ("end_header\n", "end_header \n"),
    ] {
        let at = whole.windows(from.len()).position(|window| window == from.as_bytes()).expect("an end");
        let bytes = [&whole[..at], to.as_bytes(), &whole[at + from.len()..]].concat();
        assert_eq!(SplatCloud::parse(&bytes).expect(to).splats.len(), 3);
    }
}

#[test]
fn what_is_wrong_with_a_file_is_said_in_one_line() {
    let whole = file(&[[0.0; 3], [1.0; 3]], 0.5);
    // The header with one word changed, and the two rows as they were.
    let (header, rows) = whole.split_at(whole.len() - 2 * 14 * 4);
    let changed = |from: &str, to: &str| {
        let header = String::from_utf8_lossy(header).replace(from, to);
        [header.as_bytes(), rows].concat()
    };
    for (bytes, told) in [
        (whole[..whole.len() - 14 * 4 - 1].to_vec(), "cut short"),
        (whole[..60].to_vec(), "no end"),
        (file(&[[0.0; 3], [f32::NAN, 0.0, 0.0], [f32::NAN; 3]], 0.5), "2 of 3 splats"),
        (file(&[[f32::INFINITY; 3]], 0.5), "no finite number"),
        (file(&[[0.0; 3]], 200.0), "no finite number"),
        (b"glTF".to_vec(), "no PLY"),
        (changed("binary_little_endian", "ascii"), "format is ascii"),
        (changed("binary_little_endian", "binary"), "format is binary"),
        (changed("format binary_little_endian 1.0\n", ""), "does not say its format"),
        (changed("vertex 2", "vertex 10000000"), "cut short"),
        (changed("vertex 2", "vertex 18446744073709551615"), "more rows"),
        (changed("scale_1", "size"), "`scale_1`"),
    ] {
        let error = SplatCloud::parse(&bytes).expect_err(told);
        assert!(error.contains(told) && !error.contains('\n'), "{error}");
    }
}

proptest! {
    #[test]
    fn no_file_makes_the_reader_or_the_renderer_panic(
        cut in 0usize..600, at in 0usize..500, value in any::<u8>(), other in -20.0f32..20.0,
    ) {
        let mut bytes = file(&[[0.0, 0.0, 1.0], [0.3, -0.2, 0.06]], other);
        let at = at.min(bytes.len() - 1);
        bytes[at] = value;
        bytes.truncate(cut);
        if let Ok(cloud) = SplatCloud::parse(&bytes) {
            let seen = picture(&BENT, &[&cloud], Isometry3::identity());
            prop_assert!(seen.cover.iter().all(|c| (0.0..=1.0).contains(c)));
            prop_assert!(seen.color.iter().flatten().all(|c| c.is_finite()));
        }
    }
}
