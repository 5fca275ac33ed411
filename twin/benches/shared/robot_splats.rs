//! A robot as splats, made from the surfaces of its meshes: flat discs, one beside the other, with colours that depend on
//! the direction. What benchmarks and tests draw where no scanned robot is at hand.

use nalgebra::{Point3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use splat::{Splat, SplatCloud};
use twin::render::{Mesh, RobotSurface};

/// One cloud for each part of the robot, about `count` splats together, spherical harmonics to degree 3.
pub(crate) fn robot_splats(robot: &RobotSurface, count: usize) -> Vec<SplatCloud> {
    let whole: f32 = robot.parts().iter().flat_map(areas).sum();
    let mut random = Pcg64Mcg::seed_from_u64(70_000);
    (robot.parts().iter())
        .map(|part| {
            let share = areas(part).sum::<f32>() / whole;
            on_surface(part, (share * count as f32).round() as usize, &mut random)
        })
        .collect()
}

fn corners(mesh: &Mesh) -> impl Iterator<Item = [Point3<f32>; 3]> + '_ {
    mesh.triangles.iter().map(|t| t.map(|i| mesh.points[i as usize]))
}

fn areas(mesh: &Mesh) -> impl Iterator<Item = f32> + '_ {
    corners(mesh).map(|[a, b, c]| (b - a).cross(&(c - a)).norm() / 2.0)
}

fn on_surface(mesh: &Mesh, count: usize, random: &mut Pcg64Mcg) -> SplatCloud {
    let whole: f32 = areas(mesh).sum();
    let wide = 0.6 * (whole / count.max(1) as f32).sqrt();
    let mut cloud = SplatCloud { degree: 3, ..SplatCloud::default() };
    let mut due = 0.0;
    for ([a, b, c], area) in corners(mesh).zip(areas(mesh)) {
        due += area / whole * count as f32;
        let normal = (b - a).cross(&(c - a));
        let facing = UnitQuaternion::rotation_between(&Vector3::z(), &normal).unwrap_or_default();
        while due >= 1.0 {
            due -= 1.0;
            let (s, t): (f32, f32) = (random.random(), random.random());
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            cloud.splats.push(Splat {
                centre: a + (b - a) * s + (c - a) * t,
                rotation: facing,
                sigma: Vector3::new(wide, wide * random.random_range(0.5..1.0), 2e-4),
                opacity: random.random_range(0.5..0.99),
            });
            cloud.harmonics.push(mesh.color.map(|c| (f32::from(c) / 255.0 - 0.5) / 0.282_094_8));
            cloud.harmonics.extend((1..16).map(|_| [(); 3].map(|()| random.random_range(-0.1..0.1))));
        }
    }
    cloud
}
