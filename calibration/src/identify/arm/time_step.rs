//! What the twin's time step does to identified numbers: estimated from steps half as long, and taken out.
//!
//! The twin integrates by a rule of second order, so half the step leaves a quarter of the error. With predictions `p1` in
//! steps of a control period and `p2` in half steps, `p1 + 4/3 (p2 - p1)` is what steps without end would predict, but for
//! terms of higher order (Richardson 1911). The numbers move by one Gauss-Newton step of that difference.

use super::Model;
use inference::estimate::{ClipFit, Fit, Impossible, Random, Shifted, Subset, Unknown, at_bounds, moved_by};
use nalgebra::DVector;
use rayon::prelude::*;

/// From the difference to half steps to the whole error of whole ones: `1 / (1 - 1/4)` for a rule of second order.
const RICHARDSON: f64 = 4.0 / 3.0;
/// What of the error a robot, or a simulator in its place, may have itself (a choice): a quarter, as with half steps.
const SHARE_LEFT_OPEN: f64 = 0.25;

/// How far the numbers of a fit to the clips in `train` move once the time step is taken out.
pub(super) fn error(
    model: &Model<'_>,
    train: &[usize],
    unknowns: &[Unknown],
    random: &[Random],
    fit: &Fit,
) -> Result<Vec<f64>, Impossible> {
    let off = |place: usize| {
        let in_parts = |parts| model.residuals_in(parts, (train[place], &fit.shared, &fit.clips[place].own));
        let (whole, mut halves) = (in_parts(1)?, in_parts(2)?);
        halves.iter_mut().zip(&whole).for_each(|(half, whole)| *half = RICHARDSON * (*half - whole));
        Ok(halves)
    };
    let by = (0..train.len()).into_par_iter().map(off).collect::<Result<Vec<_>, Impossible>>()?;
    let clips = Subset { model, clips: train };
    let shifted = Shifted { model: &clips, by: &by };
    // Slopes at the shifted residuals less those of the fit: what the error of the step adds to the gradient.
    let slope = |place: usize| {
        let linear = &fit.clips[place];
        let there = ClipFit::at(&shifted, place, (unknowns, &fit.shared), (random, &linear.own))?;
        Ok(there.gradient - &linear.gradient)
    };
    let slopes = (0..train.len()).into_par_iter().map(slope).collect::<Result<Vec<_>, Impossible>>()?;
    let slope = slopes.iter().fold(DVector::zeros(unknowns.len()), |sum, slope| sum + slope);
    Ok(moved_by(fit, &at_bounds(unknowns, &fit.shared), &slope).iter().copied().collect())
}

/// Takes the error out of the numbers; what of it stays open, in half widths of an interval.
pub(super) fn taken_out(fit: &mut Fit, unknowns: &[Unknown], error: &[f64]) -> Vec<f64> {
    for ((value, error), unknown) in fit.shared.iter_mut().zip(error).zip(unknowns) {
        *value = (*value + error).clamp(unknown.lower, unknown.upper);
    }
    error.iter().map(|error| SHARE_LEFT_OPEN * error.abs()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::arm::Numbers;
    use inference::estimate::{Schedule, fit};
    use inference::likelihood::Settings;
    use inference::likelihood::arm::ArmClips;
    use inference::likelihood::setting::{arm_numbers, complete};
    use shared_mem::cell::Cell;
    use std::path::Path;
    use worlds::session::record;
    use worlds::world::{Fault, Kind, World};

    #[test]
    fn gains_of_an_arm_that_was_integrated_finer_come_out_as_they_are() {
        let text = include_str!("../../../../config/fr3_cell.toml");
        let shipped = shared_mem::toml_file::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file");
        let world = World::draw(3, Kind::Excitation, Fault::Nothing, &shipped);
        let cell = Cell { objects: Vec::new(), ..world.cell.clone() };
        let mut clips = record(&world, 1).expect("a session");
        let base = complete(&cell, Some(&world.hidden)).expect("gains");
        let (settings, unknowns): (Vec<_>, Vec<_>) = arm_numbers(&cell, &base).into_iter().unzip();
        let settings = Settings::new(base, settings);
        let model = |clips| -> Model<'_> {
            let numbers: Numbers<'_> = Box::new(|shared| settings.theta(shared));
            ArmClips::means(&cell, clips, numbers).expect("an arm").0
        };
        let truth: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
        // Without noise nothing but the step is left.
        let finer = model(clips.clone()).predict_in(4, (0, &truth, &[])).expect("readings");
        let measured = &mut clips[0].measured;
        let dof = measured.dof;
        let rows = measured.q.chunks_exact_mut(dof).zip(measured.dq.chunks_exact_mut(dof));
        for ((q, dq), reading) in rows.zip(&finer) {
            q.copy_from_slice(&reading.state.q[..dof]);
            dq.copy_from_slice(&reading.state.dq[..dof]);
        }
        (measured.tau, clips[0].desired.tau) = (Vec::new(), Vec::new());
        let (model, random) = (model(clips), Vec::new());
        let mut found = fit(&model, &unknowns, &random, &Schedule::default(), |_, _| true).expect("an answer");
        let off = |shared: &[f64]| {
            let off = shared.iter().zip(&truth).map(|(found, truth)| (found / truth - 1.0).powi(2)).sum::<f64>();
            (off / truth.len() as f64).sqrt()
        };
        let before = off(&found.shared);
        let error = error(&model, &[0], &unknowns, &random, &found).expect("an answer");
        let open = taken_out(&mut found, &unknowns, &error);
        let after = off(&found.shared);
        assert!(before > 1e-5 && after < 0.2 * before, "off by {before:e}, and then by {after:e}");
        assert!(open.iter().zip(&error).all(|(open, error)| *open <= error.abs()));
    }
}
