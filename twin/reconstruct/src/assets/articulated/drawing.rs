//! States of the object drawn from afar, the base grey, the part orange, the axis blue.

use crate::articulated::{Joint, State};
use nalgebra::{Point3, UnitQuaternion, Vector3};

/// Edge of a picture [pixel].
pub(super) const EDGE: usize = 360;
const GROUND: [u8; 3] = [255; 3];
const BASE: [f64; 3] = [150.0, 158.0, 170.0];
const PART: [f64; 3] = [235.0, 130.0, 40.0];
const AXIS: [u8; 3] = [30, 60, 220];
/// Where one looks from, over all states: about z, then above the horizon [rad].
pub(super) const SIDES: [[f64; 2]; 2] = [[0.7, 0.45], [2.6, 0.35]];

/// What is in the picture.
pub(super) struct Window {
    middle: Point3<f64>,
    /// Metres for a pixel.
    pixel: f64,
}

impl Window {
    /// One that all states fit into.
    pub(super) fn of(states: &[State]) -> Self {
        let bounds = states.iter().map(|state| state.mesh.bounds());
        let (low, high) = bounds.fold(
            (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
            |(low, high): (Vector3<f64>, Vector3<f64>), (l, h)| (low.inf(&l.coords), high.sup(&h.coords)),
        );
        Self { middle: ((low + high) * 0.5).into(), pixel: 1.02 * (high - low).norm() / EDGE as f64 }
    }

    /// Column, row and depth of a place; depth grows away.
    fn place(&self, point: &Point3<f64>, turn: &UnitQuaternion<f64>) -> [f64; 3] {
        let seen = turn * (point - self.middle) / self.pixel;
        let half = EDGE as f64 * 0.5;
        [half + seen.y, half - seen.z, -seen.x]
    }
}

/// One state from one side, row by row.
pub(super) fn drawn(state: &State, joint: &Joint, window: &Window, [around, above]: [f64; 2]) -> Vec<[u8; 3]> {
    // The eye looks against x, z is up.
    let turn = UnitQuaternion::from_axis_angle(&Vector3::y_axis(), above)
        * UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -around);
    let light = Vector3::new(0.8, 0.35, 0.5).normalize();
    let mut picture = vec![GROUND; EDGE * EDGE];
    let mut depth = vec![f64::INFINITY; EDGE * EDGE];
    for number in 0..state.mesh.triangles.len() {
        let corners = state.mesh.corners(number);
        let normal = turn * (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let colour = if state.moves[number] { PART } else { BASE };
        let shade = 0.45 + 0.55 * (normal.dot(&light) / normal.norm().max(1e-300)).max(0.0);
        let colour = colour.map(|c| (c * shade) as u8);
        fill(corners.map(|corner| window.place(&corner, &turn)), colour, &mut picture, &mut depth);
    }
    line(joint, window, &turn, &mut picture);
    picture
}

fn fill(corners: [[f64; 3]; 3], colour: [u8; 3], picture: &mut [[u8; 3]], depth: &mut [f64]) {
    let cross = |a: [f64; 3], b: [f64; 3], x: f64, y: f64| (a[0] - x) * (b[1] - y) - (a[1] - y) * (b[0] - x);
    let area = cross(corners[1], corners[2], corners[0][0], corners[0][1]);
    if area.abs() < 1e-9 {
        return;
    }
    let range = |axis: usize| {
        let values = corners.map(|corner| corner[axis]);
        let low = values.iter().copied().fold(f64::INFINITY, f64::min).floor().max(0.0) as usize;
        let high = values.iter().copied().fold(f64::NEG_INFINITY, f64::max).ceil().max(0.0) as usize;
        low..high.min(EDGE)
    };
    for row in range(1) {
        for column in range(0) {
            let (x, y) = (column as f64 + 0.5, row as f64 + 0.5);
            let [a, b, c] = corners;
            let weights = [cross(b, c, x, y), cross(c, a, x, y), cross(a, b, x, y)].map(|w| w / area);
            let z: f64 = weights.iter().zip(&corners).map(|(w, corner)| w * corner[2]).sum();
            if weights.iter().all(|w| *w >= 0.0) && z < depth[row * EDGE + column] {
                depth[row * EDGE + column] = z;
                picture[row * EDGE + column] = colour;
            }
        }
    }
}

/// The axis through the whole picture, or the way of a slide, over what is before it.
fn line(joint: &Joint, window: &Window, turn: &UnitQuaternion<f64>, picture: &mut [[u8; 3]]) {
    let middle = match joint {
        Joint::Revolute { point, .. } => *point,
        Joint::Prismatic { .. } => window.middle,
    };
    let reach = 0.35 * EDGE as f64 * window.pixel;
    for step in 0..4 * EDGE {
        let along = (2.0 * step as f64 / (4 * EDGE) as f64 - 1.0) * reach;
        let [x, y, _] = window.place(&(middle + joint.direction().into_inner() * along), turn);
        for (dx, dy) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (1.0, 1.0)] {
            let (column, row) = (x + dx, y + dy);
            if column >= 0.0 && row >= 0.0 && column < EDGE as f64 && row < EDGE as f64 {
                picture[row as usize * EDGE + column as usize] = AXIS;
            }
        }
    }
}
