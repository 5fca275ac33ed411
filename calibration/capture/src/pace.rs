//! The same motion faster or slower: every set point at another time. Which factor the limits allow at most. Pure; rad, s, N m.
//!
//! A motion played `f` times as fast has `f` times the speeds, `f²` times the accelerations and `f³` times the jerks; of its
//! torques all but gravity's grow with `f²`.

use super::body::Body;
use super::excess::Excess;
use super::limits::{LIMITS_SHARE, first_excess};
use super::rate::RATE;
use shared_mem::msg::motion::SetPoint;
use shared_mem::msg::{Joints, MAX_JOINTS};
use twin::arm::{JointLimits, JointState};

/// What is taken off the largest factor before it is named: between set points it is reckoned by interpolation.
const PACE_MARGIN: f64 = 0.995;

/// So little beyond the largest factor the limit is looked for that is met there.
const EXCEEDED_PACE: f64 = 1.02;

/// The motion cannot be played at that pace.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum TooFast {
    /// A slower pace would do.
    #[error(
        "{factor} times its speed breaks a limit; the largest factor that fits is {largest:.2}, just beyond it comes {excess}: \
         give --speed {largest:.2}"
    )]
    Slower {
        /// What was asked for.
        factor: f64,
        /// What the motion breaks first when it is played faster and faster.
        excess: Excess,
        /// The largest factor that breaks nothing, rounded down.
        largest: f64,
    },
    /// No pace would do.
    #[error("the motion breaks a limit at any speed ({0}); move the arm, or choose another clip")]
    Never(Excess),
}

/// The motion at `factor` times its speed, within all limits.
///
/// # Errors
/// [`TooFast`] with joint, quantity and the largest factor.
pub fn paced(points: &[SetPoint], factor: f64, limits: &[JointLimits], body: &Body) -> Result<Vec<SetPoint>, TooFast> {
    let times: Vec<f64> = (0..points.len()).map(|i| i as f64).collect();
    let paced = resampled(&times, points, factor);
    let Some(excess) = first_excess(&paced, limits, Some(body)) else { return Ok(paced) };
    let largest = (100.0 * largest(points, limits, body)).floor() / 100.0;
    if largest > 0.0 && largest < factor && excess.quantity.eases() {
        let beyond = resampled(&times, points, factor.min(EXCEEDED_PACE * largest));
        let excess = first_excess(&beyond, limits, Some(body)).unwrap_or(excess);
        Err(TooFast::Slower { factor, excess, largest })
    } else {
        Err(TooFast::Never(excess))
    }
}

/// The largest factor at which `points`, one a control cycle, break no limit; 0 where they break one at any pace.
pub fn largest(points: &[SetPoint], limits: &[JointLimits], body: &Body) -> f64 {
    let of_moment = |w: &[SetPoint]| {
        let [before, now, after] = [&w[0], &w[1], &w[2]];
        let ddq: Joints = std::array::from_fn(|i| 0.5 * RATE * (after.dq_d[i] - before.dq_d[i]));
        let gravity = body.model().gravity(&now.q_d);
        let torque = body.torque(&JointState { q: now.q_d, dq: now.dq_d }, &ddq);
        let of_joint = |joint: usize| {
            let (limits, q, dq) = (&limits[joint], now.q_d[joint], now.dq_d[joint]);
            let jerk = RATE * RATE * (after.dq_d[joint] - 2.0 * dq + before.dq_d[joint]);
            let [slowest, fastest] = limits.speed_bounds(q);
            let speed = LIMITS_SHARE * if dq < 0.0 { -slowest } else { fastest };
            let most = LIMITS_SHARE * limits.torque;
            let (still, more) = (gravity[joint], torque[joint] - gravity[joint]);
            if !(limits.q_min..=limits.q_max).contains(&q) || still.abs() > most {
                return 0.0;
            }
            let room = if more < 0.0 { most + still } else { most - still };
            ratio(speed, dq.abs())
                .min(ratio(LIMITS_SHARE * limits.acceleration, ddq[joint].abs()).sqrt())
                .min(ratio(LIMITS_SHARE * limits.jerk, jerk.abs()).cbrt())
                .min(ratio(room, more.abs()).sqrt())
        };
        (0..limits.len().min(MAX_JOINTS)).map(of_joint).fold(f64::INFINITY, f64::min)
    };
    PACE_MARGIN * points.windows(3).map(of_moment).fold(f64::INFINITY, f64::min)
}

/// How often `much` goes into `room`; without bound where there is nothing.
fn ratio(room: f64, much: f64) -> f64 {
    if much > 0.0 { (room / much).max(0.0) } else { f64::INFINITY }
}

/// Set points one a control cycle of what was at `rows` at `times` [cycles], played at `factor` times its speed. Between two
/// rows the course is the cubic with their positions and speeds; where a cycle falls on a row it is that row.
pub fn resampled(times: &[f64], rows: &[SetPoint], factor: f64) -> Vec<SetPoint> {
    let (Some(first), Some(last)) = (times.first(), times.last()) else { return Vec::new() };
    let cycles = ((last - first) / factor).ceil() as usize;
    let point = |k: usize| {
        let time = (first + k as f64 * factor).min(*last);
        let next = times.partition_point(|t| *t <= time).min(times.len() - 1);
        let before = next.saturating_sub(1);
        let at = if times[next] <= time { next } else { before };
        if times[at] == time {
            let SetPoint { q_d, dq_d } = rows[at];
            return SetPoint { q_d, dq_d: dq_d.map(|dq| factor * dq) };
        }
        let (length, share) = (times[next] - times[before], (time - times[before]) / (times[next] - times[before]));
        let [a, b] = [&rows[before], &rows[next]];
        let mut point = SetPoint::default();
        for joint in 0..MAX_JOINTS {
            // Slopes a cycle, over the whole interval.
            let [m0, m1] = [a, b].map(|row| row.dq_d[joint] / RATE * length);
            let way = b.q_d[joint] - a.q_d[joint];
            let [c2, c3] = [3.0 * way - 2.0 * m0 - m1, m0 + m1 - 2.0 * way];
            point.q_d[joint] = a.q_d[joint] + share * (m0 + share * (c2 + share * c3));
            point.dq_d[joint] = factor * RATE / length * (m0 + share * (2.0 * c2 + share * 3.0 * c3));
        }
        point
    };
    (0..=cycles).map(point).collect()
}

#[cfg(test)]
mod tests {
    use super::super::plan::plan;
    use super::super::request::{Kind, Request};
    use super::*;
    use crate::limits;
    use proptest::prelude::*;
    use shared_mem::cell::{Cell, Robot};

    fn planned(seed: u64, amplitude: f64) -> (Vec<SetPoint>, Body, Vec<JointLimits>) {
        let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
        let cell = Cell { robot: Some(robot), ..Cell::default() };
        let body = Body::of(&cell).expect("an FR3");
        let limits = limits::of(&cell, &body);
        let (start, moving) = (*body.model().ready(), [true; MAX_JOINTS]);
        let request = Request { start, kind: Kind::Multisine, moving, amplitude, duration: 3.0, seed, floor: -10.0 };
        let set_points = plan(&request, &limits, &body).expect("room").set_points;
        (set_points, body, limits)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(12))]
        #[test]
        fn the_largest_factor_fits_and_a_little_more_does_not(seed in any::<u64>(), amplitude in 0.03..0.3_f64) {
            let (points, body, limits) = planned(seed, amplitude);
            let largest = largest(&points, &limits, &body);
            let fits = paced(&points, largest, &limits, &body).expect("it fits");
            prop_assert!((fits.len() as f64 - points.len() as f64 / largest).abs() < 3.0);
            let error = paced(&points, 1.03 * largest, &limits, &body).expect_err("too fast");
            let TooFast::Slower { largest: named, .. } = error else { panic!("{error}") };
            prop_assert!(named <= largest && named > largest - 0.011, "{error}");
            prop_assert!(paced(&points, named, &limits, &body).is_ok(), "{error}");
        }
    }

    #[test]
    fn half_the_speed_is_the_same_way_in_twice_the_time_and_the_speed_itself_changes_no_bit() {
        let (points, body, limits) = planned(3, 0.1);
        assert_eq!(paced(&points, 1.0, &limits, &body).expect("as it was"), points);
        let half = paced(&points, 0.5, &limits, &body).expect("slower fits");
        assert_eq!(half.len(), 2 * points.len() - 1);
        for (k, point) in half.iter().enumerate().step_by(2) {
            assert_eq!(point.q_d, points[k / 2].q_d);
            assert!(point.dq_d.iter().zip(&points[k / 2].dq_d).all(|(slow, dq)| (2.0 * slow - dq).abs() < 1e-12));
        }
        for w in half.windows(3) {
            for joint in 0..7 {
                let difference = 0.5 * RATE * (w[2].q_d[joint] - w[0].q_d[joint]);
                assert!((difference - w[1].dq_d[joint]).abs() < 1e-4, "{difference} {}", w[1].dq_d[joint]);
            }
        }
    }

    #[test]
    fn a_row_that_is_missing_is_put_back_from_its_neighbours() {
        let (points, ..) = planned(5, 0.2);
        let (mut times, mut rows) = (Vec::new(), Vec::new());
        for (k, point) in points.iter().enumerate().filter(|(k, _)| k % 50 != 7) {
            times.push(k as f64);
            rows.push(*point);
        }
        let whole = resampled(&times, &rows, 1.0);
        assert_eq!(whole.len(), points.len());
        for (a, b) in whole.iter().zip(&points) {
            assert!(a.q_d.iter().zip(&b.q_d).all(|(a, b)| (a - b).abs() < 1e-9), "{a:?} {b:?}");
        }
    }
}
