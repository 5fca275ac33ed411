//! What the states of an own clip say that nobody measured, as the file says it about itself.
//!
//! A state holds positions, velocities and torques of what the arm did and of what it was told, all at one moment. A clip that
//! was taken from elsewhere may lack some of them, or have the commands at moments of their own; then those stand in
//! `/arm/command`, at their own stamps, and a state repeats the newest of them for whoever looks at states alone.

use super::clip::Clip;
use super::container::Messages;
use super::series::JointSeries;
use mcap::records::Metadata;
use std::collections::BTreeMap;
use std::io::{Read, Seek};

/// Metadata record, its keys, and what they say.
const RECORD: &str = "twinalign.logged";
const COMMANDS: &str = "commands";
const APART: &str = "in /arm/command, at stamps of their own";
const NONE: &str = "none were logged";
const LACKING: &str = "lacking";
const QUANTITIES: [&str; 4] = ["dq", "tau_J", "dq_d", "tau_J_d"];

/// What is to be believed of an own clip's states.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct Logged {
    /// Whether what the arm was told stands in messages of its own.
    pub(super) commands_apart: bool,
    /// Whether nobody logged what the arm was told.
    without_commands: bool,
    /// Which of [`QUANTITIES`] nobody logged.
    lacking: [bool; 4],
}

impl Logged {
    /// An arm that is moved without being pushed.
    pub(super) const WITHOUT_TORQUES: Self =
        Self { commands_apart: false, without_commands: false, lacking: [false, true, false, true] };

    /// What a clip of any kind holds.
    pub(super) fn of(clip: &Clip) -> Self {
        let lacks = |series: &JointSeries| [series.dq_row(0).is_none(), series.tau_row(0).is_none()];
        let ([dq, tau], [dq_d, tau_d]) = (lacks(&clip.measured), lacks(&clip.desired));
        let without_commands = clip.desired.is_empty() && !clip.measured.is_empty();
        let commands_apart = !without_commands && clip.measured.stamps_ns != clip.desired.stamps_ns;
        Self { commands_apart, without_commands, lacking: [dq, tau, dq_d, tau_d] }
    }

    /// The record to write; `None` where states say all there is.
    pub(super) fn record(self) -> Option<Metadata> {
        let mut pairs = BTreeMap::new();
        if self.commands_apart {
            pairs.insert(COMMANDS.to_owned(), APART.to_owned());
        } else if self.without_commands {
            pairs.insert(COMMANDS.to_owned(), NONE.to_owned());
        }
        let lacking: Vec<&str> =
            QUANTITIES.iter().zip(self.lacking).filter(|(_, lacks)| *lacks).map(|(name, _)| *name).collect();
        if !lacking.is_empty() {
            pairs.insert(LACKING.to_owned(), lacking.join(" "));
        }
        (!pairs.is_empty()).then(|| Metadata { name: RECORD.into(), metadata: pairs })
    }

    /// What the file says; its first message must have been looked at.
    pub(super) fn read<R: Read + Seek>(messages: &Messages<R>) -> Self {
        let Some(record) = messages.metadata.iter().find(|m| m.name == RECORD) else { return Self::default() };
        let lacking = record.pairs.get(LACKING).map_or("", String::as_str);
        Self {
            commands_apart: record.pairs.get(COMMANDS).is_some_and(|said| said == APART),
            without_commands: record.pairs.get(COMMANDS).is_some_and(|said| said == NONE),
            lacking: QUANTITIES.map(|name| lacking.split(' ').any(|word| word == name)),
        }
    }

    /// Takes what nobody logged out of what was read.
    pub(super) fn strip(self, measured: &mut JointSeries, desired: &mut JointSeries) {
        let [dq, tau, dq_d, tau_d] = self.lacking;
        if self.without_commands {
            *desired = JointSeries::default();
        }
        for (lacks, numbers) in
            [(dq, &mut measured.dq), (tau, &mut measured.tau), (dq_d, &mut desired.dq), (tau_d, &mut desired.tau)]
        {
            if lacks {
                numbers.clear();
            }
        }
    }
}
