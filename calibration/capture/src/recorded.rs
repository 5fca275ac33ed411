//! A clip of the session as a motion to be played again: its desired positions, cycle by cycle, and where its object stood.
//! Base frame; m, rad, s.

use super::body::Body;
use super::pace::resampled;
use super::program::Standing;
use super::rate::RATE;
use super::session::number_of;
use shared_mem::cell::{ClipEntry, ClipKind};
use shared_mem::msg::joints_from;
use shared_mem::msg::motion::SetPoint;
use shared_mem::origin::Origin;
use shared_mem::recording::{Clip, JointSeries, Provenance, ReadError, Session};
use shared_mem::typed::Command;
use std::path::{Path, PathBuf};

/// What moves less is at rest [rad/s].
const MAX_STILL_SPEED: f64 = 1e-7;
/// Rows further apart than this leave open what was between them [cycles].
const MAX_ROW_GAP: f64 = 25.0;
/// A row counts as of a cycle when it is so near [cycles].
const MAX_CYCLE_OFFSET: f64 = 0.2;
/// Poses that say where the object stood before the motion.
const AVERAGED_POSES: usize = 20;

/// A clip cannot be played again.
#[derive(Debug, thiserror::Error)]
pub enum RepeatError {
    /// The session or the clip cannot be read.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// There is no such clip.
    #[error("{} has no clip {number} to repeat; it has {known}", folder.display())]
    Unknown {
        folder: PathBuf,
        /// The number asked for.
        number: usize,
        /// The clips there are.
        known: String,
    },
    /// The session knows no such object.
    #[error("{}: {what}", folder.display())]
    Object {
        folder: PathBuf,
        /// What stands in the way.
        what: String,
    },
    /// It is of the other kind.
    #[error("clip {number} {was}; repeat it with `{command}`")]
    Other {
        number: usize,
        /// What was done in it.
        was: &'static str,
        /// What repeats it.
        command: Command,
    },
    /// Its desired positions are no motion that can be played.
    #[error("{} cannot be repeated: {why}; repeat another clip", file.display())]
    Unfit { file: PathBuf, why: &'static str },
}

/// A motion as it was commanded.
#[derive(Debug, Clone, PartialEq)]
pub struct Repeated {
    /// Number of the clip.
    pub number: usize,
    /// One set point a control cycle; the first and the last are at rest.
    pub set_points: Vec<SetPoint>,
    /// Where the object stood before, in a clip with one.
    pub object: Option<Standing>,
}

/// Reads clip `number` of the session in `folder`, of the kind that is wanted, and of the object of this name where there are several.
///
/// # Errors
/// [`RepeatError`] with the clips there are, or why this one cannot be repeated.
pub fn read(
    folder: &Path,
    number: usize,
    (kind, object): (ClipKind, Option<&str>),
    body: &Body,
) -> Result<Repeated, RepeatError> {
    if !folder.join("cell.toml").exists() {
        return Err(RepeatError::Unknown { folder: folder.to_owned(), number, known: "none".into() });
    }
    let mut session = Session::open(folder)?;
    if let Some(name) = object {
        session.cell.about(name).map_err(|what| RepeatError::Object { folder: folder.to_owned(), what })?;
    }
    let Some(entry) = session.clips.iter().find(|clip| number_of(&clip.file) == Some(number)) else {
        let known = session.clips.iter().map(|clip| clip.file.display().to_string()).collect::<Vec<_>>().join(", ");
        return Err(RepeatError::Unknown { folder: folder.to_owned(), number, known });
    };
    let repeats = |verb: &str| {
        let command = Command::new("calibration capture").words(verb).option("--cell", &folder.join("cell.toml"));
        let arm = Provenance::of(&session).source().and_then(Origin::arm);
        let command = command.option("--out", folder).option_of("--arm", arm.as_deref().map(Path::new));
        command.words(&format!("--repeat {number}"))
    };
    match entry.kind {
        same if same == kind => {}
        ClipKind::Excitation => {
            return Err(RepeatError::Other { number, was: "moves the arm alone", command: repeats("excitation") });
        }
        ClipKind::ControlHitSlide => {
            return Err(RepeatError::Other { number, was: "is a stroke", command: repeats("control-hit-slide") });
        }
        ClipKind::FreeMotion => {
            return Err(RepeatError::Unfit { file: entry.file.clone(), why: "no arm moved in it" });
        }
    }
    of_entry(&session, entry, number, body)
}

fn of_entry(session: &Session, entry: &ClipEntry, number: usize, body: &Body) -> Result<Repeated, RepeatError> {
    let clip = session.read(entry)?;
    let clip =
        if clip.joint_names.len() == body.model().dof() { clip } else { clip.reorder(body.model().joint_names())? };
    let set_points = motion(&clip.desired).map_err(|why| RepeatError::Unfit { file: entry.file.clone(), why })?;
    Ok(Repeated { number, set_points, object: standing(&clip) })
}

/// The moving part of desired positions, from rest to rest, one set point a control cycle.
///
/// # Errors
/// Why it cannot be played.
pub fn motion(desired: &JointSeries) -> Result<Vec<SetPoint>, &'static str> {
    let count = desired.len();
    let row = |i: usize| {
        let dq = desired.dq_row(i).ok_or("it has no desired velocities")?;
        Ok(SetPoint { q_d: joints_from(desired.q_row(i)), dq_d: joints_from(dq) })
    };
    let rows = (0..count).map(row).collect::<Result<Vec<SetPoint>, &'static str>>()?;
    let moves = |point: &SetPoint| point.dq_d.iter().any(|dq| dq.abs() > MAX_STILL_SPEED);
    let (Some(first), Some(last)) = (rows.iter().position(moves), rows.iter().rposition(moves)) else {
        return Err("nothing moves in it");
    };
    if first == 0 || last + 1 == count {
        return Err("it does not begin and end at rest");
    }
    let times: Vec<f64> = (first - 1..=last + 1).map(|i| cycle(desired, first - 1, i)).collect();
    if times.windows(2).any(|w| w[1] - w[0] > MAX_ROW_GAP || w[1] <= w[0]) {
        return Err("too many of its rows are missing");
    }
    let mut points = resampled(&times, &rows[first - 1..=last + 1], 1.0);
    // The rows at the ends move by no more than what counts as rest.
    for end in [0, points.len() - 1] {
        points[end].dq_d = [0.0; shared_mem::msg::MAX_JOINTS];
    }
    Ok(points)
}

/// When a row was, from the row `first` on [cycles]: a whole number where the rows follow the control rate.
fn cycle(desired: &JointSeries, first: usize, row: usize) -> f64 {
    let cycles = (desired.stamps_ns[row] - desired.stamps_ns[first]) as f64 * 1e-9 * RATE;
    if (cycles - cycles.round()).abs() < MAX_CYCLE_OFFSET { cycles.round() } else { cycles }
}

/// Where a clip's object stood at its beginning.
fn standing(clip: &Clip) -> Option<Standing> {
    let poses = &clip.object.poses[..clip.object.len().min(AVERAGED_POSES)];
    let (count, first) = (poses.len() as f64, poses.first()?);
    let yaw = |pose: &shared_mem::frames::Pose<shared_mem::frames::Base, shared_mem::frames::Object>| {
        let (_, _, yaw) = pose.isometry().rotation.euler_angles();
        yaw
    };
    let turned = |pose| {
        let turn: f64 = yaw(pose) - yaw(first);
        turn.sin().atan2(turn.cos())
    };
    let mean = |value: &dyn Fn(usize) -> f64| (0..poses.len()).map(value).sum::<f64>() / count;
    let at = |k: usize| poses[k].isometry().translation.vector;
    Some(Standing { place: [mean(&|k| at(k).x), mean(&|k| at(k).y)], yaw: yaw(first) + mean(&|k| turned(&poses[k])) })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(rows: usize, skip: impl Fn(usize) -> bool) -> JointSeries {
        let mut series = JointSeries { dof: 2, ..JointSeries::default() };
        for i in (0..rows).filter(|i| !skip(*i)) {
            let u = (i as f64 - 100.0).clamp(0.0, 400.0) / 400.0;
            let [q, dq, ..] = super::super::jet::quintic(u, 1.0 / 0.4);
            // The clock of the machine that recorded jitters a little.
            series.stamps_ns.push(7_000_000_000 + i as u64 * 1_000_000 + (i as u64 * 37) % 90_000);
            series.q.extend([q, -0.5 * q]);
            series.dq.extend([dq, -0.5 * dq]);
        }
        series
    }

    #[test]
    fn the_moving_part_is_taken_from_rest_to_rest_with_every_cycle() {
        for skip in [|_: usize| false, |i: usize| (200..206).contains(&i)] {
            let points = motion(&series(700, skip)).expect("a motion");
            assert!((397..=401).contains(&points.len()), "{}", points.len());
            let ends = [&points[0], &points[points.len() - 1]];
            assert!(ends.iter().all(|end| end.dq_d == [0.0; 8]));
            assert!((ends[1].q_d[0] - 1.0).abs() < 1e-9 && (ends[1].q_d[1] + 0.5).abs() < 1e-9);
            let leaps = points.windows(2).map(|w| (w[1].q_d[0] - w[0].q_d[0]).abs()).fold(0.0, f64::max);
            assert!(leaps < 5e-3, "{leaps}");
        }
    }

    #[test]
    fn what_is_no_whole_motion_is_refused_with_the_reason() {
        let refused = |series: &JointSeries| motion(series).expect_err("refused");
        assert!(refused(&series(90, |_| false)).contains("nothing moves"));
        assert!(refused(&series(300, |_| false)).contains("at rest"));
        assert!(refused(&series(700, |i| (200..260).contains(&i))).contains("missing"));
        let silent = JointSeries { dq: Vec::new(), ..series(700, |_| false) };
        assert!(refused(&silent).contains("velocities"));
    }
}
