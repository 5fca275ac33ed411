//! Roll-outs that were asked for a moment ago. What an engine does not know of effects is no part of what it is asked, so a search
//! along such an effect asks for the same again and again.

use std::collections::VecDeque;
use std::hash::{DefaultHasher, Hash as _, Hasher as _};
use std::sync::Arc;

/// So many numbers are kept at most (a choice): 128 MiB.
const MAX_KEPT_NUMBERS: usize = 1 << 24;

/// The last roll-outs, the oldest given up first.
#[derive(Debug, Default)]
pub(super) struct Recent {
    kept: VecDeque<(u64, Arc<Vec<f64>>)>,
    numbers: usize,
}

impl Recent {
    /// What a message asks for, as one number.
    pub(super) fn key(message: &[u8]) -> u64 {
        let mut hasher = DefaultHasher::new();
        message.hash(&mut hasher);
        hasher.finish()
    }

    pub(super) fn get(&self, key: u64) -> Option<Arc<Vec<f64>>> {
        self.kept.iter().find(|(known, _)| *known == key).map(|(_, states)| Arc::clone(states))
    }

    pub(super) fn keep(&mut self, key: u64, states: &Arc<Vec<f64>>) {
        self.numbers += states.len();
        self.kept.push_front((key, Arc::clone(states)));
        // An answer that alone is more than all room goes at once.
        while self.numbers > MAX_KEPT_NUMBERS {
            let Some((_, given_up)) = self.kept.pop_back() else { return };
            self.numbers -= given_up.len();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_oldest_are_given_up_where_room_ends() {
        let mut recent = Recent::default();
        let third = Arc::new(vec![0.0; MAX_KEPT_NUMBERS / 3]);
        (0..4).for_each(|key| recent.keep(key, &third));
        assert!(recent.get(0).is_none());
        assert!((1..4).all(|key| recent.get(key).is_some()));
    }
}
