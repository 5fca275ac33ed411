//! The live half of the demo: bridge and twin as two processes that meet in a private corner of shared memory.

use anyhow::{Context as _, bail};
use capture::processes::{Program, Running, arguments};
use inference::interrupt::Interrupt;
use serde_json::Value;
use shared_mem::msg::twin::TwinGap;
use shared_mem::topics::TWIN_GAP;
use shared_mem::transport::{Node, Subscriber};
use std::path::Path;
use std::time::{Duration, Instant};

/// How long bridge and twin may take until the twin shadows the arm.
const START: Duration = Duration::from_secs(20);

/// Bridge and twin at work. Dropped, both are ended.
#[derive(Debug)]
pub(super) struct Stage {
    twin: Running,
    bridge: Running,
    gap: LiveGap,
}

/// What bridge and twin said at their end.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Answers {
    /// `rt_bridge run --json`.
    pub(super) bridge: Value,
    /// `twin shadow --json`.
    pub(super) twin: Value,
}

impl Stage {
    /// Starts the simulated cell of `cell` with the truth in `hidden` (gains, effect), and a twin that does not know it.
    ///
    /// # Errors
    /// When a program is missing, ends, or the twin does not begin to shadow; the line holds its last words.
    pub(super) fn start(
        cell: &Path,
        [gains, effect]: [&Path; 2],
        domain: &str,
        interrupt: &Interrupt,
    ) -> anyhow::Result<Self> {
        let run = [&"run" as &dyn AsRef<std::ffi::OsStr>, &"--cell", &cell, &"--arm", &"sim", &"--camera", &"off"];
        // The robot's own controller, whose gains are the hidden ones, and not the bridge's, which follows cell.toml.
        let mut list = arguments(run);
        list.extend(arguments([&"--parameters", &gains, &"--effects", &effect]));
        list.extend(arguments([&"--controller", &"joint_impedance", &"--json"]));
        let bridge = Running::start(Program::Bridge, &list, Some(domain))?;
        let twin = Running::start(Program::Twin, &arguments([&"shadow", &"--cell", &cell, &"--json"]), Some(domain))?;
        let mut stage = Self { twin, bridge, gap: LiveGap::open(domain)? };
        let start = Instant::now();
        while stage.gap.look()?.is_none() {
            stage.check()?;
            if interrupt.asked() {
                bail!("ended before the twin was ready");
            }
            if start.elapsed() > START {
                bail!("the twin published no gap within {} s; run `rt_bridge doctor` to see why", START.as_secs());
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        Ok(stage)
    }

    /// An error with last words when one of the two has ended by itself.
    ///
    /// # Errors
    /// [`capture::processes::ProcessError::Ended`].
    pub(super) fn check(&mut self) -> anyhow::Result<()> {
        self.bridge.check()?;
        Ok(self.twin.check()?)
    }

    /// The live gap.
    pub(super) fn gap(&mut self) -> &mut LiveGap {
        &mut self.gap
    }

    /// Ends both, the twin first, and returns what they answered and the gap seen.
    ///
    /// # Errors
    /// When one of them failed or answered no JSON.
    pub(super) fn stop(self) -> anyhow::Result<(Answers, LiveGap)> {
        let parse = |name, text: String| {
            serde_json::from_str(&text).with_context(|| format!("`{name} --json` answered no JSON object: {text:?}"))
        };
        let twin = parse("twin shadow", self.twin.stop()?)?;
        let bridge = parse("rt_bridge run", self.bridge.stop()?)?;
        Ok((Answers { bridge, twin }, self.gap))
    }
}

/// The gap as the twin publishes it.
#[derive(Debug)]
pub(super) struct LiveGap {
    gaps: Subscriber<TwinGap>,
    /// Largest RMS over a second of each joint [rad].
    largest: Vec<f64>,
    newest: Option<TwinGap>,
    // Declared last: ports go before the node they belong to.
    _node: Node,
}

impl LiveGap {
    fn open(domain: &str) -> anyhow::Result<Self> {
        let node = Node::open_in(domain, "calibration demo")?;
        Ok(Self { gaps: node.subscriber(TWIN_GAP)?, largest: Vec::new(), newest: None, _node: node })
    }

    /// Takes in what arrived; the newest gap, if there ever was one.
    ///
    /// # Errors
    /// When shared memory fails.
    pub(super) fn look(&mut self) -> anyhow::Result<Option<TwinGap>> {
        while let Some(gap) = self.gaps.receive()? {
            let joints = &gap.joint_rms[..(gap.dof as usize).min(gap.joint_rms.len())];
            self.largest.resize(joints.len(), 0.0);
            for (largest, rms) in self.largest.iter_mut().zip(joints) {
                *largest = largest.max(*rms);
            }
            self.newest = Some(gap);
        }
        Ok(self.newest)
    }

    /// The gap of this moment in a few words.
    pub(super) fn words(&mut self) -> String {
        match self.look() {
            Ok(Some(gap)) => {
                let (joint, rms) = worst(&gap.joint_rms);
                format!("gap to the twin: joint {} {:.2} mrad RMS, worst", joint + 1, 1e3 * rms)
            }
            _ => String::new(),
        }
    }

    /// Largest RMS over a second of each joint, of everything taken in [rad].
    pub(super) fn largest(&self) -> &[f64] {
        &self.largest
    }
}

/// The joint with the largest value, from 0, and that value.
pub(super) fn worst(values: &[f64]) -> (usize, f64) {
    let largest = values.iter().copied().enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    largest.unwrap_or((0, 0.0))
}
