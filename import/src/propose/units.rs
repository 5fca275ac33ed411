//! Degrees or radians, by how far joints turn and by each other; units of velocities, by the slopes of the positions.

use super::Notes;
use super::track::{Track, rms};
use crate::mapping::{AngleUnit, Factor, JointColumns, RateUnit};
use std::f64::consts::TAU;

/// Beyond this a joint position is no plausible angle in radians [rad].
const LARGEST_ANGLE: f64 = 1.5 * TAU;
/// Positions are in degrees when they are so many times the others; a radian is 57.3 degrees.
const IN_DEGREES: std::ops::Range<f64> = 40.0..80.0;
/// How far a velocity may differ from the slope of its position, over all rows.
const ALIKE: std::ops::Range<f64> = 0.75..1.33;

/// How far joints turn at most [as logged].
fn largest(track: &Track) -> f64 {
    track.q.iter().flatten().filter(|v| v.is_finite()).fold(0.0, |m: f64, v| m.max(v.abs()))
}

fn by_size(value: f64) -> (AngleUnit, String) {
    if value > LARGEST_ANGLE {
        (AngleUnit::Degree, format!("they reach {value:.1}, and no joint turns that far in radians"))
    } else {
        (AngleUnit::Radian, format!("they reach {value:.2}, as joints do in radians"))
    }
}

/// Proposes the unit of the measured positions.
pub(super) fn measured(track: &Track, columns: &mut JointColumns, notes: &mut Notes) {
    let (unit, why) = by_size(largest(track));
    columns.q_unit = unit;
    notes.why("measured.q_unit", why);
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
    let (unit, why) = by_size(largest(told));
    desired.q_unit = unit;
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
    match (measured.q_unit, (factor - 1.0).abs() < 1e-9) {
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
            measured(did, &mut own, &mut Notes::default());
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
