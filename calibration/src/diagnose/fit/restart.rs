//! Restarts of clips whose nuisance parameters are stuck in a local minimum.
//!
//! An object that is touched twice in the twin and once in the clip, or the other way round, is off by centimetres, and no
//! slope leads from one to the other, though a little more friction in that clip would. So clips that stand out are tried
//! some way along each of their nuisance parameters too.

use super::bench::{Bench, Clips};
use super::effort::ANOTHER_WAY_DEVIANCE;
use super::multi_start::{Tried, cheapest};
use super::sweep::Precision;
use inference::likelihood::random_effects::OwnNumbers;
use inference::statistics::median;
use nalgebra::DVector;

/// A clip stands out that costs so many times the typical distance from the median more than the median does, and at least
/// [`ANOTHER_WAY_DEVIANCE`] more.
const OUTLIER_DISTANCE: f64 = 4.0;
/// Where along each of its nuisance parameters it is tried [sigma], and what share of that is then kept: the way back to the likeliest
/// value may lead over the edge again.
const RESTART_SIGMAS: [f64; 4] = [-5.0, -2.5, 2.5, 5.0];
const KEPT_SHARES: [f64; 2] = [0.5, 1.0];

impl<O: OwnNumbers> Bench<'_, O> {
    /// Clips with their nuisance parameters, those that stand out where they cost least; those without an answer as they were.
    pub(in crate::diagnose) fn restarted(&self, full: &[f64], clips: Clips, weights: &[f64]) -> Clips {
        self.restarted_below(full, clips, weights, f64::INFINITY)
    }

    /// The same where they may cost less than `below` then; as they were where they do not.
    pub(super) fn restarted_below(&self, full: &[f64], mut clips: Clips, weights: &[f64], below: f64) -> Clips {
        if self.scatter.count() == self.scatter.heavy.len() {
            return clips;
        }
        let Some(costs) = self.costs(full, &clips, weights) else { return clips };
        let places = outstanding(&costs);
        // No clip costs less than nothing, wherever it is restarted.
        let others = costs.iter().enumerate().filter(|(place, _)| !places.contains(place)).map(|(_, cost)| cost);
        if others.sum::<f64>() >= below {
            return clips;
        }
        for place in places {
            let elsewhere = self.elsewhere(full, clips[place].0, weights).filter(|tried| tried.cost < costs[place]);
            if let Some(Tried { cost, numbers }) = elsewhere {
                tracing::debug!("clip {} costs {cost:.0} elsewhere instead of {:.0}", clips[place].0, costs[place]);
                clips[place].1 = numbers;
            }
        }
        clips
    }

    /// What a clip costs where it costs least some way along its nuisance parameters, and these. What has heavy tails follows by one
    /// step: it acts evenly.
    fn elsewhere(&self, full: &[f64], clip: usize, weights: &[f64]) -> Option<Tried> {
        let even = &self.scatter.heavy;
        let numbers = (0..self.scatter.count()).filter(|number| !even.contains(number));
        let begun = numbers.flat_map(|number| {
            RESTART_SIGMAS.map(|sigmas| {
                let mut own = vec![0.0; self.scatter.count()];
                own[number] = sigmas * self.scatter.random[number].sigma;
                (clip, own)
            })
        });
        let begun: Clips = begun.collect();
        let swept = self.linearise(full, &[], &begun, Precision::Exact)?;
        let mut tried = Clips::new();
        for (at, (_, begun)) in swept.clips.iter().zip(&begun) {
            let after = swept.own_after(at, self.evidence, weights, &DVector::zeros(0)).ok()?;
            tried.push((clip, after.clone()));
            tried.extend(KEPT_SHARES.map(|share| {
                let kept = |k: usize| if even.contains(&k) { after[k] } else { share * begun[k] };
                (clip, (0..after.len()).map(kept).collect())
            }));
        }
        let costs = self.costs(full, &tried, weights)?;
        cheapest(costs.into_iter().zip(tried).map(|(cost, (_, numbers))| Tried { cost, numbers }))
    }
}

/// Those that stand out among costs.
fn outstanding(costs: &[f64]) -> Vec<usize> {
    let Some(middle) = median(costs.iter().copied()) else { return Vec::new() };
    let typical = median(costs.iter().map(|cost| (cost - middle).abs())).unwrap_or(0.0);
    let most = middle + ANOTHER_WAY_DEVIANCE.max(OUTLIER_DISTANCE * typical);
    (0..costs.len()).filter(|place| costs[*place] > most).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{bench, shipped};
    use inference::estimate::{ClipModel, Impossible, Random};
    use inference::interrupt::Interrupt;
    use inference::likelihood::random_effects::{RandomEffects, WithOwn};
    use inference::likelihood::{Channel, Group, Likelihood, Row, StageName, setting};
    use shared_mem::msg::MAX_JOINTS;

    const SIGMA: f64 = 0.02;
    /// Where the second touch begins.
    const EDGE: f64 = 2.0 * SIGMA;

    /// Clips of which the fourth fits only with some friction of its own.
    struct TouchedTwice([Channel; 1], [Row; 1]);

    impl ClipModel for TouchedTwice {
        fn clips(&self) -> usize {
            5
        }

        fn residuals(&self, clip: usize, _: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
            let touched = if clip == 3 && own[0] < EDGE { 30.0 } else { 0.0 };
            *out = vec![1.0 + touched + own[0] + own[1]];
            Ok(())
        }
    }

    impl Likelihood for TouchedTwice {
        type Own = WithOwn;

        fn channels(&self) -> &[Channel] {
            &self.0
        }

        fn rows(&self, _: usize) -> &[Row] {
            &self.1
        }

        fn scatter(&self) -> RandomEffects {
            let random = |name: &str, sigma| Random { name: name.into(), sigma, step: 1e-3 };
            RandomEffects { random: vec![random("friction", SIGMA), random("x", 1.0)], heavy: 1..2, forgiving: 1.0 }
        }
    }

    #[test]
    fn a_clip_that_is_touched_twice_is_restarted_and_the_others_stay() {
        let cell = shipped();
        let base = setting::complete(&cell, None).expect("a cell");
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        let channel = Channel { quantity: "position", place: "x".into(), joint: None, group: Group::Object };
        let row = Row { channel: 0, stage: StageName::Slide, regime: "free", time: 0.0 };
        let evidence = TouchedTwice([channel], [row]);
        let interrupt = Interrupt::default();
        let bench = bench(&evidence, &library, &interrupt);
        let full = library.start();
        let rest: Clips = (0..5).map(|clip| (clip, vec![0.0; 2])).collect();
        let restarted = bench.restarted(&full, rest.clone(), &[1.0]);
        let friction = restarted[3].1[0];
        assert!((EDGE..=3.0 * SIGMA).contains(&friction), "no further than it must: {friction}");
        let changed: Vec<usize> = (0..5).filter(|place| restarted[*place] != rest[*place]).collect();
        assert_eq!(changed, [3]);
        // The other four cost 1 each.
        assert_eq!(bench.restarted_below(&full, rest.clone(), &[1.0], 4.0), rest, "a hopeless one is not");
        assert_eq!(bench.restarted_below(&full, rest, &[1.0], 5.0), restarted);
    }

    #[test]
    fn clips_of_one_kind_do_not_stand_out() {
        assert_eq!(outstanding(&[3140.0, 3256.0, 3039.0, 3342.0, 3090.0, 3380.0]), [] as [usize; 0]);
        assert_eq!(outstanding(&[3134.0, 3424.0, 3358.0, 3057.0, 4002.0, 3127.0]), [4]);
        assert_eq!(outstanding(&[10.0, 10.0, 10.0, 90.0]), [] as [usize; 0], "too little to be worth it");
    }
}
