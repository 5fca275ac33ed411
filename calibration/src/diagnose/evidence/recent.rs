//! Residuals of a clip where a search has just been: it comes back to the same numbers again and again. A linearisation begins
//! where the step before it was judged, a step is judged against the point that was just linearised, and every trial is held
//! against the same hypothesis.

use inference::estimate::Impossible;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex, PoisonError};

/// Places kept for a clip: a linearisation by as many numbers comes back to its point.
const PLACES: usize = 32;

/// The last places of one clip, the oldest given up first. Two threads that miss the same at the same time both work it out, and
/// find the same.
#[derive(Debug)]
pub(in crate::diagnose) struct Recent<T>(Mutex<VecDeque<Place<T>>>);

/// Numbers, and what was found there.
type Place<T> = (Vec<f64>, Arc<T>);

impl<T> Default for Recent<T> {
    fn default() -> Self {
        Self(Mutex::default())
    }
}

impl<T> Recent<T> {
    /// What is found at `numbers`, worked out unless it is known.
    ///
    /// # Errors
    /// Those of the work.
    pub(in crate::diagnose) fn at(
        &self,
        numbers: &[f64],
        work: impl FnOnce() -> Result<T, Impossible>,
    ) -> Result<Arc<T>, Impossible> {
        let kept = || self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, found)) = kept().iter().find(|(known, _)| known == numbers) {
            return Ok(Arc::clone(found));
        }
        let found = Arc::new(work()?);
        let mut kept = kept();
        kept.truncate(PLACES - 1);
        kept.push_front((numbers.to_vec(), Arc::clone(&found)));
        Ok(found)
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
            recent.at(&[number], square).ok().map(|square| *square)
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
