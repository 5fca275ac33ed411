//! What clips cost at numbers: squared weighted residuals, and the clips' nuisance parameters in their sigmas.

use super::bench::Bench;
use inference::likelihood::random_effects::OwnNumbers;
use rayon::prelude::*;

impl<O: OwnNumbers> Bench<'_, O> {
    /// Sum of squared weighted residuals and of the nuisance parameters in their sigmas.
    pub(in crate::diagnose) fn cost(&self, full: &[f64], clips: &[(usize, Vec<f64>)], weights: &[f64]) -> Option<f64> {
        Some(self.costs(full, clips, weights)?.iter().sum::<f64>()).filter(|cost| cost.is_finite())
    }

    /// The same clip by clip.
    pub(in crate::diagnose) fn costs(
        &self,
        full: &[f64],
        clips: &[(usize, Vec<f64>)],
        weights: &[f64],
    ) -> Option<Vec<f64>> {
        let one = |(clip, own): &(usize, Vec<f64>)| {
            let mut out = Vec::new();
            self.evidence.residuals(*clip, full, own, &mut out).ok()?;
            let weighted = out.iter().zip(self.evidence.rows(*clip)).map(|(r, row)| r * weights[row.channel]);
            Some(weighted.map(|r| r * r).sum::<f64>() + self.scatter.penalty(own))
        };
        clips.par_iter().map(one).collect()
    }

    /// The cost of clips with their nuisance parameters at rest: where these were fitted they hide a part of the gap.
    pub fn plain_cost(&self, clips: &[usize], full: &[f64], weights: &[f64]) -> Option<f64> {
        self.plain_cost_below(clips, full, weights, f64::INFINITY)
    }

    /// [`Self::plain_cost`] where it is less than `bound`; clips are not asked any more once it is not.
    pub fn plain_cost_below(&self, clips: &[usize], full: &[f64], weights: &[f64], bound: f64) -> Option<f64> {
        let clips = self.with_own(clips, None);
        let mut sum = 0.0;
        for some in clips.chunks(rayon::current_num_threads()) {
            for cost in self.costs(full, some, weights)? {
                sum += cost;
            }
            if sum.is_nan() || sum >= bound {
                return None;
            }
        }
        Some(sum)
    }
}
