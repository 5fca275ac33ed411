//! What speaks against trusting a fit although it looks sure of itself, one sentence each with the remedy.

use crate::answer::identification::{ClipGap, Identification};
use crate::identify::figures::{Odd, odd};
use inference::likelihood::object::noise_of;
use shared_mem::cell::Cell;

/// ADD on the clips fitted, over the tracker's noise, from which on it is neither noise nor chance in the hits (a choice).
const BEYOND_NOISE: f64 = 7.0;

/// Doubts about a fit whose figures stand in `answer`.
pub(super) fn doubts(answer: &Identification, cell: &Cell) -> Vec<String> {
    let noise = noise_of(cell).position;
    let mut doubts = Vec::new();
    if let Some(add) = answer.gap.train.object_add_m.filter(|add| *add > BEYOND_NOISE * noise) {
        // Diagnosing takes an arm: where there is none, nothing but the recording can be looked at.
        let advice = match cell.robot {
            Some(_) => {
                "something else acts, or its poses are not where the arm's frame puts them; `calibration diagnose` says what"
            }
            None => {
                "something else acts; look at the shape, size and support of [object] in cell.toml and at the tracker's poses"
            }
        };
        doubts.push(format!(
            "on the very clips that were fitted the object is {:.1} mm off, {:.0} times the tracker's noise: {advice}",
            add * 1e3,
            add / noise
        ));
    }
    let add = |clip: &ClipGap| clip.after.object_add_m.unwrap_or_default();
    for Odd { clip, error, usual } in odd(&answer.by_clip, add, BEYOND_NOISE * noise) {
        doubts.push(format!(
            "{}: the object is {:.1} mm off where it is {:.1} mm in the middle clip: look whether it was hit on an edge, pushed by \
             something else or lost, and leave the clip out if so",
            clip.file,
            error * 1e3,
            usual * 1e3
        ));
    }
    doubts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::answer::identification::Figures;
    use shared_mem::cell::Robot;

    fn said(fitted: [f64; 5], cell: &Cell) -> Vec<String> {
        let figures = |add: f64| Figures { object_add_m: Some(add), ..Figures::default() };
        let clip =
            |(i, add): (usize, &f64)| ClipGap { file: format!("{i}"), after: figures(*add), ..ClipGap::default() };
        let mut answer =
            Identification { by_clip: fitted.iter().enumerate().map(clip).collect(), ..Default::default() };
        answer.gap.train = figures(fitted.iter().sum::<f64>() / 5.0);
        doubts(&answer, cell)
    }

    #[test]
    fn errors_that_are_no_noise_and_a_clip_unlike_the_others_are_told() {
        let cell = Cell { robot: Some(Robot::default()), ..Cell::default() };
        assert_eq!(said([0.002, 0.003, 0.003, 0.004, 0.002], &cell), [""; 0]);
        let all = said([0.02, 0.03, 0.03, 0.04, 0.02], &cell);
        assert!(all.len() == 1 && all[0].contains("28.0 mm off") && all[0].contains("diagnose"), "{all:?}");
        // An object alone cannot be diagnosed, so nobody is sent there.
        let alone = said([0.02, 0.03, 0.03, 0.04, 0.02], &Cell::default());
        assert!(alone[0].contains("28.0 mm off") && !alone[0].contains("diagnose"), "{alone:?}");
        let one = said([0.002, 0.003, 0.002, 0.018, 0.002], &cell);
        assert!(one.len() == 1 && one[0].starts_with("3: the object is 18.0 mm off"), "{one:?}");
    }
}
