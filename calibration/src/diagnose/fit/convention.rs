//! What any two simulations of one cell differ by anyway, and so no cause: an effect that is next to nothing, a control period more or
//! less, a contact as any engine has it.

use super::bench::{Bench, Hypothesis};
use super::parameters::Spread;
use inference::likelihood::random_effects::OwnNumbers;
use twin::effects::{EffectInfo, Parameter, Place, Role};

/// An effect weaker than this share of the strongest that is plausible is none: two engines with other steps and other
/// rules of integration differ by as much (0.35 % of a rotor's inertia and 0.02 % of viscous friction, measured on sessions
/// of another engine with nothing wrong).
const NEGLIGIBLE_SHARE: f64 = 0.008;
/// A control period and a half [s].
const DELAY_OF_CONVENTION: f64 = 1.5e-3;

/// Share of the strongest from which on an effect counts. What fades out towards infinity, as a gear's stiffness, is met
/// in practice from the far end of its plausible range on; beyond, it is the ordinary stiffness of anything.
fn least(effect: &EffectInfo) -> f64 {
    let fades = effect.parameters.iter().find(|parameter| parameter.resting_value().is_infinite());
    match fades {
        Some(parameter) if matches!(parameter.role, Role::Size { .. }) => {
            parameter.plausible[0] / parameter.plausible[1]
        }
        _ => NEGLIGIBLE_SHARE,
    }
}

impl<O: OwnNumbers> Bench<'_, O> {
    /// Whether an effect of a hypothesis is so weak that any two simulations differ as much.
    pub fn negligible(&self, effect: usize, full: &[f64]) -> bool {
        let candidate = &self.library.candidates[effect];
        let shares = candidate.sizes.iter().filter_map(|size| {
            let resting = self.library.unknowns[*size].start;
            let strongest = candidate.strongest(*size, resting)?;
            Some(((full[*size] - resting) / (strongest - resting)).abs())
        });
        shares.fold(0.0, f64::max) < least(candidate.effect)
    }

    /// Whether an effect of a hypothesis is every engine's own: what any two of them differ by.
    pub fn is_convention(&self, effect: usize, hypothesis: &Hypothesis<O>) -> bool {
        self.is_a_period_more(effect, hypothesis) || self.is_of_engines(effect, hypothesis)
    }

    /// Whether all of an effect lies where it does in engines in which nothing is wrong, or may: its intervals reach there.
    fn is_of_engines(&self, effect: usize, hypothesis: &Hypothesis<O>) -> bool {
        let candidate = &self.library.candidates[effect];
        if candidate.effect.parameters.iter().any(|parameter| parameter.of_engines.is_none()) {
            return false;
        }
        let spread = Spread::of(self, hypothesis);
        // Such effects have parameters of one number each.
        let lies = |(k, parameter): (usize, &Parameter)| {
            let (value, half) = (hypothesis.full[k], spread.half_width_of(self, hypothesis, effect, k));
            parameter.of_engines.is_some_and(|[low, high]| value + half >= low && value - half <= high)
        };
        candidate.numbers.clone().zip(candidate.effect.parameters).all(lies)
    }

    /// Whether an effect does no more to commands that another changes already than shift them by a control period: from which
    /// period on a filtered command acts differs.
    fn is_a_period_more(&self, effect: usize, hypothesis: &Hypothesis<O>) -> bool {
        let of_commands = |k: &usize| self.library.candidates[*k].effect.acts_on == Place::CommandPath;
        let weak = |size: &usize| hypothesis.full[*size] - self.library.unknowns[*size].start < DELAY_OF_CONVENTION;
        of_commands(&effect)
            && hypothesis.effects.iter().any(|other| *other != effect && of_commands(other))
            && self.library.candidates[effect].sizes.iter().all(weak)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_bench::{ONCE, on_strokes, shipped};
    use worlds::world::{Fault, Kind, World};

    #[test]
    fn an_effect_that_lies_where_any_engine_has_it_is_no_cause() {
        let cell = shipped();
        on_strokes((&cell, &World::draw(3, Kind::Strokes, Fault::Nothing, &cell)), |bench, _| {
            let mut with_a_range = 0;
            for (effect, candidate) in bench.library.candidates.iter().enumerate() {
                let at = |share: f64| {
                    let mut full = bench.library.start();
                    for (k, parameter) in candidate.numbers.clone().zip(candidate.effect.parameters) {
                        full[k] = parameter.of_engines.map_or(full[k], |[low, high]| low + share * (high - low));
                    }
                    let hypothesis = Hypothesis { effects: vec![effect], full, free: Vec::new(), fitted: Vec::new() };
                    bench.is_convention(effect, &hypothesis)
                };
                let ranges = candidate.effect.parameters.iter().all(|parameter| parameter.of_engines.is_some());
                assert_eq!(
                    [0.01, 0.5, 0.99, 1.01].map(at),
                    [ranges, ranges, ranges, false],
                    "{}",
                    candidate.effect.name
                );
                with_a_range += usize::from(ranges);
            }
            assert!(with_a_range > 0);
        });
    }

    #[test]
    fn an_effect_whose_interval_reaches_to_where_any_engine_has_it_is_no_cause() {
        let cell = shipped();
        on_strokes((&cell, &World::draw(3, Kind::Strokes, Fault::Nothing, &cell)), |bench, even| {
            let effect = bench.library.find("restitution").expect("a candidate");
            let fit = bench.fit(&[effect], bench.library.start(), &[0, 1], even, None, ONCE).expect("a fit");
            let candidate = &bench.library.candidates[effect];
            let (k, parameter) = candidate.numbers.clone().zip(candidate.effect.parameters).next().expect("a number");
            let [low, _] = parameter.of_engines.expect("a range");
            let half = Spread::of(bench, &fit).half_width_of(bench, &fit, effect, k);
            let below = |widths: f64| {
                let mut moved = fit.clone();
                moved.full[k] = low - widths * half;
                bench.is_convention(effect, &moved)
            };
            assert!(half > 0.0 && below(0.9) && !below(1.1), "{half}");
        });
    }
}
