//! Two hosts: network namespaces with a cable (veth) between them, and a domain of shared memory for each.

use super::bare::ROLE;
use rt_bridge::rt::process::ask_to_end;
use serde_json::Value;
use std::io::Read as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// Where links listen.
pub(crate) const PORT: u16 = 7447;

/// Before the answer of a peer, among what a test program says.
pub(crate) const ANSWER: &str = "answer: ";
/// The test that plays the peers.
const PEER: [&str; 4] = ["--exact", "peer", "--ignored", "--nocapture"];

/// Two hosts; they are gone when this is dropped.
pub(crate) struct Hosts {
    robot: String,
    far: String,
    /// Domain of the robot's host.
    pub(crate) robot_domain: String,
    /// Domain of the other one.
    pub(crate) far_domain: String,
}

fn ip(arguments: &[&str]) {
    let status = Command::new("ip").args(arguments).status().expect("ip");
    assert!(status.success(), "ip {}: {status}; this test needs root", arguments.join(" "));
}

impl Hosts {
    /// Makes them; `name` keeps tests of one process apart.
    pub(crate) fn new(name: &str) -> Self {
        let of = |host: &str| format!("ta{host}{name}{}", std::process::id());
        let [robot, far] = [of("r"), of("f")];
        for namespace in [&robot, &far] {
            ip(&["netns", "add", namespace]);
        }
        ip(&["link", "add", "cable", "netns", &robot, "type", "veth", "peer", "name", "cable", "netns", &far]);
        for (namespace, address) in [(&robot, "10.213.7.1/24"), (&far, "10.213.7.2/24")] {
            ip(&["-n", namespace, "address", "add", address, "dev", "cable"]);
            ip(&["-n", namespace, "link", "set", "cable", "up"]);
            ip(&["-n", namespace, "link", "set", "lo", "up"]);
        }
        let domain = |host: &str| format!("link{host}{name}{}", std::process::id());
        Self { robot, far, robot_domain: domain("r"), far_domain: domain("f") }
    }

    /// An address of the robot's host.
    pub(crate) fn robot_endpoint(&self, port: u16) -> String {
        format!("tcp/10.213.7.1:{port}")
    }

    /// Pulls the cable out at one end, or puts it in again.
    pub(crate) fn cable(&self, is_robots_end: bool, is_in: bool) {
        let namespace = if is_robots_end { &self.robot } else { &self.far };
        ip(&["-n", namespace, "link", "set", "cable", if is_in { "up" } else { "down" }]);
    }

    /// Runs `rt_bridge link` on the robot's host.
    pub(crate) fn link_on_robot(&self, arguments: &[&str]) -> Running {
        let arguments = [&["link", "--json"], arguments].concat();
        Running::start(&self.robot, &self.robot_domain, env!("CARGO_BIN_EXE_rt_bridge").as_ref(), &arguments, "")
    }

    /// Runs `rt_bridge link` on the other host.
    pub(crate) fn link_on_far(&self, arguments: &[&str]) -> Running {
        let arguments = [&["link", "--json"], arguments].concat();
        Running::start(&self.far, &self.far_domain, env!("CARGO_BIN_EXE_rt_bridge").as_ref(), &arguments, "")
    }

    /// Runs a peer on the robot's host.
    pub(crate) fn peer_on_robot(&self, role: &str) -> Running {
        let program = std::env::current_exe().expect("this program");
        Running::start(&self.robot, &self.robot_domain, &program, &PEER, role)
    }

    /// Runs a peer on the other host.
    pub(crate) fn peer_on_far(&self, role: &str) -> Running {
        let program = std::env::current_exe().expect("this program");
        Running::start(&self.far, &self.far_domain, &program, &PEER, role)
    }
}

impl Drop for Hosts {
    fn drop(&mut self) {
        for namespace in [&self.robot, &self.far] {
            let _left = Command::new("ip").args(["netns", "delete", namespace]).status();
        }
    }
}

/// A program in a namespace. Dropping it kills it.
pub(crate) struct Running {
    child: Child,
    what: String,
}

impl Running {
    fn start(namespace: &str, domain: &str, program: &Path, arguments: &[&str], role: &str) -> Self {
        // `ip netns exec` becomes the program: it has its process id.
        let child = Command::new("ip")
            .args(["netns", "exec", namespace])
            .arg(program)
            .args(arguments)
            .env(ROLE, role)
            .env("TWINALIGN_DOMAIN", domain)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .spawn()
            .expect("ip");
        Self { child, what: format!("{} {role}", arguments.join(" ")) }
    }

    /// Waits for the end.
    pub(crate) fn ended(mut self, limit: Duration) {
        let begin = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().expect("a child") {
                assert!(status.success(), "{}: {status}", self.what);
                return;
            }
            assert!(begin.elapsed() < limit, "{} does not end", self.what);
            std::thread::sleep(Duration::from_millis(10));
        }
    }

    /// Waits for the end and returns the JSON object.
    pub(crate) fn answer(mut self, limit: Duration) -> Value {
        let mut stdout = self.child.stdout.take().expect("a pipe");
        let what = self.what.clone();
        self.ended(limit);
        let mut text = String::new();
        stdout.read_to_string(&mut text).expect("UTF-8");
        let answer = text.lines().find_map(|line| line.strip_prefix(ANSWER).or(line.strip_prefix('{').map(|_| line)));
        let answer = answer.unwrap_or_else(|| panic!("{what} said {text:?}"));
        serde_json::from_str(answer).unwrap_or_else(|e| panic!("{what}: {e}"))
    }

    /// Asks a link to end, which it does within a second; returns the JSON object.
    pub(crate) fn interrupted(self) -> Value {
        ask_to_end(self.child.id()).unwrap_or_else(|e| panic!("{}: {e}", self.what));
        let begin = Instant::now();
        let answer = self.answer(Duration::from_secs(10));
        assert!(begin.elapsed() < Duration::from_secs(1), "it took {:?} to end", begin.elapsed());
        answer
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ended_already = self.child.kill();
        let _status = self.child.wait();
    }
}
