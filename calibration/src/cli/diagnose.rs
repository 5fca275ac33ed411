//! The verb `calibration diagnose`: arguments, files, and what is printed.

use super::engine::{EngineArguments, heard};
use crate::check::gate::{self, Allowed};
use crate::diagnose::conclude::written;
use crate::diagnose::{Diagnosis, Options, diagnose_kept};
use crate::report;
use inference::interrupt::Interrupt;
use shared_mem::output::Destination;
use shared_mem::recording::Session;
use shared_mem::theta::Theta;
use shared_mem::{console, typed};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Arguments of the verb.
#[derive(Debug, clap::Args)]
#[command(after_help = "\
The twin is identified first, then every known effect is tried, alone and with others, on clips that were not used to fit
it. The verdict is none, named, class (several that these clips cannot separate), unexplained or not_testable.

Of strokes it says whose the object's gap is: the arm's, or what stays under the recorded motion of the arm. Without a robot in cell.toml
an object that moves by itself is explained, tossed or sliding. Where cell.toml does not say which control law leads the arm, the
one that fits is found first.

Clips of a robot are not explained together with those of another one, or of the simulation, unless --mix says so.

A recording that cannot mean what it says (units, order, sign, misaligned logs) is not explained, unless --as-recorded says
so: `calibration check` shows what is wrong.

With --against B the question is another: what changed from this session, A, to B, of one robot under one control law (a payload, a
wiped table, a gain, wear). A's parameters and effects count for both, and the change is given with a 95 % interval and the
share of B's gap under A's model that it closes; or that nothing changed, and how small a change would have been seen.

With --engine another simulator is the twin: yours, with your model of the robot, over a small protocol (docs/engine.md;
adapters/mujoco is one for MuJoCo). The verdict is about that one. Effects that it knows are asked of it; of others the twin's own
difference is added. For clips of the arm alone, and of strokes where the engine says that it simulates an object.

Of clips of the arm alone that last longer together than 96 s the parts count in which its commands move the joints most, and the
answer says how long these are.

What to record next is printed as commands that can be typed, with the arm that the clips are of. Where no bridge drives that arm, it
is said in words, and the motion is written beside --report or --out as CSV: time and position of each joint, 1000 rows a second, within
the limits of the cell. Of an effect that is named what to do about it in the
cell and in a model.

How far the gap shrinks is one figure, 1 - after / before of the mean squared residual on held-out clips, in units of the
noise (docs/figures.md). The parameters found go to --theta: `twin replay SESSION --parameters theta.toml` gives the errors of joints
and object with them. With --out alone
they go to theta.toml beside it, unless there is one already. What no clip tells is not written.

Ctrl-C keeps what was found so far, beside --out or in the session's folder; the same command goes on from there. So it does
after a --budget that was spent: of that the answer is the best so far, and says so.

Examples:
  calibration diagnose session --report report.html
  calibration diagnose session --out diagnosis.json --seed 7 --json
  calibration diagnose session --object milk_box
  calibration diagnose session --torques --report torques.html
  calibration diagnose session --engine ./my_simulator
  calibration diagnose session --budget 120 --out diagnosis.json
  calibration diagnose monday --against tuesday --report changes.html")]
pub struct Arguments {
    /// Folder with cell.toml and at least four different clips.
    #[arg(value_name = "SESSION")]
    pub(super) session: PathBuf,
    /// Another session of the same robot: what changed from SESSION to this one, B. --theta then gets the parameters of B.
    #[arg(long, value_name = "SESSION", conflicts_with_all = ["budget", "engine"])]
    pub against: Option<PathBuf>,
    /// What the laboratory knows about its cell [default: cell.toml beside the clips].
    #[arg(long, value_name = "CELL.TOML")]
    pub(super) cell: Option<PathBuf>,
    /// Of several objects in cell.toml the one to judge [default: the one that moves].
    #[arg(long, value_name = "NAME")]
    pub(super) object: Option<String>,
    /// Parameters that are known already; effects among them act and are no candidates.
    #[arg(long, value_name = "THETA.TOML")]
    pub(super) parameters: Option<PathBuf>,
    /// Where the answer goes, as JSON.
    #[arg(long, value_name = "DIAGNOSIS.JSON")]
    pub(super) out: Option<PathBuf>,
    /// Where the page goes.
    #[arg(long, value_name = "REPORT.HTML")]
    pub(super) report: Option<PathBuf>,
    /// Where the parameters and the effects named go [default: theta.toml beside --out, where there is none].
    #[arg(long, value_name = "THETA.TOML")]
    theta: Option<PathBuf>,
    /// Replaces the files of --out, --report and --theta; of a theta.toml, comments and what is not found stay.
    #[arg(long)]
    pub(super) force: bool,
    /// Takes the data as they were recorded where `calibration check` says that they cannot mean what they say.
    #[arg(long)]
    pub(super) as_recorded: bool,
    /// Takes clips of several sources together: of two robots, or of a robot and the simulation.
    #[arg(long)]
    pub(super) mix: bool,
    /// After so many seconds the best answer so far counts, 1 to 1000000 [default: as long as it takes].
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(1..=1_000_000))]
    budget: Option<u64>,
    /// Explains the measured torques along the measured motion instead of how commands are followed: for logs without
    /// commands, and where the control law is not known. Needs a model with masses.
    #[arg(long, conflicts_with = "engine")]
    pub(super) torques: bool,
    #[command(flatten)]
    pub(super) engine: EngineArguments,
    /// Draws which clips are for what, and the intervals.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = inference::seed::parse)]
    pub(super) seed: u64,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    pub json: bool,
}

impl Arguments {
    /// What is taken all the same.
    pub(super) fn allowed(&self) -> Allowed {
        Allowed { as_recorded: self.as_recorded, mix: self.mix, copied_commands: self.torques }
    }
}

/// Runs the verb; the caller prints what was found.
///
/// # Errors
/// What cannot be read, diagnosed or written, in one line with the remedy.
pub(super) fn run(arguments: &Arguments, interrupt: &Interrupt) -> anyhow::Result<Diagnosis> {
    let Arguments { out, report, force, .. } = arguments;
    let page = Destination::of(report.as_deref(), *force)?;
    let answer = Destination::of(out.as_deref(), *force)?;
    let theta_file = theta_file(arguments)?;
    Destination::apart(&[out.as_deref(), report.as_deref(), theta_file.as_deref()])?;
    let mut session = Session::open_with(&arguments.session, arguments.cell.as_deref())?;
    if let Some(subject) = session.about(arguments.object.as_deref())? {
        console::line(subject);
    }
    let looked = gate::look(&session, arguments.allowed())?;
    let theta = arguments.parameters.as_deref().map(Theta::read).transpose()?.map(|theta| theta.about(&session.cell));
    let budget = arguments.budget.map(Duration::from_secs);
    let (seed, torques) = (arguments.seed, arguments.torques);
    let engine = arguments.engine.start(&session, interrupt)?;
    let options =
        Options { theta, seed, torques, engine: engine.clone(), budget, out: out.clone(), report: report.clone() };
    let found = diagnose_kept(&session, &options, interrupt).map_err(anyhow::Error::from);
    let (mut found, kept) = heard(engine.as_ref(), found)?;
    gate::add(&mut found.warnings, &looked);
    match theta_file {
        Some(file) if found.identifies() => {
            found.theta.write(&file)?;
            found.theta_file = Some(file);
        }
        Some(file) => console::line(format_args!("{}: not written, because no parameter was found", file.display())),
        None => {}
    }
    if let Some(beside) = report.as_deref().or(out.as_deref()) {
        written::write(&mut found.next_motions, &session, beside, *force)?;
    }
    if let Some(answer) = answer {
        answer.write(serde_json::to_string_pretty(&found)?)?;
    }
    if let Some(page) = page {
        page.write(report::diagnosis::page(&found))?;
    }
    if !found.budget_spent {
        kept.done();
    } else if let Some(state) = kept.save()? {
        console::line(format_args!(
            "what was found is in {}; `{}` goes on from there",
            state.display(),
            typed::with("--force", *force || (out.is_none() && report.is_none() && arguments.theta.is_none()))
        ));
    }
    Ok(found)
}

/// Where the parameters go: where the command line says, or beside the answer. There nobody named the file, so one that is there
/// stays.
pub(super) fn theta_file(arguments: &Arguments) -> anyhow::Result<Option<PathBuf>> {
    if let Some(file) = &arguments.theta {
        return Ok(Some(Destination::new(file, arguments.force)?.path().to_owned()));
    }
    let Some(file) = arguments.out.as_ref().map(|out| out.with_file_name("theta.toml")) else { return Ok(None) };
    if is_there(&file) {
        let name = file.display();
        console::line(format_args!("{name} is there, and is kept; --theta FILE says where the parameters go"));
        return Ok(None);
    }
    Ok(Some(Destination::new(&file, false)?.path().to_owned()))
}

/// A link that leads nowhere is there, too.
fn is_there(file: &Path) -> bool {
    file.symlink_metadata().is_ok()
}
