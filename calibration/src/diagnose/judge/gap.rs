//! The gap: mean square of residuals in sigmas of the sensors, and by how much it shrinks from one hypothesis to another.
//!
//! A hit on a corner sends an object elsewhere by more than any cause does. So what a clip leaves in the object's poses counts up to
//! [`MAX_OF_MEDIAN`] times what the clip in the middle does (a Winsorised mean over clips).

use crate::answer::diagnosis::Share;
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::select::gain::MAX_OF_MEDIAN;
use inference::likelihood::{Evidence, Group, Row};
use inference::statistics::median;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rayon::prelude::*;
use shared_mem::msg::MAX_JOINTS;

/// Residuals of clips as the twin alone predicts them, not weighted: what a clip has of its own is not fitted, it is part
/// of the floor.
#[derive(Debug, Clone, PartialEq)]
pub struct Residuals {
    /// Clip and residuals.
    pub clips: Vec<(usize, Vec<f64>)>,
    sums: Vec<Sums>,
    /// The same of every piece of a clip: whole clips where there are enough of them.
    pieces: Vec<Sums>,
    /// The same of what noise and the scatter between clips alone would leave.
    floors: Vec<Sums>,
}

/// Squared residuals of a clip or a part of one, by groups of sensors.
type Sums = [Sum; 3];

#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Sum {
    squares: f64,
    rows: f64,
}

impl Sum {
    fn of(residual: f64) -> Self {
        Self { squares: residual * residual, rows: 1.0 }
    }

    fn with(self, other: Self) -> Self {
        Self { squares: self.squares + other.squares, rows: self.rows + other.rows }
    }

    fn mean(self) -> Option<f64> {
        (self.rows > 0.0).then(|| self.squares / self.rows)
    }
}

/// How far the gap shrinks on held-out clips.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Shrunk {
    /// Of the mean squared residual, see [`Residuals::shrink`].
    pub mean: Share,
    /// Of what is not noise in a clip like most, see [`crate::answer::diagnosis::SensorGap::explained`]: in the group of sensors of
    /// which that is most.
    pub usual: Share,
    /// The same of the joints in contact; 0 where no tool touches anything.
    pub contact: Share,
    /// In how many clips it does, and of how many.
    pub clips: [usize; 2],
}

/// A group of sensors in a clip like most.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Typical {
    /// Geometric mean over clips of the mean square of the residuals.
    pub mean_square: f64,
    /// What noise and the scatter between clips alone would leave of it.
    pub floor: f64,
    /// Whether it is the object's group; else the arm's.
    pub of_object: bool,
}

/// The groups whose gap is said. The arm in contact is evidence for causes, and no gap of its own: how far a joint yields
/// to a push says how the object resists.
const WITH_A_GAP: [Group; 2] = [Group::Arm, Group::Object];

impl Residuals {
    /// Of clips at the numbers of a hypothesis.
    pub fn at(bench: &Bench<'_>, hypothesis: &Hypothesis, clips: &[usize]) -> Option<Self> {
        Self::each(bench, &clips.iter().map(|clip| (*clip, &hypothesis.full[..])).collect::<Vec<_>>())
    }

    /// Of clips that were not fitted, each at its nuisance parameters.
    pub fn of(bench: &Bench<'_>, fits: &[(Hypothesis, Vec<usize>)]) -> Option<Self> {
        let clips = fits.iter().flat_map(|(fit, clips)| clips.iter().map(|clip| (*clip, &fit.full[..])));
        Self::each(bench, &clips.collect::<Vec<_>>())
    }

    fn each(bench: &Bench<'_>, clips: &[(usize, &[f64])]) -> Option<Self> {
        let nothing = vec![0.0; bench.scatter.count()];
        let one = |(clip, full): &(usize, &[f64])| {
            let mut out = Vec::new();
            bench.evidence.residuals(*clip, full, &nothing, &mut out).ok()?;
            Some((*clip, out))
        };
        let clips: Vec<(usize, Vec<f64>)> = clips.par_iter().map(one).collect::<Option<_>>()?;
        let in_pieces = |cut: usize| -> Vec<Sums> {
            clips.iter().flat_map(move |(clip, residuals)| pieces(bench.evidence, *clip, residuals, cut)).collect()
        };
        let (sums, pieces) = (in_pieces(1), in_pieces(MIN_PIECES.div_ceil(clips.len().max(1))));
        let floor = |(clip, _): &(usize, _)| self::pieces(bench.evidence, *clip, &noise_of_rows(bench, *clip), 1)[0];
        let floors = clips.iter().map(floor).collect();
        Some(Self { clips, sums, pieces, floors })
    }

    /// What noise and the scatter between clips alone would leave of [`Self::mean_square`].
    pub fn floor(&self) -> f64 {
        mean(&self.floors)
    }

    /// Of every group of sensors, the geometric mean over clips of their mean squares: one stroke that went its own way
    /// decides little, and a cause that shows in some clips only is seen.
    pub fn typical(&self) -> Vec<Typical> {
        WITH_A_GAP.into_iter().filter_map(|group| self.typical_of(group)).collect()
    }

    /// The same of one group; `None` where no clip has any of it.
    pub fn typical_of(&self, group: Group) -> Option<Typical> {
        self.typical_among(&(0..self.clips.len()).collect::<Vec<_>>(), group)
    }

    /// The same among some clips, by their places.
    fn typical_among(&self, places: &[usize], group: Group) -> Option<Typical> {
        let usual =
            |sums: &[Sums]| geometric_mean(places.iter().filter_map(|place| sums[*place][group as usize].mean()));
        let (mean_square, floor) = (usual(&self.sums)?, usual(&self.floors)?);
        Some(Typical { mean_square, floor, of_object: group == Group::Object })
    }

    /// The arm's group joint by joint, as [`Self::typical`]; joints that no clip shows are left out.
    pub fn typical_of_joints(&self, bench: &Bench<'_>) -> Vec<(usize, Typical)> {
        let channels = bench.evidence.channels();
        let noise: Vec<Vec<f64>> = self.clips.iter().map(|(clip, _)| noise_of_rows(bench, *clip)).collect();
        let of_joint = |joint: usize| {
            let mean_of = |clip: usize, values: &[f64]| {
                let rows = bench.evidence.rows(clip).iter().zip(values);
                let of_joint = |(row, value): (&Row, &f64)| {
                    let channel = &channels[row.channel];
                    (channel.group == Group::Arm && channel.joint == Some(joint)).then(|| Sum::of(*value))
                };
                rows.filter_map(of_joint).fold(Sum::default(), Sum::with).mean()
            };
            let left = self.clips.iter().filter_map(|(clip, residuals)| mean_of(*clip, residuals));
            let floors = self.clips.iter().zip(&noise).filter_map(|((clip, _), noise)| mean_of(*clip, noise));
            let (mean_square, floor) = (geometric_mean(left)?, geometric_mean(floors)?);
            Some((joint, Typical { mean_square, floor, of_object: false }))
        };
        (0..MAX_JOINTS).filter_map(of_joint).collect()
    }

    /// Mean square: the mean over the groups of sensors, so that a thousand encoder rows do not drown the object.
    pub fn mean_square(&self) -> f64 {
        mean(&self.sums)
    }

    /// In how many clips the mean square is smaller than `before`, and how many clips there are.
    pub fn clips_that_shrink(&self, before: &Self) -> [usize; 2] {
        let falls = |clip: &usize| mean([&self.sums[*clip]]) < mean([&before.sums[*clip]]);
        [(0..self.clips.len()).filter(falls).count(), self.clips.len()]
    }

    /// How far the gap shrinks from `before` to this.
    pub fn shrunk(&self, before: &Self, seed: u64) -> Shrunk {
        let usual = |places: &[usize]| {
            let of = |group| self.explained_among(before, places, group);
            WITH_A_GAP.into_iter().filter_map(of).fold(0.0, f64::max)
        };
        let contact = |places: &[usize]| self.explained_among(before, places, Group::Contact).unwrap_or(0.0);
        Shrunk {
            mean: self.shrink(before, seed),
            usual: over_draws(self.clips.len(), seed, usual),
            contact: over_draws(self.clips.len(), seed, contact),
            clips: self.clips_that_shrink(before),
        }
    }

    /// Share of what is not noise in a clip like most of some that is gone.
    fn explained_among(&self, before: &Self, places: &[usize], group: Group) -> Option<f64> {
        let [before, after] = [before, self].map(|residuals| residuals.typical_among(places, group));
        let (before, after) = before.zip(after)?;
        Some(explained(before.mean_square, after.mean_square, before.floor))
    }

    /// The shrink `1 - after / before` of the mean square from `before` to this, with an interval from drawing clips anew,
    /// or pieces of them where there are few.
    pub fn shrink(&self, before: &Self, seed: u64) -> Share {
        self.shrink_added(before, before, seed)
    }

    /// What a step from `from` to this adds to the shrink: `(from - after) / before`. Steps that follow each other add up to
    /// the shrink of the whole. At least [`SHRINK_OF_A_DOUBLED_GAP`].
    pub fn shrink_added(&self, from: &Self, before: &Self, seed: u64) -> Share {
        let of = |drawn: &[usize]| {
            let [from, after, before] =
                [from, self, before].map(|residuals| mean(drawn.iter().map(|k| &residuals.pieces[*k])));
            ((from - after) / before.max(f64::MIN_POSITIVE)).max(SHRINK_OF_A_DOUBLED_GAP)
        };
        over_draws(self.pieces.len(), seed, of)
    }
}

/// Share of what a gap has beyond the noise that is explained.
pub fn explained(before: f64, after: f64, floor: f64) -> f64 {
    let excess = before - floor;
    if excess <= 0.0 { 0.0 } else { ((before - after) / excess).clamp(0.0, 1.0) }
}

/// A share of so many clips or pieces, with its interval from drawing them anew (bootstrap).
fn over_draws(count: usize, seed: u64, of: impl Fn(&[usize]) -> f64) -> Share {
    let all: Vec<usize> = (0..count).collect();
    let mut rng = Pcg64::seed_from_u64(seed);
    let mut drawn: Vec<f64> =
        (0..BOOTSTRAP_DRAWS).map(|_| of(&all.iter().map(|_| rng.random_range(0..count)).collect::<Vec<_>>())).collect();
    drawn.sort_unstable_by(f64::total_cmp);
    Share { value: of(&all), ci90: [drawn[BOOTSTRAP_DRAWS / 20], drawn[BOOTSTRAP_DRAWS - 1 - BOOTSTRAP_DRAWS / 20]] }
}

/// The share by which a gap shrinks that becomes twice as large. Numbers that fit some clips may be anything in others, up
/// to an arm that swings without end: beyond twice the gap the share tells how soon a simulation was given up, not how
/// wrong the numbers are.
pub const SHRINK_OF_A_DOUBLED_GAP: f64 = -1.0;

/// Draws of the bootstrap (a choice).
const BOOTSTRAP_DRAWS: usize = 1000;

/// It draws from at least so many pieces (a choice): from fewer an interval is far too narrow.
const MIN_PIECES: usize = 8;

/// Sums of a clip cut into so many pieces of the same duration.
fn pieces(evidence: &Evidence<'_>, clip: usize, residuals: &[f64], cut: usize) -> Vec<Sums> {
    let rows = evidence.rows(clip);
    let last = rows.iter().map(|row| row.time).fold(f64::MIN_POSITIVE, f64::max);
    let mut pieces = vec![Sums::default(); cut];
    for (row, residual) in rows.iter().zip(residuals) {
        let piece = ((row.time / last * cut as f64) as usize).min(cut - 1);
        let group = &mut pieces[piece][evidence.channels()[row.channel].group as usize];
        *group = group.with(Sum::of(*residual));
    }
    pieces
}

fn geometric_mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let logarithms: Vec<f64> = values.map(|value| value.max(f64::MIN_POSITIVE).ln()).collect();
    (!logarithms.is_empty()).then(|| (logarithms.iter().sum::<f64>() / logarithms.len() as f64).exp())
}

/// What noise of one sigma and nuisance parameters that scatter as assumed would give, row by row.
fn noise_of_rows(bench: &Bench<'_>, clip: usize) -> Vec<f64> {
    let rows = bench.evidence.rows(clip);
    let mut squares = vec![1.0; rows.len()];
    for (k, random) in bench.scatter.random.iter().enumerate() {
        let slopes = bench.evidence.own_slope(clip, k).unwrap_or_default();
        squares.iter_mut().zip(slopes).for_each(|(square, slope)| *square += (slope * random.sigma).powi(2));
    }
    squares.into_iter().map(f64::sqrt).collect()
}

/// The mean over the groups that have a gap.
fn mean<'a>(parts: impl IntoIterator<Item = &'a Sums>) -> f64 {
    let parts: Vec<&Sums> = parts.into_iter().collect();
    let means: Vec<f64> = WITH_A_GAP.into_iter().filter_map(|group| mean_of_group(&parts, group)).collect();
    means.iter().sum::<f64>() / means.len().max(1) as f64
}

fn mean_of_group(parts: &[&Sums], group: Group) -> Option<f64> {
    let of_group = parts.iter().map(|part| part[group as usize]);
    if group == Group::Arm {
        return of_group.fold(Sum::default(), Sum::with).mean();
    }
    let of_clips: Vec<f64> = of_group.filter_map(Sum::mean).collect();
    let most = MAX_OF_MEDIAN * median(of_clips.iter().copied())?;
    Some(of_clips.iter().map(|of_clip| of_clip.min(most)).sum::<f64>() / of_clips.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{ONCE, on_bench, shipped, truth, with_effect};
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;
    use worlds::world::Kind;

    fn residuals(sizes: &[f64]) -> Residuals {
        let clips = sizes.iter().enumerate().map(|(clip, size)| (clip, vec![*size; 10])).collect();
        let sums = |size: &f64| [Sum { squares: 10.0 * size * size, rows: 10.0 }, Sum::default(), Sum::default()];
        let floors = sizes.iter().map(|_| sums(&1.0)).collect();
        let sums: Vec<_> = sizes.iter().map(sums).collect();
        Residuals { clips, pieces: sums.clone(), sums, floors }
    }

    #[test]
    fn one_clip_that_went_its_own_way_does_not_make_the_typical_one() {
        let [typical] = residuals(&[1.0, 1.0, 1.0, 30.0]).typical()[..] else { panic!("one group") };
        assert!((typical.mean_square - 30f64.sqrt()).abs() < 1e-9 && typical.floor == 1.0, "{typical:?}");
    }

    #[test]
    fn an_object_that_meets_a_corner_in_one_clip_does_not_decide_how_far_the_gap_shrinks() {
        let of_object = |sizes: &[f64]| {
            let mut residuals = residuals(sizes);
            for sums in [&mut residuals.sums, &mut residuals.pieces, &mut residuals.floors] {
                sums.iter_mut().for_each(|sums| sums.swap(Group::Arm as usize, Group::Object as usize));
            }
            residuals
        };
        let before = of_object(&[2.0, 2.2, 1.9, 2.1, 2.0, 1.8, 2.3, 2.0]);
        let after = of_object(&[1.0, 1.0, 1.1, 0.9, 30.0, 1.0, 1.0, 1.0]);
        let shrink = after.shrink(&before, 1);
        assert!(shrink.value > 0.5 && shrink.ci90[0] > 0.2, "{shrink:?}");
    }

    #[test]
    fn clips_are_counted_in_which_the_gap_shrinks() {
        assert_eq!(residuals(&[1.0, 1.9, 9.0]).clips_that_shrink(&residuals(&[2.0; 3])), [2, 3]);
    }

    #[test]
    fn a_fit_that_flies_apart_in_other_clips_doubles_the_gap_and_no_more() {
        let shrink = residuals(&[1e53, 1.0, 1.0, 1.0]).shrink(&residuals(&[2.0; 4]), 1);
        assert_eq!((shrink.value, shrink.ci90[0]), (SHRINK_OF_A_DOUBLED_GAP, SHRINK_OF_A_DOUBLED_GAP));
        assert!(shrink.ci90[1] <= 0.75, "{shrink:?}");
    }

    #[test]
    fn the_shrink_of_a_single_clip_has_an_interval() {
        let (cell, base) = (shipped(), setting::complete(&shipped(), None).expect("a cell"));
        let world = with_effect("command_delay", 3, Kind::Excitation, &cell);
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        on_bench((&cell, &world), &library, |bench, even| {
            let [baseline, found] = [library.start(), truth(&library, &world)]
                .map(|full| bench.fit(&[], full, &[0], even, None, ONCE).expect("a fit"));
            let [before, after] =
                [baseline, found].map(|fit| Residuals::at(bench, &fit, &[1]).expect("it can be simulated"));
            let shrink = after.shrink(&before, 1);
            assert!(before.pieces.len() == MIN_PIECES, "{} pieces", before.pieces.len());
            assert!(shrink.ci90[0] < shrink.value && shrink.value < shrink.ci90[1], "{shrink:?}");
        });
    }

    #[test]
    fn the_shrink_is_one_less_the_ratio_of_mean_squares_and_lies_in_its_interval() {
        let shrink = residuals(&[1.0, 1.0, 1.2, 0.9]).shrink(&residuals(&[2.0, 2.1, 2.2, 1.9]), 1);
        assert!((shrink.value - (1.0 - (1.0 + 1.0 + 1.44 + 0.81) / (4.0 + 4.41 + 4.84 + 3.61))).abs() < 1e-12);
        assert!(shrink.ci90[0] < shrink.value && shrink.value < shrink.ci90[1], "{shrink:?}");
        assert!(shrink.ci90[1] - shrink.ci90[0] < 0.1, "{shrink:?}");
    }

    #[test]
    fn what_steps_add_to_the_shrink_sums_to_the_shrink_of_the_whole() {
        let [before, between, after] = [[3.0, 4.0], [2.0, 3.0], [1.0, 1.5]].map(|sizes| residuals(&sizes));
        let steps = between.shrink_added(&before, &before, 1).value + after.shrink_added(&between, &before, 1).value;
        assert!((steps - after.shrink(&before, 1).value).abs() < 1e-12, "{steps}");
    }
}
