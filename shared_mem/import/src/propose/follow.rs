//! What two groups of columns say about each other: whether velocities are the slope of positions, and whether joints go where
//! commands say.

use super::track::Track;
use std::f64::consts::TAU;

/// Rows that are compared.
const MOST_ROWS: usize = 400;
/// Fewer tell nothing.
const FEWEST_ROWS: usize = 10;
/// Lags that are looked at, in steps of at least this much [s].
const LAGS: usize = 10;
const SHORTEST_STEP: f64 = 0.05;
/// A joint that goes through less than this does not move [rad].
const STILL: f64 = 1e-4;
/// Correlation from which velocities are the slope of positions.
const SLOPE: f64 = 0.8;
/// Share of the joints' motion that commands explain. Those in the same unit and from the same zero need to explain less of it than
/// those that a factor or an offset may have fitted by chance.
const PLAIN: f64 = 0.5;
const FITTED: f64 = 0.7;
/// Commands come before what they cause when the residual at a lag is so many times that at none.
const EARLIER: f64 = 0.7;
/// Two groups of the same numbers differ by less than this part of the motion: one of them may have been logged seldom, and lies on
/// straight lines between its rows.
const SAME: f64 = 5e-3;

/// A radian [deg].
pub(super) const DEGREES: f64 = 360.0 / TAU;

/// How joints go where commands say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Following {
    /// Positions are so many times the commands: 1, or 57.3 and its inverse.
    pub(super) factor: f64,
    /// Share of the joints' motion that the commands explain; that of the joint in the middle.
    pub(super) share: f64,
}

/// Whether the velocities of a track are the slope of its positions, in whatever unit.
pub(super) fn is_slope(track: &Track) -> bool {
    let (mut product, mut square, mut slope_square) = (0.0, 0.0, 0.0);
    for (joint, dq) in track.dq.iter().enumerate() {
        for (slope, dq) in track.slopes(joint).iter().zip(dq).filter(|(s, v)| s.is_finite() && v.is_finite()) {
            product += slope * dq;
            square += dq * dq;
            slope_square += slope * slope;
        }
    }
    product > SLOPE * (square * slope_square).sqrt() && product > 0.0
}

/// Whether the joints go where the commands say; `None` where that cannot be known, as they rest or share no time. `in_order`:
/// whether each command stands in the place of its joint.
pub(super) fn follows(measured: &Track, desired: &Track, in_order: bool) -> Option<Result<Following, f64>> {
    let pairs = Pairs::of(measured, desired, in_order)?;
    let share = |factor: f64, level: bool| {
        let shares = (0..pairs.lags).map(|lag| pairs.share(lag, factor, level));
        shares.fold(f64::NEG_INFINITY, f64::max)
    };
    let tries = [(1.0, true, PLAIN), (DEGREES, true, FITTED), (DEGREES.recip(), true, FITTED), (1.0, false, FITTED)];
    let mut best = f64::NEG_INFINITY;
    for (factor, level, enough) in tries {
        let share = share(factor, level);
        if share > enough {
            return Some(Ok(Following { factor, share }));
        }
        best = best.max(share);
    }
    Some(Err(best))
}

/// Whether the first of two tracks comes clearly before the second: the second goes where the first says, later.
pub(super) fn leads(first: &Track, second: &Track) -> bool {
    let Some(pairs) = Pairs::finely(second, first) else { return false };
    let residual = |lag: usize| 1.0 - pairs.share(lag, 1.0, true);
    let at_once = residual(0);
    let best = (1..pairs.lags).map(residual).fold(f64::INFINITY, f64::min);
    1.0 - best > PLAIN && best < EARLIER * at_once
}

/// Whether two tracks hold the same numbers, at whatever rates.
pub(super) fn are_same(a: &Track, b: &Track) -> bool {
    a.q.len() == b.q.len() && Pairs::of(a, b, true).is_some_and(|pairs| pairs.share(0, 1.0, true) > 1.0 - SAME * SAME)
}

/// Positions of joints that move, and what they may have been commanded, at the same rows.
struct Pairs {
    /// Joint by joint.
    did: Vec<Vec<f64>>,
    /// Lag by lag, command by command.
    told: Vec<Vec<Vec<f64>>>,
    lags: usize,
    /// Which command is a joint's, by its place among those that move; `None`: any.
    places: Option<Vec<usize>>,
}

impl Pairs {
    fn of(measured: &Track, desired: &Track, in_order: bool) -> Option<Self> {
        Self::at(measured, desired, (SHORTEST_STEP, in_order))
    }

    /// In steps of a row.
    fn finely(measured: &Track, desired: &Track) -> Option<Self> {
        Self::at(measured, desired, (0.0, true))
    }

    fn at(measured: &Track, desired: &Track, (shortest, in_order): (f64, bool)) -> Option<Self> {
        let every = (measured.t.len() / MOST_ROWS).max(1);
        let rows: Vec<usize> = (0..measured.t.len()).step_by(every).collect();
        let moving: Vec<usize> = (0..measured.q.len()).filter(|joint| spread(&measured.q[*joint]) > STILL).collect();
        if moving.is_empty() || desired.q.is_empty() || (in_order && desired.q.len() < measured.q.len()) {
            return None;
        }
        let (first, last) = (*desired.t.first()?, *desired.t.last()?);
        if rows.iter().filter(|row| (first..=last).contains(&measured.t[**row])).count() < FEWEST_ROWS {
            return None;
        }
        let span = measured.t.last()? - measured.t.first()?;
        let step = (span / (measured.t.len() - 1) as f64).max(shortest);
        let at_lag = |lag: usize| {
            let times: Vec<f64> = rows.iter().map(|row| measured.t[*row] - lag as f64 * step).collect();
            (0..desired.q.len()).map(|joint| desired.at(joint, &times)).collect()
        };
        let told = (0..=LAGS).map(at_lag).collect();
        let did = moving.iter().map(|joint| rows.iter().map(|row| measured.q[*joint][*row]).collect()).collect();
        Some(Self { did, told, lags: LAGS + 1, places: in_order.then_some(moving) })
    }

    /// Share of the motion that the commands explain at a lag: that of the joint in the middle. `level`: from the same zero.
    fn share(&self, lag: usize, factor: f64, level: bool) -> f64 {
        let told = &self.told[lag];
        let one = |(joint, did): (usize, &Vec<f64>)| {
            let commands = match &self.places {
                Some(places) => places[joint]..places[joint] + 1,
                None => 0..told.len(),
            };
            let each = commands.flat_map(|command| {
                [factor, -factor]
                    .map(|factor| explained(did, told.get(command).map_or(&[], Vec::as_slice), factor, level))
            });
            each.fold(f64::NEG_INFINITY, f64::max)
        };
        let mut shares: Vec<f64> = self.did.iter().enumerate().map(one).collect();
        shares.sort_by(f64::total_cmp);
        shares[(shares.len() - 1) / 2]
    }
}

/// Share of the motion of a joint that commands explain, times a factor; of all rows that both have.
fn explained(did: &[f64], told: &[f64], factor: f64, level: bool) -> f64 {
    let pairs = || did.iter().zip(told).filter(|(a, b)| a.is_finite() && b.is_finite());
    let count = pairs().count();
    if count < FEWEST_ROWS {
        return f64::NEG_INFINITY;
    }
    let n = count as f64;
    let (mean, told_mean) = pairs().fold((0.0, 0.0), |(a, b), (did, told)| (a + did / n, b + told / n));
    let offset = if level { 0.0 } else { mean - factor * told_mean };
    let (mut rest, mut all) = (0.0, 0.0);
    for (did, told) in pairs() {
        rest += (did - factor * told - offset).powi(2);
        all += (did - mean).powi(2);
    }
    1.0 - rest / all.max(f64::MIN_POSITIVE)
}

/// From the smallest number to the largest.
fn spread(values: &[f64]) -> f64 {
    let finite = values.iter().filter(|v| v.is_finite());
    let (least, most) = finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(*v), b.max(*v)));
    (most - least).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn track(joints: &[&dyn Fn(f64) -> f64]) -> Track {
        let t: Vec<f64> = (0..200).map(|i| f64::from(i) * 0.02).collect();
        let q = joints.iter().map(|of| t.iter().map(|t| of(*t)).collect()).collect();
        Track { t, q, ..Track::default() }
    }

    fn wave(w: f64, level: f64, lag: f64, scale: f64) -> impl Fn(f64) -> f64 {
        move |t| scale * (level + 0.3 * (w * (t - lag)).sin())
    }

    #[test]
    fn commands_are_told_from_deltas_of_a_hand_and_from_another_run() {
        let [a, b, c] = [wave(3.0, 0.0, 0.1, 1.0), wave(4.0, -0.8, 0.1, 1.0), wave(5.0, 1.5, 0.1, 1.0)];
        let measured = track(&[&a, &b, &c]);
        let commands = |scale: f64| {
            let [a, b, c] = [wave(3.0, 0.0, 0.0, scale), wave(4.0, -0.8, 0.0, scale), wave(5.0, 1.5, 0.0, scale)];
            track(&[&a, &b, &c])
        };
        for (scale, factor) in [(1.0, 1.0), (DEGREES, DEGREES.recip()), (DEGREES.recip(), DEGREES)] {
            let found = follows(&measured, &commands(scale), true).expect("they move").expect("commands");
            assert!((found.factor - factor).abs() < 1e-9 && found.share > 0.9, "{found:?}");
        }
        let [a, b, c] = [wave(4.2, 0.0, 0.0, 0.2), wave(3.3, 0.0, 0.3, 0.2), wave(2.4, 0.1, 0.0, 0.2)];
        let deltas = track(&[&a, &b, &c]);
        assert!(follows(&measured, &deltas, false).expect("they move").is_err());
        let turned = Track { q: commands(1.0).q.into_iter().rev().collect(), ..commands(1.0) };
        assert!(follows(&measured, &turned, true).expect("they move").is_err());
        assert!(follows(&measured, &turned, false).expect("they move").is_ok());
        assert!(leads(&commands(1.0), &measured) && !leads(&measured, &commands(1.0)));
        assert!(are_same(&measured, &measured) && !are_same(&measured, &commands(1.0)));
        assert_eq!(follows(&track(&[&|_| 0.5]), &commands(1.0), false), None, "it rests");
    }

    #[test]
    fn velocities_belong_to_the_positions_whose_slope_they_are() {
        let a = wave(3.0, 0.0, 0.0, 1.0);
        let mut own = track(&[&a]);
        own.dq = vec![own.slopes(0).iter().map(|v| 57.3 * v).collect()];
        assert!(is_slope(&own));
        let other = Track { q: track(&[&|t: f64| (7.0 * t).cos()]).q, ..own };
        assert!(!is_slope(&other));
    }
}
