//! From what the search found to the answer: the confirm clips are opened here, and only here.

use super::headline::{self, Facts};
use super::site::Advice;
use super::site::Site;
use super::verdict::{self, Finding};
use super::{advice, ranked, remedies};
use crate::answer::diagnosis::{Change, Clips, Diagnosis, Gap, Nearest, NextMotion, Place, Rest, Share, Verdict};
use crate::answer::{Trace, effect_in_words};
use crate::diagnose::criteria::CLASS_IS_RIGHT;
use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::parameters;
use crate::diagnose::judge::confirm::confirm;
use crate::diagnose::judge::gap::{Residuals, Shrunk, Typical};
use crate::diagnose::judge::held_out::{self, Fits};
use crate::diagnose::judge::partly::{self, Partly};
use crate::diagnose::judge::remainder::{self, Left};
use crate::diagnose::judge::score::predict;
use crate::diagnose::judge::sizes::{self, Sizes};
use crate::diagnose::judge::trial::{Found, Step};
use crate::diagnose::judge::unproven::{self, Unproven};
use crate::diagnose::judge::{confidence, drift, ends, localise};
use crate::diagnose::library::Library;
use crate::diagnose::search::refit;
use crate::diagnose::{DiagnoseError, Kind, Options};
use inference::likelihood::{Evidence, Group};
use crate::words::{channel_in_words, words};
use inference::admit::Admitted;
use inference::admit::{COMMANDS_TO_CHOOSE_BY, Split};
use shared_mem::recording::Session;
use shared_mem::theta::Theta;

/// What noise alone leaves: residuals are in sigmas of the sensors.
const FLOOR: f64 = 1.0;
/// So many traces are shown.
const TRACES: usize = 12;

/// The answer where the clips do not say enough.
pub fn not_testable(session: &Session, options: &Options, why: &str) -> Diagnosis {
    let nothing = Share { value: 0.0, ci90: [0.0; 2] };
    let site = Site::of(session, options.report.as_deref());
    let lacking = advice::lacking(why, &site);
    Diagnosis {
        verdict: verdict::not_testable(why),
        gap: Gap {
            unit: "sigma",
            before: 0.0,
            after: 0.0,
            floor: FLOOR,
            shrink: nothing,
            explainable_fraction: 0.0,
            joint_rms_rad: Change::default(),
            torque_rms: None,
            object_add_m: Change::default(),
            object_add_s_m: Change::default(),
            sensors: Vec::new(),
        },
        nearest: None,
        stage_test: None,
        places: Vec::new(),
        candidates: Vec::new(),
        next_experiment: lacking.sentence,
        next_commands: lacking.commands,
        next_motions: lacking.motions.into_iter().map(NextMotion::new).collect(),
        remedies: Vec::new(),
        clips: Clips::default(),
        warnings: Vec::new(),
        budget_spent: false,
        engine: None,
        seconds: 0.0,
        object: session.cell.one_of_several().map(str::to_owned),
        session: session.folder.display().to_string(),
        origin: site.origin().to_owned(),
        files: session.files.clone(),
        seed: options.seed,
        // What was known before; nothing was found.
        theta: options.theta.clone().unwrap_or_default(),
        theta_file: None,
        traces: Vec::new(),
    }
}

/// Opens the confirm clips and says what was found.
///
/// # Errors
/// [`DiagnoseError`] when the twin has no answer on them.
pub fn conclude<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    found: &Found,
    session: &Session,
    admitted: &Admitted,
    options: &Options,
) -> Result<Diagnosis, DiagnoseError> {
    let first = &found.steps[0];
    let (baseline, before) = unseen(bench, split, (&first.from, &first.weights))?;
    let (with, after) = unseen(bench, split, (&found.last, &found.steps.last().unwrap_or(first).weights))?;
    let (places, rest) = (localise::localise(bench.evidence, &before), localise::localise(bench.evidence, &after));
    let typical = typical(bench, found, admitted).ok_or(DiagnoseError::NoBaseline)?;
    let left = Left::of_groups(&typical.0, &typical.1);
    let sensors = Left::of_all_sensors(&typical.0, &typical.1);
    let judged = confirm(bench, &first.weights, [(&baseline, &before), (&with, &after)], options.seed)?;
    let overdispersion = found.overdispersion(bench);
    let within_tolerance = sizes::within_tolerance(bench, ([&baseline, &with], [&before, &after]), session, admitted)?;
    let finding = finding(bench, (split, found), &overdispersion, (left, judged.holds, within_tolerance));
    let decision = finding.decide();
    let tried = decision.kind == Kind::Unexplained;
    let partly = tried.then(|| partly::proven(bench, (split, found), &before, &overdispersion, options.seed)).flatten();
    let (found, after) = partly.as_ref().map_or((found, &after), |partly| (&partly.found, &partly.after));
    let rest = if partly.is_some() { localise::localise(bench.evidence, after) } else { rest };
    let believed = partly.is_some() || matches!(decision.kind, Kind::Named | Kind::Class);
    let kept = if believed { &found.last } else { &first.from };
    let shown = if believed { after } else { &before };
    let some = tried && partly.is_none() && judged.holds && !finding.effects.is_empty();
    let nearest = some.then(|| Nearest {
        effects: finding.effects.iter().map(|name| (*name).to_owned()).collect(),
        shrink: after.shrink(&before, options.seed),
    });
    let shown_fits = partly.as_ref().map_or(if believed { &with } else { &baseline }, |partly| &partly.fits);
    let of_object = places.first().is_some_and(|place| !place.channel.starts_with("joint"));
    let sizes = Sizes::of(bench, ([&baseline, shown_fits], [&before, shown]), session, admitted)?;
    let [size, stays] = sizes.in_words(of_object);
    let closed = |open: &Unproven<'_>| share_of(bench, split, (open, &first.weights), (&before, options.seed));
    let unproven =
        unproven::unproven(bench, found, admitted.cut()).and_then(|open| closed(&open).map(|share| (open, share)));
    let open = unproven.as_ref().map(|(open, share)| (open, *share));
    let facts = facts(bench, found, (size, open), [&places, &rest], judged.shrink);
    let verdict = match &partly {
        Some(partly) => in_part(bench, partly, &facts, (&stays, &sizes)),
        None => {
            let text = headline::sentence(&decision, &finding, &facts);
            decision.said(text)
        }
    };
    let largest = rest.first().map(|place| (place.channel.as_str(), place.regime.as_str()));
    let site = Site::of(session, options.report.as_deref());
    let next = match &unproven {
        Some((open, _)) if verdict.kind == Kind::Unexplained => advice::proving(open.effect(bench), open.more, &site),
        _ => next(&verdict, partly.is_some() || finding.open().is_some(), largest, &site),
    };
    let theta = bench.library.theta(&kept.full);
    // Of an object that no clip shows nothing was found but what was given.
    let known = if admitted.with_object { Some(&theta) } else { options.theta.as_ref() };
    Ok(Diagnosis {
        gap: sizes.gap(([&before, shown], sensors), options.seed),
        candidates: ranked::candidates(
            bench,
            (found, overdispersion[0]),
            split,
            (&before, after, &finding),
            verdict.kind,
            options.seed,
        ),
        next_experiment: next.sentence,
        next_commands: next.commands,
        next_motions: next.motions.into_iter().map(NextMotion::new).collect(),
        remedies: remedies::of(&verdict, &theta, &session.cell),
        verdict,
        stage_test: None,
        places,
        clips: clips(admitted, split),
        warnings: warnings(bench.library, kept, (admitted, split)),
        budget_spent: false,
        engine: None,
        seconds: 0.0,
        object: session.cell.one_of_several().map(str::to_owned),
        session: session.folder.display().to_string(),
        origin: site.origin().to_owned(),
        files: session.files.clone(),
        seed: options.seed,
        theta: Theta { object: known.and_then(|known| known.object.clone()), ..theta },
        theta_file: None,
        traces: traces(bench.evidence, (&before, if nearest.is_some() { after } else { shown }), admitted),
        nearest,
    })
}

/// What the baseline and all that was found leave in a clip like most, of every group of sensors.
fn typical<E: Evidence>(
    bench: &Bench<'_, E>,
    found: &Found,
    admitted: &Admitted,
) -> Option<(Vec<Typical>, Vec<Typical>)> {
    let all: Vec<usize> = (0..admitted.clips.len()).collect();
    let of = |hypothesis| Residuals::at(bench, hypothesis, &all).map(|left| left.typical());
    of(&found.steps[0].from).zip(of(&found.last))
}

/// Numbers for the clips that they were not fitted to, and what they leave there.
fn unseen<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    hypothesis: (&Hypothesis, &[f64]),
) -> Result<(Fits, Residuals), DiagnoseError> {
    let fits = held_out::fits(bench, split, hypothesis).ok_or(DiagnoseError::NoBaseline)?;
    let left = Residuals::of(bench, &fits).ok_or(DiagnoseError::NoBaseline)?;
    Ok((fits, left))
}

/// The files that are for what, each once.
fn clips(admitted: &Admitted, split: &Split) -> Clips {
    let files = |set: &[usize]| {
        let mut files: Vec<String> = set.iter().map(|clip| admitted.files[*clip].clone()).collect();
        files.dedup();
        files
    };
    Clips { train: files(&split.train), choose: files(&split.choose), confirm: files(&split.confirm) }
}

/// How far the gap shrinks with an effect that is not proven; `None` where it widens: that is no lead.
fn share_of<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    (open, weights): (&Unproven<'_>, &[f64]),
    (before, seed): (&Residuals, u64),
) -> Option<f64> {
    let share = held_out::residuals(bench, split, (open.fit, weights))?.shrink(before, seed).value;
    (share > 0.0).then_some(share)
}

/// What has to be known beside the answer: of the recording, of few commands, of effects as strong as they are looked for.
fn warnings(library: &Library, kept: &Hypothesis, (admitted, split): (&Admitted, &Split)) -> Vec<String> {
    let ended = kept.effects.iter().filter(|effect| !ends::stopped(library, **effect, &kept.full).is_empty());
    let sentence = |effect: &usize| {
        let name = words(library.candidates[*effect].effect.name);
        format!(
            "{name} was found as strong as it is looked for: it may be stronger, or something else that looks like it"
        )
    };
    admitted.warnings.iter().cloned().chain(few(admitted, split)).chain(ended.map(sentence)).collect()
}

/// What has to be known about clips of few commands.
fn few(admitted: &Admitted, split: &Split) -> Option<String> {
    let (commands, parts) = (admitted.commands, admitted.groups.len());
    let [in_parts, in_turn] = match parts > commands {
        true => [
            format!("their clips count in {parts} parts, each of which is called a clip here, "),
            format!("one in {} of them", split.in_turn.len()),
        ],
        false => [String::new(), "each".to_owned()],
    };
    (!split.in_turn.is_empty()).then(|| {
        format!(
            "only {commands} different commands: {in_parts}effects are chosen by all of them, and {in_turn} in turn is left out of the fit \
             that its gap is measured with; record {} more to have clips that nothing was chosen by",
            COMMANDS_TO_CHOOSE_BY - commands
        )
    })
}

/// What the sentence is made of; where the gap lies without and with what was found.
fn facts<E: Evidence>(
    bench: &Bench<'_, E>,
    found: &Found,
    (size, unproven): (String, Option<(&Unproven<'_>, f64)>),
    places: [&[Place]; 2],
    shrink: Shrunk,
) -> Facts {
    let [place, rest] = places.map(|places| places.first().map_or_else(String::new, place_in_words));
    let effects = found.last.effects.iter().map(|effect| with_size(bench, &found.last, *effect)).collect();
    let unproven = unproven
        .map(|(open, share)| (with_size(bench, open.fit, open.trial.scored.candidate), share, [open.clips, open.more]));
    Facts { size, place, rest, effects, unproven, shrink }
}

/// The verdict where what was found is proven, but a part of the gap stays: so much of the joints [rad] and the object [m].
fn in_part<E: Evidence>(
    bench: &Bench<'_, E>,
    partly: &Partly,
    facts: &Facts,
    (stays, sizes): (&str, &Sizes),
) -> Verdict {
    let looks_like = partly.looks_like(bench);
    let [own, rivals] = partly.effects(bench);
    let text = headline::in_part(facts, (&partly.share, partly.unusual), (stays, looks_like), &rivals);
    let (place, looks_like) = (facts.rest.clone(), looks_like.map(str::to_owned));
    let (kind, confidence) =
        if rivals.is_empty() { (Kind::Named, sureness(&partly.found)) } else { (Kind::Class, CLASS_IS_RIGHT.value) };
    Verdict {
        kind,
        confidence,
        effects: [own, rivals].concat(),
        text,
        explained_share: Some(partly.share),
        rest: Some(Rest { joint_rms_rad: sizes.joints.after, object_add_m: sizes.add.after, place, looks_like }),
    }
}

/// `joint 2 (reversal)`.
fn place_in_words(place: &Place) -> String {
    format!("{} ({})", channel_in_words(&place.channel), place.regime)
}

/// `command delay (delay 11.9 ms)`.
fn with_size<E: Evidence>(bench: &Bench<'_, E>, hypothesis: &Hypothesis, effect: usize) -> String {
    let name = bench.library.candidates[effect].effect.name;
    effect_in_words(name, &parameters::of_effect(bench, hypothesis, effect))
}

/// What to record next; `open`: only the arm's gap is explained, `largest`: where what is left is largest.
fn next(verdict: &Verdict, open: bool, largest: Option<(&str, &str)>, site: &Site) -> Advice {
    match verdict.kind {
        Kind::Unexplained => advice::unexplained(largest, site),
        Kind::Named if open => advice::unexplained(largest, site),
        Kind::None => advice::nothing_open(site),
        Kind::Named => advice::confirming(&verdict.effects, site),
        Kind::Class | Kind::NotTestable => {
            advice::separating(&verdict.effects.iter().map(String::as_str).collect::<Vec<_>>(), site)
        }
    }
}

fn finding<'a, E: Evidence>(
    bench: &Bench<'a, E>,
    (split, found): (&Split, &Found),
    overdispersion: &[f64],
    (left, confirmed, within_tolerance): (Vec<Left>, bool, [bool; 2]),
) -> Finding<'a> {
    let name = |effect: &usize| bench.library.candidates[*effect].effect.name;
    let mut rivals = Vec::new();
    let mut clear = true;
    for (place, effect) in found.kept() {
        let step = &found.steps[place];
        clear &= step.is_clear(bench.library, effect);
        let others = confidence::rivals(step, bench.library, effect, overdispersion[place]);
        let others = others.into_iter().filter(|other| !found.last.effects.contains(other));
        rivals.extend(others.filter(|other| stands_in(bench, split, found, (step, effect), *other)).map(|k| name(&k)));
    }
    Finding {
        effects: found.last.effects.iter().map(name).collect(),
        rivals,
        confidence: sureness(found),
        clear,
        of_arm: found.last.effects.iter().all(|effect| bench.library.candidates[*effect].is_of_arm()),
        left,
        confirmed,
        implausible: !remainder::implausible(bench, &found.last).is_empty(),
        within_tolerance,
        drift: drift::of_friction(&bench.scatter, &found.last),
    }
}

/// How sure the weakest of the effects that were found is.
fn sureness(found: &Found) -> f64 {
    let of = |(place, effect): (usize, usize)| {
        let all = confidence::probabilities(&found.steps[place].trials, false);
        all.iter().find(|(candidate, _)| *candidate == effect).map_or(0.5, |(_, p)| *p)
    };
    found.kept().map(of).fold(1.0, f64::min)
}

/// Whether a rival of an effect does as well in its place beside all the others that were found: where several act, what one
/// of them left unexplained makes rivals of it look alike that are told apart once the others are there.
fn stands_in<E: Evidence>(
    bench: &Bench<'_, E>,
    split: &Split,
    found: &Found,
    (step, effect): (&Step, usize),
    rival: usize,
) -> bool {
    let (last, weights) = (&found.last, &found.steps[found.steps.len() - 1].weights);
    let fitted = step.trials.iter().find(|trial| trial.scored.candidate == rival);
    let Some((fit, _)) = fitted.and_then(|trial| trial.fitted.as_ref()).filter(|_| last.effects.len() > 1) else {
        return true;
    };
    let effects: Vec<usize> = last.effects.iter().map(|other| if *other == effect { rival } else { *other }).collect();
    let mut full = last.full.clone();
    bench.library.candidates[effect].numbers.clone().for_each(|k| full[k] = bench.library.unknowns[k].start);
    bench.library.candidates[rival].numbers.clone().for_each(|k| full[k] = fit.full[k]);
    let swapped = bench.fit((&effects, full), &split.train, weights, Some(last), refit::last_pass(bench));
    let predicted = |hypothesis| predict(bench, hypothesis, &split.choose, weights);
    let Some((with, instead)) = predicted(last).zip(swapped.as_ref().and_then(predicted)) else { return true };
    let advantage = with.over(&instead);
    confidence::alike(advantage.nats, advantage.error, advantage.clips())
}

/// Residuals of the channels with the largest gap, before and after, on the confirm clips.
fn traces(evidence: &impl Evidence, (before, after): (&Residuals, &Residuals), admitted: &Admitted) -> Vec<Trace> {
    let mut sized: Vec<(f64, usize, usize)> = Vec::new();
    for (place, (clip, residuals)) in before.clips.iter().enumerate() {
        for channel in 0..evidence.channels().len() {
            let rows = evidence.rows(*clip).iter().zip(residuals).filter(|(row, _)| row.channel == channel);
            sized.push((rows.map(|(_, r)| r * r).sum(), place, channel));
        }
    }
    sized.sort_by(|a, b| b.0.total_cmp(&a.0));
    let trace = |(_, place, channel): (f64, usize, usize)| {
        let (clip, info) = (before.clips[place].0, &evidence.channels()[channel]);
        let points = |residuals: &[f64]| {
            let rows = evidence.rows(clip).iter().zip(residuals).filter(|(row, _)| row.channel == channel);
            rows.map(|(row, residual)| [row.time, *residual]).collect::<Vec<_>>()
        };
        let when = if info.group == Group::Contact { " in contact" } else { "" };
        Trace {
            clip: admitted.label(clip),
            channel: format!("{} of {}{when}", info.quantity, channel_in_words(&info.place)),
            unit: "σ".into(),
            sigma: 1.0,
            before: points(&before.clips[place].1),
            after: points(&after.clips[place].1),
        }
    };
    sized.into_iter().take(TRACES).map(trace).collect()
}
