//! Who is on the other side: clocks of the hosts that answer, and when one was there last.

use crate::ages::Ages;
use crate::clock::{ClockEstimate, Offset, RoundTrip};
use crate::report::Clock;
use shared_mem::time::now_ns;
use std::collections::HashMap;

/// Without an answer for so long nobody is there [ns].
const GONE_NS: u64 = 1_000_000_000;
/// Hosts whose clocks are remembered.
const MOST_HOSTS: usize = 16;

/// The other hosts, by the ids of their links.
#[derive(Debug, Default)]
pub(super) struct Hosts {
    clocks: HashMap<u64, ClockEstimate>,
    /// The one that answered last.
    last: Option<u64>,
    round_trips: Ages,
    answered_ns: Option<u64>,
    pub(super) outages: u64,
    /// How often it came back.
    pub(super) returns: u64,
    pub(super) longest_ns: u64,
    is_gone: bool,
}

impl Hosts {
    /// The clock of one host, as of now.
    pub(super) fn offset(&self, id: u64, now_ns: u64) -> Option<Offset> {
        self.clocks.get(&id)?.at(now_ns)
    }

    /// The clock of the host that answered last.
    pub(super) fn clock(&self) -> Option<Clock> {
        let estimate = self.clocks.get(&self.last?)?;
        let Offset { ns, uncertainty_ns } = estimate.at(now_ns())?;
        Some(Clock {
            offset: ns as f64 * 1e-9,
            uncertainty: uncertainty_ns as f64 * 1e-9,
            round_trips: estimate.round_trips(),
            round_trip_us: self.round_trips.percentiles(),
        })
    }

    /// Whether anybody was ever there.
    pub(super) fn were_met(&self) -> bool {
        self.answered_ns.is_some()
    }

    /// Counts an answer. Returns how long nobody was there before it [ns]; 0: the first of all.
    pub(super) fn answered(&mut self, id: u64, trip: &RoundTrip) -> Option<u64> {
        if self.clocks.len() >= MOST_HOSTS && !self.clocks.contains_key(&id) {
            self.clocks.clear();
        }
        let on_the_way = self.clocks.entry(id).or_default().add(trip)?;
        self.round_trips.record(on_the_way);
        self.last = Some(id);
        let before = self.answered_ns.replace(trip.back_ns);
        match before {
            None => Some(0),
            Some(before) if self.is_gone => {
                self.is_gone = false;
                self.returns += 1;
                let away = trip.back_ns.saturating_sub(before);
                self.longest_ns = self.longest_ns.max(away);
                Some(away)
            }
            Some(_) => None,
        }
    }

    /// Whether the other host has just become one that is gone.
    pub(super) fn has_gone(&mut self, now_ns: u64) -> bool {
        let silent = self.answered_ns.is_some_and(|at| now_ns.saturating_sub(at) > GONE_NS);
        let is_news = silent && !self.is_gone;
        if is_news {
            self.is_gone = true;
            self.outages += 1;
        }
        is_news
    }
}
