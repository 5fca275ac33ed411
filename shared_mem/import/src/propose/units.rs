//! Degrees or radians, by how far joints turn and by each other; units of velocities, by the slopes of the positions.

use super::Notes;
use super::follow;
use super::track::{Track, rms};
use crate::mapping::{AngleUnit, Factor, JointColumns, RateUnit};
use crate::naming;
use std::f64::consts::TAU;

/// Beyond this a joint position is no plausible angle in radians [rad].
const LARGEST_ANGLE: f64 = 1.5 * TAU;
/// How far off a factor may be that a unit explains [1].
const SAME_FACTOR: f64 = 0.02;
/// Positions are in degrees when they are so many times the others; a radian is 57.3 degrees.
const IN_DEGREES: std::ops::Range<f64> = 40.0..80.0;
/// How far a velocity may differ from the slope of its position, over all rows.
const ALIKE: std::ops::Range<f64> = 0.75..1.33;

/// Beyond this they are counts of an encoder, or hundredths of a degree [deg].
const LARGEST_DEGREES: f64 = 1000.0;
/// No arm turns a joint faster for a fiftieth of a motion: the fastest reach some 15 [rad/s]; a choice above them.
const FASTEST: f64 = 20.0;
/// How much faster than its description says a joint is not [1]; a choice.
const FASTER: f64 = 1.5;
const FAST_SHARE: f64 = 0.98;
/// Speeds are taken over this time, so that rows that hold a value and then step are none [s].
const WINDOW: f64 = 0.1;

/// What else is known of the joints: the speeds that their description allows [rad/s]; empty where none is known.
pub(super) type Speeds<'a> = &'a [f64];

/// The unit that all of these columns name.
fn named(names: &[String]) -> Option<(AngleUnit, String)> {
    let first = naming::unit(names.first()?)?;
    let (unit, word) = match first {
        naming::Unit::Radian => (AngleUnit::Radian, "rad"),
        naming::Unit::Degree => (AngleUnit::Degree, "deg"),
        naming::Unit::Turn => (AngleUnit::Turn, "turn"),
        naming::Unit::Millimetre => (AngleUnit::Millimetre, "mm"),
        naming::Unit::Metre => (AngleUnit::Metre, "m"),
        _ => return None,
    };
    let all = names.iter().all(|name| naming::unit(name) == Some(first));
    all.then(|| (unit, format!("`{}` names its unit: {word}", names[0])))
}

/// How far each joint turns at most, in rising order [as logged].
fn reaches(track: &Track) -> Vec<f64> {
    let reach = |q: &Vec<f64>| q.iter().filter(|v| v.is_finite()).fold(0.0, |m: f64, v| m.max(v.abs()));
    let mut reaches: Vec<f64> = track.q.iter().map(reach).collect();
    reaches.sort_by(f64::total_cmp);
    reaches
}

/// A speed that a joint has over a tenth of a second, and one that it cannot have, both as if it was logged in radians [rad/s].
fn too_fast(track: &Track, speeds: Speeds<'_>) -> Option<(f64, f64)> {
    let rows = ((WINDOW / track.step()) as usize).max(1);
    let span = |row: usize| track.t.get(row + rows).zip(track.t.get(row)).map(|(b, a)| b - a);
    track.q.iter().enumerate().find_map(|(joint, q)| {
        let speed = |row: usize| span(row).filter(|dt| *dt > 0.0).map(|dt| (q[row + rows] - q[row]).abs() / dt);
        let mut all: Vec<f64> = (0..q.len().saturating_sub(rows)).filter_map(speed).filter(|v| v.is_finite()).collect();
        all.sort_by(f64::total_cmp);
        let speed = all.get((FAST_SHARE * all.len() as f64) as usize).copied()?;
        let most = speeds.get(joint).filter(|most| **most > 0.0).map_or(FASTEST, |most| FASTEST.min(FASTER * most));
        (speed > most).then_some((speed, most))
    })
}

/// `speeds`: those of measured positions; `None` of commands, which may step.
fn by_size(track: &Track, speeds: Option<Speeds<'_>>) -> (AngleUnit, String) {
    let reaches = reaches(track);
    let largest = reaches.last().copied().unwrap_or(0.0);
    let middle = reaches.get(reaches.len() / 2).copied().unwrap_or(0.0);
    if largest > LARGEST_DEGREES {
        let what = format!(
            "they reach {largest:.0}, which joints do neither in radians nor in degrees: which unit? Of counts of an encoder \
             `q_unit = \"turn\"` and `q_factor` = 1 over the counts of a turn; of hundredths of a degree `\"deg\"` and 0.01"
        );
        (AngleUnit::NotKnown, what)
    } else if middle > LARGEST_ANGLE {
        (AngleUnit::Degree, format!("they reach {largest:.1}, and no joint turns that far in radians"))
    } else if largest > LARGEST_ANGLE {
        let what = format!(
            "one joint reaches {largest:.1} and the one in the middle {middle:.2}: \"deg\", or \"rad\" with a joint that turns without end?"
        );
        (AngleUnit::NotKnown, what)
    } else if let Some((speed, most)) = speeds.and_then(|speeds| too_fast(track, speeds)) {
        let what = format!("in radians a joint would turn at {speed:.0} rad/s, and at most {most:.0} can be: degrees");
        (AngleUnit::Degree, what)
    } else {
        (AngleUnit::Radian, format!("they reach {largest:.2}, as joints do in radians"))
    }
}

/// Says which unit, or asks for it.
fn say(line: &str, unit: AngleUnit, why: String, notes: &mut Notes) {
    if unit == AngleUnit::NotKnown { notes.open(line, why) } else { notes.why(line, why) }
}

/// Proposes the unit of the measured positions.
pub(super) fn measured(track: &Track, speeds: Speeds<'_>, columns: &mut JointColumns, notes: &mut Notes) {
    let (unit, why) = named(&columns.q).unwrap_or_else(|| by_size(track, Some(speeds)));
    columns.q_unit = unit;
    say("measured.q_unit", unit, why, notes);
}

/// Proposes the unit of the commanded positions. `factor`: positions are so many times the commands, as both are logged, where
/// their numbers tell.
pub(super) fn desired(
    (did, told): (&Track, &Track),
    factor: Option<f64>,
    (measured, desired): (&mut JointColumns, &mut JointColumns),
    notes: &mut Notes,
) {
    let line = "desired.q_unit";
    if let Some((unit, why)) = named(&desired.q)
        && factor.is_none_or(|factor| (factor * measured.q_unit.si() / unit.si() - 1.0).abs() < SAME_FACTOR)
    {
        desired.q_unit = unit;
        notes.why(line, why);
        return;
    }
    let is_one = factor.is_some_and(|factor| (factor - 1.0).abs() < 1e-9);
    let (unit, why) = by_size(told, None);
    desired.q_unit = unit;
    if measured.q_unit == AngleUnit::NotKnown && factor.is_some() {
        // Asked once, of the measured ones.
        desired.q_unit = AngleUnit::NotKnown;
        return;
    }
    let untold = unit == AngleUnit::NotKnown && (is_one || factor.is_none());
    if unit != measured.q_unit && (untold || (is_one && named(&measured.q).is_some())) {
        desired.q_unit = measured.q_unit;
        notes.why(line, "they go where the measured positions go: one unit for both");
        return;
    }
    let ratio = rms(told.q.iter().flatten()) / rms(did.q.iter().flatten());
    let Some(factor) = factor else {
        // A motion too small to tell is told by the other's.
        if measured.q_unit != unit && !IN_DEGREES.contains(&ratio) && !IN_DEGREES.contains(&ratio.recip()) {
            (measured.q_unit, desired.q_unit) = (AngleUnit::Degree, AngleUnit::Degree);
            notes.why(line, format!("they are {ratio:.2} times the measured positions: one unit for both"));
        } else {
            notes.why(line, why);
        }
        return;
    };
    let times = if factor > 1.0 { "57.3 times smaller than" } else { "57.3 times as large as" };
    match (measured.q_unit, is_one) {
        (_, true) if measured.q_unit == unit => notes.why(line, why),
        (_, true) => {
            (measured.q_unit, desired.q_unit) = (AngleUnit::Degree, AngleUnit::Degree);
            notes.why(line, "they go where the measured positions go: one unit for both");
        }
        (AngleUnit::Radian, false) if factor < 1.0 => {
            desired.q_unit = AngleUnit::Degree;
            notes.why(line, format!("they are {times} the measured positions: degrees, where those are radians"));
        }
        (AngleUnit::Degree, false) if factor > 1.0 => {
            desired.q_unit = AngleUnit::Radian;
            notes.why(line, format!("they are {times} the measured positions: radians, where those are degrees"));
        }
        (unit, false) => {
            desired.q_unit = unit;
            desired.q_factor = Factor::All(factor);
            let what = format!(
                "the commands are {times} the measured positions, as if they had been converted once too often: they are brought to \
                 the same unit; 1.0 takes them as they are logged"
            );
            notes.why("desired.q_factor", what);
        }
    }
}

/// Proposes the unit of velocities, or leaves them out where they are no slope of the positions.
pub(super) fn velocities(track: &Track, block: &str, columns: &mut JointColumns, notes: &mut Notes) {
    let line = format!("{block}.dq_unit");
    columns.dq_unit = columns.q_unit.per_second();
    let (mut product, mut square, mut slope_square) = (0.0, 0.0, 0.0);
    for (joint, dq) in track.dq.iter().enumerate() {
        for (slope, dq) in track.slopes(joint).iter().zip(dq).filter(|(s, v)| s.is_finite() && v.is_finite()) {
            product += slope * dq;
            square += dq * dq;
            slope_square += slope * slope;
        }
    }
    let moves = (slope_square / track.t.len() as f64).sqrt() > 1e-3;
    if !moves || square == 0.0 {
        notes.why(&line, "the arm hardly moves, so the slopes of q do not tell; the unit of q a second is taken");
        return;
    }
    let factor = product / square;
    let units = [
        (RateUnit::RadianPerSecond, "rad/s"),
        (RateUnit::DegreePerSecond, "deg/s"),
        (RateUnit::TurnPerMinute, "rpm"),
        (RateUnit::MillimetrePerSecond, "mm/s"),
    ];
    match units.iter().find(|(unit, _)| ALIKE.contains(&(factor / unit.si()))) {
        Some((unit, word)) => {
            columns.dq_unit = *unit;
            notes.why(&line, format!("q rises {factor:.4} rad/s for each 1 of them: {word}"));
        }
        None => {
            columns.dq.clear();
            let what = format!(
                "left out: q rises {factor:.4} rad/s for each 1 of them, which is no known unit; list them to keep them"
            );
            notes.why(&format!("{block}.dq"), what);
        }
    }
}

/// Proposes the units of blocks that a person filled in and that name none.
pub(super) fn unnamed(
    (did, told): (&Track, Option<&Track>),
    (own, other): (&mut JointColumns, Option<&mut JointColumns>),
    notes: &mut Notes,
) {
    if own.q_unit == AngleUnit::NotKnown {
        measured(did, &[], own, notes);
    }
    if let (Some(told), Some(other)) = (told, other)
        && other.q_unit == AngleUnit::NotKnown
    {
        let factor = follow::follows(did, told, true).and_then(Result::ok).map(|following| following.factor);
        desired((did, told), factor, (own, other), notes);
    }
}

#[cfg(test)]
mod tests {
    use super::super::follow::DEGREES;
    use super::*;

    fn track(scale: f64, rate_scale: f64) -> Track {
        let t: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-3).collect();
        let q = vec![t.iter().map(|t| scale * (2.0 * t).sin()).collect()];
        let dq = vec![t.iter().map(|t| rate_scale * 2.0 * (2.0 * t).cos()).collect()];
        Track { t, q, dq, tau: vec![] }
    }

    #[test]
    fn degrees_are_told_by_size_and_by_the_other_topic() {
        let units = |did: &Track, told: &Track, factor: Option<f64>| {
            let (mut own, mut other) = (JointColumns::default(), JointColumns::default());
            measured(did, &[], &mut own, &mut Notes::default());
            desired((did, told), factor, (&mut own, &mut other), &mut Notes::default());
            (own.q_unit, other.q_unit, other.q_factor.of(0))
        };
        use AngleUnit::{Degree, Radian};
        let small = DEGREES.recip();
        for (did, told, factor, expected) in [
            (1.0, 1.0, None, (Radian, Radian, 1.0)),
            (57.3, 57.3, None, (Degree, Degree, 1.0)),
            (1.0, 57.3, None, (Radian, Degree, 1.0)),
            // One of two topics just below the bound.
            (9.4, 9.5, None, (Degree, Degree, 1.0)),
            (9.4, 9.5, Some(1.0), (Degree, Degree, 1.0)),
            (0.1, 5.73, Some(small), (Radian, Degree, 1.0)),
            (1.0, 0.0175, Some(DEGREES), (Radian, Radian, DEGREES)),
            (57.3, 1.0, Some(DEGREES), (Degree, Radian, 1.0)),
            (57.3, 3283.0, Some(small), (Degree, Degree, small)),
        ] {
            assert_eq!(units(&track(did, 1.0), &track(told, 1.0), factor), expected, "{did} {told}");
        }
    }

    #[test]
    fn velocities_are_told_by_the_slope_and_left_out_where_they_are_none() {
        for (rate_scale, expected) in [
            (1.0, Some(RateUnit::RadianPerSecond)),
            (57.3, Some(RateUnit::DegreePerSecond)),
            (9.55, Some(RateUnit::TurnPerMinute)),
            (2.5, None),
        ] {
            let mut columns = JointColumns { dq: vec!["dq".into()], ..JointColumns::default() };
            let mut notes = Notes::default();
            velocities(&track(1.0, rate_scale), "measured", &mut columns, &mut notes);
            assert_eq!((!columns.dq.is_empty()).then_some(columns.dq_unit), expected, "{:?}", notes.0);
        }
    }
}
