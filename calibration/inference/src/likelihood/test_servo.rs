//! An arm of two servos whose truth is known, and clips in which it swings: as cheap as an arm can be, so that many of them can be
//! fitted in a test. SI units.

use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::origin::Origins;
use shared_mem::recording::{Clip, JointSeries, ObjectSeries};
use shared_mem::theta::{ArmTheta, EffectTheta, Theta};
use std::path::Path;
use twin::arm::{JointState, MAX_JOINTS};
use twin::control::CommandTrack;
use twin::rollout::{CellRollout, CellTrace, Course};

/// Joints of the arm.
pub(crate) const DOF: usize = 2;
/// Stamp of the first row [ns].
pub(crate) const START_NS: u64 = 5_000_000_000;
/// Amplitude of each of the two swings that a joint's motion is made of [rad], and their angular frequencies over the joint's.
const AMPLITUDE: f64 = 0.08;
const OVERTONES: [f64; 2] = [1.0, 1.7];

/// How the joints are commanded to move, and how it is logged.
#[derive(Clone, Copy)]
pub(crate) struct Swing {
    /// Angular frequency of each joint's swing [rad/s]; a joint with 0 is commanded to stay.
    pub(crate) speeds: [f64; DOF],
    /// Rows of a millisecond.
    pub(crate) rows: u64,
    /// One sigma of the encoders' noise [rad], and what it is drawn from.
    pub(crate) noise: f64,
    pub(crate) seed: u64,
    /// In so many parts a control period is integrated.
    pub(crate) parts: u32,
}

impl Default for Swing {
    fn default() -> Self {
        Self { speeds: [4.0, 7.0], rows: 1000, noise: 0.0, seed: 0, parts: 1 }
    }
}

/// What is known of the arm; `kind`: the law that leads it.
pub(crate) fn cell(kind: &str) -> Cell {
    let text = format!(
        "[robot]\njoints = [\"a\", \"b\"]\n[controller]\nkind = \"{kind}\"\nstiffness = [30.0, 20.0]\ndamping = [3.0, 2.0]\n\
         rotor_inertia = [0.4, 0.2]\ntorque_limit = [12.0, 8.0]\n"
    );
    Cell::parse(&text, Path::new("cell.toml")).expect("a cell")
}

/// Gains of the arm.
pub(crate) fn gains(stiffness: [f64; DOF], damping: [f64; DOF]) -> Theta {
    let arm = ArmTheta { stiffness: stiffness.to_vec(), damping: damping.to_vec() };
    Theta { arm: Some(arm), ..Theta::default() }
}

/// The same with numbers of an effect.
pub(crate) fn with_effect(theta: &Theta, name: &str, numbers: &[(&str, f64)]) -> Theta {
    let parameters = numbers.iter().map(|(parameter, value)| ((*parameter).to_owned(), (*value).into())).collect();
    let effect = EffectTheta { name: name.into(), parameters };
    Theta { effects: [&theta.effects[..], &[effect]].concat(), ..theta.clone() }
}

/// What is commanded at a time since the first row [s]: positions, then velocities.
fn commanded(swing: &Swing, t: f64) -> [[f64; DOF]; 2] {
    let of = |joint: usize| {
        OVERTONES
            .map(|times| times * swing.speeds[joint])
            .iter()
            .fold([0.3, 0.0], |[q, dq], w| [q + AMPLITUDE * (1.0 - (w * t).cos()), dq + AMPLITUDE * w * (w * t).sin()])
    };
    let both = [of(0), of(1)];
    [both.map(|[q, _]| q), both.map(|[_, dq]| dq)]
}

/// A clip of the arm with these hidden parameters, from rest where it is commanded to begin.
pub(crate) fn clip(cell: &Cell, hidden: &Theta, swing: &Swing) -> Clip {
    let stamps_ns: Vec<u64> = (0..swing.rows).map(|row| START_NS + row * 1_000_000).collect();
    let mut desired = JointSeries { dof: DOF, stamps_ns: stamps_ns.clone(), ..JointSeries::default() };
    for row in 0..swing.rows {
        let [q, dq] = commanded(swing, row as f64 * 1e-3);
        desired.q.extend(q);
        desired.dq.extend(dq);
    }
    let commands = CommandTrack::new(&desired).expect("commands");
    let mut start = [0.0; MAX_JOINTS];
    start[..DOF].copy_from_slice(&desired.q[..DOF]);
    let mut rollout = CellRollout::new(cell, Some(hidden)).expect("an arm");
    rollout.refine(swing.parts);
    rollout.start(START_NS, Some(&JointState::at_rest(start)), None, Some(&commands));
    let mut trace = CellTrace::default();
    rollout.run(&Course { commands: Some(&commands), joints_ns: &stamps_ns, poses_ns: &[] }, &mut trace);
    let mut random = Pcg64::seed_from_u64(swing.seed);
    let mut measured = JointSeries { dof: DOF, stamps_ns, ..JointSeries::default() };
    for reading in &trace.joints {
        measured
            .q
            .extend(reading.state.q[..DOF].iter().map(|q| q + swing.noise * random.sample::<f64, _>(StandardNormal)));
        measured.dq.extend(&reading.state.dq[..DOF]);
        measured.tau.extend(&reading.tau_J[..DOF]);
        desired.tau.extend(&reading.tau_J_d[..DOF]);
    }
    Clip {
        file: format!("swing_{}.mcap", swing.seed).into(),
        kind: ClipKind::Excitation,
        joint_names: vec!["a".into(), "b".into()],
        desired,
        measured,
        torques_end_at_rows: true,
        object: ObjectSeries::default(),
        others: Vec::new(),
        origins: Origins::default(),
        warnings: Vec::new(),
        damage: None,
    }
}
