//! Joint values that come later by a time that need not be a whole number of ticks.

use crate::arm::Joints;
use shared_mem::time::TICK;

/// Values of the last ticks. A fraction of a tick is a straight line between two of them: the mean of a held signal over
/// a tick, and continuous in the delay.
#[derive(Debug)]
pub(super) struct DelayLine {
    past: Vec<Joints>,
    newest: usize,
    whole: usize,
    part: f64,
    /// Whether the first value stands for the time before it.
    started: bool,
}

impl Clone for DelayLine {
    fn clone(&self) -> Self {
        Self { past: self.past.clone(), ..*self }
    }

    /// Keeps the memory it has.
    fn clone_from(&mut self, source: &Self) {
        let mut past = std::mem::take(&mut self.past);
        past.clone_from(&source.past);
        *self = Self { past, ..*source };
    }
}

impl DelayLine {
    /// A line of `delay` seconds that has carried `before` for ever.
    pub(super) fn new(delay: f64, before: &Joints) -> Self {
        let mut line = Self::empty(delay);
        line.restart(before);
        line
    }

    /// As if it had carried `before` for ever.
    pub(super) fn restart(&mut self, before: &Joints) {
        self.past.fill(*before);
        self.started = true;
    }

    /// As if nothing had come yet.
    pub(super) fn clear(&mut self) {
        self.started = false;
    }

    /// A line of `delay` seconds that takes its first value for what came before.
    pub(super) fn empty(delay: f64) -> Self {
        // A delay that is a whole number of ticks but for rounding must not blur.
        let ticks = (delay / TICK * 1e6).round() * 1e-6;
        let whole = ticks.floor() as usize;
        Self { past: vec![Joints::default(); whole + 2], newest: 0, whole, part: ticks - whole as f64, started: false }
    }

    /// Takes the value of this tick and gives the delayed one.
    pub(super) fn after(&mut self, value: &Joints) -> Joints {
        if !self.started {
            self.past.fill(*value);
            self.started = true;
        }
        let length = self.past.len();
        self.newest = (self.newest + 1) % length;
        self.past[self.newest] = *value;
        let ago = |ticks: usize| &self.past[(self.newest + length - ticks) % length];
        let (later, earlier) = (ago(self.whole), ago(self.whole + 1));
        std::array::from_fn(|i| (1.0 - self.part) * later[i] + self.part * earlier[i])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_ticks_come_back_unchanged_and_fractions_in_between() {
        let count = |delay: f64| {
            let mut line = DelayLine::new(delay, &[0.0; 8]);
            (1..10).map(|i| line.after(&[f64::from(i); 8])[3]).collect::<Vec<_>>()
        };
        assert_eq!(count(0.0), [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0]);
        assert_eq!(count(0.003), [0.0, 0.0, 0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        assert_eq!(count(0.00225)[4..], [2.75, 3.75, 4.75, 5.75, 6.75]);
    }
}
