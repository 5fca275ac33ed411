//! What acts in the simulated cell hidden from everybody outside of it: parameters and effects from files.

use anyhow::Result;
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use std::path::Path;
use twin::effects::{Place, find};

/// Those of both files together, about the cell's object; `None` where neither is given.
///
/// # Errors
/// A file that cannot be read or is no theta.toml.
pub(crate) fn read(cell: &Cell, parameters: Option<&Path>, effects: Option<&Path>) -> Result<Option<Theta>> {
    let mut theta = parameters.map(Theta::read).transpose()?.map(|theta| theta.about(cell));
    if let Some(path) = effects {
        let effects = Theta::read(path)?.effects;
        theta.get_or_insert_default().effects.extend(effects);
    }
    Ok(theta)
}

/// Effects on the way of a command to the arm's own controller: whoever computes the torque himself does not meet them.
pub(crate) fn on_the_way(hidden: &Theta) -> impl Iterator<Item = &str> {
    let on_the_way = |name: &&str| find(name).is_some_and(|effect| effect.acts_on == Place::CommandPath);
    hidden.effects.iter().map(|effect| effect.name.as_str()).filter(on_the_way)
}
