//! Where bodies and joints of an MJCF are at the positions in which it is written, and where the cell's base frame lies in the user's
//! world: by the axes of the joints, so that it does not matter in which frames either of them describes its links.

use super::classes::{Classes, MAIN, numbers};
use nalgebra::{Isometry3, Matrix3, Quaternion, Rotation3, Translation3, Unit, UnitQuaternion, Vector3};
use std::collections::HashMap;
use twin::xml::Element;

/// Arms whose axes are off by more are not built alike [m, rad].
const OFF: [f64; 2] = [0.05, 0.15];
/// Directions of axes that span less than this share of their number leave a turn open.
const FLAT: f64 = 1e-3;

/// A joint in the world.
#[derive(Debug, Clone)]
pub(super) struct PlacedJoint {
    /// A point of its axis [m].
    pub(super) point: Vector3<f64>,
    pub(super) axis: Vector3<f64>,
    /// The frame of the body that it moves.
    pub(super) body: Isometry3<f64>,
    /// `hinge`, `slide`, `ball` or `free`.
    pub(super) kind: String,
    /// Where its position begins in `qpos`; `None` behind elements of which MuJoCo makes several.
    pub(super) address: Option<usize>,
    /// Its range as it is written, its class's where it has none itself; empty without one.
    pub(super) range: Vec<f64>,
    /// Its position where it stands in the file, as it is written.
    pub(super) reads: f64,
}

impl PlacedJoint {
    pub(super) fn new(body: Isometry3<f64>, point: Vector3<f64>, axis: Vector3<f64>, kind: &str) -> Self {
        Self { point, axis, body, kind: kind.to_owned(), address: None, range: Vec::new(), reads: 0.0 }
    }
}

/// What is placed, by name.
#[derive(Debug, Default)]
pub(super) struct Places {
    pub(super) joints: HashMap<String, PlacedJoint>,
    pub(super) bodies: HashMap<String, Isometry3<f64>>,
    /// Numbers in `qpos` so far; `None` behind elements of which MuJoCo makes several.
    pub(super) positions: Option<usize>,
}

/// How a document writes angles.
pub(super) struct Angles {
    pub(super) degrees: bool,
    sequence: String,
}

impl Angles {
    pub(super) fn of(root: &Element) -> Self {
        let compilers = || root.elements().filter(|element| element.name == "compiler");
        let said = |key: &str| compilers().filter_map(|compiler| compiler.get(key)).next_back().map(str::to_owned);
        let degrees = said("angle").is_none_or(|angle| angle != "radian");
        Self { degrees, sequence: said("eulerseq").unwrap_or_else(|| "xyz".into()) }
    }

    fn radians(&self, angle: f64) -> f64 {
        if self.degrees { angle.to_radians() } else { angle }
    }

    /// The frame that an element's attributes give it.
    pub(super) fn frame(&self, element: &Element) -> Isometry3<f64> {
        let list = |key: &str| element.get(key).map(numbers).unwrap_or_default();
        let at = |list: &[f64]| Vector3::from_iterator((0..3).map(|i| list.get(i).copied().unwrap_or(0.0)));
        let turn = match [list("quat"), list("axisangle"), list("euler"), list("xyaxes"), list("zaxis")] {
            [quat, ..] if quat.len() == 4 => {
                UnitQuaternion::new_normalize(Quaternion::new(quat[0], quat[1], quat[2], quat[3]))
            }
            [_, axis, ..] if axis.len() == 4 => Unit::try_new(at(&axis), 1e-12)
                .map_or_else(UnitQuaternion::identity, |unit| {
                    UnitQuaternion::from_axis_angle(&unit, self.radians(axis[3]))
                }),
            [_, _, euler, ..] if euler.len() == 3 => self.euler(&euler),
            [_, _, _, axes, _] if axes.len() == 6 => {
                let (x, y) = (at(&axes), at(&axes[3..]));
                let x = x.try_normalize(1e-12).unwrap_or_else(Vector3::x);
                let y = (y - x * x.dot(&y)).try_normalize(1e-12).unwrap_or_else(Vector3::y);
                UnitQuaternion::from_matrix(&Matrix3::from_columns(&[x, y, x.cross(&y)]))
            }
            [.., axis] if axis.len() == 3 => UnitQuaternion::rotation_between(&Vector3::z(), &at(&axis))
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f64::consts::PI)),
            _ => UnitQuaternion::identity(),
        };
        Isometry3::from_parts(Translation3::from(at(&list("pos"))), turn)
    }

    /// Small letters turn about axes that turn along, capital ones about fixed axes.
    fn euler(&self, angles: &[f64]) -> UnitQuaternion<f64> {
        self.sequence.chars().zip(angles).fold(UnitQuaternion::identity(), |turn, (axis, angle)| {
            let about = match axis.to_ascii_lowercase() {
                'x' => Vector3::x_axis(),
                'y' => Vector3::y_axis(),
                _ => Vector3::z_axis(),
            };
            let next = UnitQuaternion::from_axis_angle(&about, self.radians(*angle));
            if axis.is_lowercase() { turn * next } else { next * turn }
        })
    }
}

impl Places {
    /// Of a document.
    pub(super) fn of(root: &Element) -> Self {
        let (classes, angles) = (Classes::of(root), Angles::of(root));
        let mut places = Self { positions: Some(0), ..Self::default() };
        for world in root.elements().filter(|element| element.name == "worldbody") {
            let class = world.get("childclass").unwrap_or(MAIN).to_owned();
            places.walk(world, &Isometry3::identity(), &class, (&classes, &angles));
        }
        places
    }

    fn walk(&mut self, body: &Element, at: &Isometry3<f64>, class: &str, given: (&Classes, &Angles)) {
        // A body's own joints come before those of the bodies in it, wherever they stand.
        self.joints_of(body, at, class, given);
        self.inner(body, at, class, given);
    }

    fn joints_of(&mut self, body: &Element, at: &Isometry3<f64>, class: &str, given: (&Classes, &Angles)) {
        for element in body.elements() {
            match element.name.as_str() {
                "frame" => {
                    let class = element.get("childclass").unwrap_or(class);
                    self.joints_of(element, &(at * given.1.frame(element)), class, given);
                }
                "joint" | "freejoint" => self.joint(element, at, class, given.0),
                _ => {}
            }
        }
    }

    fn inner(&mut self, body: &Element, at: &Isometry3<f64>, class: &str, given: (&Classes, &Angles)) {
        for element in body.elements() {
            let class = element.get("childclass").unwrap_or(class);
            match element.name.as_str() {
                "frame" => self.inner(element, &(at * given.1.frame(element)), class, given),
                "body" => {
                    let at = at * given.1.frame(element);
                    if let Some(name) = element.get("name") {
                        self.bodies.insert(name.to_owned(), at);
                    }
                    self.walk(element, &at, class, given);
                }
                "replicate" | "composite" | "flexcomp" | "attach" => self.positions = None,
                _ => {}
            }
        }
    }

    fn joint(&mut self, element: &Element, at: &Isometry3<f64>, class: &str, classes: &Classes) {
        let get = |key: &str| classes.get(element, class, &["joint"], key);
        let list = |key: &str, or: Vector3<f64>| {
            let list = get(key).map(|text| numbers(&text)).unwrap_or_default();
            if list.len() == 3 { Vector3::from_column_slice(&list) } else { or }
        };
        let kind =
            if element.name == "freejoint" { "free".into() } else { get("type").unwrap_or_else(|| "hinge".into()) };
        let size = match kind.as_str() {
            "free" => 7,
            "ball" => 4,
            _ => 1,
        };
        let address = self.positions;
        self.positions = address.map(|address| address + size);
        let Some(name) = element.get("name") else { return };
        let axis = list("axis", Vector3::z()).try_normalize(1e-12).unwrap_or_else(Vector3::z);
        let point = at * nalgebra::Point3::from(list("pos", Vector3::zeros()));
        let written = |key: &str| get(key).map(|text| numbers(&text)).unwrap_or_default();
        let (range, reads) = (written("range"), written("ref").first().copied().unwrap_or(0.0));
        let placed = PlacedJoint::new(*at, point.coords, at.rotation * axis, &kind);
        let placed = PlacedJoint { address, range, reads, ..placed };
        self.joints.insert(name.to_owned(), placed);
    }
}

/// Where the cell's base frame lies in the user's world: the place at which the axes of the cell's joints are those of the user's.
///
/// # Errors
/// Where the arms are not built alike: the first joint whose axis is off, and by how much [m, rad].
pub(super) fn fits(cell: &[&PlacedJoint], own: &[&PlacedJoint]) -> Result<Isometry3<f64>, (usize, [f64; 2])> {
    let (Some(first), Some(theirs)) = (own.first(), cell.first()) else { return Ok(Isometry3::identity()) };
    let found = aligned(cell, own).unwrap_or_else(|| first.body * theirs.body.inverse());
    for (place, (cell, own)) in cell.iter().zip(own).enumerate() {
        let axis = found.rotation * cell.axis;
        let turned = axis.cross(&own.axis).norm().atan2(axis.dot(&own.axis));
        let apart = found * nalgebra::Point3::from(cell.point) - nalgebra::Point3::from(own.point);
        let apart = if own.kind == "slide" { 0.0 } else { apart.cross(&own.axis).norm() };
        if !(apart < OFF[0] && turned < OFF[1]) {
            return Err((place, [apart, turned]));
        }
    }
    Ok(found)
}

/// By least squares over all axes; `None` where they leave the turn open.
fn aligned(cell: &[&PlacedJoint], own: &[&PlacedJoint]) -> Option<Isometry3<f64>> {
    let pairs = || cell.iter().zip(own);
    let directions = pairs().fold(Matrix3::zeros(), |sum, (cell, own)| sum + own.axis * cell.axis.transpose());
    let svd = directions.svd(true, true);
    let (u, v_t) = (svd.u?, svd.v_t?);
    let mut sizes: Vec<f64> = svd.singular_values.iter().copied().collect();
    sizes.sort_by(f64::total_cmp);
    if sizes[1] < FLAT * cell.len() as f64 {
        return None;
    }
    let sign = (u * v_t).determinant().signum();
    // Of the least singular value; nalgebra has them in falling order.
    let turn = u * Matrix3::from_diagonal(&Vector3::new(1.0, 1.0, sign)) * v_t;
    let turn = Rotation3::from_matrix_unchecked(turn);
    let (mut across, mut wanted) = (Matrix3::zeros(), Vector3::zeros());
    for (cell, own) in pairs().filter(|(_, own)| own.kind != "slide") {
        let beside = Matrix3::identity() - own.axis * own.axis.transpose();
        across += beside;
        wanted += beside * (own.point - turn * cell.point);
    }
    let shift = across.try_inverse()? * wanted;
    Some(Isometry3::from_parts(Translation3::from(shift), UnitQuaternion::from_rotation_matrix(&turn)))
}

/// What is in a body, in its frames as well.
pub(super) fn beside_frames(body: &Element) -> Vec<&Element> {
    let (mut found, mut open) = (Vec::new(), vec![body]);
    while let Some(element) = open.pop() {
        for inner in element.elements() {
            if inner.name == "frame" {
                open.push(inner);
            } else {
                found.push(inner);
            }
        }
    }
    found
}
