//! The finding: one of five verdicts, in a sentence, with the effects and how sure it is.

use super::answer::{Kind, Verdict};
use super::leftovers::Left;
use std::time::Duration;

/// What a verdict is drawn from.
#[derive(Debug, Clone)]
pub struct Finding<'a> {
    /// Effects that were found, in the order in which they were.
    pub effects: Vec<&'a str>,
    /// Effects that would do as well as one of them.
    pub rivals: Vec<&'a str>,
    /// How sure the weakest of them is.
    pub confidence: f64,
    /// Whether each of them stood out: nearly all clips spoke for it, and for no other.
    pub clear: bool,
    /// Whether all of them act on the arm.
    pub of_arm: bool,
    /// The gap before and after, of every group of sensors.
    pub left: Vec<Left>,
    /// Whether the gap shrinks on the clips that were kept for confirming.
    pub confirmed: bool,
    /// Whether an effect is stronger than what is met in practice.
    pub implausible: bool,
    /// How much the friction of the last clip is over that of the first, less 1, where it drifts over the session.
    pub drift: Option<f64>,
    /// Where the gap, or what is left of it, is largest.
    pub place: String,
}

/// Straying beyond this multiple of the noise is said, even where it is no gap.
const ROUGH: f64 = 1.25;

/// What is stronger than what is met in practice is believed where it explains this much [%]: a substitute does not.
const ALL_BUT_EXACT: f64 = 99.5;

/// What is less likely than not is not named.
const LIKELY: f64 = 0.5;

/// How often it is right, as met in sessions of another engine, that nothing is there where the twin is as near as noise allows, ...
const NONE: f64 = 0.96;
/// ... that one of a class is the cause, ...
const CLASS: f64 = 0.9;
/// ... and that the cause of a plain gap is unknown (seven of ten); else it was an effect too far from its model.
const UNKNOWN: f64 = 0.7;
/// A gap of less than three least ones is seldom that (one of eight): mostly an effect that is too weak to be believed.
const PLAIN: f64 = 3.0;
const UNKNOWN_OF_LITTLE: f64 = 0.2;

impl Finding<'_> {
    /// The verdict.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        let unlikely = self.rivals.is_empty() && self.confidence < LIKELY;
        if self.effects.is_empty() || !self.confirmed || unlikely {
            let gap = self.left.iter().any(|left| left.gaps() > 1.0);
            return if gap || self.drift.is_some() { self.unexplained() } else { self.none() };
        }
        let pushed = self.implausible && self.percent() < ALL_BUT_EXACT;
        if pushed || self.left.iter().any(|left| left.too_much(self.clear) && !(left.of_object && self.moves_the_arm()))
        {
            return self.unexplained();
        }
        if self.rivals.is_empty() { self.named() } else { self.class() }
    }

    /// The first group of sensors of which the effects leave too much.
    pub(super) fn open(&self) -> Option<&Left> {
        self.left.iter().find(|left| left.too_much(self.clear))
    }

    /// Whether the effects are what moves the arm, whatever an object does besides: a gap that is plain, and a cause that
    /// leaves nothing of it.
    fn moves_the_arm(&self) -> bool {
        let arm = self.left.iter().find(|left| !left.of_object);
        self.of_arm && arm.is_some_and(|arm| arm.gaps() > PLAIN && arm.explained() > 1.0 - arm.substitute)
    }

    fn none(&self) -> Verdict {
        let strays = self.strays();
        let text = if strays < ROUGH {
            "No gap: with the parameters identified, the twin differs from the cell by noise alone.".into()
        } else {
            format!(
                "No gap to explain: the cell strays {strays:.1} times as far from the twin as noise alone would make it, \
                 no further than one simulation from another, and in no way that an effect foretells."
            )
        };
        let nothing = self.left.iter().map(Left::is_nothing).fold(1.0, f64::min);
        Verdict { kind: Kind::None, effects: Vec::new(), confidence: NONE * nothing, text }
    }

    /// How many times as far as noise alone would make it the cell strays from the twin without any effect.
    fn strays(&self) -> f64 {
        self.left.iter().map(|left| left.before / left.floor).fold(1.0, f64::max).sqrt()
    }

    fn named(&self) -> Verdict {
        let names = self.effects.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        let share = self.percent();
        let (verb, these) = if names.len() == 1 { ("causes", "it") } else { ("together cause", "them") };
        let (whose, rest) = match self.open() {
            Some(open) if !self.place.is_empty() => (
                "the arm's gap",
                format!(
                    " there; {:.0} % of what the object does, most in {}, stays unexplained",
                    100.0 * (1.0 - open.explained()),
                    self.place
                ),
            ),
            _ => ("the gap", String::new()),
        };
        let text = format!(
            "{} {verb} {whose}: with {these} the twin closes {share:.0} % of what is not noise{rest}.",
            names.join(" and ")
        );
        Verdict { kind: Kind::Named, effects: names, confidence: self.confidence, text }
    }

    fn class(&self) -> Verdict {
        let all: Vec<String> = self.effects.iter().chain(&self.rivals).map(|name| (*name).to_owned()).collect();
        let text = format!("One of {} causes the gap; these clips cannot tell which.", all.join(", "));
        Verdict { kind: Kind::Class, effects: all, confidence: CLASS, text }
    }

    /// How much of what is not noise the effects explain, in the group of sensors in which they explain most [%].
    fn percent(&self) -> f64 {
        100.0 * self.left.iter().map(Left::explained).fold(0.0, f64::max)
    }

    /// How much is left, of what the arm does or of what the object does where only one of them is explained.
    fn rest(&self) -> String {
        let open: Vec<&Left> = self.left.iter().filter(|left| left.too_much(self.clear)).collect();
        match &open[..] {
            [open] if self.left.len() > 1 => {
                let whose = if open.of_object { "object" } else { "arm" };
                format!("{:.0} % of what the {whose} does", 100.0 * (1.0 - open.explained()))
            }
            _ => format!("{:.0} % of it", 100.0 - self.percent()),
        }
    }

    fn unexplained(&self) -> Verdict {
        let nearest = match &self.effects[..] {
            [] => String::new(),
            names => {
                let strength = if self.implausible { ", stronger than it is met in practice," } else { "" };
                format!("; {} comes nearest{strength} and leaves {}", names.join(" with "), self.rest())
            }
        };
        let drift = self.drift.map_or_else(String::new, |change| {
            let (verb, share) = (if change > 0.0 { "rises" } else { "falls" }, 100.0 * change.abs());
            format!("; from the first clip to the last the friction {verb} by {share:.0} %, as where a table wears or gets dirty")
        });
        let plain = self.drift.is_some() || self.left.iter().any(|left| left.gaps() > PLAIN);
        let (confidence, weak) = if plain {
            (UNKNOWN, "")
        } else {
            (UNKNOWN_OF_LITTLE, "; an effect of the library may also act too weakly to be told in so small a gap")
        };
        let text = format!(
            "Nothing in the library explains the gap: the cell strays {:.1} times as far from the twin as noise alone would \
             make it, most in {}{nearest}{drift}{weak}.",
            self.strays(),
            if self.place.is_empty() { "no single place" } else { &self.place }
        );
        Verdict { kind: Kind::Unexplained, effects: Vec::new(), confidence, text }
    }
}

/// The verdict when the clips do not say enough.
#[must_use]
pub fn not_testable(why: &str) -> Verdict {
    Verdict { kind: Kind::NotTestable, effects: Vec::new(), confidence: 1.0, text: format!("Not testable: {why}.") }
}

impl Verdict {
    /// The same of a diagnosis whose time was spent. `cut_short`: not everything was tried, so that what is unexplained need not
    /// be.
    #[must_use]
    pub fn so_far(self, budget: Duration, cut_short: bool) -> Self {
        let kind = if cut_short && self.kind == Kind::Unexplained { Kind::NotTestable } else { self.kind };
        let budget = budget.as_secs_f64();
        let text = if kind == self.kind {
            format!("{} This is the best answer so far: the budget of {budget} s was spent.", self.text)
        } else {
            format!(
                "There is a gap, and the budget of {budget} s was spent before a cause was found; give it more time."
            )
        };
        Self { kind, text, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::super::leftovers::{NUMERICS, SUBSTITUTE};
    use super::*;

    fn finding<'a>(effects: Vec<&'a str>, before: f64, after: f64) -> Finding<'a> {
        let left =
            vec![Left { before, after, floor: 1.0, numerics: NUMERICS, substitute: SUBSTITUTE, of_object: false }];
        Finding {
            effects,
            rivals: Vec::new(),
            confidence: 0.95,
            clear: false,
            of_arm: true,
            left,
            confirmed: true,
            implausible: false,
            drift: None,
            place: "joint2".into(),
        }
    }

    #[test]
    fn friction_that_drifts_is_told_even_where_every_clip_can_be_followed() {
        let worn = Finding { drift: Some(0.38), ..finding(vec![], 4.0, 4.0) }.verdict();
        assert!(worn.kind == Kind::Unexplained && worn.text.contains("the friction rises by 38 %"), "{}", worn.text);
        let named = Finding { drift: Some(0.38), ..finding(vec!["payload"], 500.0, 1.5) }.verdict();
        assert_eq!(named.kind, Kind::Named);
    }

    #[test]
    fn the_further_the_cell_strays_the_less_sure_it_is_that_nothing_is_there() {
        let object = |before: f64| {
            let mut nothing = finding(vec![], before, before);
            nothing.left[0].of_object = true;
            nothing.verdict()
        };
        let (near, rough, far) = (object(1.5), object(10.5), object(16.0));
        assert!(near.kind == Kind::None && near.confidence > 0.95, "{near:?}");
        assert!(rough.kind == Kind::None && (0.4..0.7).contains(&rough.confidence), "{rough:?}");
        assert!(far.kind == Kind::Unexplained && far.confidence < 0.5 && far.text.contains("too weakly"), "{far:?}");
        assert!(object(100.0).confidence > 0.6);
    }

    #[test]
    fn the_five_verdicts() {
        assert_eq!(finding(vec![], 1.5, 1.5).verdict().kind, Kind::None);
        assert!(finding(vec![], 4.0, 4.0).verdict().text.contains("strays 2.0 times"));
        assert_eq!(finding(vec![], 500.0, 500.0).verdict().kind, Kind::Unexplained);
        assert_eq!(finding(vec!["payload"], 500.0, 1.5).verdict().kind, Kind::Named);
        assert_eq!(finding(vec!["payload"], 500.0, 200.0).verdict().kind, Kind::Unexplained);
        let class = Finding { rivals: vec!["base_tilt"], ..finding(vec!["payload"], 500.0, 1.5) }.verdict();
        assert_eq!((class.kind, class.effects.len()), (Kind::Class, 2));
        assert_eq!(not_testable("one clip").kind, Kind::NotTestable);
    }

    #[test]
    fn what_widens_the_gap_on_clips_kept_for_confirming_is_not_named() {
        let refuted = Finding { confirmed: false, ..finding(vec!["payload"], 500.0, 1.5) };
        assert_eq!(refuted.verdict().kind, Kind::Unexplained);
        assert_eq!(Finding { confirmed: false, ..finding(vec!["payload"], 2.0, 1.5) }.verdict().kind, Kind::None);
    }

    #[test]
    fn what_is_less_likely_than_not_is_not_named_alone() {
        let unlikely = Finding { confidence: 0.1, ..finding(vec!["restitution"], 5.0, 1.5) };
        assert_eq!(unlikely.verdict().kind, Kind::None);
        assert_eq!(Finding { rivals: vec!["tip_friction"], ..unlikely }.verdict().kind, Kind::Class);
        let in_a_gap = Finding { confidence: 0.1, ..finding(vec!["restitution"], 500.0, 1.5) };
        assert_eq!(in_a_gap.verdict().kind, Kind::Unexplained);
    }

    #[test]
    fn where_only_the_arm_is_explained_its_cause_is_named_and_it_is_said_what_is_left_of_the_object() {
        let mut found = finding(vec!["command_delay"], 5e5, 1.5);
        let arm = found.left[0];
        found.left.push(Left { of_object: true, before: 301.0, after: 91.0, ..arm });
        found.place = "yaw (after the slide)".into();
        let Verdict { kind, text, .. } = found.verdict();
        let told = "the arm's gap: with it the twin closes 100 % of what is not noise there; 30 % of what the object does, \
                    most in yaw (after the slide), stays unexplained";
        assert!(kind == Kind::Named && text.contains(told), "{text}");
        let of_object = Finding { of_arm: false, ..found.clone() }.verdict();
        let nearest = "comes nearest and leaves 30 % of what the object does";
        assert!(of_object.kind == Kind::Unexplained && of_object.text.contains(nearest), "{}", of_object.text);
        let mut little = found.clone();
        (little.left[0].before, little.left[0].after) = (15.0, 1.2);
        assert_eq!(little.verdict().kind, Kind::Unexplained, "a substitute closes so small a gap as well");
        found.left[0].after = 2e5;
        assert!(found.verdict().text.contains("leaves 30 % of it"), "both are left");
    }

    #[test]
    fn an_effect_beyond_what_is_met_in_practice_is_a_substitute() {
        let exact = Finding { implausible: true, ..finding(vec!["payload"], 500.0, 1.5) };
        assert_eq!(exact.verdict().kind, Kind::Named, "stronger than usual, and exactly that");
        let pushed = Finding { implausible: true, ..finding(vec!["payload"], 500.0, 6.5) };
        let verdict = pushed.verdict();
        assert!(verdict.kind == Kind::Unexplained && verdict.text.contains("stronger than"), "{}", verdict.text);
    }
}
