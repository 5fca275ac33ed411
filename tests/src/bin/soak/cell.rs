//! A cell that runs: its programs, the hand that steers its arm without a pause, and the judge of what is commanded.

use super::clip::Rows;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use serde_json::{Value, json};
use shared_mem::msg::MAX_JOINTS;
use shared_mem::msg::arm::{ArmState, MotionStatus};
use shared_mem::msg::target::{ArmTarget, TargetKind};
use shared_mem::time::now_ns;
use shared_mem::topics;
use shared_mem::transport::Node;
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use tests::{Cell, Finished, Judge, Program};

/// A target is repeated this often.
const PERIOD: Duration = Duration::from_millis(20);
/// Targets until the next place: a second and a half.
const REPEATED: u32 = 75;
/// Around this place the arm is steered [rad], and so far from it.
const MIDDLE: [f64; MAX_JOINTS] = [0.0, -0.6, 0.0, -2.2, 0.0, 1.6, 0.785, 0.0];
const REACH: f64 = 0.25;
/// Share of each joint's highest speed.
const SPEED: f64 = 0.5;

/// The programs of a cell and who steers its arm.
pub(crate) struct Running {
    name: &'static str,
    domain: String,
    clip: PathBuf,
    programs: Vec<(&'static str, Program)>,
    over: Arc<AtomicBool>,
    steering: JoinHandle<Steered>,
}

/// What the steering hand saw.
#[derive(Debug)]
struct Steered {
    judge: Judge,
    /// Streams that were braked or refused, of which nobody asked it.
    stopped: u64,
    places: u64,
}

impl Running {
    /// A simulated arm with camera, tracker, recorder and shadow twin.
    pub(crate) fn simulated(cell: &Cell) -> Self {
        let clip = cell.path("simulated.mcap");
        let bridge = cell.start_bridge(&["--camera", "sim", "--record", &cell.text("simulated.mcap")]);
        let twin = cell.start("twin", &["shadow", "--cell", "{cell}", "--json"]);
        Self::steer("simulated", cell, cell.domain(), clip, vec![("bridge", bridge), ("twin", twin)])
    }

    /// A served robot, the bridge that drives it over FCI, and its recorder, in a domain of their own.
    pub(crate) fn served(cell: &Cell) -> Self {
        let domain = format!("{}-fci", cell.domain());
        // Any that is free: a robot, or another one that is served, may be there beside.
        let port = TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr()).expect("a free port").port();
        let (toml, clip) = (cell.text("cell.toml"), cell.text("served.mcap"));
        let (address, port) = (format!("127.0.0.1:{port}"), port.to_string());
        let serve = ["serve", "--cell", &toml, "--port", &port, "--no-hand", "--json"];
        let robot = Program::start("rt_bridge", &domain, &serve);
        Cell::until("the served robot listens", Duration::from_secs(20), || TcpStream::connect(&address).is_ok());
        let arm = format!("fci://{address}");
        let run = ["run", "--cell", &toml, "--arm", &arm, "--realtime", "ignore", "--record", &clip, "--json"];
        let bridge = Program::start("rt_bridge", &domain, &run);
        Self::steer("served", cell, &domain, cell.path("served.mcap"), vec![("bridge", bridge), ("robot", robot)])
    }

    fn steer(
        name: &'static str,
        cell: &Cell,
        domain: &str,
        clip: PathBuf,
        programs: Vec<(&'static str, Program)>,
    ) -> Self {
        let described = shared_mem::cell::Cell::read(&cell.path("cell.toml")).expect("the shipped cell");
        let over = Arc::new(AtomicBool::new(false));
        let (ends, there) = (over.clone(), domain.to_owned());
        let steering = std::thread::spawn(move || steer(&there, Judge::new(&described), &ends));
        Self { name, domain: domain.to_owned(), clip, programs, over, steering }
    }

    pub(crate) fn name(&self) -> &'static str {
        self.name
    }

    /// What is recorded.
    pub(crate) fn clip(&self) -> &Path {
        &self.clip
    }

    /// Its domain of shared memory.
    pub(crate) fn domain(&self) -> &str {
        &self.domain
    }

    /// Its programs and the recorder that the bridge started, with their process ids.
    pub(crate) fn processes(&self) -> Vec<(&'static str, u32)> {
        let own = self.programs.iter().map(|(name, program)| (*name, program.pid()));
        let bridge = self.programs.first().map(|(_, bridge)| bridge.pid());
        own.chain(bridge.and_then(recorder_of).map(|pid| ("recorder", pid))).collect()
    }

    /// Programs that have ended by themselves.
    pub(crate) fn dead(&mut self) -> Vec<String> {
        let dead = self.programs.iter_mut().filter_map(|(name, program)| (!program.is_running()).then_some(*name));
        dead.map(|name| format!("{}: {name}", self.name)).collect()
    }

    /// Ends the programs in their order, the bridge first, and reads what was recorded.
    pub(crate) fn end(self) -> Ended {
        self.over.store(true, Ordering::Relaxed);
        let steered = self.steering.join().expect("the steering hand");
        let programs = self.programs.into_iter().map(|(name, program)| (name, program.interrupt())).collect();
        Ended { name: self.name, programs, steered, rows: Rows::of(&self.clip) }
    }
}

/// Process id of the recorder that a bridge started.
fn recorder_of(bridge: u32) -> Option<u32> {
    let children = std::fs::read_to_string(format!("/proc/{bridge}/task/{bridge}/children")).ok()?;
    children.split_whitespace().find_map(|pid| pid.parse().ok())
}

/// Steers the arm from place to place until it is over, and judges every command and state meanwhile.
fn steer(domain: &str, judge: Judge, over: &AtomicBool) -> Steered {
    let node = Node::open_in(domain, "soak").expect("shared memory");
    let targets = node.publisher(topics::ARM_TARGET).expect("a place to send targets");
    let commands = node.subscriber(topics::ARM_COMMAND).expect("a place to read");
    let states = node.subscriber(topics::ARM_STATE).expect("a place to read");
    let mut random = Pcg64::seed_from_u64(1);
    let mut steered = Steered { judge, stopped: 0, places: 0 };
    let (mut stream, mut sent, mut q) = (1, REPEATED, MIDDLE);
    while !over.load(Ordering::Relaxed) {
        let mut newest = None::<ArmState>;
        while let Some(state) = states.receive().expect("a state") {
            steered.judge.state(&state);
            newest = Some(state);
        }
        while let Some(command) = commands.receive().expect("a command") {
            steered.judge.command(&command);
        }
        let stopped = newest.is_some_and(|state| {
            state.motion_id == stream && [MotionStatus::Braked, MotionStatus::Refused].contains(&state.motion)
        });
        if stopped {
            steered.stopped += 1;
            stream += 1;
        }
        if sent == REPEATED {
            (sent, steered.places) = (0, steered.places + 1);
            q = MIDDLE;
            q.iter_mut().take(7).for_each(|q| *q += random.random_range(-REACH..REACH));
        }
        sent += 1;
        let target = ArmTarget {
            stamp_ns: now_ns(),
            stream,
            kind: TargetKind::Joints,
            dof: 7,
            speed: SPEED,
            q,
            ..ArmTarget::default()
        };
        targets.send(&target).expect("a target sent");
        std::thread::sleep(PERIOD);
    }
    steered.judge.overlooked = commands.ignored() + states.ignored();
    steered
}

/// A cell that has ended.
pub(crate) struct Ended {
    pub(crate) name: &'static str,
    programs: Vec<(&'static str, Finished)>,
    steered: Steered,
    rows: Result<Rows, String>,
}

impl Ended {
    /// What went wrong, a sentence each.
    pub(crate) fn wrong(&self) -> Vec<String> {
        let failed = self.programs.iter().filter(|(_, end)| !end.status.success());
        let mut wrong: Vec<String> = failed
            .map(|(name, end)| {
                format!("{name}: {}, {}", end.status, end.stderr.lines().last().unwrap_or("without a word"))
            })
            .collect();
        let Steered { judge, stopped, places } = &self.steered;
        wrong.extend(judge.exceeded().into_iter().map(|limit| format!("exceeded: {limit}")));
        if *stopped > 0 {
            wrong.push(format!("{stopped} of {places} ways were braked or refused unasked"));
        }
        if judge.moved == 0 {
            wrong.push("the arm was never moved".to_owned());
        }
        match &self.rows {
            Err(what) => wrong.push(format!("the clip: {what}")),
            Ok(Rows { damage: Some(damage), .. }) => wrong.push(format!("the clip: {damage}")),
            Ok(Rows { unnamed, .. }) if *unnamed > 0 => {
                wrong.push(format!("{unnamed} states are missing in the clip without a word"))
            }
            Ok(_) => {}
        }
        wrong.iter().map(|what| format!("{}: {what}", self.name)).collect()
    }

    pub(crate) fn json(&self) -> Value {
        let said: serde_json::Map<_, _> = self
            .programs
            .iter()
            .map(|(name, end)| ((*name).to_owned(), serde_json::from_str(&end.stdout).unwrap_or(Value::Null)))
            .collect();
        let worst: serde_json::Map<_, _> =
            self.steered.judge.worst().iter().map(|(what, ratio)| ((*what).to_owned(), json!(ratio))).collect();
        let rows = self.rows.as_ref().ok().map(
            |rows| json!({ "states": rows.states, "missing": rows.missing, "missing_without_a_word": rows.unnamed }),
        );
        json!({
            "programs": said, "worst_ratio": worst, "ways": self.steered.places, "stopped_unasked": self.steered.stopped,
            "commands": self.steered.judge.judged[0], "states": self.steered.judge.judged[1], "clip": rows,
        })
    }
}
