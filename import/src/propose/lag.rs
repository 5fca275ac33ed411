//! How far the arm lags behind its commands: where their velocities correlate best. An arm that follows is late; one that is
//! early was stamped by another clock. A delay is nothing to take out: the twin explains it.

use super::Notes;
use super::track::Track;
use crate::mapping::JointColumns;

/// Lags that are looked at [s].
const LONGEST: f64 = 0.5;
/// Correlation below which nothing is said.
const CLEAR: f64 = 0.5;
/// Rows that are compared at each lag.
const MOST_ROWS: usize = 4000;
/// Fast and slow parts that differ by this factor tell a constant phase from a constant delay.
const FASTER: f64 = 1.5;

/// Lag [s] and correlation at it.
type Best = (f64, f64);

/// Tells the lag, and proposes a shift where commands come behind what they cause.
pub(super) fn look(measured: &Track, desired: &Track, columns: &mut JointColumns, notes: &mut Notes) {
    let line = "desired.shift";
    let (Some(first), Some(last)) = (measured.t.first(), measured.t.last()) else { return };
    if desired.t.first().is_none_or(|t| t > last) || desired.t.last().is_none_or(|t| t < first) {
        notes.why(
            line,
            "commands and states do not overlap in time: two clocks stamped them; give the difference here [s]",
        );
        return;
    }
    let Some((lag, r)) = best(measured, desired, 0..measured.t.len()) else { return };
    if r < CLEAR {
        notes.why(line, format!("the arm does not clearly follow its commands (correlation {r:.2} at best)"));
        return;
    }
    let step = median_step(&measured.t);
    let ms = lag * 1e3;
    if lag < -1.5 * step {
        columns.shift = (lag / step).round() * step;
        let what = format!(
            "the arm moves {:.0} ms before its commands, which no arm does: the commands were stamped by another clock",
            -ms
        );
        notes.why(line, what);
        return;
    }
    let mut told = format!(
        "the arm follows its commands by {ms:.0} ms (correlation {r:.2}); nothing is shifted, since a delay is the twin's to explain"
    );
    if let Some(((slow, slow_hz), (fast, fast_hz))) = by_speed(measured, desired)
        && slow > 2.0 * step
        && slow / fast.max(step) > FASTER
    {
        told += &format!(
            ". It shrinks from {:.0} ms at {slow_hz:.1} Hz to {:.0} ms at {fast_hz:.1} Hz: a constant phase, as friction or a log \
             that was stretched make it, and no constant delay",
            slow * 1e3,
            fast * 1e3
        );
    }
    notes.why(line, told);
}

/// The lag at which measured and desired velocities correlate best within some rows.
fn best(measured: &Track, desired: &Track, rows: std::ops::Range<usize>) -> Option<Best> {
    let every = (rows.len() / MOST_ROWS).max(1);
    let rows: Vec<usize> = rows.step_by(every).collect();
    let step = median_step(&measured.t);
    let count = measured.q.len().min(desired.q.len());
    let did: Vec<Vec<f64>> = (0..count).map(|joint| pick(&measured.slopes(joint), &rows)).collect();
    let told: Vec<Track> = (0..count)
        .map(|joint| Track { t: desired.t.clone(), q: vec![desired.slopes(joint)], ..Track::default() })
        .collect();
    let times = pick(&measured.t, &rows);
    let score = |lag: f64| {
        let at: Vec<f64> = times.iter().map(|t| t - lag).collect();
        let (mut ab, mut aa, mut bb) = (0.0, 0.0, 0.0);
        for (did, told) in did.iter().zip(&told) {
            for (a, b) in did.iter().zip(told.at(0, &at)).filter(|(a, b)| a.is_finite() && b.is_finite()) {
                ab += a * b;
                aa += a * a;
                bb += b * b;
            }
        }
        if aa > 0.0 && bb > 0.0 { ab / (aa * bb).sqrt() } else { 0.0 }
    };
    let coarse = step.max(0.01);
    let reach = (LONGEST / coarse) as i32;
    let lags = (-reach..=reach).map(|i| f64::from(i) * coarse);
    let (centre, r) = lags.map(|lag| (lag, score(lag))).max_by(|a, b| a.1.total_cmp(&b.1))?;
    // The top of a parabola through it and its neighbours.
    let (before, after) = (score(centre - coarse), score(centre + coarse));
    let bend = before - 2.0 * r + after;
    let off = if bend < 0.0 { 0.5 * (before - after) / bend } else { 0.0 };
    Some((centre + off.clamp(-1.0, 1.0) * coarse, r))
}

/// Lag and frequency [Hz] of the slower and of the faster half of the log.
fn by_speed(measured: &Track, desired: &Track) -> Option<(Best, Best)> {
    let parts = 8;
    let length = measured.t.len() / parts;
    let mut found: Vec<(f64, Best)> = (0..parts)
        .filter(|_| length > 50)
        .filter_map(|part| {
            let rows = part * length..(part + 1) * length;
            let hz = frequency(measured, rows.clone())?;
            let best = best(measured, desired, rows).filter(|(_, r)| *r > CLEAR)?;
            Some((hz, best))
        })
        .collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let ((slow_hz, slow), (fast_hz, fast)) = (*found.first()?, *found.last()?);
    (fast_hz > FASTER * slow_hz).then_some(((slow.0, slow_hz), (fast.0, fast_hz)))
}

/// How often the joint that moves most turns back, over two [Hz].
fn frequency(track: &Track, rows: std::ops::Range<usize>) -> Option<f64> {
    let seconds = track.t.get(rows.end - 1)? - track.t.get(rows.start)?;
    let slopes = (0..track.q.len()).map(|joint| track.slopes(joint)).max_by(|a, b| {
        let sum =
            |s: &[f64]| s.get(rows.clone()).unwrap_or(&[]).iter().filter(|v| v.is_finite()).map(|v| v * v).sum::<f64>();
        sum(a).total_cmp(&sum(b))
    })?;
    let part = slopes.get(rows)?;
    let peak = part.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
    // Only turns between motions worth the name.
    let signs: Vec<bool> = part.iter().filter(|v| v.abs() > 0.1 * peak).map(|v| *v > 0.0).collect();
    let turns = signs.windows(2).filter(|w| w[0] != w[1]).count();
    (turns >= 2 && seconds > 0.0).then(|| turns as f64 / 2.0 / seconds)
}

fn median_step(t: &[f64]) -> f64 {
    let mut steps: Vec<f64> = t.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0).collect();
    steps.sort_by(f64::total_cmp);
    steps.get(steps.len() / 2).copied().unwrap_or(1e-3)
}

fn pick(values: &[f64], rows: &[usize]) -> Vec<f64> {
    rows.iter().filter_map(|row| values.get(*row)).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(by: impl Fn(f64) -> f64) -> Track {
        let t: Vec<f64> = (0..8000).map(|i| f64::from(i) * 2e-3).collect();
        let q = vec![t.iter().map(|t| by(*t)).collect()];
        Track { t, q, ..Track::default() }
    }

    fn shift(measured: &Track, desired: &Track) -> (f64, String) {
        let (mut columns, mut notes) = (JointColumns::default(), Notes::default());
        look(measured, desired, &mut columns, &mut notes);
        (columns.shift, notes.0.iter().map(|note| note.why.clone()).collect())
    }

    #[test]
    fn an_arm_that_is_late_stays_late_and_one_that_is_early_is_put_right() {
        let wave = |t: f64| (2.0 * t).sin() + 0.4 * (5.3 * t).sin();
        let desired = moved(wave);
        let (by, told) = shift(&moved(|t| wave(t - 0.04)), &desired);
        assert!(by == 0.0 && told.contains("by 40 ms"), "{by} {told}");
        let (by, told) = shift(&moved(|t| wave(t + 0.1)), &desired);
        assert!((by + 0.1).abs() < 5e-3 && told.contains("another clock"), "{by} {told}");
    }

    #[test]
    fn a_constant_phase_is_told_from_a_constant_delay() {
        // Half of the time at 0.5 Hz, half at 2 Hz.
        let turn = |t: f64, phase: f64| {
            let w = if t < 8.0 { std::f64::consts::PI } else { 4.0 * std::f64::consts::PI };
            (w * t - phase).sin()
        };
        let desired = moved(|t| turn(t, 0.0));
        let (_, told) = shift(&moved(|t| turn(t, 0.5)), &desired);
        assert!(told.contains("a constant phase"), "{told}");
        let (_, told) = shift(&moved(|t| turn(t - 0.05, 0.0)), &desired);
        assert!(!told.contains("a constant phase"), "{told}");
    }
}
