//! What waits for a thread. A queue that is full drops its oldest and counts it: nobody waits for a slow reader.

use std::collections::VecDeque;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// A queue between threads.
#[derive(Debug)]
pub struct Queue<T> {
    inner: Mutex<Inner<T>>,
    filled: Condvar,
    most: usize,
}

#[derive(Debug)]
struct Inner<T> {
    waiting: VecDeque<T>,
    dropped: u64,
}

impl<T> Queue<T> {
    /// For at most so many.
    pub fn new(most: usize) -> Self {
        Self {
            inner: Mutex::new(Inner { waiting: VecDeque::new(), dropped: 0 }),
            filled: Condvar::new(),
            most: most.max(1),
        }
    }

    /// Puts one at the end; where the queue is full, its oldest is dropped.
    pub fn push(&self, item: T) {
        let mut inner = self.inner();
        if inner.waiting.len() >= self.most {
            inner.waiting.pop_front();
            inner.dropped += 1;
        }
        inner.waiting.push_back(item);
        drop(inner);
        self.filled.notify_one();
    }

    /// The oldest; `None` when none came within `patience`.
    pub fn pop(&self, patience: Duration) -> Option<T> {
        let inner = self.inner();
        let waited = self.filled.wait_timeout_while(inner, patience, |inner| inner.waiting.is_empty());
        let (mut inner, _) = waited.unwrap_or_else(PoisonError::into_inner);
        inner.waiting.pop_front()
    }

    /// How many were dropped so far.
    pub fn dropped(&self) -> u64 {
        self.inner().dropped
    }

    fn inner(&self) -> MutexGuard<'_, Inner<T>> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    #[test]
    fn a_full_queue_drops_its_oldest_and_counts_it() {
        let queue = Queue::new(2);
        (0..5).for_each(|i| queue.push(i));
        assert_eq!(queue.dropped(), 3);
        assert_eq!([queue.pop(Duration::ZERO), queue.pop(Duration::ZERO)], [Some(3), Some(4)]);
        assert_eq!(queue.pop(Duration::from_millis(1)), None);
    }

    #[test]
    fn who_waits_is_woken() {
        let queue = Arc::new(Queue::new(4));
        let waiting = Arc::clone(&queue);
        let thread = std::thread::spawn(move || waiting.pop(Duration::from_secs(20)));
        queue.push("here");
        assert_eq!(thread.join().ok().flatten(), Some("here"));
    }
}
