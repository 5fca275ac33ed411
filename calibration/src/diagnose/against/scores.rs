//! What every change would explain, by the slopes of all clips of both sessions around one model, and which changes these
//! clips would have shown.
//!
//! A change is held against the same thing being in both sessions: an effect that the model lacks in both is no change. Over
//! the quadratic form of the weighted deviance the gain of a change is what it lowers the minimum by beyond that, with
//! everything that is shared at its best.

use super::super::library::Library;
use super::fits::PairBench;
use super::subjects::Subject;
use super::turned::{Acts, Model, SIDES, Side, side_of};
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::shortlist::Scored;
use crate::diagnose::fit::sweep::{Column, Point, Precision, Swept, sweep};
use crate::diagnose::propose::signatures::weights;
use inference::estimate::interval::half_width;
use inference::estimate::quadratic::{bounded_minimum, eliminate, minimum};
use inference::statistics::{beyond_chi_square, level};
use nalgebra::{DMatrix, DVector};

/// A change as the slopes have it.
#[derive(Debug, Clone)]
pub(super) struct Score {
    /// Index of the subject.
    pub(super) subject: usize,
    /// By how much the deviance would fall beyond what it falls by with the same in both sessions.
    pub(super) gain: f64,
    /// By how much it would fall with the same in both sessions.
    pub(super) gain_shared: f64,
    /// Numbers that the change costs.
    pub(super) cost: usize,
    /// Probability of such a gain by chance.
    pub(super) p: f64,
    /// The numbers of both sessions with the change as strong as that, and of both with the same.
    pub(super) starts: [[Vec<f64>; 2]; 2],
    /// One sigma of the change of each of its sizes, every other number at its best.
    pub(super) sigma: Vec<(usize, f64)>,
}

/// The slopes of both sessions.
pub(super) struct Slopes {
    swept: [Swept; 2],
    /// Factors on the channels: what the richest model leaves is taken for noise.
    pub(super) weights: Vec<f64>,
    forms: [DMatrix<f64>; 2],
    /// The same clip by clip.
    clips: [Vec<DMatrix<f64>>; 2],
}

/// A column of the form of both sessions: its place in the form of each that it belongs to.
type Place = [Option<usize>; 2];

impl Slopes {
    /// Around a model that was fitted; `None` where the twin has no answer, or the time is over.
    pub(super) fn around(
        pair_bench: &PairBench<'_>,
        model: &Model,
        fitted: &Hypothesis,
        known_weights: Option<&[f64]>,
    ) -> Option<Self> {
        let bench = pair_bench.bench;
        let one = |side: Side| {
            let mut free: Vec<usize> =
                model.turned.iter().filter(|turned| turned.acts.on(side)).map(|turned| turned.number).collect();
            free.sort_unstable();
            let candidates = bench.library.candidates.iter().enumerate();
            let is_in = |numbers: &[usize]| numbers.iter().any(|number| free.contains(number));
            let probed: Vec<usize> =
                candidates.filter(|(_, info)| !is_in(&info.turned)).map(|(candidate, _)| candidate).collect();
            let train = pair_bench.split.train.iter().copied();
            let of_side: Vec<usize> = train.filter(|clip| side_of(*clip, pair_bench.first_of_b) == side).collect();
            let clips = bench.with_own(&of_side, Some(fitted));
            let (full, free) = (model.of(side), &free[..]);
            let point = Point { full, free, probed: &probed, clips: &clips, precision: Precision::Joints };
            sweep(bench.evidence, bench.library, &point, &bench.scatter, &|_| !bench.interrupt.asked()).ok()
        };
        let swept = [one(Side::A)?, one(Side::B)?];
        let weights =
            known_weights.map_or_else(|| weights(bench, &[&swept[0], &swept[1]]), |known| Some(known.to_vec()))?;
        let clips = |swept: &Swept| -> Option<Vec<DMatrix<f64>>> {
            let reduced = swept.reduced(bench.evidence, &weights).ok()?;
            Some(reduced.into_iter().map(|clip| clip.form).collect())
        };
        let clips = [clips(&swept[0])?, clips(&swept[1])?];
        let forms = [0, 1].map(|side: usize| {
            let size = 1 + swept[side].columns.len();
            clips[side].iter().fold(DMatrix::zeros(size, size), |sum, form| sum + form)
        });
        Some(Self { swept, weights, forms, clips })
    }

    /// The form over the residual and columns of both sessions.
    fn form(&self, columns: &[Place]) -> DMatrix<f64> {
        over(self.forms.each_ref().map(Some), columns)
    }

    /// One sigma of the coefficient of a column, those of the others at their best, by the rule of all intervals: what the curvature says,
    /// or what the scatter of the clips' slopes says (a sandwich).
    fn sigma(&self, others: &[Place], held: &[f64], column: Place) -> f64 {
        let columns = [others, &[column]].concat();
        let form = self.form(&columns);
        let count = others.len();
        let mut inner = form.view((1, 1), (count, count)).into_owned();
        for (k, held) in held.iter().enumerate() {
            inner[(k, k)] += held + RELATIVE_RIDGE * inner[(k, k)] + f64::MIN_POSITIVE.sqrt();
        }
        let Some(inner) = inner.cholesky() else { return f64::INFINITY };
        // Residual and column with what the others imitate taken out.
        let freed = |of: usize| {
            let imitated = inner.solve(&form.view((1, of), (count, 1)));
            let mut freed = DVector::zeros(count + 2);
            freed.rows_mut(1, count).copy_from(&-imitated);
            freed[of] = 1.0;
            freed
        };
        let (residual, own) = (freed(0), freed(count + 1));
        let information = own.dot(&(&form * &own)).max(f64::MIN_POSITIVE);
        let of_clip = |(side, form): (usize, &DMatrix<f64>)| {
            let sides = if side == 0 { [Some(form), None] } else { [None, Some(form)] };
            residual.dot(&(over(sides, &columns) * &own))
        };
        let clips = (0..2).flat_map(|side| self.clips[side].iter().map(move |form| (side, form)));
        let slopes: Vec<f64> = clips.map(of_clip).collect();
        let count = slopes.len();
        let spread = slopes.iter().map(|slope| slope * slope).sum::<f64>() * count as f64 / (count.max(2) - 1) as f64;
        half_width(level(1.0), information.sqrt().recip(), spread.sqrt() / information, count)
    }
}

/// Relative ridge: columns that say the same to this many digits are one.
const RELATIVE_RIDGE: f64 = 1e-9;

/// The form over the residual and columns, of those sessions that are given.
fn over(forms: [Option<&DMatrix<f64>>; 2], columns: &[Place]) -> DMatrix<f64> {
    let places: Vec<Place> = std::iter::once([Some(0), Some(0)]).chain(columns.iter().copied()).collect();
    let product = |i: usize, k: usize| {
        let of_side = |side: usize| Some(forms[side]?[(places[i][side]?, places[k][side]?)]);
        of_side(0).unwrap_or(0.0) + of_side(1).unwrap_or(0.0)
    };
    DMatrix::from_fn(places.len(), places.len(), product)
}

impl Slopes {
    fn place(&self, side: Side, column: Column) -> Option<usize> {
        self.swept[side as usize].columns.iter().position(|known| *known == column).map(|at| at + 1)
    }

    /// Every subject that has not changed yet, the most promising first.
    pub(super) fn scores(&self, bench: &Bench<'_>, model: &Model, subjects: &[Subject]) -> Vec<Score> {
        let shared = |number: usize| model.turned.contains(&super::turned::Turned { number, acts: Acts::Everywhere });
        let changed = |subject: &Subject| subject.numbers.clone().any(|k| is_apart(model, k));
        let all = subjects.iter().enumerate().filter(|(_, subject)| !changed(subject));
        let mut scores: Vec<Score> = all
            .filter_map(|(index, subject)| {
                let is_in = subject.is_in(shared);
                if is_in {
                    self.of_known(bench.library, model, index, subject)
                } else {
                    self.of_new(bench, model, index, subject)
                }
            })
            .collect();
        let worth = |score: &Score| score.gain - 2.0 * score.cost as f64;
        scores.sort_by(|a, b| worth(b).total_cmp(&worth(a)));
        scores
    }

    /// What is turned, as columns, with the precision that keeps each within its range.
    fn nuisance(&self, library: &Library, model: &Model) -> (Vec<Place>, Vec<f64>) {
        let column = |turned: &super::turned::Turned| {
            SIDES.map(|side| turned.acts.on(side).then(|| self.place(side, Column::Number(turned.number))).flatten())
        };
        let held = |turned: &super::turned::Turned| hold(library, turned.number);
        (model.turned.iter().map(column).collect(), model.turned.iter().map(held).collect())
    }

    /// The form with what is turned at its best, over the residual and `extra` columns alone.
    fn beyond(&self, library: &Library, model: &Model, extra: &[(Place, f64)]) -> DMatrix<f64> {
        let (mut columns, mut held) = self.nuisance(library, model);
        let nuisance: Vec<usize> = (1..=columns.len()).collect();
        columns.extend(extra.iter().map(|(place, _)| *place));
        held.extend(extra.iter().map(|(_, held)| *held));
        let mut form = self.form(&columns);
        for (k, held) in held.iter().enumerate() {
            form[(k + 1, k + 1)] += held;
        }
        let left = eliminate(&form, &nuisance);
        let kept: Vec<usize> = std::iter::once(0).chain(columns.len() - extra.len() + 1..=columns.len()).collect();
        DMatrix::from_fn(kept.len(), kept.len(), |i, k| left[(kept[i], kept[k])])
    }

    /// Of something that the model has in both sessions.
    fn of_known(&self, library: &Library, model: &Model, index: usize, subject: &Subject) -> Option<Score> {
        let turned: Vec<usize> =
            subject.turned.iter().copied().filter(|k| self.place(Side::B, Column::Number(*k)).is_some()).collect();
        let extra: Vec<(Place, f64)> =
            (turned.iter()).map(|k| ([None, self.place(Side::B, Column::Number(*k))], hold(library, *k))).collect();
        let left = self.beyond(library, model, &extra);
        let found = minimum(&left, &(1..=extra.len()).collect::<Vec<_>>());
        let mut in_b = model.of(Side::B).clone();
        for (number, step) in turned.iter().zip(&found.at) {
            in_b[*number] += step;
        }
        let same = model.values.clone();
        let (others, held) = self.nuisance(library, model);
        let sigma = extra.iter().zip(&turned).filter(|(_, k)| subject.sizes.contains(k));
        let sigma = sigma.map(|((column, _), k)| (*k, self.sigma(&others, &held, *column))).collect();
        let cost = turned.len();
        (cost > 0).then(|| Score {
            subject: index,
            gain: found.gain,
            gain_shared: 0.0,
            cost,
            p: beyond_chi_square(found.gain, cost),
            starts: [[model.of(Side::A).clone(), in_b], same],
            sigma,
        })
    }

    /// Of an effect that the model has in neither.
    fn of_new(&self, bench: &Bench<'_>, model: &Model, index: usize, subject: &Subject) -> Option<Score> {
        let library = bench.library;
        let candidate = subject.effect?;
        let info = &library.candidates[candidate];
        let of_form = |alternative: usize| {
            let probes = &info.alternatives[alternative].probes;
            let place = |side, probe| self.place(side, Column::Probe(candidate, alternative, probe));
            let columns = |side: Side| -> Option<Vec<(Place, f64)>> {
                let one = |probe: usize| {
                    let at = place(side, probe)?;
                    let own = if side == Side::A { [Some(at), None] } else { [None, Some(at)] };
                    Some((own, probes[probe].largest.powi(-2)))
                };
                (0..probes.len()).map(one).collect()
            };
            let (count, extra) = (probes.len(), [columns(Side::A)?, columns(Side::B)?].concat());
            let left = self.beyond(library, model, &extra);
            let one_sided: Vec<bool> = probes.iter().map(|probe| probe.one_sided).collect();
            let apart = bounded_minimum(&left, &(1..=2 * count).collect::<Vec<_>>(), &one_sided.repeat(2));
            let together = same_in_both(&left, count);
            let both = bounded_minimum(&together, &(1..=count).collect::<Vec<_>>(), &one_sided);
            Some((alternative, apart, both))
        };
        let forms = (0..info.alternatives.len()).filter_map(of_form);
        let (alternative, apart, both) = forms.max_by(|a, b| a.1.gain.total_cmp(&b.1.gain))?;
        let probes = &info.alternatives[alternative].probes;
        let count = probes.len();
        let begun =
            |side: Side, units: &[f64]| bench.begun(model.of(side).clone(), &pointed(candidate, alternative, units));
        let starts = [
            [begun(Side::A, &apart.at[..count]), begun(Side::B, &apart.at[count..])],
            SIDES.map(|side| begun(side, &both.at)),
        ];
        let gain = (apart.gain - both.gain).max(0.0);
        let (others, held) = self.nuisance(library, model);
        let sigma = (probes.iter().enumerate()).map(|(probe, info)| {
            let (size, at_one) = info.moves[0];
            let [in_a, in_b] = SIDES.map(|side| self.place(side, Column::Probe(candidate, alternative, probe)));
            let others = [&others[..], &[[in_a, in_b]]].concat();
            let held = [&held[..], &[info.largest.powi(-2)]].concat();
            (size, (at_one - library.unknowns[size].start).abs() * self.sigma(&others, &held, [None, in_b]))
        });
        let sigma = sigma.collect();
        Some(Score {
            subject: index,
            gain,
            gain_shared: both.gain,
            cost: count,
            p: beyond_chi_square(gain, count),
            starts,
            sigma,
        })
    }
}

/// Whether each session has a number of its own.
pub(super) fn is_apart(model: &Model, number: usize) -> bool {
    model.turned.iter().any(|turned| turned.number == number && turned.acts != Acts::Everywhere)
}

/// Precision that keeps a number within its range.
fn hold(library: &Library, number: usize) -> f64 {
    let unknown = &library.unknowns[number];
    (0.5 * (unknown.upper - unknown.lower)).powi(-2)
}

/// The form over residual and `count` columns that both sessions share, of one over residual, A's columns and B's.
fn same_in_both(form: &DMatrix<f64>, count: usize) -> DMatrix<f64> {
    let parts = |k: usize| if k == 0 { vec![0] } else { vec![k, k + count] };
    DMatrix::from_fn(count + 1, count + 1, |i, k| {
        parts(i).iter().flat_map(|a| parts(k).into_iter().map(move |b| form[(*a, b)])).sum()
    })
}

fn pointed(candidate: usize, alternative: usize, units: &[f64]) -> Scored {
    let (units, next) = (units.to_vec(), Vec::new());
    Scored { candidate, alternative, units, next, gain: 0.0, cost: 0, cosine: 0.0, signal: 0.0, imitated: 0.0, p: 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use inference::likelihood::random_effects::RandomEffects;

    /// (1 - a - 2 b)^2 + (3 - b)^2 over (1, a, b).
    fn form() -> DMatrix<f64> {
        DMatrix::from_row_slice(3, 3, &[10.0, -1.0, -5.0, -1.0, 1.0, 2.0, -5.0, 2.0, 5.0])
    }

    #[test]
    fn columns_of_both_sessions_that_move_together_are_one() {
        let both = same_in_both(&form(), 1);
        // (1 - 3 s)^2 + (3 - s)^2.
        assert_eq!(both, DMatrix::from_row_slice(2, 2, &[10.0, -6.0, -6.0, 10.0]));
    }

    /// Sessions of four clips with one column, of which noise or the clips' own ways make the slopes.
    fn sigma(slopes: [f64; 4]) -> f64 {
        let clip = |slope: &f64| DMatrix::from_row_slice(2, 2, &[slope * slope, *slope, *slope, 1.0]);
        let clips = [slopes[..2].iter().map(clip).collect::<Vec<_>>(), slopes[2..].iter().map(clip).collect()];
        let forms = clips.each_ref().map(|clips: &Vec<DMatrix<f64>>| &clips[0] + &clips[1]);
        let nothing = || Swept { columns: Vec::new(), scatter: RandomEffects::default(), clips: Vec::new() };
        let slopes = Slopes { swept: [nothing(), nothing()], weights: Vec::new(), forms, clips };
        slopes.sigma(&[[Some(1), Some(1)]], &[0.0], [None, Some(1)])
    }

    #[test]
    fn a_change_is_as_uncertain_as_its_curvature_or_its_clips_say() {
        // Two clips in each session: the difference of two means of two numbers of variance 1.
        assert!((sigma([0.1, -0.1, 0.1, -0.1]) - 1.0).abs() < 1e-6);
        let scattered = sigma([10.0, -10.0, 10.0, -10.0]);
        assert!((scattered / sigma([5.0, -5.0, 5.0, -5.0]) - 2.0).abs() < 1e-6 && scattered > 10.0, "{scattered}");
    }
}
