//! Commands that did not come in time: the share of those that did, and when there are too many in a row.

/// Commands that the success rate looks back on.
const WINDOW: usize = 100;
/// Losses in a row after which the robot stops.
const TOO_MANY: u32 = 20;

/// The count of one motion. It begins with the motion's first command: a client needs some states to notice that its
/// motion has started.
#[derive(Debug, Clone)]
pub(super) struct Losses {
    window: [bool; WINDOW],
    asked: usize,
    in_a_row: u32,
    total: u64,
}

impl Losses {
    pub(super) fn new() -> Self {
        Self { window: [false; WINDOW], asked: 0, in_a_row: 0, total: 0 }
    }

    /// `true` once there was a command.
    pub(super) fn has_begun(&self) -> bool {
        self.asked > 0
    }

    /// Takes note of one cycle. `false` when the robot has to stop.
    pub(super) fn note(&mut self, arrived: bool) -> bool {
        if !arrived && !self.has_begun() {
            return true;
        }
        self.window[self.asked % WINDOW] = arrived;
        self.asked += 1;
        self.in_a_row = if arrived { 0 } else { self.in_a_row + 1 };
        self.total += u64::from(!arrived);
        self.in_a_row < TOO_MANY
    }

    /// Share of the last 100 commands, or of those there were, that came in time; 0 before the first.
    pub(super) fn success_rate(&self) -> f64 {
        let counted = self.asked.min(WINDOW);
        let arrived = self.window.iter().take(counted).filter(|arrived| **arrived).count();
        arrived as f64 / counted.max(1) as f64
    }

    /// Commands lost in this motion.
    pub(super) fn total(&self) -> u64 {
        self.total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_twentieth_loss_in_a_row_is_one_too_many_and_any_command_begins_anew() {
        let mut losses = Losses::new();
        assert!((0..100).all(|_| losses.note(false)), "nothing is lost before the first command");
        assert!(losses.note(true));
        assert!((0..19).all(|_| losses.note(false)));
        assert!(losses.note(true));
        assert!((0..19).all(|_| losses.note(false)));
        assert!(!losses.note(false));
        assert_eq!(losses.total(), 39);
    }

    #[test]
    fn the_rate_looks_back_on_a_hundred_commands() {
        let mut losses = Losses::new();
        assert_eq!(losses.success_rate(), 0.0);
        losses.note(true);
        assert_eq!(losses.success_rate(), 1.0);
        for k in 0..400 {
            losses.note(k % 4 != 0);
        }
        assert_eq!(losses.success_rate(), 0.75);
    }
}
