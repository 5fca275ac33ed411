//! Rows of an arm against what made them: a simulated arm that swings one joint.

use super::*;
use crate::estimate::{ClipFit, Unknown};
use crate::likelihood::smoothing;
use shared_mem::cell::{ClipKind, Controller};
use shared_mem::msg::arm::ArmState;
use shared_mem::origin::Origins;
use shared_mem::recording::{JointSeries, ObjectSeries};
use shared_mem::theta::{ArmTheta, EffectTheta};
use shared_mem::time::TICK_NS;
use std::path::Path;
use twin::control::Drive;
use twin::sim::SimCell;

const DOF: usize = 7;

/// The shipped arm without an object, its sensors as noisy as that [rad, rad/s].
fn cell([q_noise, dq_noise]: [f64; 2]) -> Cell {
    let text = include_str!("../../../../../config/fr3_cell.toml");
    let mut cell = Cell::parse(text, Path::new("cell.toml")).expect("the shipped cell");
    cell.objects.clear();
    (cell.simulation.q_noise, cell.simulation.dq_noise) = (q_noise, dq_noise);
    cell
}

/// What the arm does while its fourth joint is commanded to swing, for 0.6 s.
fn swung(cell: &Cell, theta: &Theta, torques_end_at_rows: bool) -> Clip {
    let mut twin = SimCell::new(cell, Some(theta)).expect("a cell");
    let mut state = ArmState::default();
    twin.read(&mut state);
    let (home, mut log) = (state.q, [JointSeries::default(), JointSeries::default()]);
    for tick in 0..600_u32 {
        let t = f64::from(tick) * 1e-3;
        let (mut q_d, mut dq_d) = (home, [0.0; MAX_JOINTS]);
        (q_d[3], dq_d[3]) = (q_d[3] + 0.1 * (1.0 - (5.0 * t).cos()), 0.5 * (5.0 * t).sin());
        let mut row = state;
        twin.step(&Drive::JointImpedance { q_d, dq_d });
        twin.read(&mut state);
        if !torques_end_at_rows {
            (row.tau_J, row.tau_J_d) = (state.tau_J, state.tau_J_d);
        }
        let series = [(&row.q, &row.dq, &row.tau_J), (&q_d, &dq_d, &row.tau_J_d)];
        for (log, (q, dq, tau)) in log.iter_mut().zip(series) {
            log.dof = DOF;
            log.stamps_ns.push(u64::from(tick) * TICK_NS);
            log.q.extend(&q[..DOF]);
            log.dq.extend(&dq[..DOF]);
            log.tau.extend(&tau[..DOF]);
        }
    }
    let [measured, desired] = log;
    let joint_names = (1..=DOF).map(|joint| format!("fr3_joint{joint}")).collect();
    Clip {
        file: "clip.mcap".into(),
        kind: ClipKind::Excitation,
        joint_names,
        desired,
        measured,
        torques_end_at_rows,
        object: ObjectSeries::default(),
        others: Vec::new(),
        origins: Origins::default(),
        warnings: Vec::new(),
        damage: None,
    }
}

/// A load, so that torques are not those of an arm at rest.
fn loaded() -> Theta {
    let effect = EffectTheta { name: "payload".into(), parameters: [("mass".to_owned(), 0.3.into())].into() };
    Theta { effects: vec![effect], ..Theta::default() }
}

fn residuals(arm: &impl ClipModel, shared: &[f64]) -> Vec<f64> {
    let mut out = Vec::new();
    arm.residuals(0, shared, &[], &mut out).expect("it can be simulated");
    out
}

fn largest(residuals: impl IntoIterator<Item = f64>) -> f64 {
    residuals.into_iter().fold(0.0, |largest, residual| largest.max(residual.abs()))
}

#[test]
fn an_arm_that_swings_ever_wider_has_no_residuals_however_finite_its_joints_are() {
    let cell = cell([0.0; 2]);
    let recorded = swung(&cell, &Theta::default(), true);
    let arm = ArmClips::moments(&cell, &[recorded], |_: &[f64]| Theta::default()).expect("an arm");
    let left = |away: f64| {
        let mut readings = arm.readings(arm.by(1), (0, &[], &[])).expect("it can be simulated");
        readings[200].state.q[3] += away;
        arm.compared(&arm.clips[0], &readings)
    };
    assert!(left(0.0).is_ok());
    assert!(left(std::f64::consts::TAU).is_ok(), "a reading that wraps around");
    assert!(left(1e47).is_err_and(|why| why.0.contains("left all bounds")));
}

#[test]
fn torques_agree_whether_a_log_means_the_period_before_or_behind_its_stamp() {
    let (cell, theta) = (cell([0.0; 2]), loaded());
    // Of a part of a clip commands are kept from before it.
    for (end_at_rows, begins_ns) in [(true, 0), (false, 0), (true, 150_000_000), (false, 150_000_000)] {
        let mut recorded = swung(&cell, &theta, end_at_rows);
        recorded.measured = recorded.measured.between(begins_ns..=u64::MAX);
        let arm = ArmClips::moments(&cell, &[recorded], |_: &[f64]| theta.clone()).expect("an arm");
        let out = residuals(&arm, &[]);
        let torques: Vec<f64> =
            arm.rows(0).iter().zip(&out).filter(|(row, _)| row.channel >= 2 * DOF).map(|(_, r)| *r).collect();
        let worst = largest(torques.iter().copied());
        assert!(torques.len() > 2000 && worst < 3.0, "{end_at_rows}: {worst} sigmas in {} rows", torques.len());
        assert!(arm.rows(0).iter().any(|row| row.channel == 3 && row.regime == "fast forward"));
    }
}

#[test]
fn rows_are_zero_for_the_twins_own_log_and_stand_in_the_order_that_they_say() {
    let (cell, theta) = (cell([0.0; 2]), loaded());
    let recorded = swung(&cell, &theta, true);
    let known = |_: &[f64]| theta.clone();
    let moments = ArmClips::moments(&cell, std::slice::from_ref(&recorded), known).expect("an arm");
    let (means, left_out) = ArmClips::means(&cell, vec![recorded], known).expect("an arm");
    assert!(left_out.is_empty(), "{left_out:?}");
    for (arm, channels) in [(&moments, 4 * DOF), (&means, DOF)] {
        let (rows, out) = (arm.rows(0), residuals(arm, &[]));
        assert_eq!((arm.channels().len(), rows.len(), out.len() % channels), (channels, out.len(), 0));
        assert!(out.iter().all(|residual| residual.abs() < 3.0), "{}", largest(out));
        for channel in 0..channels {
            let times: Vec<f64> = rows.iter().filter(|row| row.channel == channel).map(|row| row.time).collect();
            assert!(times.len() == rows.len() / channels && times.is_sorted_by(|a, b| a < b), "channel {channel}");
        }
    }
    assert!(moments.rows(0).is_sorted_by_key(|row| row.channel));
    assert!(means.rows(0).is_sorted_by(|a, b| a.time <= b.time));
}

#[test]
fn residuals_are_in_sigmas_of_the_encoders_however_noisy_these_are() {
    for noise in [2e-6, 2e-5, 2e-4] {
        let cell = cell([noise, 50.0 * noise]);
        let recorded = swung(&cell, &Theta::default(), true);
        let arm = ArmClips::moments(&cell, &[recorded], |_: &[f64]| Theta::default()).expect("an arm");
        let out = residuals(&arm, &[]);
        let of_encoders: Vec<f64> =
            arm.rows(0).iter().zip(&out).filter(|(row, _)| row.channel < DOF).map(|(_, r)| r * r).collect();
        let mean_square = of_encoders.iter().sum::<f64>() / of_encoders.len() as f64;
        assert!((0.7..1.6).contains(&mean_square), "{mean_square} sigma^2 of a noise of {noise}");
        assert!((arm.sigma()[3] / noise - 1.0).abs() < 0.2, "{} of {noise}", arm.sigma()[3]);
    }
}

#[test]
fn slopes_of_rows_are_those_of_central_differences() {
    let cell = cell([0.0; 2]);
    let nominal = crate::likelihood::setting::complete(&cell, None).expect("gains").arm.expect("gains");
    let theta = |shared: &[f64]| {
        let ArmTheta { mut stiffness, damping } = nominal.clone();
        stiffness[3] = shared[0];
        Theta { arm: Some(ArmTheta { stiffness, damping }), ..Theta::default() }
    };
    let recorded = swung(&cell, &theta(&[630.0]), true);
    let arm = ArmClips::moments(&cell, &[recorded], theta).expect("an arm");
    let unknown = Unknown { name: "k".into(), start: 600.0, lower: 300.0, upper: 1200.0, step: 0.06 };
    let there = ClipFit::at(&arm, 0, (&[unknown], &[600.0]), (&[], &[])).expect("it can be simulated");
    let sides = [590.0, 610.0].map(|stiffness| residuals(&arm, &[stiffness]));
    let here = residuals(&arm, &[600.0]);
    let slopes = sides[1].iter().zip(&sides[0]).map(|(up, down)| (up - down) / 20.0);
    let (mut gradient, mut information) = (0.0, 0.0);
    for (residual, slope) in here.iter().zip(slopes) {
        (gradient, information) = (gradient + residual * slope, information + slope * slope);
    }
    let [found, curvature] = [there.gradient[0], there.information[(0, 0)]];
    assert!(
        (found / gradient - 1.0).abs() < 0.02 && (curvature / information - 1.0).abs() < 0.02,
        "{found} {gradient}"
    );
}

/// The clip as if its smoothed motion had been commanded, without its ends.
fn followed(clip: &Clip) -> Clip {
    let stamps = &clip.measured.stamps_ns;
    let half = smoothing::half_width(stamps).expect("rows");
    let within = stamps[0] + half..=stamps[stamps.len() - 1] - half;
    let kept = clip.measured.between(within);
    let motion = smoothing::motion(&clip.measured, &kept.stamps_ns, half);
    Clip { desired: motion.clone(), measured: JointSeries { tau: kept.tau, ..motion }, ..clip.clone() }
}

#[test]
fn along_a_measured_motion_the_torque_is_what_moves_links_and_overcomes_friction() {
    let cell = cell([0.0; 2]);
    let followed = followed(&swung(&cell, &Theta::default(), true));
    let law = cell.controller.clone().expect("a law");
    let none = Vec::new;
    let law =
        Controller { kind: ControllerKind::Tracking, stiffness: none(), damping: none(), torque_limit: none(), ..law };
    let tracking = Cell { controller: Some(law), ..cell };
    let viscous =
        EffectTheta { name: "joint_viscous_friction".into(), parameters: [("viscous".to_owned(), 2.0.into())].into() };
    // The clip's own torques are those behind the gear.
    for (effects, viscous, close) in [(Vec::new(), 0.0, 0.05), (vec![viscous], 2.0, 0.06)] {
        let theta = Theta { effects, ..Theta::default() };
        let arm = ArmClips::moments(&tracking, std::slice::from_ref(&followed), |_: &[f64]| theta.clone());
        let arm = arm.expect("an arm");
        assert!(arm.torque_sigma().is_some() && arm.channels().len() == DOF);
        let rows = arm.rows(0).iter().zip(residuals(&arm, &[])).filter(|(row, _)| row.channel == 3);
        for ((_, residual), measured) in rows.zip(&arm.clips[0].rows) {
            let (rest, dq) = (residual * arm.sigma()[3], followed.measured.dq_row(*measured).expect("velocities")[3]);
            assert!((rest + viscous * dq).abs() < close, "{rest} N m at {dq} rad/s");
        }
    }
}
