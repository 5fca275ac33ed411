//! Set points that wait to be played, in memory set aside once.

use shared_mem::msg::motion::SetPoint;

/// Set points that can wait: 4 s at 1 kHz.
pub const QUEUE: usize = 4096;

/// First in, first out.
#[derive(Debug)]
pub(super) struct Queue {
    points: Box<[SetPoint]>,
    head: usize,
    pub(super) len: usize,
}

impl Queue {
    pub(super) fn new() -> Self {
        Self { points: vec![SetPoint::default(); QUEUE].into_boxed_slice(), head: 0, len: 0 }
    }

    /// Drops what does not fit: the player asks for room before.
    pub(super) fn push(&mut self, point: &SetPoint) {
        if self.len < QUEUE
            && let Some(slot) = self.points.get_mut((self.head + self.len) % QUEUE)
        {
            *slot = *point;
            self.len += 1;
        }
    }

    pub(super) fn pop(&mut self) -> Option<SetPoint> {
        if self.len == 0 {
            return None;
        }
        let point = self.points.get(self.head).copied();
        self.head = (self.head + 1) % QUEUE;
        self.len -= 1;
        point
    }

    pub(super) fn clear(&mut self) {
        (self.head, self.len) = (0, 0);
    }
}
