//! `calibration viewpoint`.

use super::print;
use clap::{Args, ValueEnum};
use inference::interrupt::Interrupt;
use shared_mem::output::Destination;
use shared_mem::quantity::{self, number};
use shared_mem::recording::PictureKind;
use std::path::PathBuf;
use twin::render::Hand;
use vision::viewpoint::answer::Viewpoint;
use vision::viewpoint::board::Board;
use vision::viewpoint::command::{Options, StartFrom, run as find};
use vision::viewpoint::fit::Method;
use vision::viewpoint::search::Reach;

#[derive(Debug, Args)]
#[command(after_help = "\
Examples:
  calibration viewpoint session --out cell.toml --picture outline.png
  calibration viewpoint photo.jpg --joints 0,-0.78,0,-2.36,0,1.57,0.79 --cell cell.toml --start 1.4,0.8,0.9,0.26,-0.37,-0.73,0.51
  calibration viewpoint a.png b.png --joints a.json --joints b.json --mask ma.png --mask mb.png --start search --json
A joint file is JSON: a list of positions, or an object with `q`; `K`, `D`, `width`, `height` beside it are intrinsics as ROS names them.")]
pub struct ViewpointArguments {
    /// A session folder, a clip, or pictures (png, jpg) of one camera that did not move.
    #[arg(required = true, value_name = "SESSION|CLIP|PICTURE")]
    targets: Vec<PathBuf>,
    /// The cell: arm, tool, intrinsics, first pose of the camera; a session brings its own.
    #[arg(long)]
    cell: Option<PathBuf>,
    /// Joint positions [rad] of a picture, with commas between them or as a JSON file; one for each picture.
    #[arg(long, value_name = "Q,...|FILE.json", allow_hyphen_values = true)]
    joints: Vec<String>,
    /// Mask of a picture, as an outside segmenter writes it: the robot white, all else black; one for each picture.
    #[arg(long)]
    mask: Vec<PathBuf>,
    /// The same view without the robot: colour, or depth where the pictures are depth.
    #[arg(long)]
    background: Option<PathBuf>,
    /// Silhouettes from depth pictures alone, a session's or given ones: whatever hangs together and stands out of table,
    /// floor and walls; the robot has to be the largest such thing in view. Of a session this is the way that is gone where it
    /// holds such pictures and they show the robot.
    #[arg(long, conflicts_with_all = ["mask", "board"])]
    depth: bool,
    /// The colour pictures of a session although it holds depth.
    #[arg(long, conflicts_with = "depth")]
    color: bool,
    /// Focal lengths and principal point [pixel]: fx,fy,cx,cy.
    #[arg(long, value_parser = numbers::<4>)]
    intrinsics: Option<[f64; 4]>,
    /// A ChArUco board in view that tells where the camera is about, as OpenCV draws it: COLUMNSxROWS,SQUARE,MARKER,DICTIONARY,
    /// lengths in metres, for example 5x7,0.04,0.03,DICT_5X5_100.
    #[arg(long, value_name = "BOARD", requires = "board_at", conflicts_with = "start", value_parser = Board::parse)]
    board: Option<Board>,
    /// Where the board lies in the base frame: x,y,z,qw,qx,qy,qz of its first square's outer corner, x along the rows, y down
    /// the columns, z into the board.
    #[arg(long, value_name = "POSE", requires = "board", allow_hyphen_values = true, value_parser = pose)]
    board_at: Option<([f64; 3], [f64; 4])>,
    /// Where the camera is about: `cell` (its cell.toml), `search`, or x,y,z,qw,qx,qy,qz of the optical frame in the base.
    #[arg(long, default_value = "cell", allow_hyphen_values = true, value_parser = start)]
    start: StartFrom,
    /// How far the start may be from the truth: degrees,metres [default: 20,0.32 with silhouettes, 14,0.15 with photos].
    #[arg(long, value_parser = reach)]
    reach: Option<[f64; 2]>,
    /// outline: least squares on the outline; swarm: the paper's particle swarm on the silhouettes.
    #[arg(long, value_enum, default_value_t = MethodName::Outline)]
    method: MethodName,
    /// Points that the swarm tries, for each of which every frame is drawn.
    #[arg(long, alias = "budget", value_name = "N", default_value_t = 10_000, value_parser = clap::value_parser!(u32).range(40..=1_000_000))]
    points: u32,
    /// At most so many pictures of a session.
    #[arg(long, default_value_t = 6, value_parser = clap::value_parser!(u8).range(1..=100))]
    frames: u8,
    /// A Franka Hand is mounted, its fingers this far apart [m], 0 to 0.08.
    #[arg(long, value_name = "WIDTH", value_parser = |text: &str| number(text, 0.0..=0.08, "m"))]
    hand: Option<f64>,
    /// Seed of what is drawn by lot.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = inference::seed::parse)]
    seed: u64,
    /// Writes the cell with the pose found.
    #[arg(long, value_name = "CELL.TOML")]
    out: Option<PathBuf>,
    /// Replaces the files of --out and --picture; of a cell.toml, all but the camera's block stays.
    #[arg(long)]
    force: bool,
    /// Writes the pictures with the outline (red: found, green: start) as a PNG.
    #[arg(long, alias = "report", value_name = "PICTURE.PNG")]
    picture: Option<PathBuf>,
    /// Prints the answer as one JSON object.
    #[arg(long)]
    json: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum MethodName {
    Outline,
    Swarm,
}

fn numbers<const N: usize>(text: &str) -> Result<[f64; N], String> {
    let parts: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    let parts = parts.ok().filter(|parts| parts.iter().all(|value| value.is_finite()));
    parts.and_then(|parts| parts.try_into().ok()).ok_or_else(|| format!("give {N} numbers with commas between them"))
}

/// Degrees and metres around the start.
fn reach(text: &str) -> Result<[f64; 2], String> {
    let [degrees, metres] = quantity::numbers(text, 0.0..=180.0, "degrees")?;
    Ok([degrees, number(&metres.to_string(), 0.0..=10.0, "m")?])
}

fn pose(text: &str) -> Result<([f64; 3], [f64; 4]), String> {
    let [x, y, z, w, i, j, k] = numbers::<7>(text)?;
    if w.hypot(i).hypot(j).hypot(k) < 1e-6 {
        return Err("the quaternion qw,qx,qy,qz must not be zero".into());
    }
    Ok(([x, y, z], [w, i, j, k]))
}

fn start(text: &str) -> Result<StartFrom, String> {
    match text {
        "cell" => Ok(StartFrom::Cell),
        "search" => Ok(StartFrom::Search),
        _ => {
            let (position, wxyz) = pose(text).map_err(|e| format!("{e}; or say `cell` or `search`"))?;
            Ok(StartFrom::Pose(position, wxyz))
        }
    }
}

/// Runs the verb.
///
/// # Errors
/// One line: what happened, and what to do.
pub(super) fn run(arguments: ViewpointArguments, interrupt: &Interrupt) -> anyhow::Result<()> {
    let ViewpointArguments { targets, cell, joints, mask, background, intrinsics, start, reach, .. } = arguments;
    let start = match (arguments.board, arguments.board_at) {
        (Some(board), Some((position, wxyz))) => StartFrom::Board(board, position, wxyz),
        _ => start,
    };
    let method = match arguments.method {
        MethodName::Outline => Method::Outline,
        MethodName::Swarm => Method::Swarm(arguments.points as usize),
    };
    Destination::apart(&[arguments.out.as_deref(), arguments.picture.as_deref()])?;
    let options = Options {
        targets,
        cell,
        joints,
        masks: mask,
        background,
        kind: match (arguments.depth, arguments.color) {
            (true, _) => Some(PictureKind::Depth),
            (_, true) => Some(PictureKind::Color),
            _ => None,
        },
        intrinsics,
        start,
        reach: reach.map(|[degrees, distance]| Reach { angle: degrees.to_radians(), distance }),
        method,
        frames: usize::from(arguments.frames),
        hand: arguments.hand.map_or(Hand::None, |width| Hand::Franka { width }),
        seed: arguments.seed,
        out: Destination::of(arguments.out.as_deref(), arguments.force)?,
        report: Destination::of(arguments.picture.as_deref(), arguments.force)?,
    };
    let found = find(&options, interrupt)?;
    print(arguments.json, &found, in_words(&found))
}

/// The answer for people.
fn in_words(found: &Viewpoint) -> String {
    let [x, y, z] = found.camera.position;
    let [qw, qx, qy, qz] = found.camera.orientation;
    let mut lines = Vec::new();
    if let Some(start) = &found.start {
        lines.push(format!(
            "The camera is {:.1} mm and {:.2} degrees from where the search began, {:.1} pixels in the picture: {} than its interval",
            start.distance_m * 1e3,
            start.angle_rad.to_degrees(),
            start.reprojection_px,
            if start.excluded { "more" } else { "no more" }
        ));
    }
    lines.push(format!(
        "camera in the base frame: {x:.4}, {y:.4}, {z:.4} m; {qw:.5}, {qx:.5}, {qy:.5}, {qz:.5} (w, x, y, z)"
    ));
    if let Some(interval) = &found.interval {
        let [a, b, c] = interval.position.map(|v| v * 1e3);
        let [d, e, f] = interval.rotation.map(f64::to_degrees);
        lines.push(format!("95 % within {a:.1}, {b:.1}, {c:.1} mm and {d:.2}, {e:.2}, {f:.2} degrees"));
    }
    let confirmed = found.confirmed * 100.0;
    let (pictures, kind) = (found.frames.len(), if found.pictures == "depth" { "depth" } else { "colour" });
    lines.push(format!(
        "{confirmed:.0} % of the outline confirmed in {pictures} {kind} pictures; {} drawings, {:.1} s",
        found.drawings, found.seconds
    ));
    lines.extend(found.warnings.iter().map(|warning| format!("note: {warning}")));
    lines.join("\n")
}
