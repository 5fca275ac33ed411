//! Ctrl-C and SIGTERM end every command that takes long within a second, whatever it is doing; what it had found is kept.

use rustix::process::Signal;
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::image::{CameraInfo, ImageHeader};
use shared_mem::recording::{ClipInfo, ClipWriter, write_png};
use shared_mem::topics;
use std::path::Path;
use std::time::Duration;
use tests::texts::root;
use tests::{Cell, Program, lab_cell};

/// What everybody is promised, and what a command may take that brakes an arm and closes its recording first.
const PROMISED: Duration = Duration::from_secs(1);
const BRAKING: Duration = Duration::from_secs(2);
const MS: u64 = 1_000_000;
const JOINTS: &str = "0,-0.78,0,-2.36,0,1.57,0.78";

/// A clip of an arm that swings, with pictures of 640 x 480 beside it where they are wanted.
fn clip(path: &Path, number: u64, seconds: u64, pictures: bool) {
    let mut writer = ClipWriter::create(path, &ClipInfo::default()).expect("a new file");
    let rest = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785, 0.0];
    let pixels = vec![90; 640 * 480 * 3];
    for i in 0..1000 * seconds {
        let at = |ms: u64, slope: bool| {
            std::array::from_fn(|joint| {
                let omega = 1.0 + 0.23 * joint as f64 + 0.31 * number as f64;
                let angle = omega * 1e-3 * (ms as f64);
                let swing = if slope { omega * angle.cos() } else { angle.sin() };
                if joint < 7 { f64::from(u8::from(!slope)) * rest[joint] + 0.1 * swing } else { 0.0 }
            })
        };
        let stamp_ns = 1_000_000_000_000 + i * MS;
        writer
            .arm_state(&ArmState {
                stamp_ns,
                device_ns: stamp_ns,
                cycle: i,
                dof: 7,
                q: at(i + 20, false),
                dq: at(i + 20, true),
                q_d: at(i + 26, false),
                dq_d: at(i + 26, true),
                ..ArmState::default()
            })
            .expect("room");
        if pictures && i % 33 == 0 {
            let header = ImageHeader { stamp_ns, width: 640, height: 480, stride: 1920, ..ImageHeader::default() };
            writer
                .camera_info(&CameraInfo { stamp_ns, width: 640, height: 480, ..CameraInfo::default() })
                .expect("room");
            writer.image(topics::CAMERA_COLOR, &header, &pixels).expect("room");
        }
    }
    writer.finish().expect("room");
}

/// A session of clips that swing differently.
fn session(cell: &Cell, name: &str, clips: u64, seconds: u64, pictures: bool) {
    std::fs::create_dir(cell.path(name)).expect("a folder");
    let mut text = lab_cell().to_owned();
    for number in 0..clips {
        let file = format!("clip_{number:02}.mcap");
        clip(&cell.path(name).join(&file), number, seconds, pictures);
        text += &format!("\n[[clip]]\nfile = \"{file}\"\nkind = \"excitation\"\n");
    }
    std::fs::write(cell.path(name).join("cell.toml"), text).expect("room");
}

/// A scan of many splats, in the order that trainers write them.
fn scan(path: &Path, splats: u32) {
    let names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1", "scale_2"];
    let turns = ["rot_0", "rot_1", "rot_2", "rot_3"];
    let properties: String = names.iter().chain(&turns).map(|name| format!("property float {name}\n")).collect();
    let head = format!("ply\nformat binary_little_endian 1.0\nelement vertex {splats}\n{properties}end_header\n");
    let mut bytes = head.into_bytes();
    for i in 0..splats {
        let along = |prime: u32| f64::from(i.wrapping_mul(prime) % 10_007) / 10_007.0 - 0.5;
        let place = [along(7919), along(104_729), along(15_485_863)].map(|x| x as f32);
        let looks = [0.1, 0.2, 0.3, 3.0, -5.0, -5.0, -5.0, 1.0, 0.0, 0.0, 0.0];
        bytes.extend(place.into_iter().chain(looks).flat_map(f32::to_le_bytes));
    }
    std::fs::write(path, bytes).expect("room");
}

/// Every command that can take longer than a person waits, and what it says at its end.
fn commands() -> Vec<(&'static str, String, &'static str)> {
    let found = "interrupted";
    let line = |line: &str| line.to_owned();
    vec![
        ("calibration", line("identify arm {dir}/session --out {dir}/theta.toml"), found),
        ("calibration", line("identify arm {dir}/session --optimizer pso --out {dir}/swarm.toml"), found),
        ("calibration", line("diagnose {dir}/session --out {dir}/d.json"), found),
        ("calibration", line("export {dir}/pictures --to twinaligner --out {dir}/new/folders"), found),
        (
            "calibration",
            format!(
                "viewpoint {{dir}}/photo.png --mask {{dir}}/mask.png --joints {JOINTS} --cell {{cell}} --start search \
                 --method swarm --budget 1000000 --out {{dir}}/found.toml"
            ),
            found,
        ),
        (
            "calibration",
            format!(
                "evaluate --policies expert --tasks {} --episodes 100000 --out {{dir}}/evaluation",
                root().join("twin/tasks/pick_carrot.toml").display()
            ),
            found,
        ),
        (
            "calibration",
            format!(
                "policy run --policy expert --task {} --episodes 100000",
                root().join("twin/tasks/pick_carrot.toml").display()
            ),
            found,
        ),
        ("calibration", line("benchmark --cell {cell} --short"), ""),
        ("calibration", line("demo --out {dir}/demo"), ""),
        ("twin", line("replay {dir}/session --out {dir}/twin"), found),
        ("twin", line("render {dir}/pictures --out {dir}/frames"), found),
        ("twin", format!("label-splats {{dir}}/scan.ply --cell {{cell}} --joints {JOINTS} --out {{dir}}/links"), found),
        ("twin", line("shadow --cell {cell}"), ""),
        ("twin", format!("teleop --port 0 --task {}", root().join("twin/tasks/push_milk.toml").display()), ""),
        ("rt_bridge", line("run --cell {cell} --arm sim --realtime ignore --record {dir}/live.mcap"), ""),
        ("rt_bridge", line("record --out {dir}/alone.mcap"), ""),
        ("rt_bridge", line("serve --cell {cell} --port 0 --no-hand"), ""),
    ]
}

/// What the commands work on.
fn material() -> Cell {
    let cell = Cell::shipped();
    session(&cell, "session", 5, 12, false);
    session(&cell, "pictures", 1, 3, true);
    scan(&cell.path("scan.ply"), 60_000);
    write_png(&cell.path("photo.png"), 640, 480, &vec![90; 640 * 480 * 3]).expect("room");
    let white = |i: usize| if (200..440).contains(&(i / 3 % 640)) && (i / 3 / 640) > 100 { 255 } else { 0 };
    write_png(&cell.path("mask.png"), 640, 480, &(0..640 * 480 * 3).map(white).collect::<Vec<u8>>()).expect("room");
    cell
}

/// How long a command took to its end from a signal at a moment behind its beginning to listen; `None` where it was done before.
fn ended(
    cell: &Cell,
    (program, line, says): &(&str, String, &str),
    signal: Signal,
    moment: Duration,
) -> Option<Duration> {
    let arguments: Vec<&str> = line.split_whitespace().collect();
    let mut running: Program = cell.start(program, &arguments);
    Cell::until(&format!("{line}: listening"), Duration::from_secs(20), || {
        running.listens_to(signal) || !running.is_running()
    });
    std::thread::sleep(moment);
    let end = if running.is_running() { Some(running.end_by(signal)) } else { None };
    let Some(end) = end.filter(|end| says.is_empty() || !end.status.success()) else {
        // It was done before the signal came. Its outputs make room for the next one.
        let files =
            ["theta.toml", "swarm.toml", "d.json", "found.toml"].map(|name| std::fs::remove_file(cell.path(name)));
        let _may_not_be_there = (files, std::fs::remove_dir_all(cell.path("new")));
        return None;
    };
    assert!(end.stderr.contains(says), "{program} {line}, {signal:?} after {moment:?}:\n{}", end.stderr);
    assert!(!end.stderr.contains("panicked"), "{}", end.stderr);
    Some(end.took)
}

/// How long a command may take to its end.
fn most((program, line, _): &(&str, String, &str)) -> Duration {
    let moves_an_arm = line.starts_with("demo") || (*program == "rt_bridge" && line.starts_with("run"));
    if moves_an_arm { BRAKING } else { PROMISED }
}

/// Nothing half done lies about, and recordings make room for the next one.
fn clear(cell: &Cell) {
    let entries = std::fs::read_dir(cell.path("")).expect("a folder").flatten();
    for name in entries.map(|entry| entry.file_name().to_string_lossy().into_owned()) {
        assert!(!name.starts_with(".unfinished-"), "{name} stayed behind");
    }
    assert!(!cell.path("new").exists(), "a folder on the way stayed behind");
    for name in ["live.mcap", "alone.mcap"] {
        let _may_not_be_there = std::fs::remove_file(cell.path(name));
    }
    for name in ["demo", "frames", "links", "twin"] {
        let _may_not_be_there = std::fs::remove_dir_all(cell.path(name));
    }
}

#[test]
fn every_command_that_takes_long_ends_within_a_second() {
    let cell = material();
    for (number, command) in commands().iter().enumerate() {
        let signal = if number % 2 == 0 { Signal::INT } else { Signal::TERM };
        // On a fast machine some are done soon.
        let took = [300, 100, 30, 0].into_iter().find_map(|moment| {
            let took = ended(&cell, command, signal, Duration::from_millis(moment));
            clear(&cell);
            took
        });
        let took = took.unwrap_or_else(|| panic!("{} was done before it could be interrupted", command.1));
        assert!(took < most(command), "{} {}: {took:?} from {signal:?} to its end", command.0, command.1);
    }
}

#[test]
#[ignore = "takes minutes: cargo test --release --workspace --test interrupts -- --ignored --nocapture"]
fn every_command_ends_within_a_second_at_any_moment() {
    let cell = material();
    let mut slow = Vec::new();
    for command in commands() {
        for signal in [Signal::INT, Signal::TERM] {
            let took: Vec<String> = [0, 50, 200, 600, 1500, 3000, 6000, 12_000]
                .into_iter()
                .map(|moment| {
                    let took = ended(&cell, &command, signal, Duration::from_millis(moment));
                    clear(&cell);
                    if took.is_some_and(|took| took > most(&command)) {
                        slow.push(format!("{} after {moment} ms", command.1));
                    }
                    took.map_or("done".to_owned(), |took| format!("{:.2}", took.as_secs_f64()))
                })
                .collect();
            eprintln!("{:>5} {} {}: {} s", format!("{signal:?}"), command.0, command.1, took.join(" "));
        }
    }
    assert!(slow.is_empty(), "too long: {slow:#?}");
}

#[test]
fn a_budget_that_is_spent_gives_the_best_answer_so_far_and_says_so() {
    let cell = Cell::shipped();
    session(&cell, "session", 6, 12, false);
    let line = ["diagnose", "{dir}/session", "--budget", "1", "--out", "{dir}/d.json", "--json"];
    let end = cell.start("calibration", &line).wait(Duration::from_secs(60)).succeeded();
    let answer = end.json();
    assert_eq!(answer["budget_spent"], true, "{answer}");
    let text = answer["verdict"]["text"].as_str().expect("a sentence");
    assert!(text.contains("the budget of 1 s was spent"), "{text}");
    assert_ne!(answer["verdict"]["kind"], "unexplained", "not everything was tried");
    assert!(answer["gap"]["before"].as_f64().expect("a number") > 0.0, "{answer}");
    // What was found is there to go on from, if there was time to find something.
    let told = end.stderr.contains("goes on from there") && end.stderr.contains("--force");
    assert_eq!(told, cell.path("d.json.state").is_file(), "{}", end.stderr);
}
