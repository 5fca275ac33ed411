//! Identification of an arm on sessions whose gains are known, on recordings with faults, and on recorded sessions.

use crate::arm_session;
use crate::arm_session::{cell, clips, hidden};
use calibration::identify::arm::{Options, identify_clips};
use calibration::identify::{Identification, Optimizer};
use inference::interrupt::Interrupt;
use shared_mem::cell::Cell;
use shared_mem::recording::{Clip, JointSeries};
use shared_mem::theta::ArmTheta;

/// Long enough for a test.
const SECONDS: f64 = 1.5;

fn options() -> Options {
    Options { budget: 400, ..Options::default() }
}

fn identify(cell: &Cell, clips: Vec<Clip>) -> Result<Identification, String> {
    identify_clips(cell, clips, &options(), &Interrupt::default()).map_err(|error| error.to_string())
}

/// Number of gains, and how many of them lie in their intervals; the largest relative error.
fn judge(found: &Identification, truth: &ArmTheta) -> (usize, usize, f64) {
    let (mut all, mut inside, mut worst) = (0, 0, 0.0_f64);
    for (name, truth) in [("stiffness", &truth.stiffness), ("damping", &truth.damping)] {
        let parameter = &found.parameters[name];
        for ((value, [lo, hi]), truth) in parameter.value.iter().zip(&parameter.ci95).zip(truth) {
            all += 1;
            inside += usize::from((*lo..=*hi).contains(truth));
            worst = worst.max((value / truth - 1.0).abs());
        }
    }
    (all, inside, worst)
}

fn every(n: usize, series: &JointSeries) -> JointSeries {
    let rows = (0..series.len()).step_by(n);
    let pick = |values: &[f64]| -> Vec<f64> {
        if values.is_empty() {
            return Vec::new();
        }
        rows.clone().flat_map(|i| values[i * series.dof..(i + 1) * series.dof].to_vec()).collect()
    };
    let stamps_ns = rows.clone().map(|i| series.stamps_ns[i]).collect();
    JointSeries { stamps_ns, dof: series.dof, q: pick(&series.q), dq: pick(&series.dq), tau: pick(&series.tau) }
}

#[test]
fn gains_are_found_and_the_error_is_told_on_clips_that_were_not_fitted() {
    let cell = cell();
    let truth = hidden(&cell, 1);
    let found = identify(&cell, clips(&cell, &truth, 3, SECONDS, 1)).expect("an answer");
    let (_, _, worst) = judge(&found, &truth);
    assert!(found.converged && worst < 5e-3, "{worst}");
    assert_eq!((found.clips.train.len(), found.clips.holdout.len()), (2, 1));
    let held_out = found.gap.holdout.joint_rms_rad.expect("a figure");
    assert!(held_out < 2.0 * arm_session::NOISE, "{held_out}");
    assert!(found.gap.holdout_before.joint_rms_rad.expect("a figure") > 20.0 * held_out);
    assert!(!found.advice.is_empty() && found.advice.iter().all(|advice| advice.predicted < advice.now));
}

#[test]
fn any_number_of_threads_gives_the_same_bits() {
    let cell = cell();
    let truth = hidden(&cell, 2);
    let recorded = clips(&cell, &truth, 2, 0.8, 2);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| identify(&cell, recorded.clone())).expect("an answer").parameters
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn a_single_clip_is_fitted_and_said_to_hold_nothing_out() {
    let cell = cell();
    let truth = hidden(&cell, 3);
    let found = identify(&cell, clips(&cell, &truth, 1, SECONDS, 3)).expect("an answer");
    assert_eq!(found.gap.holdout.joint_rms_rad, None);
    assert!(found.warnings.iter().any(|warning| warning.contains("record another motion")), "{:?}", found.warnings);
    assert!(judge(&found, &truth).2 < 1e-2);
}

#[test]
fn a_clip_of_another_robot_is_left_out_with_its_reason() {
    let cell = cell();
    let truth = hidden(&cell, 4);
    let mut recorded = clips(&cell, &truth, 3, SECONDS, 4);
    recorded[1].joint_names = (1..=7).map(|i| format!("ur_joint{i}")).collect();
    let found = identify(&cell, recorded).expect("an answer");
    assert_eq!(found.clips.left_out.len(), 1);
    assert!(found.clips.left_out[0].why.contains("ur_joint1"), "{:?}", found.clips.left_out);
    assert!(found.warnings.iter().any(|warning| warning.contains("1 of 3 clips")));
}

#[test]
fn a_dead_joint_keeps_its_gains_and_is_told() {
    let cell = cell();
    let truth = hidden(&cell, 5);
    let mut recorded = clips(&cell, &truth, 2, SECONDS, 5);
    for clip in &mut recorded {
        let stays = clip.measured.q[6];
        clip.measured.q.iter_mut().skip(6).step_by(7).for_each(|q| *q = stays);
    }
    let found = identify(&cell, recorded).expect("an answer");
    let told = |name: &str| found.not_identifiable.iter().find(|untold| untold.parameter == name);
    assert!(told("stiffness[6]").expect("a reason").why.contains("joint 7 follows its command in no clip"));
    assert_eq!(found.parameters["stiffness"].value[6], 50.0);
    assert!(told("stiffness[0]").is_none());
}

#[test]
fn a_reading_that_stands_still_while_the_others_feel_its_joint_move_leaves_their_gains_right() {
    let cell = cell();
    let truth = hidden(&cell, 12);
    let mut recorded = clips(&cell, &truth, 3, SECONDS, 12);
    for clip in &mut recorded {
        let stays = clip.measured.q[3];
        clip.measured.q.iter_mut().skip(3).step_by(7).for_each(|q| *q = stays);
        clip.measured.dq.iter_mut().skip(3).step_by(7).for_each(|dq| *dq = 0.0);
    }
    let found = identify(&cell, recorded).expect("an answer");
    assert!(
        found.warnings.iter().any(|w| w.contains("joint 4 `fr3_joint4` stands still in its readings")),
        "{:?}",
        found.warnings
    );
    for joint in [0, 1, 2, 4, 5, 6] {
        let error = found.parameters["stiffness"].value[joint] / truth.stiffness[joint] - 1.0;
        assert!(error.abs() < 0.03, "joint {}: {error}", joint + 1);
    }
}

#[test]
fn a_torque_limit_is_found_where_it_clips_and_left_away_where_it_does_not() {
    let cell = cell();
    let mut real = cell.clone();
    real.controller.as_mut().expect("a controller").torque_limit = vec![8.0, 87.0, 87.0, 87.0, 12.0, 12.0, 12.0];
    let truth = hidden(&cell, 13);
    let recorded = clips(&real, &truth, 2, SECONDS, 13);
    let options = Options { also: vec!["torque_saturation".into()], ..options() };
    let found = identify_clips(&cell, recorded, &options, &Interrupt::default()).expect("an answer");
    let limits = &found.parameters["torque_saturation.limit"].value;
    assert!((limits[0] / 8.0 - 1.0).abs() < 0.02, "{limits:?}");
    assert!(limits[1..].iter().all(|limit| limit.is_infinite()), "{limits:?}");
    assert!(judge(&found, &truth).2 < 1e-2);
}

#[test]
fn a_log_of_15_hz_is_refused_and_one_of_50_hz_is_not() {
    let cell = cell();
    let truth = hidden(&cell, 6);
    let recorded = clips(&cell, &truth, 2, 4.0, 6);
    let slowed = |n: usize| {
        let slow = |clip: &Clip| Clip { measured: every(n, &clip.measured), ..clip.clone() };
        identify(&cell, recorded.iter().map(slow).collect())
    };
    let refused = slowed(66).expect_err("a refusal");
    assert!(refused.contains("15 Hz") && refused.contains("record at 100 Hz or more"), "{refused}");
    let (_, _, worst) = judge(&slowed(20).expect("an answer"), &truth);
    assert!(worst < 2e-2, "{worst}");
}

#[test]
fn commands_missing_for_200_ms_are_left_out_and_told() {
    let cell = cell();
    let truth = hidden(&cell, 7);
    let mut recorded = clips(&cell, &truth, 2, SECONDS, 7);
    let desired = &mut recorded[0].desired;
    desired.stamps_ns.drain(600..800);
    desired.q.drain(600 * 7..800 * 7);
    desired.dq.drain(600 * 7..800 * 7);
    let found = identify(&cell, recorded).expect("an answer");
    let warnings: Vec<&String> = found.by_clip.iter().flat_map(|clip| &clip.warnings).collect();
    assert!(warnings.iter().any(|warning| warning.contains("no commands for 0.20")), "{warnings:?}");
    assert!(judge(&found, &truth).2 < 1e-2);
}

#[test]
fn what_follows_a_jump_of_the_robots_clock_is_left_out_and_told() {
    let cell = cell();
    let truth = hidden(&cell, 8);
    let mut recorded = clips(&cell, &truth, 4, SECONDS, 8);
    // The robot's clock jumps by 50 ms against the commands'.
    recorded[2].measured.stamps_ns.iter_mut().skip(700).for_each(|stamp| *stamp += 50_000_000);
    let found = identify(&cell, recorded).expect("an answer");
    let warnings: Vec<&String> = found.by_clip.iter().flat_map(|clip| &clip.warnings).collect();
    assert!(warnings.iter().any(|warning| warning.contains("clock jumps by 0.051 s at 0.699 s")), "{warnings:?}");
    assert!(judge(&found, &truth).2 < 1e-2);
}

#[test]
fn rows_of_another_clock_are_left_out_with_the_remedy() {
    let cell = cell();
    let truth = hidden(&cell, 12);
    let mut recorded = clips(&cell, &truth, 3, SECONDS, 12);
    recorded[1].measured.stamps_ns.iter_mut().for_each(|stamp| *stamp += 3_600_000_000_000);
    let found = identify(&cell, recorded).expect("an answer");
    let told = |warning: &String| warning.contains("clip_01.mcap: commands and measured joints do not overlap in time");
    assert!(found.warnings.iter().any(told), "{:?}", found.warnings);
    assert!(judge(&found, &truth).2 < 1e-2);
}

#[test]
fn clips_of_two_robots_are_told_from_those_of_one() {
    let cell = cell();
    let truths = [13, 14].map(|seed| hidden(&cell, seed));
    let told = |found: &Identification| found.warnings.iter().any(|warning| warning.contains("not of one robot"));
    let one = clips(&cell, &truths[0], 4, SECONDS, 13);
    let mut both = clips(&cell, &truths[1], 6, SECONDS, 14);
    both.splice(..3, one[..3].iter().cloned());
    assert!(told(&identify(&cell, both).expect("an answer")));
    assert!(!told(&identify(&cell, one).expect("an answer")));
}

#[test]
fn joints_that_come_late_as_a_whole_are_told_with_the_effect_to_search() {
    let cell = cell();
    let truth = hidden(&cell, 15);
    let mut recorded = clips(&cell, &truth, 3, SECONDS, 15);
    for clip in &mut recorded {
        clip.desired.stamps_ns.iter_mut().for_each(|stamp| *stamp -= 12_000_000);
    }
    let found = identify(&cell, recorded).expect("an answer");
    let told = |warning: &String| warning.contains("--also command_delay");
    assert!(found.warnings.iter().any(told), "{:?}", found.warnings);
}

#[test]
fn a_swarm_and_an_evolution_strategy_lower_the_loss_within_their_budget() {
    let cell = cell();
    let truth = hidden(&cell, 9);
    let recorded = clips(&cell, &truth, 2, 0.6, 9);
    for optimizer in [Optimizer::Swarm, Optimizer::Evolution] {
        let options = Options { optimizer, budget: 600, ..Options::default() };
        let found = identify_clips(&cell, recorded.clone(), &options, &Interrupt::default()).expect("an answer");
        let [(_, first), (_, last)] = [found.convergence[0], found.convergence[found.convergence.len() - 1]]
            .map(|[evaluations, loss]| (evaluations, loss));
        assert!(last < 0.6 * first, "{}: {first} {last}", optimizer.name());
    }
}

#[test]
fn an_interrupted_search_goes_on_to_the_same_answer() {
    let cell = cell();
    let truth = hidden(&cell, 10);
    let recorded = clips(&cell, &truth, 2, 0.6, 10);
    let folder = tempfile::tempdir().expect("a folder");
    let options = |name: &str| Options {
        optimizer: Optimizer::Evolution,
        budget: 120,
        out: Some(folder.path().join(name)),
        ..Options::default()
    };
    let whole =
        identify_clips(&cell, recorded.clone(), &options("whole.toml"), &Interrupt::default()).expect("an answer");
    let interrupt = Interrupt::default();
    let asks = interrupt.clone();
    let stopper = std::thread::spawn(move || {
        std::thread::sleep(std::time::Duration::from_millis(150));
        asks.ask();
    });
    let stopped = identify_clips(&cell, recorded.clone(), &options("theta.toml"), &interrupt);
    stopper.join().expect("a thread");
    if let Err(error) = &stopped {
        let error = error.to_string();
        assert!(error.contains("goes on from there") || error.contains("starts again"), "{error}");
    }
    let resumed = identify_clips(&cell, recorded, &options("theta.toml"), &Interrupt::default()).expect("an answer");
    assert_eq!(resumed.parameters, whole.parameters);
    assert!(!folder.path().join("theta.toml.state").exists());
}

#[test]
fn an_effect_that_is_searched_besides_is_found() {
    let cell = cell();
    let truth = hidden(&cell, 11);
    let mut recorded = clips(&cell, &truth, 2, SECONDS, 11);
    // The robot hears every command 7 ms late.
    for clip in &mut recorded {
        clip.desired.stamps_ns.iter_mut().for_each(|stamp| *stamp -= 7_000_000);
    }
    let options = Options { also: vec!["command_delay".into()], ..options() };
    let found = identify_clips(&cell, recorded, &options, &Interrupt::default()).expect("an answer");
    let delay = found.parameters["command_delay.delay"].value[0];
    assert!((delay - 0.007).abs() < 2e-4, "{delay}");
    assert!(judge(&found, &truth).2 < 1e-2);
    let wrong = Options { also: vec!["restitution".into()], ..options };
    let refused = identify_clips(&cell, Vec::new(), &wrong, &Interrupt::default()).expect_err("a refusal").to_string();
    assert!(refused.contains("--also restitution") && refused.contains("command_lag"), "{refused}");
}

#[test]
#[ignore = "takes minutes: cargo test --release -p calibration --test sessions identify_arm -- --ignored --nocapture"]
fn intervals_hold_the_truth_in_90_to_99_of_100_cases() {
    let cell = cell();
    let (mut all, mut inside, mut worst) = (0, 0, 0.0_f64);
    for seed in 100..150 {
        let truth = hidden(&cell, seed);
        let found = identify(&cell, clips(&cell, &truth, 8, 4.0, seed)).expect("an answer");
        let (gains, held, error) = judge(&found, &truth);
        (all, inside, worst) = (all + gains, inside + held, worst.max(error));
        eprintln!(
            "session {seed}: {held} of {gains}, so far {:.3}, worst error {worst:.5}",
            inside as f64 / all as f64
        );
    }
    let coverage = inside as f64 / all as f64;
    assert!((0.90..=0.99).contains(&coverage), "{coverage}");
}
