//! Why a candidate is the cause or is not, in words: every reason for ruling one out speaks against it.

use super::verdict::Finding;
use crate::answer::diagnosis::{Kind, Status};
use crate::diagnose::fit::bench::Bench;
use crate::diagnose::fit::shortlist::{BY_CHANCE, TESTABLE};
use crate::diagnose::judge::trial::{Found, LARGE_SHARE_CLOSED, MIN_NATS_PER_ROW, Trial};
use crate::diagnose::select::criteria::EFFECTS;
use crate::diagnose::select::gain::Gain;
use crate::words::words;

/// A candidate with all that its reason is drawn from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Judged<'a> {
    /// The candidate in the step at [`Self::place`].
    pub(super) trial: &'a Trial,
    /// The step in which it is judged.
    pub(super) place: usize,
    /// Effects that were in the twin then.
    pub(super) beside: &'a [&'a str],
    pub(super) status: Status,
    /// Whether it was not fitted because the arm's gap is open.
    pub(super) hidden: bool,
    /// How many times what noise leaves the residuals of the confirm clips are with it, where it was fitted.
    pub(super) times_noise: Option<f64>,
    /// The verdict on the session.
    pub(super) kind: Kind,
    /// What the verdict was drawn from.
    pub(super) finding: &'a Finding<'a>,
}

pub(super) fn reason(bench: &Bench<'_>, found: &Found, judged: &Judged<'_>) -> String {
    let scored = &judged.trial.scored;
    let text = match (judged.status, &judged.trial.fitted) {
        (Status::NotTestable, _) if judged.hidden => {
            return "not identifiable while the arm's own gap is unexplained: where the arm is elsewhere, a hit says nothing of \
                    the object"
                .into();
        }
        (Status::NotTestable, _) => {
            return format!(
                "not identifiable: at the largest plausible size its signature reaches {:.1} sigma beyond what other \
                 parameters imitate, and {TESTABLE:.0} are needed",
                scored.signal
            );
        }
        (Status::RuledOut, Some((_, advantage))) => against(bench, found, judged, advantage),
        (Status::RuledOut, None) => screened(bench, found, judged),
        (_, Some((_, advantage))) => format!(
            "predicts {:.0} % of the held-out clips better, with {} (log-likelihood +{})",
            100.0 * advantage.share,
            parameters(scored.cost),
            nats(advantage.nats, advantage.error)
        ),
        (_, None) => format!("its signature explains {:.1} % of the residuals", 100.0 * scored.cosine.powi(2)),
    };
    let beside: Vec<String> = judged.beside.iter().map(|name| words(name)).collect();
    if beside.is_empty() { text } else { format!("beside {}: {text}", beside.join(" and ")) }
}

/// Against a candidate that was fitted.
fn against(bench: &Bench<'_>, found: &Found, judged: &Judged<'_>, advantage: &Gain) -> String {
    let Judged { trial, finding, .. } = judged;
    let (effect, cost) = (trial.scored.candidate, trial.scored.cost);
    let name = bench.library.candidates[effect].effect.name;
    if finding.effects.contains(&name) {
        return nearest(judged);
    }
    let gain = nats(advantage.nats, advantage.error);
    if advantage.nats <= 0.0 {
        return format!("does not predict held-out clips better: log-likelihood changes by {gain}");
    }
    let plain = trial.closed.most > LARGE_SHARE_CLOSED && advantage.in_nearly_all();
    if !EFFECTS.proves(advantage, cost) && !plain {
        let share = 100.0 * advantage.share;
        return format!(
            "no better than chance: the log-likelihood of held-out clips rises by {gain} for {}, in {share:.0} % of the clips",
            parameters(cost)
        );
    }
    if let Some((leader, its)) = leader(bench, found, judged) {
        let ahead = its.beyond(advantage);
        let other = words(bench.library.candidates[leader.scored.candidate].effect.name);
        let fewer = if leader.scored.cost < cost { ", with fewer parameters" } else { "" };
        if ahead.nats > 0.0 {
            return format!(
                "{other} predicts held-out clips better{fewer} (log-likelihood +{})",
                nats(ahead.nats, ahead.error)
            );
        }
        if trial.is_outdone_by(leader) {
            return format!("{other} predicts held-out clips as well{fewer}");
        }
    }
    if !trial.is_cause() {
        let times = times_noise(judged);
        return format!("shrinks too little of the gap for a cause: residuals stay {times} what noise alone leaves");
    }
    let full = trial.fitted.as_ref().map(|(fit, _)| fit);
    if full.is_some_and(|fit| bench.negligible(effect, &fit.full)) {
        return "the size fitted is negligible: two simulations of one cell differ by as much".into();
    }
    if full.is_some_and(|fit| bench.is_convention(effect, fit)) {
        let convention = match bench.library.is_of_arm(effect) {
            true => "does no more than shift commands by one control period beside another effect that shifts them",
            false => "what was fitted lies where engines with nothing wrong in them lie: no two of them agree on it",
        };
        return convention.into();
    }
    let step = &found.steps[judged.place];
    if bench.library.candidates[effect].is_of_arm() && advantage.nats <= MIN_NATS_PER_ROW * step.arm_rows as f64 {
        return format!(
            "the log-likelihood rises by {gain} over {} residuals of the arm: numerical differences add up to as much",
            step.arm_rows
        );
    }
    if judged.kind == Kind::None {
        return format!("nothing is left to explain: its gain of {gain} is what two simulations of one cell differ by");
    }
    format!("gains {gain} of log-likelihood, but leaves residuals {} what noise alone leaves", times_noise(judged))
}

/// Against effects that were found and are not believed.
fn nearest(judged: &Judged<'_>) -> String {
    let finding = judged.finding;
    if !finding.confirmed {
        return "does not predict held-out clips better".into();
    }
    if judged.kind == Kind::None
        || finding.left.iter().all(|left| !left.too_much(finding.clear)) && !finding.implausible
    {
        return "less likely than not".into();
    }
    let strength = if finding.implausible { "only at a size beyond what is plausible, and " } else { "" };
    format!(
        "comes nearest, but {strength}residuals stay {} what noise alone leaves: a cause leaves less",
        times_noise(judged)
    )
}

/// The effect that was kept in the step of a candidate, or the best of it where none was.
fn leader<'a>(bench: &Bench<'_>, found: &'a Found, judged: &Judged<'_>) -> Option<(&'a Trial, &'a Gain)> {
    let step = &found.steps[judged.place];
    let kept = found.kept().find(|(place, _)| *place == judged.place).map(|(_, effect)| effect);
    let trial = kept.and_then(|effect| step.trial(effect)).or_else(|| step.best(bench).map(|(trial, ..)| trial))?;
    let (_, advantage) = trial.fitted.as_ref().filter(|_| trial.scored.candidate != judged.trial.scored.candidate)?;
    Some((trial, advantage))
}

/// Against a candidate whose signature ruled it out before a fit.
fn screened(bench: &Bench<'_>, found: &Found, judged: &Judged<'_>) -> String {
    let scored = &judged.trial.scored;
    let share = 100.0 * scored.cosine.powi(2);
    if scored.p >= BY_CHANCE {
        return format!(
            "screening: its signature explains {share:.1} % of the residuals, as noise alone does in {:.0} % of cases",
            100.0 * scored.p
        );
    }
    let step = &found.steps[judged.place];
    if bench.negligible(scored.candidate, &bench.begun(step.from.full.clone(), scored)) {
        return format!(
            "screening: its signature explains {share:.1} % of the residuals, at a size that is negligible: two simulations of \
             one cell differ by as much"
        );
    }
    let kept = found.kept().find(|(place, _)| *place == judged.place).map(|(_, effect)| effect);
    let fitted = || step.trials.iter().filter(|trial| trial.fitted.is_some());
    let better = || fitted().map(|trial| &trial.scored).filter(|other| other.gain > scored.gain);
    match better().find(|other| Some(other.candidate) == kept).or_else(|| better().next()) {
        Some(best) => format!(
            "screening: its signature would raise the log-likelihood by {:.0} nats, that of {} by {:.0}",
            0.5 * scored.gain,
            words(bench.library.candidates[best.candidate].effect.name),
            0.5 * best.gain
        ),
        None => format!(
            "screening: its signature explains {share:.1} % of the residuals, and other parameters imitate {:.0} % of that \
             signature",
            100.0 * scored.imitated
        ),
    }
}

/// `12.3 ± 4.5 nats`.
fn nats(value: f64, error: f64) -> String {
    let digits = usize::from(value.abs().max(error) < 9.95);
    format!("{value:.digits$} \u{b1} {error:.digits$} nats")
}

fn parameters(count: usize) -> String {
    format!("{count} parameter{}", if count == 1 { "" } else { "s" })
}

fn times_noise(judged: &Judged<'_>) -> String {
    judged.times_noise.map_or_else(|| "above".to_owned(), |times| format!("{times:.1} times"))
}

#[cfg(test)]
mod tests {
    use super::super::verdict::tests::finding;
    use super::*;
    use crate::diagnose::fit::bench::Hypothesis;
    use crate::diagnose::fit::shortlist::Scored;
    use crate::diagnose::judge::closing::Closed;
    use crate::diagnose::judge::score::Predicted;
    use crate::diagnose::judge::trial::Step;
    use crate::diagnose::test_bench::{nothing_said_of, on_strokes, shipped};
    use worlds::world::{Fault, World};

    fn hypothesis(effects: &[usize], full: &[f64]) -> Hypothesis {
        Hypothesis { effects: effects.to_vec(), full: full.to_vec(), free: Vec::new(), fitted: Vec::new() }
    }

    /// Twelve clips that are likelier by so many nats together than without any effect.
    fn likelier(nats: f64) -> Predicted {
        Predicted { clips: (0..12).map(|clip| (clip, 1000.0 - 2.0 * nats / 12.0)).collect() }
    }

    #[test]
    fn every_reason_for_ruling_out_speaks_against_the_candidate() {
        let cell = shipped();
        let world = World::draw(3, worlds::world::Kind::Strokes, Fault::Nothing, &cell);
        on_strokes((&cell, &world), |bench, _| {
            let start = bench.library.start();
            let of_arm = (0..bench.library.candidates.len()).filter(|k| bench.library.candidates[*k].is_of_arm());
            let [leading, other] = of_arm.take(2).collect::<Vec<_>>()[..] else { panic!("two effects on the arm") };
            let trial = |candidate, nats: Option<f64>, closes, p, gain| Trial {
                fitted: nats.map(|nats| (hypothesis(&[candidate], &start), likelier(nats).over(&likelier(0.0)))),
                closed: Closed::all(closes),
                ..Trial::untried(
                    Scored { cosine: 0.3, gain, p, signal: 30.0, ..nothing_said_of(bench.library, candidate) },
                    false,
                )
            };
            let found = |candidate: Trial| {
                let step = |from: &[usize], trials: Vec<Trial>| Step {
                    from: hypothesis(from, &start),
                    trials,
                    predicted: likelier(0.0),
                    weights: Vec::new(),
                    arm_rows: 100,
                    left: Vec::new(),
                    whole: Vec::new(),
                };
                let first = step(&[], vec![trial(leading, Some(200.0), 0.99, 0.0, 400.0), candidate]);
                Found { steps: vec![first, step(&[leading], Vec::new())], last: hypothesis(&[leading], &start) }
            };
            let name = bench.library.candidates[leading].effect.name;
            let finding = finding(vec![name], 500.0, 1.5);
            let why = |candidate: Trial| {
                let found = found(candidate);
                let trial = &found.steps[0].trials[1];
                let judged = Judged {
                    trial,
                    place: 0,
                    beside: &[],
                    status: Status::RuledOut,
                    hidden: false,
                    times_noise: Some(7.5),
                    kind: Kind::Named,
                    finding: &finding,
                };
                reason(bench, &found, &judged)
            };
            let cases = [
                // One that would close all of the gap by itself.
                (trial(other, Some(150.0), 1.0, 0.0, 300.0), format!("{} predicts held-out clips better", words(name))),
                (trial(other, Some(-5.0), 0.0, 0.0, 3.0), "does not predict held-out clips better".into()),
                (trial(other, Some(2.0), 0.0, 0.0, 3.0), "no better than chance".into()),
                (trial(other, None, 0.0, 0.6, 3.0), "as noise alone does in 60 % of cases".into()),
            ];
            for (candidate, against) in cases {
                let why = why(candidate);
                assert!(why.contains(&against), "{why}");
                assert!(!why.starts_with("predicts") && !why.contains("closes"), "{why}");
            }
        });
    }

    #[test]
    fn few_nats_are_given_with_a_digit_and_many_without() {
        assert_eq!(nats(2.04, 0.5), "2.0 \u{b1} 0.5 nats");
        assert_eq!(nats(120.4, 3.3), "120 \u{b1} 3 nats");
        assert_eq!([parameters(1), parameters(7)], ["1 parameter", "7 parameters"]);
    }
}
