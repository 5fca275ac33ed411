//! Whether the friction drifts from clip to clip over a session, as on a table that wears or gets dirty.
//!
//! Clips scatter in friction anyway, so that a twin may follow each of them; but chance knows no order. A straight line
//! through the logarithm of their friction, in the order in which they were recorded, tells (Student's t of its slope), if it
//! leads further than clips scatter.

use crate::diagnose::fit::bench::Hypothesis;
use crate::diagnose::select::gain::CHANCE_SIGMAS;
use inference::likelihood::object::Nuisance;
use inference::likelihood::random_effects::RandomEffects;
use inference::statistics::student_sigmas;

/// A slope that is no chance counts where over the session the friction changes by so many sigmas of its scatter from clip to clip.
const MIN_CHANGE_SIGMAS: f64 = 6.0;
/// A line through fewer clips tells nothing.
const MIN_CLIPS: usize = 5;

/// How much the friction of the last clip is over that of the first, less 1; `None` where it does not drift.
pub fn of_friction(scatter: &RandomEffects, hypothesis: &Hypothesis) -> Option<f64> {
    let name = Nuisance::LnFriction.name();
    let number = scatter.random.iter().position(|random| random.name == name)?;
    let points: Vec<(f64, f64)> =
        hypothesis.fitted.iter().map(|fitted| (fitted.clip as f64, fitted.own[number])).collect();
    let change = trend(&points)?;
    (change.abs() > MIN_CHANGE_SIGMAS * scatter.random[number].sigma).then(|| change.exp_m1())
}

/// By how much the line through points rises from the first to the last, where its slope is no chance.
fn trend(points: &[(f64, f64)]) -> Option<f64> {
    let count = points.len();
    if count < MIN_CLIPS {
        return None;
    }
    let mean = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count as f64;
    let (x, y) = (mean(|p| p.0), mean(|p| p.1));
    let moment = |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| of(p.0 - x, p.1 - y)).sum::<f64>();
    let (xx, xy, yy) = (moment(&|dx, _| dx * dx), moment(&|dx, dy| dx * dy), moment(&|_, dy| dy * dy));
    let (slope, degrees) = (xy / xx, count - 2);
    let error = ((yy - slope * xy).max(0.0) / degrees as f64 / xx).sqrt();
    let span = points.last()?.0 - points.first()?.0;
    (slope.abs() > student_sigmas(CHANCE_SIGMAS, degrees) * error).then_some(slope * span)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// RandomEffects of 0.02 without order, on eight clips, with a rise on top.
    fn clips(rise: f64) -> Vec<(f64, f64)> {
        let scatter = [0.013, -0.022, 0.005, 0.031, -0.018, 0.009, -0.027, 0.016];
        scatter.iter().enumerate().map(|(k, own)| (2.0 * k as f64, own + rise * k as f64 / 7.0)).collect()
    }

    #[test]
    fn a_rise_is_told_from_scatter() {
        assert_eq!(trend(&clips(0.0)), None);
        assert_eq!(trend(&clips(0.02)), None, "as much as chance makes of such a scatter");
        for rise in [0.4, -0.3] {
            let found = trend(&clips(rise)).expect("a trend");
            assert!((found - rise).abs() < 0.05, "{found}");
        }
        assert_eq!(trend(&clips(0.4)[..4]), None, "too few");
    }
}
