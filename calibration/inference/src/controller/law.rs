//! Which control law leads the arm, where cell.toml does not say: gains are fitted under each law, and the one that leaves the least of
//! the joints' motion is taken.

use super::{ControllerError, begun, fitted};
use crate::interrupt::Interrupt;
use crate::likelihood::setting::complete;
use shared_mem::cell::{Cell, ControllerKind};
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;

/// Laws that are compared, the most frequent first: of two that fit alike the first is taken. Without gravity the last two are one.
const LAWS: [ControllerKind; 4] = [
    ControllerKind::JointImpedance,
    ControllerKind::InverseDynamics,
    ControllerKind::JointPd,
    ControllerKind::CompensatedPd,
];
/// So many clips decide which law it is (a choice).
const CLIPS_THAT_DECIDE: usize = 4;
/// A law that leaves less than this times as much as another fits as well (a choice).
const FITS_AS_WELL_WITHIN: f64 = 1.1;

/// The cell with the law that fits its clips best, and a sentence about it; `None` where cell.toml states the law, or there is no
/// law to find. `given`: parameters that are known already.
pub(super) fn found(
    cell: &Cell,
    clips: &[Clip],
    given: Option<&Theta>,
    interrupt: &Interrupt,
) -> Result<Option<(Cell, String)>, ControllerError> {
    let unstated = cell.controller.as_ref().is_some_and(|law| law.kind == ControllerKind::Unstated);
    let moving = || clips.iter().filter(|clip| !clip.measured.is_empty() && !clip.desired.is_empty());
    if !unstated || moving().next().is_none() {
        return Ok(None);
    }
    let some: Vec<Clip> = moving().take(CLIPS_THAT_DECIDE).cloned().collect();
    let left = left_in_each(LAWS, |kind| under(cell, kind), &some, given, interrupt)?;
    let least = left.iter().map(|(_, rest)| *rest).fold(f64::INFINITY, f64::min);
    // The first in the order of [`LAWS`], not the best: gains make up for what tells laws apart.
    let best = left.iter().find(|(_, rest)| *rest < FITS_AS_WELL_WITHIN * least);
    Ok(best.map(|(kind, _)| (under(cell, *kind), sentence(*kind, &left))))
}

fn under(cell: &Cell, kind: ControllerKind) -> Cell {
    let mut cell = cell.clone();
    if let Some(controller) = &mut cell.controller {
        controller.kind = kind;
    }
    cell
}

/// What the best gains leave in each of several ways in which the arm may be led, those left out in which it cannot follow.
pub(super) fn left_in_each<W: Copy>(
    ways: impl IntoIterator<Item = W>,
    led: impl Fn(W) -> Cell,
    clips: &[Clip],
    given: Option<&Theta>,
    interrupt: &Interrupt,
) -> Result<Vec<(W, f64)>, ControllerError> {
    let left = |way| Ok(left_under(&led(way), clips, given, interrupt)?.map(|rest| (way, rest)));
    ways.into_iter().filter_map(|way| left(way).transpose()).collect()
}

/// Root mean square of what the best gains leave, over the encoders' noise; `None` where the arm cannot follow under this law.
fn left_under(
    cell: &Cell,
    clips: &[Clip],
    given: Option<&Theta>,
    interrupt: &Interrupt,
) -> Result<Option<f64>, ControllerError> {
    let base = begun(cell, &clips.iter().collect::<Vec<_>>(), &complete(cell, given)?, interrupt)?;
    match fitted(cell, None, &base, clips.to_vec(), interrupt) {
        Ok((_, fit)) if !fit.clips.is_empty() => Ok(Some(fit.misfit().sqrt())),
        // An arm that flies away under a law is not led by it.
        Ok(_) | Err(ControllerError::Impossible(_)) => Ok(None),
        Err(error) => Err(error),
    }
}

fn sentence(kind: ControllerKind, left: &[(ControllerKind, f64)]) -> String {
    let name = |kind: ControllerKind| kind.name().unwrap_or_default();
    let each: Vec<String> = left.iter().map(|(kind, rest)| format!("{rest:.1} times under {}", name(*kind))).collect();
    format!(
        "cell.toml does not say by which law the arm is led: the best gains leave the encoders' noise {}; {} is taken, write `kind = \
         \"{}\"` under [controller] if it is right",
        each.join(", "),
        name(kind),
        name(kind)
    )
}

#[cfg(test)]
mod tests {
    use super::super::test_swing::{CELL, clip};
    use super::*;
    use std::path::Path;

    #[test]
    fn the_law_that_led_an_arm_is_found_and_said() {
        let unstated = Cell::parse(CELL, Path::new("cell.toml")).expect("a cell");
        // A joint that carries nothing tells no servo from one whose weight is compensated.
        for kind in LAWS.into_iter().filter(|kind| *kind != ControllerKind::CompensatedPd) {
            let led = under(&unstated, kind);
            let clips = [clip(&led, 1.0, 1), clip(&led, 1.7, 1)];
            let (cell, said) =
                found(&unstated, &clips, None, &Interrupt::default()).expect("an answer").expect("a law");
            let name = kind.name().expect("a law of a robot");
            assert!(cell == led && said.contains(&format!("kind = \"{name}\"")), "{name}: {said}");
            assert_eq!(found(&led, &clips, None, &Interrupt::default()).expect("an answer"), None, "it is stated");
        }
    }
}
