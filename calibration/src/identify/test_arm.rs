//! Identification of a servo arm whose gains are known: what is found, how sure that is, and what is said where clips cannot tell.

use super::test_servo::{DOF, Swing, cell, clip, gains, with_effect};
use super::{Identification, Optimizer, Options, arm};
use crate::answer::identification::Parameter;
use inference::interrupt::Interrupt;
use proptest::prelude::*;
use shared_mem::cell::Cell;
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use std::sync::LazyLock;

/// One sigma of the encoders [rad].
const NOISE: f64 = 2e-5;
static CELL: LazyLock<Cell> = LazyLock::new(|| cell("joint_impedance"));
static TRUTH: LazyLock<Theta> = LazyLock::new(|| gains([33.0, 18.0], [2.6, 2.2]));
/// Three motions, each of its own command.
static SESSION: LazyLock<Vec<Clip>> = LazyLock::new(|| session(&TRUTH, 7, 3));
static FOUND: LazyLock<Identification> = LazyLock::new(|| identify(SESSION.clone()));

/// A swing of the seed, through noise, integrated finer than the twin does.
fn swing(seed: u64) -> Swing {
    let faster = 1.0 + 0.1 * (seed % 7) as f64;
    Swing { speeds: [4.0 * faster, 6.1 * faster], rows: 1400, noise: NOISE, seed, parts: 3 }
}

fn session(truth: &Theta, seed: u64, count: u64) -> Vec<Clip> {
    (0..count).map(|number| clip(&CELL, truth, &swing(100 * seed + number))).collect()
}

/// Clips of one command, of which none can be held out, each with noise of its own.
fn repeats(count: u64) -> Vec<Clip> {
    (0..count).map(|seed| clip(&CELL, &TRUTH, &swing(7 * seed))).collect()
}

fn identify_with(clips: Vec<Clip>, options: &Options) -> Identification {
    arm::identify_clips(&CELL, clips, options, &Interrupt::default()).expect("an answer")
}

fn identify(clips: Vec<Clip>) -> Identification {
    identify_with(clips, &Options::default())
}

/// Stiffness of every joint, then damping: value, and half of its interval.
fn found_gains(found: &Identification) -> Vec<[f64; 2]> {
    let of = |Parameter { value, ci95, .. }: &Parameter| -> Vec<[f64; 2]> {
        value.iter().zip(ci95).map(|(value, [low, high])| [*value, 0.5 * (high - low)]).collect()
    };
    ["stiffness", "damping"].iter().flat_map(|name| of(&found.parameters[*name])).collect()
}

fn true_gains(truth: &Theta) -> Vec<f64> {
    let arm = truth.arm.as_ref().expect("gains");
    arm.stiffness.iter().chain(&arm.damping).copied().collect()
}

fn why(found: &Identification, parameter: &str) -> String {
    let open = found.not_identifiable.iter().find(|open| open.parameter == parameter);
    open.map_or_else(String::new, |open| open.why.clone())
}

fn says(found: &Identification, what: &str) -> bool {
    found.warnings.iter().any(|warning| warning.contains(what))
}

/// Of so many that each come true with a chance, the number below which fewer than one in a thousand draws falls.
fn least_of(count: u32, chance: f64) -> u32 {
    let (mut below, mut density) = (0.0, (1.0 - chance).powi(count as i32));
    for k in 0..count {
        below += density;
        if below > 1e-3 {
            return k;
        }
        density *= chance / (1.0 - chance) * f64::from(count - k) / f64::from(k + 1);
    }
    count
}

#[test]
fn gains_are_found_to_a_hundredth_and_what_is_left_is_the_encoders_noise() {
    for (found, truth) in found_gains(&FOUND).into_iter().zip(true_gains(&TRUTH)) {
        assert!((found[0] / truth - 1.0).abs() < 0.01 && found[1] < 0.02 * truth, "{found:?} of {truth}");
    }
    assert!(
        FOUND.converged && FOUND.at_bounds.is_empty() && FOUND.target == "arm" && FOUND.optimizer == "least-squares"
    );
    assert_eq!((FOUND.clips.train.len(), FOUND.clips.holdout.len(), FOUND.clips.left_out.len()), (2, 1, 0));
    assert!(FOUND.misfit < 1.2, "{}", FOUND.misfit);
    for (after, before) in [(FOUND.gap.train, FOUND.gap.train_before), (FOUND.gap.holdout, FOUND.gap.holdout_before)] {
        let [after, before] = [after, before].map(|figures| figures.joint_rms_rad.expect("a figure"));
        assert!((0.9..1.2).contains(&(after / NOISE)) && before > 50.0 * after, "{after} {before}");
    }
}

#[test]
fn intervals_hold_the_truth_as_often_as_they_say() {
    let (mut all, mut inside) = (0, 0);
    for seed in 0..8_u8 {
        let turned = |k: u8| 1.0 + 0.15 * f64::from((seed * 5 + k * 3) % 7).mul_add(2.0 / 6.0, -1.0);
        let truth = gains([30.0 * turned(0), 20.0 * turned(1)], [3.0 * turned(2), 2.0 * turned(3)]);
        let found = identify(session(&truth, 20 + u64::from(seed), 3));
        for ([value, half], truth) in found_gains(&found).into_iter().zip(true_gains(&truth)) {
            all += 1;
            inside += u32::from((value - truth).abs() <= half);
        }
    }
    assert!(all == 32 && inside >= least_of(all, 0.95), "{inside} of {all}, at least {}", least_of(all, 0.95));
}

#[test]
fn the_bound_of_a_count_is_that_of_the_binomial_distribution() {
    assert_eq!((least_of(10, 0.95), least_of(100, 0.5), least_of(1, 0.95)), (6, 35, 0));
}

#[test]
fn neither_the_order_of_clips_nor_the_time_at_which_they_were_recorded_counts() {
    let clips = repeats(3);
    let mut turned = clips.clone();
    turned.rotate_left(1);
    let mut later = clips.clone();
    for series in later.iter_mut().flat_map(|clip| [&mut clip.measured, &mut clip.desired]) {
        series.stamps_ns.iter_mut().for_each(|stamp| *stamp += 1_700_000_000_000_000_000);
    }
    let [here, turned, later] = [clips, turned, later].map(identify);
    assert!(here.clips.holdout.is_empty() && says(&here, "a single motion"));
    assert_eq!(here.parameters, later.parameters);
    for (here, turned) in found_gains(&here).into_iter().zip(found_gains(&turned)) {
        assert!((here[0] - turned[0]).abs() < 0.02 * here[1], "{here:?} {turned:?}");
        assert!((here[1] / turned[1] - 1.0).abs() < 0.02, "{here:?} {turned:?}");
    }
}

#[test]
fn clips_that_are_there_twice_change_no_value_and_narrow_the_intervals_as_twice_as_many_do() {
    let clips = repeats(2);
    let [once, twice] = [clips.clone(), [clips.clone(), clips].concat()].map(identify);
    for (once, twice) in found_gains(&once).into_iter().zip(found_gains(&twice)) {
        assert!((once[0] - twice[0]).abs() < 0.05 * once[1], "{once:?} {twice:?}");
        // By the root of two, and by the tails of Student's distribution of few witnesses.
        assert!((0.3..0.78).contains(&(twice[1] / once[1])), "{once:?} {twice:?}");
    }
    assert_eq!(2 * once.witnesses, twice.witnesses);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2))]

    /// The joint's number is a name alone.
    #[test]
    fn joints_that_change_places_take_their_gains_along(stiffness in 26.0..36.0_f64, damping in 2.4..3.4_f64) {
        let truth = gains([stiffness, 18.0], [damping, 2.2]);
        let clips = session(&truth, 5, 2);
        let swapped = |values: &[f64]| values.chunks_exact(DOF).flat_map(|row| [row[1], row[0]]).collect::<Vec<f64>>();
        let other = clips.iter().cloned().map(|mut clip| {
            clip.joint_names.swap(0, 1);
            for series in [&mut clip.measured, &mut clip.desired] {
                let [q, dq, tau] = [&series.q, &series.dq, &series.tau].map(|values| swapped(values));
                (series.q, series.dq, series.tau) = (q, dq, tau);
            }
            clip
        });
        let [here, there] = [clips.clone(), other.collect()].map(identify);
        prop_assert_eq!(&here.parameters, &there.parameters);
        prop_assert!((here.parameters["stiffness"].value[0] / stiffness - 1.0).abs() < 0.01);
    }
}

#[test]
fn a_joint_that_is_not_moved_is_open_and_the_other_is_found() {
    let only = |joint: usize| {
        let clips = (0..2).map(|seed| {
            let Swing { speeds, .. } = swing(seed);
            let moved = std::array::from_fn(|k| if k == joint { speeds[k] } else { 0.0 });
            clip(&CELL, &TRUTH, &Swing { speeds: moved, ..swing(seed) })
        });
        identify(clips.collect())
    };
    for joint in 0..DOF {
        let (found, rests) = (only(joint), 1 - joint);
        for name in ["stiffness", "damping"] {
            assert!(
                !why(&found, &format!("{name}[{rests}]")).is_empty(),
                "{name} of {rests}: {:?}",
                found.not_identifiable
            );
        }
        let [value, half] = found_gains(&found)[joint];
        assert!((value - true_gains(&TRUTH)[joint]).abs() < 3.0 * half);
    }
}

#[test]
fn clips_without_any_motion_leave_every_gain_open() {
    let still = |seed| clip(&CELL, &TRUTH, &Swing { speeds: [0.0; DOF], ..swing(seed) });
    let found = identify((0..2).map(still).collect());
    for gain in ["stiffness[0]", "stiffness[1]", "damping[0]", "damping[1]"] {
        assert!(!why(&found, gain).is_empty(), "{gain}: {:?}", found.not_identifiable);
    }
    assert!(says(&found, "a single motion"), "{:?}", found.warnings);
}

#[test]
fn a_gain_beyond_its_search_rests_on_the_bound_and_is_open() {
    let found = identify(session(&gains([75.0, 18.0], [3.0, 2.0]), 3, 2));
    assert!(found.at_bounds.contains(&"stiffness[0]".to_owned()), "{:?}", found.at_bounds);
    assert!((found.parameters["stiffness"].value[0] - 60.0).abs() < 1e-6);
    let said = why(&found, "stiffness[0]");
    assert!(said.contains("upper bound") && said.contains("`stiffness_range`"), "{said}");
    assert_eq!(found.parameters["stiffness"].ci95[0], [f64::NEG_INFINITY, f64::INFINITY]);
    assert!(says(&found, "calibration diagnose"), "{:?}", found.warnings);
}

#[test]
fn weight_of_links_whose_masses_nobody_knows_is_found_with_the_gains() {
    let pulled = with_effect(&TRUTH, "joint_weight", &[("constant", 0.0), ("sine", 1.5), ("cosine", 0.0)]);
    let found = identify(session(&pulled, 11, 3));
    let part = |name: &str| &found.parameters[&format!("joint_weight.{name}")];
    assert_eq!((part("sine").unit.as_str(), part("sine").value.len(), part("constant").value.len()), ("N m", DOF, DOF));
    // Over a small swing a constant and a sine are nearly one: what counts is the torque where it swings.
    let (sine, cosine) = 0.46_f64.sin_cos();
    for joint in 0..DOF {
        let of = |name| part(name).value[joint];
        let pull = of("constant") + of("sine") * sine + of("cosine") * cosine;
        assert!((pull - 1.5 * sine).abs() < 0.02, "joint {joint}: {pull}");
    }
    let [value, half] = found_gains(&found)[0];
    assert!((value / 33.0 - 1.0).abs() < 0.05 && half > found_gains(&FOUND)[0][1] * 0.5, "{value} {half}");
}

#[test]
fn a_delay_that_is_searched_besides_is_found_and_one_that_is_not_is_said() {
    let late = with_effect(&TRUTH, "command_delay", &[("delay", 0.011)]);
    let clips = session(&late, 2, 3);
    let options = Options { also: vec!["command_delay".into()], ..Options::default() };
    let found = identify_with(clips.clone(), &options);
    let delay = &found.parameters["command_delay.delay"];
    assert!((delay.value[0] - 0.011).abs() < 2e-4 && delay.unit == "s", "{delay:?}");
    assert!(found.names.contains(&"command_delay.delay".to_owned()) && !says(&found, "--also"));
    let without = identify(clips);
    assert!(says(&without, "--also command_delay") && without.misfit > 3.0, "{:?}", without.warnings);
    let none = identify_with(SESSION.clone(), &options);
    assert!(none.parameters["command_delay.delay"].value[0] < 3e-4, "{:?}", none.parameters["command_delay.delay"]);
}

#[test]
fn commands_that_are_stamped_too_late_are_said_to_be_of_another_clock() {
    let mut clips = SESSION.clone();
    for clip in &mut clips {
        clip.desired.stamps_ns.iter_mut().for_each(|stamp| *stamp += 15_000_000);
    }
    let found = identify(clips);
    assert!(says(&found, "not stamped by one clock"), "{:?}", found.warnings);
}

#[test]
fn clips_of_two_robots_are_no_session_of_one() {
    let mixed = [session(&TRUTH, 1, 2), session(&gains([22.0, 25.0], [3.6, 1.6]), 2, 2)].concat();
    assert!(says(&identify(mixed), "not of one robot"));
    assert!(!says(&FOUND, "not of one robot") && !says(&FOUND, "something else acts"), "{:?}", FOUND.warnings);
}

#[test]
fn a_clip_unlike_the_others_is_named_with_how_far_it_is_off() {
    let mut clips = session(&TRUTH, 9, 6);
    // Somebody leans on the second joint for a while.
    clips[2].measured.q.iter_mut().skip(400 * DOF + 1).step_by(DOF).take(200).for_each(|q| *q += 4e-3);
    let file = clips[2].file.display().to_string();
    let found = identify(clips);
    let odd: Vec<&String> = found.warnings.iter().filter(|warning| warning.contains("times the usual one")).collect();
    assert!(odd.len() == 1 && odd[0].starts_with(&file), "{:?}", found.warnings);
}

#[test]
fn figures_of_clips_add_up_to_those_of_their_uses_and_pictures_show_the_worst_joint() {
    let of = |used: &str| -> Vec<_> { FOUND.by_clip.iter().filter(|clip| clip.used == used).collect() };
    for (used, files, gap) in
        [("fitted", &FOUND.clips.train, FOUND.gap.train), ("held out", &FOUND.clips.holdout, FOUND.gap.holdout)]
    {
        let clips = of(used);
        assert_eq!(&clips.iter().map(|clip| clip.file.clone()).collect::<Vec<_>>(), files);
        let square = |rms: f64| rms * rms;
        let mean = clips.iter().map(|clip| square(clip.after.joint_rms_rad.expect("a figure"))).sum::<f64>()
            / clips.len() as f64;
        assert!((mean.sqrt() / gap.joint_rms_rad.expect("a figure") - 1.0).abs() < 1e-9);
        for clip in clips {
            let of_joints = clip.joint_rms_rad.iter().map(|rms| square(*rms)).sum::<f64>() / DOF as f64;
            assert!((of_joints.sqrt() / clip.after.joint_rms_rad.expect("a figure") - 1.0).abs() < 1e-9);
            // The norm of a row's errors over both joints, mean over rows, is at most its root mean square.
            assert!(
                clip.after.joint_norm_rad.expect("a figure") <= (DOF as f64).sqrt() * of_joints.sqrt() * (1.0 + 1e-9)
            );
        }
    }
    assert_eq!(FOUND.traces.len(), FOUND.by_clip.len());
    for (trace, clip) in FOUND.traces.iter().zip(&FOUND.by_clip) {
        let worst = if clip.joint_rms_rad[0] > clip.joint_rms_rad[1] { 1 } else { 2 };
        assert_eq!((trace.clip.as_str(), trace.channel.as_str()), (clip.file.as_str(), &*format!("joint {worst}")));
        assert!(trace.after.len() <= 400 && trace.after.len() == trace.before.len() && trace.unit == "rad");
        assert!(trace.after.is_sorted_by(|a, b| a[0] < b[0]));
    }
}

#[test]
fn advice_names_the_number_that_is_least_known_and_what_would_sharpen_it_most_comes_first() {
    let narrower = |advice: &crate::answer::identification::Advice| advice.predicted < advice.now;
    assert!(
        !FOUND.advice.is_empty() && FOUND.advice.len() <= 3 && FOUND.advice.iter().all(narrower),
        "{:?}",
        FOUND.advice
    );
    assert!(FOUND.advice.is_sorted_by(|a, b| a.predicted <= b.predicted));
    assert!(FOUND.advice[0].record.ends_with("twice as large"), "{:?}", FOUND.advice[0]);
    assert!(FOUND.names.contains(&FOUND.advice[0].parameter));
    // Correlations are those of estimates: one with itself, alike both ways.
    for (i, row) in FOUND.correlation.iter().enumerate() {
        for (j, r) in row.iter().enumerate() {
            assert!((r - FOUND.correlation[j][i]).abs() < 1e-9 && r.abs() <= 1.0 + 1e-9, "{i} {j}: {r}");
        }
        assert!((row[i] - 1.0).abs() < 1e-9 || row[i] == 0.0);
    }
}

#[test]
fn searches_without_slopes_lower_the_loss_and_draw_the_same_from_the_same_seed() {
    for optimizer in [Optimizer::Swarm, Optimizer::Evolution] {
        let of = |seed: u64| identify_with(repeats(1), &Options { optimizer, budget: 150, seed, ..Options::default() });
        let (first, again) = (of(1), of(1));
        assert_eq!((&first.parameters, &first.convergence), (&again.parameters, &again.convergence));
        assert!(first.convergence.is_sorted_by(|a, b| a[0] < b[0] && a[1] >= b[1]), "{:?}", first.convergence);
        assert!(first.evaluations > 100 && first.optimizer == optimizer.name());
    }
}

#[test]
fn parameters_go_to_their_file_with_what_was_known_and_nothing_else_is_left_there() {
    let folder = tempfile::tempdir().expect("a folder");
    let [known, out] = ["known.toml", "theta.toml"].map(|name| folder.path().join(name));
    let friction = with_effect(&Theta::default(), "joint_viscous_friction", &[("viscous", 0.3)]);
    Theta { object: Some(shared_mem::theta::ObjectTheta { friction: Some(0.2), ..Default::default() }), ..friction }
        .write(&known)
        .expect("room");
    let dragged = with_effect(&TRUTH, "joint_viscous_friction", &[("viscous", 0.3)]);
    let options = Options { out: Some(out.clone()), parameters: Some(known), ..Options::default() };
    let found = identify_with(session(&dragged, 4, 2), &options);
    assert_eq!(found.theta_file.as_deref(), Some(out.as_path()));
    let written = Theta::read(&out).expect("a theta.toml");
    let arm = written.arm.expect("gains");
    assert_eq!(
        (&arm.stiffness, &arm.damping),
        (&found.parameters["stiffness"].value, &found.parameters["damping"].value)
    );
    assert_eq!(written.object.and_then(|object| object.friction), Some(0.2));
    assert!(written.effects.iter().any(|effect| effect.name == "joint_viscous_friction"));
    // What acts was known: gains are those of the law.
    assert!((arm.damping[0] / 2.6 - 1.0).abs() < 0.02, "{arm:?}");
    let left: Vec<_> =
        std::fs::read_dir(folder.path()).expect("a folder").map(|entry| entry.expect("a file").file_name()).collect();
    assert_eq!(left.len(), 2, "{left:?}");
}
