//! A box on a table, without an arm, to try effects on.

use super::{SlideEffects, TableFriction};
use crate::control::Drive;
use crate::effects::Effects;
use crate::sim::SimCell;
use crate::sliding::SlidingFriction as _;
use nalgebra::{Isometry3, Vector2, Vector3};
use shared_mem::cell::{Cell, Object, Table};
use shared_mem::frames::Pose;
use shared_mem::theta::{ObjectTheta, Theta};
use std::path::Path;

/// Mass of the box [kg].
pub(super) const MASS: f64 = 0.25;
/// Its edge lengths [m]: flat, so that it does not tip.
pub(super) const SIZE: [f64; 3] = [0.08, 0.06, 0.02];

fn theta(blocks: &str) -> Theta {
    shared_mem::toml_file::parse(blocks, Path::new("theta.toml")).expect("a theta.toml")
}

/// The effects of `[[effect]]` blocks.
pub(super) fn effects(blocks: &str) -> SlideEffects {
    Effects::from_theta(&theta(blocks).effects, 0).expect("known effects").slide
}

/// Coefficient on a table of 0.3.
pub(super) fn mu(blocks: &str, point: [f64; 2], velocity: [f64; 2]) -> f64 {
    let friction = TableFriction { nominal: 0.3, effects: Some(effects(blocks)) };
    friction.mu(Vector2::from(point), Vector2::from(velocity))
}

/// How far and by what angle the box has come after a time, from a velocity along x [m/s] and a spin [rad/s].
pub(in crate::effects) fn slid(
    blocks: &str,
    friction: f64,
    velocity: f64,
    spin: f64,
    seconds: f64,
) -> (Vector3<f64>, f64) {
    let description = Cell {
        objects: vec![Object { size: Some(SIZE), ..Object::default() }],
        table: Some(Table { height: 0.0 }),
        ..Cell::default()
    };
    let object = ObjectTheta { friction: Some(friction), mass: Some(MASS), ..ObjectTheta::default() };
    let mut cell =
        SimCell::new(&description, Some(&Theta { object: Some(object), ..theta(blocks) })).expect("a box on a table");
    let start = Isometry3::translation(0.0, 0.0, 0.5 * SIZE[2]);
    cell.set_object(&Pose::from_isometry(start), Vector3::x() * velocity, Vector3::z() * spin);
    let yaw_rate = |cell: &SimCell| cell.object_velocity().expect("a box").1.z;
    let mut yaw = 0.0;
    for _ in 0..(seconds * 1e3) as usize {
        let before = yaw_rate(&cell);
        cell.step(&Drive::Torque { tau_J_d: [0.0; 8] });
        yaw += 0.5e-3 * (before + yaw_rate(&cell));
    }
    (cell.object().expect("a box").isometry().translation.vector - start.translation.vector, yaw)
}
