//! What people get wrong: each time one line that says what and what to do, exit code 1, and nothing lost.

use rustix::process::Signal;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::joints_from;
use shared_mem::recording::{ClipInfo, ClipWriter};
use std::io::Write as _;
use std::time::{Duration, Instant};
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

/// Names of temporary files in a folder of the cell.
fn unfinished(cell: &Cell, folder: &str) -> Vec<String> {
    let entries = std::fs::read_dir(cell.path(folder)).into_iter().flatten().flatten();
    let names = entries.map(|entry| entry.file_name().to_string_lossy().into_owned());
    names.filter(|name| name.starts_with(".unfinished-")).collect()
}

#[test]
fn a_disk_without_room_leaves_the_outputs_of_before_and_is_told() {
    let cell = Cell::shipped();
    record(&cell, "clip.mcap", "2");
    std::fs::create_dir(cell.path("frames")).expect("a folder");
    std::fs::write(cell.path("frames/frame_00000.png"), "of before").expect("a picture of before");
    // A limit to the size of files is met like the end of the disk, and needs no root.
    let program = |name: &str| tests::program_path(name).display().to_string();
    let limited = |line: &str| {
        let line = format!("trap '' XFSZ; ulimit -f 8; exec {line}").replace("{dir}/", &cell.text(""));
        let end = std::process::Command::new("sh").args(["-c", &line]).output().expect("a shell");
        let said = String::from_utf8_lossy(&end.stderr).trim_end().lines().last().unwrap_or("").to_owned();
        assert_eq!(end.status.code(), Some(1), "{line}: {said}");
        said
    };
    let (twin, calibration) = (program("twin"), program("calibration"));
    let said = limited(&format!("{twin} render {{dir}}/clip.mcap --every 10 --out {{dir}}/frames --force"));
    assert!(said.contains("frame_00000.png") && said.contains("file of before is unchanged"), "{said}");
    assert_eq!(std::fs::read(cell.path("frames/frame_00000.png")).expect("a picture"), b"of before");
    let said = limited(&format!("{twin} replay {{dir}}/clip.mcap --out {{dir}}/twin.mcap"));
    assert!(said.contains("twin.mcap") && said.contains("ulimit"), "{said}");
    let said = limited(&format!("{calibration} export {{dir}}/clip.mcap --to ros2 --out {{dir}}/bags"));
    assert!(said.contains("bags/clip.mcap") && said.contains("ulimit"), "{said}");
    assert!(!cell.path("twin.mcap").exists() && !cell.path("bags").exists());
    assert_eq!([unfinished(&cell, ""), unfinished(&cell, "frames")], [[""; 0]; 2]);
}

#[test]
fn an_output_of_a_killed_program_is_not_there_and_the_next_run_clears_up() {
    let cell = Cell::shipped();
    record(&cell, "clip.mcap", "3");
    let replay = ["replay", "{dir}/clip.mcap", "--out", "{dir}/twin.mcap"];
    // On a busy machine it is done before this thread looks, many times in a row.
    let end = Instant::now() + Duration::from_secs(60);
    let mut tries = std::iter::from_fn(|| (Instant::now() < end).then_some(()));
    let killed_while_it_wrote = tries.any(|()| {
        let _of_a_run_that_was_too_fast = std::fs::remove_file(cell.path("twin.mcap"));
        let mut twin = cell.start("twin", &replay);
        while twin.is_running() && unfinished(&cell, "").is_empty() {}
        twin.kill_without_warning();
        !unfinished(&cell, "").is_empty()
    });
    assert!(killed_while_it_wrote && !cell.path("twin.mcap").exists());
    let _replayed = run(&cell, "twin", &replay).succeeded();
    assert_eq!(unfinished(&cell, ""), [""; 0]);
    // At Ctrl-C, pictures that are finished stay, and nothing else.
    let twin = cell.start("twin", &["render", "{dir}/clip.mcap", "--out", "{dir}/frames"]);
    Cell::until("a picture", Duration::from_secs(30), || cell.path("frames/frame_00001.png").exists());
    let end = twin.interrupt();
    assert!(end.complaint().contains("interrupted"), "{}", end.complaint());
    assert_eq!(unfinished(&cell, "frames"), [""; 0]);
    for picture in std::fs::read_dir(cell.path("frames")).expect("a folder") {
        shared_mem::recording::read_picture(&picture.expect("an entry").path()).expect("a whole picture");
    }
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
fn pipes_devices_folders_and_files_without_end_are_named_at_once() {
    let cell = Cell::shipped();
    let (pipe, huge) = (cell.path("pipe"), cell.path("huge.toml"));
    rustix::fs::mkfifoat(rustix::fs::CWD, &pipe, rustix::fs::Mode::RUSR).expect("a pipe");
    std::fs::File::create(&huge).and_then(|file| file.set_len(1 << 40)).expect("a file without bytes on the disk");
    std::fs::create_dir(cell.path("folder.toml")).expect("a folder");
    let cases = [
        ("{dir}/pipe", "a pipe"),
        ("/dev/zero", "a device"),
        ("{dir}/folder.toml", "a folder"),
        ("{dir}/huge.toml", "16 MiB at most"),
    ];
    for (path, what) in cases {
        let end = run(&cell, "twin", &["shadow", "--cell", path]);
        let name = path.rsplit('/').next().unwrap_or("");
        assert!(end.complaint().contains(what) && end.complaint().contains(name), "{}", end.complaint());
    }
    for (path, what) in [("{dir}/pipe", "a pipe"), ("/dev/zero", "a device")] {
        let end = run(&cell, "twin", &["replay", path, "--cell", "{cell}"]);
        assert!(end.complaint().contains(what), "{}", end.complaint());
    }
}

#[test]
fn shapes_that_make_no_sense_are_named_at_once() {
    let object = "[table]\nheight = 0.0\n[object]\nmesh = \"body.ply\"\nmass_range = [0.1, 1.0]\n";
    let robot = "[robot]\nurdf = \"deep.urdf\"\n[controller]\nkind = \"joint_pd\"\nstiffness = [1]\ndamping = [1]\n";
    let floats = "property float x\nproperty float y\nproperty float z\n";
    let lists = "property list uchar float x\nproperty float y\nproperty float z\n";
    let ply = |vertices: &str, columns: &str, values: &str| {
        format!("ply\nformat ascii 1.0\nelement vertex {vertices}\n{columns}end_header\n{values}")
    };
    let cases = [
        (object, "body.ply", ply("4", lists, "0 0 0\n0 0 0\n0 0 0\n0 0 0\n"), "corners"),
        (object, "body.ply", ply("1000000000000", "", ""), "rows without columns"),
        (object, "body.ply", ply("1000000000000", floats, "0 0 0\n"), "1000000000000 rows"),
        (robot, "deep.urdf", format!("<robot name=\"deep\">{}", "<a>".repeat(300_000)), "64 deep"),
    ];
    for (cell, file, text, what) in cases {
        let cell = Cell::with(cell);
        std::fs::write(cell.path(file), text).expect("a file");
        let end = run(&cell, "twin", &["shadow", "--cell", "{cell}"]);
        assert!(end.complaint().contains(file) && end.complaint().contains(what), "{}", end.complaint());
    }
}

/// A clip of the arm at rest with a state every `step` ns; `stamp` may change what a state says.
fn clip_at_rest(path: &std::path::Path, rows: u64, step: u64, stamp: impl Fn(u64, u64) -> u64) {
    let mut writer = ClipWriter::create(path, &ClipInfo::default()).expect("a new file");
    for i in 0..rows {
        let stamp_ns = stamp(i, 1_000_000_000_000 + i * step);
        let q = joints_from(&[0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785 + 1e-4 * (i % 7) as f64]);
        let state = ArmState { stamp_ns, device_ns: stamp_ns, cycle: i, dof: 7, q, q_d: q, ..ArmState::default() };
        writer.arm_state(&state).expect("room");
    }
    writer.finish().expect("room");
}

#[test]
fn a_stamp_of_zero_or_a_day_off_costs_its_row_and_a_word() {
    const DAY: u64 = 86_400_000_000_000;
    let cell = Cell::shipped();
    clip_at_rest(&cell.path("clean.mcap"), 500, 1_000_000, |_, usual| usual);
    let answer = |clip: &str| {
        let end = run(&cell, "twin", &["replay", &cell.text(clip), "--cell", "{cell}", "--json"]).succeeded();
        (end.json()["clips"][0]["joint_rms_rad"][0].as_f64().expect("a number"), end.stderr)
    };
    let (clean, _) = answer("clean.mcap");
    for (name, wrong) in [("zero.mcap", 0), ("ahead.mcap", 1_000_000_000_000 + DAY), ("back.mcap", 1_000_000_000)] {
        clip_at_rest(&cell.path(name), 500, 1_000_000, |i, usual| if i == 250 { wrong } else { usual });
        let (rms, said) = answer(name);
        assert!(said.contains(&format!("{name}: ")) && said.contains("1 of 500 rows left out"), "{said}");
        assert!((rms - clean).abs() < 1e-4, "{rms} against {clean}");
    }
}

#[test]
fn a_replay_that_would_take_an_hour_ends_when_it_is_asked_to() {
    let cell = Cell::shipped();
    // A row every 50 s: ten days, which no pause between two rows gives away.
    clip_at_rest(&cell.path("long.mcap"), 20_000, 50_000_000_000, |_, usual| usual);
    let replay = cell.start("twin", &["replay", "{dir}/long.mcap", "--cell", "{cell}"]);
    Cell::until("listening", Duration::from_secs(20), || replay.listens_to(Signal::INT));
    std::thread::sleep(Duration::from_secs(1));
    let end = replay.interrupt();
    assert!(end.complaint().contains("interrupted"), "{}", end.complaint());
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
    assert_eq!(end.status.code(), Some(1), "a recording that ended early is a failure:\n{}", end.stderr);
    assert!(states.len() > 2000, "only {} states survived", states.len());
    assert!(end.json()["cycles"].as_u64() > Some(7000), "the bridge stopped with its recorder:\n{}", end.stderr);
}
