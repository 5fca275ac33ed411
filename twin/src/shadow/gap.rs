//! The joint gap: root mean square over the last second and over the whole run, per joint [rad].

use shared_mem::msg::{Joints, MAX_JOINTS};

/// States of the sliding window: one second.
const WINDOW: usize = 1000;

/// Sums of squares per joint.
#[derive(Debug, Clone)]
pub(super) struct JointGap {
    dof: usize,
    ring: Vec<Joints>,
    next: usize,
    window: Joints,
    total: Joints,
    count: u64,
}

impl JointGap {
    pub(super) fn new(dof: usize) -> Self {
        Self {
            dof,
            ring: Vec::with_capacity(WINDOW),
            next: 0,
            window: [0.0; MAX_JOINTS],
            total: [0.0; MAX_JOINTS],
            count: 0,
        }
    }

    /// Empties the window: what lies before an alignment says nothing about the twin as it is now.
    pub(super) fn start_anew(&mut self) {
        self.ring.clear();
        self.next = 0;
        self.window = [0.0; MAX_JOINTS];
    }

    pub(super) fn add(&mut self, error: &Joints) {
        let squares: Joints = std::array::from_fn(|i| if i < self.dof { error[i] * error[i] } else { 0.0 });
        let leaves = if self.ring.len() < WINDOW {
            self.ring.push(squares);
            [0.0; MAX_JOINTS]
        } else {
            std::mem::replace(&mut self.ring[self.next], squares)
        };
        self.next = (self.next + 1) % WINDOW;
        self.count += 1;
        for i in 0..self.dof {
            self.window[i] += squares[i] - leaves[i];
            self.total[i] += squares[i];
        }
        if self.next == 0 {
            // Adding and taking away leaves rounding behind; once a window it is summed afresh.
            self.window = self.ring.iter().fold([0.0; MAX_JOINTS], |sum, s| std::array::from_fn(|i| sum[i] + s[i]));
        }
    }

    /// Over the last second, or since the last alignment where that is less.
    pub(super) fn recent(&self) -> Joints {
        let count = self.ring.len().max(1) as f64;
        self.window.map(|sum| (sum.max(0.0) / count).sqrt())
    }

    /// Over everything; `None` before the first state.
    pub(super) fn overall(&self) -> Option<Joints> {
        (self.count > 0).then(|| self.total.map(|sum| (sum / self.count as f64).sqrt()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_window_forgets_what_is_older_than_a_second() {
        let mut gap = JointGap::new(1);
        assert_eq!(gap.overall(), None);
        let with = |v: f64| std::array::from_fn(|i| if i == 0 { v } else { 0.0 });
        (0..500).for_each(|_| gap.add(&with(3.0)));
        assert!((gap.recent()[0] - 3.0).abs() < 1e-12);
        (0..1000).for_each(|_| gap.add(&with(1.0)));
        assert!((gap.recent()[0] - 1.0).abs() < 1e-12);
        assert!((gap.overall().expect("states")[0] - (5500.0f64 / 1500.0).sqrt()).abs() < 1e-12);
        gap.start_anew();
        gap.add(&with(2.0));
        assert_eq!(gap.recent()[0], 2.0);
    }
}
