//! What was simulated where a search has just been: it comes back to the same numbers again and again. A linearisation begins where the
//! step before it was judged, a step is judged against the point that was just linearised, and every trial is held against the same
//! hypothesis.

use crate::estimate::Impossible;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Places kept where nothing else is said: a linearisation by as many numbers comes back to its point [1].
const PLACES: usize = 32;

/// The last places, the oldest given up first. Two threads that miss the same at the same time both work it out, and find the same.
#[derive(Debug)]
pub struct Recent<K, T> {
    most: usize,
    /// Keys, and what was found there.
    kept: Mutex<VecDeque<(K, Arc<T>)>>,
}

impl<K, T> Default for Recent<K, T> {
    fn default() -> Self {
        Self::of(PLACES)
    }
}

impl<K: PartialEq, T> Recent<K, T> {
    /// What is found at a key, worked out unless it is known.
    ///
    /// # Errors
    /// Those of the work.
    pub fn at(&self, key: K, work: impl FnOnce() -> Result<T, Impossible>) -> Result<Arc<T>, Impossible> {
        let kept = || self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = kept().iter().find(|(known, _)| *known == key) {
            return Ok(Arc::clone(found));
        }
        let found = Arc::new(work()?);
        let mut kept = kept();
        kept.truncate(self.most - 1);
        kept.push_front((key, Arc::clone(&found)));
        Ok(found)
    }
}

impl<K, T> Recent<K, T> {
    /// At most so many places.
    pub fn of(most: usize) -> Self {
        Self { most, kept: Mutex::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::cell::Cell;

    #[test]
    fn a_place_is_worked_out_once_until_many_others_were_and_a_failure_is_no_place() {
        let (recent, worked) = (Recent::default(), Cell::new(0));
        let at = |number: f64| {
            let square = || {
                worked.set(worked.get() + 1);
                if number < 0.0 { Err(Impossible("below zero".into())) } else { Ok(number * number) }
            };
            recent.at(number, square).ok().map(|square| *square)
        };
        assert_eq!((at(3.0), at(3.0), worked.get()), (Some(9.0), Some(9.0), 1));
        assert!(at(-1.0).is_none() && at(-1.0).is_none() && worked.get() == 3);
        for number in 0..PLACES {
            assert!(at(100.0 + number as f64).is_some());
        }
        let before = worked.get();
        assert_eq!((at(3.0), worked.get()), (Some(9.0), before + 1), "given up");
    }
}
