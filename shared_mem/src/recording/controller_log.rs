//! What a controller logs in other quantities than positions and torques, made into these: velocities that a velocity interface
//! is sent, and motor currents.

use super::series::JointSeries;
use crate::cell::{Cell, ControllerKind};
use crate::recording::Clip;
use crate::time::seconds_between;

/// The clip with positions that a velocity interface was led to, and with torques for currents.
pub(super) fn in_positions_and_torques(mut clip: Clip, cell: &Cell) -> Clip {
    let Some(controller) = &cell.controller else { return clip };
    if controller.kind == ControllerKind::JointVelocity && !clip.measured.is_empty() {
        integrate(&mut clip.desired, &clip.measured);
    }
    let dof = clip.measured.dof;
    if controller.torque_constant.len() == dof && dof > 0 {
        let constants = controller.torque_constant.iter().cycle();
        clip.measured.tau.iter_mut().zip(constants).for_each(|(current, constant)| *current *= constant);
    }
    clip
}

/// Positions of commands that hold velocities alone: the velocity in force, summed up from where the joints were at the first command.
fn integrate(desired: &mut JointSeries, measured: &JointSeries) {
    let (dof, rows) = (desired.dof, desired.len());
    // Positions that were logged as well are what the robot was led to, lost rows and all.
    let logged = desired.q.iter().any(|q| *q != 0.0);
    if rows == 0 || logged || measured.dof != dof || desired.dq.len() != rows * dof {
        return;
    }
    let first = measured.stamps_ns.partition_point(|stamp| *stamp < desired.stamps_ns[0]).min(measured.len() - 1);
    let mut at = measured.q_row(first).to_vec();
    for row in 0..rows {
        if row > 0 {
            let dt = seconds_between(desired.stamps_ns[row - 1], desired.stamps_ns[row]);
            let before = &desired.dq[(row - 1) * dof..row * dof];
            at.iter_mut().zip(before).for_each(|(q, dq)| *q += dq * dt);
        }
        desired.q[row * dof..(row + 1) * dof].copy_from_slice(&at);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cell::{ClipKind, Controller};
    use crate::recording::ObjectSeries;

    fn clip() -> Clip {
        let stamps_ns: Vec<u64> = (0..5).map(|row| row * 100_000_000).collect();
        let series = |q: f64, dq: f64| JointSeries {
            stamps_ns: stamps_ns.clone(),
            dof: 2,
            q: vec![q; 10],
            dq: vec![dq; 10],
            tau: vec![0.5; 10],
        };
        Clip {
            others: Vec::new(),
            origins: crate::origin::Origins::default(),
            file: "clip.mcap".into(),
            kind: ClipKind::Excitation,
            joint_names: vec!["a".into(), "b".into()],
            desired: series(0.0, 2.0),
            measured: series(0.3, 0.0),
            torques_end_at_rows: false,
            object: ObjectSeries::default(),
            warnings: Vec::new(),
            damage: None,
        }
    }

    fn read_with(controller: Controller) -> Clip {
        in_positions_and_torques(clip(), &Cell { controller: Some(controller), ..Cell::default() })
    }

    #[test]
    fn velocities_that_were_commanded_become_positions_from_where_the_joints_were() {
        let read = read_with(Controller { kind: ControllerKind::JointVelocity, ..Controller::default() });
        for row in 0..5 {
            let expected = 0.3 + 0.2 * row as f64;
            assert!(read.desired.q_row(row).iter().all(|q| (q - expected).abs() < 1e-12), "{:?}", read.desired.q);
        }
        assert_eq!(read_with(Controller::default()), clip(), "positions stay as they were logged");
    }

    #[test]
    fn currents_become_torques_by_the_constant_of_each_motor() {
        let read = read_with(Controller { torque_constant: vec![0.1, 2.0], ..Controller::default() });
        assert_eq!(read.measured.tau_row(3), Some(&[0.05, 1.0][..]));
        assert_eq!(read.desired.tau, clip().desired.tau);
    }
}
