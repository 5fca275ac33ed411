//! Joint positions in degrees, which only a comparison can tell from radians.

use crate::recording::series::JointSeries;
use std::f64::consts::TAU;

/// Beyond this a joint position is no plausible angle in radians [rad].
const LARGEST_ANGLE: f64 = 1.5 * TAU;
/// A topic is in degrees when its positions are so many times the other's; a radian is 57.3 degrees.
const IN_DEGREES: std::ops::Range<f64> = 40.0..80.0;
/// Velocities that exceed the positions' own slopes so many times are in degrees too.
const TOO_FAST: f64 = 10.0;

/// Puts the topic that is in degrees into radians when the other one is in radians; a sentence when it did. The larger one
/// is in degrees where its angles are beyond any in radians or exceed the integral of its velocities; else the smaller one
/// may as well have been divided by 57.3 once too often, and both stay as they are.
pub(super) fn against_each_other(desired: &mut JointSeries, measured: &mut JointSeries) -> Option<String> {
    let ratio = rms(&desired.q) / rms(&measured.q);
    let (series, ratio, which, other) = match ratio {
        ratio if IN_DEGREES.contains(&ratio) => (desired, ratio, "desired", "measured"),
        ratio if IN_DEGREES.contains(&ratio.recip()) => (measured, ratio.recip(), "measured", "desired"),
        _ => return None,
    };
    let slope = rms(&slopes(series));
    let beyond = series.q.iter().any(|q| q.abs() > LARGEST_ANGLE);
    let outruns = !series.dq.is_empty() && IN_DEGREES.contains(&(slope / rms(&series.dq)));
    if !beyond && !outruns {
        return Some(format!(
            "the {which} positions are {ratio:.0} times the {other} ones, and are plausible as radians: the {other} ones were \
             divided by 57.3 once too often, or both are small and the {which} ones in degrees; both stay as they are: publish \
             radians on both"
        ));
    }
    series.q.iter_mut().for_each(|q| *q = q.to_radians());
    if !series.dq.is_empty() && rms(&series.dq) > TOO_FAST * rms(&slopes(series)) {
        series.dq.iter_mut().for_each(|dq| *dq = dq.to_radians());
    }
    Some(format!(
        "the {which} positions are {ratio:.0} times the others: that topic is in degrees and was put into radians; record \
         radians"
    ))
}

/// A sentence when most rows hold angles that no joint has in radians.
pub(super) fn beyond_turns(series: &JointSeries, topic: &str) -> Option<String> {
    let beyond = (0..series.len()).filter(|&i| series.q_row(i).iter().any(|q| q.abs() > LARGEST_ANGLE)).count();
    (series.len() > 1 && beyond * 2 > series.len()).then(|| {
        format!(
            "`{topic}`: {beyond} of {} rows hold positions beyond {LARGEST_ANGLE:.1} rad: probably degrees; record \
             radians",
            series.len()
        )
    })
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Changes of the positions from row to row, a second [rad/s].
fn slopes(series: &JointSeries) -> Vec<f64> {
    let pairs = (1..series.len()).flat_map(|row| {
        let seconds = series.stamps_ns.get(row - 1..=row).map_or(f64::NAN, |w| {
            crate::time::seconds_between(w.first().copied().unwrap_or(0), w.last().copied().unwrap_or(0))
        });
        series.q_row(row - 1).iter().zip(series.q_row(row)).map(move |(a, b)| (b - a) / seconds)
    });
    pairs.filter(|slope| slope.is_finite()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_topic_in_degrees_is_put_into_radians_with_its_velocities() {
        let row = |i: u64| (i as f64 * 0.01).sin();
        let rate = |i: u64| (i as f64 * 0.01).cos() * 10.0;
        let good = JointSeries {
            stamps_ns: (0..500).map(|i| i * 1_000_000).collect(),
            dof: 1,
            q: (0..500).map(row).collect(),
            dq: (0..500).map(rate).collect(),
            tau: vec![],
        };
        let degrees = |series: &JointSeries| JointSeries {
            q: series.q.iter().map(|q| q.to_degrees()).collect(),
            dq: series.dq.iter().map(|dq| dq.to_degrees()).collect(),
            ..series.clone()
        };
        let near = |series: &JointSeries| {
            series.q.iter().zip(&good.q).all(|(a, b)| (a - b).abs() < 1e-12)
                && series.dq.iter().zip(&good.dq).all(|(a, b)| (a - b).abs() < 1e-12)
        };
        let (mut desired, mut measured) = (good.clone(), degrees(&good));
        assert!(against_each_other(&mut desired, &mut measured).is_some_and(|told| told.contains("measured")));
        assert!(near(&measured) && desired == good);
        // Velocities that were in radians all along stay.
        let (mut desired, mut measured) = (JointSeries { dq: good.dq.clone(), ..degrees(&good) }, good.clone());
        assert!(against_each_other(&mut desired, &mut measured).is_some_and(|told| told.contains("desired")));
        assert!(near(&desired));
        let (mut desired, mut measured) = (good.clone(), good.clone());
        assert_eq!(against_each_other(&mut desired, &mut measured), None);
    }

    #[test]
    fn commands_that_were_divided_once_too_often_are_not_mended_on_the_measured_side() {
        let wave = |size: f64| JointSeries {
            stamps_ns: (0..500).map(|i| i * 1_000_000).collect(),
            dof: 1,
            q: (0..500).map(|i| size * (f64::from(i) * 0.01).sin()).collect(),
            dq: (0..500).map(|i| 10.0 * size * (f64::from(i) * 0.01).cos()).collect(),
            tau: vec![],
        };
        let (mut desired, mut measured) = (wave(1f64.to_radians()), wave(1.0));
        let told = against_each_other(&mut desired, &mut measured).expect("a sentence");
        assert!(told.contains("the desired ones were divided by 57.3 once too often"), "{told}");
        assert_eq!((desired, measured), (wave(1f64.to_radians()), wave(1.0)));
        // Small angles in degrees are known by velocities in radians.
        let (mut desired, mut measured) =
            (wave(0.05), JointSeries { q: wave(0.05).q.iter().map(|q| q.to_degrees()).collect(), ..wave(0.05) });
        assert!(
            against_each_other(&mut desired, &mut measured).is_some_and(|told| told.contains("in degrees and was put"))
        );
        assert!(measured.q.iter().zip(&desired.q).all(|(a, b)| (a - b).abs() < 1e-12));
    }
}
