//! The device's pictures against the reference's. Where there is no Vulkan device nothing is compared, and the test says so.
#![cfg(feature = "render")]

use crate::eye::camera_from_base;
use crate::robot_splats::robot_splats;
use nalgebra::{Isometry3, Matrix2, Matrix3, Point3, Translation3, UnitQuaternion, Vector2, Vector3};
use shared_mem::lens::Distortion;
use splat::{Body, Lens, Picture, Shape, Splat, SplatCloud, Surroundings, render};
use std::path::Path;
use twin::render::device::{Device, DeviceCanvas, DeviceError};
use twin::render::{Drawer, Hand, Mesh, Model, Painter, RobotSurface};

const SIZE: [usize; 2] = [323, 241];
const LENS: Lens = Lens { focal: [290.0, 285.0], centre: [163.2, 118.7], distortion: Distortion::NONE };
const BENT: Lens = Lens { distortion: Distortion::brown([-0.08, 0.04, 6e-4, -4e-4, 0.01]), ..LENS };
const SKY: Surroundings = Surroundings { background: [0.66, 0.73, 0.8], light: Vector3::new(0.3, -0.8, -0.5) };

/// The device, or the reason why the test has nothing to say.
fn device() -> Option<Device> {
    match Device::open() {
        Ok(device) => Some(device),
        Err(DeviceError::Missing) => {
            eprintln!("skipped: no Vulkan device is here");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

fn robot() -> RobotSurface {
    let cell = shared_mem::cell::Cell::read(&Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml"));
    RobotSurface::new(&cell.expect("the shipped cell"), Hand::Franka { width: 0.04 }).expect("a robot")
}

/// The robot's parts where `q` puts them, in the camera's frame.
fn placed(robot: &RobotSurface, bend: f64) -> Vec<Isometry3<f64>> {
    let view = camera_from_base([1.2, 0.8, 0.8], [0.2, 0.0, 0.4]);
    let mut q = *robot.model().ready();
    q.iter_mut().for_each(|q| *q += bend);
    let mut poses = vec![Isometry3::identity(); robot.parts().len()];
    robot.for_each(&q, |part, pose| poses[part] = view * pose);
    poses
}

fn both(device: &Device, bodies: &[Body<'_>], lens: Lens) -> [Picture; 2] {
    let shapes: Vec<(Shape<'_>, u32)> = bodies.iter().map(|body| (body.shape, body.instance)).collect();
    let poses: Vec<Option<Isometry3<f64>>> = bodies.iter().map(|body| Some(body.camera_from_body)).collect();
    let mut canvas = DeviceCanvas::new(device, &shapes, lens, SIZE).expect("room for the models");
    [render(bodies, &lens, SIZE, &SKY), canvas.render(&poses, &SKY).expect("a picture")]
}

/// Peak signal to noise of the colours as bytes would hold them: 1 is the peak [dB].
fn psnr(a: &Picture, b: &Picture) -> f64 {
    let values = || a.color.iter().flatten().zip(b.color.iter().flatten());
    let off = |(a, b): (&f32, &f32)| f64::from(a.clamp(0.0, 1.0) - b.clamp(0.0, 1.0)).powi(2);
    -10.0 * (values().map(off).sum::<f64>() / values().count() as f64).max(1e-20).log10()
}

/// Colours alike by 45 dB at least; depth, number and cover the same except at a few pixels of a border.
fn compare(scene: &str, [wanted, drawn]: &[Picture; 2]) {
    let seen = wanted.cover.iter().filter(|cover| **cover > 0.5).count();
    let apart = |differs: &dyn Fn(usize) -> bool| (0..wanted.cover.len()).filter(|i| differs(*i)).count();
    let depth = apart(&|i| (wanted.depth[i] - drawn.depth[i]).abs() > 1e-3 * wanted.depth[i].max(0.1));
    let number = apart(&|i| wanted.instance[i] != drawn.instance[i]);
    let cover = apart(&|i| (wanted.cover[i] - drawn.cover[i]).abs() > 0.02);
    let psnr = psnr(wanted, drawn);
    eprintln!("{scene}: {psnr:.1} dB; of {seen} pixels {depth} differ in depth, {number} in number, {cover} in cover");
    assert!(seen > 4000, "{scene}: only {seen} pixels of the robot");
    assert!(psnr > 45.0, "{scene}: {psnr} dB");
    assert!([depth, number, cover].iter().all(|differ| differ * 200 < seen), "{scene}");
}

fn bodies_of<'a>(shapes: impl Iterator<Item = Shape<'a>>, poses: &[Isometry3<f64>]) -> Vec<Body<'a>> {
    (shapes.zip(poses).zip(1..))
        .map(|((shape, pose), instance)| Body { shape, camera_from_body: *pose, instance })
        .collect()
}

#[test]
fn splats_of_many_bodies_look_as_the_reference_draws_them() {
    let Some(device) = device() else { return };
    let robot = robot();
    let clouds = robot_splats(&robot, 20_000);
    compare("splats", &both(&device, &bodies_of(clouds.iter().map(Shape::Splats), &placed(&robot, 0.0)), LENS));
}

#[test]
fn meshes_look_as_the_reference_draws_them() {
    let Some(device) = device() else { return };
    let robot = robot();
    let bodies = bodies_of(robot.parts().iter().map(Shape::Mesh), &placed(&robot, 0.0));
    compare("meshes", &both(&device, &bodies, LENS));
}

#[test]
fn splats_and_meshes_share_a_picture_through_a_bent_lens() {
    let Some(device) = device() else { return };
    let robot = robot();
    let clouds = robot_splats(&robot, 20_000);
    let table = Mesh::plate([0.3, 0.0, 0.0], [0.7, 0.8], [196, 172, 140]);
    // Every second part as splats, so that the two hide each other.
    let part = |(number, (mesh, cloud))| if number % 2 == 0 { Shape::Mesh(mesh) } else { Shape::Splats(cloud) };
    let mut bodies = bodies_of(robot.parts().iter().zip(&clouds).enumerate().map(part), &placed(&robot, 0.1));
    let view = camera_from_base([1.2, 0.8, 0.8], [0.2, 0.0, 0.4]);
    bodies.push(Body { shape: Shape::Mesh(&table), camera_from_body: view, instance: 99 });
    compare("mixed", &both(&device, &bodies, BENT));
    let rational = Distortion::Polynomial([1.2, 0.35, 4e-4, -7e-4, 0.02, 1.45, 0.52, 0.06]);
    compare("rational", &both(&device, &bodies, Lens { distortion: rational, ..LENS }));
    let fisheye = Distortion::Fisheye([-0.03, 0.008, -0.004, 6e-4]);
    compare("fisheye", &both(&device, &bodies, Lens { distortion: fisheye, ..LENS }));
}

#[test]
fn bodies_move_and_vanish_without_a_new_upload() {
    let Some(device) = device() else { return };
    let robot = robot();
    let clouds = robot_splats(&robot, 5_000);
    let models = || clouds.iter().cloned().map(Model::Splats).zip(1..).collect::<Vec<_>>();
    let mut painters = [Drawer::Processor, Drawer::Device]
        .map(|drawer| Painter::new(drawer, models(), BENT, SIZE).expect("a painter"));
    assert_eq!(painters[1].name(), device.name());
    for bend in [0.0, 0.3, -0.2] {
        let mut poses: Vec<Option<Isometry3<f64>>> = placed(&robot, bend).into_iter().map(Some).collect();
        poses[3] = None;
        let [wanted, drawn] = painters.each_mut().map(|painter| painter.paint(&poses, &SKY).expect("a picture"));
        assert!(wanted.instance.iter().chain(&drawn.instance).all(|instance| *instance != 4));
        assert!(psnr(&wanted, &drawn) > 45.0);
    }
}

#[test]
fn one_splat_is_the_gaussian_of_the_formula() {
    let Some(device) = device() else { return };
    let rotation = UnitQuaternion::from_scaled_axis(Vector3::new(0.4, -0.7, 0.3f32));
    let (centre, sigma) = (Point3::new(0.07, -0.04, 1.2f32), Vector3::new(0.05, 0.012, 0.03f32));
    let color = [0.9, 0.5, 0.2f32];
    let cloud = SplatCloud {
        splats: vec![Splat { centre, rotation, sigma, opacity: 0.8 }],
        degree: 0,
        harmonics: vec![color.map(|c| (c - 0.5) / 0.282_094_8)],
    };
    let mut canvas = DeviceCanvas::new(&device, &[(Shape::Splats(&cloud), 1)], LENS, SIZE).expect("room");
    let dark = Surroundings { background: [0.0; 3], ..SKY };
    let seen = canvas.render(&[Some(Isometry3::identity())], &dark).expect("a picture");
    let [x, y, z] = [centre.x, centre.y, centre.z].map(f64::from);
    let turn: Matrix3<f64> = rotation.cast::<f64>().to_rotation_matrix().into();
    let variances = Matrix3::from_diagonal(&sigma.cast::<f64>().map(|s| s * s));
    let [fx, fy] = LENS.focal;
    let slope = nalgebra::Matrix2x3::new(fx / z, 0.0, -fx * x / (z * z), 0.0, fy / z, -fy * y / (z * z));
    let covariance = slope * turn * variances * turn.transpose() * slope.transpose() + Matrix2::identity() * 0.3;
    let inverse = covariance.try_inverse().expect("a bell");
    let middle = Vector2::new(fx * x / z + LENS.centre[0], fy * y / z + LENS.centre[1]);
    for (i, (drawn, cover)) in seen.color.iter().zip(&seen.cover).enumerate() {
        let off = Vector2::new((i % SIZE[0]) as f64, (i / SIZE[0]) as f64) - middle;
        let bell = f64::from(0.8f32) * (-0.5 * (off.transpose() * inverse * off)[0]).exp();
        // Whether exactly 1/255 counts is rounding.
        if (bell * 255.0 - 1.0).abs() < 1e-3 {
            continue;
        }
        let alpha = if bell < 1.0 / 255.0 { 0.0 } else { bell };
        assert!((f64::from(*cover) - alpha).abs() < 1e-4, "{cover} instead of {alpha}");
        (0..3).for_each(|c| assert!((f64::from(drawn[c]) - f64::from(color[c]) * alpha).abs() < 1e-4));
    }
}

#[test]
fn many_splats_in_one_tile_are_still_in_order() {
    let Some(device) = device() else { return };
    // A stack of 3,000 thin veils along the axis, in a mixed order: far more than a group sorts in its own memory.
    let splats: Vec<Splat> = (0..3000u32)
        .map(|i| Splat {
            centre: Point3::new(0.0, 0.0, 1.0 + (i * 1777 % 3000) as f32 * 1e-3),
            rotation: UnitQuaternion::identity(),
            sigma: Vector3::new(0.01, 0.01, 1e-4),
            opacity: 0.006,
        })
        .collect();
    let color = |i: u32| [(i * 1777 % 3000) as f32 / 1500.0 - 1.0, (i % 2) as f32, 0.3];
    let cloud = SplatCloud { splats, degree: 0, harmonics: (0..3000).map(color).collect() };
    let body = Body {
        shape: Shape::Splats(&cloud),
        camera_from_body: Isometry3::from_parts(Translation3::identity(), UnitQuaternion::identity()),
        instance: 1,
    };
    let [wanted, drawn] = both(&device, &[body], LENS);
    for (a, b) in wanted.color.iter().flatten().zip(drawn.color.iter().flatten()) {
        assert!((a - b).abs() < 2e-3, "{a} {b}");
    }
}

#[test]
fn what_the_device_does_not_hold_is_refused_in_one_line() {
    let Some(device) = device() else { return };
    let error = DeviceCanvas::new(&device, &[], LENS, [1_000_000, 2]).expect_err("no such texture").to_string();
    assert!(error.contains("1000000 x 2") && error.contains("on the processor") && !error.contains('\n'), "{error}");
    let empty = DeviceCanvas::new(&device, &[], LENS, SIZE).expect("nothing to hold").render(&[], &SKY);
    assert!(empty.expect("a picture").color.iter().all(|color| (color[0] - 0.66).abs() < 1e-6));
}
