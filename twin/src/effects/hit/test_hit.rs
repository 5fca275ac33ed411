//! A stroke of the shipped cell's arm against its box, to try effects on.

use super::HitEffects;
use crate::arm::ArmModel;
use crate::control::Drive;
use crate::effects::Effects;
use crate::shipped::shipped;
use crate::sim::SimCell;
use nalgebra::{UnitQuaternion, Vector3};
use shared_mem::cell::{Cell, Table};
use shared_mem::theta::Theta;
use std::path::Path;

fn theta(blocks: &str) -> Theta {
    shared_mem::toml_file::parse(blocks, Path::new("theta.toml")).expect("a theta.toml")
}

/// The effects of `[[effect]]` blocks.
pub(super) fn all_effects(blocks: &str) -> Effects {
    Effects::from_theta(&theta(blocks).effects, 7).expect("known effects")
}

/// Those of them on the hit.
pub(super) fn effects(blocks: &str) -> HitEffects {
    all_effects(blocks).hit
}

/// The shipped cell with the table lifted to under the tip and the box 20 mm beside it, so that turning joint 1 strikes it.
pub(super) fn striking() -> (Cell, ArmModel) {
    let mut cell = shipped();
    let arm = ArmModel::from_cell(&cell).expect("an FR3");
    let tip = arm.tip(arm.ready()).position();
    cell.table = Some(Table { height: tip[2] - 0.03 });
    cell.simulation.object_position = [tip[0], tip[1] + 0.062];
    (cell, arm)
}

/// Orientation of the flange when the stroke begins.
pub(super) fn flange_rotation() -> UnitQuaternion<f64> {
    let (_, arm) = striking();
    arm.flange(arm.ready()).isometry().rotation
}

/// Where the nominal tip was when tool and box first touched [m], and how fast it moved [m/s].
pub(super) fn first_contact(blocks: &str) -> (Vector3<f64>, f64) {
    let (description, arm) = striking();
    let mut cell = SimCell::new(&description, Some(&theta(blocks))).expect("a cell");
    let start = cell.q();
    let mut before = Vector3::from(arm.tip(&start).position());
    for period in 0..1000 {
        let (mut q_d, mut dq_d) = (start, [0.0; 8]);
        (q_d[0], dq_d[0]) = (start[0] + 0.3e-3 * f64::from(period), 0.3);
        cell.step(&Drive::JointImpedance { q_d, dq_d });
        let tip = Vector3::from(arm.tip(&cell.q()).position());
        if cell.first_contact_ns().is_some() {
            return (tip, (tip - before).norm() * 1e3);
        }
        before = tip;
    }
    panic!("the stroke misses the box")
}
