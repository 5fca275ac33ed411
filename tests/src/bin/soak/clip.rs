//! What a recording of hours holds: how many states are missing, and whether it says so itself.

use shared_mem::msg::arm::ArmState;
use shared_mem::msg::event::{Event, EventSource};
use shared_mem::recording::{ClipMessages, Payload};
use shared_mem::topics;
use std::path::Path;

/// A loss is named by the recorder when it next writes to the disk: within this time [ns].
const NAMED_WITHIN_NS: u64 = 2_000_000_000;

/// Rows of a clip.
#[derive(Debug, Default)]
pub(crate) struct Rows {
    /// States that are there.
    pub(crate) states: u64,
    /// States that the count of cycles shows to be missing.
    pub(crate) missing: u64,
    /// Of those, the ones of which no event of the recorder speaks.
    pub(crate) unnamed: u64,
    /// What keeps the file from being read whole.
    pub(crate) damage: Option<String>,
}

impl Rows {
    /// Counts the rows of a clip, message by message.
    ///
    /// # Errors
    /// What is wrong with the file.
    pub(crate) fn of(clip: &Path) -> Result<Self, String> {
        let mut messages =
            ClipMessages::open(clip, &[topics::ARM_STATE.name, topics::EVENTS.name]).map_err(|e| e.to_string())?;
        let (mut rows, mut last) = (Self::default(), None::<[u64; 2]>);
        let mut waiting = Vec::new();
        for message in &mut messages {
            match message.map_err(|e| e.to_string())?.payload {
                Payload::ArmState(state) => {
                    rows.states += 1;
                    let missing = rows.missing_before(&state, &mut last);
                    if missing > 0 {
                        waiting.push((state.stamp_ns, missing));
                    }
                }
                Payload::Event(event) if names_a_loss(&event) => {
                    waiting.retain(|(stamp_ns, _)| event.stamp_ns > stamp_ns + NAMED_WITHIN_NS);
                }
                _ => {}
            }
        }
        rows.unnamed = waiting.iter().map(|(_, missing)| missing).sum();
        rows.damage = messages.damage();
        Ok(rows)
    }

    /// How many states are missing before this one of the same run of the bridge.
    fn missing_before(&mut self, state: &ArmState, last: &mut Option<[u64; 2]>) -> u64 {
        let missing = match *last {
            Some([session, cycle]) if session == state.session => state.cycle.saturating_sub(cycle + 1),
            _ => 0,
        };
        *last = Some([state.session, state.cycle]);
        self.missing += missing;
        missing
    }
}

fn names_a_loss(event: &Event) -> bool {
    event.source == EventSource::Recorder && event.text().contains("missing in the clip")
}
