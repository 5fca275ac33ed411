//! A stroke for tests: the shipped cell with the box in the way of a turn of joint 1. 2.5 s, joints at 1 kHz, poses at 60 Hz.

use nalgebra::{Isometry3, Vector3};
use shared_mem::cell::{Cell, Table};
use shared_mem::frames::Pose;
use shared_mem::recording::JointSeries;
use shared_mem::theta::Theta;
use std::path::Path;
use twin::arm::{ArmModel, JointState};
use twin::control::CommandTrack;
use twin::rollout::{CellRollout, CellTrace, Course, ObjectState};

pub(crate) struct Stroke {
    pub(crate) cell: Cell,
    pub(crate) commands: CommandTrack,
    pub(crate) arm: JointState,
    pub(crate) object: ObjectState,
    pub(crate) joints_ns: Vec<u64>,
    pub(crate) poses_ns: Vec<u64>,
}

const START_NS: u64 = 1_700_000_000_000_000_123;

/// The parameters of a theta.toml.
pub(crate) fn theta(text: &str) -> Theta {
    shared_mem::toml_file::parse(text, Path::new("theta.toml")).expect("a theta.toml")
}

impl Stroke {
    /// Joint 1 turns by 0.5 rad and back within 1 s; the box, 60 mm away from the tip, slides on.
    pub(crate) fn new() -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
        let mut cell = Cell::read(&path).expect("the shipped cell");
        let model = ArmModel::from_cell(&cell).expect("an FR3");
        let (q, tip) = (*model.ready(), model.tip(model.ready()).position());
        cell.table = Some(Table { height: tip[2] - 0.03 });
        let mut desired = JointSeries { dof: 7, ..JointSeries::default() };
        for tick in 0..2500u64 {
            let phase = std::f64::consts::TAU * (tick as f64 * 1e-3).min(1.0);
            desired.stamps_ns.push(START_NS + tick * 1_000_000);
            desired.q.extend_from_slice(&q[..7]);
            desired.q[tick as usize * 7] += 0.25 * (1.0 - phase.cos());
        }
        let place = Vector3::new(tip[0] + 0.01, tip[1] + 0.09, tip[2] + 0.02);
        let object = ObjectState::at_rest(Pose::from_isometry(Isometry3::new(place, Vector3::z() * 0.2)));
        Self {
            cell,
            commands: CommandTrack::new(&desired).expect("rows"),
            arm: JointState::at_rest(q),
            object,
            joints_ns: desired.stamps_ns,
            poses_ns: (0..150).map(|i| START_NS + i * 16_666_667).collect(),
        }
    }

    pub(crate) fn worker(&self, theta: Option<&Theta>) -> CellRollout {
        CellRollout::new(&self.cell, theta).expect("a cell")
    }

    pub(crate) fn course(&self) -> Course<'_> {
        Course { commands: Some(&self.commands), joints_ns: &self.joints_ns, poses_ns: &self.poses_ns }
    }

    pub(crate) fn start(&self, worker: &mut CellRollout) {
        worker.start(self.joints_ns[0], Some(&self.arm), Some(&self.object), Some(&self.commands));
    }

    pub(crate) fn run(&self, worker: &mut CellRollout) -> CellTrace {
        let mut trace = CellTrace::default();
        self.start(worker);
        worker.run(&self.course(), &mut trace);
        trace
    }
}
