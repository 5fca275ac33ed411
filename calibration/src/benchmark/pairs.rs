//! Two sessions of one world: between them one thing changed, or nothing. What `diagnose --against` says of them.
//!
//! The second session has other motions and other noise. In every second pair the gears have dry friction in both sessions, as in
//! any real arm.

use super::session::record;
use super::trial::sealed;
use super::world::{Fault, Kind, World};
use crate::diagnose::against::{Comparison, Pair, compare_clips};
use crate::diagnose::{self, Options, Status};
use inference::interrupt::Interrupt;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::{Deserialize, Serialize};
use shared_mem::cell::Cell;
use shared_mem::theta::EffectTheta;

/// What changes between two sessions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Changed {
    /// Nothing, in sessions of the arm or of strokes.
    Nothing(Kind),
    /// A payload is put on.
    Payload,
    /// The dry friction of the gears grows.
    JointFriction,
    /// All stiffnesses are changed by one factor.
    Gain,
    /// Commands come later.
    Delay,
    /// The table is wiped or gets dirty.
    TableFriction,
}

/// Those in which something changes.
pub const CHANGES: [Changed; 5] =
    [Changed::Payload, Changed::JointFriction, Changed::Gain, Changed::Delay, Changed::TableFriction];

/// What came of one pair.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Outcome {
    /// Number of the world.
    pub world: u64,
    /// What changed; empty where nothing did.
    pub truth: String,
    /// True change of its first number.
    pub size: f64,
    pub verdict: String,
    /// What it names.
    pub changes: Vec<String>,
    /// The change that was found of the first number of what changed, with its interval; none where it was not found.
    pub found: Option<(f64, [f64; 2])>,
    /// Share of B's gap that closes.
    pub shrink: f64,
    /// Wall-clock time [s].
    pub seconds: f64,
}

impl Changed {
    /// The name under which a comparison tells it; empty for nothing.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nothing(_) => "",
            Self::Payload => "payload",
            Self::JointFriction => "joint_coulomb_friction",
            Self::Gain => "stiffness",
            Self::Delay => "command_delay",
            Self::TableFriction => "friction",
        }
    }

    fn kind(self) -> Kind {
        match self {
            Self::Nothing(kind) => kind,
            Self::TableFriction => Kind::Strokes,
            _ => Kind::Excitation,
        }
    }

    /// The worlds of both sessions, and the true change of the first number.
    pub fn worlds(self, number: u64, cell: &Cell) -> ([World; 2], f64) {
        let mut rng = Pcg64::seed_from_u64(number ^ 0x00C0_FFEE);
        let mut a = World::draw(number, self.kind(), Fault::Nothing, cell);
        if number.is_multiple_of(2) {
            a.hidden.effects.push(joint_friction(rng.random_range(0.1..0.5), cell));
        }
        let mut b = World { number: number + OTHER_MOTIONS, ..a.clone() };
        let size = self.make(&mut b, cell, &mut rng);
        ([a, b], size)
    }

    fn make(self, world: &mut World, cell: &Cell, rng: &mut Pcg64) -> f64 {
        let hidden = &mut world.hidden;
        match self {
            Self::Nothing(_) => 0.0,
            Self::Payload => {
                let mass: f64 = rng.random_range(0.05..0.6);
                hidden.effects.push(effect("payload", "mass", mass.into()));
                mass
            }
            Self::JointFriction => {
                let before = hidden.effects.pop();
                let level = before.as_ref().map_or(0.0, first_of);
                let more = rng.random_range(0.1..0.6);
                hidden.effects.push(joint_friction(level + more, cell));
                first_of(&hidden.effects[0]) - level
            }
            Self::Gain => {
                let factor = rng.random_range(1.02_f64..2.0);
                let Some(arm) = hidden.arm.as_mut() else { return 0.0 };
                let before = arm.stiffness[0];
                arm.stiffness.iter_mut().for_each(|gain| *gain *= factor);
                arm.stiffness[0] - before
            }
            Self::Delay => {
                let delay: f64 = rng.random_range(0.002..0.012);
                hidden.effects.push(effect("command_delay", "delay", delay.into()));
                delay
            }
            Self::TableFriction => {
                let factor =
                    if rng.random_bool(0.5) { rng.random_range(0.6..0.8) } else { rng.random_range(1.25..1.6) };
                let Some(friction) = hidden.object.as_mut().and_then(|object| object.friction.as_mut()) else {
                    return 0.0;
                };
                let before = *friction;
                *friction *= factor;
                *friction - before
            }
        }
    }

    /// Has a pair of so many clips each compared.
    ///
    /// # Errors
    /// When a world gives no session, or the pair cannot be compared.
    pub fn examine(self, number: u64, (clips, cell): (usize, &Cell), interrupt: &Interrupt) -> anyhow::Result<Outcome> {
        let (worlds, size) = self.worlds(number, cell);
        let [a, b] = [sealed(&worlds[0], record(&worlds[0], clips)?), sealed(&worlds[1], record(&worlds[1], clips)?)];
        let pair = Pair::of([a.1, b.1], false, Vec::new());
        let options = Options { seed: number, ..Options::default() };
        let found = compare_clips([&a.0, &b.0], &pair, &options, interrupt)?;
        Ok(self.outcome(number, size, &found))
    }

    fn outcome(self, number: u64, size: f64, found: &Comparison) -> Outcome {
        let kind = match found.verdict.kind {
            diagnose::Kind::None => "none",
            diagnose::Kind::Named => "named",
            diagnose::Kind::Class => "class",
            diagnose::Kind::Unexplained => "unexplained",
            diagnose::Kind::NotTestable => "not_testable",
        };
        let changed = found.candidates.iter().find(|candidate| {
            candidate.name == self.name() && matches!(candidate.status, Status::Named | Status::Possible)
        });
        let first = changed.and_then(|candidate| candidate.parameters.values().next());
        Outcome {
            world: number,
            truth: self.name().to_owned(),
            size,
            verdict: kind.to_owned(),
            changes: found.verdict.changes.clone(),
            found: first.map(|values| (values.change[0], values.ci95[0])),
            shrink: found.gap.shrink.value,
            seconds: found.seconds,
        }
    }
}

/// Numbers of worlds that differ by this have other motions and other noise.
const OTHER_MOTIONS: u64 = 500_000;

fn effect(name: &str, parameter: &str, value: toml::Value) -> EffectTheta {
    EffectTheta { name: name.to_owned(), parameters: [(parameter.to_owned(), value)].into() }
}

/// As strong in every joint as its gear is large: so much at the strongest [N m].
fn joint_friction(strongest: f64, cell: &Cell) -> EffectTheta {
    let stiffness = cell.controller.as_ref().map_or(&[][..], |controller| &controller.stiffness);
    let largest = stiffness.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
    let levels: Vec<toml::Value> = stiffness.iter().map(|k| (strongest * (k / largest).sqrt()).into()).collect();
    effect("joint_coulomb_friction", "coulomb", levels.into())
}

/// The first number of an effect's only parameter.
fn first_of(effect: &EffectTheta) -> f64 {
    let levels = effect.parameters.values().next().and_then(toml::Value::as_array);
    levels.and_then(|levels| levels.first()).and_then(toml::Value::as_float).unwrap_or(0.0)
}

impl Outcome {
    /// Whether what it says is right: the change named, alone or in a class; nothing where nothing changed.
    pub fn is_right(&self) -> bool {
        if self.truth.is_empty() {
            return !matches!(self.verdict.as_str(), "named" | "class");
        }
        match self.verdict.as_str() {
            "named" => self.changes == [self.truth.clone()],
            "class" => self.changes.contains(&self.truth),
            _ => false,
        }
    }

    /// Whether the interval holds the true change; none where it was not found.
    pub fn holds(&self) -> Option<bool> {
        self.found.map(|(_, [low, high])| (low..=high).contains(&self.size))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn the_sessions_of_a_pair_differ_by_what_changed_and_nothing_else() {
        let text = include_str!("../../../config/fr3_cell.toml");
        let cell = shared_mem::toml_file::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file");
        for number in [4, 5] {
            for changed in CHANGES {
                let ([a, b], size) = changed.worlds(number, &cell);
                assert!(a.hidden != b.hidden && size != 0.0 && a.number != b.number, "{changed:?}");
            }
            let ([a, b], _) = Changed::Nothing(Kind::Excitation).worlds(number, &cell);
            assert_eq!(a.hidden, b.hidden);
            assert_eq!(a.hidden.effects.len(), usize::from(number == 4));
        }
    }
}
