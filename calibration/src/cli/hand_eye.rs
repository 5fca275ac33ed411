//! `calibration hand-eye`.

use super::print;
use anyhow::bail;
use clap::Args;
use shared_mem::hand_eye::Mount;
use shared_mem::output::Destination;
use shared_mem::quantity;
use std::path::PathBuf;
use vision::hand_eye::command::{Options, run as find};
use vision::hand_eye::input::Source;
use vision::viewpoint::board::Board;

#[derive(Debug, Args)]
#[command(after_help = "\
FOLDER holds poses.json, which lists pictures each with `O_T_EE`; or pictures with a
JSON file of the same name beside each. Of a session the flange is the end effector.
docs/hand_eye.md has the keys. Ten to twenty pictures at rest, the end effector turned
by 20 degrees and more about at least two axes between them, are good.

Examples:
  calibration hand-eye board --board 5x7,0.034,0.028,DICT_5X5_100 --out hand_eye.toml
  calibration hand-eye session --board 5x7,0.034,0.028,DICT_5X5_100 --json
  calibration hand-eye board --board 5x7,0.034,0.028,DICT_5X5_100 --fixed-camera")]
pub struct HandEyeArguments {
    /// Folder of pictures of the board, a session, or a clip.
    #[arg(value_name = "FOLDER|SESSION|CLIP")]
    target: PathBuf,
    /// The ChArUco board as OpenCV draws it: COLUMNSxROWS,SQUARE,MARKER,DICTIONARY, lengths in metres, for example 5x7,0.034,0.028,DICT_5X5_100; not needed where
    /// poses.json holds its corners.
    #[arg(long, value_name = "BOARD", value_parser = Board::parse)]
    board: Option<Board>,
    /// The camera stands beside the robot, and the board is in the arm's hand.
    #[arg(long)]
    fixed_camera: bool,
    /// Focal lengths and principal point [pixel]: fx,fy,cx,cy.
    #[arg(long, value_name = "FX,FY,CX,CY", value_parser = |text: &str| quantity::numbers::<4>(text, 0.0..=1e5, "pixel"))]
    intrinsics: Option<[f64; 4]>,
    /// The cell: intrinsics of its camera, and the arm of a clip; a session brings its own.
    #[arg(long, value_name = "CELL.TOML")]
    cell: Option<PathBuf>,
    /// At most so many pictures of a session, as different as there are.
    #[arg(long, value_name = "N", default_value_t = 20, value_parser = clap::value_parser!(u8).range(3..=200))]
    frames: u8,
    /// Writes the mount with its intervals.
    #[arg(long, value_name = "HAND_EYE.TOML")]
    out: Option<PathBuf>,
    /// Replaces the file of --out.
    #[arg(long)]
    force: bool,
    /// Prints the answer as one JSON object.
    #[arg(long)]
    json: bool,
}

/// Runs the verb.
///
/// # Errors
/// One line: what happened, and what to do.
pub(super) fn run(arguments: HandEyeArguments) -> anyhow::Result<()> {
    let HandEyeArguments { target, board, fixed_camera, intrinsics, cell, frames, out, force, json } = arguments;
    let found = find(&Options {
        source: Source { target, cell, board, intrinsics, frames: usize::from(frames) },
        mount: if fixed_camera { Mount::FixedCamera } else { Mount::EyeInHand },
        out: Destination::of(out.as_deref(), force)?,
    })?;
    print(json, &found, found.in_words())?;
    if let Some(open) = found.not_identifiable.first() {
        bail!("the mount is not identifiable from these pictures, and nothing was written: {}", open.why);
    }
    Ok(())
}
