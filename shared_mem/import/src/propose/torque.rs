//! Whether a log's torques are measured and hold gravity: the format says so, or the weight that is fitted to them does.

use super::Notes;
use super::track::Track;
use crate::clip::{Gravity, still};
use crate::log::{Log, Table};
use crate::mapping::{JointColumns, Torque};
use crate::weight::{self, Finding, Moment, Weight};

/// Moments that are compared.
const MOMENTS: usize = 600;
/// Half the time over which velocities and accelerations are taken [s].
const HALF: f64 = 0.04;
/// What a person can do where the log does not tell.
const UNLESS: &str = "they are left out, unless this says with_gravity or without_gravity";

/// Leaves out torques that nobody measured: `line` is the block's.
pub(super) fn measured_at_all(table: &Table, columns: &mut JointColumns, line: &str, notes: &mut Notes) {
    let tau: Vec<&[f64]> =
        columns.tau.iter().filter_map(|name| table.column(name)).map(|column| column.values.as_slice()).collect();
    if let Some(what) = still(&tau) {
        columns.tau.clear();
        notes.why(&format!("{line}.tau"), format!("no torques: {what}"));
    }
}

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
    let Some(gravity) = gravity else {
        notes.why(line, format!("no model is known that could tell whether they hold gravity: {UNLESS}"));
        return;
    };
    if let Some(why) = unmeasured(track) {
        columns.torque = Torque::NotKnown;
        notes.why(line, format!("{why}: {UNLESS}"));
        return;
    }
    let Some(weight) = Weight::of(&moments(track, &gravity)) else {
        notes.why(
            line,
            format!(
                "too few rows hold positions and torques of all joints to tell whether they hold gravity: {UNLESS}"
            ),
        );
        return;
    };
    let (torque, why) = meant(&weight, gravity.falls);
    columns.torque = torque;
    notes.why(line, why);
}

/// Joints whose torques nobody measured, beside others.
fn unmeasured(track: &Track) -> Option<String> {
    let joints: Vec<usize> = (0..track.tau.len()).filter(|joint| still(&[&track.tau[*joint]]).is_some()).collect();
    let who = match joints.len() {
        0 => return None,
        1 => format!("the torque of {} holds", numbered(&joints)),
        _ => format!("the torques of {} each hold", numbered(&joints)),
    };
    Some(format!("{who} one or two numbers in all rows, which no joint measures"))
}

/// Joints by their numbers from 1.
fn numbered(joints: &[usize]) -> String {
    let numbers: Vec<String> = joints.iter().map(|joint| (joint + 1).to_string()).collect();
    format!("{} {}", if joints.len() == 1 { "joint" } else { "joints" }, numbers.join(", "))
}

/// Which torque it is by the weight in it, and why.
fn meant(weight: &Weight, falls: [f64; 3]) -> (Torque, String) {
    // Without the sign of a 0.
    let percent = |share: f64| format!("{:.0} %", (share * 100.0).round() + 0.0);
    match weight.finding(falls) {
        Finding::Whole(share) => {
            (Torque::WithGravity, format!("{} of the model's gravity shows in them", percent(share)))
        }
        Finding::Elsewhere => (
            Torque::WithGravity,
            format!(
                "they hold the arm's weight, which pulls {}, and not as in the model: the base is mounted another way than the \
                 model stands{}. Nothing is added; turn the base in the URDF by a fixed joint between its root link and the base",
                weight.in_words(),
                weight.doubt(falls)
            ),
        ),
        Finding::Absent(share) => {
            let why = format!(
                "{} of the model's gravity shows in them (95 % within {}), and no weight along any other axis of the base: it was \
                 taken off",
                percent(share),
                percent(weight.share(falls)[1])
            );
            (Torque::WithoutGravity, why)
        }
        Finding::Noise => (
            Torque::NotKnown,
            format!(
                "nothing in them goes with the motion, neither weight nor friction nor inertia: they are not what moves this arm, \
                 and {UNLESS}"
            ),
        ),
        Finding::Turned(_, factor) => {
            let turned: Vec<usize> = weight.turned(falls).into_iter().map(|(joint, _)| joint).collect();
            let (who, its) = match turned.len() {
                1 => (format!("the torque of {} is", numbered(&turned)), "it is counted"),
                _ => (format!("the torques of {} are", numbered(&turned)), "they are counted"),
            };
            let why = format!(
                "{who} {factor:.2} times what holds the model's weight, which others hold: {its} the other way round. Turn the \
                 sign by a negative `tau_factor`; until then {UNLESS}"
            );
            (Torque::NotKnown, why)
        }
        Finding::Scaled(joint, factor) => {
            let who =
                joint.map_or_else(|| "they are".to_owned(), |joint| format!("the torque of joint {} is", joint + 1));
            let why = format!(
                "{who} {} times what holds the model's weight: {}. Give `tau_factor`; until then {UNLESS}",
                significant(factor),
                weight::meaning(factor)
            );
            (Torque::NotKnown, why)
        }
        Finding::Partly(share) => {
            let some = (share - 1.0).abs() < HALF_OF_IT;
            let not = if some { "but not in those of all joints" } else { "neither all nor none" };
            (Torque::NotKnown, format!("{} of the model's gravity shows in them, {not}: {UNLESS}", percent(share)))
        }
        Finding::NotTold => {
            (Torque::NotKnown, format!("this motion does not tell how much of the arm's weight they hold: {UNLESS}"))
        }
    }
}

/// A share of the weight that is nearer to all of it than this is not between all and none [1].
const HALF_OF_IT: f64 = 0.4;

/// A factor with three digits that mean something.
fn significant(factor: f64) -> String {
    let digits = (2.0 - factor.abs().max(1e-9).log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{factor:.digits$}")
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

/// Moments at which all joints have position, velocity, acceleration and torque.
fn moments(track: &Track, gravity: &Gravity) -> Vec<Moment> {
    let track = &track.continuous();
    let every = (track.t.len() / MOMENTS).max(1);
    let rows: Vec<usize> =
        (0..track.t.len()).step_by(every).filter(|row| track.tau.iter().all(|tau| tau[*row].is_finite())).collect();
    let half = HALF.max(2.0 * track.step());
    let at = |offset: f64| {
        let times: Vec<f64> = rows.iter().map(|row| track.t[*row] + offset).collect();
        (0..track.q.len()).map(|joint| track.at(joint, &times)).collect::<Vec<_>>()
    };
    let [before, now, after] = [at(-half), at(0.0), at(half)];
    let moment = |(place, row): (usize, &usize)| {
        let [before, now, after] =
            [&before, &now, &after].map(|all| all.iter().map(|q| q[place]).collect::<Vec<f64>>());
        let of = |joint: usize| (before[joint], now[joint], after[joint]);
        let dq: Vec<f64> = (0..now.len()).map(of).map(|(a, _, c)| (c - a) / (2.0 * half)).collect();
        let ddq: Vec<f64> = (0..now.len()).map(of).map(|(a, b, c)| (c - 2.0 * b + a) / (half * half)).collect();
        let unit = |axis: usize| std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
        let holds = [0, 1, 2].map(|axis| (gravity.holds)(&now, unit(axis)));
        let [Some(x), Some(y), Some(z)] = holds else { return None };
        let tau = track.tau.iter().map(|tau| tau[*row]).collect();
        let motion = (gravity.moves)(&now, &dq, &ddq).unwrap_or_default();
        // Both ends of the log have no velocity.
        ddq.iter().all(|v| v.is_finite()).then_some(Moment { tau, holds: [x, y, z], motion, dq, ddq })
    };
    rows.iter().enumerate().filter_map(moment).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log::Column;

    const INERTIA: [f64; 2] = [0.9, 0.2];

    /// Two joints that lean about the base's y, one on the other: first moments of mass [kg m].
    fn model() -> Gravity {
        let holds = |q: &[f64], a: [f64; 3]| {
            let [first, second] = [q[0], q[0] + q[1]].map(|lean| (lean.sin(), lean.cos()));
            let pull = |(sin, cos): (f64, f64)| -(cos * a[0] - sin * a[2]);
            Some(vec![2.0 * pull(first) + 0.8 * pull(second), 0.8 * pull(second)])
        };
        // Two links that turn about one axis each, without coupling.
        let moves = |_: &[f64], _: &[f64], ddq: &[f64]| Some(vec![INERTIA[0] * ddq[0], INERTIA[1] * ddq[1]]);
        Gravity { falls: [0.0, 0.0, -9.81], holds: Box::new(holds), moves: Box::new(moves) }
    }

    fn proposed(change: impl Fn(&[f64], &Gravity) -> Vec<f64>) -> (Torque, String) {
        proposed_of(change, 0.3)
    }

    /// `dry`: friction [N m].
    fn proposed_of(change: impl Fn(&[f64], &Gravity) -> Vec<f64>, dry: f64) -> (Torque, String) {
        let t: Vec<f64> = (0..1500).map(|i| f64::from(i) * 1e-2).collect();
        let wave = |w: f64| t.iter().map(|t| 1.1 * (w * t).sin()).collect::<Vec<f64>>();
        let q = vec![wave(0.7), wave(1.3)];
        let rows: Vec<Vec<f64>> = (0..t.len()).map(|row| change(&[q[0][row], q[1][row]], &model())).collect();
        // Dry friction.
        let friction = |joint: usize, row: usize| {
            dry * [0.7, 1.3].map(|w| (w * t[row]).cos()).map(|c| c.signum() + 0.1 * c)[joint]
        };
        let tau = |joint: usize| (0..t.len()).map(|row| rows[row][joint] + friction(joint, row)).collect();
        let track = Track { tau: vec![tau(0), tau(1)], q, t, ..Track::default() };
        let (mut columns, mut notes) = (JointColumns::default(), Notes::default());
        which(&Log::default(), &track, (&mut columns, Some(model())), &mut notes);
        (columns.torque, notes.0[0].why.clone())
    }

    #[test]
    fn gravity_shows_or_was_taken_off_or_pulls_another_way() {
        let along = |falls: [f64; 3]| move |q: &[f64], model: &Gravity| (model.holds)(q, falls).expect("a model");
        for (falls, expected, said) in [
            ([0.0, 0.0, -9.81], Torque::WithGravity, "100 %"),
            ([9.81, 0.0, 0.0], Torque::WithGravity, "along +x of the base by 9.8"),
            ([0.0, 0.0, 0.0], Torque::WithoutGravity, "no weight along any other axis"),
            ([0.0, 0.0, -5.0], Torque::NotKnown, "neither all nor none"),
        ] {
            let (torque, why) = proposed(along(falls));
            assert!(torque == expected && why.contains(said), "{falls:?}: {torque:?}, {why}");
        }
    }

    #[test]
    fn a_turned_joint_and_a_missing_torque_constant_are_named_and_nothing_is_added() {
        let changed = |factors: [f64; 2]| {
            proposed(move |q, model| {
                let tau = model.torques(q).expect("a model");
                vec![factors[0] * tau[0], factors[1] * tau[1]]
            })
        };
        let (torque, why) = changed([1.0, -1.0]);
        assert!(
            torque == Torque::NotKnown && why.contains("torque of joint 2") && why.contains("other way round"),
            "{why}"
        );
        let (torque, why) = changed([20.0, 20.0]);
        assert!(torque == Torque::NotKnown && why.contains("torque constant"), "{why}");
    }

    #[test]
    fn noise_holds_no_gravity_that_was_taken_off_and_a_dead_joint_is_no_weight() {
        let noise = |row: usize| (row as f64 * 12.9898).sin() * 43_758.545;
        let count = std::cell::Cell::new(0);
        let next = || {
            count.set(count.get() + 1);
            0.05 * (noise(count.get()).fract())
        };
        let (torque, why) = proposed_of(|_, _| vec![next(), next()], 0.0);
        assert!(torque == Torque::NotKnown && why.contains("nothing in them goes with the motion"), "{why}");
        let (torque, why) = proposed_of(|q, model| vec![model.torques(q).expect("a model")[0], 0.0], 0.0);
        assert!(torque == Torque::NotKnown && why.contains("the torque of joint 2 holds one or two"), "{why}");
    }

    #[test]
    fn without_a_model_nobody_knows() {
        let (mut columns, mut notes) = (JointColumns::default(), Notes::default());
        which(&Log::default(), &Track::default(), (&mut columns, None), &mut notes);
        assert!(columns.torque == Torque::NotKnown && notes.0[0].why.contains("no model"), "{:?}", notes.0);
    }

    #[test]
    fn columns_of_one_number_are_no_torques() {
        let table = |of: &dyn Fn(usize) -> f64| Table {
            columns: ["a", "b"].map(|name| Column { name: name.into(), values: (0..300).map(of).collect() }).into(),
            ..Table::default()
        };
        for (of, said) in [
            (&(|_| 0.0) as &dyn Fn(usize) -> f64, Some("0 in all 300 rows")),
            (&|_| f64::NAN, Some("no row holds a number")),
            (&|row| if row % 7 == 0 { 0.1 } else { -0.1 }, Some("one or two numbers")),
            (&|row| row as f64, None),
        ] {
            let mut columns = JointColumns { tau: vec!["a".into(), "b".into()], ..JointColumns::default() };
            let mut notes = Notes::default();
            measured_at_all(&table(of), &mut columns, "measured", &mut notes);
            assert_eq!(columns.tau.is_empty(), said.is_some());
            assert!(said.is_none_or(|said| notes.0[0].why.contains(said)), "{:?}", notes.0);
        }
    }
}
