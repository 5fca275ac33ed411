//! What people get wrong: each time one line that says what and what to do, exit code 1, and nothing lost.

use std::io::Write as _;
use std::time::Duration;
use tests::{Cell, Finished, lab_cell};

fn run(cell: &Cell, program: &str, arguments: &[&str]) -> Finished {
    cell.start(program, arguments).wait(Duration::from_secs(30))
}

/// Records `seconds` of the simulated cell.
fn record(cell: &Cell, clip: &str, seconds: &str) {
    let bridge = cell.start_bridge(&["--record", &cell.text(clip), "--duration", seconds]);
    let answer = bridge.wait(Duration::from_secs(30)).succeeded().json();
    assert!(answer["recorded"]["messages"].as_u64() > Some(1000), "{answer}");
}

#[test]
fn a_misspelt_key_names_the_right_one() {
    let cell = Cell::with(&lab_cell().replace("stiffness =", "stifness ="));
    for (program, verb) in
        [("rt_bridge", vec!["run", "--cell", "{cell}", "--arm", "sim"]), ("twin", vec!["shadow", "--cell", "{cell}"])]
    {
        let end = run(&cell, program, &verb);
        assert!(end.complaint().contains("did you mean `stiffness`"), "{program}: {}", end.complaint());
    }
}

#[test]
fn a_missing_block_is_named() {
    let cell = Cell::with("[table]\nheight = 0.0\n");
    let end = run(&cell, "rt_bridge", &["run", "--cell", "{cell}", "--arm", "sim"]);
    assert!(end.complaint().contains("[robot]"), "{}", end.complaint());
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let cell = Cell::shipped();
    let end = run(&cell, "twin", &["replay", "{dir}/nothing.mcap", "--cell", "{cell}"]);
    assert!(end.complaint().contains("nothing.mcap"), "{}", end.complaint());
}

#[test]
fn a_truncated_clip_gives_all_but_its_end() {
    let cell = Cell::shipped();
    record(&cell, "clip.mcap", "3");
    let bytes = std::fs::read(cell.path("clip.mcap")).expect("the clip");
    std::fs::write(cell.path("cut.mcap"), &bytes[..bytes.len() * 2 / 3]).expect("a shorter copy");
    let end = run(&cell, "twin", &["replay", "{dir}/cut.mcap", "--cell", "{cell}", "--json"]).succeeded();
    let answer = end.json();
    assert!(answer["clips"][0]["joint_rms_rad"][0].is_f64(), "{answer}");
    let said = format!("{} {answer}", end.stderr);
    assert!(said.contains("truncated") || said.contains("cut"), "nobody said that the file is cut:\n{said}");
}

#[test]
fn a_flipped_bit_is_noticed() {
    let cell = Cell::shipped();
    record(&cell, "clip.mcap", "3");
    let mut bytes = std::fs::read(cell.path("clip.mcap")).expect("the clip");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x10;
    std::fs::write(cell.path("flipped.mcap"), &bytes).expect("a damaged copy");
    let end = run(&cell, "twin", &["replay", "{dir}/flipped.mcap", "--cell", "{cell}", "--json"]);
    let said = format!("{}{}", end.stdout, end.stderr);
    assert!(said.contains("the file is damaged"), "the flipped bit went unnoticed:\n{said}");
}

#[test]
fn a_file_that_is_no_recording_is_named() {
    let cell = Cell::shipped();
    std::fs::write(cell.path("no.mcap"), b"not a recording at all").expect("written");
    let end = run(&cell, "twin", &["replay", "{dir}/no.mcap", "--cell", "{cell}"]);
    assert!(end.complaint().contains("no.mcap"), "{}", end.complaint());
}

#[test]
fn no_robot_at_the_address_is_said_within_seconds() {
    let cell = Cell::shipped();
    // The discard port: nothing listens there, even where a simulated robot runs on this machine.
    let arm = "fci://127.0.0.1:9";
    let end = run(&cell, "rt_bridge", &["run", "--cell", "{cell}", "--arm", arm, "--realtime", "ignore"]);
    assert!(end.complaint().contains("no robot answers at 127.0.0.1:9"), "{}", end.complaint());
}

#[test]
fn wrong_arguments_exit_with_two() {
    let cell = Cell::shipped();
    for (program, arguments) in [
        ("rt_bridge", vec!["run", "--cell", "{cell}", "--arm", "telepathy"]),
        ("twin", vec!["replay"]),
        ("calibration", vec!["capture", "excitation"]),
    ] {
        let end = run(&cell, program, &arguments);
        assert_eq!(end.status.code(), Some(2), "{program} {arguments:?}:\n{}", end.stderr);
    }
}

#[test]
#[ignore = "mounts a small file system, as root: cargo test --release --workspace --test bad_input -- --ignored --nocapture"]
fn a_full_disk_stops_the_recording_and_nothing_else() {
    let cell = Cell::shipped();
    let disk = cell.path("disk");
    std::fs::create_dir(&disk).expect("a folder");
    let mount =
        |arguments: &[&str]| std::process::Command::new("mount").args(arguments).status().expect("mount").success();
    assert!(mount(&["-t", "tmpfs", "-o", "size=260m", "tmpfs", disk.to_str().expect("a path")]), "needs root");
    let filler = disk.join("filler");
    let bridge = cell.start_bridge(&["--record", &cell.text("disk/clip.mcap"), "--duration", "8"]);
    std::thread::sleep(Duration::from_secs(3));
    let mut file = std::fs::File::create(&filler).expect("a filler");
    while file.write_all(&[0; 1 << 16]).is_ok() {}
    let end = bridge.wait(Duration::from_secs(30));
    let states =
        shared_mem::recording::read_arm_states(&cell.path("disk/clip.mcap")).expect("what was recorded before");
    let unmounted = std::process::Command::new("umount").arg("-l").arg(&disk).status();
    assert!(unmounted.is_ok_and(|s| s.success()));
    assert!(
        end.stderr.contains("disk") || end.stderr.contains("space"),
        "nobody said that the disk is full:\n{}",
        end.stderr
    );
    assert!(states.len() > 2000, "only {} states survived", states.len());
    assert!(end.json()["cycles"].as_u64() > Some(7000), "the bridge stopped with its recorder:\n{}", end.stderr);
}
