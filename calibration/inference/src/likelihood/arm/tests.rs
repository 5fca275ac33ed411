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
    // What is left is the start state, which is estimated from the log: rad, rad/s, N m.
    let close = |quantity: &str| if quantity == "q" { 1e-4 } else { 5e-3 };
    for (arm, channels) in [(&moments, 4 * DOF), (&means, DOF)] {
        let (rows, out) = (arm.rows(0), residuals(arm, &[]));
        assert_eq!((arm.channels().len(), rows.len(), out.len() % channels), (channels, out.len(), 0));
        for (row, residual) in rows.iter().zip(&out) {
            let (channel, error) = (&arm.channels()[row.channel], residual * arm.sigma()[row.channel]);
            assert!(error.abs() < close(channel.quantity), "{channel:?}: {error} at {} s", row.time);
        }
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

fn prepared(clip: Clip) -> Result<ArmClip, ArmClipError> {
    let cell = cell([0.0; 2]);
    ArmClip::new(clip, &cell, &ArmModel::from_cell(&cell).expect("an arm")).and_then(ArmClip::long_enough)
}

fn plain() -> Clip {
    swung(&cell([0.0; 2]), &Theta::default(), true)
}

#[test]
fn rows_are_averaged_over_five_milliseconds_and_every_row_counts_once() {
    let clip = prepared(plain()).expect("usable");
    assert_eq!(clip.averaged().flatten().copied().collect::<Vec<_>>(), (0..600).collect::<Vec<_>>());
    assert!(clip.averaged().all(|bin| bin.len() == 5));
    assert_eq!((clip.runs.len(), clip.alone_until_ns, clip.warnings.len()), (1, u64::MAX, 0));
    let slow = plain().measured;
    let every_20_ms = |series: &JointSeries| {
        let rows = |values: &[f64]| values.chunks(DOF).step_by(20).flatten().copied().collect::<Vec<_>>();
        let stamps_ns = series.stamps_ns.iter().step_by(20).copied().collect();
        JointSeries { dof: DOF, stamps_ns, q: rows(&series.q), dq: Vec::new(), tau: Vec::new() }
    };
    let slow = prepared(Clip { measured: every_20_ms(&slow), ..plain() }).expect("usable");
    assert!(slow.averaged().all(|bin| bin.len() == 1), "single rows of slower logs");
}

#[test]
fn what_cannot_be_used_is_refused_with_the_reason() {
    let cut = |mut clip: Clip, to_ns: u64| {
        clip.measured = clip.measured.between(0..=to_ns);
        clip
    };
    assert!(matches!(prepared(cut(plain(), 0)), Err(ArmClipError::Empty)));
    assert!(matches!(prepared(cut(plain(), 300_000_000)), Err(ArmClipError::Short(_))));
    assert!(matches!(prepared(Clip { desired: JointSeries::default(), ..plain() }), Err(ArmClipError::NoCommands)));
    let later = |mut series: JointSeries, by_ns: u64| {
        series.stamps_ns.iter_mut().for_each(|stamp| *stamp += by_ns);
        series
    };
    let apart = Clip { desired: later(plain().desired, 5_000_000_000), ..plain() };
    assert!(matches!(prepared(apart), Err(ArmClipError::Apart)));
    let mut slow = plain();
    slow.measured.stamps_ns.iter_mut().for_each(|stamp| *stamp *= 50);
    assert!(matches!(prepared(slow), Err(ArmClipError::Slow(rate)) if (rate - 20.0).abs() < 0.1));
}

#[test]
fn a_joint_whose_readings_stand_still_has_rows_of_zero_until_its_neighbours_feel_it_move() {
    let mut clip = plain();
    let stays = clip.measured.q_row(0)[3];
    clip.measured.q.iter_mut().skip(3).step_by(DOF).for_each(|q| *q = stays);
    clip.measured.dq.clear();
    let (mut arm, left_out) =
        ArmClips::means(&cell([0.0; 2]), vec![clip], |_: &[f64]| Theta::default()).expect("an arm");
    assert!(left_out.is_empty() && arm.clip(0).dead[3] && arm.clip(0).stands_still(3));
    assert!(arm.clip(0).warnings.iter().any(|warning| warning.starts_with("joint 4 `fr3_joint4` does not move")));
    let of_joint = |arm: &ArmClips<_>| {
        let rows = residuals(arm, &[]).into_iter().enumerate();
        largest(rows.filter(|(row, _)| row % DOF == 3).map(|(_, residual)| residual))
    };
    assert_eq!(of_joint(&arm), 0.0);
    let before = largest(residuals(&arm, &[]));
    arm.settle_dead_joints(&[]);
    assert!(!arm.clip(0).stands_still(3), "the others feel it");
    assert_eq!(of_joint(&arm), 0.0);
    assert!(largest(residuals(&arm, &[])) < 0.5 * before, "they were held against a joint at rest");
}

#[test]
fn a_clock_that_jumps_and_a_hole_in_the_commands_split_a_clip() {
    let mut jumped = plain();
    jumped.measured.stamps_ns.iter_mut().skip(550).for_each(|stamp| *stamp += 40_000_000);
    let jumped = prepared(jumped).expect("usable");
    assert!(
        jumped.warnings.iter().any(|warning| warning.contains("clock jumps by 0.041 s at 0.549 s")),
        "{:?}",
        jumped.warnings
    );
    assert!(jumped.rows.iter().all(|row| *row < 550));
    let mut holed = plain();
    let (before, after) = (holed.desired.between(0..=49_000_000), holed.desired.between(300_000_000..=u64::MAX));
    let joined = |a: &[f64], b: &[f64]| [a, b].concat();
    holed.desired = JointSeries {
        dof: DOF,
        stamps_ns: [&before.stamps_ns[..], &after.stamps_ns].concat(),
        q: joined(&before.q, &after.q),
        dq: joined(&before.dq, &after.dq),
        tau: joined(&before.tau, &after.tau),
    };
    let cell = cell([0.0; 2]);
    let model = ArmModel::from_cell(&cell).expect("an arm");
    let clip = ArmClip::new(holed.clone(), &cell, &model).expect("usable");
    assert_eq!(clip.runs.iter().map(|run| run.from).collect::<Vec<_>>(), [0, 300]);
    assert!(clip.averaged().all(|bin| bin[bin.len() - 1] - bin[0] == bin.len() - 1), "no mean over the hole");
    assert!(clip.warnings.iter().any(|warning| warning.contains("no commands")), "{:?}", clip.warnings);
    let whole = clip.longest_stretch().expect("a part");
    assert_eq!(*whole.start(), 300_000_000);
}

#[test]
fn moments_are_few_and_begin_where_the_first_velocity_is_forgotten() {
    let cell = cell([0.0; 2]);
    let arm = ArmClips::moments(&cell, &[plain()], |_: &[f64]| Theta::default()).expect("an arm");
    let clip = arm.clip(0);
    assert!(clip.rows.len() <= 250 && clip.rows.len() > 150, "{}", clip.rows.len());
    assert!(clip.rows[0] == 80 && clip.rows.is_sorted_by(|a, b| b - a == 3));
    assert_eq!(clip.asked_ns.len(), 2 * clip.rows.len());
    assert_eq!(arm.stretches(0), [] as [usize; 0], "a clip is one witness");
    let mut halted = plain();
    halted.desired.tau.clear();
    halted.measured.dq.clear();
    let arm = ArmClips::moments(&cell, &[halted], |_: &[f64]| Theta::default()).expect("an arm");
    let quantities: Vec<_> = arm.channels().iter().step_by(DOF).map(|channel| channel.quantity).collect();
    assert_eq!(quantities, ["q", "tau_J"], "what is logged in every clip");
}

#[test]
fn peaks_are_what_the_controller_asks_of_a_loaded_arm_with_gravity() {
    let cell = cell([0.0; 2]);
    let recorded = swung(&cell, &loaded(), true);
    let arm = ArmClips::moments(&cell, std::slice::from_ref(&recorded), |_: &[f64]| loaded()).expect("an arm");
    let peaks = arm.peaks(&[]).expect("it can be simulated");
    let model = arm.arm();
    for (joint, peak) in peaks.iter().enumerate().take(DOF) {
        let logged = (80..600).map(|row| {
            let mut q = [0.0; MAX_JOINTS];
            q[..DOF].copy_from_slice(recorded.measured.q_row(row));
            (recorded.desired.tau[row * DOF + joint] + model.gravity(&q)[joint]).abs()
        });
        let largest = logged.fold(0.0, f64::max);
        assert!((peak - largest).abs() < 0.02 * largest.max(1.0), "joint {joint}: {peak} of {largest}");
    }
}

#[test]
fn a_log_without_noise_is_trusted_no_further_than_sensors_can_be() {
    let cell = cell([0.0; 2]);
    let arm = ArmClips::moments(&cell, &[plain()], |_: &[f64]| Theta::default()).expect("an arm");
    for (channel, sigma) in arm.channels().iter().zip(arm.sigma()) {
        assert!(*sigma >= noise::floor(channel.quantity), "{channel:?}: {sigma}");
    }
    assert_eq!(arm.sigma()[0], noise::floor("q"), "a joint that hardly moves");
    let quantisation = std::f64::consts::TAU / 2.0_f64.powi(21) / 12.0_f64.sqrt();
    assert!((0.8..1.0).contains(&(quantisation / noise::floor("q"))), "{quantisation} rad");
}
