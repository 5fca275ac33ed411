//! `twin teleop`: a task's arm steered at a page in a browser, and recorded.

use super::host_name;
use crate::task::Task;
use crate::teleop::{Recording, serve};
use crate::web::Address;
use anyhow::Context as _;
use shared_mem::quantity::seconds;
use shared_mem::{answer, origin::Origin, recording::ClipInfo};
use shared_mem::{console, parent};
use std::net::{IpAddr, Ipv4Addr};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Lets a person steer the arm of a task at a page in a browser, and records what it does.
#[derive(clap::Args)]
#[command(after_help = "\
The page shows the task through one of its cameras; keys, buttons or a gamepad jog the flange or single joints and open and close
the gripper. An episode begins at a button and ends with success, at a button, or after --duration; with --record each that is
kept becomes a clip, as with `twin task --record`. The first page steers, others watch. docs/teleop.md has keys and messages.

Examples:
  twin teleop --task pick_carrot
  twin teleop --task pick_carrot --record carrot
  twin teleop --task push_milk --record milk --seed 100 --bind 0.0.0.0 --port 8400
  twin teleop --task push_milk --bind 0.0.0.0 --name bench.lab.example

Escape stops: the arm holds until an episode is started. Every page can stop, also one that watches.

Ctrl-C ends it; an episode that is under way is discarded, and that is said.

JSON: task, kept, successes, discarded, cut_short (the seed of an episode that was under way at the end), clips.")]
pub struct Teleop {
    /// The task file, which needs an [arm] and a [[camera]]; or a name of those that are built in: push_milk, stack_boxes, pick_carrot, close_laptop
    #[arg(long, value_name = "TASK.toml")]
    task: PathBuf,
    /// Writes each episode that is kept into this folder as a clip, `episode_SEED.mcap`
    #[arg(long, value_name = "FOLDER")]
    record: Option<PathBuf>,
    /// The start of the first episode; the others follow it, but for those whose clip is there
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Which of the task's cameras is shown [default: the first]
    #[arg(long, value_name = "NAME")]
    camera: Option<String>,
    /// Simulated time of an episode, at most
    #[arg(long, value_name = "SECONDS", default_value = "120", value_parser = seconds)]
    duration: Duration,
    /// Address of this machine on which the page is; others than the loopback's let every machine that reaches it steer
    #[arg(long, value_name = "ADDRESS", default_value_t = IpAddr::V4(Ipv4Addr::LOCALHOST))]
    bind: IpAddr,
    /// A name by which other machines open the page, beside this machine's own and its addresses; again for others. By other names
    /// it is refused: a page of their owner would count as this one
    #[arg(long = "name", value_name = "NAME", value_parser = host_name)]
    names: Vec<String>,
    /// Port of the page; 0: any that is free
    #[arg(long, value_name = "PORT", default_value_t = 8380)]
    port: u16,
    /// Replaces clips that are there already
    #[arg(long)]
    force: bool,
    /// End when this process is no longer our parent
    #[arg(long, hide = true)]
    parent: Option<u32>,
    /// Prints one JSON object on stdout at the end
    #[arg(long)]
    json: bool,
}

impl Teleop {
    pub(crate) fn run(self) -> anyhow::Result<()> {
        let stop = Arc::new(AtomicBool::new(false));
        let stopping = Arc::clone(&stop);
        ctrlc::set_handler(move || stopping.store(true, Ordering::Relaxed)).context("cannot listen for Ctrl-C")?;
        if let Some(parent) = self.parent {
            let stopping = Arc::clone(&stop);
            parent::when_gone(parent, move || stopping.store(true, Ordering::Relaxed))?;
        }
        let task = Arc::new(Task::read(&self.task)?);
        let recording = Recording {
            folder: self.record,
            force: self.force,
            seed: self.seed,
            longest: self.duration.as_secs_f64(),
            info: ClipInfo {
                configuration: task.text().to_owned(),
                program: concat!("twin ", env!("CARGO_PKG_VERSION"), " teleop").to_owned(),
                cell_toml: Some(super::task::ARM_CELL.to_owned()),
                origins: Origin::Simulation.into(),
                ..ClipInfo::default()
            },
        };
        let address = Address { ip: self.bind, port: self.port, names: self.names };
        let camera = self.camera.as_deref();
        let summary = serve(&task, camera, recording, &address, &stop, |at| {
            console::line(format_args!("open http://{at}/ in a browser; Ctrl-C ends"));
        })?;
        if let Some(seed) = summary.cut_short {
            console::line(format_args!(
                "episode {seed} was under way and is discarded; --seed {seed} begins with it again"
            ));
        }
        if self.json {
            let mut json = serde_json::to_value(&summary)?;
            json["task"] = self.task.display().to_string().into();
            answer::json(&json)?;
        } else {
            let (kept, successes, discarded) = (summary.kept, summary.successes, summary.discarded);
            answer::words(format!("{kept} episodes kept, {successes} of them a success; {discarded} discarded"))?;
        }
        Ok(())
    }
}
