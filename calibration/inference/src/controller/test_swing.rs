//! A joint that swings under a law of its cell.

use shared_mem::cell::Cell;
use shared_mem::recording::{Clip, JointSeries, ObjectSeries};
use twin::arm::{ArmModel, JointState};
use twin::control::{ArmRollout, CommandTrack};

/// A joint whose law is not stated.
pub(super) const CELL: &str =
    "[robot]\njoints = [\"a\"]\n[controller]\nstiffness = [30.0]\ndamping = [3.0]\nrotor_inertia = [0.4]\n";

/// What a joint does under a cell's law that is commanded a sum of swings, with gains that are not those of cell.toml. The log has every
/// so many of the commands.
pub(super) fn clip(cell: &Cell, faster: f64, every: usize) -> Clip {
    let arm = ArmModel::from_cell(cell).expect("a joint");
    let theta = shared_mem::theta::ArmTheta { stiffness: vec![33.0], damping: vec![2.8] };
    let law = twin::arm::ControlLaw::new(cell.controller.as_ref(), Some(&theta), &arm).expect("gains");
    let stamps_ns: Vec<u64> = (1..=3000).map(|tick| tick * 1_000_000).collect();
    let swing = |stamp: &u64, of: fn(f64) -> f64, power: i32| -> f64 {
        let t = *stamp as f64 * 1e-9;
        [2.0, 5.0, 9.0].iter().map(|w| w * faster).map(|w| 0.1 * w.powi(power) * of(w * t)).sum()
    };
    let logged = || stamps_ns.iter().step_by(every);
    let desired = JointSeries {
        dof: 1,
        q: logged().map(|stamp| swing(stamp, f64::sin, 0)).collect(),
        dq: logged().map(|stamp| swing(stamp, f64::cos, 1)).collect(),
        tau: Vec::new(),
        stamps_ns: logged().copied().collect(),
    };
    let commands = CommandTrack::of_cell(&desired, cell).expect("commands");
    let rollout = ArmRollout { arm: &arm, nominal: &arm, law: &law, effects: None, parts: 1 };
    let mut states = vec![JointState::default(); stamps_ns.len()];
    rollout.run(&JointState::default(), stamps_ns[0], &commands, &stamps_ns, &mut states);
    let noise = |row: usize| 1e-5 * (1e4 * row as f64).sin();
    let measured = JointSeries {
        q: states.iter().enumerate().map(|(row, state)| state.q[0] + noise(row)).collect(),
        stamps_ns,
        dof: 1,
        ..JointSeries::default()
    };
    Clip {
        others: Vec::new(),
        file: "swing.mcap".into(),
        kind: shared_mem::cell::ClipKind::Excitation,
        joint_names: vec!["a".into()],
        desired,
        measured,
        torques_end_at_rows: true,
        origins: shared_mem::origin::Origins::default(),
        object: ObjectSeries::default(),
        warnings: Vec::new(),
        damage: None,
    }
}
