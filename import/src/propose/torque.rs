//! Whether a log's torques hold gravity: the format says so, or the nominal model's gravity shows in them or does not.

use super::Notes;
use super::track::Track;
use crate::clip::Gravity;
use crate::log::Log;
use crate::mapping::{JointColumns, Torque};

/// Rows that are compared.
const MOST_ROWS: usize = 500;
/// Share of the model's gravity that shows in the torques: all of it, or none.
const ALL: std::ops::Range<f64> = 0.6..1.5;
const NONE: std::ops::Range<f64> = -0.35..0.35;
/// Below this a model has no gravity to compare with [N m].
const LEAST: f64 = 0.5;

/// Proposes which torque the log holds.
pub(super) fn which(
    log: &Log,
    track: &Track,
    (columns, gravity): (&mut JointColumns, Option<Gravity>),
    notes: &mut Notes,
) {
    let line = "measured.torque";
    if let Some((with_gravity, why)) = log.facts.torque {
        columns.torque = if with_gravity { Torque::WithGravity } else { Torque::WithoutGravity };
        notes.why(line, why);
        return;
    }
    let share = gravity.as_ref().and_then(|gravity| share(track, gravity));
    match share {
        Some(share) if ALL.contains(&share) => {
            columns.torque = Torque::WithGravity;
            notes.why(line, format!("{:.0} % of the model's gravity shows in them", share * 100.0));
        }
        Some(share) if NONE.contains(&share) => {
            columns.torque = Torque::WithoutGravity;
            notes.why(line, format!("{:.0} % of the model's gravity shows in them: it was taken off", share * 100.0));
        }
        Some(share) => notes.why(
            line,
            format!("{:.0} % of the model's gravity shows in them, neither all nor none: they are left out, unless this says \
                     with_gravity or without_gravity", share * 100.0),
        ),
        None => notes.why(
            line,
            "no model is known that could tell whether they hold gravity: they are left out, unless this says with_gravity or \
             without_gravity",
        ),
    }
}

/// What an arm was told beside its gravity: known of a Franka alone.
pub(super) fn desired(log: &Log, columns: &mut JointColumns, notes: &mut Notes) {
    if log.facts.franka && log.facts.torque.is_some() {
        columns.torque = Torque::WithoutGravity;
        notes.why("desired.torque", "a Franka's tau_J_d holds no gravity");
    } else {
        notes.why("desired.torque", "nobody knows what they hold: they are left out, unless this says without_gravity");
    }
}

/// Share of the model's gravity in the torques, over all joints, by least squares.
fn share(track: &Track, gravity: &Gravity) -> Option<f64> {
    let every = (track.t.len() / MOST_ROWS).max(1);
    let rows: Vec<(Vec<f64>, Vec<f64>)> = (0..track.t.len())
        .step_by(every)
        .filter_map(|row| {
            let q: Vec<f64> = track.q.iter().map(|column| column[row]).collect();
            let tau: Vec<f64> = track.tau.iter().map(|column| column[row]).collect();
            let g = gravity(&q)?;
            (tau.iter().all(|v| v.is_finite()) && g.len() == tau.len()).then_some((g, tau))
        })
        .collect();
    let (mut product, mut square) = (0.0, 0.0);
    for (g, tau) in &rows {
        for (g, tau) in g.iter().zip(tau) {
            product += g * tau;
            square += g * g;
        }
    }
    let mean = (square / rows.len().max(1) as f64).sqrt();
    (rows.len() > 10 && mean > LEAST).then_some(product / square)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gravity_shows_or_was_taken_off_and_without_a_model_nobody_knows() {
        let pull = |q: f64| 20.0 * q.cos();
        let t: Vec<f64> = (0..1000).map(|i| f64::from(i) * 1e-2).collect();
        let q: Vec<f64> = t.iter().map(|t| (0.7 * t).sin()).collect();
        let rest: Vec<f64> = t.iter().map(|t| 2.0 * (3.0 * t).sin()).collect();
        for (share, expected) in [(1.0, Torque::WithGravity), (0.0, Torque::WithoutGravity), (0.5, Torque::NotKnown)] {
            let tau = q.iter().zip(&rest).map(|(q, rest)| share * pull(*q) + rest).collect();
            let track = Track { t: t.clone(), q: vec![q.clone()], dq: vec![], tau: vec![tau] };
            let model: Gravity = Box::new(move |q: &[f64]| Some(q.iter().map(|q| pull(*q)).collect()));
            let mut columns = JointColumns::default();
            which(&Log::default(), &track, (&mut columns, Some(model)), &mut Notes::default());
            assert_eq!(columns.torque, expected, "{share}");
            let (mut columns, mut notes) = (JointColumns::default(), Notes::default());
            which(&Log::default(), &track, (&mut columns, None), &mut notes);
            assert!(columns.torque == Torque::NotKnown && notes.0[0].why.contains("no model"), "{:?}", notes.0);
        }
    }
}
