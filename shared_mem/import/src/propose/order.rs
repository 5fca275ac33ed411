//! Which desired joint goes with which measured one, and with which sign, where their names do not tell: each measured joint
//! is near one of the commands.

use super::Notes;
use super::track::{Track, rms};
use crate::mapping::JointColumns;

/// A joint that is no farther than this from the command in its place follows that one [rad].
const NEAR: f64 = 0.02;
/// Another command is a joint's own where it is nearer by this factor.
const NEARER: f64 = 0.4;

/// Puts the desired columns into the measured joints' order, with signs, where the data say clearly that they stand in another.
pub(super) fn match_up(measured: &Track, desired: &Track, columns: &mut JointColumns, notes: &mut Notes) {
    let count = measured.q.len().min(desired.q.len());
    let told: Vec<Vec<f64>> = (0..count).map(|joint| desired.at(joint, &measured.t)).collect();
    // How far a joint is from a command, or from its opposite [rad].
    let apart = |did: usize, told_at: usize, sign: f64| {
        let differences: Vec<f64> = measured.q[did].iter().zip(&told[told_at]).map(|(q, q_d)| q - sign * q_d).collect();
        rms(differences.iter())
    };
    let mut order: Vec<usize> = (0..count).collect();
    let mut sign = vec![1.0; count];
    for did in 0..count {
        let own = apart(did, did, 1.0);
        let all = (0..count).flat_map(|told| [(told, 1.0), (told, -1.0)]);
        let best = all.map(|(told, sign)| (apart(did, told, sign), told, sign)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((distance, told, turned)) = best
            && own > NEAR
            && distance < NEARER * own
        {
            order[did] = told;
            sign[did] = turned;
        }
    }
    let mut sorted = order.clone();
    sorted.sort_unstable();
    let is_order = sorted.iter().copied().eq(0..count);
    if is_order && order.iter().copied().ne(0..count) {
        let pick = |list: &[String]| order.iter().filter_map(|i| list.get(*i)).cloned().collect::<Vec<_>>();
        for list in [&mut columns.q, &mut columns.dq, &mut columns.tau] {
            if !list.is_empty() {
                *list = pick(list);
            }
        }
        notes.why(
            "desired.q",
            "put into the order of the measured joints: each is near the command that now stands in its place",
        );
    } else if order.iter().copied().ne(0..count) {
        notes.why(
            "desired.q",
            "some measured joints are nearer to other commands than those in their place: check the order",
        );
        return;
    }
    let turned: Vec<String> = (0..count).filter(|i| sign[*i] < 0.0).map(|i| (i + 1).to_string()).collect();
    if !turned.is_empty() {
        columns.sign = sign;
        notes.why(
            "desired.sign",
            format!("joint {} moves against its command, the others with theirs", turned.join(", ")),
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_in_another_order_and_with_another_sign_are_found() {
        let t: Vec<f64> = (0..3000).map(|i| f64::from(i) * 1e-3).collect();
        let wave = |w: f64, s: f64| t.iter().map(|t| s * (w * t).sin()).collect::<Vec<f64>>();
        let measured =
            Track { t: t.clone(), q: vec![wave(2.0, 1.0), wave(3.1, 1.0), wave(4.7, 1.0)], ..Track::default() };
        let desired = Track { q: vec![wave(3.1, -1.0), wave(2.0, 1.0), wave(4.7, 1.0)], ..measured.clone() };
        let mut columns = JointColumns { q: vec!["b".into(), "a".into(), "c".into()], ..JointColumns::default() };
        let mut notes = Notes::default();
        match_up(&measured, &desired, &mut columns, &mut notes);
        assert_eq!((columns.q, columns.sign), (vec!["a".into(), "b".into(), "c".into()], vec![1.0, -1.0, 1.0]));
        assert_eq!(notes.0.len(), 2, "{:?}", notes.0);
        let mut same = JointColumns { q: vec!["a".into(), "b".into(), "c".into()], ..JointColumns::default() };
        match_up(&measured, &measured, &mut same, &mut notes);
        assert!(same.sign.is_empty() && same.q == ["a", "b", "c"]);
    }
}
