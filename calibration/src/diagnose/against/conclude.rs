//! From what the search found to the answer, measured on held-out clips.

use super::answer::{Candidate, Comparison, Verdict};
use super::changes;
use super::fits::{PairBench, numbers};
use super::headline::{self, Facts};
use super::pair::Pair;
use super::power::Power;
use super::search::{Found, Step, Trial};
use super::subjects::Subject;
use super::turned::Side;
use crate::answer::diagnosis::{Clips, Kind, SensorGap, Share, Status};
use crate::diagnose::conclude::advice;
use crate::diagnose::conclude::site::{Advice, Site};
use crate::diagnose::criteria::{CLASS_IS_RIGHT, MOST_OF_IT, UNKNOWN_IS_RIGHT};
use crate::diagnose::fit::bench::Hypothesis;
use crate::diagnose::judge::confidence::MAX_PROBABILITY;
use crate::diagnose::judge::ends;
use crate::diagnose::judge::gap::Residuals;
use crate::diagnose::judge::held_out::HeldOut;
use crate::diagnose::judge::localise;
use crate::diagnose::judge::remainder::Left;
use crate::diagnose::judge::sizes::Sizes;
use crate::diagnose::select::gain::SAME_WORTH_NATS;
use crate::diagnose::work::{DiagnoseError, Options};
use shared_mem::recording::Session;
use std::collections::BTreeMap;

/// What a conclusion is drawn from.
pub(super) struct Case<'a> {
    /// The sessions, A first.
    pub(super) sessions: [&'a Session; 2],
    pub(super) pair: &'a Pair,
    /// What was found on A alone.
    pub(super) of_a: &'a Hypothesis,
    /// What may have changed.
    pub(super) subjects: &'a [Subject],
    /// What was found.
    pub(super) found: &'a Found,
}

/// Measures and says what was found.
///
/// # Errors
/// [`DiagnoseError`] when the twin has no answer on them.
pub(super) fn conclude(
    pair_bench: &PairBench<'_>,
    case: &Case<'_>,
    options: &Options,
) -> Result<Comparison, DiagnoseError> {
    let (found, session) = (case.found, case.sessions[1]);
    let with = pair_bench.held_out(&found.last.fitted, &found.weights).ok_or(DiagnoseError::NoBaseline)?;
    let under_a = with.fits.iter().map(|(_, clips)| (numbers(case.of_a.full.clone()), clips.clone())).collect();
    let under_a = HeldOut::of(pair_bench.bench, under_a).ok_or(DiagnoseError::NoBaseline)?;
    let before = &under_a.left;
    let shrink = with.left.shrink(before, options.seed);
    let rivals = rivals(pair_bench, case);
    let deviates = deviates(pair_bench, case);
    let library = pair_bench.bench.library;
    let power = Power { library, of_a: &case.of_a.full, subjects: case.subjects, scores: &found.steps[0].scores };
    let kind = match (found.last.changed.is_empty() || shrink.value <= 0.0, rivals.is_empty()) {
        (true, _) if deviates.is_some() => Kind::Unexplained,
        (true, _) if !power.is_enough() => Kind::NotTestable,
        (true, _) => Kind::None,
        (false, true) => Kind::Named,
        (false, false) => Kind::Class,
    };
    let believed = matches!(kind, Kind::Named | Kind::Class);
    let shown = if believed { &with } else { &under_a };
    let gap = Sizes::of(pair_bench.bench, [&under_a, shown], session, &case.pair.admitted)?.gap(
        [before, &shown.left],
        Left::of(pair_bench.bench, before, &shown.left),
        options.seed,
    );
    let (gap_of_a, places) = (of_a(pair_bench, case), localise::localise(pair_bench.bench.evidence, before));
    let candidates =
        candidates(pair_bench, case, &Judged { kind, rivals: &rivals, power: &power }, before, options.seed);
    let changes: Vec<String> = if believed { named(case, &rivals) } else { Vec::new() };
    let facts = Facts::of(&candidates, gap.shrink, deviates.unwrap_or(1.0), places.first());
    let text = headline::sentence(kind, &facts);
    let names: Vec<&str> = changes.iter().map(String::as_str).collect();
    let site = Site::of(session, options.report.as_deref());
    let next = if kind == Kind::Class { advice::separating(&names, &site) } else { Advice::default() };
    let files = |set: &[usize]| set.iter().map(|clip| case.pair.admitted.files[*clip].clone()).collect();
    let in_b = if believed { found.last.fitted.model.of(Side::B) } else { found.without.model.of(Side::B) };
    Ok(Comparison {
        verdict: Verdict { kind, changes, confidence: confidence(kind, &candidates, power.share()), text },
        gap,
        gap_of_a,
        places,
        shared: shared(pair_bench, case),
        candidates,
        next_experiment: next.sentence,
        next_commands: next.commands,
        clips: Clips {
            train: files(&pair_bench.split.train),
            choose: files(&pair_bench.split.choose),
            confirm: files(&pair_bench.split.confirm),
        },
        warnings: warnings(pair_bench, case),
        seconds: 0.0,
        session: case.sessions[0].folder.display().to_string(),
        against: session.folder.display().to_string(),
        files: case.sessions.map(|session| session.files.clone()),
        seed: options.seed,
        theta: pair_bench.bench.library.theta(in_b),
        theta_file: None,
    })
}

/// What has to be known beside the answer: of the recordings, and of gains that stopped at an end of their range.
fn warnings(pair_bench: &PairBench<'_>, case: &Case<'_>) -> Vec<String> {
    let fitted = &case.found.last.fitted;
    let ended = ends::of_gains(&fitted.model.library(pair_bench.bench.library), &fitted.hypothesis.full);
    case.pair.admitted.warnings.iter().cloned().chain(ended).collect()
}

/// What A's own clips leave under what was found on A.
fn of_a(pair_bench: &PairBench<'_>, case: &Case<'_>) -> f64 {
    let clips: Vec<usize> =
        pair_bench.split.confirm.iter().copied().filter(|clip| !pair_bench.is_of_b(*clip)).collect();
    pair_bench.left(&case.of_a.full, &clips).map_or(0.0, |left| left.mean_square())
}

/// How many times as much B leaves although both share everything as A does under its own model, in a clip like most; `None`
/// where A leaves most of it as well.
fn deviates(pair_bench: &PairBench<'_>, case: &Case<'_>) -> Option<f64> {
    let (of_b, of_a): (Vec<usize>, Vec<usize>) =
        pair_bench.split.searched().into_iter().partition(|clip| pair_bench.is_of_b(*clip));
    let b = pair_bench.left(case.found.without.model.of(Side::B), &of_b)?;
    let a = pair_bench.left(&case.of_a.full, &of_a)?;
    let groups = SensorGap::of_groups(&b.typical(), &a.typical());
    let more = groups.iter().filter(|left| left.gaps() > 1.0 && left.after < MOST_OF_IT * left.before);
    more.map(|left| left.before / left.after).max_by(f64::total_cmp)
}

/// Subjects that do as well as one that changed, beside all the others that did.
fn rivals(pair_bench: &PairBench<'_>, case: &Case<'_>) -> Vec<usize> {
    let found = case.found;
    let mut rivals = Vec::new();
    for step in found.steps.iter().filter(|step| step.added.is_some_and(|added| found.last.changed.contains(&added))) {
        let others = step.rivals(pair_bench).into_iter().filter(|trial| !found.last.changed.contains(&trial.subject));
        let alike = others
            .filter(|trial| found.last.changed.len() == 1 || found.stands_in(pair_bench, case.subjects, step, trial));
        rivals.extend(alike.map(|trial| trial.subject));
    }
    rivals.sort_unstable();
    rivals.dedup();
    rivals
}

fn named(case: &Case<'_>, rivals: &[usize]) -> Vec<String> {
    case.found.last.changed.iter().chain(rivals).map(|subject| case.subjects[*subject].name.clone()).collect()
}

/// Effects that act in both sessions alike.
fn shared(pair_bench: &PairBench<'_>, case: &Case<'_>) -> Vec<String> {
    let (library, model) = (pair_bench.bench.library, &case.found.last.fitted.model);
    let acts = |subject: &&Subject| {
        let rests = |k: &usize| model.of(Side::A)[*k] == library.unknowns[*k].start;
        let changed = case.found.last.changed.iter().any(|changed| case.subjects[*changed].name == subject.name);
        subject.effect.is_some() && !changed && !subject.sizes.iter().all(rests)
    };
    case.subjects.iter().filter(acts).map(|subject| subject.name.clone()).collect()
}

/// What is known of all that may have changed.
struct Judged<'a> {
    kind: Kind,
    /// Subjects that do as well as one that changed.
    rivals: &'a [usize],
    power: &'a Power<'a>,
}

/// What is said of everything that may have changed.
fn candidates(
    pair_bench: &PairBench<'_>,
    case: &Case<'_>,
    judged: &Judged<'_>,
    before: &Residuals,
    seed: u64,
) -> Vec<Candidate> {
    let Judged { kind, rivals, power } = *judged;
    let (found, first) = (case.found, &case.found.steps[0]);
    let likely = probabilities(&found.steps);
    let one = |(index, subject): (usize, &Subject)| {
        let changed = found.last.changed.contains(&index) && matches!(kind, Kind::Named | Kind::Class);
        let trial = found.steps.iter().rev().find_map(|step| step.trials.iter().find(|trial| trial.subject == index));
        let fitted = if changed { Some(&found.last.fitted) } else { trial.map(|trial| &trial.fitted) };
        let with = fitted
            .filter(|_| changed || rivals.contains(&index))
            .and_then(|fitted| Some(pair_bench.held_out(fitted, &found.weights)?.left));
        let shrink = with.map_or(Share { value: 0.0, ci90: [0.0; 2] }, |with| with.shrink(before, seed));
        let score = first.scores.iter().find(|score| score.subject == index);
        let status = match kind {
            Kind::Named if changed => Status::Named,
            Kind::Class if changed || rivals.contains(&index) => Status::Possible,
            _ if !power.shows(index) => Status::NotTestable,
            _ => Status::RuledOut,
        };
        let alike: Vec<String> =
            if changed { rivals } else { &[][..] }.iter().map(|rival| case.subjects[*rival].name.clone()).collect();
        Candidate {
            name: subject.name.clone(),
            is_effect: subject.effect.is_some(),
            probability: likely.get(&index).copied().unwrap_or(0.0),
            parameters: fitted.map(|fitted| changes::of_subject(pair_bench, fitted, subject)).unwrap_or_default(),
            shrink,
            confusable_with: alike,
            status,
            why: headline::reason(status, score.map(|score| (score.p, score.gain)), trial),
            smallest_seen: power.smallest(index),
        }
    };
    let place = |index: usize| first.scores.iter().position(|score| score.subject == index).unwrap_or(usize::MAX);
    let all = case.subjects.iter().enumerate().map(|(index, subject)| (place(index), one((index, subject))));
    let mut all: Vec<(usize, Candidate)> = all.collect();
    all.sort_by_key(|(place, Candidate { status, .. })| {
        (*status != Status::Named, *status != Status::Possible, *status == Status::NotTestable, *place)
    });
    all.into_iter().map(|(_, candidate)| candidate).collect()
}

/// How likely each change is that was proven: shares of the evidence in the step in which it was.
fn probabilities(steps: &[Step]) -> BTreeMap<usize, f64> {
    let mut all = BTreeMap::new();
    for step in steps {
        let proven: Vec<&Trial> = step.proven().collect();
        let best = proven.iter().map(|trial| trial.whole.nats).fold(0.0, f64::max);
        let weight = |nats: f64| ((nats - best) / SAME_WORTH_NATS).exp();
        let total: f64 = proven.iter().map(|trial| weight(trial.whole.nats)).sum::<f64>() + weight(0.0);
        for trial in proven {
            let probability = MAX_PROBABILITY * weight(trial.whole.nats) / total;
            all.entry(trial.subject)
                .and_modify(|known: &mut f64| *known = known.max(probability))
                .or_insert(probability);
        }
    }
    all
}

/// How sure a verdict is; `shown`: share of the subjects of which a change would have been seen. That nothing changed is no surer.
fn confidence(kind: Kind, candidates: &[Candidate], shown: f64) -> f64 {
    let named = candidates.iter().filter(|candidate| candidate.status == Status::Named);
    match kind {
        Kind::Named => named.map(|candidate| candidate.probability).fold(MAX_PROBABILITY, f64::min),
        Kind::None => MAX_PROBABILITY * shown,
        Kind::Class => CLASS_IS_RIGHT.value,
        Kind::Unexplained => UNKNOWN_IS_RIGHT.value,
        Kind::NotTestable => 1.0,
    }
}
