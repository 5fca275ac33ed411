//! A diagnosis that is cut short keeps what it has found, and ends where it would have ended without that.

use crate::arm_session::{cell, clips, hidden};
use calibration::diagnose::{Diagnosis, Options, diagnose, diagnose_kept};
use inference::interrupt::Interrupt;
use shared_mem::cell::{Cell, ClipEntry, ClipKind};
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::joints_from;
use shared_mem::recording::{Clip, ClipInfo, ClipWriter, Session};
use std::path::Path;
use std::time::Duration;

/// A recording of the clip.
fn record(path: &Path, clip: &Clip) {
    let mut writer = ClipWriter::create(path, &ClipInfo::default()).expect("a new file");
    for (row, stamp_ns) in clip.measured.stamps_ns.iter().copied().enumerate() {
        let of = |values: Option<&[f64]>| joints_from(values.unwrap_or(&[]));
        let state = ArmState {
            stamp_ns,
            device_ns: stamp_ns,
            cycle: row as u64,
            dof: 7,
            q: joints_from(clip.measured.q_row(row)),
            dq: of(clip.measured.dq_row(row)),
            q_d: joints_from(clip.desired.q_row(row)),
            dq_d: of(clip.desired.dq_row(row)),
            ..ArmState::default()
        };
        writer.arm_state(&state).expect("room");
    }
    writer.finish().expect("room");
}

/// A session of an arm whose gains are off and that has no effect.
fn session(folder: &Path) -> Session {
    let cell = cell();
    let mut listed = Cell { clips: Vec::new(), ..cell.clone() };
    for (number, clip) in clips(&cell, &hidden(&cell, 5), 4, 0.5, 5).iter().enumerate() {
        let file = format!("clip_{number:02}.mcap");
        record(&folder.join(&file), clip);
        listed.clips.push(ClipEntry { file: file.into(), kind: ClipKind::Excitation });
    }
    std::fs::write(folder.join("cell.toml"), listed.to_toml()).expect("room");
    Session::open(folder).expect("a session")
}

/// The answer, but for how long it took.
fn answer(found: &Diagnosis) -> String {
    serde_json::to_string(&Diagnosis { seconds: 0.0, ..found.clone() }).expect("JSON")
}

#[test]
fn a_diagnosis_that_was_cut_short_goes_on_to_the_same_answer() {
    let folder = tempfile::tempdir().expect("a folder");
    let session = session(folder.path());
    let whole = diagnose(&session, &Options::default(), &Interrupt::default()).expect("an answer");
    assert!(!whole.budget_spent && whole.theta.object.is_none() && whole.theta.arm.is_some(), "{whole:?}");
    let state = folder.path().join("d.json.state");
    let options = Options { out: Some(folder.path().join("d.json")), ..Options::default() };
    let mut cut_short = 0;
    for share in [0.3, 0.6] {
        let budget = Some(Duration::from_secs_f64(share * whole.seconds));
        let (cut, kept) = diagnose_kept(&session, &Options { budget, ..options.clone() }, &Interrupt::default())
            .expect("the best so far");
        if cut.budget_spent {
            assert!(cut.verdict.text.contains("budget"), "{}", cut.verdict.text);
            cut_short += 1;
            kept.save().expect("room");
        }
    }
    assert!(cut_short > 0 && state.is_file(), "it was never cut short");
    let resumed = diagnose(&session, &options, &Interrupt::default()).expect("an answer");
    assert_eq!(answer(&resumed), answer(&whole));
    assert!(!state.exists(), "an answer that is there needs no state");
    // Ctrl-C says how to go on.
    let interrupt = Interrupt::default();
    interrupt.ask();
    let line = diagnose(&session, &options, &interrupt).expect_err("interrupted").to_string();
    assert!(line.starts_with("interrupted") && line.lines().count() == 1, "{line}");
}
