//! What changed as numbers: the value in each session, and the change with a 95 % interval.
//!
//! The interval is that of the difference of two numbers of one fit, so that what makes both uncertain alike does not count. As
//! elsewhere it is the wider of two: from the curvature of the weighted deviance, and from how the difference moves when clips
//! are left out one by one (jackknife, with Student's t). Where a hit lies between a number and what is seen, the step over
//! which its slope was taken comes on top.

use super::answer::Values;
use super::fits::{Fitted, PairBench};
use super::subjects::Subject;
use super::turned::{Acts, Side, Turned};

use crate::page::UNBOUNDED;
use inference::likelihood::Evidence;
use inference::estimate::quadratic::minimum;
use inference::statistics::student_sigmas;
use nalgebra::{DMatrix, DVector};
use std::collections::BTreeMap;

/// Half the width of a 95 % interval of a normal number, in sigmas.
const NINETY_FIVE: f64 = 1.96;

/// The parameters of a subject that each session has of its own.
pub(super) fn of_subject<E: Evidence>(
    pair_bench: &PairBench<'_, E>,
    fitted: &Fitted,
    subject: &Subject,
) -> BTreeMap<String, Values> {
    let library = pair_bench.bench.library;
    let spread = Spread::of(pair_bench, fitted);
    let rough = subject.effect.is_some_and(|effect| !library.candidates[effect].is_of_arm());
    let mut all: BTreeMap<String, Values> = BTreeMap::new();
    for number in subject.numbers.clone() {
        let place = |side| {
            let own = Turned { number, acts: Acts::In(side) };
            fitted.model.turned.iter().position(|turned| *turned == own)
        };
        let (Some(in_a), Some(in_b)) = (place(Side::A), place(Side::B)) else { continue };
        let half = spread.half_width(in_b, in_a);
        let half = if rough { half.hypot(NINETY_FIVE * library.unknowns[number].step) } else { half };
        let setting = &library.settings.settings()[number];
        let [a, b] = [Side::A, Side::B].map(|side| fitted.model.of(side)[number]);
        let physical = |value: f64| setting.physical(value).clamp(-UNBOUNDED, UNBOUNDED);
        let ends = [b - half, b + half].map(|end| physical(end) - physical(a));
        let values = all.entry(name(&setting.parameter())).or_insert_with(|| Values::new(&setting.physical_unit()));
        values.a.push(physical(a));
        values.b.push(physical(b));
        values.change.push(physical(b) - physical(a));
        values.ci95.push([ends[0].min(ends[1]), ends[0].max(ends[1])]);
    }
    all
}

/// A parameter's own name: `delay` of `command_delay.delay`.
pub(super) fn name(parameter: &str) -> String {
    parameter.split_once('.').map_or(parameter, |(_, name)| name).to_owned()
}

/// How sure a fit's numbers are.
struct Spread {
    /// Their covariance by the curvature; none where it has no inverse.
    covariance: Option<DMatrix<f64>>,
    /// How they move without each clip.
    shifts: Vec<Vec<f64>>,
}

impl Spread {
    fn of<E: Evidence>(pair_bench: &PairBench<'_, E>, fitted: &Fitted) -> Self {
        let hypothesis = &fitted.hypothesis;
        let total = pair_bench.on_bench(&fitted.model, |bench| Some(bench.held(hypothesis)));
        let Some(total) = total else { return Self { covariance: None, shifts: Vec::new() } };
        let count = hypothesis.free.len();
        let inner: DMatrix<f64> = total.view((1, 1), (count, count)).into_owned();
        // Numbers of many sizes: scaled, so that rounding makes none of them uncertain.
        let scale = DVector::from_fn(count, |k, _| inner[(k, k)].max(f64::MIN_POSITIVE).sqrt().recip());
        let scaled = DMatrix::from_fn(count, count, |i, k| inner[(i, k)] * scale[i] * scale[k]);
        let inverse = scaled.cholesky().map(|factor| factor.inverse());
        let covariance =
            inverse.map(|inverse| DMatrix::from_fn(count, count, |i, k| inverse[(i, k)] * scale[i] * scale[k]));
        let all: Vec<usize> = (1..=count).collect();
        let without = |form: &DMatrix<f64>| minimum(&(&total - form), &all).at;
        let shifts = hypothesis.fitted.iter().map(|clip| without(&clip.reduced.form)).collect();
        Self { covariance, shifts }
    }

    /// Half the 95 % interval of the difference of two numbers.
    fn half_width(&self, one: usize, other: usize) -> f64 {
        let curvature = self
            .covariance
            .as_ref()
            .map_or(0.0, |c| (c[(one, one)] + c[(other, other)] - 2.0 * c[(one, other)]).max(0.0).sqrt());
        let clips = self.shifts.len() as f64;
        let differences: Vec<f64> = self.shifts.iter().map(|shift| shift[one] - shift[other]).collect();
        let mean = differences.iter().sum::<f64>() / clips.max(1.0);
        let squares: f64 = differences.iter().map(|difference| (difference - mean).powi(2)).sum();
        let jackknife = (squares * (clips - 1.0).max(0.0) / clips.max(1.0)).sqrt();
        (NINETY_FIVE * curvature).max(student_sigmas(NINETY_FIVE, self.shifts.len().saturating_sub(1)) * jackknife)
    }
}
