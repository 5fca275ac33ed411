//! The finding in one sentence of plain words: how large the gap is and where, which effect causes it, how far it shrinks.

use super::verdict::{Decision, Finding};
use crate::answer::diagnosis::{Kind, Share};
use crate::diagnose::criteria::UNKNOWN_OF_LITTLE_IS_RIGHT;
use crate::diagnose::judge::closing::MIN_SHARE_CLOSED;
use crate::diagnose::judge::gap::Shrunk;
use crate::words::quantity::UNBOUNDED;
use crate::words::{percent, words};

/// What the sentence is made of, beside the finding itself.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Facts {
    /// How large the gap is: `2.13 mrad RMS`.
    pub(super) size: String,
    /// Where it is largest: `joint 2 (reversal)`; empty where it is nowhere.
    pub(super) place: String,
    /// Where it is largest once the effects are in the twin.
    pub(super) rest: String,
    /// The effects found, each with its size: `command delay (delay 11.9 ms)`.
    pub(super) effects: Vec<String>,
    /// An effect that is likely and not proven.
    pub(super) unproven: Option<NotProven>,
    /// The shrink with all of them in the twin.
    pub(super) shrink: Shrunk,
}

/// An effect that closes a part of the gap, in too few clips to be proven.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct NotProven {
    pub(super) effect: String,
    /// Share of the gap that it closes.
    pub(super) share: f64,
    /// How many clips do not prove it.
    pub(super) clips: usize,
    /// How many more would.
    pub(super) more: usize,
}

impl Shrunk {
    /// `by 96 % (94 % to 97 %) on held-out clips`. Where some clips outweigh all others, what most do, and in how many it grows.
    fn in_words(&self) -> String {
        let [shrinks, all] = self.clips;
        if self.mean.value >= MIN_SHARE_CLOSED || shrinks == all {
            return format!("by {} on held-out clips", with_interval(&self.mean));
        }
        // Before and after the hit nothing may change where the cause acts in it alone.
        let of_contact = self.usual.value <= MIN_SHARE_CLOSED && self.contact.value > self.usual.value;
        let (share, whose) = if of_contact { (self.contact, "the joints in contact of ") } else { (self.usual, "") };
        let (share, grows) = (with_interval(&share), all - shrinks);
        format!("by {share} in {whose}a held-out clip like most, but grows in {grows} of {all}")
    }
}

/// `96 % (94 % to 97 %)`.
fn with_interval(share: &Share) -> String {
    let (value, [low, high]) = (percent(share.value), share.ci90.map(percent));
    let said = value.replace("> ", "more than ").replace("< ", "less than ");
    // What is known to the last digit that is shown has no interval to show.
    if low == value && high == value { said } else { format!("{said} ({low} to {high})") }
}

/// Residuals beyond this multiple of the noise are said, even where they are no gap [1] (a choice).
const SAID_FROM: f64 = 1.25;

pub(super) fn sentence(decision: &Decision, finding: &Finding<'_>, facts: &Facts) -> String {
    match decision.kind {
        Kind::None => none(finding, facts),
        Kind::Named => named(finding, facts),
        Kind::Class => class(finding, facts),
        Kind::Unexplained => unexplained(decision, finding, facts),
        Kind::NotTestable => not_shown(finding, facts),
    }
}

fn not_shown(finding: &Finding<'_>, Facts { size, .. }: &Facts) -> String {
    let power = &finding.power;
    let nearest = power.not_shown.first().filter(|(_, times)| *times < UNBOUNDED);
    let nearest = nearest.map_or_else(String::new, |(name, times)| {
        format!("; the nearest of the others, {}, from {times:.1} times that size on", words(name))
    });
    format!(
        "Not testable: with the parameters identified, twin and cell differ by {size}, but of {} effects these clips would show {} at the \
         largest size that is plausible{nearest}.",
        power.all, power.shown
    )
}

fn none(finding: &Finding<'_>, Facts { size, .. }: &Facts) -> String {
    let times = finding.times_noise();
    if finding.within_tolerance[0] && times >= SAID_FROM {
        return format!(
            "No gap of interest: with the parameters identified, twin and cell differ by {size}, less than the tolerance."
        );
    }
    if times < SAID_FROM {
        return format!(
            "No gap: with the parameters identified, twin and cell differ by {size}, as noise alone makes them."
        );
    }
    format!(
        "No gap to explain: with the parameters identified, twin and cell differ by {size}, {times:.1} times what noise alone \
         leaves but no more than two simulations of one cell, and no effect predicts the difference."
    )
}

fn named(finding: &Finding<'_>, facts: &Facts) -> String {
    let (verb, these) = if facts.effects.len() == 1 { ("causes", "it") } else { ("together cause", "them") };
    let (whose, rest) = match finding.open() {
        Some(_) if !facts.rest.is_empty() => (
            "the arm's part of the gap",
            format!("; what the object does, most of it in {}, stays unexplained", facts.rest),
        ),
        _ => ("the gap", String::new()),
    };
    format!(
        "{} {verb} {whose}, {}: with {these} in the twin the gap shrinks {}{rest}.",
        facts.effects.join(" and "),
        size_and_place(facts),
        facts.shrink.in_words()
    )
}

/// The sentence where what was found is proven, but a part of the gap stays. `share`: what it explains; `unusual`: whether it is
/// stronger than what is plausible; `after`: how large what stays is; `rivals`: effects that do as well as one of those found.
pub(super) fn in_part(
    facts: &Facts,
    share: &Share,
    unusual: bool,
    after: &str,
    looks_like: Option<&str>,
    rivals: &[String],
) -> String {
    let strength = strength(unusual);
    let (verb, these) = match (facts.effects.len(), rivals.is_empty()) {
        (1, true) => ("explains", "it"),
        (_, true) => ("together explain", "them"),
        (1, false) => ("explains", "the first"),
        (_, false) => ("explain", "those whose size is given"),
    };
    let first = if rivals.is_empty() { "" } else { "One of " };
    let who = if rivals.is_empty() {
        facts.effects.join(" and ")
    } else {
        facts.effects.iter().cloned().chain(rivals.iter().map(|rival| words(rival))).collect::<Vec<_>>().join(", ")
    };
    let apart = if rivals.is_empty() { "" } else { "; these clips cannot separate them" };
    let alike = match looks_like {
        Some(effect) => format!("; {} explains most of that", words(effect)),
        None => "; no effect of the library explains much of that".to_owned(),
    };
    let share = with_interval(share);
    format!(
        "{first}{who}{strength} {verb} {share} of the squared gap, {}: with {these} in the twin {after} stay on held-out \
         clips, largest in {}{alike}{apart}.",
        size_and_place(facts),
        facts.rest
    )
}

fn class(finding: &Finding<'_>, facts: &Facts) -> String {
    let rivals = finding.rivals.iter().map(|rival| words(rival));
    let all: Vec<String> = facts.effects.iter().cloned().chain(rivals).collect();
    let these = if facts.effects.len() == 1 { "the first" } else { "those whose size is given" };
    format!(
        "One of {} causes the gap, {}: with {these} in the twin the gap shrinks {}, and these clips cannot separate them.",
        all.join(", "),
        size_and_place(facts),
        facts.shrink.in_words()
    )
}

fn unexplained(decision: &Decision, finding: &Finding<'_>, facts: &Facts) -> String {
    let nearest = if facts.effects.is_empty() {
        let unproven = |NotProven { effect, share, clips, more }: &NotProven| {
            let share = percent(*share);
            format!(
                "; {effect} closes {share} of it, but in {clips} clips that may be chance: about {more} more would prove it"
            )
        };
        facts.unproven.as_ref().map_or_else(String::new, unproven)
    } else {
        let strength = strength(finding.implausible);
        let shrinks = if finding.confirmed {
            format!("shrinks it {} and leaves more than a cause does", facts.shrink.in_words())
        } else {
            "does not predict held-out clips better".to_owned()
        };
        format!("; {} comes nearest{strength} but {shrinks}", facts.effects.join(" with "))
    };
    let drift = finding.drift.map_or_else(String::new, |change| {
        let (verb, share) = (if change > 0.0 { "rises" } else { "falls" }, percent(change.abs()));
        format!(
            "; from the first clip to the last the friction {verb} by {share}, as where a table wears or gets dirty"
        )
    });
    let weak = if decision.little {
        let share = percent(1.0 - UNKNOWN_OF_LITTLE_IS_RIGHT.value);
        format!(
            "; in {share} of simulated sessions with so small a gap no unknown cause acted, but an effect of the library too weakly to be \
             identified, or nothing"
        )
    } else {
        String::new()
    };
    format!(
        "No effect of the library explains the gap, {}, {:.1} times what noise alone leaves{nearest}{drift}{weak}.",
        size_and_place(facts),
        finding.times_noise()
    )
}

fn strength(implausible: bool) -> &'static str {
    if implausible { ", stronger than is plausible," } else { "" }
}

/// `2.13 mrad RMS, largest in joint 2 (reversal)`.
fn size_and_place(Facts { size, place, .. }: &Facts) -> String {
    if place.is_empty() { size.clone() } else { format!("{size}, largest in {place}") }
}

#[cfg(test)]
mod tests {
    use super::super::verdict::Power;
    use super::super::verdict::tests::finding;
    use super::*;

    fn facts(effects: &[&str]) -> Facts {
        Facts {
            size: "2.13 mrad RMS".into(),
            place: "joint 2 (reversal)".into(),
            rest: "yaw (after the slide)".into(),
            effects: effects.iter().map(|name| (*name).to_owned()).collect(),
            unproven: None,
            shrink: Shrunk {
                mean: Share { value: 0.963, ci90: [0.94, 0.972] },
                usual: Share { value: 0.97, ci90: [0.95, 0.98] },
                contact: Share::default(),
                clips: [4, 4],
            },
        }
    }

    fn said(finding: &Finding<'_>, effects: &[&str]) -> String {
        sentence(&finding.decide(), finding, &facts(effects))
    }

    #[test]
    fn the_headline_says_effect_size_place_and_the_one_shrink() {
        assert_eq!(
            said(&finding(vec!["command_delay"], 500.0, 1.5), &["command delay (delay 11.9 ms)"]),
            "command delay (delay 11.9 ms) causes the gap, 2.13 mrad RMS, largest in joint 2 (reversal): with it in the twin \
             the gap shrinks by 96 % (94 % to 97 %) on held-out clips."
        );
        let class = Finding { rivals: vec!["command_lag"], ..finding(vec!["command_delay"], 500.0, 1.5) };
        let text = said(&class, &["command delay (delay 11.9 ms)"]);
        assert!(
            text.starts_with("One of command delay (delay 11.9 ms), command lag causes the gap, 2.13 mrad"),
            "{text}"
        );
        assert!(text.contains("with the first in the twin the gap shrinks by 96 %"), "{text}");
    }

    #[test]
    fn a_clip_that_outweighs_the_others_is_said_and_not_averaged() {
        let share = |value, ci90| Share { value, ci90 };
        let (mean, usual) = (share(-0.15, [-1.0, 0.5]), share(0.62, [0.2, 0.8]));
        let shrink = Shrunk { mean, usual, clips: [3, 4], ..Shrunk::default() };
        let found = finding(vec!["camera_scale"], 30.0, 1.5);
        let text = sentence(&found.decide(), &found, &Facts { shrink, ..facts(&["camera scale (scale 0.02)"]) });
        assert!(
            text.ends_with("the gap shrinks by 62 % (20 % to 80 %) in a held-out clip like most, but grows in 1 of 4."),
            "{text}"
        );
        let shrink = Shrunk { usual: Share::default(), contact: share(0.9, [0.85, 0.95]), ..shrink };
        let text = sentence(&found.decide(), &found, &Facts { shrink, ..facts(&["camera scale (scale 0.02)"]) });
        assert!(
            text.ends_with(
                "by 90 % (85 % to 95 %) in the joints in contact of a held-out clip like most, but grows in 1 of 4."
            ),
            "{text}"
        );
    }

    #[test]
    fn what_is_proven_is_said_with_what_stays() {
        let share = Share { value: 0.963, ci90: [0.94, 0.98] };
        let text =
            in_part(&facts(&["command lag (lag 15.4 ms)"]), &share, false, "0.40 mrad RMS", Some("payload"), &[]);
        assert_eq!(
            text,
            "command lag (lag 15.4 ms) explains 96 % (94 % to 98 %) of the squared gap, 2.13 mrad RMS, largest in joint 2 \
             (reversal): with it in the twin 0.40 mrad RMS stay on held-out clips, largest in yaw (after the slide); payload \
             explains most of that."
        );
        let text = in_part(&facts(&["payload"]), &share, true, "1 mm", None, &[]);
        assert!(text.ends_with("no effect of the library explains much of that."), "{text}");
        assert!(text.starts_with("payload, stronger than is plausible, explains 96 %"), "{text}");
        let rivals = ["joint_coulomb_friction".to_owned()];
        let text = in_part(&facts(&["load friction (0.44)"]), &share, false, "1 mm", None, &rivals);
        assert!(text.starts_with("One of load friction (0.44), joint coulomb friction explains 96 %"), "{text}");
        assert!(
            text.contains("with the first in the twin 1 mm stay") && text.ends_with("cannot separate them."),
            "{text}"
        );
    }

    #[test]
    fn where_nothing_is_found_the_size_is_said_in_noise() {
        let text = said(&finding(vec![], 4.0, 4.0), &[]);
        assert!(text.contains("2.0 times what noise alone leaves"), "{text}");
        assert!(text.contains("% of simulated sessions with so small a gap"), "{text}");
        assert!(said(&finding(vec![], 1.5, 1.5), &[]).starts_with("No gap: "));
        let text = said(&finding(vec!["payload"], 500.0, 200.0), &["payload (mass 0.4 kg)"]);
        assert!(text.starts_with("No effect of the library explains the gap, 2.13 mrad RMS"), "{text}");
        assert!(text.contains("payload (mass 0.4 kg) comes nearest but shrinks it by 96 %"), "{text}");
        let pushed = Finding { implausible: true, ..finding(vec!["payload"], 500.0, 6.5) };
        assert!(said(&pushed, &["payload"]).contains("stronger than is plausible"));
        let unproven = NotProven { effect: "payload (mass 0.4 kg)".into(), share: 0.63, clips: 4, more: 5 };
        let open = Facts { unproven: Some(unproven), ..facts(&[]) };
        let found = finding(vec![], 500.0, 500.0);
        let text = sentence(&found.decide(), &found, &open);
        assert!(
            text.contains("payload (mass 0.4 kg) closes 63 % of it, but in 4 clips that may be chance: about 5 more"),
            "{text}"
        );
        let worn = Finding { drift: Some(0.38), ..finding(vec![], 4.0, 4.0) };
        assert!(said(&worn, &[]).contains("the friction rises by 38 %"));
    }

    #[test]
    fn where_hardly_an_effect_would_be_seen_it_is_said_from_which_size_on_it_would() {
        let not_shown = vec![("payload", 2.51), ("torque_ripple", 1e200)];
        let blind = Finding { power: Power { shown: 2, all: 20, not_shown }, ..finding(vec![], 1.5, 1.5) };
        let text = said(&blind, &[]);
        assert!(text.contains("of 20 effects these clips would show 2 at the largest size"), "{text}");
        assert!(text.ends_with("the nearest of the others, payload, from 2.5 times that size on."), "{text}");
    }

    #[test]
    fn where_only_the_arm_is_explained_it_is_said_what_the_object_leaves() {
        use crate::answer::diagnosis::{SensorGap, Sensors};
        let mut found = finding(vec!["command_delay"], 5e5, 1.5);
        let arm = found.left[0];
        found.left.push(SensorGap { sensors: Sensors::Object, before: 301.0, after: 91.0, ..arm });
        let text = said(&found, &["command delay"]);
        assert!(text.starts_with("command delay causes the arm's part of the gap"), "{text}");
        assert!(
            text.ends_with("what the object does, most of it in yaw (after the slide), stays unexplained."),
            "{text}"
        );
    }
}
