//! Which of the open pages steers: the one that came first. Others watch, and the next of them steers when it goes.

use super::orders::Orders;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// The open pages, in the order in which they came.
#[derive(Debug)]
pub(super) struct Seats {
    orders: Arc<Orders>,
    pages: Mutex<Pages>,
}

#[derive(Debug, Default)]
struct Pages {
    last: u64,
    open: Vec<u64>,
}

/// The seat of a page, from its request on. Dropped, it is free again, however the page came to its end: by a connection that
/// failed before it was one, too.
#[derive(Debug)]
pub(super) struct Seat {
    seats: Arc<Seats>,
    number: u64,
}

impl Seats {
    /// None is taken; `orders` hears when the page that steers goes.
    pub(super) fn new(orders: Arc<Orders>) -> Arc<Self> {
        Arc::new(Self { orders, pages: Mutex::default() })
    }

    fn pages(&self) -> MutexGuard<'_, Pages> {
        self.pages.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// A seat for a page that was opened; none where there are too many.
    pub(super) fn take(self: &Arc<Self>, most: usize) -> Option<Seat> {
        let mut pages = self.pages();
        if pages.open.len() >= most {
            return None;
        }
        pages.last += 1;
        let number = pages.last;
        pages.open.push(number);
        drop(pages);
        Some(Seat { seats: Arc::clone(self), number })
    }
}

impl Seat {
    /// Whether this page steers.
    pub(super) fn steers(&self) -> bool {
        self.seats.pages().open.first() == Some(&self.number)
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        let mut pages = self.seats.pages();
        let steered = pages.open.first() == Some(&self.number);
        pages.open.retain(|other| *other != self.number);
        if steered {
            // While the pages are held: the next one asks for nothing before that.
            self.seats.orders.gone();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::teleop::orders::{Awaited, Order};
    use std::time::Instant;

    #[test]
    fn the_first_steers_and_the_next_follows_it() {
        let orders = Arc::new(Orders::default());
        let seats = Seats::new(Arc::clone(&orders));
        let [first, second] = [(); 2].map(|()| seats.take(2).expect("a seat"));
        assert!(seats.take(2).is_none());
        assert!(first.steers() && !second.steers());
        drop(first);
        assert_eq!(orders.next(Instant::now(), Awaited::Halts), Some(Order::Gone));
        assert!(second.steers());
        let third = seats.take(2).expect("a seat that is free again");
        assert!(!third.steers());
        drop(third);
        assert_eq!(orders.next(Instant::now(), Awaited::Halts), None, "who watches is not missed");
    }
}
