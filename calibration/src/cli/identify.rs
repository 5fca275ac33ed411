//! `calibration identify`.

use super::engine::{EngineArguments, heard};
use super::{NoAnswer, print};
use crate::check::gate::{self, Allowed};
use crate::identify::{Identification, Optimizer, Options, arm, joint, object};
use crate::report::{identification, terminal};
use clap::{Subcommand, ValueEnum};
use inference::interrupt::Interrupt;
use shared_mem::output::Destination;
use shared_mem::recording::{Provenance, Session};
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub enum Identify {
    /// Stiffness and damping of every joint, and effects on request, from clips in which the arm moves.
    Arm(ArmArguments),
    /// Friction, mass, centre of mass and tip friction of the object, from clips in which the arm hits it.
    Object(ObjectArguments),
    /// Friction and damping of a laptop's hinge or a drawer's slide, from clips in which its part moves by itself after a push.
    Joint(JointArguments),
}

/// What both are asked for.
#[derive(Debug, clap::Args)]
struct Task {
    /// Session folder, or one clip beside a cell.toml.
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// What the laboratory knows about its cell [default: cell.toml beside the clips].
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// The way of searching; for an object pso and cma go by ADD + ADD-S.
    #[arg(long, value_enum, default_value_t = Way::LeastSquares)]
    optimizer: Way,
    /// Where the parameters go: a theta.toml that every other command takes.
    #[arg(long, value_name = "THETA.TOML")]
    out: Option<PathBuf>,
    /// Replaces the files of --out and --report; of a theta.toml, comments and what is not found stay.
    #[arg(long)]
    force: bool,
    /// Parameters that are known already: effects, and for an object the arm's gains.
    #[arg(long, value_name = "THETA.TOML")]
    parameters: Option<PathBuf>,
    /// Draws the clips that are held out, and the searches.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = inference::seed::parse)]
    seed: u64,
    /// Takes the data as they were recorded where `calibration check` says that they cannot mean what they say.
    #[arg(long)]
    as_recorded: bool,
    /// Takes clips of several sources together: of two robots, or of a robot and the simulation.
    #[arg(long)]
    mix: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
    /// Writes a page with pictures.
    #[arg(long, value_name = "PAGE.HTML")]
    report: Option<PathBuf>,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
The recorded commands are simulated until the twin's joints move as the robot's did. A quarter of the motions is held
out: the error on them is what the twin is worth. What is not identifiable from the clips is said, with the reason.

With --engine another simulator moves the arm, over the protocol of docs/engine.md; effects of --also that it does not
know are added from the twin.

Ctrl-C keeps what was found so far, beside --out or in the session's folder; the same command goes on from there, and ends
where it would have ended. What no clip tells is not written.

Exit code 3 where gains alone do not explain the clips: nothing is written then, and `calibration diagnose` says what else acts.

Examples:
  calibration identify arm monday --out theta.toml --report page.html
  calibration identify arm monday --engine ./my_simulator --out theta.toml
  calibration identify arm monday --also command_delay,joint_coulomb_friction --out theta.toml
  calibration identify arm monday --optimizer pso --json")]
pub struct ArmArguments {
    #[command(flatten)]
    task: Task,
    /// Effects to search besides, by the names of docs/effects.md: command_delay,rotor_inertia,payload,...
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    also: Vec<String>,
    #[command(flatten)]
    engine: EngineArguments,
    /// Points that pso and cma may try.
    #[arg(long = "points", alias = "budget", value_name = "N", default_value_t = 4000, value_parser = clap::value_parser!(u32).range(1..))]
    budget: u32,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
The recorded commands are simulated, hit and slide included, until object and arm move as they did. The arm's gains are
found first, from the way to the object in the same clips, unless --parameters brings them. A quarter of the strokes is
held out. Clips in which the object topples, is lost or not hit are left out, and that is said; so is what is not identifiable.

With --engine another simulator moves arm and object, over the protocol of docs/engine.md: what is found is for that simulator.

Ctrl-C keeps what was found so far, beside --out or in the session's folder; the same command goes on from there, and ends
where it would have ended. What no clip tells is not written.

Examples:
  calibration identify object strokes --out theta.toml --report page.html
  calibration identify object strokes --object milk_box --out theta.toml
  calibration identify object strokes --engine ./my_simulator --out theta.toml
  calibration identify object strokes --parameters arm.toml --optimizer pso --points 1200 --json")]
pub struct ObjectArguments {
    #[command(flatten)]
    task: Task,
    /// Of several objects in cell.toml the one to identify [default: the one that moves].
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    #[command(flatten)]
    engine: EngineArguments,
    /// Points that pso and cma may try.
    #[arg(long = "points", alias = "budget", value_name = "N", default_value_t = 1200, value_parser = clap::value_parser!(u32).range(1..))]
    budget: u32,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
The object stands in cell.toml as an [[object]] with a `urdf`, as `twin reconstruct articulated` writes one. A clip has the poses of both
of its links, on /object/NAME/pose and /object/NAME_LINK/pose, while somebody or the robot pushes the part and lets go: what counts
of each motion is its end, from where weight and friction alone explain it until the part rests or runs into something. Push three
times and more, with different strength. Of several motions each is held out in turn.

Weight and inertia are those of the URDF: what is found is in proportion to them. --out is the URDF with what was found in the
joint's <dynamics>; write it beside the URDF, whose meshes it names.

Examples:
  calibration identify joint pushes --out laptop/identified.urdf --report hinge.html
  calibration identify joint pushes --object desk --joint rail --json")]
pub struct JointArguments {
    /// Session folder, or one clip beside a cell.toml.
    #[arg(value_name = "SESSION")]
    session: PathBuf,
    /// What the laboratory knows about its cell [default: cell.toml beside the clips].
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// Of several objects with a `urdf` in cell.toml the one in question.
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Of several joints of its URDF the one in question.
    #[arg(long, value_name = "NAME")]
    joint: Option<String>,
    /// Where the URDF with what was found goes.
    #[arg(long, value_name = "FILE.URDF")]
    out: Option<PathBuf>,
    /// Replaces the files of --out and --report.
    #[arg(long)]
    force: bool,
    /// Takes clips of several sources together: of two robots, or of a robot and the simulation.
    #[arg(long)]
    mix: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
    /// Writes a page with pictures.
    #[arg(long, value_name = "PAGE.HTML")]
    report: Option<PathBuf>,
}

impl JointArguments {
    fn run(self, interrupt: &Interrupt) -> anyhow::Result<()> {
        let Self { session, cell, object, joint, out, force, mix, json, report } = self;
        Destination::apart(&[out.as_deref(), report.as_deref()])?;
        Destination::of(out.as_deref(), force)?;
        let page = Destination::of(report.as_deref(), force)?;
        let provenance = Provenance::of(&Session::open_with(&session, cell.as_deref())?);
        gate::unmixed(&provenance, mix)?;
        let mut found = joint::identify(&joint::Options { session, cell, object, joint, out }, interrupt)?;
        found.origin = provenance.to_string();
        if let Some(page) = page {
            page.write(identification::page(&found))?;
        }
        print(json, &found, terminal::identification(&found))
    }
}

/// Ways of searching, by their names on the command line.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Way {
    /// Bounded least squares on rollouts, for an object followed by a small cloud of points: the fastest.
    LeastSquares,
    /// A particle swarm.
    Pso,
    /// Covariance matrix adaptation.
    Cma,
}

impl Way {
    fn optimizer(self) -> Optimizer {
        match self {
            Self::LeastSquares => Optimizer::LeastSquares,
            Self::Pso => Optimizer::Swarm,
            Self::Cma => Optimizer::Evolution,
        }
    }
}

pub(super) fn run(identify: Identify, interrupt: &Interrupt) -> anyhow::Result<()> {
    match identify {
        Identify::Arm(ArmArguments { task, also, engine, budget }) => task.run(|task, opened| {
            let engine = engine.start(opened, interrupt)?;
            let Task { session, cell, optimizer, out, parameters, seed, .. } = task;
            let (optimizer, budget, asked) = (optimizer.optimizer(), budget as usize, engine.clone());
            let options =
                Options { session, cell, object: None, also, optimizer, out, parameters, budget, seed, engine };
            heard(asked.as_ref(), arm::identify(&options, interrupt).map_err(anyhow::Error::from))
        }),
        Identify::Object(ObjectArguments { task, object, engine, budget }) => task.run(|task, opened| {
            let engine = engine.start(opened, interrupt)?;
            let Task { session, cell, optimizer, out, parameters, seed, .. } = task;
            let (optimizer, budget, asked) = (optimizer.optimizer(), budget as usize, engine.clone());
            let options =
                Options { session, cell, object, also: Vec::new(), optimizer, out, parameters, budget, seed, engine };
            heard(asked.as_ref(), object::identify(&options, interrupt).map_err(anyhow::Error::from))
        }),
        Identify::Joint(arguments) => arguments.run(interrupt),
    }
}

impl Task {
    /// Looks at where the outputs go and at the recording, has the rest done, and says and writes what was found.
    fn run(self, identify: impl FnOnce(Self, &Session) -> anyhow::Result<Identification>) -> anyhow::Result<()> {
        Destination::apart(&[self.out.as_deref(), self.report.as_deref()])?;
        Destination::of(self.out.as_deref(), self.force)?;
        let page = Destination::of(self.report.as_deref(), self.force)?;
        let session = Session::open_with(&self.session, self.cell.as_deref())?;
        let allowed = Allowed { as_recorded: self.as_recorded, mix: self.mix, ..Allowed::default() };
        let looked = gate::look(&session, allowed)?;
        let json = self.json;
        let mut found = identify(self, &session)?;
        gate::add(&mut found.warnings, &looked);
        found.origin = looked.provenance.to_string();
        if let Some(page) = page {
            page.write(identification::page(&found))?;
        }
        print(json, &found, terminal::identification(&found))?;
        if found.is_unexplained() { Err(NoAnswer.into()) } else { Ok(()) }
    }
}
