//! Sessions of a simulated FR3 whose gains are known, made with another time step than the twin's: excitation clips in
//! memory, 1 kHz, with the encoders' noise. SI units.

use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::msg::MAX_JOINTS;
use shared_mem::recording::{Clip, JointSeries, ObjectSeries};
use shared_mem::theta::ArmTheta;
use std::path::Path;
use twin::arm::{ArmModel, ControlLaw, JointState, Joints};

/// Noise of the encoders, one sigma [rad]; of a Franka.
pub(crate) const NOISE: f64 = 4e-6;
/// Steps of the simulation in a control period.
const SUBSTEPS: u32 = 4;
/// First stamp [ns].
const START_NS: u64 = 1_700_000_000_000_000_000;

/// The cell as a laboratory knows it.
pub(crate) fn cell() -> Cell {
    let text = include_str!("../../../../config/fr3_cell.toml");
    Cell { objects: Vec::new(), ..Cell::parse(text, Path::new("cell.toml")).expect("the shipped cell") }
}

/// The gains that a session's seed hides: nominal ones, each off by up to 20 %.
pub(crate) fn hidden(cell: &Cell, seed: u64) -> ArmTheta {
    let mut random = Pcg64::seed_from_u64(seed);
    let controller = cell.controller.as_ref().expect("a controller");
    let mut off = |nominal: &[f64]| nominal.iter().map(|gain| gain * random.random_range(0.8..1.2)).collect();
    ArmTheta { stiffness: off(&controller.stiffness), damping: off(&controller.damping) }
}

/// Clips of a seed's session, each its own motion.
pub(crate) fn clips(cell: &Cell, gains: &ArmTheta, count: u64, seconds: f64, seed: u64) -> Vec<Clip> {
    (0..count).map(|number| clip(cell, gains, number, seconds, seed * 1000 + number)).collect()
}

fn clip(cell: &Cell, gains: &ArmTheta, number: u64, seconds: f64, seed: u64) -> Clip {
    let arm = ArmModel::from_cell(cell).expect("an arm");
    let law = ControlLaw::new(cell.controller.as_ref(), Some(gains), &arm).expect("gains");
    let mut random = Pcg64::seed_from_u64(seed);
    let motion = Motion::draw(&arm, &mut random);
    let mut state = JointState::at_rest(*arm.ready());
    let (mut desired, mut measured) = (JointSeries::default(), JointSeries::default());
    (desired.dof, measured.dof) = (7, 7);
    for tick in 0..(seconds * 1e3) as u64 {
        let (q_d, dq_d) = motion.at(tick as f64 * 1e-3);
        let stamp = START_NS + tick * 1_000_000;
        desired.stamps_ns.push(stamp);
        desired.q.extend(&q_d[..7]);
        desired.dq.extend(&dq_d[..7]);
        measured.stamps_ns.push(stamp);
        measured.q.extend(state.q[..7].iter().map(|q| q + NOISE * random.sample::<f64, _>(StandardNormal)));
        measured.dq.extend(&state.dq[..7]);
        let tau = law.torque(&arm, &state, &q_d, &dq_d);
        (0..SUBSTEPS).for_each(|_| arm.step(&mut state, &tau, 1e-3 / f64::from(SUBSTEPS)));
    }
    Clip {
        file: format!("clip_{number:02}.mcap").into(),
        kind: ClipKind::Excitation,
        torques_end_at_rows: false,
        origins: shared_mem::origin::Origins::default(),
        joint_names: arm.joint_names().to_vec(),
        desired,
        measured,
        object: ObjectSeries::default(),
        others: Vec::new(),
        warnings: Vec::new(),
        damage: None,
    }
}

/// Four sines a joint around the ready pose, growing from rest.
struct Motion {
    middle: Joints,
    /// Amplitude [rad], angular frequency [rad/s], phase [rad].
    sines: [[[f64; 3]; 4]; MAX_JOINTS],
}

impl Motion {
    fn draw(arm: &ArmModel, random: &mut Pcg64) -> Self {
        let mut sine =
            || [random.random_range(0.02..0.08), random.random_range(2.0..16.0), random.random_range(0.0..6.0)];
        Self { middle: *arm.ready(), sines: std::array::from_fn(|_| std::array::from_fn(|_| sine())) }
    }

    fn at(&self, t: f64) -> (Joints, Joints) {
        // 1 - exp(-t²) starts with no speed.
        let (grown, growing) = (1.0 - (-t * t).exp(), 2.0 * t * (-t * t).exp());
        let (mut q, mut dq) = (self.middle, [0.0; MAX_JOINTS]);
        for joint in 0..7 {
            for [amplitude, omega, phase] in self.sines[joint] {
                let (sin, cos) = (omega * t + phase).sin_cos();
                q[joint] += amplitude * grown * sin;
                dq[joint] += amplitude * (growing * sin + grown * omega * cos);
            }
        }
        (q, dq)
    }
}
