//! Clips of arms that go where they are commanded to be.

use nalgebra::{Isometry3, Point3};
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::recording::{Clip, JointSeries, ObjectSeries};
use shared_mem::time::seconds_between;
use std::f64::consts::PI;
use std::path::Path;
use twin::arm::ArmModel;

/// `q` gives the joint [rad] at a stamp [s].
pub(crate) fn of_one_joint(stamps_ns: Vec<u64>, q: impl Fn(f64) -> f64) -> Clip {
    let q = stamps_ns.iter().map(|ns| q(seconds_between(0, *ns))).collect();
    let series = JointSeries { stamps_ns, dof: 1, q, dq: Vec::new(), tau: Vec::new() };
    Clip {
        file: "clip.mcap".into(),
        kind: ClipKind::Excitation,
        joint_names: vec!["joint1".into()],
        desired: series.clone(),
        measured: series,
        torques_end_at_rows: false,
        origins: shared_mem::origin::Origins::default(),
        object: ObjectSeries::default(),
        others: Vec::new(),
        warnings: Vec::new(),
        damage: None,
    }
}

/// The shipped arm swings every joint for three seconds; in a stroke an object that stands at its tool slides 0.1 m, too. The table
/// of the cell is as high as that takes.
pub(super) fn of_the_shipped_arm(kind: ClipKind) -> (Cell, ArmModel, Clip) {
    let text = include_str!("../../../../config/fr3_cell.toml");
    let mut cell = Cell::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file");
    let arm = ArmModel::from_cell(&cell).expect("an arm");
    let (ready, dof) = (*arm.ready(), arm.dof());
    let series =
        |value: &dyn Fn(f64, usize) -> f64| (0..3000 * dof).map(|k| value((k / dof) as f64 * 1e-3, k % dof)).collect();
    let desired = JointSeries {
        dof,
        stamps_ns: (0..3000).map(|row| row * 1_000_000).collect(),
        q: series(&|t, joint| ready[joint] + 0.05 * (1.0 - (PI * t).cos())),
        dq: series(&|t, _| 0.05 * PI * (PI * t).sin()),
        tau: Vec::new(),
    };
    let tool = cell.tool.as_ref().expect("a tool");
    let tip = arm.flange(&ready).isometry() * Point3::new(0.0, 0.0, tool.length);
    cell.table.as_mut().expect("a table").height = tip.z - 0.05;
    let place = |row: u64| {
        let along = ((row as f64 - 45.0) / 20.0).clamp(0.0, 1.0);
        Pose::<Base, Object>::from_isometry(Isometry3::translation(tip.x + 0.052 + 0.1 * along, tip.y, tip.z))
    };
    let stroke = kind == ClipKind::ControlHitSlide;
    let rows = if stroke { 90 } else { 0 };
    let object = ObjectSeries {
        stamps_ns: (0..rows).map(|row| row * 33_000_000).collect(),
        poses: (0..rows).map(place).collect(),
    };
    let clip = Clip {
        kind,
        joint_names: arm.joint_names().to_vec(),
        measured: desired.clone(),
        desired,
        object,
        ..of_one_joint(Vec::new(), |_| 0.0)
    };
    (cell, arm, clip)
}
