//! The grid of deadlines of a timer-clocked loop. Deadlines lie on `start + k * period` for ever: a late cycle shortens
//! the next sleep, a missed one is skipped and counted, and nothing is ever made up for in a burst.

/// The grid and where the loop stands on it. Pure arithmetic; the caller sleeps.
#[derive(Debug, Clone, Copy)]
pub struct Grid {
    period_ns: u64,
    next_ns: u64,
}

/// What the clock said when the loop woke.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wake {
    /// How long after its deadline the loop woke [ns].
    pub late_ns: u64,
    /// Deadlines that passed unused while the loop was away.
    pub missed: u64,
}

impl Grid {
    /// A grid whose first deadline is one period after `now_ns`. A period of 0 counts as 1 ns.
    pub fn new(now_ns: u64, period_ns: u64) -> Self {
        let period_ns = period_ns.max(1);
        Self { period_ns, next_ns: now_ns + period_ns }
    }

    /// The deadline to sleep for [ns].
    pub fn next_ns(&self) -> u64 {
        self.next_ns
    }

    /// Takes note of having woken at `now_ns` and moves on to the first deadline after it.
    pub fn woke(&mut self, now_ns: u64) -> Wake {
        let late_ns = now_ns.saturating_sub(self.next_ns);
        let missed = late_ns / self.period_ns;
        self.next_ns += (missed + 1) * self.period_ns;
        Wake { late_ns, missed }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_late_cycle_keeps_the_grid_and_a_missed_one_is_skipped() {
        let mut grid = Grid::new(0, 1000);
        assert_eq!(grid.woke(1010), Wake { late_ns: 10, missed: 0 });
        assert_eq!(grid.next_ns(), 2000);
        assert_eq!(grid.woke(4500), Wake { late_ns: 2500, missed: 2 });
        assert_eq!(grid.next_ns(), 5000);
    }

    proptest! {
        #[test]
        fn the_next_deadline_is_on_the_grid_and_at_most_one_period_ahead(
            sleeps in prop::collection::vec(0_u64..20_000, 1..50),
        ) {
            let mut grid = Grid::new(500, 1000);
            let mut cycles = 0;
            for extra in sleeps {
                let now = grid.next_ns() + extra;
                cycles += 1 + grid.woke(now).missed;
                prop_assert!(grid.next_ns() > now && grid.next_ns() <= now + 1000);
                prop_assert_eq!(grid.next_ns(), 500 + (cycles + 1) * 1000);
            }
        }
    }
}
