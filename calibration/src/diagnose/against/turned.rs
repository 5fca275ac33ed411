//! Two sessions of one cell under numbers that both share and numbers that each has of its own.
//!
//! The clips of both lie in one evidence, those of the second behind those of the first. A model says which numbers of the
//! library are turned and in which session each acts; what is not turned stays where it is.

use super::super::library::Library;
use inference::estimate::{ClipModel, Impossible, Unknown};
use inference::likelihood::random_effects::{RandomEffects, WithOwn};
use inference::likelihood::{Channel, Evidence, Likelihood, Near, Row, Setting};

/// One of the two sessions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// The first, to which the second is held.
    A,
    /// The second.
    B,
}

pub(super) const SIDES: [Side; 2] = [Side::A, Side::B];

/// In which sessions a number acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Acts {
    Everywhere,
    /// In one of them.
    In(Side),
}

impl Acts {
    pub(super) fn on(self, side: Side) -> bool {
        self == Self::Everywhere || self == Self::In(side)
    }
}

/// A number of the library that a fit turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Turned {
    pub(super) number: usize,
    /// Where it acts.
    pub(super) acts: Acts,
}

/// Numbers of both sessions, and which of them are turned.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Model {
    /// All numbers of the library in A and in B.
    pub(super) values: [Vec<f64>; 2],
    /// Those that are turned.
    pub(super) turned: Vec<Turned>,
}

/// How far gains of a session may be from what cell.toml states once each session has its own: firmware gains are switched by powers of
/// two.
pub(super) const MAX_GAIN_FACTOR: f64 = 10.0;

impl Model {
    /// Everything shared: `free` numbers at `full`.
    pub(super) fn shared(full: Vec<f64>, free: &[usize]) -> Self {
        let turned = free.iter().map(|number| Turned { number: *number, acts: Acts::Everywhere }).collect();
        Self { values: [full.clone(), full], turned }
    }

    /// Numbers of one session.
    pub(super) fn of(&self, side: Side) -> &Vec<f64> {
        &self.values[side as usize]
    }

    /// The same with numbers of which each session has its own from now on.
    pub(super) fn apart(mut self, numbers: &[usize]) -> Self {
        self.turned.retain(|turned| !numbers.contains(&turned.number));
        let own = |side| numbers.iter().map(move |number| Turned { number: *number, acts: Acts::In(side) });
        self.turned.extend(SIDES.into_iter().flat_map(own));
        self
    }

    /// The same with numbers that both have from now on.
    pub(super) fn with(mut self, numbers: &[usize]) -> Self {
        let fresh = numbers.iter().filter(|number| !self.turned.iter().any(|turned| turned.number == **number));
        let fresh: Vec<Turned> = fresh.map(|number| Turned { number: *number, acts: Acts::Everywhere }).collect();
        self.turned.extend(fresh);
        self
    }

    /// The same with numbers that both share again, each where the first session has it.
    pub(super) fn together(mut self, numbers: &[usize]) -> Self {
        self.turned.retain(|turned| !numbers.contains(&turned.number));
        numbers.iter().for_each(|number| self.values[Side::B as usize][*number] = self.values[0][*number]);
        self.with(numbers)
    }

    /// Values of what is turned.
    pub(super) fn start(&self) -> Vec<f64> {
        let side = |acts| if acts == Acts::In(Side::B) { Side::B } else { Side::A };
        self.turned.iter().map(|turned| self.of(side(turned.acts))[turned.number]).collect()
    }

    /// All numbers of a session where what is turned has these values.
    pub(super) fn full(&self, side: Side, values: &[f64]) -> Vec<f64> {
        let mut full = self.of(side).clone();
        for (turned, value) in self.turned.iter().zip(values).filter(|(turned, _)| turned.acts.on(side)) {
            full[turned.number] = *value;
        }
        full
    }

    /// The same with these values.
    pub(super) fn at(mut self, values: &[f64]) -> Self {
        self.values = SIDES.map(|side| self.full(side, values));
        self
    }

    /// The library of what is turned.
    pub(super) fn library(&self, whole: &Library) -> Library {
        let chosen = self.turned.iter().map(|turned| {
            let unknown = &whole.unknowns[turned.number];
            let own = turned.acts != Acts::Everywhere;
            let is_gain =
                matches!(whole.settings.settings()[turned.number], Setting::Stiffness(_) | Setting::Damping(_));
            let [lower, upper] = if own && is_gain {
                [unknown.lower / MAX_GAIN_FACTOR, unknown.upper * MAX_GAIN_FACTOR]
            } else {
                [unknown.lower, unknown.upper]
            };
            (turned.number, Unknown { lower, upper, ..unknown.clone() })
        });
        whole.of_numbers(chosen.collect())
    }
}

/// The clips of both sessions under the numbers that a model turns.
pub(super) struct TwoSessions<'a> {
    /// The clips, those of B behind those of A.
    pub(super) evidence: &'a Evidence<'a>,
    /// Index of B's first clip.
    pub(super) first_of_b: usize,
    /// What is turned.
    pub(super) model: &'a Model,
}

impl TwoSessions<'_> {
    fn full(&self, clip: usize, values: &[f64]) -> Vec<f64> {
        self.model.full(side_of(clip, self.first_of_b), values)
    }
}

/// The session of a clip.
pub(super) fn side_of(clip: usize, first_of_b: usize) -> Side {
    if clip < first_of_b { Side::A } else { Side::B }
}

impl ClipModel for TwoSessions<'_> {
    fn clips(&self) -> usize {
        self.evidence.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.evidence.residuals(clip, &self.full(clip, shared), own, out)
    }
}

impl Likelihood for TwoSessions<'_> {
    type Own = WithOwn;

    fn changed(
        &self,
        clip: usize,
        (shared, own): (&[f64], &[f64]),
        (reach, base, at): Near<'_>,
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        let at = at.map(|(at, own)| (self.full(clip, at), own));
        let at = at.as_ref().map(|(at, own)| (&at[..], *own));
        self.evidence.changed(clip, (&self.full(clip, shared), own), (reach, base, at), out)
    }

    fn channels(&self) -> &[Channel] {
        self.evidence.channels()
    }

    fn rows(&self, clip: usize) -> &[Row] {
        self.evidence.rows(clip)
    }

    fn scatter(&self) -> RandomEffects {
        self.evidence.scatter()
    }

    fn torque_sigma(&self) -> Option<&[f64]> {
        self.evidence.torque_sigma()
    }

    fn own_slope(&self, clip: usize, own: usize) -> Option<&[f64]> {
        self.evidence.own_slope(clip, own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_acts_where_it_was_said_to_and_the_others_are_shared() {
        let shared = Model::shared(vec![1.0, 2.0, 3.0], &[0, 1]);
        let apart = shared.clone().apart(&[1]);
        assert_eq!(apart.start(), [1.0, 2.0, 2.0]);
        let moved = apart.at(&[10.0, 20.0, 40.0]);
        assert_eq!((moved.of(Side::A), moved.of(Side::B)), (&vec![10.0, 20.0, 3.0], &vec![10.0, 40.0, 3.0]));
        let again = moved.together(&[1]);
        assert_eq!((again.of(Side::B)[1], again.turned.len()), (20.0, 2));
        assert_eq!(again.with(&[1, 2]).turned.len(), 3);
    }
}
