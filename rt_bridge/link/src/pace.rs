//! How fast a backlog is published. Readers of shared memory keep two seconds of a stream, 2048 messages, and are not to lose what
//! a mended line brings all at once.

use std::time::Duration;

/// Messages that may be published in a millisecond over a longer time.
const PER_MS: u64 = 8;
/// Messages that may be published at once: a quarter of what a reader keeps.
const AT_ONCE: u64 = 512;
const MS: u64 = 1_000_000;

/// A budget of messages that fills up by time, so that a sleep that takes longer than asked slows nothing down.
#[derive(Debug)]
pub struct Pace {
    left: u64,
    filled_ns: u64,
}

impl Pace {
    /// Full, as of now [ns].
    pub fn new(now_ns: u64) -> Self {
        Self { left: AT_ONCE, filled_ns: now_ns }
    }

    /// Takes one message from the budget; how long to sleep before it is published, where nothing was left.
    pub fn take(&mut self, now_ns: u64) -> Option<Duration> {
        let ms = now_ns.saturating_sub(self.filled_ns) / MS;
        self.left = self.left.saturating_add(ms.saturating_mul(PER_MS)).min(AT_ONCE);
        self.filled_ns += ms * MS;
        let is_empty = self.left == 0;
        self.left = self.left.saturating_sub(1);
        is_empty.then_some(Duration::from_nanos(MS))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_stream_at_its_own_pace_never_sleeps_and_a_backlog_goes_at_eight_a_millisecond() {
        let mut pace = Pace::new(0);
        assert!((0..5000).all(|ms| pace.take(ms * MS).is_none()));
        let (mut now_ns, mut published) = (5000 * MS, 0);
        while now_ns < 6000 * MS {
            // Sleeps take five times as long as they are asked for.
            now_ns += pace.take(now_ns).map_or(1_000, |sleep| 5 * sleep.as_nanos() as u64);
            published += 1;
        }
        assert!((8_000..=9_000).contains(&published), "{published}");
    }
}
