//! What the tests share: the motion in the fixtures, and an import of one of them.

use import::{Arm, ImportError, Order, Outcome, import};
use shared_mem::cell::{Cell, ClipEntry};
use shared_mem::recording::{Clip, Session};
use std::path::{Path, PathBuf};

/// Numbers that were written with all their digits.
pub(crate) const EXACT: f64 = 1e-12;
pub(crate) const ROWS: usize = 60;
pub(crate) const LAG: f64 = 0.03;
pub(crate) const STEP_NS: u64 = 20_000_000;

/// Position [rad] and velocity [rad/s] of joint `i` in row `k`, as make_fixtures.py writes them.
pub(crate) fn motion(k: usize, i: usize, lag: f64) -> (f64, f64) {
    let w = std::f64::consts::TAU * (0.8 + 0.1 * i as f64);
    let t = k as f64 * 0.02 - lag;
    (0.2 * (w * t).sin() + 0.1 * i as f64, 0.2 * w * (w * t).cos())
}

pub(crate) fn fixture(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures").join(name)
}

/// Copies a log, be it a file or a folder.
pub(crate) fn copy(from: &Path, to: &Path) {
    if from.is_dir() {
        std::fs::create_dir_all(to).expect("room");
        for entry in std::fs::read_dir(from).expect("a folder") {
            let path = entry.expect("an entry").path();
            copy(&path, &to.join(path.file_name().expect("a name")));
        }
    } else {
        std::fs::copy(from, to).expect("room");
    }
}

/// An array of one dimension as a `.npy` file.
pub(crate) fn npy(descr: &str, count: usize, data: &[u8]) -> Vec<u8> {
    let header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({count},), }}\n");
    [b"\x93NUMPY\x01\x00", &(header.len() as u16).to_le_bytes()[..], header.as_bytes(), data].concat()
}

pub(crate) fn no_model(_: &Cell, _: Option<&str>) -> Result<Option<Arm>, String> {
    Ok(None)
}

pub(crate) fn order<'a>(files: &'a [PathBuf], out: &'a Path, questions: &'a Path) -> Order<'a> {
    Order {
        questions,
        files,
        out,
        mapping: None,
        cell: None,
        force: false,
        arms: &no_model,
        command: &|mapping| format!("calibration import ... --mapping {}", mapping.display()),
    }
}

/// Imports with everything proposed; questions go beside the session.
pub(crate) fn run(file: &Path, out: &Path) -> Result<Outcome, ImportError> {
    import(order(&[file.to_owned()], out, &out.with_extension("toml")), |_, _| {})
}

/// The session that comes of a fixture, in a folder that is gone with it.
pub(crate) struct Imported {
    pub(crate) folder: tempfile::TempDir,
    pub(crate) outcome: Outcome,
    pub(crate) session: Session,
}

pub(crate) fn imported(name: &str) -> Imported {
    let folder = tempfile::tempdir().expect("a folder");
    let out = folder.path().join("session");
    let outcome = run(&fixture(name), &out).unwrap_or_else(|e| panic!("{name}: {e}"));
    assert!(matches!(outcome, Outcome::Done { .. }), "{name}: {outcome:?}");
    let session = Session::open(&out).unwrap_or_else(|e| panic!("{name}: {e}"));
    Imported { folder, outcome, session }
}

/// What came of a log.
pub(crate) struct Read {
    /// How many clips, and the first of them.
    pub(crate) clips: usize,
    pub(crate) clip: Clip,
    /// What was odd in any of them.
    pub(crate) warnings: Vec<String>,
    /// What was left out of the folder.
    pub(crate) left_out: Vec<String>,
}

/// Imports a log into a session beside it that is gone afterwards.
pub(crate) fn read(log: &Path) -> Read {
    let out = log.with_file_name("session");
    let outcome = run(log, &out).unwrap_or_else(|e| panic!("{e}"));
    let Outcome::Done { clips, notes } = outcome else { panic!("{}: {outcome:?}", log.display()) };
    let session = Session::open(&out).expect("a session");
    let clip = session.read(&session.clips[0]).expect("a clip");
    std::fs::remove_dir_all(&out).expect("a folder of ours");
    Read {
        clips: clips.len(),
        clip,
        warnings: clips.into_iter().flat_map(|clip| clip.warnings).collect(),
        left_out: notes.into_iter().filter(|note| note.line == "left out").map(|note| note.why).collect(),
    }
}

impl Imported {
    pub(crate) fn clip(&self, number: usize) -> Clip {
        let entry: &ClipEntry = &self.session.clips[number];
        self.session.read(entry).expect("a clip")
    }

    /// The reason of a line of the mapping.
    pub(crate) fn why(&self, line: &str) -> String {
        let (Outcome::Done { notes, .. } | Outcome::Open { notes, .. }) = &self.outcome;
        notes.iter().filter(|note| note.line == line).map(|note| note.why.as_str()).collect()
    }
}

/// Holds a clip against the motion: `rows` from the fixture's row `first` on, joints in the fixture's order.
pub(crate) fn holds_the_motion(clip: &Clip, (first, rows): (usize, usize), dof: usize, near: f64) {
    for (series, lag) in [(&clip.measured, LAG), (&clip.desired, 0.0)] {
        assert_eq!((series.len(), series.dof), (rows, dof));
        for row in 0..rows {
            assert_eq!(series.stamps_ns[row] - series.stamps_ns[0], row as u64 * STEP_NS);
            for (i, q) in series.q_row(row).iter().enumerate() {
                let (expected, velocity) = motion(first + row, i, lag);
                assert!((q - expected).abs() <= near, "row {row}, joint {i}: {q} for {expected}");
                if let Some(dq) = series.dq_row(row) {
                    let (dq, near) = (dq[i], near * 30.0);
                    assert!((dq - velocity).abs() <= near, "row {row}, joint {i}: {dq} for {velocity}");
                }
            }
        }
    }
}

/// Holds what is left of a clip against the motion: rows from the first on, of commands perhaps one more or less.
pub(crate) fn holds_the_motion_from(clip: &Clip, rows: usize, near: f64) {
    assert_eq!(clip.measured.len(), rows);
    assert!(clip.desired.len().abs_diff(rows) <= 1, "{} commands", clip.desired.len());
    for (series, lag) in [(&clip.measured, LAG), (&clip.desired, 0.0)] {
        for row in 0..series.len() {
            for (i, q) in series.q_row(row).iter().enumerate() {
                assert!((q - motion(row, i, lag).0).abs() <= near, "row {row}, joint {i}: {q}");
            }
        }
    }
}
