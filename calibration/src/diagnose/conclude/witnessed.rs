//! What single stages say beside the verdict: they stand in the answer, and where one contradicts what is named, a sentence says so. They
//! are measured without roll-outs, so nothing that the search was misled by is in them.

use crate::answer::diagnosis::{Candidate, Diagnosis, Kind, Status};
use crate::answer::witnessed_number;
use crate::words::words;
use inference::admit::Admitted;
use inference::statistics::normal;
use inference::witness::{SIGNIFICANT, Witness, beyond, witnesses};
use shared_mem::cell::Cell;

/// Adds the witnesses of a session to its answer, and what contradicts it to its warnings.
pub(in crate::diagnose) fn add(found: &mut Diagnosis, cell: &Cell, admitted: &Admitted) {
    if !admitted.with_object {
        return;
    }
    found.witnesses = witnesses(cell, &admitted.clips);
    if found.verdict.kind != Kind::NotTestable {
        let left = beyond(cell, &admitted.clips, &found.theta);
        let sentences = contradictions(&found.witnesses, &left, doubt(&found.candidates), found.verdict.kind);
        found.warnings.extend(sentences);
    }
}

/// One standard error of the named effects' sizes, as a share of them, out of their 90 % intervals; the largest.
fn doubt(candidates: &[Candidate]) -> f64 {
    let named = candidates.iter().filter(|candidate| candidate.status == Status::Named);
    let share = |size: &crate::answer::Size| {
        let half: f64 = size.ci90.iter().map(|[low, high]| (0.5 * (high - low)).powi(2)).sum();
        let whole: f64 = size.values.iter().map(|value| value * value).sum();
        if whole > 0.0 { (half / whole).sqrt() / normal(0.9) } else { 0.0 }
    };
    named
        .flat_map(|candidate| candidate.parameters.values().map(share))
        .filter(|share| share.is_finite())
        .fold(0.0, f64::max)
}

/// Sentences about witnesses that stay once clips are corrected for what is named, `left`; `whole`: without that. What is named explains of
/// a witness only as exactly as it is known itself, with an error that is the share `doubt` of it.
fn contradictions(whole: &[Witness], left: &[Witness], doubt: f64, kind: Kind) -> Vec<String> {
    let contradicts = |witness: &&Witness| {
        let before = whole.iter().find(|other| (other.effect, other.number) == (witness.effect, witness.number));
        let explained = before.map_or(0.0, |before| before.value - witness.value);
        witness.value.abs() > SIGNIFICANT * witness.error.hypot(doubt * explained)
    };
    let open: Vec<&Witness> = left.iter().filter(contradicts).collect();
    let mut sentences: Vec<String> = Vec::new();
    for (place, witness) in open.iter().enumerate() {
        let alike = |other: &&&Witness| (other.effect, other.stage) == (witness.effect, witness.stage);
        if open[..place].iter().any(|other| alike(&other)) {
            continue;
        }
        let all: Vec<&&Witness> = open[place..].iter().filter(alike).collect();
        sentences.push(sentence(&all, kind));
    }
    sentences
}

/// A sentence about the numbers of one effect in one stage.
fn sentence(witnesses: &[&&Witness], kind: Kind) -> String {
    let [first, ..] = witnesses else { return String::new() };
    let numbers: Vec<String> = witnesses.iter().map(|witness| witnessed_number(witness)).collect();
    let or = first.confusable_with.iter().map(|effect| format!(" or {}", words(effect))).collect::<String>();
    let against = match kind {
        Kind::Named | Kind::Class => "beyond what is named",
        _ => "which no named effect explains",
    };
    format!(
        "the stage \"{}\" by itself, without a roll-out, shows {}{or} ({}; {} clips), {against}",
        first.stage,
        words(first.effect),
        numbers.join(", "),
        first.clips
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use inference::witness::CLIPS;

    fn latency(value: f64) -> Witness {
        Witness {
            effect: "camera_latency",
            number: "latency",
            stage: "contact",
            value,
            error: 1e-3,
            t: value / 1e-3,
            unit: "s",
            clips: 8,
            confusable_with: vec!["tracker_smoothing"],
            against: CLIPS,
            measured: CLIPS,
            points: Vec::new(),
        }
    }

    #[test]
    fn a_witness_that_nothing_named_explains_is_said_with_its_number() {
        let said = contradictions(&[latency(0.02)], &[latency(0.02)], 0.0, Kind::None);
        assert_eq!(said.len(), 1);
        assert!(said[0].starts_with(
            "the stage \"contact\" by itself, without a roll-out, shows camera latency or tracker smoothing"
        ));
        assert!(said[0].ends_with("(latency 20.0 \u{b1} 1.0 ms; 8 clips), which no named effect explains"), "{said:?}");
    }

    #[test]
    fn what_is_named_explains_a_witness_as_exactly_as_it_is_known() {
        assert!(contradictions(&[latency(0.02)], &[latency(0.003)], 0.0, Kind::Named).is_empty());
        let left = [latency(0.005)];
        assert!(contradictions(&[latency(0.025)], &left, 0.0, Kind::Named)[0].ends_with("beyond what is named"));
        // Known to a tenth: 20 ms may be 18 or 22.
        assert!(contradictions(&[latency(0.025)], &left, 0.1, Kind::Named).is_empty());
    }
}
