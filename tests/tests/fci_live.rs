//! The bridge on a robot that speaks the real Franka Control Interface, in a process of its own: franka-sim, a server
//! around MuJoCo (`pip install franka-sim`). With `FRANKA_SIM` naming its program and `FR3_MJCF` its model:
//! `cargo test --release -p tests --test fci_live -- --ignored --nocapture`.

use serde_json::Value;
use shared_mem::cell::{Cell as CellToml, ClipKind};
use shared_mem::msg::arm::{ArmMode, ArmState};
use shared_mem::recording::read_clip;
use shared_mem::topics;
use shared_mem::transport::Node;
use std::io::{BufRead, BufReader};
use std::net::TcpListener;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tests::{Cell, Program};

/// A server of its own port; killed when dropped.
struct Server {
    child: Child,
    port: u16,
}

impl Server {
    /// Starts it and waits until it listens.
    fn start() -> Self {
        let program = std::env::var("FRANKA_SIM").expect("FRANKA_SIM=<path of run-franka-sim-server>");
        let port = TcpListener::bind("127.0.0.1:0").and_then(|l| l.local_addr()).expect("a free port").port();
        let mut child = Command::new(program)
            .args(["--no-gripper", "--port", &port.to_string()])
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("franka-sim starts");
        let mut log = BufReader::new(child.stderr.take().expect("it was piped")).lines();
        let begun = log.by_ref().map_while(Result::ok).any(|line| line.contains("Starting MuJoCo simulation loop"));
        assert!(begun, "franka-sim ended before it listened; is FR3_MJCF set?");
        std::thread::spawn(move || log.map_while(Result::ok).for_each(drop)); // a full pipe would stop the server
        Self { child, port }
    }

    fn address(&self) -> String {
        format!("fci://127.0.0.1:{}", self.port)
    }

    fn kill_without_warning(&mut self) {
        self.child.kill().expect("it runs");
        let _status = self.child.wait();
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ended_already = self.child.kill();
        let _status = self.child.wait();
    }
}

fn start_bridge(cell: &Cell, server: &Server, more: &[&str]) -> Program {
    let address = server.address();
    let record = ["--record", "{dir}/live.mcap", "--realtime", "ignore", "--json"];
    let arguments = [&["run", "--cell", "{cell}", "--arm", &address][..], &record, more].concat();
    let bridge = cell.start("rt_bridge", &arguments);
    assert!(cell.wait_for_states(Duration::from_secs(20)), "no states of the live robot");
    bridge
}

/// Has the arm moved until it ends or is stopped.
fn excite(cell: &Cell, clips: &str) -> Program {
    let arguments = ["capture", "excitation", "--cell", "{cell}", "--clips", clips, "--out", "{dir}/session", "--json"];
    cell.start("calibration", &arguments)
}

/// What a reader of `/arm/state` saw.
#[derive(Debug, Default)]
struct Seen {
    states: u64,
    /// Steps of the robot's counter without a state.
    skipped: u64,
    /// Lost commands that the success rate tells of, at least.
    told: f64,
    moving: u64,
    swing: f64,
}

fn watch(cell: &Cell, duration: Duration) -> Seen {
    let node = Node::open_in(cell.domain(), "watch").expect("shared memory");
    let states = node.subscriber(topics::ARM_STATE).expect("a place to read");
    let (mut seen, mut last, begin): (Seen, Option<ArmState>, _) = (Seen::default(), None, Instant::now());
    let (mut low, mut high) = (f64::MAX, f64::MIN);
    while begin.elapsed() < duration {
        while let Some(state) = states.receive().expect("a state") {
            if let Some(last) = last {
                seen.skipped += (state.device_ns - last.device_ns) / 1_000_000 - 1;
                // The rate is over a window of 100: every drop of it is that many commands that did not arrive in time.
                seen.told += (100.0 * (last.success_rate - state.success_rate)).max(0.0);
            }
            seen.states += 1;
            seen.moving += u64::from(state.mode == ArmMode::Move);
            (low, high) = (low.min(state.q[3]), high.max(state.q[3]));
            last = Some(state);
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    seen.swing = high - low;
    seen
}

#[test]
#[ignore = "needs a simulated robot: FRANKA_SIM=PATH/run-franka-sim-server FR3_MJCF=PATH/fr3.xml cargo test --release --workspace --test fci_live -- --ignored --nocapture"]
fn a_live_robot_is_moved_for_a_minute_without_a_fault() {
    for controller in ["torque_pd", "joint_impedance"] {
        let (cell, server) = (Cell::shipped(), Server::start());
        let bridge = start_bridge(&cell, &server, &["--duration", "60", "--controller", controller]);
        let mut capture = excite(&cell, "3");
        let seen = watch(&cell, Duration::from_secs(55));
        let done = !capture.is_running();
        let answer = bridge.wait(Duration::from_secs(20)).succeeded().json();
        eprintln!("{controller}: {seen:?}\n{answer}");
        assert!(done, "the excitation did not come to its end");
        assert_eq!(answer["faults"], Value::Array(Vec::new()));
        assert_eq!(seen.moving, seen.states);
        // A lost command goes untold only where another one leaves the window in the same cycle.
        assert!(
            seen.skipped as f64 <= 1.2 * seen.told + 5.0,
            "states are missing that the robot knows nothing of: {seen:?}"
        );
        assert!(seen.swing > 0.05, "the arm was not moved: {seen:?}");
        let clip = read_clip(&cell.path("live.mcap"), ClipKind::Excitation, &CellToml::default()).expect("readable");
        let cycles = usize::try_from(answer["cycles"].as_u64().expect("cycles")).expect("a count");
        // The recorder joins after the first states.
        assert!(clip.measured.len() + 1500 > cycles, "{} of {cycles} states recorded", clip.measured.len());
    }
}

#[test]
#[ignore = "needs a simulated robot: FRANKA_SIM=PATH/run-franka-sim-server FR3_MJCF=PATH/fr3.xml cargo test --release --workspace --test fci_live -- --ignored --nocapture"]
fn a_robot_that_dies_mid_motion_is_told_of_and_the_recording_is_kept() {
    let (cell, mut server) = (Cell::shipped(), Server::start());
    let bridge = start_bridge(&cell, &server, &["--duration", "60"]);
    let _capture = excite(&cell, "3");
    let before = watch(&cell, Duration::from_secs(8));
    assert!(before.swing > 0.01, "it was not mid-motion: {before:?}");
    server.kill_without_warning();
    let end = bridge.wait(Duration::from_secs(20));
    eprintln!("took {:?}: {}\n{}", end.took, end.stdout.trim_end(), end.stderr.trim_end());
    assert!(end.took < Duration::from_secs(2), "{:?}", end.took);
    assert!(end.complaint().contains("closed the connection"), "{}", end.stderr);
    assert_eq!(end.json()["faults"].as_array().map(Vec::len), Some(1));
    let clip = read_clip(&cell.path("live.mcap"), ClipKind::Excitation, &CellToml::default()).expect("readable");
    assert_eq!(clip.damage, None);
    assert!(clip.measured.len() > 6000, "{} states recorded", clip.measured.len());
}
