//! Sealed worlds: a cell as the laboratory knows it, and what is true in it. A world is a pure function of its number.
//!
//! True gains lie within 20 % of the nominal ones, the object anywhere in half of its known ranges; friction scatters from
//! clip to clip, in every second world twice as much as the cell declares.

use crate::draw;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use serde::Serialize;
use shared_mem::cell::{Cell, Range};
use shared_mem::theta::{ArmTheta, EffectTheta, ObjectTheta, Theta};

/// What kind of session a world gives.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// The arm alone.
    Excitation,
    /// Control, hit, slide.
    Strokes,
}

/// How many effects act.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    Nothing,
    /// The effect with this place among the candidates, counted round.
    Single(usize),
    Pair,
    /// Something outside the registry.
    Outside(Outside),
}

/// Disturbances that no effect of the registry describes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outside {
    /// Gear friction that grows from clip to clip as a gear cools.
    Cooling,
    /// Commands that are held for some milliseconds now and then, unlogged.
    HeldCommands,
    /// A hose that pulls on one joint beyond an angle.
    Hose,
    /// Friction of the table that grows with every clip.
    Wear,
    /// A lens that moves what it sees outwards with the square of the distance from its axis.
    Lens,
    /// A camera whose latency differs from clip to clip.
    Exposure,
}

impl Outside {
    /// Those that show in clips of a kind.
    pub fn of(kind: Kind) -> &'static [Self] {
        match kind {
            Kind::Excitation => &[Self::Cooling, Self::HeldCommands, Self::Hose],
            Kind::Strokes => &[Self::Wear, Self::Lens, Self::Exposure],
        }
    }

    /// Name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::Cooling => "cooling gears",
            Self::HeldCommands => "held commands",
            Self::Hose => "hose",
            Self::Wear => "wear",
            Self::Lens => "lens",
            Self::Exposure => "exposure",
        }
    }
}

/// What is wrong with a world.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Truth {
    /// Nothing but the scatter that the cell declares.
    Nothing,
    /// These effects of the registry.
    Effects(Vec<String>),
    /// A disturbance that the registry does not describe.
    Outside(String),
}

#[derive(Debug, Clone)]
pub struct World {
    pub number: u64,
    /// What kind of session it gives.
    pub kind: Kind,
    /// What is wrong.
    pub truth: Truth,
    /// What the laboratory knows.
    pub cell: Cell,
    /// Gains, object and effects as they are.
    pub hidden: Theta,
    /// What acts besides.
    pub outside: Option<Outside>,
    /// One sigma of ln(mu) from clip to clip.
    pub friction_scatter: f64,
    /// Steps in which the world integrates what the twin takes in one: nature does not use the fitter's integrator.
    pub parts: u32,
}

impl World {
    /// Draws world `number`.
    pub fn draw(number: u64, kind: Kind, fault: Fault, cell: &Cell) -> Self {
        let mut rng = Pcg64::seed_from_u64(number);
        let with_object = kind == Kind::Strokes;
        let effects = match fault {
            Fault::Nothing | Fault::Outside(_) => Vec::new(),
            Fault::Single(which) => {
                let all = draw::candidates(with_object);
                vec![draw::effect(all[which % all.len()], cell, &mut rng)]
            }
            Fault::Pair => draw::two_effects(with_object, cell, &mut rng),
        };
        let declared = cell.object().and_then(|object| object.friction_scatter).unwrap_or(0.0);
        Self {
            number,
            kind,
            truth: truth(fault, &effects),
            cell: cell.clone(),
            hidden: Theta { arm: arm(cell, &mut rng), object: object(cell, &mut rng), effects, ..Theta::default() },
            outside: if let Fault::Outside(outside) = fault { Some(outside) } else { None },
            friction_scatter: if number.is_multiple_of(2) { declared } else { 2.0 * declared },
            parts: rng.random_range(2..=4),
        }
    }
}

fn truth(fault: Fault, effects: &[EffectTheta]) -> Truth {
    match fault {
        Fault::Nothing => Truth::Nothing,
        Fault::Outside(outside) => Truth::Outside(outside.name().to_owned()),
        Fault::Single(_) | Fault::Pair => Truth::Effects(effects.iter().map(|effect| effect.name.clone()).collect()),
    }
}

fn arm(cell: &Cell, rng: &mut Pcg64) -> Option<ArmTheta> {
    let controller = cell.controller.as_ref()?;
    let mut near = |nominal: &[f64]| nominal.iter().map(|x| x * rng.random_range(0.8..1.2)).collect();
    Some(ArmTheta { stiffness: near(&controller.stiffness), damping: near(&controller.damping) })
}

fn object(cell: &Cell, rng: &mut Pcg64) -> Option<ObjectTheta> {
    let object = cell.object()?;
    let mut within = |range: Option<Range>| {
        range.map(|[low, high]| {
            let quarter = 0.25 * (high - low);
            rng.random_range(low + quarter..high - quarter)
        })
    };
    let centre = object.centre_of_mass_range.map(|ranges| ranges.map(|range| within(Some(range)).unwrap_or(0.0)));
    Some(ObjectTheta {
        name: object.name.clone(),
        friction: within(object.friction_range),
        mass: object.mass.or_else(|| within(object.mass_range)),
        centre_of_mass: centre,
        tip_friction: within(object.tip_friction_range),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn shipped() -> Cell {
        let text = include_str!("../../../config/fr3_cell.toml");
        shared_mem::toml_file::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file")
    }

    #[test]
    fn a_world_is_the_same_whenever_it_is_drawn() {
        let draw = |number| World::draw(number, Kind::Strokes, Fault::Pair, &shipped());
        assert_eq!((draw(7).hidden, draw(7).truth), (draw(7).hidden, draw(7).truth));
        assert_ne!(draw(7).hidden, draw(8).hidden);
    }

    #[test]
    fn every_effect_of_the_registry_can_be_drawn_and_means_something() {
        let cell = shipped();
        for which in 0..draw::candidates(true).len() {
            for number in 0..20 {
                let world = World::draw(number, Kind::Strokes, Fault::Single(which), &cell);
                let effects = twin::effects::Effects::from_theta(&world.hidden.effects, 7);
                let effects = effects.unwrap_or_else(|error| panic!("{error}"));
                assert!(!effects.is_none(), "{:?} changes nothing", world.hidden.effects);
            }
        }
    }
}
