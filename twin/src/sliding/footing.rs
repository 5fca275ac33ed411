//! Between a free rigid body and one that stands: which face is down, and how the two states turn into each other.

use super::patch::Patch;
use super::planar::PlanarState;
use super::polygon::Polygon;
use super::slider::Slider;
use nalgebra::{Matrix3, Point3, Rotation3, UnitQuaternion, Vector2, Vector3};
use shared_mem::cell::Support;

/// State of a free rigid body, world axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeBody {
    /// Centre of mass [m].
    pub centre: Point3<f64>,
    /// Orientation of the object's axes.
    pub rotation: UnitQuaternion<f64>,
    /// Velocity of the centre of mass [m/s].
    pub velocity: Vector3<f64>,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vector3<f64>,
}

/// What a body is made of, in its own axes.
#[derive(Debug, Clone, Copy)]
pub struct Solid<'a> {
    /// Corners of its convex hull, from the object's origin [m].
    pub corners: &'a [Point3<f64>],
    /// Centre of mass, from the object's origin [m].
    pub centre_of_mass: Vector3<f64>,
    /// Mass [kg].
    pub mass: f64,
    /// Inertia about the centre of mass [kg m²].
    pub inertia: Matrix3<f64>,
    /// How the base carries the load.
    pub support: Support,
    /// Distance of each place of pressure from the middle of the base, over that of `support`.
    pub pressure_reach: f64,
}

/// A body that stands with a face on the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Footing {
    pub slider: Slider,
    /// Orientation at yaw 0: the face lies flat.
    upright: UnitQuaternion<f64>,
    table_height: f64,
}

/// What counts as standing: how near the base must be to lying still on the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Closeness {
    /// Each place of the base lies nearer to the table than this [m].
    pub gap: f64,
    /// Each place of the base rises or sinks slower than this [m/s].
    pub sinking: f64,
}

impl Closeness {
    /// For a body that is left alone. What is dropped then is less than 1 % of the energy of a slide at 0.3 m/s.
    pub const LANDED: Self = Self { gap: 3e-4, sinking: 0.01 };
    /// For one that leans against a tool: laid flat from farther away it would hit the tool.
    pub const FLAT: Self = Self { gap: 1e-6, sinking: 1e-3 };
}

/// No body stands whose base leans more than this [rad].
const LEAN: f64 = 2e-3;
/// Corners up to this far above the lowest belong to the base [m].
pub const BASE: f64 = 1e-3;

impl Footing {
    /// The footing of a body that lies flat on the table and hardly moves up or down; `None` when it does not stand.
    pub fn find(
        solid: &Solid<'_>,
        body: &FreeBody,
        table_height: f64,
        Closeness { gap, sinking }: Closeness,
    ) -> Option<(Self, PlanarState)> {
        let turn = body.rotation.to_rotation_matrix();
        let place = |p: &Point3<f64>| turn * (p.coords - solid.centre_of_mass);
        let lowest = solid.corners.iter().map(|p| place(p).z).fold(f64::INFINITY, f64::min);
        if (body.centre.z + lowest - table_height).abs() > gap + BASE {
            return None;
        }
        let base = || solid.corners.iter().map(place).filter(|p| p.z < lowest + BASE);
        let settled = base().all(|p| {
            let rising = body.velocity.z + body.angular_velocity.cross(&p).z;
            rising.abs() < sinking && (body.centre.z + p.z - table_height).abs() < gap
        });
        if !settled {
            return None;
        }
        let upright = level(base())? * body.rotation;
        if (upright * body.rotation.inverse()).angle() > LEAN {
            return None;
        }
        let footing = Self::on(solid, upright, table_height)?;
        let state = PlanarState {
            position: body.centre.coords.xy(),
            yaw: 0.0,
            velocity: body.velocity.xy(),
            yaw_rate: body.angular_velocity.z,
        };
        Some((footing, state))
    }

    /// A body that stands with the orientation `upright` at yaw 0; `None` when nothing flat is below its centre of mass.
    pub fn on(solid: &Solid<'_>, upright: UnitQuaternion<f64>, table_height: f64) -> Option<Self> {
        let turned = upright.to_rotation_matrix();
        let place = |p: &Point3<f64>| turned * (p.coords - solid.centre_of_mass);
        let lowest = solid.corners.iter().map(|p| place(p).z).fold(f64::INFINITY, f64::min);
        let hull = Polygon::of(solid.corners.iter().map(place).filter(|p| p.z < lowest + BASE).map(|p| p.xy()))?;
        if !hull.holds(Vector2::zeros(), 0.0) {
            return None;
        }
        let slider = Slider {
            mass: solid.mass,
            yaw_inertia: (turned * solid.inertia * turned.transpose())[(2, 2)],
            height: -lowest,
            patch: Patch::of_hull(&hull, solid.support).reaching(solid.pressure_reach),
        };
        Some(Self { slider, upright, table_height })
    }

    /// The standing body as a free one.
    pub fn release(&self, state: &PlanarState) -> FreeBody {
        FreeBody {
            centre: Point3::new(state.position.x, state.position.y, self.table_height + self.slider.height),
            rotation: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), state.yaw) * self.upright,
            velocity: Vector3::new(state.velocity.x, state.velocity.y, 0.0),
            angular_velocity: Vector3::new(0.0, 0.0, state.yaw_rate),
        }
    }
}

/// The smallest turn that lays the plane through `points` flat; `None` when they span no plane that could be a base.
fn level(points: impl Iterator<Item = Vector3<f64>>) -> Option<UnitQuaternion<f64>> {
    let (mut squares, mut product) = (Matrix3::zeros(), Vector3::zeros());
    for p in points {
        let row = Vector3::new(1.0, p.x, p.y);
        squares += row * row.transpose();
        product += row * p.z;
    }
    let plane = squares.try_inverse()? * product;
    let normal = Vector3::new(-plane.y, -plane.z, 1.0);
    Some(UnitQuaternion::from_rotation_matrix(&Rotation3::rotation_between(&normal, &Vector3::z())?))
}
