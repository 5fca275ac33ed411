//! The motions that an advice asks for of an arm that no bridge drives, planned within the limits of its cell and written as CSV: a
//! row a control cycle, time and the commanded position of each joint.

use crate::answer::diagnosis::NextMotion;
use capture::arm_motion::ArmMotion;
use capture::body::Body;
use capture::plan::plan;
use capture::rate::RATE;
use capture::request::Request;
use capture::{excitation, limits, pace};
use shared_mem::msg::motion::SetPoint;
use shared_mem::msg::{Joints, MAX_JOINTS, joints_from};
use shared_mem::output::{Destination, OutputError};
use shared_mem::recording::Session;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Files for one answer at most (a choice): eight clips differ as much as more would.
const MOTIONS_WRITTEN: usize = 8;

/// Plans the motions and writes each beside `answer`: `report_motion_1.csv` beside `report.html`. A file that is there already is
/// kept, and another number taken, unless `force`. What cannot be planned says why.
///
/// # Errors
/// [`OutputError`] when a file cannot be written.
pub fn write(motions: &mut Vec<NextMotion>, session: &Session, answer: &Path, force: bool) -> Result<(), OutputError> {
    let each = motions.iter().flat_map(|next| (0..next.motion.clips).map(|_| next.motion)).take(MOTIONS_WRITTEN);
    let mut written: Vec<NextMotion> = Vec::new();
    let mut number = 0;
    let planner = Planner::of(session);
    for (seed, motion) in each.enumerate() {
        let next = NextMotion::new(motion);
        let planned = match &planner {
            Ok(planner) => planner.plan(&motion, seed as u64).map(|set_points| csv(&planner.names, &set_points)),
            Err(why) => Err(why.clone()),
        };
        let next = match planned {
            Err(why) => NextMotion { why: Some(why), ..next },
            Ok(Csv { text, seconds }) => {
                let place = free(answer, &mut number, force)?;
                let file = Some(place.path().to_owned());
                place.write(text)?;
                NextMotion { file, seconds: Some(seconds), why: None, ..next }
            }
        };
        // What cannot be planned is said once.
        if next.file.is_some() || !written.contains(&next) {
            written.push(next);
        }
    }
    *motions = written;
    Ok(())
}

/// The next file beside the answer that is not there yet, or may be replaced.
fn free(answer: &Path, number: &mut usize, force: bool) -> Result<Destination, OutputError> {
    let stem = answer.file_stem().map_or_else(|| "next".to_owned(), |stem| stem.to_string_lossy().into_owned());
    loop {
        *number += 1;
        let file: PathBuf = answer.with_file_name(format!("{stem}_motion_{number}.csv"));
        if force || file.symlink_metadata().is_err() {
            return Destination::new(&file, force);
        }
    }
}

/// The arm of a session, and where it stands when a clip begins.
struct Planner {
    body: Body,
    limits: Vec<twin::arm::JointLimits>,
    floor: f64,
    start: Joints,
    names: Vec<String>,
}

impl Planner {
    /// A sentence where the arm is not known well enough.
    fn of(session: &Session) -> Result<Self, String> {
        let cell = &session.cell;
        let body = Body::of(cell).map_err(|error| error.to_string())?;
        let limits = limits::of(cell, &body);
        let floor = excitation::floor(cell).map_err(|error| error.to_string())?;
        let begin = |entry| {
            let clip = session.read(entry).ok()?;
            let q = clip.measured.q_row(0);
            (q.len() == limits.len()).then(|| joints_from(q))
        };
        let start = session.clips.iter().find_map(begin).ok_or("no clip says where the arm stands")?;
        let names = body.model().joint_names().to_vec();
        Ok(Self { body, limits, floor, start, names })
    }

    /// The motion of one clip.
    fn plan(&self, motion: &ArmMotion, seed: u64) -> Result<Vec<SetPoint>, String> {
        let (duration, amplitude) = motion.kind.usual();
        let request = Request {
            start: self.start,
            kind: motion.kind,
            moving: std::array::from_fn(|joint| joint < self.limits.len().min(MAX_JOINTS)),
            amplitude: motion.amplitude.unwrap_or(amplitude),
            duration,
            seed,
            floor: self.floor,
        };
        let plan = plan(&request, &self.limits, &self.body).map_err(|error| error.to_string())?;
        pace::paced(&plan.set_points, motion.speed, &self.limits, &self.body).map_err(|error| error.to_string())
    }
}

/// A motion as it is written.
struct Csv {
    text: String,
    /// How long it lasts.
    seconds: f64,
}

/// Time [s] and positions [rad], a row a control cycle; names and units in the first line.
fn csv(names: &[String], set_points: &[SetPoint]) -> Csv {
    // A name comes from a URDF, which may hold what ends a column.
    let plain = |c: char| if c.is_alphanumeric() || "_-./".contains(c) { c } else { '_' };
    let columns: Vec<String> =
        names.iter().map(|name| format!("q_d {} [rad]", name.chars().map(plain).collect::<String>())).collect();
    let mut text = format!("time [s],{}\n", columns.join(","));
    for (row, point) in set_points.iter().enumerate() {
        // Writing to a string does not fail.
        let _written = write!(text, "{:.3}", row as f64 / RATE);
        for q in point.q_d.iter().take(names.len()) {
            let _written = write!(text, ",{q:.7}");
        }
        text.push('\n');
    }
    Csv { text, seconds: set_points.len().saturating_sub(1) as f64 / RATE }
}

#[cfg(test)]
mod tests {
    use super::*;
    use capture::request::Kind;
    use shared_mem::cell::{Cell, ClipEntry, ClipKind};
    use shared_mem::msg::arm::ArmState;
    use shared_mem::recording::{ClipInfo, ClipWriter, SessionFiles};

    fn shipped() -> Cell {
        let text = include_str!("../../../../config/fr3_cell.toml");
        shared_mem::toml_file::parse(text, "fr3_cell.toml".as_ref()).expect("the shipped file")
    }

    /// A session of the shipped cell with one state of the arm at `q`.
    fn session(folder: &Path, q: Joints) -> Session {
        let cell = shipped();
        let mut writer = ClipWriter::create(&folder.join("a.mcap"), &ClipInfo::default()).expect("a new file");
        for row in 0..10 {
            let stamp_ns = 5_000_000_000 + row * 1_000_000;
            let state =
                ArmState { stamp_ns, device_ns: stamp_ns, cycle: row, dof: 7, q, q_d: q, ..ArmState::default() };
            writer.arm_state(&state).expect("room");
        }
        writer.finish().expect("room");
        let clips = vec![ClipEntry { file: "a.mcap".into(), kind: ClipKind::Excitation }];
        Session { folder: folder.to_owned(), cell, clips, files: SessionFiles::default() }
    }

    fn ready() -> Joints {
        *Body::of(&shipped()).expect("its arm").model().ready()
    }

    #[test]
    fn a_motion_is_written_with_names_units_and_rate_inside_the_limits_of_the_cell() {
        let folder = tempfile::tempdir().expect("a folder");
        let session = session(folder.path(), ready());
        let slow = ArmMotion { speed: 0.5, ..ArmMotion::of(Kind::Multisine, 2) };
        let mut motions = vec![NextMotion::new(slow)];
        std::fs::write(folder.path().join("report_motion_1.csv"), "mine").expect("room");
        write(&mut motions, &session, &folder.path().join("report.html"), false).expect("room");
        let files: Vec<_> = motions.iter().map(|next| next.file.clone().expect("a file")).collect();
        assert_eq!(files, [2, 3].map(|n| folder.path().join(format!("report_motion_{n}.csv"))));
        assert_eq!(std::fs::read_to_string(folder.path().join("report_motion_1.csv")).expect("text"), "mine");
        let texts: Vec<String> = files.iter().map(|file| std::fs::read_to_string(file).expect("text")).collect();
        assert_ne!(texts[0], texts[1], "two clips are two motions");
        let mut lines = texts[0].lines();
        let head: Vec<&str> = lines.next().expect("a head").split(',').collect();
        assert_eq!((head[0], head[1], head.len()), ("time [s]", "q_d fr3_joint1 [rad]", 8));
        let rows: Vec<Vec<f64>> =
            lines.map(|line| line.split(',').map(|n| n.parse().expect("a number")).collect()).collect();
        assert!((rows[1][0] - 1.0 / RATE).abs() < 1e-9 && (motions[0].seconds.expect("planned") - 16.0).abs() < 0.1);
        assert!(motions[0].in_words().contains("1000 rows a second"), "{}", motions[0].in_words());
        // It begins where the clips begin, goes somewhere, and breaks no limit of the cell.
        let body = Body::of(&session.cell).expect("its arm");
        let all = limits::of(&session.cell, &body);
        let reach = rows.iter().map(|row| (row[1] - ready()[0]).abs()).fold(0.0, f64::max);
        assert!((rows[0][1] - ready()[0]).abs() < 1e-6 && reach > 0.05, "{reach}");
        for row in &rows {
            let q = joints_from(&row[1..]);
            assert!(body.lowest_point(&q) >= excitation::floor(&session.cell).expect("a floor") - 1e-6);
            assert!(all.iter().zip(&row[1..]).all(|(limits, q)| (limits.q_min..=limits.q_max).contains(q)));
        }
        let speeds = rows.windows(2).map(|w| (w[1][1] - w[0][1]).abs() * RATE).fold(0.0, f64::max);
        assert!(speeds <= all[0].speed_bounds(ready()[0])[1], "{speeds}");
    }

    #[test]
    fn what_cannot_be_planned_says_why_once_and_leaves_no_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let session = session(folder.path(), [9.0; MAX_JOINTS]);
        let mut motions = vec![NextMotion::new(ArmMotion::of(Kind::Multisine, 3))];
        write(&mut motions, &session, &folder.path().join("d.json"), false).expect("nothing to write");
        assert!(motions.len() == 1 && motions[0].file.is_none(), "{motions:?}");
        assert!(motions[0].why.as_ref().is_some_and(|why| why.contains("outside the limits")), "{motions:?}");
        assert!(!folder.path().join("d_motion_1.csv").exists());
    }

    #[test]
    fn a_name_of_a_joint_ends_no_column() {
        let Csv { text, seconds } = csv(&["a,b\"\n".to_owned()], &[SetPoint { q_d: [0.5; 8], dq_d: [0.0; 8] }]);
        assert_eq!((text.as_str(), seconds), ("time [s],q_d a_b__ [rad]\n0.000,0.5000000\n", 0.0));
    }
}
