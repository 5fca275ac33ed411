//! Motions, targets and stops on their way from the pump to the control loop. Chunks go through a ring, one behind the other; a stop
//! goes past them all by a number of its own, and makes void what was sent before it. What does not fit into the ring is
//! held on the pump's side, so that a stop is never behind it in shared memory. Neither side ever waits.

use crate::motion::Target;
use rtrb::{Consumer, Producer, RingBuffer};
use shared_mem::msg::motion::{MotionChunk, MotionKind};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// A chunk, and how many chunks and stops were sent before it.
#[derive(Debug, Clone, Copy)]
struct Numbered {
    number: u64,
    chunk: MotionChunk,
}

/// Targets that can wait: those of a few senders between two cycles.
const TARGETS: usize = 64;

/// The pump's end.
#[derive(Debug)]
pub struct OrderSender {
    chunks: Producer<Numbered>,
    /// Chunks for which there is no room in the ring yet; never more than its capacity.
    held: VecDeque<Numbered>,
    most_held: usize,
    targets: Producer<(u64, Target)>,
    /// Chunks and stops sent so far.
    sent: u64,
    /// The number from which on chunks count.
    valid_from: Arc<AtomicU64>,
}

/// The control loop's end.
#[derive(Debug)]
pub struct Orders {
    chunks: Consumer<Numbered>,
    targets: Consumer<(u64, Target)>,
    valid_from: Arc<AtomicU64>,
    /// What that number was when it was last looked at.
    seen: u64,
}

/// The two ends of a way on which `in_ring` chunks have room, and `most_held` before it. Allocates; what follows does not.
pub fn orders(in_ring: usize, most_held: usize) -> (OrderSender, Orders) {
    let (to_control, chunks) = RingBuffer::new(in_ring);
    let valid_from = Arc::new(AtomicU64::new(0));
    let (to_targets, targets) = RingBuffer::new(TARGETS);
    let held = VecDeque::with_capacity(most_held);
    let sender = OrderSender {
        chunks: to_control,
        held,
        most_held,
        targets: to_targets,
        sent: 0,
        valid_from: valid_from.clone(),
    };
    (sender, Orders { chunks, targets, valid_from, seen: 0 })
}

impl OrderSender {
    /// Sends a chunk. `false` where there is no room for it: it is dropped then, and the loop will find it missing. A stop
    /// needs no room.
    pub fn send(&mut self, chunk: &MotionChunk) -> bool {
        if chunk.kind == MotionKind::Stop {
            self.sent += 1;
            self.held.clear();
            self.valid_from.store(self.sent, Ordering::Release);
            return true;
        }
        self.hand_on();
        let next = Numbered { number: self.sent, chunk: *chunk };
        let fits = if self.held.is_empty() && !self.chunks.is_full() {
            self.chunks.push(next).is_ok()
        } else if self.held.len() < self.most_held {
            self.held.push_back(next);
            true
        } else {
            false
        };
        self.sent += u64::from(fits);
        fits
    }

    /// Sends a target. Where the loop has not taken those before it, it is dropped: newer ones follow.
    pub fn aim(&mut self, target: &Target) {
        let _full = self.targets.push((self.sent, *target));
    }

    /// Moves what is held into the ring, as far as there is room.
    pub fn hand_on(&mut self) {
        while !self.chunks.is_full()
            && let Some(next) = self.held.pop_front()
        {
            // There is room: looked at above, and only this end pushes.
            let _pushed = self.chunks.push(next);
        }
    }

    /// `true` when the loop has taken everything.
    pub fn is_empty(&self) -> bool {
        self.held.is_empty() && self.chunks.slots() == self.chunks.buffer().capacity()
    }
}

impl Orders {
    /// `true` when a stop was sent since this was last asked.
    pub fn is_stopped(&mut self) -> bool {
        let newest = self.valid_from.load(Ordering::Acquire);
        std::mem::replace(&mut self.seen, newest) != newest
    }

    /// The next chunk of those that the newest stop overtook.
    pub fn overtaken(&mut self) -> Option<MotionChunk> {
        let is_void = self.chunks.peek().is_ok_and(|next| next.number < self.seen);
        if is_void { self.take() } else { None }
    }

    /// The target that waits longest, but for those that the newest stop overtook.
    pub fn target(&mut self) -> Option<Target> {
        while let Ok((number, target)) = self.targets.pop() {
            if number >= self.seen {
                return Some(target);
            }
        }
        None
    }

    /// The chunk that waits longest.
    pub fn take(&mut self) -> Option<MotionChunk> {
        self.chunks.pop().ok().map(|next| next.chunk)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(motion_id: u64, kind: MotionKind) -> MotionChunk {
        MotionChunk { motion_id, kind, ..MotionChunk::default() }
    }

    #[test]
    fn a_stop_overtakes_a_full_ring_and_what_is_sent_after_it_counts() {
        let (mut sender, mut orders) = orders(2, 1);
        for motion in [1, 1, 2] {
            assert!(sender.send(&chunk(motion, MotionKind::Play)));
        }
        assert!(!sender.send(&chunk(2, MotionKind::Last)), "no room");
        assert!(!orders.is_stopped());
        assert!(sender.send(&chunk(0, MotionKind::Stop)), "a stop needs none");
        assert!(orders.take().is_some());
        assert!(sender.send(&chunk(3, MotionKind::Last)));
        assert!(orders.is_stopped() && !orders.is_stopped());
        let overtaken: Vec<u64> = std::iter::from_fn(|| orders.overtaken()).map(|chunk| chunk.motion_id).collect();
        assert_eq!(overtaken, [1], "what was held is gone already");
        assert_eq!(orders.take().map(|chunk| chunk.motion_id), Some(3));
        assert!(orders.take().is_none());
    }

    #[test]
    fn a_stop_overtakes_targets_and_later_ones_count() {
        let (mut sender, mut orders) = orders(2, 1);
        let target = |stream| Target { stream, q: Some([0.0; 8]), speed: 0.0 };
        sender.aim(&target(1));
        sender.send(&chunk(0, MotionKind::Stop));
        sender.aim(&target(2));
        assert!(orders.is_stopped());
        let came: Vec<u64> = std::iter::from_fn(|| orders.target()).map(|target| target.stream).collect();
        assert_eq!(came, [2]);
    }

    #[test]
    fn what_is_held_follows_in_order() {
        let (mut sender, mut orders) = orders(1, 2);
        let sent = [1, 2, 3, 4].map(|motion| sender.send(&chunk(motion, MotionKind::Play)));
        assert_eq!(sent, [true, true, true, false]);
        let mut came = Vec::new();
        while let Some(next) = orders.take() {
            came.push(next.motion_id);
            sender.hand_on();
        }
        assert!(came == [1, 2, 3] && sender.is_empty(), "{came:?}");
    }

    #[test]
    fn each_stop_is_seen_also_when_nothing_was_sent_between() {
        let (mut sender, mut orders) = orders(1, 0);
        for _ in 0..3 {
            sender.send(&chunk(0, MotionKind::Stop));
            assert!(orders.is_stopped());
        }
    }
}
