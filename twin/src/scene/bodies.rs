//! Everything on the table as bodies by name: each rigid object, and each link of an object that moves in itself, out of its URDF.

use super::{MOST_BODIES, MeshFileError, ObjectModel, ObjectShape, mesh_file};
use crate::arm::{UrdfBody, UrdfForm};
use nalgebra::{Isometry3, Point3, Vector3};
use shared_mem::cell::{Cell, Object};
use shared_mem::input;
use shared_mem::msg::object::{NAME_LENGTH, ObjectName};
use std::path::Path;

/// Sides of a drawn and simulated cylinder.
const SIDES: u32 = 24;
/// Steps over a joint's range in which its highest place is looked for.
const RANGE_STEPS: u32 = 16;

#[derive(Debug, Clone)]
pub struct CellBody {
    /// The object's name, or `NAME_LINK`; empty for the one object of a cell that names none.
    pub name: ObjectName,
    /// Place of its object among those of the cell.
    pub object: usize,
    /// What it is made of, and where each piece is in the body.
    pub pieces: Vec<(Isometry3<f64>, ObjectShape)>,
    /// Of an object that moves in itself: its link.
    pub link: Option<UrdfBody>,
}

/// The bodies of all objects of a cell, in the order of the file, each root before what hangs on it.
///
/// # Errors
/// [`MeshFileError`] for a mesh or URDF that cannot be used, and for two bodies of one name.
pub fn cell_bodies(cell: &Cell) -> Result<Vec<CellBody>, MeshFileError> {
    let mut bodies: Vec<CellBody> = Vec::new();
    for number in 0..cell.objects.len() {
        bodies.extend(bodies_of(cell, number)?);
    }
    for (i, body) in bodies.iter().enumerate() {
        if bodies[..i].iter().any(|other| other.name == body.name) {
            let name = body.name.text();
            return Err(MeshFileError::Links(format!(
                "two bodies are called `{name}`, an object and a link of another; give the object another `name`"
            )));
        }
    }
    if bodies.len() > MOST_BODIES {
        let count = bodies.len();
        return Err(MeshFileError::Links(format!(
            "the objects of cell.toml have {count} bodies, links included; at most {MOST_BODIES} are simulated and drawn"
        )));
    }
    Ok(bodies)
}

/// Those of the cell's object of this number.
///
/// # Errors
/// As [`cell_bodies`].
pub fn bodies_of(cell: &Cell, number: usize) -> Result<Vec<CellBody>, MeshFileError> {
    let one = Cell { in_question: number, ..cell.clone() };
    let Some(object) = one.object() else { return Ok(Vec::new()) };
    if let Some(file) = &object.urdf {
        return links(object, number, &cell.folder.join(file));
    }
    let name = object.name.as_deref().and_then(ObjectName::new).unwrap_or_default();
    let model = ObjectModel::new(&one, None)?;
    let body = |model: ObjectModel| CellBody {
        name,
        object: number,
        pieces: vec![(Isometry3::identity(), model.shape)],
        link: None,
    };
    Ok(model.map(body).into_iter().collect())
}

fn links(object: &Object, number: usize, file: &Path) -> Result<Vec<CellBody>, MeshFileError> {
    let fault = |what: String| MeshFileError::Links(what);
    let text = input::text(file, input::Kind::Robot)
        .map_err(|error| fault(format!("{error} (`object.urdf` in cell.toml)")))?;
    let links = UrdfBody::of(&text, file).map_err(|error| fault(error.to_string()))?;
    let known: Vec<&str> = links.iter().filter_map(|link| Some(link.joint.as_ref()?.name.as_str())).collect();
    if let Some(unknown) = object.joints.keys().find(|name| !known.contains(&name.as_str())) {
        return Err(fault(format!(
            "`object.joints`: no joint of {} is called `{unknown}`; there are: {}",
            file.display(),
            known.join(", ")
        )));
    }
    let root = object.name.as_deref().unwrap_or("");
    let folder = file.parent().unwrap_or(Path::new(""));
    let body = |link: UrdfBody| {
        let name = if link.joint.is_some() { format!("{root}_{}", link.link) } else { root.to_owned() };
        let named = ObjectName::new(&name).ok_or_else(|| {
            fault(format!("{}: `{name}` is no name; use up to {NAME_LENGTH} letters, digits and _", file.display()))
        })?;
        if let Some(joint) = &link.joint {
            let start = start_of(object, &link);
            let [low, high] = joint.limits;
            if !(low..=high).contains(&start) {
                return Err(fault(format!(
                    "`object.joints` puts `{}` at {start}, outside of its limits {low} to {high}",
                    joint.name
                )));
            }
        }
        let pieces = link.shapes.iter().map(|shape| Ok((shape.at, surface(&shape.form, folder)?)));
        let pieces = pieces.collect::<Result<Vec<_>, MeshFileError>>()?;
        Ok(CellBody { name: named, object: number, pieces, link: Some(link) })
    };
    links.into_iter().map(body).collect()
}

fn surface(form: &UrdfForm, folder: &Path) -> Result<ObjectShape, MeshFileError> {
    match form {
        UrdfForm::Box(size) => Ok(ObjectShape::Box { half_extents: Vector3::from(*size) * 0.5 }),
        UrdfForm::Cylinder { radius, length } => Ok(prism(*radius, *length)),
        UrdfForm::Mesh(file) => mesh_file::read(&folder.join(file)),
    }
}

/// Where a link's joint starts [rad or m]: where the object's block says, else at 0 or the limit nearest to it.
pub fn start_of(object: &Object, link: &UrdfBody) -> f64 {
    let of = |joint: &crate::arm::UrdfJoint| {
        let [low, high] = joint.limits;
        object.joints.get(&joint.name).copied().unwrap_or(0.0_f64.clamp(low, high))
    };
    link.joint.as_ref().map_or(0.0, of)
}

/// Poses of an object's bodies in its root, each joint where `position` has it [rad or m].
pub fn poses_in_root(own: &[&CellBody], position: impl Fn(&UrdfBody) -> f64) -> Vec<Isometry3<f64>> {
    let mut poses: Vec<Isometry3<f64>> = Vec::new();
    for body in own {
        let joint = body.link.as_ref().and_then(|link| Some((link.joint.as_ref()?, position(link))));
        poses.push(
            joint.map_or_else(Isometry3::identity, |(joint, position)| poses[joint.parent] * joint.pose_at(position)),
        );
    }
    poses
}

/// How far the highest object of a cell reaches above the table on which it stands upright [m]; of one that moves in itself wherever
/// one of its joints may be, the others where they start. 0 without objects.
///
/// # Errors
/// As [`cell_bodies`].
pub fn tallest(cell: &Cell) -> Result<f64, MeshFileError> {
    let bodies = cell_bodies(cell)?;
    let height = |(number, object): (usize, &Object)| {
        let own: Vec<&CellBody> = bodies.iter().filter(|body| body.object == number).collect();
        let at_start = heights(&own, &poses_in_root(&own, |link| start_of(object, link)));
        let moved = own
            .iter()
            .filter_map(|body| Some((body.link.as_ref()?.link.as_str(), body.link.as_ref()?.joint.as_ref()?)));
        let moved = moved.flat_map(|(name, joint)| (0..=RANGE_STEPS).map(move |k| (name, joint, k)));
        let highest = moved.map(|(name, joint, k)| {
            let [low, high] = joint.limits;
            let there = low + (high - low) * f64::from(k) / f64::from(RANGE_STEPS);
            heights(&own, &poses_in_root(&own, |link| if link.link == name { there } else { start_of(object, link) }))
                [1]
        });
        highest.fold(at_start[1], f64::max) - at_start[0]
    };
    Ok(cell.objects.iter().enumerate().map(height).fold(0.0, f64::max))
}

/// Lowest and highest point of bodies at `poses` [m].
fn heights(own: &[&CellBody], poses: &[Isometry3<f64>]) -> [f64; 2] {
    let points = own.iter().zip(poses).flat_map(|(body, pose)| {
        let (points, _) = body.surface().triangles();
        points.into_iter().map(move |point| (pose * point).z)
    });
    points.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], z| [low.min(z), high.max(z)])
}

impl CellBody {
    /// Its whole surface in the body's axes.
    pub fn surface(&self) -> ObjectShape {
        if let [(at, shape)] = &self.pieces[..]
            && *at == Isometry3::identity()
        {
            return shape.clone();
        }
        let (mut points, mut triangles) = (Vec::new(), Vec::new());
        for (at, shape) in &self.pieces {
            let (of_piece, faces) = shape.triangles();
            let first = points.len() as u32;
            points.extend(of_piece.iter().map(|point| at * point));
            triangles.extend(faces.iter().map(|face| face.map(|corner| corner + first)));
        }
        ObjectShape::Mesh { points, triangles }
    }
}

/// A cylinder along z as a prism inside of it.
fn prism(radius: f64, length: f64) -> ObjectShape {
    let at = |i: u32, z: f64| {
        let (sin, cos) = ((f64::from(i) + 0.5) * std::f64::consts::TAU / f64::from(SIDES)).sin_cos();
        Point3::new(radius * cos, radius * sin, z * length)
    };
    let points = (0..2 * SIDES).map(|i| at(i / 2, if i % 2 == 0 { -0.5 } else { 0.5 })).collect();
    let mut triangles = Vec::new();
    for i in 0..SIDES {
        let [a, b] = [2 * i, 2 * ((i + 1) % SIDES)];
        triangles.extend([[a, b, b + 1], [a, b + 1, a + 1]]);
        if i > 0 && i + 1 < SIDES {
            triangles.extend([[0, b, a], [1, a + 1, b + 1]]);
        }
    }
    ObjectShape::Mesh { points, triangles }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prism_looks_outwards_and_has_nearly_the_volume_of_its_cylinder() {
        let (points, triangles) = prism(0.5, 2.0).triangles();
        let volume = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|i| points[i as usize].coords);
            a.dot(&b.cross(&c)) / 6.0
        };
        let whole: f64 = triangles.iter().map(volume).sum();
        let round = std::f64::consts::PI * 0.25 * 2.0;
        assert!(whole < round && whole > 0.98 * round, "{whole} of {round}");
    }

    #[test]
    fn the_highest_object_is_the_one_whose_lid_may_stand_open() {
        let folder = tempfile::tempdir().expect("a folder");
        let part = |name: &str, x: f64, z: f64, height: f64| {
            format!(
                "<link name='{name}'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>\
                 <collision><origin xyz='{x} 0 {z}'/><geometry><box size='0.2 0.2 {height}'/></geometry></collision></link>"
            )
        };
        let hinge = "<joint name='hinge' type='revolute'><parent link='base'/><child link='lid'/><origin xyz='0.1 0 0.04'/>\
                     <axis xyz='0 1 0'/><limit lower='0' upper='1.5707963267948966' effort='1' velocity='1'/></joint>";
        let robot = format!(
            "<robot name='lap'>{}{}{hinge}</robot>",
            part("base", 0.0, 0.02, 0.04),
            part("lid", -0.1, 0.01, 0.02)
        );
        std::fs::write(folder.path().join("lap.urdf"), robot).expect("room");
        let blocks = "[[object]]\nname = \"cup\"\nshape = \"box\"\nsize = [0.1, 0.1, 0.12]\n";
        let read = |text: &str| Cell::parse(text, &folder.path().join("cell.toml")).expect("a cell");
        assert!((tallest(&read(blocks)).expect("a box") - 0.12).abs() < 1e-12);
        let both = format!("{blocks}[[object]]\nname = \"lap\"\nurdf = \"lap.urdf\"\n");
        let highest = tallest(&read(&both)).expect("a box and a laptop");
        // Its far edge is highest just before the lid stands upright.
        assert!((highest - 0.04 - 0.2_f64.hypot(0.02)).abs() < 1e-5, "{highest}");
        assert_eq!(tallest(&Cell::default()).expect("nothing"), 0.0);
    }
}
