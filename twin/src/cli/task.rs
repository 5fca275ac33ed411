//! `twin task`: a task's bodies placed and simulated; did they come to rest, where, and was it a success.

use crate::task::{Episode, Run, Task as TaskFile};
use anyhow::Context as _;
use serde::Serialize;
use shared_mem::answer;
use shared_mem::origin::Origin;
use shared_mem::output::Destination;
use shared_mem::progress::Progress;
use shared_mem::quantity::seconds;
use shared_mem::recording::{ClipInfo, write_episode};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Places the bodies of a task, simulates them, and says whether they come to rest, where, and whether it is a success.
#[derive(clap::Args)]
#[command(after_help = "\
A task file holds bodies of convex pieces (free, on joints, held, moved), where they may start, what counts as success, and
a scripted motion; docs/tasks.md has every key. An episode ends with success, or after the task's horizon. With --record each
episode becomes a clip of its own in a folder, named by its seed; those that are finished stay whatever happens to the rest.

Examples:
  twin task push_milk
  twin task stack_boxes --seed 3 --duration 5
  twin task close_laptop --episodes 50 --out laptop.json
  twin task pick_carrot --episodes 50 --noise 0.003 --record carrot
  twin task pick_carrot --json

JSON: task, successes, and for each of episodes seed, duration_s, at_rest, at_rest_since_s, success, progress (0 to 1: how far it
came), missed (conditions that did not hold at the end), arm_fault (what the arm cannot do of the motion), contacts (names of bodies that press on each other), and bodies: name, start and end (position, orientation_wxyz, joint), speed_m_s.")]
pub struct Task {
    /// The task file, or a name of those that are built in: push_milk, stack_boxes, pick_carrot, close_laptop
    #[arg(value_name = "TASK.toml")]
    file: PathBuf,
    /// The start of the first episode; the others follow it
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: u64,
    /// Episodes, each with its own start
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    episodes: u32,
    /// Simulated time of an episode, at most [default: the task's horizon]
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Duration>,
    /// One sigma of what is added to the script's way points along each axis; the start's seed draws it too
    #[arg(long, value_name = "METRES", default_value_t = 0.0, value_parser = noise)]
    noise: f64,
    /// Writes each episode into this folder as a clip, `episode_SEED.mcap`
    #[arg(long, value_name = "FOLDER")]
    record: Option<PathBuf>,
    /// Writes the JSON answer to a file as well
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// Replaces files that are there already
    #[arg(long)]
    force: bool,
    /// Prints one JSON object on stdout at the end
    #[arg(long)]
    json: bool,
}

/// The whole answer.
#[derive(Serialize)]
struct Answer {
    task: String,
    successes: usize,
    episodes: Vec<Episode>,
}

impl Task {
    pub(crate) fn run(&self) -> anyhow::Result<()> {
        super::discard_on_signal()?;
        let task = TaskFile::read(&self.file)?;
        let place = Destination::of(self.out.as_deref(), self.force)?;
        let duration = self.duration.map_or(task.horizon(), |duration| duration.as_secs_f64());
        let bar = Progress::new("task", self.episodes.into());
        let mut episodes = Vec::new();
        for i in 0..u64::from(self.episodes) {
            let seed = self.seed.checked_add(i).context("--seed is too large for so many --episodes")?;
            let run = Run { seed, duration, noise: self.noise };
            let outcome = match &self.record {
                Some(folder) => self.recorded(folder, &task, &run),
                None => task.episode(&run).map_err(anyhow::Error::from),
            };
            episodes.push(outcome.with_context(|| format!("seed {seed}"))?);
            bar.show(i + 1, "");
        }
        drop(bar);
        let successes = episodes.iter().filter(|episode| episode.success).count();
        let answer = Answer { task: self.file.display().to_string(), successes, episodes };
        if let Some(place) = place {
            let mut output = place.begin()?;
            output.write_all(&serde_json::to_vec_pretty(&answer)?)?;
            output.finish()?;
        }
        if self.json {
            answer::json(&answer)?;
        } else {
            answer::words(answer.words())?;
        }
        Ok(())
    }

    /// Runs an episode and writes its clip.
    fn recorded(&self, folder: &Path, task: &TaskFile, run: &Run) -> anyhow::Result<Episode> {
        let place = Destination::in_new_folder(&folder.join(format!("episode_{:06}.mcap", run.seed)), self.force)?;
        let (episode, rows) = task.demonstration(run)?;
        let info = ClipInfo {
            configuration: task.text().to_owned(),
            program: concat!("twin ", env!("CARGO_PKG_VERSION"), " task").to_owned(),
            cell_toml: (!task.arm_joints().is_empty()).then(|| ARM_CELL.to_owned()),
            origins: Origin::Simulation.into(),
            ..ClipInfo::default()
        };
        write_episode(place.begin()?, &info, &rows)?;
        Ok(episode)
    }
}

/// What a clip's cell is where an arm carries something.
pub(crate) const ARM_CELL: &str = "[robot]\nmodel = \"fr3\"\n";

/// A length that is not negative [m].
fn noise(text: &str) -> Result<f64, String> {
    let wanted = "give metres from 0 to 1, as 0.003";
    text.parse().ok().filter(|noise| (0.0..=1.0).contains(noise)).ok_or_else(|| wanted.to_owned())
}

impl Answer {
    fn words(&self) -> String {
        let mut text = String::new();
        for episode in &self.episodes {
            let rest = match episode.at_rest_since_s {
                Some(since) => format!("at rest since {since:.3} s"),
                None => {
                    let fastest = episode.bodies.iter().max_by(|a, b| a.speed_m_s.total_cmp(&b.speed_m_s));
                    let named = |body: &crate::task::BodyEnd| format!(", `{}` at {:.3} m/s", body.name, body.speed_m_s);
                    format!("not at rest{}", fastest.map_or(String::new(), named))
                }
            };
            let outcome = if episode.success { "success" } else { "no success" };
            let fault = episode.arm_fault.as_ref().map_or(String::new(), |fault| format!("; the arm: {fault}"));
            let _ = writeln!(text, "seed {}: {outcome} after {:.3} s, {rest}{fault}", episode.seed, episode.duration_s);
        }
        match self.episodes.as_slice() {
            [episode] => {
                for body in &episode.bodies {
                    let [x, y, z] = body.end.position;
                    let joint = body.end.joint.map_or(String::new(), |at| format!("  joint {at:.4}"));
                    let _ = writeln!(text, "  {:16} {x:8.4} {y:8.4} {z:8.4} m{joint}", body.name);
                }
            }
            episodes => {
                let _ = writeln!(text, "{} of {} episodes are a success", self.successes, episodes.len());
            }
        }
        text
    }
}
