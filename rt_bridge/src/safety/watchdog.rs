//! How long silence is borne before the run is given up.

/// Longest silence of an arm [ns]. A second is what the robot's own client library waits.
pub const LONGEST_SILENCE_NS: u64 = 1_000_000_000;

/// Measures the time since the last state.
#[derive(Debug, Clone, Copy)]
pub struct Watchdog {
    last_ns: u64,
    longest_ns: u64,
}

impl Watchdog {
    /// Starts to watch at `now_ns`; bears `longest_ns` of silence.
    pub fn new(now_ns: u64, longest_ns: u64) -> Self {
        Self { last_ns: now_ns, longest_ns }
    }

    /// A state came.
    pub fn feed(&mut self, now_ns: u64) {
        self.last_ns = now_ns;
    }

    /// The silence so far [ms], when it is longer than what is borne.
    pub fn expired(&self, now_ns: u64) -> Option<u32> {
        let silence = now_ns.saturating_sub(self.last_ns);
        (silence > self.longest_ns).then(|| u32::try_from(silence / 1_000_000).unwrap_or(u32::MAX))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn silence_is_borne_up_to_its_limit_and_a_state_starts_anew() {
        let mut dog = Watchdog::new(0, 1000);
        assert_eq!(dog.expired(1000), None);
        assert_eq!(dog.expired(3_001_000), Some(3));
        dog.feed(3_001_000);
        assert_eq!(dog.expired(3_002_000), None);
    }
}
