//! The silence after a stop: nothing begins before nobody has sent anything for [`STOP_SILENCE_NS`]. It is that of all senders
//! together and not of each stream: so a sender that takes a new id with every target does not get around it, and no id has to
//! be remembered.

use shared_mem::msg::motion::STOP_SILENCE_NS;

/// How much of it is left.
#[derive(Debug)]
pub(super) struct Silence {
    periods: u32,
    left: u32,
}

impl Silence {
    /// Nobody has asked for a stop.
    pub(super) fn over(period_s: f64) -> Self {
        Self { periods: (STOP_SILENCE_NS as f64 * 1e-9 / period_s).round() as u32, left: 0 }
    }

    /// A stop was asked for.
    pub(super) fn begin(&mut self) {
        self.left = self.periods;
    }

    /// Somebody sent something: where it is not over, it begins anew.
    pub(super) fn hear(&mut self) {
        if !self.is_over() {
            self.begin();
        }
    }

    /// A period on.
    pub(super) fn step(&mut self) {
        self.left = self.left.saturating_sub(1);
    }

    /// Whether motions may begin.
    pub(super) fn is_over(&self) -> bool {
        self.left == 0
    }
}
