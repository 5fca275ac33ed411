//! The answer: the verdict in its sentence, what to do about it, what to record next, and all figures.

use super::Case;
use super::decide::{Decided, sureness};
use super::headline::{self, Facts, NotProven};
use super::measure::Measures;
use super::site::{Advice, Site};
use super::{advice, ranked, remedies, verdict};
use crate::answer::Trace;
use crate::answer::diagnosis::{Clips, Diagnosis, Gap, Kind, Nearest, NextMotion, Place, Rest, Verdict};
use crate::diagnose::criteria::{CLASS_IS_RIGHT, PART_IS_RIGHT};
use crate::diagnose::fit::bench::Hypothesis;
use crate::diagnose::judge::gap::Residuals;
use crate::diagnose::judge::held_out::estimated;
use crate::diagnose::judge::localise::localise;
use crate::diagnose::judge::partly::Partly;
use crate::diagnose::judge::sizes::Sizes;
use crate::diagnose::judge::unproven::{Unproven, unproven};
use crate::diagnose::judge::{apart, ends};
use crate::diagnose::work::{DiagnoseError, Options};
use crate::words::{channel_in_words, words};
use inference::admit::{Admitted, COMMANDS_TO_CHOOSE_BY, Split};
use inference::likelihood::{Evidence, Group};
use shared_mem::recording::Session;
use shared_mem::theta::Theta;

/// So many traces are shown (a choice).
const SHOWN_TRACES: usize = 12;

/// The answer where the clips do not say enough.
pub fn not_testable(session: &Session, options: &Options, why: &str) -> Diagnosis {
    let site = Site::of(session, options.report.as_deref());
    let next = advice::lacking(why, &site);
    // What was known before; nothing was found.
    let theta = options.theta.clone().unwrap_or_default();
    // Residuals are in sigmas of the sensors: noise leaves 1.
    let gap = Gap { unit: "sigma", floor: 1.0, ..Gap::default() };
    Diagnosis { gap, theta, ..about(session, options, &site, verdict::not_testable(why), next) }
}

/// A verdict on a session and what to record next, without what was measured.
fn about(session: &Session, options: &Options, site: &Site, verdict: Verdict, next: Advice) -> Diagnosis {
    Diagnosis {
        verdict,
        next_experiment: next.sentence,
        next_commands: next.commands,
        next_motions: next.motions.into_iter().map(NextMotion::new).collect(),
        object: session.cell.one_of_several().map(str::to_owned),
        session: session.folder.display().to_string(),
        origin: site.origin().to_owned(),
        cell: session.cell.clone(),
        files: session.files.clone(),
        seed: options.seed,
        ..Diagnosis::default()
    }
}

/// Says what was measured and decided.
pub(super) fn say(case: &Case<'_>, measures: Measures, decided: &Decided<'_>) -> Result<Diagnosis, DiagnoseError> {
    let Case { bench, session, admitted, options, .. } = *case;
    let (without, with, shown) = (&measures.without, decided.with(&measures), decided.shown(&measures));
    let (before, after) = (&without.held_out.left, &with.held_out.left);
    let sizes = Sizes::of(bench, [&without.held_out, &shown.held_out], session, admitted)?;
    let open = not_proven(case, decided, before);
    let (verdict, rest) = verdict_of(case, &measures, decided, &sizes, open.as_ref());
    let site = Site::of(session, options.report.as_deref());
    let next = match &open {
        Some((open, _)) if verdict.kind == Kind::Unexplained => advice::proving(open.effect(bench), open.more, &site),
        _ => next(&verdict, decided, rest.first(), &site),
    };
    let nearest = decided.comes_near().then(|| Nearest {
        effects: decided.finding.effects.iter().map(|name| (*name).to_owned()).collect(),
        shrink: after.shrink(before, options.seed),
    });
    let theta = bench.library.theta(&shown.of_all.full);
    // Of an object that no clip shows nothing was found but what was given.
    let known = if admitted.with_object { Some(&theta) } else { options.theta.as_ref() };
    let object = known.and_then(|known| known.object.clone());
    let traced = if nearest.is_some() { after } else { &shown.held_out.left };
    let remedies = remedies::of(&verdict, &theta, &session.cell);
    Ok(Diagnosis {
        gap: sizes.gap([before, &shown.held_out.left], measures.left.clone(), options.seed),
        candidates: ranked::candidates(case, &measures, decided, verdict.kind),
        remedies,
        clips: clips(admitted, case.split),
        warnings: warnings(case, &shown.of_all),
        theta: Theta { object, ..theta },
        traces: traces(bench.evidence, [before, traced], admitted),
        nearest,
        places: measures.places,
        ..about(session, options, &site, verdict, next)
    })
}

/// The verdict in its sentence, and where what was found leaves most.
fn verdict_of(
    case: &Case<'_>,
    measures: &Measures,
    decided: &Decided<'_>,
    sizes: &Sizes,
    open: Option<&(Unproven<'_>, f64)>,
) -> (Verdict, Vec<Place>) {
    let (places, with) = (&measures.places, decided.with(measures));
    let rest = localise(case.bench.evidence, &with.held_out.left);
    let of_object = places.first().is_some_and(|place| !place.channel.starts_with("joint"));
    let [size, stays] = sizes.in_words(of_object);
    let last = &with.of_all;
    let largest = |places: &[Place]| places.first().map_or_else(String::new, place_in_words);
    let facts = Facts {
        size,
        place: largest(places),
        rest: largest(&rest),
        effects: last.effects.iter().map(|effect| case.with_size(last, *effect)).collect(),
        unproven: open.map(|(open, share)| NotProven {
            effect: case.with_size(open.fit, open.trial.scored.candidate),
            share: *share,
            clips: open.clips,
            more: open.more,
        }),
        shrink: measures.confirmation.shrink,
    };
    let verdict = match &decided.partly {
        Some(partly) => in_part(case, partly, &facts, &stays, sizes),
        None => decided.decision.clone().said(headline::sentence(&decided.decision, &decided.finding, &facts)),
    };
    (verdict, rest)
}

/// An effect that is likely and not proven, and how far the gap shrinks with it; `None` where it widens: that is no lead.
fn not_proven<'a>(case: &'a Case<'_>, decided: &'a Decided<'_>, before: &Residuals) -> Option<(Unproven<'a>, f64)> {
    let open = unproven(case.bench, decided.found(case), case.admitted.cut())?;
    // As of every candidate that is not named.
    let share = estimated(case.bench, case.split, open.fit)?.shrink(before, case.options.seed).value;
    (share > 0.0).then_some((open, share))
}

/// The files that are for what, each once.
fn clips(admitted: &Admitted, split: &Split) -> Clips {
    let files = |set: &[usize]| {
        let mut files: Vec<String> = set.iter().map(|clip| admitted.files[*clip].clone()).collect();
        // Parts of one clip stand beside each other.
        files.dedup();
        files
    };
    Clips { train: files(&split.train), choose: files(&split.choose), confirm: files(&split.confirm) }
}

/// What has to be known beside the answer: of the recording, of few commands, of effects as strong as they are looked for.
fn warnings(case: &Case<'_>, shown: &Hypothesis) -> Vec<String> {
    let Hypothesis { full, effects, .. } = shown;
    let ended = effects.iter().filter(|effect| !ends::stopped(case.bench.library, **effect, full).is_empty());
    let sentence = |effect: &usize| {
        let name = words(case.name(*effect));
        format!(
            "{name} was found as strong as it is looked for: it may be stronger, or something else that looks like it"
        )
    };
    let known = case.admitted.warnings.iter().cloned().chain(few(case.admitted, case.split));
    let apart = apart::of_joints(case.bench, shown);
    known.chain(ended.map(sentence)).chain(ends::of_gains(case.bench.library, full)).chain(apart).collect()
}

/// What has to be known about clips of few commands.
fn few(admitted: &Admitted, split: &Split) -> Option<String> {
    let (commands, parts) = (admitted.commands, admitted.groups.len());
    let [in_parts, in_turn] = match parts > commands {
        true => [
            format!("they were cut into {parts} parts, which count as clips, "),
            format!("one in {} of them", split.in_turn.len()),
        ],
        false => [String::new(), "each".to_owned()],
    };
    split.is_of_few().then(|| {
        format!(
            "only {commands} different commands: {in_parts}effects are chosen by all of them, and {in_turn} in turn is left out of the fit \
             that its gap is measured with; record {} more to have clips that nothing was chosen by",
            COMMANDS_TO_CHOOSE_BY - commands
        )
    })
}

/// The verdict where what was found is proven, but a part of the gap stays: so much of the joints [rad] and the object [m].
fn in_part(case: &Case<'_>, partly: &Partly, facts: &Facts, stays: &str, sizes: &Sizes) -> Verdict {
    let looks_like = partly.looks_like(case.bench);
    let [own, rivals] = partly.effects(case.bench);
    let text = headline::in_part(facts, &partly.share, partly.unusual, stays, looks_like, &rivals);
    let (place, looks_like) = (facts.rest.clone(), looks_like.map(str::to_owned));
    let (kind, confidence) = if rivals.is_empty() {
        (Kind::Named, sureness(&partly.found).min(PART_IS_RIGHT.value))
    } else {
        (Kind::Class, CLASS_IS_RIGHT.value)
    };
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

/// What to record next; `largest`: where what is left is largest.
fn next(verdict: &Verdict, decided: &Decided<'_>, largest: Option<&Place>, site: &Site) -> Advice {
    let largest = largest.map(|place| (place.channel.as_str(), place.regime.as_str()));
    // A part of the gap is explained, or that of the arm alone.
    let open = || decided.partly.is_some() || decided.finding.open().is_some();
    match verdict.kind {
        Kind::Unexplained => advice::unexplained(largest, site),
        Kind::Named if open() => advice::unexplained(largest, site),
        Kind::None => advice::nothing_open(site),
        Kind::Named => advice::confirming(&verdict.effects, site),
        Kind::Class => advice::separating(&verdict.effects.iter().map(String::as_str).collect::<Vec<_>>(), site),
        Kind::NotTestable => advice::lacking("motions in which most effects show", site),
    }
}

/// Residuals of the channels with the largest gap, before and after, on the confirm clips.
fn traces(evidence: &Evidence<'_>, [before, after]: [&Residuals; 2], admitted: &Admitted) -> Vec<Trace> {
    let mut sized: Vec<(f64, usize, usize)> = Vec::new();
    for (place, (clip, residuals)) in before.clips.iter().enumerate() {
        for channel in 0..evidence.channels().len() {
            let rows = evidence.rows(*clip).iter().zip(residuals).filter(|(row, _)| row.channel == channel);
            sized.push((rows.map(|(_, r)| r * r).sum(), place, channel));
        }
    }
    sized.sort_by(|a, b| b.0.total_cmp(&a.0));
    let trace = |place: usize, channel: usize| {
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
    sized.into_iter().take(SHOWN_TRACES).map(|(_, place, channel)| trace(place, channel)).collect()
}
