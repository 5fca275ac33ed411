//! What the robot keeps an eye on beyond judging set points: what it measures, while it moves and while it does not. Pure.

use super::body::Body;
use super::faults::{Fault, all};
use super::generator::Surroundings;
use super::generator::rules::{END_EFFECTOR_SPEED, JointRules, exceeds, highest_speed};
use super::motion::Motion;
use super::settings::Settings;
use crate::arm::ReflexErrors;
use crate::safety::JointLimits;
use twin::arm::pose_difference;

/// How far over its limit a speed may be measured before the robot stops: a controller follows with some error.
const MARGIN: f64 = 1.05;
/// Commanded acceleration above which the thresholds of accelerating hold [rad/s²].
const ACCELERATES: f64 = 0.01;

/// Objections to what happens while `motion` runs; empty where there are none. Updates contact and collision flags.
pub(super) fn objections(body: &mut Body, motion: &Motion, rules: &JointRules, settings: &Settings) -> ReflexErrors {
    let mut faults = touches(body, Some(motion), settings);
    if body.threatens_itself() {
        faults.push(Fault::SelfCollision);
    }
    let (measured, limits) = (&body.measured, &rules.limits);
    faults.extend(excesses(body, rules, settings, true));
    if motion.torque().is_some_and(|tau| {
        let gravity = body.model().gravity(&measured.q);
        limits.counted().enumerate().any(|(i, limits)| exceeds((tau[i] + gravity[i]).abs(), limits.torque))
    }) {
        faults.push(Fault::TorqueRange);
    }
    if deviates(body, motion, &motion.request.path_deviation, rules, settings) {
        faults.push(Fault::PathPoseDeviation);
    }
    all(&faults)
}

/// Objections to what an arm does that no client commands: its own controller is to hold it, within its torques. `in_range`:
/// it has to be inside its range as well.
pub(super) fn runs_away(body: &Body, rules: &JointRules, settings: &Settings, in_range: bool) -> ReflexErrors {
    let mut faults = excesses(body, rules, settings, in_range);
    let gravity = body.model().gravity(&body.measured.q);
    let too_much =
        |(i, limits): (usize, &JointLimits)| exceeds((body.measured.tau_J_d[i] + gravity[i]).abs(), limits.torque);
    if rules.limits.counted().enumerate().any(too_much) {
        faults.push(Fault::TorqueRange);
    }
    all(&faults)
}

/// What is out of bounds: the range of the joints, their speed, the speed of the end effector.
fn excesses(body: &Body, rules: &JointRules, settings: &Settings, in_range: bool) -> Vec<Fault> {
    let (measured, limits, mut faults) = (&body.measured, &rules.limits, Vec::new());
    if in_range && is_outside(body, rules) {
        faults.push(Fault::JointPositionLimits);
    }
    let too_fast = |(i, limits): (usize, &JointLimits)| {
        let highest = highest_speed(limits, measured.q[i], measured.dq[i]).max(MARGIN - 1.0);
        exceeds(measured.dq[i].abs(), MARGIN * highest)
    };
    if limits.counted().enumerate().any(too_fast) {
        faults.push(Fault::JointVelocity);
    }
    let ee = Surroundings::new(body.model(), rules, settings).ee;
    if exceeds(ee.twist(&body.joints()).fixed_rows::<3>(0).norm(), MARGIN * END_EFFECTOR_SPEED) {
        faults.push(Fault::CartesianVelocity);
    }
    faults
}

/// Looks for contact and, while `motion` runs, for collision.
pub(super) fn touches(body: &mut Body, motion: Option<&Motion>, settings: &Settings) -> Vec<Fault> {
    let accelerates =
        motion.and_then(|m| m.generator.joints()).is_some_and(|trace| trace.a.iter().any(|a| a.abs() > ACCELERATES));
    let thresholds = if accelerates { &settings.accelerating } else { &settings.nominal };
    let (tau_ext, wrench) = (*body.tau_ext(), body.wrench[1]);
    let [joint, cartesian] = body.touched.update(&tau_ext, &wrench, thresholds, motion.is_some());
    let reflexes = [(joint, Fault::JointReflex), (cartesian, Fault::CartesianReflex)];
    reflexes.into_iter().filter(|(struck, _)| *struck && motion.is_some()).map(|(_, fault)| fault).collect()
}

/// Whether a joint is beyond its limits.
pub(super) fn is_outside(body: &Body, rules: &JointRules) -> bool {
    let within = |(limits, q): (&JointLimits, &f64)| (limits.q_min..=limits.q_max).contains(q);
    !rules.limits.counted().zip(&body.measured.q).all(within)
}

/// Whether the arm is farther from where it should be than the client allows: translation [m], rotation [rad], elbow [rad].
pub(super) fn deviates(
    body: &Body,
    motion: &Motion,
    allowed: &[f64; 3],
    rules: &JointRules,
    settings: &Settings,
) -> bool {
    let Some(desired) = motion.generator.joints() else { return false };
    let ee = Surroundings::new(body.model(), rules, settings).ee;
    let miss = pose_difference(&ee.pose(&body.measured.q), &ee.pose(&desired.q));
    let elbow = (body.measured.q[2] - desired.q[2]).abs();
    let found = [miss.fixed_rows::<3>(0).norm(), miss.fixed_rows::<3>(3).norm(), elbow];
    found.iter().zip(allowed).any(|(found, allowed)| found > allowed)
}
