//! Streams of targets for the fingers: one sender at a time, sent to the device where it changes. After a stop none of them
//! moves the fingers before all were silent, as with the arm.

use crate::remark::Newest;
use shared_mem::msg::gripper::{GripperAction, GripperCommand};
use shared_mem::msg::motion::STOP_SILENCE_NS;
use shared_mem::msg::target::{GripperTarget, SILENCE_NS};

/// Why a target does not count after a stop.
const STOPPED: &str = "the fingers were stopped, and no stream moves them before nobody has sent gripper targets for 0.5 s; end \
                       what sends, then ask again";
/// A change of less is none [m].
const STEP: f64 = 5e-4;

/// Whose targets count, and what of them the gripper knows.
#[derive(Debug, Default)]
pub(super) struct Fingers {
    stream: u64,
    heard_ns: u64,
    sent: Option<GripperTarget>,
    refused: Newest<u64>,
    /// When a stop was asked for, or a target came last after it.
    stopped_ns: Option<u64>,
}

impl Fingers {
    /// What a target has the gripper do; else what there is to say, once a stream. A sender that was silent for as long as
    /// an arm's may be makes room for another; the fingers stay where they were sent.
    pub(super) fn take(&mut self, target: &GripperTarget, now_ns: u64) -> Result<Option<GripperCommand>, String> {
        if let Some(stopped_ns) = self.stopped_ns {
            if now_ns.saturating_sub(stopped_ns) < STOP_SILENCE_NS {
                self.stopped_ns = Some(now_ns);
                return self.refuse(target.stream, STOPPED);
            }
            self.stopped_ns = None;
        }
        if now_ns.abs_diff(target.stamp_ns) > SILENCE_NS {
            return Ok(None);
        }
        let is_free = now_ns.saturating_sub(self.heard_ns) > SILENCE_NS;
        if target.stream != self.stream && !is_free {
            return self.refuse(target.stream, &format!("stream {} moves the fingers; end it first", self.stream));
        }
        if target.stream != self.stream {
            (self.stream, self.sent, self.refused) = (target.stream, None, Newest::default());
        }
        self.heard_ns = now_ns;
        let known = self.sent.is_some_and(|sent| {
            (sent.width - target.width).abs() < STEP && sent.force == target.force && sent.speed == target.speed
        });
        if known {
            return Ok(None);
        }
        self.sent = Some(*target);
        Ok(Some(GripperCommand {
            stamp_ns: target.stamp_ns,
            width: target.width,
            speed: target.speed,
            force: target.force,
            action: if target.force > 0.0 { GripperAction::Grasp } else { GripperAction::Move },
            reserved: 0,
        }))
    }

    fn refuse(&mut self, stream: u64, why: &str) -> Result<Option<GripperCommand>, String> {
        if self.refused.note(stream) {
            Err(format!("gripper targets of stream {stream} refused: {why}"))
        } else {
            Ok(None)
        }
    }

    /// Another order came in between: what the fingers were sent to counts no more.
    pub(super) fn give_way(&mut self, command: &GripperCommand, now_ns: u64) {
        self.sent = None;
        if command.action == GripperAction::Stop {
            (self.stopped_ns, self.refused) = (Some(now_ns), Newest::default());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn target(stream: u64, width: f64, ms: u64) -> GripperTarget {
        GripperTarget { stamp_ns: ms * MS, stream, width, ..GripperTarget::default() }
    }

    #[test]
    fn a_repeated_target_is_one_order_and_a_second_sender_waits_for_silence() {
        let mut fingers = Fingers::default();
        let mut take = |stream, width, ms| fingers.take(&target(stream, width, ms), ms * MS);
        let order = take(1, 0.04, 1000).expect("nothing to say").expect("an order");
        assert_eq!((order.width, order.action), (0.04, GripperAction::Move));
        assert_eq!(take(1, 0.0401, 1020), Ok(None), "the same");
        assert!(take(2, 0.01, 1040).is_err_and(|line| line.contains("stream 1 moves the fingers")));
        assert_eq!(take(2, 0.01, 1060), Ok(None), "said already");
        assert_eq!(take(1, 0.02, 1080).expect("nothing to say").map(|order| order.width), Some(0.02));
        assert_eq!(take(2, 0.01, 1300).expect("it is free").map(|order| order.width), Some(0.01));
    }

    #[test]
    fn after_a_stop_no_stream_moves_the_fingers_before_all_were_silent() {
        let mut fingers = Fingers::default();
        assert!(fingers.take(&target(1, 0.04, 1000), 1000 * MS).is_ok_and(|order| order.is_some()));
        fingers.give_way(&GripperCommand { action: GripperAction::Stop, ..GripperCommand::default() }, 1010 * MS);
        for ms in (1020..3000).step_by(20) {
            // The one that moved them, another, and one that takes a new id each time.
            for stream in [1, 2, ms] {
                assert!(!matches!(fingers.take(&target(stream, 0.01, ms), ms * MS), Ok(Some(_))), "{ms} ms: {stream}");
            }
        }
        let line = fingers.take(&target(7, 0.01, 3000), 3000 * MS).expect_err("its own words");
        assert!(line.contains("stream 7 refused: the fingers were stopped"), "{line}");
        assert_eq!(fingers.take(&target(7, 0.01, 3020), 3020 * MS), Ok(None), "said already");
        assert!(fingers.take(&target(7, 0.01, 3530), 3530 * MS).is_ok_and(|order| order.is_some()));
    }

    #[test]
    fn an_old_target_does_not_count_and_a_force_makes_a_grasp() {
        let mut fingers = Fingers::default();
        assert_eq!(fingers.take(&target(1, 0.04, 1000), 1300 * MS), Ok(None));
        let grasp = GripperTarget { force: 20.0, ..target(1, 0.03, 1300) };
        let order = fingers.take(&grasp, 1300 * MS).expect("nothing to say").expect("an order");
        assert_eq!((order.action, order.force), (GripperAction::Grasp, 20.0));
    }
}
