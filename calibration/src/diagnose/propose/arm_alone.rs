//! Clips with an object as if only the arm had been recorded. What the joints' own channels tell about an effect in the
//! joints needs no object, and simulating the arm up to the touch takes a tenth of the time of a whole stroke. So effects in
//! the joints are compared there first, and few of them are taken on to the object.

use super::screening::arm_gap_is_open;
use super::{Around, Search, starts};
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::effort::{NEAR_DEVIANCE, PROBE, REFINEMENT, SCREENING};
use crate::diagnose::fit::multi_start::MultiStart;
use crate::diagnose::fit::{stages, undetermined};
use crate::diagnose::judge::closing::MIN_SHARE_CLOSED;
use crate::diagnose::judge::trial::Step;
use inference::estimate::{ClipModel, Impossible};
use inference::likelihood::arm::following::Moment;
use inference::likelihood::random_effects::{RandomEffects, WithoutOwn};
use inference::likelihood::{Channel, Evidence, Likelihood, Near, Reach, Row};

/// The same clips, rows and channels; residuals of the object are zero, and clips have no nuisance parameters.
pub struct ArmAlone<'a>(pub &'a Evidence<'a>);

impl ArmAlone<'_> {
    /// A bench for these.
    pub fn bench<'b>(&'b self, whole: &Bench<'b>) -> Bench<'b, WithoutOwn> {
        whole.seen_as(self, "the arm alone")
    }
}

/// Trials of effects in the joints, at their `places` in a step, fitted to the arm's own channels first; those that explain these about
/// as well as the best of them are looked at once with the object as well. What an object does after it was hit a little
/// elsewhere is no judge of joints. `others`: steps of the bar that the caller takes next.
pub(in crate::diagnose) fn fitted(
    search: &Search<'_>,
    step: &Step,
    places: &[usize],
    overlooked: bool,
    others: u64,
) -> Vec<(usize, Hypothesis)> {
    if places.is_empty() {
        search.bar.stage(stages::FITS, others);
        return Vec::new();
    }
    let (bench, evidence) = (search.bench, ArmAlone(search.bench.evidence));
    let arm = evidence.bench(bench);
    let (clips, weights) = (&search.split.train, &step.weights);
    let fits = MultiStart { bench: &arm, effects: &step.from.effects, clips, weights, near: None };
    // What the step extends, as the arm alone sees it.
    let Some(from) = fits.fit(step.from.full.clone(), PROBE) else { return Vec::new() };
    let around = Around { bench: &arm, from: &from, weights: &step.weights };
    let label = |stage: &str, place: usize| {
        stages::of(stage, bench.library.candidates[step.trials[place].scored.candidate].effect.name)
    };
    search.bar.stage(stages::ARM_FITS, places.len() as u64);
    let alone = |(done, place): (usize, &usize)| {
        search.bar.show(done as u64, &label(stages::ARM_FITS, *place));
        let scored = (!bench.interrupt.asked()).then(|| &step.trials[*place].scored)?;
        let effects = [&step.from.effects[..], &[scored.candidate]].concat();
        let fits = MultiStart { bench: &arm, effects: &effects, clips, weights, near: None };
        Some((*place, fits.best_further(starts::kept(&around, scored, overlooked), SCREENING, 1, REFINEMENT)?))
    };
    let all: Vec<(usize, Hypothesis<WithoutOwn>)> = places.iter().enumerate().filter_map(alone).collect();
    let best = all.iter().fold(&from, |best, (_, fit)| if fit.deviance() < best.deviance() { fit } else { best });
    let near = best.deviance() + NEAR_DEVIANCE.max(MIN_SHARE_CLOSED * (from.deviance() - best.deviance()));
    let anew = if arm_gap_is_open(&step.whole, &step.left) { (search.refined)(&best.full) } else { None };
    let near: Vec<(usize, Hypothesis<WithoutOwn>)> =
        all.into_iter().filter(|(_, alone)| alone.deviance() < near).collect();
    search.bar.stage(stages::FITS, near.len() as u64 + others);
    let looked_at = |(done, (place, alone)): (usize, (usize, Hypothesis<WithoutOwn>))| {
        search.bar.show(done as u64, &label(stages::FITS, place));
        let candidate = step.trials[place].scored.candidate;
        let mut open = undetermined::sizes(&arm, &alone, candidate);
        open.retain(|k| bench.library.joints[*k].is_none());
        Some((place, with_object(search, step, &alone, &open, anew.as_deref())?))
    };
    near.into_iter().enumerate().filter_map(looked_at).collect()
}

/// A fit to the arm alone, looked at with the object: with that of the step, and with one found anew. `open`: numbers of its effect that
/// the arm leaves open.
fn with_object(
    search: &Search<'_>,
    step: &Step,
    alone: &Hypothesis<WithoutOwn>,
    open: &[usize],
    anew: Option<&[f64]>,
) -> Option<Hypothesis> {
    let bench = search.bench;
    let around = Around { bench, from: &step.from, weights: &step.weights };
    let object = |other: &[f64]| bench.library.with_object_of(alone.full.clone(), other);
    let starts = [Some(alone.full.clone()), anew.map(object)].into_iter().flatten();
    let seen = starts.map(|start| starts::seen_by_the_object(&around, start, open));
    search.fits(&alone.effects, &step.weights, &step.from).best(seen, PROBE)
}

impl ClipModel for ArmAlone<'_> {
    fn clips(&self) -> usize {
        self.0.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let nothing = vec![0.0; self.rows(clip).len()];
        self.0.changed(clip, (shared, own), (Reach::Arm, &nothing, None), out)
    }
}

impl Likelihood for ArmAlone<'_> {
    type Own = WithoutOwn;

    fn changed(
        &self,
        clip: usize,
        numbers: (&[f64], &[f64]),
        (reach, base, at): Near<'_>,
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        match reach {
            Reach::Object => {
                out.clear();
                out.extend_from_slice(base);
                Ok(())
            }
            Reach::All | Reach::Arm => self.0.changed(clip, numbers, (Reach::Arm, base, at), out),
        }
    }

    fn following(&self, clip: usize) -> Vec<Moment> {
        self.0.following(clip)
    }

    fn channels(&self) -> &[Channel] {
        self.0.channels()
    }

    fn rows(&self, clip: usize) -> &[Row] {
        self.0.rows(clip)
    }

    fn scatter(&self) -> RandomEffects {
        RandomEffects::default()
    }

    fn has_object(&self) -> bool {
        self.0.has_object()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::fit::effort::Effort;
    use crate::diagnose::fit::sweep::Precision;
    use crate::diagnose::judge::gap::Typical;
    use crate::diagnose::judge::score::Predicted;
    use crate::diagnose::judge::trial::Trial;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{nothing_said_of, on_strokes, shipped, with_effect};
    use inference::admit::Split;
    use inference::likelihood::Group;
    use shared_mem::progress::Progress;
    use worlds::world::{Fault, Kind, World};

    /// The baseline as it is hidden in a world.
    fn hidden_baseline(library: &Library, world: &World) -> Vec<f64> {
        let (hidden, mut full) = (library.settings.numbers(&world.hidden), library.start());
        for k in library.baseline.clone() {
            full[k] = hidden[k].unwrap_or(full[k]);
        }
        full
    }

    /// A step from these numbers on two strokes, in which trials of these candidates are to be fitted.
    fn step(bench: &Bench<'_>, full: Vec<f64>, even: &[f64], asked: &[usize]) -> (Step, Split) {
        let trial = |candidate: &usize| Trial::untried(nothing_said_of(bench.library, *candidate), true);
        let step = Step {
            from: bench.fit(&[], full, &[0, 1], even, None, PROBE).expect("a fit"),
            predicted: Predicted { clips: Vec::new() },
            trials: asked.iter().map(trial).collect(),
            weights: even.to_vec(),
            arm_rows: 0,
            left: Vec::new(),
            whole: Vec::new(),
        };
        (step, Split { train: vec![0, 1], ..Split::default() })
    }

    #[test]
    fn an_object_that_was_found_under_an_arm_that_is_wrong_is_found_anew() {
        let cell = shipped();
        let world = with_effect("command_delay", 40, Kind::Strokes, &cell);
        on_strokes((&cell, &world), |bench, even| {
            let library = bench.library;
            let hidden = hidden_baseline(library, &world);
            let mut wrong = hidden.clone();
            for k in library.baseline.clone().filter(|k| !library.arm_feels(*k, &hidden)) {
                wrong[k] = library.start()[k];
            }
            let candidate = library.find("command_delay").expect("a candidate");
            let (mut step, split) = step(bench, wrong.clone(), even, &[candidate]);
            let object = |fits: Vec<(usize, Hypothesis)>| {
                let [(0, fit)] = &fits[..] else { panic!("{} fits", fits.len()) };
                library.with_object_of(hidden.clone(), &fit.full)
            };
            let anew = |given: &[f64]| Some(library.with_object_of(given.to_vec(), &hidden));
            let mut fitted = |arm: f64| {
                let group = |of_object, mean_square| Typical { mean_square, floor: 1.5, of_object };
                step.left = vec![group(false, arm), group(true, 100.0)];
                step.whole = step.left.clone();
                let search = Search {
                    bench,
                    split: &split,
                    refined: &anew,
                    witnessed: &|_| Vec::new(),
                    bar: &Progress::new("nothing", 1),
                };
                object(super::fitted(&search, &step, &[0], false, 0))
            };
            assert_eq!(fitted(1.5), library.with_object_of(hidden.clone(), &wrong), "the arm is where it was");
            assert_eq!(fitted(50.0), hidden);
        });
    }

    #[test]
    fn the_arm_tells_its_effects_apart_and_the_object_what_the_arm_leaves_open() {
        let cell = shipped();
        let world = with_effect("joint_encoder_offset", 48, Kind::Strokes, &cell);
        on_strokes((&cell, &world), |bench, even| {
            let library = bench.library;
            let hidden = library.settings.numbers(&world.hidden);
            let asked = ["base_tilt", "joint_encoder_offset"].map(|name| library.find(name).expect("a candidate"));
            let (step, split) = step(bench, hidden_baseline(library, &world), even, &asked);
            let bar = &Progress::new("nothing", 1);
            let search = Search { bench, split: &split, refined: &|_| None, witnessed: &|_| Vec::new(), bar };
            let found = fitted(&search, &step, &[0, 1], false, 0);
            let [(1, fit)] = &found[..] else { panic!("{} fits", found.len()) };
            let sizes = &library.candidates[asked[1]].sizes;
            let [turned, lifted] = [0, 1].map(|joint| (fit.full[sizes[joint]], hidden[sizes[joint]].expect("hidden")));
            assert!((lifted.0 - lifted.1).abs() < 1e-4, "gravity tells it: {lifted:?}");
            assert!((turned.0 - turned.1).abs() < 5e-3, "only the hit tells it: {turned:?}");
        });
    }

    #[test]
    fn play_is_tried_joint_by_joint_on_strokes_whose_clips_have_numbers_of_their_own() {
        let cell = shipped();
        let world = with_effect("joint_backlash", 40, Kind::Strokes, &cell);
        on_strokes((&cell, &world), |bench, even| {
            assert!(bench.scatter.count() > 0, "strokes have nuisance parameters");
            let library = bench.library;
            let candidate = library.find("joint_backlash").expect("a candidate");
            let (step, split) = step(bench, hidden_baseline(library, &world), even, &[candidate]);
            let bar = &Progress::new("nothing", 1);
            let search = Search { bench, split: &split, refined: &|_| None, witnessed: &|_| Vec::new(), bar };
            let found = fitted(&search, &step, &[0], true, 0);
            let [(0, fit)] = &found[..] else { panic!("{} fits", found.len()) };
            assert_eq!(fit.effects, [candidate]);
            assert!(fit.deviance() < step.from.deviance(), "{} {}", fit.deviance(), step.from.deviance());
            assert!(fit.fitted.iter().all(|clip| clip.own.len() == bench.scatter.count()));
        });
    }

    #[test]
    fn the_object_is_silent_and_fits_turn_what_they_may() {
        let cell = shipped();
        let world = World::draw(3, Kind::Strokes, Fault::Nothing, &cell);
        on_strokes((&cell, &world), |whole, even| {
            let (evidence, library, alone) = (whole.evidence, whole.library, ArmAlone(whole.evidence));
            let (mut all, mut some) = (Vec::new(), Vec::new());
            evidence.residuals(0, &library.start(), &[], &mut all).expect("a stroke");
            alone.residuals(0, &library.start(), &[], &mut some).expect("a stroke");
            let of_joint = |row: &Row| evidence.channels()[row.channel].group == Group::Arm;
            for ((row, all), some) in evidence.rows(0).iter().zip(&all).zip(&some) {
                assert_eq!(*some, if of_joint(row) { *all } else { 0.0 });
            }

            let step = Effort::of(2, Precision::Joints);
            let moved = |numbers: Vec<f64>| -> Vec<usize> {
                let of_baseline = library.baseline.clone();
                of_baseline.filter(|k| numbers[*k] != library.unknowns[*k].start).collect()
            };
            let (gains, of_object): (Vec<usize>, Vec<usize>) =
                library.baseline.clone().partition(|k| library.joints[*k].is_some());
            let fit = alone.bench(whole).fit(&[], library.start(), &[0, 1], even, None, step).expect("a fit");
            assert_eq!(moved(fit.full), gains, "joints' channels tell the gains, and nothing of the object");
            let effort = Effort { holds_joints: true, ..step };
            let fit = whole.fit(&[], library.start(), &[0, 1], even, None, effort).expect("a fit");
            let moved = moved(fit.full);
            assert!(!moved.is_empty() && moved.iter().all(|k| of_object.contains(k)), "{moved:?} of {of_object:?}");
        });
    }
}
