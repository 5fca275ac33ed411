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
    let mut left: Vec<(ControllerKind, f64)> = Vec::new();
    for kind in LAWS {
        let rest = left_under(&under(cell, kind), &some, given, interrupt)?;
        left.extend(rest.map(|rest| (kind, rest)));
    }
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
    use super::*;
    use shared_mem::recording::{JointSeries, ObjectSeries};
    use std::path::Path;
    use twin::arm::{ArmModel, JointState};
    use twin::control::{ArmRollout, CommandTrack};

    const CELL: &str =
        "[robot]\njoints = [\"a\"]\n[controller]\nstiffness = [30.0]\ndamping = [3.0]\nrotor_inertia = [0.4]\n";

    /// What a joint does under a law that is commanded a sum of swings, with gains that are not those of cell.toml.
    fn clip(cell: &Cell, faster: f64) -> Clip {
        let arm = ArmModel::from_cell(cell).expect("a joint");
        let theta = shared_mem::theta::ArmTheta { stiffness: vec![33.0], damping: vec![2.8] };
        let law = twin::arm::ControlLaw::new(cell.controller.as_ref(), Some(&theta), &arm).expect("gains");
        let stamps_ns: Vec<u64> = (1..=3000).map(|tick| tick * 1_000_000).collect();
        let swing = |stamp: &u64, of: fn(f64) -> f64, power: i32| -> f64 {
            let t = *stamp as f64 * 1e-9;
            [2.0, 5.0, 9.0].iter().map(|w| w * faster).map(|w| 0.1 * w.powi(power) * of(w * t)).sum()
        };
        let desired = JointSeries {
            dof: 1,
            q: stamps_ns.iter().map(|stamp| swing(stamp, f64::sin, 0)).collect(),
            dq: stamps_ns.iter().map(|stamp| swing(stamp, f64::cos, 1)).collect(),
            tau: Vec::new(),
            stamps_ns: stamps_ns.clone(),
        };
        let commands = CommandTrack::new(&desired).expect("commands");
        let rollout = ArmRollout { arm: &arm, nominal: &arm, law: &law, effects: None, parts: 1 };
        let mut states = vec![JointState::default(); stamps_ns.len()];
        rollout.run(&JointState::default(), stamps_ns[0], &commands, &stamps_ns, &mut states);
        let noise = |row: usize| 1e-5 * (1e4 * row as f64).sin();
        let measured = JointSeries {
            q: states.iter().enumerate().map(|(row, state)| state.q[0] + noise(row)).collect(),
            dq: Vec::new(),
            ..desired.clone()
        };
        Clip {
            others: Vec::new(),
            file: "swing.mcap".into(),
            kind: shared_mem::cell::ClipKind::Excitation,
            joint_names: vec!["a".into()],
            desired,
            measured,
            torques_end_at_rows: true,
            origins: shared_mem::origin::Origins::default(),
            object: ObjectSeries::default(),
            warnings: Vec::new(),
            damage: None,
        }
    }

    #[test]
    fn the_law_that_led_an_arm_is_found_and_said() {
        let unstated = Cell::parse(CELL, Path::new("cell.toml")).expect("a cell");
        // A joint that carries nothing tells no servo from one whose weight is compensated.
        for kind in LAWS.into_iter().filter(|kind| *kind != ControllerKind::CompensatedPd) {
            let led = under(&unstated, kind);
            let clips = [clip(&led, 1.0), clip(&led, 1.7)];
            let (cell, said) =
                found(&unstated, &clips, None, &Interrupt::default()).expect("an answer").expect("a law");
            let name = kind.name().expect("a law of a robot");
            assert!(cell == led && said.contains(&format!("kind = \"{name}\"")), "{name}: {said}");
            assert_eq!(found(&led, &clips, None, &Interrupt::default()).expect("an answer"), None, "it is stated");
        }
    }
}
