//! Draws what is wrong with a world: effects with sizes, or a disturbance that no effect of the registry describes.
//!
//! Sizes reach from a third of the plausible range to all of it, wider than what a typical cell has, on a logarithmic
//! scale; per joint they follow the square root of the nominal stiffness, as gear friction follows gear size.

use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_pcg::Pcg64;
use shared_mem::cell::Cell;
use shared_mem::theta::EffectTheta;
use std::collections::BTreeMap;
use twin::effects::{EffectInfo, Parameter, Role, Shape, Stage, registry};

/// Smallest share of the plausible range that is drawn.
const SMALLEST: f64 = 0.33;

/// Causes that can show in clips of the arm alone, or in strokes.
pub fn candidates(with_object: bool) -> Vec<&'static EffectInfo> {
    let shows = |effect: &&EffectInfo| with_object || effect.stage == Stage::Control;
    registry().iter().filter(shows).filter(|effect| effect.is_cause()).collect()
}

/// An effect with sizes and forms drawn from its plausible ranges.
pub fn effect(info: &EffectInfo, cell: &Cell, rng: &mut Pcg64) -> EffectTheta {
    let strength = SMALLEST.powf(rng.random_range(0.0..1.0));
    let parameters: BTreeMap<String, toml::Value> = info
        .parameters
        .iter()
        .filter(|parameter| parameter.resting_value().is_finite() || matches!(parameter.role, Role::Size { .. }))
        .map(|parameter| (parameter.name.to_owned(), value(parameter, strength, cell, rng)))
        .collect();
    EffectTheta { name: info.name.to_owned(), parameters }
}

/// Two different effects that do not act on the same number.
pub fn two_effects(with_object: bool, cell: &Cell, rng: &mut Pcg64) -> Vec<EffectTheta> {
    let all = candidates(with_object);
    let pick = |rng: &mut Pcg64| *all.choose(rng).expect("the registry is not empty");
    let first = pick(rng);
    let second = loop {
        let other = pick(rng);
        if other.name != first.name && !first.confusable_with.contains(&other.name) {
            break other;
        }
    };
    vec![effect(first, cell, rng), effect(second, cell, rng)]
}

fn value(parameter: &Parameter, strength: f64, cell: &Cell, rng: &mut Pcg64) -> toml::Value {
    let number = match parameter.role {
        Role::Size { neutral } => size(parameter, neutral, strength, rng),
        Role::Form { .. } => rng.random_range(parameter.plausible[0]..parameter.plausible[1]),
    };
    match parameter.shape {
        Shape::Number => number.into(),
        Shape::PerJoint => joints(parameter, number, cell).into(),
        Shape::Vector(length) => vector(number, length, rng).into(),
    }
}

/// A size on the one or, where the range has two sides, either side of the value that changes nothing.
fn size(parameter: &Parameter, neutral: f64, strength: f64, rng: &mut Pcg64) -> f64 {
    let [low, high] = parameter.plausible;
    if neutral.is_infinite() {
        // From the high end down to the middle of the logarithmic range: what lies below would not hold the arm up.
        return high * (low / high).powf(0.5 * strength);
    }
    let side = if neutral <= low || (neutral < high && rng.random_bool(0.5)) { high } else { low };
    neutral + strength * (side - neutral)
}

/// One number a joint: `number` at the strongest, less at weaker ones where it is a torque.
fn joints(parameter: &Parameter, number: f64, cell: &Cell) -> Vec<toml::Value> {
    let stiffness = cell.controller.as_ref().map_or(&[][..], |controller| &controller.stiffness);
    let strongest = stiffness.iter().copied().fold(0.0, f64::max);
    let share = |k: f64| if parameter.unit.starts_with("N m") { (k / strongest).sqrt() } else { 1.0 };
    stiffness.iter().map(|k| (number * share(*k)).into()).collect()
}

/// A vector as long as `number`, in a random direction.
fn vector(number: f64, length: usize, rng: &mut Pcg64) -> Vec<toml::Value> {
    let direction: Vec<f64> = (0..length).map(|_| rng.random_range(-1.0..1.0)).collect();
    let norm = direction.iter().map(|x: &f64| x * x).sum::<f64>().sqrt().max(1e-3);
    direction.into_iter().map(|x| (number * x / norm).into()).collect()
}
