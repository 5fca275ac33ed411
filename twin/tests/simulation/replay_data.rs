//! Replays recorded sessions that are not part of the project: `TWINALIGN_DATA=<folder> cargo test --release -p twin
//! --test simulation replay_data -- --ignored`. The folder holds `gap_dev/` (made by another engine) and `real/`.

use shared_mem::recording::Session;
use shared_mem::theta::{ArmTheta, Theta};
use std::path::{Path, PathBuf};
use twin::replay::{Options, SessionGap, replay};

fn data() -> PathBuf {
    PathBuf::from(std::env::var_os("TWINALIGN_DATA").expect("TWINALIGN_DATA=<folder of recorded sessions>"))
}

fn replayed(session: &Path, theta: Option<Theta>) -> SessionGap {
    let session = Session::open(session).expect("a session");
    replay(&session, &Options { theta, ..Options::default() }).expect("a usable cell")
}

fn true_gains(session: &Path) -> ArmTheta {
    let text = std::fs::read_to_string(session.join("truth.json")).expect("truth.json");
    let truth: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let gains = |key: &str| {
        let numbers = truth["theta"][key].as_array().expect("an array");
        numbers.iter().map(|v| v.as_f64().expect("a number")).collect()
    };
    ArmTheta { stiffness: gains("k"), damping: gains("d") }
}

#[test]
#[ignore = "needs recorded sessions: TWINALIGN_DATA=FOLDER cargo test --release -p twin --test simulation replay_data -- --ignored --nocapture"]
fn with_the_true_gains_every_joint_stays_within_20_microrad_of_another_engine() {
    let session = data().join("gap_dev/none_robot");
    let theta = Theta { arm: Some(true_gains(&session)), ..Theta::default() };
    let gap = replayed(&session, Some(theta));
    assert_eq!(gap.clips.len(), 8);
    for clip in &gap.clips {
        for (joint, rms) in clip.gap.joint_rms_rad.iter().flatten().enumerate() {
            // 4 of them are the encoder noise in that data; 20 leaves room and still fails on a wrong step or a late command.
            assert!(*rms < 2e-5, "{} joint {}: {rms} rad", clip.file, joint + 1);
        }
    }
}

#[test]
#[ignore = "needs recorded sessions: TWINALIGN_DATA=FOLDER cargo test --release -p twin --test simulation replay_data -- --ignored --nocapture"]
fn every_session_replays_with_a_figure_for_every_clip() {
    let mut sessions = 0;
    for group in ["gap_dev", "real"] {
        for entry in std::fs::read_dir(data().join(group)).expect("a folder") {
            let session = entry.expect("an entry").path();
            let gap = replayed(&session, None);
            assert_eq!(gap.failures().count(), 0, "{}: {:?}", session.display(), gap.failures().next());
            for clip in &gap.clips {
                let figures = clip.gap.joint_rms_rad.iter().flatten().chain(&clip.gap.object_add_m);
                assert!(figures.clone().count() > 0 && figures.clone().all(|v| v.is_finite()), "{}", clip.file);
            }
            sessions += 1;
        }
    }
    assert!(sessions >= 15, "{sessions} sessions");
}
