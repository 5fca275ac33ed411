//! One of the project's programs, running as a process.

use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;
use shared_mem::parent;
use std::ffi::OsStr;
use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Where cargo put a program: beside the folder of this test's own binary.
///
/// # Panics
/// When the program was not built: the scenarios run with the whole workspace.
pub fn program_path(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("this test's own path");
    let profile = test.ancestors().find(|p| p.join(name).is_file());
    profile
        .map(|p| p.join(name))
        .unwrap_or_else(|| panic!("{name} is not built; run `cargo test --release --workspace`"))
}

/// A running program. Dropping it kills it.
#[derive(Debug)]
pub struct Program {
    name: String,
    child: Child,
    stdout: Option<JoinHandle<String>>,
    stderr: Option<JoinHandle<String>>,
}

/// How a program ended.
#[derive(Debug)]
pub struct Finished {
    /// Its exit status.
    pub status: ExitStatus,
    /// What it wrote.
    pub stdout: String,
    /// What it said on the side.
    pub stderr: String,
    /// From the request to end, or the start of waiting, to the end.
    pub took: Duration,
}

impl Program {
    /// Starts a program in a domain of shared memory. One that would run on ends when this process is killed.
    ///
    /// # Panics
    /// When it cannot be started.
    #[must_use]
    pub fn start(name: &str, domain: &str, arguments: &[&str]) -> Self {
        Self::start_through(&[], name, domain, arguments)
    }

    /// The same by way of another program and its arguments, as `setpriv`, which has to become the one that it starts.
    ///
    /// # Panics
    /// When it cannot be started.
    #[must_use]
    pub fn start_through(through: &[&str], name: &str, domain: &str, arguments: &[&str]) -> Self {
        let runs_on =
            arguments.first().is_some_and(|verb| ["run", "serve", "record", "shadow", "show", "teleop"].contains(verb));
        let own_id = std::process::id().to_string();
        let parent: &[&str] = if runs_on { &[parent::FLAG, &own_id] } else { &[] };
        let path = program_path(name);
        let words: Vec<&OsStr> = through.iter().map(OsStr::new).chain([path.as_os_str()]).collect();
        let mut child = Command::new(words[0])
            .args(&words[1..])
            .args(arguments)
            .args(parent)
            .env("TWINALIGN_DOMAIN", domain)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|e| panic!("{name} does not start: {e}"));
        let stdout = child.stdout.take().map(collect);
        let stderr = child.stderr.take().map(collect);
        Self { name: name.to_owned(), child, stdout, stderr }
    }

    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// `true` until the process has ended.
    pub fn is_running(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Dies at once, as by a power cut. The process is waited for: a zombie would look alive to the others.
    pub fn kill_without_warning(&mut self) {
        self.signal(Signal::KILL);
        let _status = self.child.wait();
    }

    /// Asks it to end, as Ctrl-C does, and waits.
    ///
    /// # Panics
    /// When it does not end within 20 s.
    pub fn interrupt(self) -> Finished {
        self.end_by(Signal::INT)
    }

    /// Asks it to end by a signal, and waits.
    ///
    /// # Panics
    /// When it does not end within 20 s.
    pub fn end_by(self, signal: Signal) -> Finished {
        self.signal(signal);
        self.wait(Duration::from_secs(20))
    }

    /// Whether it has a handler for the signal.
    pub fn listens_to(&self, signal: Signal) -> bool {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.pid())).unwrap_or_default();
        let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
        let mask = mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
        mask >> (signal.as_raw() - 1) & 1 == 1
    }

    /// Waits for the end.
    ///
    /// # Panics
    /// When it does not come within `limit`; the message holds what the program said.
    pub fn wait(mut self, limit: Duration) -> Finished {
        let start = Instant::now();
        let status = loop {
            if let Ok(Some(status)) = self.child.try_wait() {
                break Some(status);
            }
            if start.elapsed() > limit {
                break None;
            }
            std::thread::sleep(Duration::from_millis(5));
        };
        let took = start.elapsed();
        if status.is_none() {
            self.kill_without_warning();
        }
        let stdout = self.stdout.take().and_then(|t| t.join().ok()).unwrap_or_default();
        let stderr = self.stderr.take().and_then(|t| t.join().ok()).unwrap_or_default();
        let status = status.unwrap_or_else(|| panic!("{} did not end within {limit:?}; it said:\n{stderr}", self.name));
        Finished { status, stdout, stderr, took }
    }

    fn signal(&self, signal: Signal) {
        let pid = i32::try_from(self.child.id()).ok().and_then(Pid::from_raw);
        if let Some(pid) = pid {
            let _gone_already = kill_process(pid, signal);
        }
    }
}

impl Drop for Program {
    fn drop(&mut self) {
        let _ended_already = self.child.kill();
        let _status = self.child.wait();
    }
}

impl Finished {
    /// The one JSON object on standard output.
    ///
    /// # Panics
    /// When there is anything else: the message holds all the program said.
    pub fn json(&self) -> Value {
        serde_json::from_str(&self.stdout)
            .unwrap_or_else(|e| panic!("no JSON object ({e}) on stdout:\n{}\nstderr:\n{}", self.stdout, self.stderr))
    }

    /// Asserts success.
    ///
    /// # Panics
    /// When the program failed; the message holds what it said.
    pub fn succeeded(self) -> Self {
        assert!(self.status.success(), "ended with {}:\n{}", self.status, self.stderr);
        self
    }

    /// The last line on standard error of a program that failed with exit code 1: what a person reads.
    ///
    /// # Panics
    /// When it ended otherwise.
    pub fn complaint(&self) -> &str {
        assert_eq!(self.status.code(), Some(1), "expected exit code 1; it said:\n{}\n{}", self.stdout, self.stderr);
        self.stderr.trim_end().lines().last().unwrap_or("")
    }
}

fn collect(mut pipe: impl Read + Send + 'static) -> JoinHandle<String> {
    std::thread::spawn(move || {
        let mut text = Vec::new();
        let _closed = pipe.read_to_end(&mut text);
        String::from_utf8_lossy(&text).into_owned()
    })
}
