//! What changed as numbers: the value in each session, and the change with a 95 % interval.
//!
//! The interval is that of the difference of two numbers of one fit ([`Spread`]), so that what makes both uncertain alike does
//! not count.

use super::answer::Values;
use super::fits::{Fitted, PairBench};
use super::subjects::Subject;
use super::turned::{Acts, Side, Turned};
use crate::diagnose::fit::parameters::Spread;
use crate::words::UNBOUNDED;
use inference::estimate::interval::LEVEL;
use std::collections::BTreeMap;

/// The parameters of a subject that each session has of its own.
pub(super) fn of_subject(pair_bench: &PairBench<'_>, fitted: &Fitted, subject: &Subject) -> BTreeMap<String, Values> {
    let library = pair_bench.bench.library;
    let spread = pair_bench.on_bench(&fitted.model, |bench| Some(Spread::of(bench, &fitted.hypothesis)));
    let rough = subject.effect.is_some_and(|effect| !library.is_of_arm(effect));
    let mut all: BTreeMap<String, Values> = BTreeMap::new();
    for number in subject.numbers.clone() {
        let place = |side| {
            let own = Turned { number, acts: Acts::In(side) };
            fitted.model.turned.iter().position(|turned| *turned == own)
        };
        let (Some(in_a), Some(in_b)) = (place(Side::A), place(Side::B)) else { continue };
        let rough_step = rough.then(|| library.unknowns[number].step);
        let of_change = |spread: &Spread| spread.half_width(&[(in_b, 1.0), (in_a, -1.0)], rough_step, LEVEL);
        let half = spread.as_ref().map_or(0.0, of_change);
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
