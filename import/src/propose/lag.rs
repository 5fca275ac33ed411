//! How far the arm lags behind its commands. An arm that follows is late; one that is early was stamped by another clock. A
//! delay is nothing to take out: the twin explains it. Nothing is shifted that the motion does not tell.

use super::Notes;
use super::track::Track;
use crate::lag::{self, Lag, Motion};
use crate::mapping::JointColumns;

/// Correlation below which nothing is said.
const CLEAR: f64 = 0.5;
/// Fast and slow parts that differ by this factor tell a constant phase from a constant delay.
const FASTER: f64 = 1.5;
/// A motion goes back where it does so by this share of the longest way of a joint [1]; a choice, far beyond noise.
const BACK: f64 = 0.2;
/// Parts of a log whose speeds are compared.
const PARTS: usize = 8;

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
    let joints = measured.q.len().min(desired.q.len());
    let [did, told] = [measured, desired].map(|track| Motion { t: &track.t, q: &track.q[..joints] });
    let Some(lag) = lag::between(told, did) else { return };
    let step = measured.step();
    let [low, high] = lag.interval.map(|end| end * 1e3);
    if lag.open {
        notes.why(
            line,
            format!(
                "this motion does not tell the lag between commands and states: any from {low:.0} to {high:.0} ms fits about as \
                 well; nothing is shifted. A motion that goes forth and back tells it"
            ),
        );
        return;
    }
    if lag.correlation < CLEAR {
        let what = format!("the arm does not clearly follow its commands (correlation {:.2} at best)", lag.correlation);
        notes.why(line, what);
        return;
    }
    let ms = lag.seconds * 1e3;
    let within = format!("95 % {low:.0} to {high:.0} ms");
    if lag.interval[1] < 0.0 && lag.seconds < -1.5 * step {
        let early = format!(
            "the arm moves {:.0} ms before its commands ({within}), which no arm does: the commands were stamped by another clock",
            -ms
        );
        if turns(measured) {
            columns.shift = (lag.seconds / step).round() * step;
            notes.why(line, early);
        } else {
            let what = format!(
                "{early}. The motion goes one way only, where a lead and an arm that is ahead look alike: nothing is shifted; \
                 {:.3} here shifts them",
                lag.seconds
            );
            notes.why(line, what);
        }
        return;
    }
    let mut said = format!(
        "the arm follows its commands by {ms:.0} ms ({within}, correlation {:.2}); nothing is shifted, since a delay is the twin's \
         to explain",
        lag.correlation
    );
    let groups = lag::groups(told, did);
    if groups.len() > 1 {
        said += &format!(". The joints do not lag alike: {}", lag::in_words(&groups));
    }
    said += &with_speed(measured, desired, step).unwrap_or_default();
    notes.why(line, said);
}

/// A lag that shrinks as the motion gets faster.
fn with_speed(measured: &Track, desired: &Track, step: f64) -> Option<String> {
    let ((slow_hz, slow), (fast_hz, fast)) = by_speed(measured, desired)?;
    (slow.seconds > 2.0 * step && slow.seconds / fast.seconds.max(step) > FASTER && slow.interval[0] > fast.interval[1])
        .then(|| {
            format!(
                ". It shrinks from {:.0} ms at {slow_hz:.1} Hz to {:.0} ms at {fast_hz:.1} Hz: a constant phase, as friction or a \
                 log that was stretched make it, and no constant delay",
                slow.seconds * 1e3,
                fast.seconds * 1e3
            )
        })
}

/// Frequency [Hz] and lag of the slowest and of the fastest part of the log.
fn by_speed(measured: &Track, desired: &Track) -> Option<((f64, Lag), (f64, Lag))> {
    let length = measured.t.len() / PARTS;
    let part = |number: usize| {
        let rows = number * length..(number + 1) * length;
        let hz = frequency(measured, rows.clone())?;
        let did = measured.rows(rows);
        let (from, to) = (*did.t.first()?, *did.t.last()?);
        let start = desired.t.partition_point(|t| *t < from);
        let told = desired.rows(start..desired.t.partition_point(|t| *t <= to).max(start));
        let lag = lag::between(Motion { t: &told.t, q: &told.q }, Motion { t: &did.t, q: &did.q })?;
        (!lag.open && lag.correlation > CLEAR).then_some((hz, lag))
    };
    let mut found: Vec<(f64, Lag)> = (0..PARTS).filter(|_| length > 50).filter_map(part).collect();
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (slow, fast) = (*found.first()?, *found.last()?);
    (fast.0 > FASTER * slow.0).then_some((slow, fast))
}

/// Whether a joint that moves much turns back: a lead is told from an arm that is ahead where it does.
fn turns(track: &Track) -> bool {
    let ways = track.q.iter().map(|q| {
        let (mut top, mut bottom, mut down, mut up) = (f64::NEG_INFINITY, f64::INFINITY, 0.0_f64, 0.0_f64);
        for q in q {
            (top, bottom) = (top.max(*q), bottom.min(*q));
            (down, up) = (down.max(top - q), up.max(q - bottom));
        }
        [down, up]
    });
    let ways: Vec<[f64; 2]> = ways.collect();
    let most = ways.iter().flatten().copied().fold(0.0, f64::max);
    ways.iter().any(|[down, up]| down.min(*up) > BACK * most)
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

    #[test]
    fn a_stroke_that_goes_one_way_shifts_nothing() {
        let slow = |t: f64| 0.1 * t + 0.02 * t * t;
        let (by, said) = shift(&moved(|t| slow(t + 0.05)), &moved(slow));
        assert!(by == 0.0 && (said.contains("nothing is shifted")), "{by} {said}");
        let even = |t: f64| 0.2 * t;
        let (by, said) = shift(&moved(|t| even(t + 0.05)), &moved(even));
        assert!(by == 0.0 && said.contains("does not tell the lag"), "{by} {said}");
    }
}
