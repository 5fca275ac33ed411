//! Joint angles that jump by a whole turn, because an encoder or a driver keeps them within one.

use crate::recording::series::JointSeries;
use std::f64::consts::TAU;

/// How near to a whole turn a step must come to be one [rad]: more than any joint moves between two samples.
const NEAR: f64 = 0.5;

/// Takes the jumps out of the positions; rows whose velocity was computed across one are left out.
pub(super) fn unwrap(mut series: JointSeries, topic: &str, warnings: &mut Vec<String>) -> JointSeries {
    let (dof, rows) = (series.dof, series.len());
    let mut wrapped: Vec<(usize, usize)> = Vec::new();
    for joint in 0..dof {
        let mut turns = 0.0;
        let mut before: Option<f64> = None;
        for (row, q) in series.q.iter_mut().skip(joint).step_by(dof).enumerate() {
            let step = before.map_or(0.0, |before| *q - before);
            before = Some(*q);
            if (step.abs() - TAU).abs() < NEAR {
                turns -= step.signum();
                wrapped.push((row, joint));
            }
            *q += turns * TAU;
        }
    }
    if wrapped.is_empty() {
        return series;
    }
    let spoilt: Vec<usize> = wrapped.iter().filter_map(|&at| spoilt_row(&series, at)).collect();
    warnings.push(format!(
        "`{topic}`: joint positions jump by a whole turn {} times; the jumps were taken out and {} rows whose velocity \
         was computed across one left out",
        wrapped.len(),
        spoilt.len()
    ));
    let kept: Vec<usize> = (0..rows).filter(|row| !spoilt.contains(row)).collect();
    series.select_rows(&kept)
}

/// Puts commands into the turn of the joint that follows them, where they are whole turns away in all rows.
pub(in super::super) fn same_turn(desired: &mut JointSeries, measured: &JointSeries) -> Option<String> {
    let dof = desired.dof;
    if dof == 0 || measured.dof != dof || measured.is_empty() {
        return None;
    }
    let turns_away = |joint: usize| {
        let turns = desired.stamps_ns.iter().enumerate().map(|(row, stamp)| {
            let near = measured.stamps_ns.partition_point(|other| other < stamp).min(measured.len() - 1);
            let apart = desired.q[row * dof + joint] - measured.q[near * dof + joint];
            let turns = (apart / TAU).round();
            ((apart - turns * TAU).abs() < NEAR).then_some(turns)
        });
        let mut turns = turns.collect::<Option<Vec<f64>>>()?;
        turns.dedup();
        (turns.len() == 1).then(|| turns[0])
    };
    // Where any joint is elsewhere, in degrees or out of order, none is known to be turns away.
    let turns: Vec<f64> = (0..dof).map(turns_away).collect::<Option<_>>()?;
    let away: Vec<(usize, f64)> = turns.into_iter().enumerate().filter(|(_, turns)| *turns != 0.0).collect();
    for (joint, turns) in &away {
        desired.q.iter_mut().skip(*joint).step_by(dof).for_each(|q| *q -= turns * TAU);
    }
    let joints: Vec<String> = away.iter().map(|(joint, _)| (joint + 1).to_string()).collect();
    (!away.is_empty()).then(|| {
        format!(
            "commands of joint {} lay whole turns from the measured positions and were put beside them",
            joints.join(", ")
        )
    })
}

/// The row, when its velocity is more than half of what a turn between two samples makes.
fn spoilt_row(series: &JointSeries, (row, joint): (usize, usize)) -> Option<usize> {
    let before = series.stamps_ns.get(row.checked_sub(1)?)?;
    let seconds = crate::time::seconds_between(*before, *series.stamps_ns.get(row)?);
    let dq = series.dq_row(row)?.get(joint)?;
    (dq.abs() * seconds > 0.5 * TAU).then_some(row)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turning_joint_stays_continuous_and_its_velocity_spike_is_left_out() {
        let n = 40;
        let true_q = |i: usize| 0.3 * i as f64;
        let wrap = |q: f64| (q + TAU / 2.0).rem_euclid(TAU) - TAU / 2.0;
        let q: Vec<f64> = (0..n).map(|i| wrap(true_q(i))).collect();
        let dq = (0..n).map(|i| if i == 0 { 3.0 } else { (q[i] - q[i - 1]) / 0.1 }).collect();
        let stamps_ns = (0..n as u64).map(|i| i * 100_000_000).collect();
        let series = JointSeries { stamps_ns, dof: 1, q, dq, tau: vec![] };
        let mut warnings = Vec::new();
        let series = unwrap(series, "/q", &mut warnings);
        assert_eq!(series.len(), n - 2, "two jumps in 12 rad");
        assert!(series.q.windows(2).all(|w| (0.29..0.61).contains(&(w[1] - w[0]))), "{:?}", series.q);
        assert!(series.dq.iter().all(|v| (v - 3.0).abs() < 1e-9));
        let mut desired = series.clone();
        desired.q.iter_mut().for_each(|q| *q += 0.1 - TAU);
        let said = same_turn(&mut desired, &series).expect("a warning");
        assert!(said.contains("joint 1"), "{said}");
        assert!(desired.q.iter().zip(&series.q).all(|(a, b)| (a - b - 0.1).abs() < 1e-9));
        assert_eq!(same_turn(&mut desired, &series), None);
        assert!(warnings[0].contains("2 times") && warnings[0].contains("2 rows"), "{warnings:?}");
    }
}
