//! What clips say of the controller that leads the arm before a model is fitted to them: its law and its stiffness where nobody
//! states them, and gains from which a fit by slopes arrives.
//!
//! | module | owns |
//! |---|---|
//! | `between` | what the law is given between two commands of a slow log |
//! | `law` | which control law leads the arm |
//! | `measured_stiffness` | what logged torques say of the stiffness |
//! | [`start`] | where the search begins when little is known |

mod between;
mod law;
mod measured_stiffness;
pub mod start;
#[cfg(test)]
mod test_swing;

use crate::engine::Engine;
use crate::estimate::{ClipModel as _, Fit, Impossible, Schedule, Unknown, fit};
use crate::interrupt::Interrupt;
use crate::likelihood::arm::ArmClips;
use crate::likelihood::setting::{BaseError, arm_numbers, complete};
use crate::likelihood::{Setting, Settings};
use shared_mem::cell::Cell;
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use std::sync::Arc;
use twin::arm::ModelError;

/// The arm cannot be simulated.
#[derive(Debug, thiserror::Error)]
pub enum ControllerError {
    #[error(transparent)]
    Base(#[from] BaseError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error("the twin cannot be simulated: {0}; check the values of cell.toml and --parameters")]
    Impossible(#[from] Impossible),
}

/// The cell with what its clips say of the controller: the law and what it is given between commands where they are not stated, and the
/// stiffness where torques tell it.
/// `given`: parameters that are known already; then gains are not looked for. `remarks`: one sentence for each that was found.
///
/// # Errors
/// [`ControllerError`] when the arm cannot be simulated under any law.
pub fn controlled(
    mut cell: Cell,
    clips: &[Clip],
    given: Option<&Theta>,
    remarks: &mut Vec<String>,
    interrupt: &Interrupt,
) -> Result<Cell, ControllerError> {
    // The law first: what torque a spring makes is read by it.
    if let Some((led, remark)) = law::found(&cell, clips, given, interrupt)? {
        cell = led;
        remarks.push(remark);
    }
    if let Some((led, remark)) = between::found(&cell, clips, given, interrupt)? {
        cell = led;
        remarks.push(remark);
    }
    if given.is_none_or(|given| given.arm.is_none())
        && let Some((known, remark)) = measured_stiffness::found(&cell, clips)
    {
        cell = known;
        remarks.push(remark);
    }
    Ok(cell)
}

/// Parameters from which a fit of gains by their slopes arrives: where cell.toml knows gains by range alone, the best of a coarse
/// grid on the first few clips, joint by joint; elsewhere those given.
///
/// # Errors
/// [`ControllerError`] when the arm cannot be simulated at all.
pub fn begun(cell: &Cell, clips: &[&Clip], base: &Theta, interrupt: &Interrupt) -> Result<Theta, ControllerError> {
    if !start::is_ranged(cell) {
        return Ok(base.clone());
    }
    let clips = clips.iter().map(|clip| (*clip).clone()).collect();
    let (settings, mut unknowns) = gains(cell, base);
    let (model, _) = ArmClips::means(cell, clips, |numbers: &[f64]| settings.theta(numbers))?;
    let all: Vec<usize> = (0..model.clips()).collect();
    start::improve(cell, &model, &all, settings.settings(), &mut unknowns, interrupt);
    Ok(settings.theta(&unknowns.iter().map(|unknown| unknown.start).collect::<Vec<_>>()))
}

/// `base` with the gains that fit the arm's motion in clips best, and the fit. `engine`: simulates in place of the twin.
///
/// # Errors
/// [`ControllerError`] when the arm cannot be simulated where the fit begins.
pub fn fitted(
    cell: &Cell,
    engine: Option<Arc<Engine>>,
    base: &Theta,
    clips: Vec<Clip>,
    interrupt: &Interrupt,
) -> Result<(Theta, Fit), ControllerError> {
    let (settings, unknowns) = gains(cell, base);
    let (clips, _) = ArmClips::means(cell, clips, |numbers: &[f64]| settings.theta(numbers))?;
    let clips = if engine.is_some() { clips.moved_by(engine, &complete(cell, None)?) } else { clips };
    let fit = fit(&clips, &unknowns, &clips.random(), &Schedule::default(), |_, _| !interrupt.asked())?;
    Ok((settings.theta(&fit.shared), fit))
}

/// The gains of a cell as numbers to be searched, beginning at `base`.
fn gains(cell: &Cell, base: &Theta) -> (Settings, Vec<Unknown>) {
    let (settings, unknowns): (Vec<Setting>, Vec<Unknown>) = arm_numbers(cell, base).into_iter().unzip();
    (Settings::new(base.clone(), settings), unknowns)
}
