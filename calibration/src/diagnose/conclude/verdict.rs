//! The finding: one of five verdicts, with the effects and how sure it is. [`super::headline`] says it in a sentence.

use crate::answer::diagnosis::{Basis, Kind, SensorGap, Verdict};
use crate::diagnose::criteria::{
    CLASS_IS_RIGHT, MOST_OF_IT, NONE_IS_RIGHT, PART_IS_RIGHT, UNKNOWN_IS_RIGHT, UNKNOWN_OF_LITTLE_IS_RIGHT,
};
use crate::diagnose::judge::confidence;
use std::time::Duration;

/// What a verdict is drawn from.
#[derive(Debug, Clone)]
pub(super) struct Finding<'a> {
    /// Effects that were found, in the order in which they were.
    pub(super) effects: Vec<&'a str>,
    /// Effects that would do as well as one of them.
    pub(super) rivals: Vec<&'a str>,
    /// How sure the weakest of them is.
    pub(super) confidence: f64,
    /// Whether each of them stood out: nearly all clips spoke for it, and for no other.
    pub(super) clear: bool,
    /// Whether what each of them gains is no chance by far.
    pub(super) beyond_chance: bool,
    /// Whether all of them act on the arm.
    pub(super) of_arm: bool,
    /// The gap before and after, of every group of sensors.
    pub(super) left: Vec<SensorGap>,
    /// Whether clips speak for it by numbers that were fitted to others.
    pub(super) confirmed: bool,
    /// Whether an effect is stronger than what is plausible.
    pub(super) implausible: bool,
    /// Whether the gap is of no interest without effects, and with them.
    pub(super) within_tolerance: [bool; 2],
    /// How much the friction of the last clip is over that of the first, less 1, where it drifts over the session.
    pub(super) drift: Option<f64>,
    pub(super) power: Power,
}

/// Of how many effects these clips would show anything.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Power {
    /// Those that would be seen at the largest size that is plausible.
    pub(super) shown: usize,
    pub(super) all: usize,
    /// Those that would not, each with the multiple of that size from which on it would be, the smallest first.
    pub(super) not_shown: Vec<(&'static str, f64)>,
}

impl Power {
    /// Whether so much would be seen that it says something that nothing was.
    fn is_enough(&self) -> bool {
        self.shown as f64 >= MOST_OF_IT * self.all as f64
    }
}

/// The verdict without its sentence.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Decision {
    /// Which of the five it is.
    pub(super) kind: Kind,
    /// Effects named, or the members of the class.
    pub(super) effects: Vec<String>,
    /// How sure, 0 to 1.
    pub(super) confidence: f64,
    /// Whether a gap that nothing explains is so small that an effect may be too weak to be identified in it.
    pub(super) little: bool,
}

impl Decision {
    /// The verdict with its sentence.
    pub(super) fn said(self, text: String) -> Verdict {
        let Self { kind, effects, confidence, .. } = self;
        Verdict { kind, effects, confidence, text, explained_share: None, rest: None }
    }
}

impl Verdict {
    /// What [`Verdict::confidence`] is.
    pub fn basis(&self) -> Basis {
        let most = match self.kind {
            Kind::Named if self.explained_share.is_some() => PART_IS_RIGHT.value,
            Kind::Named => confidence::MAX_PROBABILITY,
            Kind::None => NONE_IS_RIGHT.value,
            Kind::Class | Kind::Unexplained => return Basis::Rate,
            Kind::NotTestable => return Basis::Nothing,
        };
        if self.confidence < most - SHOWN_AS_THE_LIMIT { Basis::Estimate } else { Basis::Limit }
    }
}

/// So near its limit a confidence is shown as the limit [1]: half a percent, as it is printed.
const SHOWN_AS_THE_LIMIT: f64 = 0.005;

/// What is stronger than what is plausible is believed where it explains this much [%] (a choice): a substitute does not.
const BELIEVED_BEYOND_RANGE: f64 = 99.5;

/// What is less likely than not is not named [1].
const LEAST_CONFIDENCE: f64 = 0.5;

impl Finding<'_> {
    pub(super) fn decide(&self) -> Decision {
        if self.within_tolerance[0] {
            return self.none();
        }
        // Rivals share what is sure: that one of them acts may be surer than each of them.
        let unlikely = self.rivals.is_empty() && self.confidence < LEAST_CONFIDENCE;
        let gap = self.left.iter().any(|left| left.gaps() > 1.0);
        // Strokes of two engines differ so much anyway: in no larger a gap, of forty candidates some gain by chance.
        let may_be_chance = !gap && !self.of_arm && !self.beyond_chance;
        if self.effects.is_empty() || !self.confirmed || unlikely || may_be_chance {
            return if gap || self.drift.is_some() { self.unexplained() } else { self.none() };
        }
        // A substitute is pushed beyond its range to close a gap that is not its own, and does not close it whole.
        let pushed = self.implausible && self.percent() < BELIEVED_BEYOND_RANGE;
        if pushed
            || !self.within_tolerance[1]
                && self.left.iter().any(|left| left.too_much(self.clear) && !(left.of_object() && self.moves_the_arm()))
        {
            return self.unexplained();
        }
        if self.rivals.is_empty() { self.named() } else { self.class() }
    }

    /// The first group of sensors of which the effects leave too much.
    pub(in crate::diagnose) fn open(&self) -> Option<&SensorGap> {
        self.left.iter().find(|left| left.too_much(self.clear))
    }

    /// Whether the effects are what moves the arm, whatever an object does besides: a gap that is plain, and a cause that
    /// leaves nothing of it.
    fn moves_the_arm(&self) -> bool {
        let arm = self.left.iter().find(|left| !left.of_object());
        self.of_arm && arm.is_some_and(|arm| arm.is_plain() && arm.explained() > 1.0 - arm.substitute())
    }

    /// How many times what noise alone leaves the residuals are without any effect.
    pub(in crate::diagnose) fn times_noise(&self) -> f64 {
        self.left.iter().map(|left| left.before / left.floor).fold(1.0, f64::max).sqrt()
    }

    fn none(&self) -> Decision {
        let nothing = self.left.iter().map(SensorGap::is_nothing).fold(1.0, f64::min);
        // What is of no interest is a matter of size, which is measured.
        let nothing = if self.within_tolerance[0] { 1.0 } else { nothing };
        if !self.within_tolerance[0] && !self.power.is_enough() {
            return Decision { kind: Kind::NotTestable, effects: Vec::new(), confidence: 1.0, little: false };
        }
        Decision { kind: Kind::None, effects: Vec::new(), confidence: NONE_IS_RIGHT.value * nothing, little: false }
    }

    fn named(&self) -> Decision {
        let names = self.effects.iter().map(|name| (*name).to_owned()).collect();
        Decision { kind: Kind::Named, effects: names, confidence: self.confidence, little: false }
    }

    fn class(&self) -> Decision {
        let all = self.effects.iter().chain(&self.rivals).map(|name| (*name).to_owned()).collect();
        Decision { kind: Kind::Class, effects: all, confidence: CLASS_IS_RIGHT.value, little: false }
    }

    /// How much of what is not noise the effects explain, in the group of sensors in which they explain most [%].
    fn percent(&self) -> f64 {
        100.0 * self.left.iter().map(SensorGap::explained).fold(0.0, f64::max)
    }

    fn unexplained(&self) -> Decision {
        let plain = self.drift.is_some() || self.left.iter().any(SensorGap::is_plain);
        let confidence = if plain { UNKNOWN_IS_RIGHT.value } else { UNKNOWN_OF_LITTLE_IS_RIGHT.value };
        Decision { kind: Kind::Unexplained, effects: Vec::new(), confidence, little: !plain }
    }
}

/// The verdict when the clips do not say enough.
pub(super) fn not_testable(why: &str) -> Verdict {
    let decision = Decision { kind: Kind::NotTestable, effects: Vec::new(), confidence: 1.0, little: false };
    decision.said(format!("Not testable: {why}."))
}

impl Verdict {
    /// The same of a diagnosis whose time was spent. `cut_short`: not everything was tried, so that what is unexplained need not
    /// be.
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
pub(in crate::diagnose) mod tests {
    use super::*;
    use crate::answer::diagnosis::Sensors;

    pub(in crate::diagnose) fn finding<'a>(effects: Vec<&'a str>, before: f64, after: f64) -> Finding<'a> {
        let left = vec![SensorGap { sensors: Sensors::Joints, before, after, floor: 1.0 }];
        Finding {
            effects,
            rivals: Vec::new(),
            confidence: 0.95,
            clear: false,
            beyond_chance: true,
            of_arm: true,
            left,
            confirmed: true,
            implausible: false,
            within_tolerance: [false; 2],
            drift: None,
            power: Power::default(),
        }
    }

    #[test]
    fn friction_that_drifts_is_said_even_where_every_clip_can_be_followed() {
        let worn = Finding { drift: Some(0.38), ..finding(vec![], 4.0, 4.0) }.decide();
        assert_eq!(worn.kind, Kind::Unexplained);
        let named = Finding { drift: Some(0.38), ..finding(vec!["payload"], 500.0, 1.5) }.decide();
        assert_eq!(named.kind, Kind::Named);
    }

    #[test]
    fn the_larger_the_residuals_the_less_sure_it_is_that_nothing_is_there() {
        let object = |before: f64| {
            let mut nothing = finding(vec![], before, before);
            nothing.left[0].sensors = Sensors::Object;
            nothing.decide()
        };
        let (near, rough, far) = (object(1.5), object(10.5), object(16.0));
        assert!(near.kind == Kind::None && near.confidence > 0.95, "{near:?}");
        assert!(rough.kind == Kind::None && (0.4..0.7).contains(&rough.confidence), "{rough:?}");
        assert!(far.kind == Kind::Unexplained && far.confidence < 0.5 && far.little, "{far:?}");
        assert!(object(100.0).confidence > 0.6 && !object(100.0).little);
    }

    #[test]
    fn where_most_effects_would_not_be_seen_nothing_can_be_said_but_of_what_is_of_no_interest() {
        let blind = Power { shown: 3, all: 20, not_shown: vec![("payload", 2.5)] };
        let nothing = Finding { power: blind, ..finding(vec![], 1.5, 1.5) };
        assert_eq!(nothing.decide().kind, Kind::NotTestable);
        assert_eq!(Finding { within_tolerance: [true; 2], ..nothing.clone() }.decide().kind, Kind::None);
        let seen = Power { shown: 12, all: 20, not_shown: Vec::new() };
        assert_eq!(Finding { power: seen, ..nothing }.decide().kind, Kind::None);
    }

    #[test]
    fn the_five_verdicts() {
        assert_eq!(finding(vec![], 1.5, 1.5).decide().kind, Kind::None);
        assert_eq!(finding(vec![], 500.0, 500.0).decide().kind, Kind::Unexplained);
        assert_eq!(finding(vec!["payload"], 500.0, 1.5).decide().kind, Kind::Named);
        assert_eq!(finding(vec!["payload"], 500.0, 200.0).decide().kind, Kind::Unexplained);
        let class = Finding { rivals: vec!["base_tilt"], ..finding(vec!["payload"], 500.0, 1.5) }.decide();
        assert_eq!((class.kind, class.effects.len()), (Kind::Class, 2));
        assert_eq!(not_testable("one clip").kind, Kind::NotTestable);
    }

    #[test]
    fn a_confidence_at_its_limit_is_no_estimate() {
        let basis = |finding: &Finding<'_>| finding.decide().said(String::new()).basis();
        let named = |confidence| Finding { confidence, ..finding(vec!["payload"], 500.0, 1.5) };
        assert_eq!(basis(&named(confidence::MAX_PROBABILITY)), Basis::Limit);
        assert_eq!(basis(&named(0.8)), Basis::Estimate);
        assert_eq!(basis(&finding(vec![], 1.0, 1.0)), Basis::Limit);
        assert_eq!(basis(&finding(vec![], 500.0, 500.0)), Basis::Rate);
        assert_eq!(not_testable("one clip").basis(), Basis::Nothing);
    }

    #[test]
    fn what_widens_the_gap_on_held_out_clips_is_not_named() {
        let refuted = Finding { confirmed: false, ..finding(vec!["payload"], 500.0, 1.5) };
        assert_eq!(refuted.decide().kind, Kind::Unexplained);
        assert_eq!(Finding { confirmed: false, ..finding(vec!["payload"], 1.5, 1.2) }.decide().kind, Kind::None);
    }

    #[test]
    fn in_a_gap_that_two_engines_leave_anyway_a_cause_of_strokes_is_beyond_chance() {
        let little = Finding { of_arm: false, ..finding(vec!["tool_offset"], 1.5, 1.2) };
        assert_eq!(little.decide().kind, Kind::Named);
        let by_chance = Finding { beyond_chance: false, ..little };
        assert_eq!(by_chance.decide().kind, Kind::None);
        assert_eq!(Finding { rivals: vec!["camera_scale"], ..by_chance.clone() }.decide().kind, Kind::None);
        assert_eq!(Finding { of_arm: true, ..by_chance }.decide().kind, Kind::Named);
        let plain = Finding { of_arm: false, beyond_chance: false, ..finding(vec!["tool_offset"], 500.0, 1.5) };
        assert_eq!(plain.decide().kind, Kind::Named);
    }

    #[test]
    fn what_is_less_likely_than_not_is_not_named_alone() {
        let unlikely = Finding { confidence: 0.1, ..finding(vec!["restitution"], 1.5, 1.2) };
        assert_eq!(unlikely.decide().kind, Kind::None);
        assert_eq!(Finding { rivals: vec!["tip_friction"], ..unlikely }.decide().kind, Kind::Class);
        let in_a_gap = Finding { confidence: 0.1, ..finding(vec!["restitution"], 500.0, 1.5) };
        assert_eq!(in_a_gap.decide().kind, Kind::Unexplained);
    }

    #[test]
    fn where_only_the_arm_is_explained_its_cause_is_named() {
        let mut found = finding(vec!["command_delay"], 5e5, 1.5);
        let arm = found.left[0];
        found.left.push(SensorGap { sensors: Sensors::Object, before: 301.0, after: 91.0, ..arm });
        assert_eq!(found.decide().kind, Kind::Named);
        assert_eq!(Finding { of_arm: false, ..found.clone() }.decide().kind, Kind::Unexplained);
        let mut little = found.clone();
        (little.left[0].before, little.left[0].after) = (15.0, 1.2);
        assert_eq!(little.decide().kind, Kind::Unexplained, "a substitute closes so small a gap as well");
    }

    #[test]
    fn an_effect_beyond_what_is_plausible_is_a_substitute() {
        let exact = Finding { implausible: true, ..finding(vec!["payload"], 500.0, 1.5) };
        assert_eq!(exact.decide().kind, Kind::Named, "stronger than usual, and exactly that");
        let pushed = Finding { implausible: true, ..finding(vec!["payload"], 500.0, 6.5) };
        assert_eq!(pushed.decide().kind, Kind::Unexplained);
    }
}
