//! `twin shadow`: mirrors a running bridge and publishes the gap.

use super::look::Look;
#[cfg(feature = "viewer")]
use crate::render::LiveView;
use crate::shadow::live::{Live, Watcher};
use crate::shadow::{Mirrored, Shadow as Twin, Summary};
use anyhow::{Context as _, bail};
use clap::Args;
use shared_mem::cell::Cell;
use shared_mem::parent;
use shared_mem::quantity::seconds;
use shared_mem::theta::Theta;
use shared_mem::typed::Command;
use shared_mem::{answer, console};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// Mirror a running cell in simulation and publish how far the two are apart.
///
/// Attaches to `rt_bridge run` through shared memory, whichever of the two is started first, and survives its restarts.
/// Where no state comes within --wait it ends with exit code 1. Sends the twin's state on /twin/state, the gap on
/// /twin/gap and that of each object with a name on /twin/objects.
#[derive(Args)]
#[command(after_help = "Examples:\n  \
    twin shadow --cell fr3                       until Ctrl-C, gap on the terminal\n  \
    twin shadow --cell fr3 --viewer              in Foxglove or Lichtblick: ws://127.0.0.1:8765\n  \
    twin shadow --cell cell.toml --viewer --splats fr3_splats     the twin's pictures from a scanned robot\n  \
    twin shadow --cell cell.toml --parameters theta.toml --duration 60 --json\n\n\
    JSON: cycles, real_time_factor, dropped, alignments, age_us, gap (joint_rms_rad, object_add_m, object_add_s_m, and\n\
    objects: add_m and add_s_m of each by its name); null for what was not measured.")]
pub struct Shadow {
    /// What is known about the cell: the same file, or `fr3`, that the bridge runs with
    #[arg(long, value_name = "CELL.toml")]
    cell: PathBuf,
    /// Identified parameters for the twin
    #[arg(long, value_name = "THETA.toml")]
    parameters: Option<PathBuf>,
    /// How long to wait for the first state of a bridge [s]
    #[arg(long, value_name = "SECONDS", value_parser = seconds, default_value = "30")]
    wait: Duration,
    /// Stop after so many seconds; without it, on Ctrl-C
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    duration: Option<Duration>,
    /// Show robot and twin in 3D, and the camera's picture beside the twin's: a Foxglove WebSocket on 127.0.0.1:8765
    #[arg(long)]
    viewer: bool,
    #[command(flatten)]
    look: Look,
    /// End when this process is no longer our parent
    #[arg(long, hide = true)]
    parent: Option<u32>,
    /// One JSON object with the figures on stdout at the end
    #[arg(long)]
    json: bool,
}

impl Shadow {
    /// Runs until its duration is over, a signal asks it to end, or no bridge comes.
    pub(crate) fn run(self) -> anyhow::Result<()> {
        let cell = Cell::read(&self.cell)?;
        let theta = self.parameters.as_deref().map(Theta::read).transpose()?.map(|theta| theta.about(&cell));
        let mut shadow = Twin::new(&cell, theta.as_ref())?;
        let stop = Arc::new(AtomicBool::new(false));
        if let Some(parent) = self.parent {
            let stop = Arc::clone(&stop);
            parent::when_gone(parent, move || stop.store(true, Ordering::Relaxed))?;
        }
        let on_signal = Arc::clone(&stop);
        ctrlc::set_handler(move || on_signal.store(true, Ordering::Relaxed)).context("cannot listen for Ctrl-C")?;
        let viewer = self.viewer.then(|| viewer(&cell, &self.look, &stop)).transpose()?;
        let mut terminal = Terminal::new(&self.cell);
        let begin = Instant::now();
        let outcome = Live::open()?.run(&mut shadow, (self.wait, self.duration), &stop, &mut terminal);
        let waited = begin.elapsed();
        console::status("");
        stop.store(true, Ordering::Relaxed);
        if let Some(viewer) = viewer {
            viewer.join().map_err(|_| anyhow::anyhow!("the viewer crashed; start without --viewer"))??;
        }
        let (busy_s, summary) = (outcome?, shadow.summary());
        let text = summary.text(busy_s);
        if self.json {
            answer::json(&summary.json(busy_s))?;
        } else if let Some(text) = &text {
            answer::words(text)?;
        }
        match text {
            Some(_) => Ok(()),
            None => bail!(why_nothing(&summary, &self.cell, waited)),
        }
    }
}

/// Why nothing was mirrored, and what to do.
fn why_nothing(summary: &Summary, cell: &Path, waited: Duration) -> String {
    match summary.dropped {
        0 => format!(
            "no arm state came within {:.1} s, so nothing was mirrored; start a bridge with {}",
            waited.as_secs_f64(),
            bridge(cell)
        ),
        dropped => format!(
            "none of {dropped} arm states could be mirrored: they came late or held no numbers; give the twin a core of its own"
        ),
    }
}

/// The command that starts a bridge for this cell.
fn bridge(cell: &Path) -> String {
    let command = Command::new("rt_bridge run").option("--cell", cell).words("--arm sim");
    format!("`{command}` (a robot: --arm fci://HOST)")
}

type ViewerThread = std::thread::JoinHandle<anyhow::Result<()>>;

#[cfg(feature = "viewer")]
fn viewer(cell: &Cell, look: &Look, stop: &Arc<AtomicBool>) -> anyhow::Result<ViewerThread> {
    let camera = cell.camera.as_ref();
    let pictures = camera.map(|camera| Ok::<_, anyhow::Error>(LiveView::new(look.view(cell)?, camera.latency)));
    let viewer = crate::viewer::Viewer::start(cell, pictures.transpose()?)?;
    console::line(format_args!("viewer: open {} in Foxglove or Lichtblick", viewer.address()));
    let stop = Arc::clone(stop);
    Ok(std::thread::Builder::new().name("viewer".into()).spawn(move || Ok(viewer.run(&stop)?))?)
}

#[cfg(not(feature = "viewer"))]
fn viewer(_: &Cell, _: &Look, _: &Arc<AtomicBool>) -> anyhow::Result<ViewerThread> {
    anyhow::bail!("this program was built without its viewer; build with `--features viewer`, or leave --viewer out")
}

/// Shows the gap on stderr: a status on a terminal, a line a second elsewhere.
struct Terminal<'a> {
    shown: Instant,
    cell: &'a Path,
}

impl<'a> Terminal<'a> {
    fn new(cell: &'a Path) -> Self {
        Self { shown: Instant::now(), cell }
    }
}

impl Watcher for Terminal<'_> {
    fn remark(&mut self, text: &str) {
        console::line(format_args!("twin: {text}"));
    }

    fn silent(&mut self, patience: Option<Duration>) {
        let waiting = match patience {
            Some(patience) => format!("waiting {:.0} s for", patience.as_secs_f64()),
            None => "waiting for".to_owned(),
        };
        self.remark(&format!("no arm state for a second; {waiting} {}", bridge(self.cell)));
    }

    fn mirrored(&mut self, mirrored: &Mirrored) {
        let pause = Duration::from_millis(if console::is_terminal() { 100 } else { 1000 });
        if self.shown.elapsed() < pause {
            return;
        }
        self.shown = Instant::now();
        let line = status_line(mirrored);
        if console::is_terminal() {
            console::status(&line);
        } else {
            console::line(line);
        }
    }
}

/// `cycle 12345  gap 12.3 µrad RMS (joint 2)  object ADD 1.2 mm  contact 0.0 N  age 35 µs`
fn status_line(mirrored: &Mirrored) -> String {
    let Mirrored { state, gap, .. } = mirrored;
    let dof = gap.dof as usize;
    let (joint, worst) =
        gap.joint_rms.iter().take(dof).enumerate().fold((0, 0.0), |m, (i, v)| if *v > m.1 { (i, *v) } else { m });
    let object = if gap.object_add_m.is_nan() {
        "no object seen".to_owned()
    } else {
        format!("object ADD {:.2} mm", gap.object_add_m * 1e3)
    };
    format!(
        "cycle {}  gap {:.1} µrad RMS (joint {})  {object}  contact {:.1} N  age {:.0} µs",
        gap.cycle,
        worst * 1e6,
        joint + 1,
        state.contact_force,
        gap.age_ns as f64 * 1e-3,
    )
}
