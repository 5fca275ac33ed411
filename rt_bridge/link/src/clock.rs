//! How far the monotonic clocks of two hosts are apart. Each counts from its own start, so they differ by any amount; round
//! trips bound it.
//!
//! A question leaves at `asked`, reaches the other host at `reached`, its answer leaves at `answered` and is back at `back`.
//! Nothing arrives before it leaves: `reached - asked >= offset` and `back - answered >= -offset`. The middle of that interval
//! is the estimate and half its width, half of the time on the way, its bound (D. L. Mills, RFC 5905, section 8). It holds
//! whatever the two ways share of the delay. The shortest of the last round trips bounds best; two quartz clocks of 50 ppm
//! drift apart by 100 us a second at most, which widens the bound with the age of the trip.

use std::collections::VecDeque;

/// Round trips that are remembered: some twelve seconds of them.
const REMEMBERED: usize = 64;
/// How fast two clocks drift apart at most: 50 ppm each.
const DRIFT: f64 = 100e-6;

/// The four moments of a question and its answer [ns].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RoundTrip {
    /// The question left: this host's clock.
    pub asked_ns: u64,
    /// It reached the other host: that host's clock.
    pub reached_ns: u64,
    /// The answer left: that host's clock.
    pub answered_ns: u64,
    /// It was back: this host's clock.
    pub back_ns: u64,
}

/// The other host's clock minus this one's, and by how much that may be wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Offset {
    /// Other minus own [ns].
    pub ns: i64,
    /// Bound of the error [ns].
    pub uncertainty_ns: u64,
}

impl Offset {
    /// A stamp of the other host in this host's clock [ns].
    pub fn here(self, stamp_ns: u64) -> u64 {
        stamp_ns.saturating_add_signed(self.ns.saturating_neg())
    }
}

/// The estimate.
#[derive(Debug, Default)]
pub struct ClockEstimate {
    trips: VecDeque<(Offset, u64)>,
    round_trips: u64,
}

impl ClockEstimate {
    /// Takes a round trip into account and returns its time on the way [ns]; `None`, and no account, where its moments
    /// contradict each other.
    pub fn add(&mut self, trip: &RoundTrip) -> Option<u64> {
        let away = trip.back_ns.checked_sub(trip.asked_ns)?;
        let there = trip.answered_ns.checked_sub(trip.reached_ns)?;
        let on_the_way = away.checked_sub(there)?;
        let difference = |a: u64, b: u64| i128::from(a) - i128::from(b);
        let twice = difference(trip.reached_ns, trip.asked_ns) + difference(trip.answered_ns, trip.back_ns);
        let ns = i64::try_from(twice / 2).ok()?;
        let new = Offset { ns, uncertainty_ns: on_the_way.div_ceil(2) + 1 };
        if self.at(trip.back_ns).is_some_and(|known| !agree(known, new)) {
            // The other host was started anew, or is another one.
            self.trips.clear();
        }
        self.trips.push_back((new, trip.back_ns));
        if self.trips.len() > REMEMBERED {
            self.trips.pop_front();
        }
        self.round_trips += 1;
        Some(on_the_way)
    }

    /// The offset as of `now_ns` of this host's clock; `None` before the first round trip.
    pub fn at(&self, now_ns: u64) -> Option<Offset> {
        let widened = self.trips.iter().map(|(offset, at_ns)| {
            let drift = now_ns.saturating_sub(*at_ns) as f64 * DRIFT;
            Offset { uncertainty_ns: offset.uncertainty_ns.saturating_add(drift as u64), ..*offset }
        });
        widened.min_by_key(|offset| offset.uncertainty_ns)
    }

    /// Round trips so far.
    pub fn round_trips(&self) -> u64 {
        self.round_trips
    }
}

/// Whether two bounds have a value in common.
fn agree(a: Offset, b: Offset) -> bool {
    a.ns.abs_diff(b.ns) <= a.uncertainty_ns.saturating_add(b.uncertainty_ns)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::time::TICK_NS;

    /// A trip to a host whose clock is `offset` ahead and drifts, with these delays there and back.
    fn trip(asked_ns: u64, offset: i64, [there, back]: [u64; 2]) -> RoundTrip {
        let other = |ns: u64| ns.saturating_add_signed(offset);
        let [reached, answered] = [asked_ns + there, asked_ns + there + 5_000];
        RoundTrip { asked_ns, reached_ns: other(reached), answered_ns: other(answered), back_ns: answered + back }
    }

    #[test]
    fn the_bound_holds_for_any_delays_and_a_short_trip_makes_it_tight() {
        let offset = -7_000_000_000_123_i64;
        let (mut clock, mut chance) = (ClockEstimate::default(), 1_u64);
        for i in 0..200_u64 {
            let mut delay = || {
                chance = chance.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                60_000 + (chance >> 44)
            };
            let trip = trip(10_000_000_000_000 + i * 200 * TICK_NS, offset, [delay(), 3 * delay()]);
            let on_the_way = clock.add(&trip).expect("possible");
            let estimate = clock.at(trip.back_ns).expect("an estimate");
            assert!(estimate.ns.abs_diff(offset) <= estimate.uncertainty_ns, "{estimate:?}");
            assert!(estimate.uncertainty_ns <= on_the_way / 2 + 2);
        }
        let last = clock.at(10_040_000_000_000).expect("an estimate");
        assert!(last.uncertainty_ns < 2_000_000, "{last:?}");
        assert_eq!(clock.round_trips(), 200);
    }

    #[test]
    fn a_long_silence_widens_the_bound_by_what_quartz_drifts() {
        let mut clock = ClockEstimate::default();
        assert_eq!(clock.at(1), None);
        clock.add(&trip(1_000_000_000, 0, [50_000, 50_000]));
        let soon = clock.at(1_000_110_000).expect("an estimate").uncertainty_ns;
        let late = clock.at(11_000_110_000).expect("an estimate").uncertainty_ns;
        assert!((50_000..50_100).contains(&soon), "{soon}");
        assert!((1_040_000..1_060_000).contains(&late), "{late}");
    }

    #[test]
    fn another_clock_is_noticed_and_nonsense_is_left_out() {
        let mut clock = ClockEstimate::default();
        clock.add(&trip(1_000_000_000, 500, [50_000, 50_000]));
        clock.add(&trip(2_000_000_000, 9_000_000_000, [50_000, 50_000]));
        assert_eq!(clock.at(2_000_110_000).map(|o| o.ns), Some(9_000_000_000));
        let backwards = RoundTrip { asked_ns: 10, reached_ns: 20, answered_ns: 15, back_ns: 30 };
        let too_long_there = RoundTrip { asked_ns: 10, reached_ns: 0, answered_ns: 100, back_ns: 30 };
        assert_eq!([clock.add(&backwards), clock.add(&too_long_there)], [None, None]);
    }

    #[test]
    fn a_stamp_is_moved_into_this_hosts_clock() {
        assert_eq!(Offset { ns: 5, uncertainty_ns: 1 }.here(12), 7);
        assert_eq!(Offset { ns: -5, uncertainty_ns: 1 }.here(12), 17);
        assert_eq!(Offset { ns: 50, uncertainty_ns: 1 }.here(12), 0);
    }
}
