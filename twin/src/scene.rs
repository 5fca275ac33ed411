//! The object as it is simulated: shape, inertia, friction. Built from cell.toml's nominal values and overridden by
//! theta.toml; read by the physics and by the camera. Object frame, SI.

mod arm_outline;
mod bodies;
mod mesh_file;
mod snapshot;
mod starts;

pub use arm_outline::{ArmOutline, Part};
pub use bodies::{CellBody, bodies_of, cell_bodies, poses_in_root, start_of, tallest};
pub use mesh_file::{MeshFileError, read_surface as mesh_in_its_middle};
pub(crate) use mesh_file::{open_edges, read as read_mesh};
pub use snapshot::{MOST_BODIES, NamedPoses, SceneSnapshot};
pub use starts::{body_starts, joint_position, starts};

use nalgebra::{Point3, Vector3};
use shared_mem::cell::{Cell, Object, Support};
use shared_mem::theta::{ObjectTheta, Theta};

/// The object with every number a simulation needs.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectModel {
    pub shape: ObjectShape,
    /// Mass [kg].
    pub mass: f64,
    /// Centre of mass from the geometric centre, object frame [m]; where nothing is known, [`nominal_centre_of_mass`].
    pub centre_of_mass: Vector3<f64>,
    /// Coulomb friction on the table.
    pub friction: f64,
    /// Coulomb friction against the tool.
    pub tip_friction: f64,
    /// Restitution against the table, 0 to 1.
    pub restitution: f64,
    /// How its base carries the load.
    pub support: Support,
}

/// What can be identified about an object, and its restitution.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectParameters {
    /// Mass [kg].
    pub mass: f64,
    /// Centre of mass from the geometric centre, object frame [m].
    pub centre_of_mass: Vector3<f64>,
    /// Coulomb friction on the table.
    pub friction: f64,
    /// Coulomb friction against the tool.
    pub tip_friction: f64,
    /// Restitution against the table, 0 to 1.
    pub restitution: f64,
}

/// Surface of the object around its geometric centre, the origin of [`shared_mem::frames::Object`] [m].
#[derive(Debug, Clone, PartialEq)]
pub enum ObjectShape {
    Box {
        /// Half the edge lengths.
        half_extents: Vector3<f64>,
    },
    /// Triangles, moved so that the middle of their bounding box is the origin. Physics uses their convex hull.
    Mesh {
        points: Vec<Point3<f64>>,
        /// Indices into `points`, counter-clockwise seen from outside.
        triangles: Vec<[u32; 3]>,
    },
}

impl ObjectModel {
    /// The object of a cell, `None` when the cell has none, or one that moves in itself ([`CellBody`]).
    ///
    /// # Errors
    /// [`MeshFileError`] when the object is a mesh that cannot be used.
    pub fn new(cell: &Cell, theta: Option<&Theta>) -> Result<Option<Self>, MeshFileError> {
        let Some(object) = cell.object().filter(|object| object.urdf.is_none()) else { return Ok(None) };
        let shape = match (&object.mesh, object.size) {
            (Some(file), _) => mesh_file::read(&cell.folder.join(file))?,
            (None, size) => ObjectShape::Box { half_extents: Vector3::from(size.unwrap_or([0.05; 3])) * 0.5 },
        };
        let ObjectParameters { mass, centre_of_mass, friction, tip_friction, restitution } =
            ObjectParameters::new(object, nominal_centre_of_mass(object, &shape), theta);
        Ok(Some(Self { shape, mass, centre_of_mass, friction, tip_friction, restitution, support: object.support }))
    }

    pub fn parameters(&self) -> ObjectParameters {
        let Self { mass, centre_of_mass, friction, tip_friction, restitution, .. } = *self;
        ObjectParameters { mass, centre_of_mass, friction, tip_friction, restitution }
    }

    /// # Errors
    /// [`ParameterError`] for what [`ObjectParameters::check`] refuses, and for a centre of mass outside of the object.
    pub fn check(&self) -> Result<(), ParameterError> {
        self.parameters().check()?;
        let half = self.shape.half_extents();
        match (0..3).find(|i| self.centre_of_mass[*i].abs() > half[*i]) {
            Some(i) => Err(ParameterError {
                name: "centre of mass",
                value: self.centre_of_mass[i],
                wanted: "a place inside the object, in metres from its geometric centre",
            }),
            None => Ok(()),
        }
    }
}

/// A number of an object that no body can have.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("the object's {name} cannot be {value}; give {wanted}, in cell.toml or theta.toml")]
pub struct ParameterError {
    pub name: &'static str,
    pub value: f64,
    /// What would do.
    pub wanted: &'static str,
}

impl ObjectParameters {
    /// # Errors
    /// [`ParameterError`] for what is negative, without bound or not a number, and for a mass of zero.
    pub fn check(&self) -> Result<(), ParameterError> {
        let fault = |name, value, wanted| Err(ParameterError { name, value, wanted });
        if !(self.mass > 0.0 && self.mass.is_finite()) {
            return fault("mass", self.mass, "a positive number of kilograms");
        }
        if let Some(far) = self.centre_of_mass.iter().find(|v| v.is_nan() || v.abs() > 10.0) {
            return fault("centre of mass", *far, "three numbers in metres from the geometric centre");
        }
        for (name, value) in [("friction", self.friction), ("tip friction", self.tip_friction)] {
            if !(0.0..=100.0).contains(&value) {
                return fault(name, value, "0 or a positive number below 100");
            }
        }
        if !(0.0..=1.0).contains(&self.restitution) {
            return fault("restitution", self.restitution, "0 to 1");
        }
        Ok(())
    }

    /// What `theta` knows, else the nominal values: `centre_of_mass` ([`nominal_centre_of_mass`]) and those of cell.toml.
    pub fn new(object: &Object, centre_of_mass: Vector3<f64>, theta: Option<&Theta>) -> Self {
        // A block of another name is about another object.
        let fits = |known: &&ObjectTheta| known.name.is_none() || known.name == object.name;
        let known = theta.and_then(|theta| theta.object.as_ref()).filter(fits);
        let of = |value: fn(&ObjectTheta) -> Option<f64>| known.and_then(value);
        Self {
            mass: of(|o| o.mass).unwrap_or_else(|| object.nominal_mass()),
            centre_of_mass: known.and_then(|o| o.centre_of_mass).map_or(centre_of_mass, Vector3::from),
            friction: of(|o| o.friction).unwrap_or_else(|| object.nominal_friction()),
            tip_friction: of(|o| o.tip_friction).unwrap_or_else(|| object.nominal_tip_friction()),
            restitution: object.nominal_restitution(),
        }
    }
}

/// Where the centre of mass of an object is taken to be while nobody knows, from the geometric centre [m]: where evenly spread mass
/// has it; along an axis along which `centre_of_mass_range` excludes that, in the middle of the range.
pub fn nominal_centre_of_mass(object: &Object, shape: &ObjectShape) -> Vector3<f64> {
    let mut centre = shape.centroid();
    for (value, [low, high]) in centre.iter_mut().zip(object.centre_of_mass_range.into_iter().flatten()) {
        if !(low..=high).contains(value) {
            *value = 0.5 * (low + high);
        }
    }
    centre
}

impl ObjectShape {
    /// Centroid of the volume, from the geometric centre [m]; of a surface that encloses none, the geometric centre.
    pub fn centroid(&self) -> Vector3<f64> {
        match self {
            Self::Box { .. } => Vector3::zeros(),
            Self::Mesh { points, triangles } => mesh_file::centroid(points, triangles).unwrap_or_default(),
        }
    }

    /// Half the size of the bounding box [m].
    pub fn half_extents(&self) -> Vector3<f64> {
        match self {
            Self::Box { half_extents } => *half_extents,
            Self::Mesh { points, .. } => points.iter().fold(Vector3::zeros(), |m, p| m.sup(&p.coords.abs())),
        }
    }

    /// Radius of a sphere around the geometric centre that holds the object [m].
    pub fn bounding_radius(&self) -> f64 {
        match self {
            Self::Box { half_extents } => half_extents.norm(),
            Self::Mesh { points, .. } => points.iter().map(|p| p.coords.norm()).fold(0.0, f64::max),
        }
    }

    /// Corners and triangles of the surface, counter-clockwise seen from outside.
    pub fn triangles(&self) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
        match self {
            Self::Box { half_extents } => box_triangles(*half_extents),
            Self::Mesh { points, triangles } => (points.clone(), triangles.clone()),
        }
    }
}

/// Corner `i` has the sign of bit 0 on x, bit 1 on y, bit 2 on z.
fn box_triangles(half: Vector3<f64>) -> (Vec<Point3<f64>>, Vec<[u32; 3]>) {
    let sign = |i: usize, bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    let corners =
        (0..8).map(|i| Point3::from(half.component_mul(&Vector3::new(sign(i, 0), sign(i, 1), sign(i, 2))))).collect();
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    (corners, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_faces_of_a_box_look_outwards_and_enclose_its_volume() {
        let (points, triangles) = ObjectShape::Box { half_extents: Vector3::new(0.5, 1.0, 1.5) }.triangles();
        let volume: f64 = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|i| points[i as usize].coords);
                a.dot(&b.cross(&c)) / 6.0
            })
            .sum();
        assert!((volume - 6.0).abs() < 1e-12, "{volume}");
    }

    #[test]
    fn a_number_that_no_body_can_have_is_refused_in_one_line() {
        let fine = ObjectParameters {
            mass: 0.3,
            centre_of_mass: Vector3::zeros(),
            friction: 0.0,
            tip_friction: 0.2,
            restitution: 1.0,
        };
        assert_eq!(fine.check(), Ok(()));
        let faults = [
            (ObjectParameters { mass: 0.0, ..fine }, "mass cannot be 0"),
            (ObjectParameters { mass: -1.0, ..fine }, "mass cannot be -1"),
            (ObjectParameters { mass: f64::NAN, ..fine }, "mass cannot be NaN"),
            (ObjectParameters { friction: -0.1, ..fine }, "friction cannot be -0.1"),
            (ObjectParameters { tip_friction: f64::NAN, ..fine }, "tip friction cannot be NaN"),
            (ObjectParameters { restitution: 1.5, ..fine }, "restitution cannot be 1.5"),
            (ObjectParameters { centre_of_mass: Vector3::new(0.0, f64::NAN, 0.0), ..fine }, "centre of mass cannot be"),
        ];
        for (parameters, expected) in faults {
            let error = parameters.check().expect_err(expected).to_string();
            assert!(error.contains(expected) && error.contains("give") && !error.contains('\n'), "{error}");
        }
    }

    #[test]
    fn a_centre_of_mass_that_nobody_knows_is_that_of_evenly_spread_mass_where_cell_toml_allows_it() {
        let corners = [[0.0, 0.0, 0.0], [0.4, 0.0, 0.0], [0.0, 0.4, 0.0], [0.0, 0.0, 0.4]].map(Point3::from);
        let points = corners.map(|corner| corner - Vector3::repeat(0.2)).to_vec();
        let shape = ObjectShape::Mesh { points, triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] };
        let nominal = |centre_of_mass_range| {
            nominal_centre_of_mass(&Object { centre_of_mass_range, ..Object::default() }, &shape)
        };
        assert!((nominal(None) - Vector3::repeat(-0.1)).norm() < 1e-12);
        let range = [[-0.12, -0.02], [0.0, 0.04], [-0.08, -0.06]];
        assert!((nominal(Some(range)) - Vector3::new(-0.1, 0.02, -0.07)).norm() < 1e-12);
    }

    #[test]
    fn a_centre_of_mass_outside_of_the_object_is_refused() {
        let cell = Cell {
            objects: vec![shared_mem::cell::Object { size: Some([0.1, 0.2, 0.3]), ..Default::default() }],
            ..Cell::default()
        };
        let with = |centre: [f64; 3]| {
            let object = ObjectTheta { centre_of_mass: Some(centre), ..ObjectTheta::default() };
            let theta = Theta { object: Some(object), ..Theta::default() };
            ObjectModel::new(&cell, Some(&theta)).expect("a box").expect("an object").check()
        };
        assert_eq!(with([0.04, -0.09, 0.14]), Ok(()));
        let error = with([0.04, -0.11, 0.14]).expect_err("outside").to_string();
        assert!(error.contains("centre of mass cannot be -0.11") && !error.contains('\n'), "{error}");
    }

    #[test]
    fn what_was_identified_replaces_what_was_assumed() {
        let cell = Cell {
            objects: vec![shared_mem::cell::Object {
                size: Some([0.1; 3]),
                friction_range: Some([0.2, 0.4]),
                ..Default::default()
            }],
            ..Cell::default()
        };
        let theta =
            Theta { object: Some(ObjectTheta { mass: Some(0.7), ..ObjectTheta::default() }), ..Theta::default() };
        let model = ObjectModel::new(&cell, Some(&theta)).expect("a box").expect("an object");
        assert_eq!((model.mass, model.friction), (0.7, 0.30000000000000004));
    }
}
