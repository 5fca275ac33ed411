//! One world on trial: what the diagnosis says of its session, what knowing the truth would gain, and what the simple rules
//! say of the very same clips.

use super::rules;
use super::score::{Case, Said};
use crate::diagnose::fit::bench::{Bench, FittedClip, Hypothesis};
use crate::diagnose::fit::effort::Effort;
use crate::diagnose::fit::floor;
use crate::diagnose::fit::sweep::Precision;
use crate::diagnose::ground::Ground;
use crate::diagnose::judge::gap::Residuals;
use crate::diagnose::library::Library;
use crate::diagnose::search::baseline::{self, Baseline};
use crate::diagnose::{DiagnoseError, Diagnosis, Kind, Options, diagnose_clips, peaks};
use inference::admit::{Admitted, Refused, Split};
use inference::interrupt::Interrupt;
use inference::kept::Kept;
use inference::likelihood::arm::ArmClips;
use inference::likelihood::cell::CellClips;
use inference::likelihood::object::ObjectClips;
use inference::likelihood::{Evidence, setting};
use shared_mem::cell::{ClipEntry, ClipKind};
use shared_mem::progress::Progress;
use shared_mem::recording::{Clip, Session, SessionFiles};
use worlds::world::{Truth, World};

/// Linearisations of the fits that the oracle and the rules rest on.
const EFFORT: Effort = Effort::of(8, Precision::Joints);

/// What the diagnosis and then each of the rules said of a world, the diagnosis first.
///
/// # Errors
/// [`DiagnoseError`] when the session cannot be diagnosed at all.
pub fn examine(world: &World, clips: Vec<Clip>, interrupt: &Interrupt) -> Result<Vec<Case>, DiagnoseError> {
    let (session, admitted) = sealed(world, clips);
    let options = Options { seed: world.number, ..Options::default() };
    let found = diagnose_clips(&session, &admitted, &options, interrupt)?;
    let base = setting::complete(&world.cell, None)?;
    let peaks = peaks(&world.cell, &admitted, &base)?;
    let library = Library::new(&world.cell, &base, Ground::crossed(&admitted).as_ref(), &peaks);
    let theta = |numbers: &[f64]| library.theta(numbers);
    let arm = ArmClips::moments(&world.cell, &admitted.clips, theta).map_err(Refused::from)?;
    let split = admitted.split(options.seed);
    let context = TrialContext { world, library: &library, split, admitted: &admitted, interrupt };
    if admitted.with_object {
        let object = ObjectClips::new(&world.cell, admitted.clips.clone(), library.settings.clone())?;
        context.cases(&CellClips::new(Some(arm), object, |numbers: &[f64]| library.felt_by_arm(numbers)), &found)
    } else {
        context.cases(&arm, &found)
    }
}

/// A world's clips as a session that was read and admitted.
#[must_use]
pub fn sealed(world: &World, clips: Vec<Clip>) -> (Session, Admitted) {
    let files: Vec<String> = clips.iter().map(|clip| clip.file.display().to_string()).collect();
    let entry = |clip: &Clip| ClipEntry { file: clip.file.clone(), kind: clip.kind };
    let session = Session {
        folder: format!("world {}", world.number).into(),
        cell: world.cell.clone(),
        clips: clips.iter().map(entry).collect(),
        files: SessionFiles::default(),
    };
    let with_object = clips.iter().all(|clip| clip.kind == ClipKind::ControlHitSlide);
    (session, Admitted::of(clips, files, with_object).in_parts())
}

struct TrialContext<'a> {
    world: &'a World,
    library: &'a Library,
    split: Split,
    admitted: &'a Admitted,
    interrupt: &'a Interrupt,
}

impl TrialContext<'_> {
    fn cases(&self, evidence: &Evidence<'_>, found: &Diagnosis) -> Result<Vec<Case>, DiagnoseError> {
        let bench = Bench::new(evidence, self.library, self.interrupt, (Kept::nothing(), ""));
        let even = floor::sensors_alone(evidence);
        let bar = Progress::new("baseline", baseline::steps(self.admitted.with_object));
        // The diagnosis' own: what its parameters make up for is no gap that anyone could explain.
        let (split, cell, admitted) = (&self.split, &self.world.cell, self.admitted);
        let baseline = Baseline { bench: &bench, split, cell, admitted };
        let baseline = baseline.identified(&bar).ok_or(DiagnoseError::NoBaseline)?;
        let (detectability, oracle_shrink) = self.oracle(&bench, &baseline, &even);
        let case = |said| Case {
            world: self.world.number,
            truth: self.world.truth.clone(),
            detectability,
            oracle_shrink,
            said,
        };
        let mut cases = vec![case(said(found))];
        cases.extend(rules::all(&bench, &self.split, &baseline).into_iter().map(case));
        Ok(cases)
    }

    /// What the true structure, fitted from its true numbers on, gains on clips never used: detectability and shrink.
    fn oracle(&self, bench: &Bench<'_>, baseline: &Hypothesis, even: &[f64]) -> (f64, f64) {
        let Truth::Effects(names) = &self.world.truth else { return (0.0, 0.0) };
        let candidate = |name: &String| self.library.candidates.iter().position(|c| c.effect.name == name);
        let effects: Vec<usize> = names.iter().filter_map(candidate).collect();
        let full = self.true_numbers(baseline);
        let judged = || {
            let truth = bench.fit(&effects, full, &self.split.train, even, Some(baseline), EFFORT)?;
            let deviance = |hypothesis: &Hypothesis| -> Option<f64> {
                Some(bench.judge(hypothesis, self.split.elsewhere(), even)?.iter().map(FittedClip::deviance).sum())
            };
            let gain = deviance(baseline)? - deviance(&truth)?;
            let [before, after] =
                [baseline, &truth].map(|hypothesis| Residuals::at(bench, hypothesis, self.split.elsewhere()));
            Some((gain.max(0.0).sqrt(), 1.0 - after?.mean_square() / before?.mean_square()))
        };
        judged().unwrap_or((0.0, 0.0))
    }

    /// The baseline's numbers, those of the effects that act set to the truth.
    fn true_numbers(&self, baseline: &Hypothesis) -> Vec<f64> {
        let mut full = baseline.full.clone();
        for (number, value) in full.iter_mut().zip(self.library.settings.numbers(&self.world.hidden)) {
            if let Some(value) = value {
                *number = value;
            }
        }
        full
    }
}

fn said(found: &Diagnosis) -> Said {
    let kind = match found.verdict.kind {
        Kind::None => "none",
        Kind::Named => "named",
        Kind::Class => "class",
        Kind::Unexplained => "unexplained",
        Kind::NotTestable => "not_testable",
    };
    Said {
        verdict: kind.to_owned(),
        effects: found.verdict.effects.clone(),
        ranking: found.candidates.iter().map(|candidate| candidate.effect.clone()).collect(),
        confidence: found.verdict.confidence,
        shrink: found.gap.shrink.value,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use inference::estimate::ClipModel;
    use inference::likelihood::Likelihood as _;
    use shared_mem::cell::Cell;
    use std::path::Path;
    use worlds::draw;
    use worlds::session::record;
    use worlds::world::{Fault, Kind};

    fn shipped() -> Cell {
        let text = include_str!("../../../config/fr3_cell.toml");
        shared_mem::toml_file::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file")
    }

    /// Sums of squared residuals of measured channels and of torques asked for, each with its number of rows, at the truth.
    fn left_of(world: &World, clips: &[Clip]) -> [(f64, f64); 2] {
        let arm = ArmClips::moments(&world.cell, clips, |_: &[f64]| world.hidden.clone()).expect("an arm");
        let mut sums = [(0.0, 0.0); 2];
        for clip in 0..clips.len() {
            let mut out = Vec::new();
            arm.residuals(clip, &[], &[], &mut out).expect("it can be simulated");
            for (row, residual) in arm.rows(clip).iter().zip(&out) {
                let (sum, count) = &mut sums[usize::from(arm.channels()[row.channel].quantity == "tau_J_d")];
                (*sum, *count) = (*sum + residual * residual, *count + 1.0);
            }
        }
        sums
    }

    #[test]
    fn the_twin_that_knows_the_truth_leaves_of_a_world_what_is_noise_if_torques_are_of_their_period() {
        let candidates = draw::candidates(false);
        let elastic = candidates.iter().position(|effect| effect.name == "joint_elasticity").expect("an effect");
        for (number, effect) in [(3, 1), (4, 1), (13, elastic)] {
            let world = World::draw(number, Kind::Excitation, Fault::Single(effect), &shipped());
            let clips = record(&world, 2).expect("a session");
            let [(measured, count), (asked, of)] = left_of(&world, &clips);
            assert!((0.8..1.5).contains(&(measured / count)), "{} sigma²", measured / count);
            assert!(asked < of, "{} sigma² of the torque asked for, which has no noise", asked / of);
            let later: Vec<Clip> = clips.into_iter().map(|clip| Clip { torques_end_at_rows: false, ..clip }).collect();
            let [_, (of_next, _)] = left_of(&world, &later);
            assert!(asked < 0.1 * of_next, "{asked} of the period that ends there, {of_next} of the next");
        }
    }
}
