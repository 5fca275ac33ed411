//! Where the search begins: the paper's parameters identified on the clips for fitting.
//!
//! In order: where gains that are known by range alone may begin; the arm by itself, since a gain that is off moves the hit,
//! and a hit elsewhere tells nothing about the gain;
//! then the object's parameters under that arm, by the fit for rough hits; then all together.

use super::effects;
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::{Effort, THOROUGH};
use crate::diagnose::fit::sweep::Precision;
use crate::diagnose::fit::{floor, stages};
use crate::diagnose::judge::trial::Found;
use crate::diagnose::propose::Search;
use crate::diagnose::propose::arm_alone::ArmAlone;
use inference::admit::{Admitted, Split};
use inference::controller;
use inference::kept::Kept;
use inference::likelihood::Settings;
use inference::likelihood::object::ObjectClips;
use inference::likelihood::random_effects::OwnNumbers;
use inference::likelihood::setting::{complete, object_parameters};
use inference::object_fit::fit_object;
use inference::witness::{self, Witness};
use shared_mem::cell::Cell;
use shared_mem::progress::Progress;
use shared_mem::recording::Clip;
use shared_mem::theta::ObjectTheta;

/// Steps in which [`Baseline::identified`] shows how far it is.
pub fn steps(with_object: bool) -> u64 {
    if with_object { 4 } else { 2 }
}

/// What the baseline of a session is identified from.
pub struct Baseline<'a> {
    pub bench: &'a Bench<'a>,
    pub split: &'a Split,
    pub cell: &'a Cell,
    pub admitted: &'a Admitted,
}

impl Baseline<'_> {
    /// `None` when the twin has no answer at the nominal parameters.
    pub fn identified(&self, bar: &Progress) -> Option<Hypothesis> {
        let (bench, train) = (self.bench, &self.split.train[..]);
        let even = floor::sensors_alone(bench.evidence);
        bar.show(0, stages::BASELINE);
        let begun = match (&self.cell.robot, self.admitted.with_object) {
            (None, _) => bench.library.start(),
            (Some(_), false) => return of_the_arm(bench, train, self.start(), bar),
            (Some(_), true) => {
                let without_object = ArmAlone(bench.evidence);
                of_the_arm(&without_object.bench(bench), train, self.start(), bar)?.full
            }
        };
        bar.show(2, stages::BASELINE);
        let full = self.with_object_refined(&begun).unwrap_or(begun);
        bar.show(3, stages::BASELINE);
        // Slopes joint by joint, as only the arm says what its gains are: an object that deviates for a reason that is not in the twin
        // yet would bend them until the hit lands where it helps.
        bench.fit(&[], full, train, &even, None, THOROUGH)
    }

    /// Where the fit begins.
    fn start(&self) -> Vec<f64> {
        let (library, mut start) = (self.bench.library, self.bench.library.start());
        let clips: Vec<&Clip> = self.split.train.iter().map(|clip| &self.admitted.clips[*clip]).collect();
        let Ok(theta) = controller::begun(self.cell, &clips, &library.theta(&start), self.bench.interrupt) else {
            return start;
        };
        let numbers = library.settings.numbers(&theta);
        for k in library.baseline.clone() {
            let unknown = &library.unknowns[k];
            start[k] = numbers[k].unwrap_or(start[k]).clamp(unknown.lower, unknown.upper);
        }
        start
    }

    /// Numbers with the object's parameters that fit the strokes best under the arm and the effects that are given, by the fit for rough
    /// hits; `None` where strokes tell nothing about the object.
    fn with_object_refined(&self, given: &[f64]) -> Option<Vec<f64>> {
        let Self { bench, split, cell, admitted } = self;
        if !admitted.with_object {
            return None;
        }
        let clips: Vec<Clip> = split.train.iter().map(|clip| admitted.clips[*clip].clone()).collect();
        let mut base = bench.library.theta(given);
        // What stood in for an effect is wrong once that effect acts: only the friction is where it was.
        let nominal = bench.library.theta(&bench.library.start()).object;
        if let (Some(object), Some(nominal)) = (&mut base.object, nominal) {
            *object = ObjectTheta { friction: object.friction, ..nominal };
        }
        let (searched, unknowns): (Vec<_>, Vec<_>) = object_parameters(cell, &base).into_iter().unzip();
        let settings = Settings::new(base, searched);
        let clips = ObjectClips::new(cell, clips, settings.clone()).ok()?;
        let mut clips = clips.simulated_by(bench.evidence.engine(), &complete(cell, None).ok()?);
        let start: Vec<f64> = unknowns.iter().map(|unknown| unknown.start).collect();
        let go_on = |_: &[f64], _| !bench.interrupt.asked();
        let found = fit_object(&mut clips, &unknowns, &start, (Kept::nothing(), ""), go_on).ok()?;
        let numbers = bench.library.settings.numbers(&settings.theta(&found.at.shared));
        let mut full = given.to_vec();
        for k in bench.library.baseline.clone() {
            full[k] = numbers[k].unwrap_or(full[k]);
        }
        Some(full)
    }

    /// The effects that act, from an identified baseline on.
    pub(in crate::diagnose) fn with_effects(&self, baseline: Hypothesis, bar: &Progress) -> Option<Found> {
        let refined = |full: &[f64]| {
            let step = self.bench.step("refined").with(&self.split.train).with_numbers(full);
            self.bench.trail.0.once(&step, || self.with_object_refined(full))
        };
        let witnessed = |full: &[f64]| self.witnessed(full);
        let search = Search { bench: self.bench, split: self.split, refined: &refined, witnessed: &witnessed, bar };
        effects::search(&search, baseline)
    }

    /// What single stages show beyond the effects in these numbers.
    fn witnessed(&self, full: &[f64]) -> Vec<Witness> {
        if !self.admitted.with_object {
            return Vec::new();
        }
        witness::beyond(self.cell, &self.admitted.clips, &self.bench.library.theta(full))
    }
}

/// The arm by itself, from where its numbers begin.
fn of_the_arm<O: OwnNumbers>(
    bench: &Bench<'_, O>,
    train: &[usize],
    start: Vec<f64>,
    bar: &Progress,
) -> Option<Hypothesis<O>> {
    let even = floor::sensors_alone(bench.evidence);
    let on_the_way = bench.fit(&[], start, train, &even, None, THOROUGH)?;
    bar.show(1, stages::BASELINE);
    let to_the_end = Effort { precision: Precision::Exact, ..THOROUGH };
    bench.fit(&[], on_the_way.full.clone(), train, &even, Some(&on_the_way), to_the_end)
}
