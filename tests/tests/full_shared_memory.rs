//! A full `/dev/shm`: a bridge that runs goes on, moving its arm, and whoever would start is refused in a line.
//!
//! Each scenario has a small `/dev/shm` of its own, in a mount namespace; where that is not allowed it is left out, and says so.

use shared_mem::msg::arm::ArmState;
use shared_mem::msg::target::ArmTarget;
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::{Node, Publisher, Subscriber, TransportError};
use std::fs::OpenOptions;
use std::io::Write as _;
use std::process::{Command, ExitStatus};
use std::time::{Duration, Instant};
use tests::{Cell, Program};

/// Set where a scenario runs in its own namespace.
const INSIDE: &str = "TWINALIGN_OWN_SHARED_MEMORY";
/// What another program leaves there.
const FILL: &str = "/dev/shm/fill";
/// Room for bridge, sender and reader of the arm.
const ENOUGH: &str = "256m";
/// Takes the rights to lock memory and to run in real time.
const WITHOUT_LOCK: [&str; 3] = ["setpriv", "--bounding-set", "-ipc_lock,-sys_nice"];

/// Runs the scenario `name` of this file again, with a `/dev/shm` of this size that nobody else sees. `true`: this is that run.
fn inside(name: &str, size: &str) -> bool {
    if std::env::var_os(INSIDE).is_some() {
        return true;
    }
    let apart = ["-m", "--propagation", "private"];
    let mount = "mount -t tmpfs -o size=\"$0\" tmpfs /dev/shm && exec \"$@\"";
    let allowed = Command::new("unshare").args(apart).args(["sh", "-c", mount, "1m", "true"]).status();
    if !allowed.is_ok_and(|status| status.success()) {
        eprintln!("{name} is left out: only root may mount a /dev/shm of its own, with `unshare`");
        return false;
    }
    let test = std::env::current_exe().expect("this test's own path");
    let again = Command::new("unshare")
        .args(apart)
        .args(["sh", "-c", mount, size])
        .arg(test)
        .args(["--exact", name, "--include-ignored", "--nocapture"])
        .env(INSIDE, "1")
        .status();
    assert!(again.expect("unshare runs").success(), "{name} failed in its own /dev/shm");
    false
}

/// Writes to `/dev/shm` until it takes no more, as anybody may.
fn fill() {
    let mut file = OpenOptions::new().create(true).append(true).open(FILL).expect("a file in /dev/shm");
    let zeros = vec![0; 4096];
    while file.write_all(&zeros).is_ok() {}
}

/// Gives room back, as far as all but `bytes` of it are taken by [`fill`].
fn leave(bytes: u64) {
    fill();
    let file = OpenOptions::new().write(true).open(FILL).expect("the file");
    let length = file.metadata().expect("its length").len();
    file.set_len(length.saturating_sub(bytes)).expect("room");
}

/// It ended by itself, with 1 and one line that names the cause and the remedy.
fn refused_in_a_line(what: &str, status: ExitStatus, stderr: &str) {
    assert_eq!(status.code(), Some(1), "{what}: {status}, and it said:\n{stderr}");
    let errors: Vec<_> = stderr.lines().filter(|line| line.contains("/dev/shm is full")).collect();
    assert_eq!(errors.len(), 1, "{what} said:\n{stderr}");
    assert!(errors[0].contains(FILL) && errors[0].contains("; remove what nobody needs"), "{what}: {}", errors[0]);
    assert_eq!(stderr.lines().last(), Some(errors[0]), "{what} said:\n{stderr}");
}

#[test]
fn whoever_starts_where_there_is_no_room_is_refused_in_a_line_with_what_takes_it() {
    if !inside("whoever_starts_where_there_is_no_room_is_refused_in_a_line_with_what_takes_it", "64m") {
        return;
    }
    let cell = Cell::shipped();
    fill();
    let starts: [(&str, &[&str]); 5] = [
        ("rt_bridge", &["run", "--cell", "{cell}", "--arm", "sim", "--realtime", "ignore", "--duration", "1"]),
        ("rt_bridge", &["record", "--out", "{dir}/clip.mcap", "--duration", "1"]),
        ("rt_bridge", &["target", "joints", "0.1,-0.785,0,-2.356,0,1.57,0.785"]),
        ("twin", &["shadow", "--cell", "{cell}", "--duration", "1"]),
        ("calibration", &["capture", "excitation", "--cell", "{cell}", "--clips", "1", "--out", "{dir}/session"]),
    ];
    for (program, arguments) in starts {
        let end = cell.start(program, arguments).wait(Duration::from_secs(20));
        refused_in_a_line(&format!("{program} {}", arguments[0]), end.status, &end.stderr);
    }
}

#[test]
fn a_bridge_that_finds_too_little_room_at_any_point_of_its_start_is_refused_in_a_line() {
    if !inside("a_bridge_that_finds_too_little_room_at_any_point_of_its_start_is_refused_in_a_line", ENOUGH) {
        return;
    }
    let cell = Cell::shipped();
    let arguments = ["run", "--cell", "{cell}", "--arm", "sim", "--realtime", "ignore", "--duration", "0.2"];
    let mut refused = 0;
    for kilobytes in [4, 16, 64, 256, 1_000, 4_000, 16_000, 32_000, 64_000, 128_000] {
        leave(kilobytes * 1000);
        let end = cell.start("rt_bridge", &arguments).wait(Duration::from_secs(20));
        if !end.status.success() {
            refused += 1;
            refused_in_a_line(&format!("with {kilobytes} kB free"), end.status, &end.stderr);
        }
    }
    assert!(refused > 2, "only {refused} were too little");
}

/// Steers the arm to and fro, fifty times a second.
struct Motion {
    targets: Publisher<ArmTarget>,
    states: Subscriber<ArmState>,
    newest: ArmState,
    begun: Instant,
    /// A stream that falls silent, as on a machine that is busy, is over: the next target is of another one.
    stream: u64,
    sent: Instant,
}

impl Motion {
    fn begin(node: &Node) -> Self {
        let states = node.subscriber(topics::ARM_STATE).expect("states");
        let targets = node.publisher(topics::ARM_TARGET).expect("targets");
        let now = Instant::now();
        Self { targets, states, newest: ArmState::default(), begun: now, stream: 1, sent: now }
    }

    /// Goes on for so long, and returns how far joint 1 has gone meanwhile [rad].
    fn go_on(&mut self, duration: Duration) -> f64 {
        let end = Instant::now() + duration;
        let [mut least, mut most] = [f64::INFINITY, f64::NEG_INFINITY];
        while Instant::now() < end {
            self.stream += u64::from(self.sent.elapsed() > Duration::from_millis(150));
            self.sent = Instant::now();
            let mut target = ArmTarget { stamp_ns: now_ns(), stream: self.stream, dof: 7, ..ArmTarget::default() };
            target.q[..7].copy_from_slice(&[0.0, -0.785, 0.0, -2.356, 0.0, 1.57, 0.785]);
            target.q[0] = 0.3 * (2.0 * self.begun.elapsed().as_secs_f64()).sin();
            self.targets.send(&target).expect("a target is sent");
            std::thread::sleep(Duration::from_millis(20));
            while let Some(state) = self.states.receive().expect("states are received") {
                self.newest = state;
                [least, most] = [least.min(state.q[0]), most.max(state.q[0])];
            }
        }
        most - least
    }
}

/// Starts a bridge, moves its arm, fills `/dev/shm` so long after its start, has readers join and leave, and makes room.
fn a_moving_bridge_meets_a_full_memory(through: &[&str], filled_after: Duration) {
    let _gone = std::fs::remove_file(FILL);
    let cell = Cell::shipped();
    let file = cell.text("cell.toml");
    let clip = cell.text("clip.mcap");
    let arguments = [
        "run",
        "--cell",
        &file,
        "--arm",
        "sim",
        "--realtime",
        "ignore",
        "--camera",
        "off",
        "--record",
        &clip,
        "--json",
    ];
    let node = Node::open_in(cell.domain(), "test").expect("shared memory");
    let mut motion = Motion::begin(&node);
    let begin = Instant::now();
    let mut bridge = Program::start_through(through, "rt_bridge", cell.domain(), &arguments);
    let runs = |motion: &Motion| motion.newest.cycle > 500 && Cell::size(&cell.path("clip.mcap")) > 0;
    while begin.elapsed() < filled_after || !runs(&motion) {
        motion.go_on(Duration::from_millis(100));
        assert!(bridge.is_running() && begin.elapsed() < Duration::from_secs(30), "the bridge does not come up");
    }
    fill();
    for _ in 0..3 {
        match node.subscriber(topics::ARM_STATE) {
            Err(TransportError::NoRoom(_)) => {}
            other => panic!("a reader has joined without room: {:?}", other.map(|_| ())),
        }
        let mut shadow = Program::start("twin", cell.domain(), &["shadow", "--cell", &file, "--duration", "1"]);
        while shadow.is_running() {
            motion.go_on(Duration::from_millis(20));
        }
        let end = shadow.wait(Duration::from_secs(20));
        refused_in_a_line("twin shadow", end.status, &end.stderr);
        assert!(motion.go_on(Duration::from_millis(500)) > 0.01, "the arm stands still");
    }
    assert!(motion.go_on(Duration::from_secs(2)) > 0.1, "the arm stands still");
    std::fs::remove_file(FILL).expect("room");
    let late = node.subscriber(topics::ARM_STATE).expect("there is room again");
    motion.go_on(Duration::from_millis(300));
    assert!(late.newest().expect("states").is_some(), "a reader that joins later gets no states");
    let end = bridge.interrupt().succeeded();
    let report = end.json();
    assert_eq!(report["faults"].as_array().map(Vec::len), Some(0), "{report}");
    assert!(report["recorded"].is_object(), "{report}");
    assert_eq!(report["dropped"].as_u64(), Some(0), "{report}");
}

#[test]
fn a_moving_bridge_goes_on_while_the_memory_is_full() {
    if !inside("a_moving_bridge_goes_on_while_the_memory_is_full", ENOUGH) {
        return;
    }
    for through in [&[][..], &WITHOUT_LOCK] {
        a_moving_bridge_meets_a_full_memory(through, Duration::from_millis(1500));
    }
}

#[test]
#[ignore = "six minutes, as root: cargo test --release --workspace --test full_shared_memory -- --ignored --nocapture"]
fn twenty_of_twenty_moving_bridges_go_on_with_and_without_locked_memory() {
    if !inside("twenty_of_twenty_moving_bridges_go_on_with_and_without_locked_memory", ENOUGH) {
        return;
    }
    for round in 0..20 {
        for (what, through) in [("locked", &[][..]), ("not locked", &WITHOUT_LOCK)] {
            let filled_after = Duration::from_millis(1500 + 100 * round);
            a_moving_bridge_meets_a_full_memory(through, filled_after);
            eprintln!("round {}: filled after {filled_after:?}, memory {what}: it goes on", round + 1);
        }
    }
}
