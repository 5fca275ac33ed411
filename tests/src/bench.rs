//! A cell on the test bench: its folder, its cell.toml, its private domain, its programs.

use crate::program::Program;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// The cell.toml that ships with the project.
pub fn lab_cell() -> &'static str {
    include_str!("../../config/fr3_cell.toml")
}

/// A cell with a folder of its own; gone when dropped. One at a time in a test program: several real-time loops on a
/// small machine would disturb each other.
#[derive(Debug)]
pub struct Cell {
    _turn: MutexGuard<'static, ()>,
    folder: tempfile::TempDir,
    domain: String,
}

impl Cell {
    /// The shipped cell.
    ///
    /// # Panics
    /// When the folder cannot be made.
    pub fn shipped() -> Self {
        Self::with(lab_cell())
    }

    /// A cell with this cell.toml.
    ///
    /// # Panics
    /// When the folder cannot be made.
    pub fn with(cell_toml: &str) -> Self {
        static TURN: Mutex<()> = Mutex::new(());
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let turn = TURN.lock().unwrap_or_else(PoisonError::into_inner); // a failed scenario must not fail the next
        let folder = tempfile::tempdir().expect("a temporary folder");
        std::fs::write(folder.path().join("cell.toml"), cell_toml).expect("cell.toml");
        let domain = format!("t{}-{}", std::process::id(), NEXT.fetch_add(1, Ordering::Relaxed));
        Self { _turn: turn, folder, domain }
    }

    /// Domain of shared memory that its programs meet in.
    pub fn domain(&self) -> &str {
        &self.domain
    }

    /// A path in the cell's folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// The same as text, for command lines.
    ///
    /// # Panics
    /// When the temporary folder's path is no UTF-8.
    pub fn text(&self, name: &str) -> String {
        self.path(name).to_str().expect("a UTF-8 path").to_owned()
    }

    /// Starts a program of this cell; `{cell}` in an argument becomes the path of its cell.toml, `{dir}` its folder.
    #[must_use]
    pub fn start(&self, program: &str, arguments: &[&str]) -> Program {
        let (cell, dir) = (self.text("cell.toml"), self.text(""));
        let arguments: Vec<String> =
            arguments.iter().map(|a| a.replace("{cell}", &cell).replace("{dir}/", &dir)).collect();
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        Program::start(program, &self.domain, &arguments)
    }

    /// Starts the bridge on the simulated arm and waits until its states arrive.
    ///
    /// # Panics
    /// When none arrive within 20 s.
    #[must_use]
    pub fn start_bridge(&self, more: &[&str]) -> Program {
        let mut arguments = vec!["run", "--cell", "{cell}", "--arm", "sim", "--realtime", "ignore", "--json"];
        arguments.extend(more);
        let mut bridge = self.start("rt_bridge", &arguments);
        if !self.wait_for_states(Duration::from_secs(20)) {
            let alive = bridge.is_running();
            bridge.kill_without_warning();
            let said = bridge.wait(Duration::from_secs(1));
            panic!("no arm state for 20 s (bridge running: {alive}):\n{}", said.stderr);
        }
        bridge
    }

    /// Waits until an arm state newer than this call arrives.
    ///
    /// # Panics
    /// When shared memory fails.
    pub fn wait_for_states(&self, limit: Duration) -> bool {
        let node = shared_mem::transport::Node::open_in(&self.domain, "test").expect("shared memory");
        let states = node.subscriber(shared_mem::topics::ARM_STATE).expect("a place to read");
        let start = Instant::now();
        while start.elapsed() < limit {
            if states.newest().expect("a state").is_some() {
                return true;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        false
    }

    /// Polls `condition` until it holds.
    ///
    /// # Panics
    /// When it does not within `limit`.
    pub fn until(what: &str, limit: Duration, mut condition: impl FnMut() -> bool) {
        let start = Instant::now();
        while !condition() {
            assert!(start.elapsed() < limit, "{what} did not come true within {limit:?}");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Size of a file of the cell, 0 when it does not exist.
    pub fn size(path: &Path) -> u64 {
        std::fs::metadata(path).map_or(0, |m| m.len())
    }
}
