//! Two worlds that one session each is recorded in: between them one thing changed, or nothing.
//!
//! The second session has other motions and other noise. In every second pair the gears have dry friction in both sessions, as in
//! any real arm.

use crate::world::{Fault, Kind, World};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
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
