//! Pushes with known friction, through noise: what is found, how sure, and what is said to be open.

use super::alone::{self, Alone};
use super::fit::{Found, held_out};
use super::model::Motion;
use super::noise::Noise;
use super::positions::Positions;
use super::together::cut_to_agree;
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_distr::StandardNormal;
use twin::arm::{MassProperties, UrdfJoint};
use twin::world::LoneJoint;

const RATE: f64 = 60.0;

/// A joint along or about y, its part's centre of mass 0.1 m from it.
pub(super) fn joint(slides: bool, friction: f64, damping: f64) -> LoneJoint {
    let limits = [-3.0, 3.0];
    let axis = Vector3::y_axis();
    let joint =
        UrdfJoint { name: "j".into(), parent: 0, at: Isometry3::identity(), slides, axis, limits, friction, damping };
    let part = MassProperties::new(0.5, [0.0, 0.0, -0.1], [2e-3, 2e-3, 2e-3, 0.0, 0.0, 0.0]);
    LoneJoint::new(&joint, &part, &UnitQuaternion::identity())
}

/// Rests, is pushed up to a speed within a quarter of a second, is let go, and rests. A stop at `stop` holds it.
pub(super) fn pushed(joint: &LoneJoint, speed: f64, sigma: f64, stop: f64, seed: u64) -> Positions {
    let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
    let (mut times, mut positions) = (Vec::new(), Vec::new());
    let (mut position, mut velocity) = (0.0, 0.0);
    for row in 0..240 {
        let time = f64::from(row) / RATE;
        if (0.5..0.75).contains(&time) {
            velocity = speed * (time - 0.5) / 0.25;
            position += velocity / RATE;
        } else if time >= 0.75 {
            (position, velocity) = joint.after((position, velocity), 1.0 / RATE);
        }
        if position >= stop {
            (position, velocity) = (stop, 0.0);
        }
        let noise: f64 = random.sample(StandardNormal);
        times.push(time);
        positions.push(position + sigma * noise);
    }
    Positions { times, positions, carrier: UnitQuaternion::identity() }
}

pub(super) fn motions(clips: &[Positions], joint: &LoneJoint) -> (Vec<Motion>, Noise) {
    let noise = Noise::of(clips.iter().map(|clip| clip.positions.as_slice()));
    let mut all: Vec<Alone> = clips.iter().flat_map(|clip| alone::motions(clip, joint, &noise)).collect();
    cut_to_agree(&mut all, &noise);
    (all.into_iter().map(|alone| alone.motion).collect(), noise)
}

/// Three pushes of different strength.
pub(super) fn three(joint: &LoneJoint, sigma: f64, seed: u64) -> Vec<Positions> {
    [1.5, 2.5, 3.5]
        .iter()
        .enumerate()
        .map(|(k, speed)| pushed(joint, *speed, sigma, 9.0, 10 * seed + k as u64))
        .collect()
}

#[test]
fn friction_and_damping_of_hinge_and_slide_are_found_and_their_intervals_hold_the_truth() {
    let mut held = [0_usize; 2];
    let (mut all, mut within, mut predicted) = (0, 0, 0);
    for (slides, friction, damping) in [(false, 0.03, 0.01), (true, 1.0, 0.8), (false, 0.1, 0.004), (true, 0.4, 1.5)] {
        for seed in 0..6 {
            let truth = joint(slides, friction, damping);
            let (motions, noise) = motions(&three(&truth, 0.003, seed), &truth);
            assert_eq!(motions.len(), 3, "{slides} {friction} {damping} {seed}");
            let found = Found::of(&motions, &noise).expect("a fit");
            all += 1;
            for (k, truth) in [friction, damping].into_iter().enumerate() {
                let [low, high] = found.interval(k);
                held[k] += usize::from((low..=high).contains(&truth));
            }
            // The torque at the mean speed, which the motions tell best.
            let slows = |[dry, viscous]: [f64; 2]| dry + 1.2 * viscous;
            within += u32::from((slows(found.numbers()) / slows([friction, damping]) - 1.0).abs() < 0.1);
            let others = held_out(&motions).expect("three motions");
            predicted += u32::from(others.iter().all(|fit| fit.chi2 < 4.0 * fit.rows as f64));
        }
    }
    assert!(held.iter().all(|held| *held as f64 >= 0.9 * f64::from(all)), "{held:?} of {all}");
    assert!(f64::from(within) >= 0.95 * f64::from(all), "{within} of {all}");
    // Two motions predict a third one that is faster or slower than both.
    assert!(f64::from(predicted) >= 0.75 * f64::from(all), "{predicted} of {all}");
}

#[test]
fn a_part_that_runs_into_a_stop_is_taken_up_to_there() {
    let truth = joint(false, 0.03, 0.01);
    let clips: Vec<Positions> =
        [2.0, 3.0, 4.0].iter().enumerate().map(|(k, speed)| pushed(&truth, *speed, 0.003, 0.75, k as u64)).collect();
    let (motions, noise) = motions(&clips, &truth);
    // It swings back from the stop by itself, too.
    assert!(motions.len() >= 3);
    let found = Found::of(&motions, &noise).expect("a fit");
    let slows = |[dry, viscous]: [f64; 2]| dry + 2.5 * viscous;
    let ratio = slows(found.numbers()) / slows([0.03, 0.01]);
    assert!((ratio - 1.0).abs() < 0.25, "{:?} {ratio}", found.numbers());
}

#[test]
fn two_numbers_that_look_alike_are_said_to_be_open_and_their_sum_is_known() {
    let truth = joint(true, 0.6, 0.6);
    // One short push through much noise.
    let (motions, noise) = motions(&[pushed(&truth, 1.0, 0.008, 9.0, 1)], &truth);
    assert_eq!(motions.len(), 1);
    let found = Found::of(&motions, &noise).expect("a fit");
    let open = [0, 1].map(|k| found.open(k).is_some_and(|why| why.contains("not which of the two")));
    assert!(open == [true; 2] && found.tells_sum(), "{:?} {:?}", found.numbers(), found.half);
    assert!(held_out(&motions).is_none());
}

#[test]
fn what_friction_holds_at_rest_is_known_without_any_motion() {
    let truth = joint(false, 0.4, 0.01);
    let mut clip = pushed(&truth, 0.0, 0.002, 9.0, 3);
    clip.positions.iter_mut().for_each(|position| *position += 0.6);
    let noise = Noise::of(std::iter::once(clip.positions.as_slice()));
    assert!(alone::motions(&clip, &truth, &noise).is_empty());
    let rests = alone::rests(&clip, &noise);
    assert!((rests[0] - 0.6).abs() < 1e-3 && rests.len() == 1, "{rests:?}");
    assert!((truth.load(rests[0]).abs() - 0.5 * 9.81 * 0.1 * 0.6_f64.sin()).abs() < 2e-3);
}
