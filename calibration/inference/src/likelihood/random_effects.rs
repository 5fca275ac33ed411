//! What every clip has of its own, as random effects: nuisance parameters with the scatter that they have from clip to clip.
//!
//! Friction and the clock scatter like normal numbers. The way a real object takes from a hit differs from any simulated
//! one by a little in most clips and by a lot in some: a blow on an edge, a second touch. These parameters follow a Student
//! t distribution together (Lange, Little & Taylor 1989), so that one clip that went its own way does not decide.

use crate::estimate::Random;
use std::fmt::Debug;
use std::ops::Range;

/// Degrees of freedom of the heavy tails [1], a choice: low enough that ten sigmas occur now and then.
const DEGREES_OF_FREEDOM: f64 = 3.0;

/// Whether the clips of a bench have nuisance parameters.
pub trait OwnNumbers: Debug + Clone + Copy + Send + Sync + 'static {}

/// Each clip has those that its evidence names, of some evidence none.
#[derive(Debug, Clone, Copy)]
pub struct WithOwn;

/// No clip has any.
#[derive(Debug, Clone, Copy)]
pub struct WithoutOwn;

impl OwnNumbers for WithOwn {}
impl OwnNumbers for WithoutOwn {}

/// The nuisance parameters of a clip.
#[derive(Debug, Clone)]
pub struct RandomEffects {
    /// Names, sigmas and steps.
    pub random: Vec<Random>,
    /// Those of them whose scatter has heavy tails, as one vector.
    pub heavy: Range<usize>,
    /// Which clips are outliers is decided by sigmas so many times as wide [1].
    pub forgiving: f64,
}

impl Default for RandomEffects {
    fn default() -> Self {
        Self { random: Vec::new(), heavy: 0..0, forgiving: 1.0 }
    }
}

impl RandomEffects {
    /// The same with the heavy-tailed ones so many times as wide.
    pub fn scaled(&self, scale: f64) -> Self {
        let mut scaled = self.clone();
        scaled.random[self.heavy.clone()].iter_mut().for_each(|effect| effect.sigma *= scale);
        scaled
    }

    /// Held to so many times less scatter, but for the clips that went their own way before.
    pub fn narrowed(&self, scale: f64) -> Self {
        Self { forgiving: 1.0 / scale, ..self.scaled(scale) }
    }

    /// How many nuisance parameters a clip has.
    pub fn count(&self) -> usize {
        self.random.len()
    }

    /// Sum of squares of the heavy-tailed ones in their sigmas.
    fn heavy_square(&self, own: &[f64]) -> f64 {
        self.heavy.clone().map(|k| (own[k] / (self.forgiving * self.random[k].sigma)).powi(2)).sum()
    }

    /// By how much more (or less) than at one sigma the heavy-tailed ones of a clip are held: the weight with which
    /// reweighted least squares find the most likely values.
    fn hold(&self, own: &[f64]) -> f64 {
        (DEGREES_OF_FREEDOM + self.heavy.len() as f64) / (DEGREES_OF_FREEDOM + self.heavy_square(own))
    }

    /// Prior precision of every parameter near `own`; 1 for those that do not scatter, which keeps them where they are.
    pub fn precision(&self, own: &[f64]) -> Vec<f64> {
        let hold = self.hold(own);
        let of = |(k, random): (usize, &Random)| match random.sigma {
            0.0 => 1.0,
            sigma if self.heavy.contains(&k) => hold / (sigma * sigma),
            sigma => 1.0 / (sigma * sigma),
        };
        self.random.iter().enumerate().map(of).collect()
    }

    /// `-2 ln` of the prior density, but for a constant.
    pub fn penalty(&self, own: &[f64]) -> f64 {
        let light = (self.random.iter().enumerate())
            .filter(|(k, _)| !self.heavy.contains(k))
            .map(|(k, random)| random.square(own[k]));
        light.sum::<f64>() + self.tails(own)
    }

    fn tails(&self, own: &[f64]) -> f64 {
        (DEGREES_OF_FREEDOM + self.heavy.len() as f64) * (self.heavy_square(own) / DEGREES_OF_FREEDOM).ln_1p()
    }

    /// What a normal prior with [`Self::precision`] counts less than the heavy-tailed one, as part of a deviance whose
    /// volume is taken with that precision.
    pub fn correction(&self, own: &[f64]) -> f64 {
        let hold = self.hold(own);
        self.tails(own) - hold * self.heavy_square(own) + self.heavy.len() as f64 * hold.ln()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> RandomEffects {
        let random = |name: &str, sigma| Random { name: name.into(), sigma, step: 1e-3 };
        RandomEffects { random: vec![random("light", 2.0), random("heavy", 0.5)], heavy: 1..2, forgiving: 1.0 }
    }

    #[test]
    fn the_hold_is_the_slope_of_the_penalty_over_the_square() {
        let effects = two();
        for x in [0.1, 1.0, 7.0] {
            let slope = (effects.penalty(&[0.0, x + 1e-6]) - effects.penalty(&[0.0, x - 1e-6])) / 2e-6;
            let held = 2.0 * x * effects.precision(&[0.0, x])[1];
            assert!((slope / held - 1.0).abs() < 1e-4, "{x}: {slope} {held}");
        }
    }

    #[test]
    fn a_far_clip_costs_little_more_the_further_it_is_off_and_a_normal_one_ever_more() {
        let effects = two();
        let rise = |a: [f64; 2], b: [f64; 2]| effects.penalty(&b) - effects.penalty(&a);
        assert!(rise([0.0, 50.0], [0.0, 100.0]) < 6.0);
        assert!(rise([50.0, 0.0], [100.0, 0.0]) > 1000.0);
    }
}
