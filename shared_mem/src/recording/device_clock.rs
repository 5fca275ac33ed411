//! Puts an own clip onto the robot's clock. A state's host stamp jitters by whatever the network and the scheduler add,
//! which a moving joint turns into an error of position; the robot's own counter does not.

/// What is needed to move host stamps onto the robot's clock.
#[derive(Debug, Default)]
pub(super) struct DeviceClock {
    /// Host stamp of each state [ns].
    host_ns: Vec<u64>,
    /// The same moments by the robot's clock, counted from the first host stamp [ns].
    device_ns: Vec<u64>,
}

impl DeviceClock {
    /// From the two stamps of every state. A robot whose clock does not advance from state to state has none that could
    /// be used: host stamps stay as they are then.
    pub(super) fn new(host_ns: &[u64], device_ns: &[u64]) -> Self {
        let (Some(first_host), Some(first)) = (host_ns.first(), device_ns.first()) else { return Self::default() };
        if !device_ns.is_sorted_by(|a, b| a < b) || !host_ns.is_sorted() {
            return Self::default();
        }
        let device_ns = device_ns.iter().map(|stamp| stamp - first + first_host).collect();
        Self { host_ns: host_ns.to_vec(), device_ns }
    }

    /// Stamps of the states by the robot's clock; `None` when it has none.
    pub(super) fn stamps(&self) -> Option<&[u64]> {
        (!self.device_ns.is_empty()).then_some(&self.device_ns)
    }

    /// A host stamp by the robot's clock: as far behind the state before it, but not beyond the next one.
    pub(super) fn map(&self, stamp_ns: u64) -> u64 {
        let next = self.host_ns.partition_point(|host| *host <= stamp_ns);
        let bound = self.device_ns.get(next).copied().unwrap_or(u64::MAX);
        let before = next.checked_sub(1).and_then(|i| Some((*self.host_ns.get(i)?, *self.device_ns.get(i)?)));
        before.map_or(stamp_ns, |(host, device)| (device + (stamp_ns - host)).min(bound))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn jitter_of_the_host_is_taken_out_and_other_stamps_follow() {
        let clock = DeviceClock::new(&[1000, 1900, 3300], &[50, 1050, 2050]);
        assert_eq!(clock.stamps(), Some(&[1000, 2000, 3000][..]));
        assert_eq!(
            [900, 1000, 1500, 1900, 2500, 3300, 3400].map(|stamp| clock.map(stamp)),
            [900, 1000, 1500, 2000, 2600, 3000, 3100]
        );
        assert_eq!(clock.map(3250), 3000, "never beyond the next state");
    }

    #[test]
    fn a_robot_without_a_clock_leaves_the_stamps_alone() {
        for device in [&[0, 0, 0][..], &[5, 4, 6], &[]] {
            let clock = DeviceClock::new(&[1000, 1900, 3300], device);
            assert_eq!((clock.stamps(), clock.map(1234)), (None, 1234), "{device:?}");
        }
    }
}
