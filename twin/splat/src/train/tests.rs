//! A cloud that comes to look like the photographs, stops, goes on, and refuses what does not fit.

use super::*;
use crate::cloud::Splat;
use crate::lens::Lens;
use nalgebra::{Isometry3, Point3, UnitQuaternion};
use shared_mem::lens::Distortion;

const SIZE: [usize; 2] = [64, 48];
const LENS: Lens = Lens { focal: [80.0; 2], centre: [31.5, 23.5], distortion: Distortion::NONE };

/// A ball of discs; `color` of a direction.
fn ball(color: impl Fn(&Vector3<f32>) -> [f32; 3]) -> SplatCloud {
    let mut cloud = SplatCloud::default();
    for i in 0..400u16 {
        let z = 1.0 - (2.0 * f32::from(i) + 1.0) / 400.0;
        let (sin, cos) = (f32::from(i) * 2.399_963_2).sin_cos();
        let r = (1.0 - z * z).sqrt();
        let way = Vector3::new(r * cos, r * sin, z);
        cloud.splats.push(Splat {
            centre: Point3::from(way * 0.1),
            rotation: UnitQuaternion::rotation_between(&Vector3::z(), &way).unwrap_or_default(),
            sigma: Vector3::new(0.009, 0.009, 0.002),
            opacity: 0.9,
        });
        cloud.harmonics.push(color(&way).map(|value| (value - 0.5) / 0.282_094_8));
    }
    cloud
}

fn photographs(cloud: &SplatCloud, count: usize) -> Vec<Photograph> {
    (0..count)
        .map(|i| {
            let around = i as f64 / count as f64 * std::f64::consts::TAU;
            let eye = Point3::new(0.4 * around.cos(), 0.4 * around.sin(), 0.15 * (3.0 * around).sin());
            let flip = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), std::f64::consts::PI);
            let camera_from_world = flip * Isometry3::look_at_rh(&eye, &Point3::origin(), &-Vector3::z());
            let parameters = Parameters::<f32>::of(cloud);
            let seen = Frame::<f32, COLOR_DEPTH>::new(&parameters, &camera_from_world, &LENS, SIZE).planes();
            let cover = |at: usize| 1.0 - seen.left[at];
            let pixels = 0..SIZE[0] * SIZE[1];
            let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
            Photograph {
                camera: Camera { lens: LENS, camera_from_world },
                size: SIZE,
                rgb: pixels.clone().map(|at| [0, 1, 2].map(|c| byte(seen.channels[c][at]))).collect(),
                mask: Some(pixels.clone().map(|at| byte(cover(at))).collect()),
                depth: Some(
                    pixels.map(|at| if cover(at) > 0.5 { seen.channels[3][at] / cover(at) } else { 0.0 }).collect(),
                ),
            }
        })
        .collect()
}

fn painted(way: &Vector3<f32>) -> [f32; 3] {
    [0.5 + 0.4 * (4.0 * way.x).sin(), 0.5 + 0.4 * (5.0 * way.y).cos(), 0.5 + 0.3 * way.z]
}

#[test]
fn a_grey_ball_learns_the_colours_of_photographs_and_shows_a_view_that_it_was_not_shown() {
    let photographs = photographs(&ball(painted), 9);
    let (held, shown) = photographs.split_first().expect("nine");
    let grey = ball(|_| [0.5; 3]);
    let before = held.quality(&grey, [0.0; 3]);
    let mut last = 0;
    let settings = Settings { rates: Rates { color: 0.04, ..Rates::default() }, ..Settings::object(300) };
    let trained = train(&grey, shown, &settings, |progress| {
        last = progress.step;
        ControlFlow::Continue(())
    });
    let after = held.quality(&trained.expect("a cloud"), [0.0; 3]);
    assert!(last == 300 && after.inside > before.inside + 8.0, "{before:?} {after:?}");
}

#[test]
fn a_training_that_is_stopped_goes_on_to_the_same_end() {
    let photographs = photographs(&ball(painted), 5);
    let grey = ball(|_| [0.5; 3]);
    let folder = tempfile::tempdir().expect("a folder");
    let settings = Settings { state: Some(folder.path().join("state")), ..Settings::scene(30) };
    let going = |_: &Progress| ControlFlow::Continue(());
    let whole = train(&grey, &photographs, &Settings { state: None, ..settings.clone() }, going).expect("a cloud");
    let stop =
        |progress: &Progress| if progress.step == 11 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
    assert!(matches!(train(&grey, &photographs, &settings, stop), Err(TrainError::Stopped(11))));
    let other = train(&grey, &photographs[1..], &settings, going).expect_err("other photographs").to_string();
    assert!(other.contains("another training") && other.contains("remove it"), "{other}");
    let mut first = 0;
    let resumed = train(&grey, &photographs, &settings, |progress| {
        first = if first == 0 { progress.step } else { first };
        ControlFlow::Continue(())
    });
    assert_eq!((first, resumed.expect("a cloud")), (12, whole.clone()));
    let again = train(&grey, &photographs, &settings, |_| panic!("it has come to its end"));
    assert_eq!(again.expect("a cloud"), whole);
    // A bit of a number that flipped on the disk.
    let path = folder.path().join("state");
    let mut bytes = std::fs::read(&path).expect("the state");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&path, bytes).expect("a file");
    let damaged = train(&grey, &photographs, &settings, going).expect_err("damaged").to_string();
    assert!(damaged.contains("is damaged"), "{damaged}");
}

#[test]
fn what_cannot_be_trained_is_refused_in_one_line() {
    let grey = ball(|_| [0.5; 3]);
    let going = |_: &Progress| ControlFlow::Continue(());
    let mut photographs = photographs(&grey, 2);
    let settings = Settings::object(10);
    let error = |cloud: &SplatCloud, photographs: &[Photograph]| {
        train(cloud, photographs, &settings, going).expect_err("nothing to do").to_string()
    };
    assert!(error(&grey, &[]).contains("no photograph"));
    assert!(error(&SplatCloud::default(), &photographs).contains("no splat"));
    photographs[1].mask = Some(vec![0; 7]);
    assert!(error(&grey, &photographs).contains("photograph 1: its mask has 7 pixels"));
}
