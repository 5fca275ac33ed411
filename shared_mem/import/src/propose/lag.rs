//! How far the arm lags behind its commands. An arm that follows is late; one that is early was stamped by another clock. A
//! delay is nothing to take out: the twin explains it. Nothing is shifted that the motion does not tell.

use super::Notes;
use super::track::Track;
use crate::lag::{self, Group, Lag, Motion};
use crate::mapping::JointColumns;

/// Correlation below which nothing is said.
const CLEAR: f64 = 0.5;
/// Lags that are nearer to none [s], or by so many rows, are no lead and no lag worth the name.
const LEAD: f64 = 0.015;
const LEAD_ROWS: f64 = 3.0;
/// Commands that are logged behind what they cause come so many rows late at most [1].
const ROWS_LATE: f64 = 1.5;
/// Half the narrowest interval of a lag that digits are kept for [s].
const FINEST: f64 = 1e-4;
/// Fast and slow parts that differ by this factor tell a constant phase from a constant delay.
const FASTER: f64 = 1.5;
/// A motion goes back where it does so by this share of the longest way of a joint [1]; a choice, far beyond noise.
const BACK: f64 = 0.2;
/// Parts of a log whose speeds are compared.
const PARTS: usize = 8;

/// Tells the lag, and proposes a shift where commands come behind what they cause.
pub(super) fn look(measured: &Track, desired: &Track, columns: &mut JointColumns, notes: &mut Notes) {
    let line = "desired.shift";
    let [measured, desired] = [&measured.continuous(), &desired.continuous()];
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
    let said = match untold(&lag, step) {
        Some(why) => why,
        None if lag.interval[1] < 0.0 && lag.seconds < 0.0 => early(&lag, step, turns(measured), columns),
        None => late(&lag, &lag::groups(told, did)) + &with_speed(measured, desired, step).unwrap_or_default(),
    };
    notes.why(line, said);
}

/// Why the motion does not tell the lag; `step`: from row to row [s].
fn untold(lag: &Lag, step: f64) -> Option<String> {
    let [ms, low, high] = milliseconds(lag);
    let fits = format!("any from {low} to {high} ms fits about as well; nothing is shifted");
    let far = LEAD.max(LEAD_ROWS * step);
    if lag.repeats && lag.correlation >= CLEAR {
        Some(format!(
            "this motion repeats itself, so that it does not tell the lag between commands and states: {ms} ms fits, and so do \
             others between {low} and {high} ms; nothing is shifted. A motion that does not repeat itself tells it"
        ))
    } else if lag.open {
        Some(format!(
            "this motion does not tell the lag between commands and states: {fits}. A motion that goes forth and back tells it"
        ))
    } else if lag.correlation < CLEAR {
        Some(format!("the arm does not clearly follow its commands (correlation {:.2} at best)", lag.correlation))
    } else if lag.interval[0] < -far && lag.interval[1] > far {
        Some(format!(
            "this motion does not tell whether the arm leads its commands or follows them: {fits}. A faster motion that goes forth \
             and back tells it"
        ))
    } else {
        None
    }
}

/// An arm that leads its commands, which are shifted where that is sure.
fn early(lag: &Lag, step: f64, turns: bool, columns: &mut JointColumns) -> String {
    let [ms, low, high] = milliseconds(&Lag { seconds: -lag.seconds, ..*lag });
    let early = format!("the arm moves {ms} ms before its commands (95 % {low} to {high} ms), which no arm does");
    let shift = meant(lag);
    if lag.seconds > -ROWS_LATE * step {
        format!(
            "{early}: that is less than two rows, as commands that are logged a row late show it. Nothing is shifted; {shift} here \
             shifts them"
        )
    } else if turns {
        columns.shift = shift;
        format!("{early}: the commands were stamped by another clock")
    } else {
        format!(
            "{early}: the commands were stamped by another clock. The motion goes one way only, where a lead and an arm that is \
             ahead look alike: nothing is shifted; {shift} here shifts them"
        )
    }
}

fn late(lag: &Lag, groups: &[Group]) -> String {
    let [ms, low, high] = milliseconds(lag);
    let within = format!("95 % {low} to {high} ms, correlation {:.2}", lag.correlation);
    let mut said = if ms.starts_with('-') {
        format!("the arm follows its commands without a lag that shows ({ms} ms, {within}); nothing is shifted")
    } else {
        format!(
            "the arm follows its commands by {ms} ms ({within}); nothing is shifted, since a delay is the twin's to explain"
        )
    };
    if groups.len() > 1 {
        said += &format!(". The joints do not lag alike: {}", lag::in_words(groups));
    }
    said
}

fn milliseconds(lag: &Lag) -> [String; 3] {
    lag::milliseconds([lag.seconds, lag.interval[0], lag.interval[1]])
}

/// A lag [s] with one digit more than its interval tells.
fn meant(lag: &Lag) -> f64 {
    let half = 0.5 * (lag.interval[1] - lag.interval[0]);
    let digits = (1.0 - half.max(FINEST).log10()).floor().clamp(0.0, 6.0);
    let scale = 10f64.powf(digits);
    (lag.seconds * scale).round() / scale
}

/// A lag that shrinks as the motion gets faster.
fn with_speed(measured: &Track, desired: &Track, step: f64) -> Option<String> {
    let ((slow_hz, slow), (fast_hz, fast)) = by_speed(measured, desired)?;
    let apart = slow.seconds - slow.half_width > fast.seconds + fast.half_width;
    (slow.seconds > 2.0 * step && slow.seconds / fast.seconds.max(step) > FASTER && apart)
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
        // One speed over and over: of the lags that fit, the one nearest to none.
        ((lag.repeats || !lag.open) && lag.correlation > CLEAR).then_some((hz, lag))
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
        // Between two rows, which are 2 ms apart, and in digits that mean something.
        let (by, told) = shift(&moved(|t| wave(t + 0.045)), &desired);
        assert!((by + 0.045).abs() < 5e-4 && format!("{by}").len() < 9, "{by} {told}");
    }

    #[test]
    fn a_motion_that_repeats_itself_shifts_nothing() {
        for lag in [0.03, 0.3] {
            let wave = |t: f64| 0.3 * (4.0 * std::f64::consts::PI * t).sin();
            let (by, told) = shift(&moved(|t| wave(t - lag)), &moved(wave));
            assert!(by == 0.0 && told.contains("repeats itself"), "{by} {told}");
        }
    }

    #[test]
    fn rows_that_jump_away_and_back_hide_no_lag() {
        let wave = |t: f64| (2.0 * t).sin() + 0.4 * (5.3 * t).sin();
        let mut measured = moved(|t| wave(t - 0.04));
        for row in [700, 2300, 5100] {
            measured.q[0][row] += 0.9;
        }
        let (by, told) = shift(&measured, &moved(wave));
        assert!(by == 0.0 && told.contains("by 40 ms"), "{by} {told}");
    }

    #[test]
    fn an_interval_of_many_rows_either_way_is_no_lag() {
        let lag = Lag {
            seconds: 0.01,
            interval: [-0.067, 0.032],
            correlation: 0.99,
            open: false,
            repeats: false,
            half_width: 0.05,
        };
        let said = untold(&lag, 1e-3).expect("a reason");
        assert!(said.contains("whether the arm leads") && said.contains("-67 to 32 ms"), "{said}");
        assert_eq!(untold(&Lag { interval: [-0.002, 0.022], ..lag }, 1e-3), None);
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
