//! A remark on a recording: which fault, where, how large, and what to do about it.

use serde::Serialize;
use std::fmt;

/// How much a fault matters.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Severity {
    /// Good to know: it was mended in reading, or costs little.
    Note,
    /// Something is lost or left out by it.
    Warning,
    /// The data cannot mean what they say: no verb should use them so.
    Wrong,
}

/// Families of faults.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Fault {
    /// Clips of several sources: two robots, or a robot and the simulation.
    MixedOrigins,
    /// Commands and measurements are shifted against each other by no delay.
    MisalignedLogs,
    /// Two topics were stamped by clocks of their own.
    DifferentClocks,
    /// Stamps in ms or us.
    StampUnit,
    /// Commands that are the measurements themselves.
    CopiedCommands,
    /// Commands in another unit than what was measured.
    CommandUnit,
    /// Positions in degrees.
    Degrees,
    JointOrder,
    /// A joint counted the other way round.
    JointSign,
    /// Positions that the joint cannot take.
    BeyondLimits,
    /// Velocities in another unit than the slope of the positions.
    VelocityUnit,
    /// Velocities behind the slope of the positions.
    VelocityFilter,
    /// Jumps by a whole turn, and velocities computed across them.
    AngleWraps,
    /// Two publishers on one topic.
    TwoPublishers,
    /// Torques without the arm's weight, or commanded ones with it.
    TorqueGravity,
    /// Torques that hold a weight along another axis of the base than the model's.
    GravityDirection,
    /// Torques of another sign or unit than the model's.
    TorqueUnit,
    /// Samples that did not arrive.
    LostSamples,
    /// Stamps at uneven distances.
    UnevenStamps,
    /// Stamps that go back, repeat, or lie far from all others.
    StampOrder,
    /// A first row that was never measured.
    StartGlitch,
    /// A file that ends too early.
    CutFile,
    /// Rows that are not finite.
    UnusableRows,
    /// A channel that never changes.
    PlaceholderConstant,
    /// Rows that repeat older ones.
    HeldRows,
    /// Rates that beat against each other.
    UnsynchronisedRates,
    /// Lengths in another unit, or half of them.
    LengthUnit,
    /// Quaternions with w first, or of another length than 1.
    Quaternion,
    /// A fall with another acceleration than gravity's.
    FreeFall,
    /// Poses that are not of what the arm hits.
    PosesElsewhere,
    /// Anything else that the reader of the file noticed.
    Reader,
}

impl Fault {
    /// All of them, in the order in which a session is looked at.
    pub const ALL: [Self; 31] = [
        Self::MixedOrigins,
        Self::MisalignedLogs,
        Self::DifferentClocks,
        Self::StampUnit,
        Self::CopiedCommands,
        Self::CommandUnit,
        Self::Degrees,
        Self::JointOrder,
        Self::JointSign,
        Self::BeyondLimits,
        Self::VelocityUnit,
        Self::VelocityFilter,
        Self::AngleWraps,
        Self::TwoPublishers,
        Self::TorqueGravity,
        Self::GravityDirection,
        Self::TorqueUnit,
        Self::LostSamples,
        Self::UnevenStamps,
        Self::StampOrder,
        Self::StartGlitch,
        Self::CutFile,
        Self::UnusableRows,
        Self::PlaceholderConstant,
        Self::HeldRows,
        Self::UnsynchronisedRates,
        Self::LengthUnit,
        Self::Quaternion,
        Self::FreeFall,
        Self::PosesElsewhere,
        Self::Reader,
    ];

    /// Its name in JSON and in docs/check.md.
    pub fn key(self) -> &'static str {
        match self {
            Self::MixedOrigins => "mixed_origins",
            Self::MisalignedLogs => "misaligned_logs",
            Self::DifferentClocks => "different_clocks",
            Self::StampUnit => "stamp_unit",
            Self::CopiedCommands => "copied_commands",
            Self::CommandUnit => "command_unit",
            Self::Degrees => "degrees",
            Self::JointOrder => "joint_order",
            Self::JointSign => "joint_sign",
            Self::BeyondLimits => "beyond_limits",
            Self::VelocityUnit => "velocity_unit",
            Self::VelocityFilter => "velocity_filter",
            Self::AngleWraps => "angle_wraps",
            Self::TwoPublishers => "two_publishers",
            Self::TorqueGravity => "torque_gravity",
            Self::GravityDirection => "gravity_direction",
            Self::TorqueUnit => "torque_unit",
            Self::LostSamples => "lost_samples",
            Self::UnevenStamps => "uneven_stamps",
            Self::StampOrder => "stamp_order",
            Self::StartGlitch => "start_glitch",
            Self::CutFile => "cut_file",
            Self::UnusableRows => "unusable_rows",
            Self::PlaceholderConstant => "placeholder_constant",
            Self::HeldRows => "held_rows",
            Self::UnsynchronisedRates => "unsynchronised_rates",
            Self::LengthUnit => "length_unit",
            Self::Quaternion => "quaternion",
            Self::FreeFall => "free_fall",
            Self::PosesElsewhere => "poses_elsewhere",
            Self::Reader => "reader",
        }
    }

    /// How much it matters where nothing mends it.
    pub fn severity(self) -> Severity {
        match self {
            Self::MixedOrigins
            | Self::MisalignedLogs
            | Self::DifferentClocks
            | Self::StampUnit
            | Self::CopiedCommands
            | Self::CommandUnit
            | Self::Degrees
            | Self::JointOrder
            | Self::JointSign
            | Self::VelocityUnit
            | Self::TwoPublishers
            | Self::TorqueGravity
            | Self::GravityDirection
            | Self::TorqueUnit
            | Self::LengthUnit
            | Self::Quaternion
            | Self::FreeFall => Severity::Wrong,
            Self::BeyondLimits | Self::CutFile | Self::PlaceholderConstant | Self::HeldRows | Self::PosesElsewhere => {
                Severity::Warning
            }
            Self::VelocityFilter
            | Self::AngleWraps
            | Self::LostSamples
            | Self::UnevenStamps
            | Self::StampOrder
            | Self::StartGlitch
            | Self::UnusableRows
            | Self::UnsynchronisedRates
            | Self::Reader => Severity::Note,
        }
    }
}

/// How large a fault is, in SI units unless the unit says otherwise.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Size {
    pub value: f64,
    /// Its 95 % interval, or the range over joints or clips where that is wider; equal to the value for a count.
    pub interval: [f64; 2],
    pub unit: &'static str,
}

impl Size {
    /// A number that is counted, not estimated.
    pub fn count(value: f64, unit: &'static str) -> Self {
        Self { value, interval: [value; 2], unit }
    }
}

/// What is remarked about a recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Remark {
    pub fault: Fault,
    /// How much it matters.
    pub severity: Severity,
    /// Files of the clips that show it, as cell.toml lists them; of a fault of cell.toml or of the session, all of its.
    pub clips: Vec<String>,
    /// Topic, joint or quantity.
    pub channel: String,
    /// When in the first of the clips, from its first row [s]; none where it holds throughout.
    pub at_s: Option<f64>,
    pub what: String,
    pub size: Option<Size>,
    /// What to do: a command, or the line to change.
    pub remedy: String,
}

impl Remark {
    /// A remark on one clip with the severity of its family.
    pub fn new(fault: Fault, clip: &str, channel: impl Into<String>, what: impl Into<String>) -> Self {
        Self {
            fault,
            severity: fault.severity(),
            clips: vec![clip.to_owned()],
            channel: channel.into(),
            at_s: None,
            what: what.into(),
            size: None,
            remedy: String::new(),
        }
    }

    /// With its size.
    pub fn sized(self, size: Size) -> Self {
        Self { size: Some(size), ..self }
    }

    /// With what to do.
    pub fn mended_by(self, remedy: impl Into<String>) -> Self {
        Self { remedy: remedy.into(), ..self }
    }

    /// With when it shows [s].
    pub fn at(self, seconds: f64) -> Self {
        Self { at_s: Some(seconds), ..self }
    }

    /// With another severity than its family's.
    pub fn weighed(self, severity: Severity) -> Self {
        Self { severity, ..self }
    }

    /// The clips in words: `clip_00.mcap and 6 more`.
    pub fn clips_in_words(&self) -> String {
        match &self.clips[..] {
            [] => String::new(),
            [one] => one.clone(),
            [first, more @ ..] => format!("{first} and {} more", more.len()),
        }
    }
}

impl fmt::Display for Remark {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.clips_in_words(), self.what)?;
        if self.remedy.is_empty() { Ok(()) } else { write!(f, "; {}", self.remedy) }
    }
}

/// One remark for each fault of a channel, with all the clips that show it; those that matter most first, and of these in the
/// order of [`Fault::ALL`].
pub fn merged(remarks: Vec<Remark>) -> Vec<Remark> {
    let mut all: Vec<Remark> = Vec::new();
    for remark in remarks {
        let same = |other: &&mut Remark| {
            (other.fault, &other.channel, other.severity) == (remark.fault, &remark.channel, remark.severity)
        };
        match all.iter_mut().find(same) {
            Some(known) => {
                known.clips.extend(remark.clips.into_iter().filter(|c| !known.clips.contains(c)).collect::<Vec<_>>())
            }
            None => all.push(remark),
        }
    }
    all.sort_by(|a, b| b.severity.cmp(&a.severity).then(a.fault.cmp(&b.fault)));
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_list_of_families_is_whole_in_order_and_named_as_in_json() {
        for (place, fault) in Fault::ALL.into_iter().enumerate() {
            assert_eq!(fault as usize, place, "{}", fault.key());
            assert_eq!(serde_json::to_value(fault).expect("a word"), fault.key());
        }
        assert_eq!(Fault::Reader as usize + 1, Fault::ALL.len(), "the last one");
    }

    #[test]
    fn a_fault_of_many_clips_is_one_remark_and_the_worst_stands_first() {
        let note = |clip: &str| Remark::new(Fault::LostSamples, clip, "measured", "3 lost");
        let wrong = Remark::new(Fault::JointSign, "b", "joint 2", "turned").mended_by("turn it back");
        let all = merged(vec![note("a"), note("b"), note("b"), wrong]);
        assert_eq!(all.iter().map(|r| r.fault).collect::<Vec<_>>(), [Fault::JointSign, Fault::LostSamples]);
        assert_eq!(all[1].clips, ["a", "b"]);
        assert_eq!(all[0].to_string(), "b: turned; turn it back");
        assert_eq!(all[1].to_string(), "a and 1 more: 3 lost");
    }
}
