//! Which states are believed to be the robot's. A datagram can be forged, sender included, and the protocol has nothing
//! against it; but the robot's counter and its joints go on as time does. A state that does not follow from the last one
//! that was believed is passed over, so that a single forged one ends no run, and none is replayed.
//!
//! Where the robot's clock really was somewhere else all the while (this machine slept), its states go on from each other
//! and nothing else comes: after 50 ms of that they are believed. A forger would have to silence the robot for it.
//!
//! Pure; counters in ms.

use std::time::{Duration, Instant};

/// How much farther the counter may have gone than this machine's clock, from one state to the next [ms]. Fewer than the 20
/// commands without which the robot stops.
const AHEAD: u64 = 10;
/// How far joints may get within no time [rad], and in a second [rad/s]: four times as fast as the fastest of an FR3.
const JUMP: f32 = 0.05;
const FASTEST: f32 = 20.0;
/// How long states that follow from each other alone have to go on until they are believed.
const ALONE: Duration = Duration::from_millis(50);
/// A century [ms]: no robot has been on for longer.
const LONGEST: u64 = 100 * 365 * 86_400_000;

/// What has been believed so far, of a device that reports `N` joints.
#[derive(Debug, Clone)]
pub(super) struct Believed<const N: usize> {
    last: Option<State<N>>,
    /// The newest of those that follow from each other but not from `last`, and when the first of them came.
    rival: Option<(State<N>, Instant)>,
}

#[derive(Debug, Clone, Copy)]
struct State<const N: usize> {
    counter: u64,
    q: [f32; N],
    at: Instant,
}

impl<const N: usize> Believed<N> {
    pub(super) fn new() -> Self {
        Self { last: None, rival: None }
    }

    /// Counter of the newest state that was believed; 0 before.
    pub(super) fn counter(&self) -> u64 {
        self.last.map_or(0, |last| last.counter)
    }

    /// Whether the state with this `counter` and these joint positions [rad], which came `at` this moment, is believed and
    /// newer than the last one.
    pub(super) fn take(&mut self, counter: u64, q: [f32; N], at: Instant) -> bool {
        let state = State { counter, q, at };
        if counter == 0 || counter > LONGEST || q.iter().any(|q| !q.is_finite()) {
            return false;
        }
        let Some(last) = self.last else {
            self.last = Some(state);
            return true;
        };
        if state.follows(&last) {
            (self.last, self.rival) = (Some(state), None);
            return true;
        }
        if counter <= last.counter {
            return false;
        }
        let since = self.rival.filter(|(rival, _)| state.follows(rival)).map_or(at, |(_, since)| since);
        let believed = at.duration_since(since) >= ALONE;
        (self.last, self.rival) = if believed { (Some(state), None) } else { (Some(last), Some((state, since))) };
        believed
    }
}

impl<const N: usize> State<N> {
    fn follows(&self, last: &Self) -> bool {
        let Some(steps) = self.counter.checked_sub(last.counter).filter(|steps| *steps > 0) else { return false };
        let passed = u64::try_from(self.at.duration_since(last.at).as_millis()).unwrap_or(u64::MAX);
        let reach = JUMP + FASTEST * 1e-3 * steps as f32;
        steps <= passed.saturating_add(AHEAD) && self.q.iter().zip(&last.q).all(|(q, last)| (q - last).abs() <= reach)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ms(ms: u64) -> Duration {
        Duration::from_millis(ms)
    }

    #[test]
    fn a_robots_states_are_believed_however_they_come_and_forged_ones_between_them_are_not() {
        let (begin, mut believed) = (Instant::now(), Believed::<1>::new());
        assert!(!believed.take(u64::MAX, [0.0], begin) && !believed.take(0, [0.0], begin), "no robot counts so");
        assert!(believed.take(5000, [0.1], begin));
        for k in 1..300 {
            let at = begin + ms(k);
            assert!(!believed.take(u64::MAX, [0.1], at) && !believed.take(1 << 40, [0.1], at), "out of the blue");
            assert!(!believed.take(5000 + k + 2000, [0.1], at), "ahead of its time");
            assert!(!believed.take(5000 + k, [3.0], at), "elsewhere");
            assert!(!believed.take(5000 + k, [f32::NAN], at), "nowhere");
            assert!(!believed.take(4000 + k, [0.1], at), "a replay");
            assert!(believed.take(5000 + k, [0.1 + 0.002 * k as f32], at));
            assert!(!believed.take(5000 + k, [0.1 + 0.002 * k as f32], at), "twice");
        }
        assert_eq!(believed.counter(), 5299);
        let at = begin + ms(900);
        assert!(believed.take(5890, [0.7], at), "a pause of the network");
        assert!((1..500).all(|k| believed.take(5890 + k, [0.7], at)), "a robot whose clock waits for its client");
    }

    #[test]
    fn a_clock_that_is_elsewhere_for_good_is_believed_after_a_while() {
        let (begin, mut believed) = (Instant::now(), Believed::<0>::new());
        assert!(believed.take(5000, [], begin));
        let after_sleep = |k: u64| (3_605_000 + k, begin + ms(k));
        let first = (1..1000).find(|k| {
            let (counter, at) = after_sleep(*k);
            believed.take(counter, [], at)
        });
        assert_eq!(first, Some(51));
        let (counter, at) = after_sleep(52);
        assert!(believed.take(counter, [], at));
    }
}
