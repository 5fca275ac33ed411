//! The numbers of an effect as a person reads them: in the effect's own units, each with a 90 % interval.
//!
//! An interval is that of [`Jackknife`], one number and the change of one alike. Where a hit lies between a number and what is seen, the step over which its slope was
//! taken comes on top: the answer to less than that is rough. Of what was found on an arm alone the interval reaches to where the
//! number would be without the twin's time step. Of a size on which nothing depends ([`super::undetermined`]), and of what was
//! held and never fitted, all that is plausible is possible.

use super::bench::{Bench, Hypothesis};
use crate::answer::Size;
use crate::words::UNBOUNDED;
use inference::estimate::interval::Jackknife;
use inference::likelihood::random_effects::OwnNumbers;
use inference::likelihood::setting::Setting;
use inference::statistics::normal;
use std::collections::BTreeMap;
use twin::effects::{Role, Shape};

/// Level of the intervals [1].
const LEVEL: f64 = 0.90;

/// The parameters of one of a hypothesis' effects.
pub fn of_effect(bench: &Bench<'_>, hypothesis: &Hypothesis, effect: usize) -> BTreeMap<String, Size> {
    of_effect_moved(bench, hypothesis, effect, &[])
}

/// The same; `time_step`: how far the twin's time step moves each free number, where that is known ([`super::time_step`]).
pub fn of_effect_moved(
    bench: &Bench<'_>,
    hypothesis: &Hypothesis,
    effect: usize,
    time_step: &[f64],
) -> BTreeMap<String, Size> {
    let spread = Spread::of(bench, hypothesis);
    let candidate = &bench.library.candidates[effect];
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
            let half = spread.half_width_of(bench, hypothesis, effect, k);
            let place = hypothesis.free.iter().position(|free| *free == k);
            let moved = place.and_then(|place| time_step.get(place)).copied().unwrap_or(0.0);
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

/// How far the free numbers of a hypothesis may be off.
pub(in crate::diagnose) struct Spread(Jackknife);

impl Spread {
    pub(in crate::diagnose) fn of<O: OwnNumbers>(bench: &Bench<'_, O>, hypothesis: &Hypothesis<O>) -> Self {
        let clips = hypothesis.fitted.iter().map(|clip| &clip.reduced.form);
        Self(Jackknife::new(&bench.held(hypothesis), clips))
    }

    /// Half the interval of a number of one of the effects, 0 where it is not free.
    pub(in crate::diagnose) fn half_width_of<O: OwnNumbers>(
        &self,
        bench: &Bench<'_, O>,
        hypothesis: &Hypothesis<O>,
        effect: usize,
        number: usize,
    ) -> f64 {
        let rough_step = (!bench.library.candidates[effect].is_of_arm()).then(|| bench.library.unknowns[number].step);
        let place = hypothesis.free.iter().position(|free| *free == number);
        place.map_or(0.0, |place| self.half_width(&[(place, 1.0)], rough_step, LEVEL))
    }

    /// Half the interval, at `level`, of a sum of numbers, by their places among the free ones, each times a factor. `rough_step`: the
    /// step of the slope, where a hit lies between the number and what is seen.
    pub(in crate::diagnose) fn half_width(&self, sum: &[(usize, f64)], rough_step: Option<f64>, level: f64) -> f64 {
        let half = self.0.half_width(sum, level);
        if half > 0.0 { half.hypot(normal(level) * rough_step.unwrap_or(0.0)) } else { half }
    }
}
