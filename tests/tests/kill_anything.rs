//! Bridge, twin and recorder die without warning at random moments: the others go on or say why they stop, a restart
//! needs no cleaning by hand, and the clip is readable up to the last second. Bytes that are no message kill nobody.

use rand::{RngExt, SeedableRng};
use rustix::process::{Pid, Signal, kill_process};
use shared_mem::msg::arm::ArmState;
use shared_mem::recording;
use std::path::Path;
use std::time::Duration;
use tests::{Cell, Program};

/// Moment of the last arm state in a clip [ns], and how many it holds.
fn last_state(clip: &Path) -> (u64, usize) {
    let states = recording::read_arm_states(clip).unwrap_or_else(|e| panic!("{}: {e}", clip.display()));
    let gaps = states.windows(2).filter(|w| w[1].cycle != w[0].cycle + 1).count();
    assert_eq!(gaps, 0, "{} has {gaps} gaps", clip.display());
    (states.last().map_or(0, |s| s.stamp_ns), states.len())
}

fn kill(pid: u32) {
    let pid = i32::try_from(pid).ok().and_then(Pid::from_raw).expect("a process id");
    kill_process(pid, Signal::KILL).expect("a living process");
}

/// Process id of the recorder that this bridge started.
fn recorder_of(bridge: &Program) -> Option<u32> {
    let children = std::fs::read_to_string(format!("/proc/{0}/task/{0}/children", bridge.pid())).ok()?;
    children.split_whitespace().find_map(|p| p.parse().ok())
}

/// The files of a recording: the recorder goes on in a new one after a crash.
fn clips(cell: &Cell, stem: &str) -> Vec<std::path::PathBuf> {
    let mut found: Vec<_> = std::fs::read_dir(cell.path(""))
        .expect("the cell's folder")
        .map(|e| e.expect("an entry").path())
        .filter(|p| {
            p.extension().is_some_and(|e| e == "mcap")
                && p.file_name().is_some_and(|n| n.to_string_lossy().starts_with(stem))
        })
        .collect();
    found.sort();
    found
}

fn a_dead_bridge(cell: &Cell, round: u32, moment: Duration) {
    let clip = format!("bridge{round}.mcap");
    let mut bridge = cell.start_bridge(&["--record", &cell.text(&clip)]);
    Cell::until("the recording begins", Duration::from_secs(10), || Cell::size(&cell.path(&clip)) > 0);
    std::thread::sleep(Duration::from_secs(1) + moment);
    let recorder = recorder_of(&bridge).expect("a recorder");
    bridge.kill_without_warning();
    let died = shared_mem::time::now_ns();
    // The recorder notices by itself and finishes the file.
    Cell::until("the recorder ends", Duration::from_secs(15), || {
        let stat = std::fs::read_to_string(format!("/proc/{recorder}/stat")).unwrap_or_default();
        stat.is_empty() || stat.contains(") Z")
    });
    let (last, count) = last_state(&cell.path(&clip));
    assert!(count > 500, "only {count} states");
    assert!(died - last < 1_000_000_000, "the last {} ms are missing", (died - last) / 1_000_000);
}

fn a_dead_recorder(cell: &Cell, round: u32, moment: Duration) {
    let stem = format!("recorder{round}");
    let bridge = cell.start_bridge(&["--record", &cell.text(&format!("{stem}.mcap")), "--duration", "5"]);
    Cell::until("the recording begins", Duration::from_secs(10), || {
        Cell::size(&cell.path(&format!("{stem}.mcap"))) > 0
    });
    std::thread::sleep(Duration::from_millis(1200) + moment);
    kill(recorder_of(&bridge).expect("a recorder"));
    let died = shared_mem::time::now_ns();
    let end = bridge.wait(Duration::from_secs(20)).succeeded();
    let answer = end.json();
    assert_eq!(answer["faults"].as_array().map(Vec::len), Some(0), "the bridge stopped: {answer}");
    assert!(end.stderr.contains("recorder"), "nobody said that the recorder died:\n{}", end.stderr);
    let files = clips(cell, &stem);
    let (last, _) = last_state(&files[0]);
    assert!(died - last < 1_000_000_000, "the last {} ms are missing", (died - last) / 1_000_000);
    assert!(files.len() > 1, "the recording did not go on: {files:?}");
    // The bridge ends three seconds after the recorder died, or a little later where the machine is busy.
    let (end, _) = last_state(&files[1]);
    assert!(
        end > died + 1_000_000_000,
        "nothing was recorded later than {} ms after",
        end.saturating_sub(died) / 1_000_000
    );
}

fn a_dead_twin(cell: &Cell, moment: Duration) {
    let bridge = cell.start_bridge(&["--duration", "4"]);
    let mut twin = cell.start("twin", &["shadow", "--cell", "{cell}"]);
    std::thread::sleep(Duration::from_millis(500) + moment);
    twin.kill_without_warning();
    let again = cell.start("twin", &["shadow", "--cell", "{cell}", "--duration", "1", "--json"]);
    let answer = again.wait(Duration::from_secs(20)).succeeded().json();
    assert!(answer["cycles"].as_u64() > Some(300), "the second twin mirrored nothing: {answer}");
    let answer = bridge.wait(Duration::from_secs(20)).succeeded().json();
    assert_eq!(answer["faults"].as_array().map(Vec::len), Some(0), "{answer}");
}

fn rounds(count: u32) {
    let cell = Cell::shipped();
    let mut random = rand_pcg::Pcg64Mcg::seed_from_u64(7);
    for round in 0..count {
        let moment = Duration::from_millis(random.random_range(0..700));
        match round % 3 {
            0 => a_dead_bridge(&cell, round, moment),
            1 => a_dead_recorder(&cell, round, moment),
            _ => a_dead_twin(&cell, moment),
        }
        eprintln!("round {round} after {moment:?}: survived");
    }
}

/// Processes that a program started, from whichever of its threads.
fn children_of(pid: u32) -> Vec<u32> {
    let threads = std::fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
    let lists = threads.map(|thread| std::fs::read_to_string(thread.path().join("children")).unwrap_or_default());
    lists.flat_map(|list| list.split_whitespace().filter_map(|p| p.parse().ok()).collect::<Vec<_>>()).collect()
}

fn is_alive(pid: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    !stat.is_empty() && !stat.contains(") Z")
}

/// Kills a capture that started its own bridge once `now` says so of its children and the arm's newest state. The children
/// have to end; the last state that the bridge published.
fn a_dead_capture(cell: &Cell, out: &str, now: impl Fn(&[u32], Option<&ArmState>) -> bool) -> Option<ArmState> {
    let node = shared_mem::transport::Node::open_in(cell.domain(), "test").expect("shared memory");
    let states = node.subscriber(shared_mem::topics::ARM_STATE).expect("a place to read");
    let session = cell.text(out);
    let arguments =
        ["capture", "excitation", "--cell", "{cell}", "--clips", "1", "--realtime", "ignore", "--out", &session];
    let mut capture = cell.start("calibration", &arguments);
    let (mut children, mut newest) = (Vec::new(), None);
    Cell::until("the moment to die", Duration::from_secs(60), || {
        children = children_of(capture.pid());
        newest = states.newest().expect("a state").or(newest);
        now(&children, newest.as_ref())
    });
    capture.kill_without_warning();
    Cell::until("the capture's children end", Duration::from_secs(20), || {
        // Looked at before the children: what a bridge published is gone with it.
        newest = states.newest().expect("a state").or(newest);
        !children.iter().any(|pid| is_alive(*pid))
    });
    newest
}

#[test]
fn a_bridge_brakes_and_ends_when_the_capture_that_started_it_is_killed() {
    let cell = Cell::shipped();
    let _before_its_first_state = a_dead_capture(&cell, "born", |children, _| !children.is_empty());
    let _standing = a_dead_capture(&cell, "standing", |_, state| state.is_some());
    // What the arm is told; it swings for a moment longer.
    let fastest = |state: &ArmState| state.dq_d.iter().fold(0.0_f64, |fastest, dq| fastest.max(dq.abs()));
    // Bridge and recorder, in the middle of a motion.
    let moves = |children: &[u32], state: Option<&ArmState>| {
        children.len() == 2 && state.is_some_and(|state| fastest(state) > 0.05)
    };
    let last = a_dead_capture(&cell, "moving", moves).expect("a state");
    assert!(fastest(&last) < 0.02, "it ended while the arm was told to move by {} rad/s", fastest(&last));
    // The recorder finished its file, and it holds how the arm was braked.
    let states = recording::read_arm_states(&cell.path("moving/clip_00.mcap")).expect("a clip");
    assert!(states.iter().any(|state| fastest(state) > 0.05), "nothing moved");
    assert!(states.last().is_some_and(|state| fastest(state) < 0.02), "the recording ends in motion");
    let bytes = std::fs::read(cell.path("moving/clip_00.mcap")).expect("a clip");
    assert!(bytes.ends_with(b"\x89MCAP0\r\n"), "the recording was not finished");
}

#[test]
fn any_process_may_die_at_any_moment() {
    rounds(3);
}

/// The program throws random bytes for as long as it is told: `random_bytes 600` is the long run.
#[test]
fn whatever_bytes_lie_in_shared_memory_no_process_dies_and_no_limit_is_exceeded() {
    let cell = Cell::shipped();
    let answer =
        Program::start("random_bytes", cell.domain(), &["4"]).wait(Duration::from_secs(120)).succeeded().json();
    let thrown = [&answer["thrown"]["beside_the_bridge"], &answer["thrown"]["alone"]].map(|t| t.as_object().cloned());
    let [beside, alone] = thrown.map(Option::unwrap_or_default);
    for topic in shared_mem::topics::ALL {
        assert!(alone.contains_key(topic) || beside.contains_key(topic), "nothing was thrown at {topic}: {answer}");
    }
    assert!(beside.contains_key("/gripper/command") && beside.contains_key("/events"), "{answer}");
    let ignored = answer["ignored"].as_array().expect("remarks");
    assert!(ignored.iter().any(|line| line.as_str().is_some_and(|line| line.contains("/gripper/command"))), "{answer}");
}

#[test]
#[ignore = "takes five minutes: cargo test --release --workspace --test kill_anything -- --ignored --nocapture"]
fn fifty_deaths_at_random_moments() {
    rounds(50);
}
