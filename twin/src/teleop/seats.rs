//! Which of the open pages steers: the one that came first. Others watch, and the next of them steers when it goes.

use std::sync::{Mutex, MutexGuard, PoisonError};

/// The open pages, in the order in which they came.
#[derive(Debug, Default)]
pub(super) struct Seats(Mutex<Pages>);

#[derive(Debug, Default)]
struct Pages {
    last: u64,
    open: Vec<u64>,
}

impl Seats {
    fn pages(&self) -> MutexGuard<'_, Pages> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A seat for a page that was opened; none where there are too many.
    pub(super) fn take(&self, most: usize) -> Option<u64> {
        let mut pages = self.pages();
        if pages.open.len() >= most {
            return None;
        }
        pages.last += 1;
        let seat = pages.last;
        pages.open.push(seat);
        Some(seat)
    }

    /// The page was closed; whether it was the one that steered.
    pub(super) fn leave(&self, seat: u64) -> bool {
        let mut pages = self.pages();
        let steered = pages.open.first() == Some(&seat);
        pages.open.retain(|other| *other != seat);
        steered
    }

    /// Whether this page steers.
    pub(super) fn steers(&self, seat: u64) -> bool {
        self.pages().open.first() == Some(&seat)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_steers_and_the_next_follows_it() {
        let seats = Seats::default();
        let [first, second] = [(); 2].map(|()| seats.take(2).expect("a seat"));
        assert_eq!(seats.take(2), None);
        assert!(seats.steers(first) && !seats.steers(second));
        assert!(seats.leave(first) && seats.steers(second));
        assert!(seats.take(2).is_some_and(|third| !seats.steers(third)));
    }
}
