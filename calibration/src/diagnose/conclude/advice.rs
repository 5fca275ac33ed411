//! What to record next: a sentence, and the commands that record it.
//!
//! Where two effects are easily taken for each other one of them says what separates them; where neither does, the stages they
//! show in decide. What no capture can do, a weight to be hung or an object to be put somewhere, stands in the sentence first.

use super::site::{Advice, Capture, Site};
use crate::words::{channel_in_words, words};
use capture::arm_motion::ArmMotion;
use capture::request::Kind;
use twin::effects::{Experiment, Separation, Stage, find};

use Capture::{Arm, Elsewhere, StrokeAgain, Strokes};

const CHIRP: Capture = Arm(ArmMotion::of(Kind::Chirp { frequency: [0.2, 10.0] }, 1));
const RAMP: Capture = Arm(ArmMotion::of(Kind::Ramp { speeds: [0.005, 0.5] }, 1));
const HOLD: Capture = Arm(ArmMotion::of(Kind::Hold { poses: 8 }, 1));
const MANY_HOLDS: ArmMotion = ArmMotion::of(Kind::Hold { poses: 12 }, 1);
const HEADINGS: Capture = Strokes("--headings 8");
const OBJECT_TURNED: Capture = Strokes("--turn-object 0,90,180");
const ONE_STROKE: Capture = Strokes("--clips 1");
const AGAIN_SLOWER: Capture = StrokeAgain("--speed 0.5");
const STROKES_SLOWER: Capture = Strokes("--clips 4 --speed 0.5");

/// What records an experiment.
fn capture(experiment: Experiment) -> Capture {
    match experiment {
        Experiment::Chirp => CHIRP,
        Experiment::FastChirp => Arm(ArmMotion::of(Kind::Chirp { frequency: [0.5, 40.0] }, 1)),
        Experiment::Ramps => RAMP,
        Experiment::Holds => HOLD,
        Experiment::ManyHolds => Arm(ArmMotion { amplitude: Some(0.8), ..MANY_HOLDS }),
        Experiment::NewMotion => Arm(ArmMotion::of(Kind::Multisine, 1)),
        Experiment::StrokeAgainSlower => AGAIN_SLOWER,
        Experiment::StrokeAgainToolTurned => StrokeAgain("--turn-tool=-90"),
        Experiment::OneStroke => ONE_STROKE,
        Experiment::Strokes => Strokes("--clips 8"),
        Experiment::StrokesSlower => STROKES_SLOWER,
        Experiment::Headings => HEADINGS,
        Experiment::ObjectTurned => OBJECT_TURNED,
        Experiment::StrokesWeighted => Elsewhere("weighted", "--clips 8"),
    }
}

/// What separates two effects, and their names in the order of the sentence.
fn separation(a: &str, b: &str) -> Option<([&'static str; 2], &'static Separation)> {
    let of = |one: &str, other: &str| {
        let effect = find(one)?;
        let apart = effect.separated.iter().find(|apart| apart.from == other)?;
        Some(([effect.name, apart.from], apart))
    };
    of(a, b).or_else(|| of(b, a))
}

/// What separates effects of a stage where nothing more is known of them.
fn general(stage: Stage) -> (&'static str, &'static [Capture]) {
    match stage {
        Stage::Control => ("slow ramps, a chirp and rests in eight poses, torques logged", &[RAMP, CHIRP, HOLD]),
        Stage::Hit => (
            "straight hits on the object turned by 0, 90 and 180 degrees, and a stroke again at half its speed",
            &[OBJECT_TURNED, AGAIN_SLOWER],
        ),
        Stage::Slide => (
            "slides in eight headings through the same place, and others at half their speed",
            &[HEADINGS, STROKES_SLOWER],
        ),
        Stage::Camera => {
            ("strokes that begin in places far apart; put the object there before each", &[ONE_STROKE, ONE_STROKE])
        }
    }
}

/// What separates an effect on an object alone from others, where a hand lets the object go.
fn by_hand(effect: &str) -> &'static str {
    match find(effect).map(|effect| effect.stage) {
        Some(Stage::Camera) => "let the object slide in places far apart",
        _ => "let the object slide on its base in eight directions through the same place, and at half the speed",
    }
}

/// What to record next to separate these effects.
pub fn separating(effects: &[&str], site: &Site) -> Advice {
    let pairs = effects.iter().enumerate().flat_map(|(k, a)| effects[k + 1..].iter().map(move |b| (*a, *b)));
    let all = effects.iter().map(|effect| words(effect)).collect::<Vec<_>>().join(", ");
    if let (true, [first, ..]) = (site.objects_alone(), effects) {
        return site.advice(format!("To separate {all}: {}.", by_hand(first)), &[]);
    }
    if let Some(([a, b], apart)) = pairs.filter_map(|(a, b)| separation(a, b)).next() {
        let captures: Vec<Capture> = apart.record.iter().map(|experiment| capture(*experiment)).collect();
        return site.advice(format!("To separate {} from {}: {}.", words(a), words(b), apart.by), &captures);
    }
    if effects.is_empty() {
        return Advice::default();
    }
    let mut stages: Vec<Stage> = Vec::new();
    for stage in effects.iter().filter_map(|name| find(name)).map(|effect| effect.stage) {
        if !stages.contains(&stage) {
            stages.push(stage);
        }
    }
    let (clips, captures): (Vec<_>, Vec<_>) = stages.into_iter().map(general).unzip();
    site.advice(format!("To separate {all}: {}.", clips.join("; ")), &captures.concat())
}

/// What to record next to confirm what was found.
pub fn confirming(effects: &[String], site: &Site) -> Advice {
    let effects: Vec<String> = effects.iter().map(|effect| words(effect)).collect();
    site.again(2, |clips| format!("To confirm {}, {clips}.", effects.join(" and ")))
}

/// What to record where something unknown is left.
pub fn unexplained(place: Option<(&str, &str)>, site: &Site) -> Advice {
    let Some((channel, regime)) = place else { return Advice::default() };
    let channel = channel_in_words(channel);
    site.again(8, |clips| {
        format!("What is left is largest in {channel} ({regime}): {clips}, to see whether it repeats and how it grows.")
    })
}

/// What to record where an effect is likely, and so many clips more would prove it.
pub fn proving(effect: &str, more: usize, site: &Site) -> Advice {
    let sentence = format!("Record {more} clips more with other motions, which prove or refute {}.", words(effect));
    site.more(sentence, more)
}

/// What to record where the clips do not say enough.
pub fn lacking(why: &str, site: &Site) -> Advice {
    let command = if site.strikes() { Strokes("--clips 12") } else { Arm(ArmMotion::of(Kind::Multisine, 8)) };
    site.advice(format!("Record a session that has what this one lacks: {why}."), &[command])
}

/// What to record where nothing is open.
pub fn nothing_open(site: &Site) -> Advice {
    let commands = site.usual();
    let sentence = "Nothing is open; record the next session as usual.".into();
    Advice { sentence, commands, ..Advice::default() }
}

/// Every advice there is, for those who check that each can be carried out.
pub fn all(site: &Site) -> Vec<Advice> {
    let mut all: Vec<Advice> = Vec::new();
    for effect in twin::effects::registry() {
        all.extend(effect.separated.iter().map(|apart| separating(&[effect.name, apart.from], site)));
        all.extend(effect.confusable_with.iter().map(|other| separating(&[effect.name, other], site)));
        all.push(separating(&[effect.name], site));
    }
    let some = twin::effects::registry()[0].name;
    all.push(confirming(&[some.to_owned()], site));
    all.push(unexplained(Some(("yaw", "after the slide")), site));
    all.push(lacking("four clips", site));
    all.push(proving(some, 5, site));
    all.push(nothing_open(site));
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;
    use twin::effects::registry;

    fn strokes() -> Site {
        Site::new(Path::new("monday strokes"), true, vec![0, 3], 1.37)
    }

    #[test]
    fn a_class_of_two_gets_the_clip_that_separates_them_and_two_that_act_together_one_that_confirms_them() {
        let arm = Site::new(Path::new("monday"), false, vec![0, 3], 2.0);
        let advice = separating(&["command_lag", "command_delay"], &arm);
        assert!(advice.sentence.contains("10 Hz"));
        assert_eq!(
            advice.commands,
            [
                "calibration capture excitation --cell monday/cell.toml --out monday --arm sim --clips 1 --motion chirp --frequency 0.2 10",
                "calibration diagnose monday --report report.html"
            ]
        );
        let advice = confirming(&["command_delay".into(), "friction_patch".into()], &arm);
        assert!(advice.sentence.contains("delay and friction patch, repeat two clips"), "{}", advice.sentence);
        let expected = ["--repeat 0,3", "--repeat 0 --speed 0.5", "--repeat 0 --speed 2"];
        for (command, end) in advice.commands.iter().zip(expected) {
            assert!(command.ends_with(end), "{command}");
        }
    }

    #[test]
    fn every_pair_that_is_easily_confused_gets_a_sentence_and_commands() {
        for site in [strokes(), Site::new(Path::new("monday"), false, Vec::new(), 1.0)] {
            for effect in registry() {
                for other in effect.confusable_with {
                    let advice = separating(&[effect.name, other], &site);
                    assert!(advice.sentence.ends_with('.') && !advice.commands.is_empty(), "{} {other}", effect.name);
                }
            }
        }
    }

    #[test]
    fn clips_of_the_other_kind_go_into_a_session_beside_and_a_faster_one_is_no_faster_than_the_limits_allow() {
        let advice = separating(&["table_tilt", "base_tilt"], &strokes());
        assert_eq!(
            advice.commands,
            [
                "calibration capture excitation --cell 'monday strokes/cell.toml' --out 'monday strokes_arm' --arm sim --clips 4",
                "calibration capture excitation --cell 'monday strokes/cell.toml' --out 'monday strokes_arm' --arm sim --clips 1 --motion hold --poses 8",
                "calibration capture control-hit-slide --cell 'monday strokes/cell.toml' --out 'monday strokes' --arm sim --headings 8",
                "calibration diagnose 'monday strokes_arm' --report report_arm.html",
                "calibration diagnose 'monday strokes' --report report.html",
            ]
        );
        let advice = unexplained(Some(("yaw", "rest")), &strokes());
        assert!(advice.sentence.contains("at 1.37 times the speed, the most that the limits allow"), "{advice:?}");
        assert!(advice.commands[0].ends_with("--repeat 0 --clips 8") && advice.commands[2].ends_with("--speed 1.37"));
        assert_eq!(separating(&[], &strokes()), Advice::default());
    }
}
