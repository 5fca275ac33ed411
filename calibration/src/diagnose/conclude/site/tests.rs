//! What is advised where, as commands and as motions.

use super::*;
use shared_mem::cell::{Cell, ClipEntry, Robot};
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::origin::ArmOrigin;
use shared_mem::recording::{ClipInfo, ClipWriter, SessionFiles};

fn fr3() -> Cell {
    Cell { robot: Some(Robot { model: Some("fr3".into()), ..Robot::default() }), ..Cell::default() }
}

/// What is advised about a session of this cell with a clip of each of these arms.
fn advised(cell: Cell, arms: &[&str]) -> (tempfile::TempDir, Advice) {
    let folder = tempfile::tempdir().expect("a folder");
    let clip = |(number, arm): (usize, &&str)| {
        let file = PathBuf::from(format!("clip_{number:02}.mcap"));
        let mut writer = ClipWriter::create(&folder.path().join(&file), &ClipInfo::default()).expect("a new file");
        writer.arm_state(&ArmState { dof: 7, origin: ArmOrigin::new(arm), ..ArmState::default() }).expect("room");
        writer.finish().expect("room");
        ClipEntry { file, kind: ClipKind::Excitation }
    };
    let clips = arms.iter().enumerate().map(clip).collect();
    let session = Session { folder: folder.path().to_owned(), cell, clips, files: SessionFiles::default() };
    let advice = Site::of(&session, None).more("Record more.".into(), 5);
    (folder, advice)
}

#[test]
fn the_arm_of_the_clips_records_more_of_them() {
    for (arms, expected, into) in [
        (&["sim", "sim"][..], "sim", ""),
        (&["fci://172.16.0.2", ""], "fci://172.16.0.2", ""),
        (&[""], "fci://ROBOT", ""),
        (&["replay://x.mcap"], "fci://ROBOT", "_next"),
        (&["sim", "fci://172.16.0.2"], "fci://172.16.0.2", "_next"),
    ] {
        let (folder, advice) = advised(fr3(), arms);
        let out = format!("{}{into} --arm {expected} --clips", folder.path().display());
        assert!(advice.commands[0].contains(&out), "{arms:?}: {:?}", advice.commands);
        assert!(advice.motions.is_empty());
    }
}

#[test]
fn an_arm_that_no_bridge_drives_gets_its_motion_in_words_and_a_simulated_one_a_command() {
    let urdf = || Cell { robot: Some(Robot { urdf: Some("arm.urdf".into()), ..Robot::default() }), ..Cell::default() };
    let (_folder, advice) = advised(urdf(), &[""]);
    assert!(advice.commands.is_empty() && advice.sentence.contains("No bridge drives this arm"), "{advice:?}");
    assert_eq!(advice.motions, [ArmMotion::of(Kind::Multisine, 5)]);
    let (_folder, advice) = advised(urdf(), &["sim"]);
    assert!(advice.commands[0].contains("--arm sim") && advice.motions.is_empty(), "{advice:?}");
}

#[test]
fn the_question_about_torques_is_asked_again() {
    let site = Site { torques: true, ..Site::new(Path::new("bags"), false, Vec::new(), 1.0) };
    let advice = site.more("Record more.".into(), 4);
    assert_eq!(advice.commands[1], "calibration diagnose bags --torques --report report.html");
}

#[test]
fn of_several_objects_strokes_and_their_diagnosis_are_about_the_same_one() {
    let site = Site { object: Some("cup".into()), ..Site::new(Path::new("bags"), true, vec![4], 1.0) };
    let commands = site.advice(String::new(), &[Capture::StrokeAgain("--speed 0.5")]).commands;
    let of_strokes = "--cell bags/cell.toml --out bags --arm sim --object cup --repeat 4 --speed 0.5";
    assert_eq!(commands[0], format!("calibration capture control-hit-slide {of_strokes}"));
    assert_eq!(commands[1], "calibration diagnose bags --object cup --report report.html");
}

#[test]
fn with_a_cell_of_elsewhere_clips_go_into_a_session_that_is_captured_with_it() {
    let files = SessionFiles { session: "my clips/".into(), cell: Some("the lab/cell.toml".into()) };
    let session = Session { folder: "my clips/".into(), cell: fr3(), clips: Vec::new(), files };
    let advice = Site::of(&session, None).more("Record more.".into(), 3);
    let capture =
        "calibration capture excitation --cell 'the lab/cell.toml' --out 'my clips_next' --arm fci://ROBOT --clips";
    let expected = [format!("{capture} 4"), format!("{capture} 3")];
    assert_eq!(advice.commands[..2], expected);
    assert_eq!(advice.commands[2], "calibration diagnose 'my clips_next' --report report.html");
    assert_eq!(Site::of(&session, None).usual(), [format!("{capture} 8")]);
    // Eight clips are enough to be diagnosed.
    assert_eq!(Site::of(&session, None).more(String::new(), 8).commands.len(), 2);
}

#[test]
fn a_page_gets_a_name_that_neither_this_command_nor_one_before_has_taken() {
    let asked = |page: &str| {
        let site = Site { page: Some(page.into()), ..Site::new(Path::new("bags"), false, Vec::new(), 1.0) };
        site.more("Record more.".into(), 4).commands[1].clone()
    };
    assert!(asked("./report.html").ends_with("--report report_2.html"), "{}", asked("./report.html"));
    assert!(asked("other.html").ends_with("--report report.html"), "{}", asked("other.html"));
}

#[test]
fn a_clip_that_lies_where_the_program_runs_has_a_folder_too() {
    let advice = Site::new(Path::new(""), true, vec![2], 1.0)
        .advice(String::new(), &[Capture::Arm(ArmMotion::of(Kind::Multisine, 2))]);
    assert_eq!(advice.commands[0], "calibration capture excitation --cell ./cell.toml --out ./arm --arm sim --clips 4");
    assert_eq!(advice.commands[2], "calibration diagnose ./arm --report report_arm.html");
}

#[test]
fn where_nothing_can_be_repeated_new_clips_take_its_place() {
    let Advice { sentence: words, commands, .. } =
        Site::new(Path::new("bags"), false, Vec::new(), 1.0).again(2, |words| words);
    assert!(words.starts_with("record 2 clips more"), "{words}");
    assert!(commands[0].ends_with("--clips 2") && commands[1].ends_with("--speed 0.5"), "{commands:?}");
}
