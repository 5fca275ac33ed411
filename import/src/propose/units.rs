//! Degrees or radians, by how far joints turn and by each other; units of velocities, by the slopes of the positions.

use super::Notes;
use super::track::{Track, rms};
use crate::mapping::{AngleUnit, JointColumns, RateUnit};
use std::f64::consts::TAU;

/// Beyond this a joint position is no plausible angle in radians [rad].
const LARGEST_ANGLE: f64 = 1.5 * TAU;
/// Positions are in degrees when they are so many times the others; a radian is 57.3 degrees.
const IN_DEGREES: std::ops::Range<f64> = 40.0..80.0;
/// How far a velocity may differ from the slope of its position, over all rows.
const ALIKE: std::ops::Range<f64> = 0.75..1.33;

/// Proposes the units of both positions.
pub(super) fn angles(
    measured: &Track,
    desired: Option<&Track>,
    (did, told): (&mut JointColumns, &mut JointColumns),
    notes: &mut Notes,
) {
    let largest = |track: &Track| track.q.iter().flatten().fold(0.0, |m: f64, v| m.max(v.abs()));
    let (m, d) = (largest(measured), desired.map(largest));
    let by_size = |value: f64| {
        if value > LARGEST_ANGLE {
            (AngleUnit::Degree, format!("they reach {value:.1}, and no joint turns that far in radians"))
        } else {
            (AngleUnit::Radian, format!("they reach {value:.2}, as joints do in radians"))
        }
    };
    let (unit, why) = by_size(m);
    did.q_unit = unit;
    notes.why("measured.q_unit", why);
    let Some(d) = d else { return };
    let (unit, why) = by_size(d);
    told.q_unit = unit;
    // A motion too small to tell is told by the other's.
    let ratio = desired.map_or(1.0, |desired| rms(desired.q.iter().flatten()) / rms(measured.q.iter().flatten()));
    if did.q_unit != told.q_unit && !IN_DEGREES.contains(&ratio) && !IN_DEGREES.contains(&ratio.recip()) {
        (did.q_unit, told.q_unit) = (AngleUnit::Degree, AngleUnit::Degree);
        notes.why("desired.q_unit", format!("they are {ratio:.2} times the measured positions: one unit for both"));
    } else {
        notes.why("desired.q_unit", why);
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
    use super::*;

    fn track(scale: f64, rate_scale: f64) -> Track {
        let t: Vec<f64> = (0..2000).map(|i| f64::from(i) * 1e-3).collect();
        let q = vec![t.iter().map(|t| scale * (2.0 * t).sin()).collect()];
        let dq = vec![t.iter().map(|t| rate_scale * 2.0 * (2.0 * t).cos()).collect()];
        Track { t, q, dq, tau: vec![] }
    }

    #[test]
    fn degrees_are_told_by_size_and_by_the_other_topic() {
        let units = |measured: &Track, desired: &Track| {
            let (mut did, mut told) = (JointColumns::default(), JointColumns::default());
            angles(measured, Some(desired), (&mut did, &mut told), &mut Notes::default());
            (did.q_unit, told.q_unit)
        };
        use AngleUnit::{Degree, Radian};
        assert_eq!(units(&track(1.0, 1.0), &track(1.0, 1.0)), (Radian, Radian));
        assert_eq!(units(&track(57.3, 1.0), &track(57.3, 1.0)), (Degree, Degree));
        assert_eq!(units(&track(1.0, 1.0), &track(57.3, 1.0)), (Radian, Degree));
        // One of two topics just below the bound.
        assert_eq!(units(&track(9.4, 1.0), &track(9.5, 1.0)), (Degree, Degree));
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
