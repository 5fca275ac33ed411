//! What pages ask of the thread that steers: no more of it waits than a picture takes in, and a stop waits behind nothing.

use super::message::Input;
use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

/// Most inputs that wait. A page on which everything is held down sends some thirty a second.
pub(super) const MAX_WAITING: usize = 64;

/// What the thread that steers is to do.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Order {
    /// Hold until an episode is started; `id` as in [`Input`], 0 where it came from a page that watches.
    Stop { id: u64 },
    /// The page that steered is gone.
    Gone,
    /// What the page that steers asks for.
    Input(Input),
}

/// Which orders are waited for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Awaited {
    Any,
    /// What has the arm hold: inputs go on waiting.
    Halts,
}

/// The orders that wait.
#[derive(Debug, Default)]
pub(super) struct Orders {
    waiting: Mutex<Waiting>,
    came: Condvar,
}

#[derive(Debug, Default)]
struct Waiting {
    stop: Option<u64>,
    gone: bool,
    inputs: VecDeque<Input>,
}

impl Waiting {
    fn first(&mut self, awaited: Awaited) -> Option<Order> {
        if let Some(id) = self.stop.take() {
            return Some(Order::Stop { id });
        }
        if std::mem::take(&mut self.gone) {
            return Some(Order::Gone);
        }
        if awaited == Awaited::Halts { None } else { self.inputs.pop_front().map(Order::Input) }
    }
}

impl Orders {
    fn waiting(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Leaves an input; `false` where as many wait as may, and it is left out.
    pub(super) fn ask(&self, input: Input) -> bool {
        let mut waiting = self.waiting();
        if waiting.inputs.len() >= MAX_WAITING {
            return false;
        }
        waiting.inputs.push_back(input);
        self.came.notify_one();
        true
    }

    /// Asks for a stop. What was asked for before counts no more.
    pub(super) fn stop(&self, id: u64) {
        let mut waiting = self.waiting();
        waiting.inputs.clear();
        waiting.stop = Some(id.max(waiting.stop.unwrap_or(0)));
        self.came.notify_one();
    }

    /// The page that steered is gone, and with it what it asked for; a stop stays.
    pub(super) fn gone(&self) {
        let mut waiting = self.waiting();
        waiting.inputs.clear();
        waiting.gone = true;
        self.came.notify_one();
    }

    /// The next order; where none is there, one that comes until then. Also what is there when that is over.
    pub(super) fn next(&self, until: Instant, awaited: Awaited) -> Option<Order> {
        let mut waiting = self.waiting();
        loop {
            if let Some(order) = waiting.first(awaited) {
                return Some(order);
            }
            let left = until.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return None;
            }
            waiting = self.came.wait_timeout(waiting, left).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(id: u64) -> Input {
        Input::read(&format!("{{\"id\": {id}}}")).expect("a message")
    }

    #[test]
    fn a_stop_goes_before_all_that_waits_and_voids_it() {
        let (orders, now) = (Orders::default(), Instant::now());
        assert!((0..MAX_WAITING as u64).all(|id| orders.ask(input(id))));
        assert!(!orders.ask(input(99)), "no more wait than may");
        assert_eq!(orders.next(now, Awaited::Halts), None);
        assert_eq!(orders.next(now, Awaited::Any), Some(Order::Input(input(0))));
        orders.stop(7);
        orders.stop(3);
        assert!(orders.ask(input(100)), "what comes after it counts");
        assert_eq!(orders.next(now, Awaited::Halts), Some(Order::Stop { id: 7 }));
        assert_eq!(orders.next(now, Awaited::Any), Some(Order::Input(input(100))));
        assert_eq!(orders.next(now, Awaited::Any), None);
    }

    #[test]
    fn a_page_that_goes_takes_what_it_asked_for_along_but_no_stop() {
        let (orders, now) = (Orders::default(), Instant::now());
        orders.ask(input(1));
        orders.stop(0);
        orders.ask(input(2));
        orders.gone();
        let left: Vec<Order> = std::iter::from_fn(|| orders.next(now, Awaited::Any)).collect();
        assert_eq!(left, [Order::Stop { id: 0 }, Order::Gone]);
    }

    #[test]
    fn who_waits_is_woken_by_what_comes() {
        let orders = Orders::default();
        std::thread::scope(|scope| {
            let waits = scope.spawn(|| {
                let late = Instant::now() + std::time::Duration::from_secs(60);
                orders.next(late, Awaited::Halts)
            });
            orders.ask(input(1));
            orders.stop(0);
            assert_eq!(waits.join().expect("it ends"), Some(Order::Stop { id: 0 }));
        });
    }
}
