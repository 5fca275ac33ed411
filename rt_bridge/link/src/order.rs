//! The receiver's side of a topic: whether a message is the next one, was missed, comes again, or is a stranger's.

use crate::envelope::Envelope;

/// A sender that was silent for so long may be followed by another: it was started anew [ns].
const SILENCE_NS: u64 = 1_000_000_000;
/// How long an answer to a question is waited for before it is asked again [ns].
const PATIENCE_NS: u64 = 200_000_000;

/// What to do with a message.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Hand it on; so many before it are lost.
    Deliver {
        /// Messages that will not come.
        lost: u64,
    },
    /// Leave it out: some before it are missing and are still to be had. Ask for them and all that follow.
    Ask {
        /// Number of the first that is missing.
        from: u64,
    },
    /// Leave it out: some before it are missing and were asked for.
    Wait,
    /// Leave it out: it was handed on already.
    Repeated,
    /// Leave it out: another host sends this topic.
    Stranger,
}

/// The count of one topic.
#[derive(Debug)]
pub struct Order {
    /// Whether all messages count, and missing ones are asked for.
    is_complete: bool,
    sender: Option<Sender>,
}

#[derive(Debug)]
struct Sender {
    session: u64,
    next: u64,
    heard_ns: u64,
    asked_ns: Option<u64>,
}

impl Order {
    /// Nothing came yet. `is_complete`: missing messages are asked for; otherwise they are counted as lost.
    pub fn new(is_complete: bool) -> Self {
        Self { is_complete, sender: None }
    }

    /// Number of the message that is due; `None` before the first, and where what is missing is not asked for.
    pub fn next(&self) -> Option<u64> {
        self.sender.as_ref().filter(|_| self.is_complete).map(|sender| sender.next)
    }

    /// Judges a message that came at `now_ns` of this host's clock. The first of a sender is the beginning: nothing before
    /// it is asked for.
    pub fn judge(&mut self, envelope: &Envelope, now_ns: u64) -> Verdict {
        let Envelope { session, number, oldest, .. } = *envelope;
        let begun = Sender { session, next: number, heard_ns: now_ns, asked_ns: None };
        let sender = self.sender.get_or_insert(begun);
        if sender.session != session {
            if now_ns.saturating_sub(sender.heard_ns) < SILENCE_NS {
                return Verdict::Stranger;
            }
            *sender = Sender { session, next: number, heard_ns: now_ns, asked_ns: None };
        }
        sender.heard_ns = now_ns;
        if number < sender.next {
            return Verdict::Repeated;
        }
        // What the sender no longer has will not come, whoever asks.
        let gone = if self.is_complete { oldest.clamp(sender.next, number) } else { number };
        if gone < number {
            let asked = sender.asked_ns.is_some_and(|asked_ns| now_ns.saturating_sub(asked_ns) < PATIENCE_NS);
            if asked {
                return Verdict::Wait;
            }
            sender.asked_ns = Some(now_ns);
            return Verdict::Ask { from: sender.next };
        }
        let lost = number - sender.next;
        sender.next = number + 1;
        sender.asked_ns = None;
        Verdict::Deliver { lost }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::history::History;

    fn envelope(session: u64, number: u64, oldest: u64) -> Envelope {
        Envelope { session, number, oldest, taken_ns: 0, schema: 0 }
    }

    #[test]
    fn a_gap_is_asked_for_once_and_nothing_is_handed_on_before_it_is_filled() {
        let mut order = Order::new(true);
        assert_eq!(order.next(), None);
        let mut at = |number, now_ns| order.judge(&envelope(1, number, 0), now_ns);
        assert_eq!(at(5, 0), Verdict::Deliver { lost: 0 });
        assert_eq!(at(6, 1), Verdict::Deliver { lost: 0 });
        assert_eq!(at(9, 2), Verdict::Ask { from: 7 });
        assert_eq!(at(10, 3), Verdict::Wait);
        assert_eq!(at(11, 3 + PATIENCE_NS), Verdict::Ask { from: 7 });
        assert_eq!(at(7, 300_000_000), Verdict::Deliver { lost: 0 });
        assert_eq!(at(6, 300_000_001), Verdict::Repeated);
        assert_eq!(at(8, 300_000_002), Verdict::Deliver { lost: 0 });
        assert_eq!(order.next(), Some(9));
    }

    #[test]
    fn what_the_sender_no_longer_has_is_lost_and_counted() {
        let mut order = Order::new(true);
        assert_eq!(order.judge(&envelope(1, 0, 0), 0), Verdict::Deliver { lost: 0 });
        assert_eq!(order.judge(&envelope(1, 9, 5), 1), Verdict::Ask { from: 1 });
        assert_eq!(order.judge(&envelope(1, 5, 5), 2), Verdict::Deliver { lost: 4 });
        assert_eq!(order.judge(&envelope(1, 6, 5), 3), Verdict::Deliver { lost: 0 });
    }

    #[test]
    fn pictures_that_did_not_come_are_counted_and_not_asked_for() {
        let mut order = Order::new(false);
        assert_eq!(order.judge(&envelope(1, 3, 0), 0), Verdict::Deliver { lost: 0 });
        assert_eq!(order.judge(&envelope(1, 6, 0), 1), Verdict::Deliver { lost: 2 });
    }

    #[test]
    fn a_second_sender_counts_when_the_first_is_silent() {
        let mut order = Order::new(true);
        assert_eq!(order.judge(&envelope(1, 3, 0), 0), Verdict::Deliver { lost: 0 });
        assert_eq!(order.judge(&envelope(2, 80, 0), SILENCE_NS - 1), Verdict::Stranger);
        assert_eq!(order.judge(&envelope(2, 81, 0), SILENCE_NS), Verdict::Deliver { lost: 0 });
        assert_eq!(order.judge(&envelope(2, 82, 0), SILENCE_NS + 1), Verdict::Deliver { lost: 0 });
        assert_eq!(order.judge(&envelope(1, 4, 0), SILENCE_NS + 2), Verdict::Stranger);
    }

    /// A line that swallows all while it is cut and nothing else, and takes two milliseconds from question to answer.
    #[test]
    fn with_a_history_nothing_is_lost_however_long_the_line_is_cut() {
        let (mut history, mut order) = (History::new(10_000, 1 << 20), Order::new(true));
        let cuts = [1_000..1_500, 2_000..2_001, 2_010..2_013, 2_500..3_700];
        let (mut delivered, mut asked) = (Vec::new(), None);
        for step in 0..4_000_u64 {
            history.push(step, 1, step);
            if let Some((due_at, from)) = asked
                && step >= due_at
            {
                history.again_from(from);
                asked = None;
            }
            while let Some(due) = history.due() {
                if cuts.iter().any(|cut| cut.contains(&step)) {
                    continue;
                }
                match order.judge(&envelope(1, due.number, due.oldest), step * 1_000_000) {
                    Verdict::Deliver { lost } => {
                        assert_eq!(lost, 0);
                        delivered.push(due.message);
                    }
                    Verdict::Ask { from } => asked = Some((step + 2, from)),
                    _ => {}
                }
            }
        }
        assert!(delivered.iter().copied().eq(0..4_000), "{} of 4000 were delivered", delivered.len());
    }
}
