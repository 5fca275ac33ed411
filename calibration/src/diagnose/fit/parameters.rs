//! The numbers of an effect as a person reads them: in the effect's own units, each with a 90 % interval.
//!
//! An interval is the wider of two: from the curvature of the weighted deviance, and from how the number moves when clips are
//! left out one by one (jackknife), with Student's t for as few clips as there are. Where a hit lies between a number and
//! what is seen, the step over which its slope was taken comes on top: the answer to less than that is rough. Of what was
//! found on an arm alone the interval reaches to where the number would be without the twin's time step. Of a size on
//! which nothing depends ([`super::undetermined`]), and of what was held and never fitted, all that is met in practice is
//! possible.

use super::bench::{Bench, Hypothesis};

use crate::page::{Size, UNBOUNDED};
use inference::likelihood::Evidence;
use inference::likelihood::setting::Setting;
use inference::estimate::quadratic::minimum;
use inference::statistics::student_sigmas;
use nalgebra::DMatrix;
use std::collections::BTreeMap;
use twin::effects::{Role, Shape};

/// Half the width of a 90 % interval of a normal number, in sigmas.
const NINETY: f64 = 1.645;

/// The parameters of one of a hypothesis' effects.
pub fn of_effect<E: Evidence>(bench: &Bench<'_, E>, hypothesis: &Hypothesis, effect: usize) -> BTreeMap<String, Size> {
    of_effect_moved(bench, hypothesis, effect, &[])
}

/// The same; `time_step`: how far the twin's time step moves each free number, where that is known ([`super::time_step`]).
pub fn of_effect_moved<E: Evidence>(
    bench: &Bench<'_, E>,
    hypothesis: &Hypothesis,
    effect: usize,
    time_step: &[f64],
) -> BTreeMap<String, Size> {
    let half_widths = half_widths(bench, hypothesis);
    let candidate = &bench.library.candidates[effect];
    let rough = !candidate.is_of_arm();
    let mut sizes = BTreeMap::new();
    for parameter in candidate.effect.parameters {
        let mut size = Size { values: Vec::new(), ci90: Vec::new(), unit: parameter.unit.to_owned() };
        for k in candidate.numbers.clone() {
            let Setting::Effect { parameter: name, inverse, .. } = bench.library.settings.settings()[k] else {
                continue;
            };
            if name != parameter.name {
                continue;
            }
            let value = hypothesis.full[k];
            let place = hypothesis.free.iter().position(|free| *free == k);
            let half = place.map_or(0.0, |place| half_widths[place]);
            let moved = place.and_then(|place| time_step.get(place)).copied().unwrap_or(0.0);
            let half = if rough && half > 0.0 { half.hypot(NINETY * bench.library.unknowns[k].step) } else { half };
            let unknown = candidate.sizes.contains(&k) || candidate.held.contains(&k);
            let open = unknown && !hypothesis.free.contains(&k);
            let interval = match bench.library.plausible(k).unwrap_or(parameter.plausible) {
                _ if !open => [value - half + moved.min(0.0), value + half + moved.max(0.0)],
                [low, _] if inverse => [0.0, low.recip()],
                plausible => plausible,
            };
            let (value, interval) = readable(value, interval, inverse, parameter.possible);
            size.values.push(value);
            size.ci90.push(interval);
        }
        // A form that nothing depends on is no finding; a spring that is infinitely stiff cannot be written as a number.
        let unbounded = size.values.iter().any(|value| !value.is_finite());
        if matches!(parameter.shape, Shape::PerJoint) || !unbounded || matches!(parameter.role, Role::Size { .. }) {
            sizes.insert(parameter.name.to_owned(), size);
        }
    }
    sizes
}

/// Back from the number that was turned, within the values that have a meaning.
fn readable(value: f64, [low, high]: [f64; 2], inverse: bool, possible: [f64; 2]) -> (f64, [f64; 2]) {
    if inverse {
        let of = |number: f64| if number > UNBOUNDED.recip() { number.recip() } else { UNBOUNDED };
        return (of(value), [of(high), of(low)]);
    }
    (value, [low.max(possible[0]), high.min(possible[1])])
}

/// Half the 90 % interval of every free number.
fn half_widths<E: Evidence>(bench: &Bench<'_, E>, hypothesis: &Hypothesis) -> Vec<f64> {
    let total = bench.held(hypothesis);
    let count = hypothesis.free.len();
    let inner: DMatrix<f64> = total.view((1, 1), (count, count)).into_owned();
    let curvature: Vec<f64> = inner
        .cholesky()
        .map_or_else(|| vec![0.0; count], |c| c.inverse().diagonal().iter().map(|v| v.sqrt()).collect());
    let all: Vec<usize> = (1..=count).collect();
    let shifts: Vec<Vec<f64>> =
        hypothesis.fitted.iter().map(|clip| minimum(&(&total - &clip.reduced.form), &all).at).collect();
    let clips = shifts.len() as f64;
    let jackknife = |k: usize| {
        let mean = shifts.iter().map(|shift| shift[k]).sum::<f64>() / clips;
        let squares: f64 = shifts.iter().map(|shift| (shift[k] - mean).powi(2)).sum();
        (squares * (clips - 1.0) / clips).sqrt()
    };
    let t = student_sigmas(NINETY, hypothesis.fitted.len().saturating_sub(1));
    (0..count).map(|k| (NINETY * curvature[k]).max(t * jackknife(k))).collect()
}
