//! What a deviation of an arm's log does to its residuals: where, by how many sigmas, with which sign.

use super::arm::{ArmClips, is_tracking};
use super::random_effects::OwnNumbers;
use super::test_bench::{largest, residuals};
use super::test_servo::{DOF, START_NS, Swing, cell, clip, gains, with_effect};
use super::{Likelihood, Reach};
use crate::estimate::ClipModel as _;
use proptest::prelude::*;
use shared_mem::cell::Cell;
use shared_mem::recording::{Clip, JointSeries};
use shared_mem::theta::Theta;
use std::sync::LazyLock;

/// Gains of the recorded arm, which are not those of its cell.toml.
static TRUTH: LazyLock<Theta> = LazyLock::new(|| gains([33.0, 18.0], [2.6, 2.2]));
static CELL: LazyLock<Cell> = LazyLock::new(|| cell("joint_impedance"));
static QUIET: LazyLock<Clip> = LazyLock::new(|| clip(&CELL, &TRUTH, &Swing::default()));
static NOISY: LazyLock<Clip> =
    LazyLock::new(|| clip(&CELL, &TRUTH, &Swing { noise: 2e-5, seed: 3, ..Swing::default() }));

fn known(_: &[f64]) -> Theta {
    TRUTH.clone()
}

/// Gains, stiffness first.
fn searched(shared: &[f64]) -> Theta {
    gains([shared[0], shared[1]], [shared[2], shared[3]])
}

const AT_TRUTH: [f64; 4] = [33.0, 18.0, 2.6, 2.2];

type Arm = ArmClips<fn(&[f64]) -> Theta>;

fn means_of(clips: Vec<Clip>, theta: fn(&[f64]) -> Theta) -> Arm {
    let (arm, left_out) = ArmClips::means(&CELL, clips, theta).expect("an arm");
    assert!(left_out.is_empty(), "{left_out:?}");
    arm
}

fn means(clip: Clip) -> Arm {
    means_of(vec![clip], known)
}

fn moments(clip: Clip) -> Arm {
    ArmClips::moments(&CELL, &[clip], known as fn(&[f64]) -> Theta).expect("an arm")
}

/// Residuals in the unit of their channel.
fn errors(arm: &Arm) -> Vec<f64> {
    let rows = arm.rows(0).iter().zip(residuals(arm, 0, &[], &[]));
    rows.map(|(row, residual)| residual * arm.sigma()[row.channel]).collect()
}

/// The values of a series, by the name of their quantity.
fn logged<'a>(clip: &'a mut Clip, quantity: &str) -> &'a mut [f64] {
    match quantity {
        "q" => &mut clip.measured.q,
        "dq" => &mut clip.measured.dq,
        "tau_J" => &mut clip.measured.tau,
        _ => &mut clip.desired.tau,
    }
}

#[test]
fn what_the_twin_itself_logged_leaves_nothing_in_any_channel() {
    let arm = moments(QUIET.clone());
    let quantities: Vec<&str> = arm.channels().iter().map(|channel| channel.quantity).collect();
    assert_eq!(quantities, ["q", "q", "dq", "dq", "tau_J", "tau_J", "tau_J_d", "tau_J_d"]);
    assert!(largest(residuals(&arm, 0, &[], &[])) < 0.1, "{}", largest(residuals(&arm, 0, &[], &[])));
    assert!(largest(residuals(&means(QUIET.clone()), 0, &[], &[])) < 0.1);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn one_reading_that_is_off_is_off_by_so_many_sigmas_in_its_own_row_alone(
        joint in 0..DOF, row in 60_usize..990, off in prop_oneof![1e-3..0.05_f64, -0.05..-1e-3_f64],
    ) {
        let mut disturbed = NOISY.clone();
        disturbed.measured.q[row * DOF + joint] += off;
        let [before, after] = [NOISY.clone(), disturbed].map(means);
        // One outlier is no noise.
        prop_assert!((after.sigma()[joint] / before.sigma()[joint] - 1.0).abs() < 0.02);
        let root = f64::sqrt(5.0);
        for ((place, before), after) in before.rows(0).iter().zip(errors(&before)).zip(errors(&after)) {
            let here = place.channel == joint && (place.time - row as f64 * 1e-3).abs() < 2.6e-3;
            let expected = if here { off / root } else { 0.0 };
            prop_assert!((after - before - expected).abs() < 1e-9, "{place:?}: {before} {after}");
        }
    }

    #[test]
    fn every_quantity_that_is_off_shows_in_its_own_channel_measured_less_predicted(
        which in 0_usize..4, joint in 0..DOF, off in 0.01..0.1_f64, from in 200_usize..800,
    ) {
        let quantity = ["q", "dq", "tau_J", "tau_J_d"][which];
        let mut disturbed = QUIET.clone();
        logged(&mut disturbed, quantity).iter_mut().skip(from * DOF + joint).step_by(DOF).for_each(|value| *value += off);
        let [before, after] = [QUIET.clone(), disturbed].map(moments);
        for ((row, before), after) in before.rows(0).iter().zip(errors(&before)).zip(errors(&after)) {
            let channel = &moments_channels()[row.channel];
            let here = *channel == (quantity, joint) && row.time > from as f64 * 1e-3 - 1e-9;
            let expected = if here { off } else { 0.0 };
            prop_assert!((after - before - expected).abs() < 1e-9, "{channel:?} at {}: {before} {after}", row.time);
        }
    }

    #[test]
    fn stamps_may_begin_anywhere(later_ns in 0_u64..2_000_000_000_000_000_000) {
        let mut moved = NOISY.clone();
        for series in [&mut moved.measured, &mut moved.desired] {
            series.stamps_ns.iter_mut().for_each(|stamp| *stamp += later_ns);
        }
        for of in [means, moments] {
            let [here, there] = [NOISY.clone(), moved.clone()].map(of);
            prop_assert_eq!(residuals(&here, 0, &[], &[]), residuals(&there, 0, &[], &[]));
            prop_assert_eq!(here.rows(0), there.rows(0));
        }
    }

    /// Rows that were lost on the way, but for those that the start is read from.
    #[test]
    fn rows_that_were_lost_leave_what_is_predicted_for_the_others(lost in prop::collection::btree_set(40_usize..999, 1..200)) {
        let kept: Vec<usize> = (0..QUIET.measured.len()).filter(|row| !lost.contains(row)).collect();
        let thinned = Clip { measured: QUIET.measured.select_rows(&kept), ..QUIET.clone() };
        let [whole, thinned] = [QUIET.clone(), thinned].map(means);
        let [all, some] = [&whole, &thinned].map(|arm| arm.predict_in(1, (0, &[], &[])).expect("an answer"));
        for (place, row) in kept.iter().enumerate() {
            prop_assert_eq!(some[place].state, all[*row].state);
        }
        // Every row that is left counts once, in order.
        let counted: Vec<usize> = thinned.clip(0).averaged().flatten().copied().collect();
        prop_assert_eq!(counted, (0..kept.len()).collect::<Vec<_>>());
        prop_assert!(largest(residuals(&thinned, 0, &[], &[])) < 0.1);
    }
}

fn moments_channels() -> Vec<(&'static str, usize)> {
    ["q", "dq", "tau_J", "tau_J_d"].into_iter().flat_map(|quantity| [(quantity, 0), (quantity, 1)]).collect()
}

#[test]
fn joints_in_another_order_are_the_same_arm() {
    let swapped = |series: &JointSeries| {
        let swap = |values: &[f64]| values.chunks_exact(DOF).flat_map(|row| [row[1], row[0]]).collect();
        JointSeries { q: swap(&series.q), dq: swap(&series.dq), tau: swap(&series.tau), ..series.clone() }
    };
    let other = Clip {
        joint_names: vec!["b".into(), "a".into()],
        measured: swapped(&NOISY.measured),
        desired: swapped(&NOISY.desired),
        ..NOISY.clone()
    };
    assert_eq!(residuals(&means(NOISY.clone()), 0, &[], &[]), residuals(&means(other), 0, &[], &[]));
}

#[test]
fn means_and_moments_agree_on_an_error_that_stays() {
    let off = [4e-3, -7e-3];
    let mut clip = QUIET.clone();
    for row in 60..clip.measured.len() {
        (0..DOF).for_each(|joint| clip.measured.q[row * DOF + joint] += off[joint]);
    }
    let (means, moments) = (means(clip.clone()), moments(clip));
    for (arm, root) in [(&means, f64::sqrt(5.0)), (&moments, 1.0)] {
        let rows = arm.rows(0).iter().zip(errors(arm)).filter(|(row, _)| row.channel < DOF && row.time > 0.065);
        for (row, error) in rows {
            assert!((error * 1.0 / root - off[row.channel]).abs() < 2e-6, "{error} over {root}, {row:?}");
        }
    }
}

#[test]
fn residuals_grow_with_what_a_gain_is_off_by_and_have_the_sign_of_the_error() {
    let arm = means_of(vec![QUIET.clone()], searched);
    let square = |shared: &[f64]| residuals(&arm, 0, shared, &[]).iter().map(|r| r * r).sum::<f64>();
    for number in 0..AT_TRUTH.len() {
        for side in [-1.0, 1.0] {
            let off = [0.0, 0.02, 0.05, 0.1, 0.2].map(|share| {
                let mut shared = AT_TRUTH;
                shared[number] *= 1.0 + side * share;
                square(&shared)
            });
            assert!(off.is_sorted_by(|a, b| a < b), "number {number}, {side}: {off:?}");
        }
    }
    // A stiffer twin is nearer to its command; the measured joint lags behind it.
    let stiffer = residuals(&arm, 0, &[40.0, 18.0, 2.6, 2.2], &[]);
    let (mut with, mut against) = (0.0, 0.0);
    for (row, residual) in arm.rows(0).iter().zip(stiffer).filter(|(row, _)| row.channel == 0) {
        let at = (row.time * 1e3) as usize;
        let behind = QUIET.desired.q_row(at)[0] - QUIET.measured.q_row(at)[0];
        if behind * residual < 0.0 { with += residual.abs() } else { against += residual.abs() }
    }
    assert!(with > 3.0 * against, "{with} {against}");
}

#[test]
fn joints_without_gears_between_them_do_not_feel_each_others_gains() {
    let arm = means_of(vec![NOISY.clone()], searched);
    let [here, there] = [AT_TRUTH, [33.0, 25.0, 2.6, 3.0]].map(|shared| residuals(&arm, 0, &shared, &[]));
    for ((row, here), there) in arm.rows(0).iter().zip(&here).zip(&there) {
        assert!(row.channel == 1 || here == there, "{row:?}");
    }
    assert_ne!(here, there);
}

#[test]
fn the_state_in_which_a_clip_begins_and_the_age_of_its_encoders_are_its_own() {
    // 100 rows a second do not show how fast the arm began.
    let sparse: Vec<usize> = (0..QUIET.measured.len()).step_by(10).collect();
    let clip = Clip { measured: QUIET.measured.select_rows(&sparse), ..QUIET.clone() };
    let [coarse, fine] = [means(clip), means(QUIET.clone())].map(|arm| (arm.random(), arm));
    let names: Vec<&str> = coarse.0.iter().map(|random| random.name.as_str()).collect();
    assert_eq!(names, ["start q[0]", "start q[1]", "start dq[0]", "start dq[1]", "encoder age"]);
    assert!(coarse.0.iter().all(|random| random.sigma > 0.0 && random.step > 0.0));
    assert!(fine.0[..4].iter().all(|random| random.sigma == 0.0) && fine.0[4].sigma > 0.0);
    let own = |place: usize, value: f64| {
        let mut own = vec![0.0; names.len()];
        own[place] = value;
        residuals(&coarse.1, 0, &[], &own)
    };
    let rest = own(0, 0.0);
    // Further ahead at first than measured, and nothing of it is left where the joint has come to its command.
    let ahead = own(1, 1e-3);
    let sigma = coarse.1.sigma()[1];
    assert!(((ahead[1] - rest[1]) * sigma + 1e-3).abs() < 1e-9 && ahead[0] == rest[0]);
    let last = rest.len() - 1;
    assert!((ahead[last] - rest[last]).abs() * sigma < 2e-5, "{}", (ahead[last] - rest[last]) * sigma);
    // A joint that begins faster is ahead by its speed times the time.
    let faster = own(2, 0.05);
    let at_10_ms = (faster[DOF] - rest[DOF]) * coarse.1.sigma()[0];
    assert!((at_10_ms / (-0.05 * 0.01) - 1.0).abs() < 0.1, "{at_10_ms}");
}

/// A joint of inertia 0.4 under a law that reads the encoder so late, by its own equation of motion.
fn read_late(age: f64) -> Clip {
    let (inertia, stiffness, damping, step) = (0.4, 33.0, 2.6, 1e-3);
    let mut clip = clip(&CELL, &TRUTH, &Swing { speeds: [6.0, 0.0], rows: 1500, ..Swing::default() });
    let (mut q, mut dq) = (clip.desired.q[0], 0.0);
    for row in 0..clip.measured.len() {
        let seen = q - age * dq;
        (clip.measured.q[row * DOF], clip.measured.dq[row * DOF]) = (seen, dq);
        let [q_d, dq_d] = [clip.desired.q[row * DOF], clip.desired.dq[row * DOF]];
        let acceleration = (stiffness * (q_d - seen) + damping * (dq_d - dq)) / inertia;
        q += step * dq + 0.5 * step * step * acceleration;
        dq += step * acceleration;
    }
    clip
}

#[test]
fn encoders_that_are_read_late_are_explained_by_their_age_alone() {
    for age in [3e-5, -2e-5] {
        let arm = means(read_late(age));
        let own = |value: f64| residuals(&arm, 0, &[], &[0.0, 0.0, 0.0, 0.0, value]);
        let of_joint = |out: Vec<f64>| largest(out.into_iter().step_by(DOF)) * arm.sigma()[0];
        // The parameter bends where an age is beyond what is plausible.
        let value = 1e-4 * f64::atanh(age / 1e-4);
        let [without, with] = [0.0, value].map(|value| of_joint(own(value)));
        assert!(without > 5e-6 && with < 0.1 * without, "{age}: {without} and {with} rad");
        assert!(own(1.0) == own(2.0), "no encoder is later than a tenth of a period");
    }
}

#[test]
fn along_a_measured_motion_the_spring_pulls_what_the_model_takes_and_friction_is_what_is_left() {
    let servo = cell("joint_pd");
    let dragged = with_effect(&TRUTH, "joint_viscous_friction", &[("viscous", 0.8)]);
    for (hidden, viscous) in [(TRUTH.clone(), 0.0), (dragged, 0.8)] {
        let recorded = clip(&servo, &hidden, &Swing::default());
        let arm = ArmClips::moments(&servo, &[recorded], |_: &[f64]| hidden.clone()).expect("an arm");
        let along = arm.following(0);
        assert_eq!(along.len(), arm.rows(0).len() / arm.channels().len());
        let gains = TRUTH.arm.as_ref().expect("gains");
        for (moment, row) in along.iter().zip(arm.rows(0)).filter(|(_, row)| (0.15..0.85).contains(&row.time)) {
            for joint in 0..DOF {
                let dq = moment.state.dq[joint];
                let asked = gains.stiffness[joint] * moment.behind[joint] - gains.damping[joint] * dq;
                let left = asked - moment.load[joint] - viscous * dq;
                assert!(left.abs() < 0.06, "joint {joint} at {} s: {left} N m of {asked}", row.time);
            }
        }
    }
    let arm = moments(QUIET.clone());
    assert!(arm.following(0).is_empty(), "a damper that knows the desired velocity imitates no friction");
}

#[test]
fn peaks_are_the_largest_torques_that_were_asked_for() {
    let peaks = means(QUIET.clone()).peaks(&[]).expect("an answer");
    for (joint, peak) in peaks.iter().enumerate().take(DOF) {
        let asked = QUIET.desired.tau.iter().skip(joint).step_by(DOF).fold(0.0, |most: f64, tau| most.max(tau.abs()));
        assert!(asked > 0.1 && (peak / asked - 1.0).abs() < 1e-3, "joint {joint}: {peak} of {asked}");
    }
}

#[test]
fn half_steps_move_predictions_by_what_a_second_order_rule_leaves() {
    let arm = means_of(vec![QUIET.clone()], searched);
    let of = |parts| arm.residuals_in(parts, (0, &AT_TRUTH, &[])).expect("an answer");
    let [whole, halves, eighths] = [1, 2, 8].map(of);
    let off = |other: &[f64]| largest(other.iter().zip(&eighths).map(|(a, b)| a - b));
    // Rotors alone turn under a torque that holds for a period: any step is exact.
    assert!(off(&whole) < 1e-3 && off(&halves) < 1e-3, "{} {}", off(&whole), off(&halves));
    assert_eq!(arm.in_halves(0, &AT_TRUTH), Some(halves));
}

#[test]
fn what_cannot_be_simulated_is_no_residual_but_a_reason() {
    // Motors without a limit: else the joint shakes within it.
    let mut free = CELL.clone();
    free.controller.as_mut().expect("a controller").torque_limit.clear();
    let arm = ArmClips::means(&free, vec![QUIET.clone()], searched as fn(&[f64]) -> Theta).expect("an arm").0;
    let why = |shared: [f64; 4]| {
        let mut out = Vec::new();
        arm.residuals(0, &shared, &[], &mut out).expect_err("no answer").0
    };
    assert!(why([30.0, 20.0, 3000.0, 2.0]).contains("damping"), "{}", why([30.0, 20.0, 3000.0, 2.0]));
    assert!(!why([f64::NAN, 20.0, 3.0, 2.0]).is_empty());
    let mut lost = QUIET.clone();
    lost.measured.q[700 * DOF] = f64::NAN;
    let mut out = Vec::new();
    assert!(means(lost).residuals(0, &[], &[], &mut out).is_err(), "a reading that is no number");
}

#[test]
fn nothing_of_an_arm_alone_is_a_nuisance_parameter_of_a_diagnosis_and_all_of_it_is_simulated_anew() {
    fn kind<E: Likelihood>(_: &E) -> &'static str
    where
        E::Own: OwnNumbers,
    {
        std::any::type_name::<E::Own>()
    }
    let arm = moments(NOISY.clone());
    assert!(arm.scatter().count() == 0 && !arm.has_object() && arm.own_slope(0, 0).is_none());
    assert!(kind(&arm).ends_with("WithOwn") && arm.torque_sigma().is_none() && !is_tracking(&CELL));
    let base = vec![7.0; arm.rows(0).len()];
    for reach in [Reach::All, Reach::Arm, Reach::Object] {
        let mut out = Vec::new();
        arm.changed(0, (&[], &[]), (reach, &base, None), &mut out).expect("an answer");
        assert_eq!(out, residuals(&arm, 0, &[], &[]), "{reach:?}");
    }
    assert_eq!(START_NS, NOISY.measured.stamps_ns[0]);
}

#[test]
fn witnesses_of_a_clip_are_whole_bins_and_hold_every_row() {
    let arm = means(clip(&CELL, &TRUTH, &Swing { rows: 2100, ..Swing::default() }));
    let ends = arm.stretches(0);
    assert_eq!((ends.len(), ends.last().copied()), (3, Some(arm.rows(0).len())));
    assert!(ends.is_sorted() && ends.iter().all(|end| end % DOF == 0), "{ends:?}");
    assert!(means(QUIET.clone()).stretches(0).len() == 1, "a second is one");
}
