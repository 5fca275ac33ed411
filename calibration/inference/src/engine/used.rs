//! What an answer says about the engine that its roll-outs came from.

use super::ability::{Ability, is_simulated};
use serde::Serialize;
use twin::effects::registry;

/// An engine, and what it was used for.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Used {
    /// Its name and version.
    pub name: String,
    pub command: String,
    /// Whether it simulated an object, too.
    pub object: bool,
    /// Effects that it simulates itself.
    pub simulates: Vec<String>,
    /// Effects of which it does not know all parameters: what the twin makes of the rest was added to its states.
    pub added: Vec<String>,
    /// Roll-outs that it was asked for.
    pub rollouts: usize,
    /// How often it ended in the middle of one and was started again.
    pub started_again: usize,
}

impl Used {
    /// An engine that was asked for an arm, or for an object too.
    pub(super) fn of(ability: &Ability, object: bool) -> Self {
        let all = || registry().iter().filter(|effect| is_simulated(effect, object)).map(|effect| effect.name);
        let added = all().filter(|name| !ability.knows(name)).map(str::to_owned).collect();
        let simulates = ability.effects().filter(|name| all().any(|other| other == *name)).map(str::to_owned).collect();
        Self { name: ability.name.clone(), object, simulates, added, ..Self::default() }
    }

    /// The same for a person, a sentence each.
    pub fn sentences(&self) -> Vec<String> {
        let list = |names: &[String]| if names.is_empty() { "none".to_owned() } else { names.join(", ") };
        let mut all = vec![format!(
            "{} simulated by {}, so what is said of the twin is said of it; effects that it simulates itself: {}; of \
             others the twin's own difference was added to its states: {}",
            if self.object { "arm and object were" } else { "the arm was" },
            self.name,
            list(&self.simulates),
            list(&self.added)
        )];
        if self.started_again > 0 {
            all.push(format!(
                "{} ended in the middle of a roll-out and was started again, {} times: see what it says when it is started by hand",
                self.name, self.started_again
            ));
        }
        all
    }
}
