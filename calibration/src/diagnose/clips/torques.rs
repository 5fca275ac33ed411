//! Measured torques against the model along the measured motion, whatever controller led the arm: for logs without commands, and
//! where the control law is not known.
//!
//! The arm of the twin is moved along what was measured, smoothed, by whatever torque that takes
//! ([`ControllerKind::Tracking`]), and this torque is held against the measured one. Effects on the way of a command do not show;
//! friction, payloads, base tilts and the like do, gains and delays or not.

use nalgebra::{Matrix4, Vector4};
use shared_mem::cell::{Cell, Controller, ControllerKind};
use shared_mem::recording::{Clip, JointSeries};
use shared_mem::theta::Theta;
use shared_mem::time::TICK_NS;

/// Half the time over which motion is smoothed [ns], rows counting less the farther away they are: as a cubic over 80 ms alone
/// would, that passes 10 Hz, and no arm is driven faster.
const HALF_NS: u64 = 80_000_000;
/// The same where stamps are uneven: what arrives a millisecond late at 1 rad/s is 1 mrad off, hundreds of times the encoder's
/// noise.
const UNEVEN_HALF_NS: u64 = 160_000_000;
/// Stamps are uneven where more than this share of the steps differs from the usual one by more than a quarter of it.
const UNEVEN: f64 = 0.02;
/// Slow logs are smoothed over at least so many rows to either side: a cubic has four coefficients.
const ROWS: u64 = 4;

/// Whether the arm of a cell goes along what was measured, whatever its controller was.
pub(in crate::diagnose) fn is_tracking(cell: &Cell) -> bool {
    cell.controller.as_ref().is_some_and(|law| law.kind == ControllerKind::Tracking)
}

/// What was found, without the gains of the law that kept the arm on its way: no robot has those. `given`: what was known before.
pub(in crate::diagnose) fn without_law(theta: Theta, given: Option<&Theta>) -> Theta {
    Theta { arm: given.and_then(|given| given.arm.clone()), ..theta }
}

/// The cell whose arm goes where it was measured; `None` where cell.toml has no controller, or only joints without bodies, of
/// which no torque can be predicted.
pub(in crate::diagnose) fn cell(cell: &Cell) -> Option<Cell> {
    let controller = cell.controller.as_ref()?;
    if cell.robot.as_ref().is_none_or(|robot| !robot.joints.is_empty()) {
        return None;
    }
    let controller = Controller {
        kind: ControllerKind::Tracking,
        rotor_inertia: controller.rotor_inertia.clone(),
        torque_sensing: controller.torque_sensing,
        ..Controller::default()
    };
    Some(Cell { controller: Some(controller), ..cell.clone() })
}

/// A clip whose command is its own measured motion, smoothed; `None` where it is too short for that. Its ends, where a fit has
/// rows on one side only, are left out.
pub(in crate::diagnose) fn followed(mut clip: Clip) -> Option<Clip> {
    let measured = &clip.measured;
    let (first, last) = (*measured.stamps_ns.first()?, *measured.stamps_ns.last()?);
    let usual = (last - first) / (measured.len() as u64 - 1).max(1);
    let half = if uneven(&measured.stamps_ns) { UNEVEN_HALF_NS } else { HALF_NS }.max(ROWS * usual);
    let (from, to) = (first + half, last.checked_sub(half)?);
    if to <= from {
        return None;
    }
    let grid: Vec<u64> = (from..=to).step_by(TICK_NS as usize).collect();
    let desired = smoothed(measured, &grid, half);
    let kept = measured.between(from..=to);
    let motion = smoothed(measured, &kept.stamps_ns, half);
    clip.measured = JointSeries { tau: kept.tau, ..motion };
    clip.desired = desired;
    // A torque belongs to the row that it was logged with.
    clip.torques_end_at_rows = true;
    (!clip.measured.is_empty()).then_some(clip)
}

fn uneven(stamps: &[u64]) -> bool {
    let mut steps: Vec<u64> = stamps.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable();
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(1);
    let odd = steps.iter().filter(|step| 4 * step.abs_diff(usual) > usual).count();
    odd as f64 > UNEVEN * steps.len() as f64
}

/// Positions and velocities at stamps, each from a cubic through the rows around it.
fn smoothed(measured: &JointSeries, at_ns: &[u64], half: u64) -> JointSeries {
    let dof = measured.dof;
    let mut out = JointSeries { dof, stamps_ns: at_ns.to_vec(), ..JointSeries::default() };
    let stamps = &measured.stamps_ns;
    let (mut begin, mut end) = (0, 0);
    for at in at_ns {
        begin += stamps[begin..].partition_point(|stamp| stamp + half < *at);
        end = end.max(begin);
        end += stamps[end..].partition_point(|stamp| *stamp <= at + half);
        let times: Vec<f64> =
            stamps[begin..end].iter().map(|stamp| (*stamp as f64 - *at as f64) / half as f64).collect();
        let shares = cubic(&times);
        for joint in 0..dof {
            // Positions far from 0 would cost digits.
            let middle = measured.q[begin * dof + joint];
            let (mut q, mut slope) = (0.0, 0.0);
            for (row, [value, rate]) in (begin..end).zip(&shares) {
                let away = measured.q[row * dof + joint] - middle;
                (q, slope) = (q + value * away, slope + rate * away);
            }
            out.q.push(middle + q);
            out.dq.push(slope / (half as f64 * 1e-9));
        }
    }
    out
}

/// What each row adds to value and slope at 0 of the cubic that fits best, rows weighted by the tricube of their distance
/// (Cleveland 1979): with full weight those that come and go at the ends would make the motion jerk.
fn cubic(times: &[f64]) -> Vec<[f64; 2]> {
    let powers = |t: f64| Vector4::new(1.0, t, t * t, t * t * t);
    let weight = |t: f64| (1.0 - t.abs().powi(3)).max(0.0).powi(3);
    let normal: Matrix4<f64> = times.iter().map(|t| weight(*t) * powers(*t) * powers(*t).transpose()).sum();
    let inverse = normal.cholesky().map_or_else(Matrix4::zeros, |normal| normal.inverse());
    let share = |t: &f64| {
        let fit = weight(*t) * inverse * powers(*t);
        [fit[0], fit[1]]
    };
    times.iter().map(share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::theta::ArmTheta;

    #[test]
    fn a_cubic_motion_is_followed_exactly_and_noise_averages_out() {
        let stamps: Vec<u64> = (0..500).map(|row| row * 2_000_000).collect();
        let position = |t: f64| 1.5 + 0.3 * t - 2.0 * t * t + 4.0 * t * t * t;
        let noise = |row: usize| if row.is_multiple_of(2) { 1e-5 } else { -1e-5 };
        let q = |noisy: bool| -> Vec<f64> {
            let at =
                |(row, stamp): (usize, &u64)| position(*stamp as f64 * 1e-9) + if noisy { noise(row) } else { 0.0 };
            stamps.iter().enumerate().map(at).collect()
        };
        let series = |q| JointSeries { stamps_ns: stamps.clone(), dof: 1, q, ..JointSeries::default() };
        let at = [500_000_000];
        for (noisy, close) in [(false, [1e-10, 1e-8]), (true, [3e-6, 1e-3])] {
            let out = smoothed(&series(q(noisy)), &at, HALF_NS);
            let slope = 0.3 - 4.0 * 0.5 + 12.0 * 0.25;
            assert!((out.q[0] - position(0.5)).abs() < close[0], "{}", out.q[0] - position(0.5));
            assert!((out.dq[0] - slope).abs() < close[1], "{}", out.dq[0] - slope);
        }
    }

    #[test]
    fn gains_of_the_law_that_keeps_the_arm_on_its_way_are_no_finding() {
        let found = Theta { arm: Some(ArmTheta { stiffness: vec![9e4], damping: vec![600.0] }), ..Theta::default() };
        assert_eq!(without_law(found.clone(), None).arm, None);
        let known = Theta { arm: Some(ArmTheta { stiffness: vec![500.0], damping: vec![40.0] }), ..Theta::default() };
        assert_eq!(without_law(found, Some(&known)).arm, known.arm);
    }
}
