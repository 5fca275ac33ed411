//! The views' pixels: those to learn from, those held out, and those that say nothing, each with the reason.

use crate::remark::Remark;
use crate::scan::{FEWEST_VIEWS, Frame, Scan, ScanError};
use crate::views::{grey, is_held_out, named, read_all, spread, without_blurred};

/// Longest edge of a picture [pixel]; larger ones are reduced.
const LONGEST: u32 = 1300;
/// Fewer pixels show no object.
const FEWEST_PIXELS: usize = 200;
/// A mask that fills so much of its picture is none.
const WHOLE: f64 = 0.95;
/// Mean brightness under which colour says nothing [of 255].
const DARK: f64 = 12.0;
/// Of the object's pixels so many must have depth.
const DEPTH_SEEN: f64 = 0.6;

/// What the views show.
#[derive(Debug)]
pub(super) struct Pictures {
    pub(super) train: Vec<Frame>,
    pub(super) held_out: Vec<Frame>,
    /// Standard deviation of depth at one metre [m]; `None` without depth.
    pub(super) depth_spread: Option<f64>,
    pub(super) remarks: Vec<Remark>,
}

/// Reads all views. `done` is called with the number of views that are read.
pub(super) fn read(scan: &Scan, done: impl Fn(u64) + Sync) -> Result<Pictures, ScanError> {
    let frames = read_all(scan, LONGEST, |view, by| scan.frame(view, by), done)?;
    let mut remarks = scan.remarks.clone();
    let frames = useful(frames, &mut remarks);
    if frames.len() < FEWEST_VIEWS {
        let most = remarks.iter().map(|remark| remark.0.as_str()).collect::<Vec<_>>().join("; ");
        return Err(ScanError::Missing(format!(
            "{} of {} views can be used, {FEWEST_VIEWS} are needed at least: {most}",
            frames.len(),
            scan.views.len()
        )));
    }
    appearance(&frames, scan.has_depth(), &mut remarks);
    let depth_spread = spread(&frames);
    let (mut train, mut held_out) = (Vec::new(), Vec::new());
    for (number, frame) in frames.into_iter().enumerate() {
        if is_held_out(number) { held_out.push(frame) } else { train.push(frame) }
    }
    Ok(Pictures { train, held_out, depth_spread, remarks })
}

/// The frames that show the object sharply.
fn useful(frames: Vec<Frame>, remarks: &mut Vec<Remark>) -> Vec<Frame> {
    let (frames, empty): (Vec<Frame>, Vec<Frame>) =
        frames.into_iter().partition(|frame| frame.masked() >= FEWEST_PIXELS);
    if !empty.is_empty() {
        let names = named(&empty);
        remarks.push(Remark(format!("{} views have no object in their mask and were left out: {names}", empty.len())));
    }
    let whole = |frame: &Frame| frame.masked() as f64 > WHOLE * frame.mask.len() as f64;
    let (full, frames): (Vec<Frame>, Vec<Frame>) = frames.into_iter().partition(whole);
    if !full.is_empty() {
        let names = named(&full);
        remarks
            .push(Remark(format!("{} masks fill their picture (white must be the object alone): {names}", full.len())));
    }
    without_blurred(frames, remarks)
}

/// Objects that are dark, or that depth does not see.
fn appearance(frames: &[Frame], with_depth: bool, remarks: &mut Vec<Remark>) {
    let inside = |frame: &Frame| -> (f64, f64, f64) {
        let pixels = frame.mask.iter().enumerate().filter(|(_, inside)| **inside).map(|(at, _)| at);
        let depth = |at: usize| frame.depth.get(at).is_some_and(|z| *z > 0.0);
        pixels.fold((0.0, 0.0, 0.0), |(count, light, seen), at| {
            (count + 1.0, light + grey(frame.rgb[at]), seen + f64::from(u8::from(depth(at))))
        })
    };
    let sums = frames.iter().map(inside).fold((0.0, 0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1, a.2 + b.2));
    let (light, seen) = (sums.1 / sums.0, sums.2 / sums.0);
    if light < DARK {
        remarks.push(Remark(format!(
            "the object is almost black ({light:.0} of 255): its colours say nothing, its shape comes from masks{} alone",
            if with_depth { " and depth" } else { "" }
        )));
    }
    if with_depth && seen < DEPTH_SEEN {
        remarks.push(Remark(format!(
            "depth was measured on {:.0} % of the object: it is dark, shiny or transparent there, and its hollows may be filled",
            seen * 100.0
        )));
    }
}
