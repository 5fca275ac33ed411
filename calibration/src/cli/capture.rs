//! `calibration capture`.

use super::print;
use crate::keys::Keys;
use capture::control_hit_slide::Series;
use capture::request::Kind;
use capture::task::Task;
use capture::{control_hit_slide, excitation, ramp, scan};
use clap::{Subcommand, ValueEnum as _};
use inference::interrupt::Interrupt;
use shared_mem::origin::Origin;
use shared_mem::output::Destination;
use shared_mem::quantity::{number, numbers};
use std::path::PathBuf;

#[derive(Debug, Subcommand)]
pub enum Capture {
    /// All joints at once along sums of sines, inside every limit: what identifying the arm needs.
    Excitation(ExcitationArguments),
    /// The tool runs up to the object, hits it and lets it slide: what identifying the object and diagnosing contact need.
    ControlHitSlide(StrokeArguments),
    /// A camera on the arm goes around a point and takes pictures of it: a scan for `twin reconstruct`.
    Scan(ScanArguments),
}

/// What every capture is asked for.
#[derive(Debug, clap::Args)]
struct TaskArguments {
    /// What the laboratory knows about its cell; `fr3` for the one that is built in.
    #[arg(long, value_name = "CELL.TOML")]
    cell: PathBuf,
    /// Plays clip N of the session again instead of a new one: the same set points. Several are played in turn.
    #[arg(long, value_name = "N[,M..]", value_delimiter = ',')]
    repeat: Vec<usize>,
    /// Plays every motion that is recorded at so many times its speed, 0.05 to 10: 0.5 is half, 2 is twice.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = |text: &str| number(text, 0.05..=10.0, ""))]
    speed: f64,
    /// Session folder; created, or continued.
    #[arg(long, value_name = "SESSION")]
    out: PathBuf,
    /// Arm for the bridge that is started when none runs: sim or fci://HOST [default: sim in a new session; none where it has clips].
    #[arg(long)]
    arm: Option<String>,
    /// Adds clips also where those of the session come from elsewhere: another robot, or the simulation.
    #[arg(long)]
    mix: bool,
    /// Whether that bridge refuses to run without real-time guarantees: enforce or ignore [default: the bridge's own].
    #[arg(long, value_parser = ["enforce", "ignore"])]
    realtime: Option<String>,
    /// Leaves pictures out: they are most of a clip, and neither identification nor diagnosis reads them.
    #[arg(long)]
    no_camera: bool,
    /// How often a robot that stops itself (a reflex) is recovered without you: the arm moves again by itself then.
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u32).range(..=20))]
    recover: u32,
}

impl TaskArguments {
    /// `clips`: how many are asked for; else as many as are named.
    fn task(self, clips: Option<u32>, named: usize) -> Task {
        let Self { cell, repeat, speed, out, arm, mix, realtime, no_camera, recover } = self;
        let clips = clips.unwrap_or_else(|| u32::try_from(repeat.len().max(named)).unwrap_or(u32::MAX));
        Task { cell, clips, repeat, speed, out, mix, arm, realtime, no_camera, recover, domain: None }
    }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum MotionKind {
    /// Sums of sines, 0.2 to 1.6 Hz: what identifying the arm needs.
    Multisine,
    /// Swings of growing frequency: delay, lag, resonance.
    Chirp,
    /// Triangles of growing speed: friction at creep, lost motion at reversals.
    Ramp,
    /// Rests in several poses, each approached from both sides: sag, sticking, play.
    Hold,
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
The arm starts and ends at rest in the pose it holds, and stays above the table and the highest object. An amplitude that breaks a limit
of position, speed, acceleration, jerk, torque or height is made smaller; which limit it was is said for each joint. A
--speed that breaks one is refused, with the joint and the largest factor that fits.

  multisine  all joints at once along sums of sines, 0.2 to 1.6 Hz (8 s, 0.25 rad)
  chirp      swings from the lower to the higher --frequency; above about 1 Hz they get smaller, so that the acceleration
             stays what it is (20 s, 0.25 rad)
  ramp       triangles with rounded reversals, their speed growing from level to level over --ramp-speeds (40 s, 0.25 rad)
  hold       rests in --poses whose gravity torques differ as much as they can, each from both sides (40 s, 0.4 rad)

A clip that is repeated begins where it began: the arm first goes there calmly. Its number is that of its file,
3 for clip_03.mcap.

A session that exists is continued with the next number; nothing is overwritten. Clips of another arm than those that are
there are refused unless --mix. At any moment p (or SIGUSR1)
pauses: the arm brakes inside its limits and holds, and p (or SIGUSR2) goes on with a fresh try of the same clip. q or
Ctrl-C ends: the arm brakes, and what was recorded is kept. A robot that stops itself ends it too; with --recover 3 it is
recovered up to three times 2 s later, the arm goes back and the clip is repeated. One that a person stopped is left alone.

Examples:
  calibration capture excitation --cell fr3 --clips 4 --out session
  calibration capture excitation --cell lab/cell.toml --clips 8 --out monday --arm fci://172.16.0.2 --amplitude 0.2
  calibration capture excitation --cell fr3 --clips 1 --out session --arm sim --motion chirp --frequency 0.2 10
  calibration capture excitation --cell fr3 --clips 1 --out session --arm sim --motion ramp --joints 1,4
  calibration capture excitation --cell fr3 --clips 1 --out session --arm sim --motion hold --poses 12
  calibration capture excitation --cell fr3 --out session --arm sim --repeat 0,3
  calibration capture excitation --cell fr3 --out session --arm sim --repeat 3 --speed 0.5")]
pub struct ExcitationArguments {
    #[command(flatten)]
    task: TaskArguments,
    /// Clips to add; with --repeat as many as it names, where nothing else is said.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000), required_unless_present = "repeat")]
    clips: Option<u32>,
    /// What kind of motion.
    #[arg(long, value_enum, default_value_t = MotionKind::Multisine)]
    motion: MotionKind,
    /// Joints that move, counted from 1; the others hold [default: all].
    #[arg(long, value_name = "N[,M..]", value_delimiter = ',', value_parser = clap::value_parser!(u32).range(1..=8))]
    joints: Vec<u32>,
    /// Length of each clip's motion [s], 2 to 600 (ramp: 12 or more) [default: by kind].
    #[arg(long, value_name = "S", value_parser = |text: &str| number(text, 2.0..=600.0, "s"))]
    duration: Option<f64>,
    /// Largest excursion of each joint from the pose the arm stands in [rad], 0.01 to 1.5 [default: by kind].
    #[arg(long, value_name = "RAD", value_parser = |text: &str| number(text, 0.01..=1.5, "rad"))]
    amplitude: Option<f64>,
    /// First and last frequency of a chirp [Hz], 0.05 to 50 [default: 0.2 10].
    #[arg(long, value_names = ["LO", "HI"], num_args = 2, value_parser = |text: &str| number(text, 0.05..=50.0, "Hz"))]
    frequency: Vec<f64>,
    /// Speeds of the first and the last ramp [rad/s], 0.001 to 2 [default: 0.005 0.5].
    #[arg(long, value_names = ["LO", "HI"], num_args = 2, value_parser = |text: &str| number(text, 0.001..=2.0, "rad/s"))]
    ramp_speeds: Vec<f64>,
    /// Poses to hold, 2 to 64 [default: 8].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=64))]
    poses: Option<u32>,
    /// Seed of the motions; clip number N of a session is drawn from seed + N. It may be negative.
    #[arg(long, value_name = "N", default_value_t = 0)]
    seed: i64,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

impl ExcitationArguments {
    /// The kind of motion with its own arguments.
    ///
    /// # Errors
    /// What does not go together, in one sentence.
    fn kind(&self) -> Result<Kind, String> {
        let Self { motion, frequency, ramp_speeds, poses, duration, task, .. } = self;
        let only = |flag: &str, given: bool, of: MotionKind| {
            let odd = given && (*motion != of || !task.repeat.is_empty());
            let name = of.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned());
            if odd { Err(format!("--{flag} is for --motion {name}; leave it out or give that kind")) } else { Ok(()) }
        };
        only("frequency", !frequency.is_empty(), MotionKind::Chirp)?;
        only("ramp-speeds", !ramp_speeds.is_empty(), MotionKind::Ramp)?;
        only("poses", poses.is_some(), MotionKind::Hold)?;
        let rising = |flag: &str, given: &[f64], otherwise: [f64; 2]| match given {
            [lo, hi] if lo < hi => Ok([*lo, *hi]),
            [] => Ok(otherwise),
            _ => Err(format!("--{flag} wants the lower number first, then a higher one")),
        };
        if *motion == MotionKind::Ramp && duration.is_some_and(|duration| duration < ramp::MIN_DURATION) {
            return Err(format!("ramps take {} s or more; give a longer --duration", ramp::MIN_DURATION));
        }
        Ok(match motion {
            MotionKind::Multisine => Kind::Multisine,
            MotionKind::Chirp => Kind::Chirp { frequency: rising("frequency", frequency, [0.2, 10.0])? },
            MotionKind::Ramp => Kind::Ramp { speeds: rising("ramp-speeds", ramp_speeds, [0.005, 0.5])? },
            MotionKind::Hold => Kind::Hold { poses: poses.unwrap_or(8) as usize },
        })
    }
}

/// Ends the program as for any other wrong argument.
fn refuse(why: &str) -> ! {
    use clap::CommandFactory as _;
    super::Arguments::command().error(clap::error::ErrorKind::ArgumentConflict, why).exit()
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
cell.toml needs [tool], [table] and [object]. The arm finds the object by its tracked pose, goes above it to the stroke's start, comes down, waits until all is still,
strikes, waits until the object rests, and steps back. Strokes come from all sides at all speeds, and every sixth repeats
the first, so that scatter and drift can be separated from a gap. Directions are chosen so that the object stays in reach; one
that got away is asked for by hand.

Of several objects --object says which one is hit, and the tracker has to see all. Arm and tool stay 30 mm away from the others;
so does what slides, and 0.3 m more for each metre of its way. The arm travels past low ones and above tall ones. Strokes
that do not keep clear are left out with the reason; where none does, it is said which object to move and how far. A clip
in which another object moved is not kept.

With --repeat, --headings and --turn-object every stroke goes out from the same place. The object has to stand there, to
5 mm and 3 degrees: you are asked to put it back at x, y and a turn, and have two minutes. Where this capture has started the
simulated cell itself it starts it anew with the object there instead. A stroke that is repeated has the same set points.

A session that exists is continued with the next number; nothing is overwritten. Clips of another arm than those that are
there are refused unless --mix. At any moment p (or SIGUSR1)
pauses: the arm brakes inside its limits and holds, and p (or SIGUSR2) goes on with a fresh try of the same clip. q or
Ctrl-C ends: the arm brakes, and what was recorded is kept. A robot that stops itself ends it too; with --recover 3 it is
recovered up to three times 2 s later, the arm goes back and the clip is repeated. One that a person stopped is left alone.

Examples:
  calibration capture control-hit-slide --cell fr3 --clips 12 --out strokes
  calibration capture control-hit-slide --cell lab/cell.toml --clips 12 --out strokes --object milk_box
  calibration capture control-hit-slide --cell lab/cell.toml --clips 1 --out monday --preview next.svg
  calibration capture control-hit-slide --cell fr3 --out strokes --arm sim --repeat 0,4
  calibration capture control-hit-slide --cell fr3 --out strokes --arm sim --repeat 4 --clips 8
  calibration capture control-hit-slide --cell fr3 --clips 6 --out strokes --arm sim --speed 0.5
  calibration capture control-hit-slide --cell fr3 --out strokes --arm sim --headings 8
  calibration capture control-hit-slide --cell fr3 --out strokes --arm sim --turn-object 0,90,180
  calibration capture control-hit-slide --cell fr3 --out strokes --arm sim --repeat 4 --turn-tool=-90")]
pub struct StrokeArguments {
    #[command(flatten)]
    task: TaskArguments,
    /// Name of the object that is hit, of several in cell.toml; all others are kept clear of.
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// Clips to add; with --repeat, --headings or --turn-object as many as they name, where nothing else is said.
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(1..=1000),
        required_unless_present_any = ["repeat", "headings", "turn_object"]
    )]
    clips: Option<u32>,
    /// Straight slides in so many headings, evenly all round, through the same place, 2 to 36.
    #[arg(
        long,
        value_name = "N",
        value_parser = clap::value_parser!(u32).range(2..=36),
        conflicts_with_all = ["repeat", "turn_object"]
    )]
    headings: Option<u32>,
    /// One straight stroke on the object turned about the vertical by so much from how it stands, or by each of several.
    #[arg(
        long,
        value_name = "DEG[,DEG..]",
        value_delimiter = ',',
        allow_hyphen_values = true,
        value_parser = turn,
        conflicts_with = "repeat"
    )]
    turn_object: Vec<f64>,
    /// Turns the tool about its own axis for every stroke; a turn that breaks a joint's limit is refused.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, value_parser = turn)]
    turn_tool: f64,
    /// Draws the next stroke into this file and moves nothing.
    #[arg(long, value_name = "FILE.SVG")]
    preview: Option<PathBuf>,
    /// Replaces the file of --preview.
    #[arg(long, requires = "preview")]
    force: bool,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

/// Degrees of a turn.
fn turn(text: &str) -> Result<f64, String> {
    number(text, -360.0..=360.0, "degrees")
}

pub(super) fn run(capture: Capture, interrupt: &Interrupt) -> anyhow::Result<()> {
    let _terminal = Keys::listen(interrupt);
    match capture {
        Capture::Excitation(arguments) => excite(arguments, interrupt),
        Capture::ControlHitSlide(arguments) => strike(arguments, interrupt),
        Capture::Scan(arguments) => look(arguments, interrupt),
    }
}

fn excite(arguments: ExcitationArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let kind = arguments.kind().unwrap_or_else(|why| refuse(&why));
    let (duration, amplitude) = kind.usual();
    let ExcitationArguments { task, clips, joints, duration: asked, amplitude: wide, seed, json, .. } = arguments;
    let options = excitation::Options {
        task: task.task(clips, 0),
        kind,
        joints: joints.iter().map(|joint| *joint as usize - 1).collect(),
        duration: asked.unwrap_or(duration),
        amplitude: wide.unwrap_or(amplitude),
        seed: seed.cast_unsigned(),
    };
    let summary = excitation::capture(&options, interrupt, &mut String::new)?;
    let kept = summary.clips.iter().filter(|clip| clip.kept).count();
    let (session, from) = (summary.session.display(), from(summary.origin.as_ref()));
    let words = format!("{session}: {kept} of {} clips kept{from}", options.task.clips);
    print(json, &summary, words)
}

/// ` (the simulation)`, behind what was recorded.
fn from(origin: Option<&Origin>) -> String {
    origin.map_or_else(String::new, |origin| format!(" ({origin})"))
}

fn strike(arguments: StrokeArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let StrokeArguments { task, object, clips, headings, turn_object, turn_tool, preview, force, json } = arguments;
    Destination::of(preview.as_deref(), force)?;
    let series = match (headings, &turn_object[..]) {
        (Some(count), _) => Series::Headings(count as usize),
        (None, []) => Series::Everywhere,
        (None, turns) => Series::Turned(turns.iter().map(|degrees| degrees.to_radians()).collect()),
    };
    let named = headings.map_or(turn_object.len(), |count| count as usize);
    let task = task.task(clips, named);
    let options = control_hit_slide::Options { task, object, series, turn_tool: turn_tool.to_radians(), preview };
    let summary = control_hit_slide::capture(&options, interrupt)?;
    let kept = summary.clips.iter().filter(|clip| clip.kept).count();
    let words = match &options.preview {
        Some(file) => format!("the next stroke is drawn in {}", file.display()),
        None => {
            let (session, from) = (summary.session.display(), from(summary.origin.as_ref()));
            format!("{session}: {kept} of {} clips kept{from}", summary.clips.len())
        }
    };
    print(json, &summary, words)
}

#[derive(Debug, clap::Args)]
#[command(after_help = "\
The bridge has to publish pictures of a camera on the arm: start it with --camera. The
arm stops at each view, waits until it is at rest, and keeps colour and, where there is
any, depth of one moment with O_T_EE. Views lie on a dome around --at, those that are
reached inside the joints' limits, above the table, and with flange, tool and camera at
least half the distance away from --at. Where cell.toml has several [[object]], arm,
tool and camera keep 30 mm clear of those that are not scanned, where the tracker sees
them, else where cell.toml has them start; views that one of them is in the way of, or
hides, are left out. Of other things in the cell it knows nothing. At any moment p
pauses, and q or Ctrl-C ends; what was taken is kept.

Examples:
  calibration capture scan --cell lab/cell.toml --hand-eye hand_eye.toml --at 0.5,0,0.05 --out scan
  calibration capture scan --cell lab/cell.toml --hand-eye hand_eye.toml --at 0.5,0,0.05 --distance 0.6 --views 60 --out scan")]
pub struct ScanArguments {
    /// What the laboratory knows about its cell; `fr3` for the one that is built in.
    #[arg(long, value_name = "CELL.TOML")]
    cell: PathBuf,
    /// How the camera is mounted, as `calibration hand-eye` writes it.
    #[arg(long, value_name = "HAND_EYE.TOML")]
    hand_eye: PathBuf,
    /// Name of the object that is scanned, where cell.toml has several [default: the one that stands at --at].
    #[arg(long, value_name = "NAME")]
    object: Option<String>,
    /// What is looked at, in the base frame [m].
    #[arg(long, value_name = "X,Y,Z", allow_hyphen_values = true, value_parser = |text: &str| numbers::<3>(text, -3.0..=3.0, "m"))]
    at: [f64; 3],
    /// From the camera to it [m].
    #[arg(long, value_name = "M", default_value_t = 0.5, value_parser = |text: &str| number(text, 0.1..=1.5, "m"))]
    distance: f64,
    /// What is further from --at is no part of the object: masks are cut by depth, of what stands above the table nearer
    /// than this [m] [default: a third of --distance].
    #[arg(long, value_name = "M", value_parser = |text: &str| number(text, 0.01..=1.0, "m"))]
    radius: Option<f64>,
    /// Views, 8 to 200; fewer where not as many are within reach.
    #[arg(long, value_name = "N", default_value_t = 40, value_parser = clap::value_parser!(u8).range(8..=200))]
    views: u8,
    /// The scan's folder; new.
    #[arg(long, value_name = "SCAN")]
    out: PathBuf,
    /// Arm for the bridge that is started when none runs: sim or fci://HOST [default: sim].
    #[arg(long)]
    arm: Option<String>,
    /// Whether that bridge refuses to run without real-time guarantees: enforce or ignore [default: the bridge's own].
    #[arg(long, value_parser = ["enforce", "ignore"])]
    realtime: Option<String>,
    /// Prints one JSON object on stdout at the end.
    #[arg(long)]
    json: bool,
}

fn look(arguments: ScanArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let ScanArguments { cell, hand_eye, object, at, distance, radius, views, out, arm, realtime, json } = arguments;
    let (views, radius) = (usize::from(views), radius.unwrap_or(distance / 3.0));
    let options =
        scan::Options { cell, hand_eye, object, at, distance, radius, views, out, arm, realtime, domain: None };
    let summary = scan::capture(&options, interrupt)?;
    let mut left = match summary.without_way {
        0 => String::new(),
        count => format!("; {count} views were left out, to which no way leads"),
    };
    if summary.blocked > 0 {
        left += &format!("; {} views were left out because of other objects", summary.blocked);
    }
    let scan::Summary { scan, pictures, with_depth, with_mask, .. } = &summary;
    let words =
        format!("{}: {pictures} pictures, {with_depth} with depth, {with_mask} with a mask{left}", scan.display());
    print(json, &summary, words)
}
