//! The robot's surface as points, evenly spread, each with its normal and its link.

use crate::arm::Joints;
use crate::render::RobotSurface;
use nalgebra::{Point3, Vector3};

/// One point for so much surface [m²]: 5 mm apart.
const AREA: f64 = 25e-6;

/// Points on the robot at some joint positions, base frame [m].
#[derive(Debug, Clone, Default)]
pub struct SurfacePoints {
    pub points: Vec<Point3<f64>>,
    /// Outward, length 1.
    pub normals: Vec<Vector3<f64>>,
    /// Links, 0 the base, as [`RobotSurface::links`] numbers them.
    pub links: Vec<usize>,
}

impl SurfacePoints {
    /// The surface of the links that `wanted` names, at joint positions `q` [rad].
    pub fn new(robot: &RobotSurface, q: &Joints, wanted: impl Fn(usize) -> bool) -> Self {
        let mut surface = Self::default();
        let links = robot.links();
        robot.for_each(q, |part, base_from_part| {
            if wanted(links[part]) {
                let mesh = &robot.parts()[part];
                for triangle in &mesh.triangles {
                    let corners = triangle.map(|i| base_from_part * mesh.points[i as usize].cast::<f64>());
                    surface.add(corners, links[part]);
                }
            }
        });
        surface
    }

    fn add(&mut self, [a, b, c]: [Point3<f64>; 3], link: usize) {
        let normal = (b - a).cross(&(c - a));
        let area = normal.norm() / 2.0;
        if area <= 0.0 {
            return;
        }
        // As many as the area is worth, the rest by a coin that falls the same way every time.
        let number = self.points.len();
        let worth = area / AREA + fraction(number as f64 * 0.618_033_988_749_894_9);
        for i in 0..worth as usize {
            let at = (number + i) as f64;
            // A sequence that leaves no holes (Roberts 2018), folded into the triangle.
            let (s, t) = (fraction(at * 0.754_877_666_246_693), fraction(at * 0.569_840_290_998_053));
            let (s, t) = if s + t > 1.0 { (1.0 - s, 1.0 - t) } else { (s, t) };
            self.points.push(a + (b - a) * s + (c - a) * t);
            self.normals.push(normal / (2.0 * area));
            self.links.push(link);
        }
    }
}

fn fraction(value: f64) -> f64 {
    value - value.floor()
}
