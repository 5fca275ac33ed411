//! How long a picture of a robot of 70,000 splats takes at 640x480: on the processor, and with the feature `render` on
//! the Vulkan device that there is.

#[path = "shared/eye.rs"]
mod eye;
#[path = "shared/robot_splats.rs"]
mod robot_splats;

use criterion::{Criterion, criterion_group, criterion_main};
use eye::camera_from_base;
use nalgebra::Vector3;
use robot_splats::robot_splats;
use shared_mem::cell::Cell;
use shared_mem::lens::Distortion;
use splat::{Body, Canvas, Lens, Shape, Surroundings};
use std::path::Path;
use twin::render::{Hand, RobotSurface};

const SIZE: [usize; 2] = [640, 480];
const LENS: Lens = Lens { focal: [600.0; 2], centre: [319.5, 239.5], distortion: Distortion::NONE };

fn pictures(criterion: &mut Criterion) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    let robot = RobotSurface::new(&Cell::read(&path).expect("the shipped cell"), Hand::None).expect("a robot");
    let clouds = robot_splats(&robot, 70_000);
    let view = camera_from_base([1.3, 0.9, 0.9], [0.2, 0.0, 0.35]);
    let mut bodies = Vec::new();
    robot.for_each(robot.model().ready(), |part, pose| {
        bodies.push(Body {
            shape: Shape::Splats(&clouds[part]),
            camera_from_body: view * pose,
            instance: part as u32 + 1,
        });
    });
    let around = Surroundings { background: [0.6; 3], light: -Vector3::z() };
    let canvas = Canvas::new(LENS, SIZE);
    let mut group = criterion.benchmark_group("70,000 splats at 640x480");
    group.sample_size(20);
    group.bench_function("processor", |bencher| bencher.iter(|| canvas.render(&bodies, &around)));
    #[cfg(feature = "render")]
    {
        use twin::render::device::{Device, DeviceCanvas};
        let Ok(device) = Device::open() else { return };
        let shapes: Vec<_> = bodies.iter().map(|body| (body.shape, body.instance)).collect();
        let poses: Vec<_> = bodies.iter().map(|body| Some(body.camera_from_body)).collect();
        let mut canvas = DeviceCanvas::new(&device, &shapes, LENS, SIZE).expect("room for the robot");
        group.bench_function(device.name(), |bencher| bencher.iter(|| canvas.render(&poses, &around)));
    }
}

criterion_group!(benches, pictures);
criterion_main!(benches);
