//! What the controller was given between two rows of a log of its commands that is slower than its 1 kHz, where cell.toml does not say:
//! gains are fitted each way, and the way that leaves the least of the joints' motion is taken.

use super::{ControllerError, law};
use crate::interrupt::Interrupt;
use shared_mem::cell::{BetweenCommands, Cell, ControllerKind};
use shared_mem::recording::Clip;
use shared_mem::statistics::usual_step_ns;
use shared_mem::theta::Theta;
use twin::control::CommandTrack;

/// The ways that are compared: of two that leave the same the first is taken.
const WAYS: [BetweenCommands; 3] = [BetweenCommands::Held, BetweenCommands::Line, BetweenCommands::Smooth];
/// So many clips decide which way it is (a choice).
const CLIPS_THAT_DECIDE: usize = 4;

/// The cell with what fits its clips best, and a sentence about it; `None` where cell.toml states it, or the clips leave nothing open.
/// `given`: parameters that are known already.
pub(super) fn found(
    cell: &Cell,
    clips: &[Clip],
    given: Option<&Theta>,
    interrupt: &Interrupt,
) -> Result<Option<(Cell, String)>, ControllerError> {
    let open = cell
        .controller
        .as_ref()
        .is_some_and(|law| law.between_commands == BetweenCommands::Unstated && law.kind != ControllerKind::Tracking);
    let slow = |clip: &&Clip| !clip.measured.is_empty() && CommandTrack::is_open_between(&clip.desired);
    let some: Vec<Clip> = clips.iter().filter(slow).take(CLIPS_THAT_DECIDE).cloned().collect();
    let Some(step_ns) = some.first().filter(|_| open).and_then(|clip| usual_step_ns(&clip.desired.stamps_ns)) else {
        return Ok(None);
    };
    let left = law::left_in_each(WAYS, |way| going(cell, way), &some, given, interrupt)?;
    let best = left.iter().copied().min_by(|(_, a), (_, b)| a.total_cmp(b));
    Ok(best.map(|(way, _)| (going(cell, way), sentence(way, step_ns, &left))))
}

fn going(cell: &Cell, way: BetweenCommands) -> Cell {
    let mut cell = cell.clone();
    if let Some(controller) = &mut cell.controller {
        controller.between_commands = way;
    }
    cell
}

fn sentence(way: BetweenCommands, step_ns: u64, left: &[(BetweenCommands, f64)]) -> String {
    let name = |way: BetweenCommands| way.name().unwrap_or_default();
    let each: Vec<String> = left.iter().map(|(way, rest)| format!("{rest:.1} times with {}", name(*way))).collect();
    format!(
        "commands were logged every {:.1} ms, and what the controller was given in between was not: the best gains leave the encoders' \
         noise {}; {} is taken, write `between_commands = \"{}\"` under [controller] if it is right",
        step_ns as f64 * 1e-6,
        each.join(", "),
        name(way),
        name(way)
    )
}

#[cfg(test)]
mod tests {
    use super::super::test_swing::{CELL, clip};
    use super::*;
    use std::path::Path;

    #[test]
    fn what_a_controller_was_given_between_commands_is_found_and_said() {
        let unstated =
            Cell::parse(&format!("{CELL}kind = \"joint_impedance\"\n"), Path::new("cell.toml")).expect("a cell");
        for way in WAYS {
            let led = going(&unstated, way);
            let clips = [clip(&led, 1.0, 20), clip(&led, 1.7, 20)];
            let found = |cell: &Cell| found(cell, &clips, None, &Interrupt::default()).expect("an answer");
            let (cell, said) = found(&unstated).expect("a way");
            let name = way.name().expect("a way");
            assert!(cell == led && said.contains(&format!("between_commands = \"{name}\"")), "{name}: {said}");
            assert_eq!(found(&led), None, "it is stated");
        }
        let every = [clip(&unstated, 1.0, 1)];
        assert_eq!(found(&unstated, &every, None, &Interrupt::default()).expect("an answer"), None, "nothing is open");
    }
}
