//! The sender's side of a topic whose messages all count: they are numbered and kept for a while, so that what a cut cable
//! swallowed is sent again when the other host asks for it.

use std::collections::VecDeque;

/// Most messages that are kept: half a minute at 1 kHz.
pub const MOST_MESSAGES: usize = 32_768;
/// Most bytes that are kept.
pub const MOST_BYTES: usize = 64 << 20;

/// Messages by number, from the oldest kept to the newest, and which is to be sent next.
#[derive(Debug)]
pub struct History<T> {
    kept: VecDeque<Kept<T>>,
    /// Number of the first that is kept.
    oldest: u64,
    bytes: usize,
    next: u64,
    most_messages: usize,
    most_bytes: usize,
}

#[derive(Debug)]
struct Kept<T> {
    taken_ns: u64,
    length: usize,
    message: T,
}

/// A message that is due.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Due<T> {
    /// Its number.
    pub number: u64,
    /// Lowest number that is still kept.
    pub oldest: u64,
    /// When it was taken out of shared memory [ns].
    pub taken_ns: u64,
    /// The message.
    pub message: T,
}

impl<T: Clone> History<T> {
    /// Nothing kept yet, at most so many messages and bytes.
    pub fn new(most_messages: usize, most_bytes: usize) -> Self {
        let most_messages = most_messages.max(1);
        Self { kept: VecDeque::new(), oldest: 0, bytes: 0, next: 0, most_messages, most_bytes }
    }

    /// Adds a message of `length` bytes that was taken out of shared memory then [ns].
    pub fn push(&mut self, taken_ns: u64, length: usize, message: T) {
        self.kept.push_back(Kept { taken_ns, length, message });
        self.bytes += length;
        while self.kept.len() > self.most_messages || (self.bytes > self.most_bytes && self.kept.len() > 1) {
            if let Some(gone) = self.kept.pop_front() {
                self.bytes -= gone.length;
                self.oldest += 1;
            }
        }
        self.next = self.next.max(self.oldest);
    }

    /// The next message to send, which counts as sent with this.
    pub fn due(&mut self) -> Option<Due<T>> {
        let at = usize::try_from(self.next - self.oldest).ok()?;
        let kept = self.kept.get(at)?;
        let due =
            Due { number: self.next, oldest: self.oldest, taken_ns: kept.taken_ns, message: kept.message.clone() };
        self.next += 1;
        Some(due)
    }

    /// From here on is sent again, as far as it is kept. What was not sent yet stays due.
    pub fn again_from(&mut self, number: u64) {
        self.next = self.next.min(number.max(self.oldest));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn numbers(history: &mut History<&'static str>) -> Vec<u64> {
        std::iter::from_fn(|| history.due()).map(|due| due.number).collect()
    }

    #[test]
    fn messages_are_sent_once_in_order_and_again_when_asked_for() {
        let mut history = History::new(10, 1000);
        for taken_ns in 0..4 {
            history.push(taken_ns, 10, "m");
        }
        let first = history.due();
        assert_eq!(first, Some(Due { number: 0, oldest: 0, taken_ns: 0, message: "m" }));
        assert_eq!(numbers(&mut history), [1, 2, 3]);
        history.again_from(2);
        history.push(4, 10, "m");
        assert_eq!(numbers(&mut history), [2, 3, 4]);
        // Nobody jumps ahead by asking.
        history.again_from(100);
        history.push(5, 10, "m");
        assert_eq!(numbers(&mut history), [5]);
    }

    #[test]
    fn what_is_too_much_goes_oldest_first_and_the_next_says_so() {
        let mut history = History::new(3, 1000);
        for taken_ns in 0..10 {
            history.push(taken_ns, 1, "m");
        }
        assert_eq!(history.due().map(|due| (due.number, due.oldest)), Some((7, 7)));
        history.again_from(0);
        assert_eq!(numbers(&mut history), [7, 8, 9]);
        let mut heavy = History::new(100, 25);
        for taken_ns in 0..5 {
            heavy.push(taken_ns, 10, "m");
        }
        assert_eq!(numbers(&mut heavy), [3, 4]);
    }
}
