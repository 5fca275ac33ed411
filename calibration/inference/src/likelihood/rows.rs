//! What every residual is about: which channel, which part of a clip, when.

/// Part of a clip to which a residual is counted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum StageName {
    /// The arm follows its command.
    Control,
    /// The object right after the hit.
    Hit,
    /// The object slides.
    Slide,
    /// The object rests: what is wrong there is seen wrongly.
    Rest,
}

impl StageName {
    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Control => "control",
            Self::Hit => "hit",
            Self::Slide => "slide",
            Self::Rest => "rest",
        }
    }
}

/// Whose sensors a channel belongs to, and while what happens.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// The arm's, while it moves alone.
    Arm,
    /// The object's poses.
    Object,
    /// The arm's, from the first touch until the tool has let go of the object: its joints yield to the contact force.
    Contact,
}

/// One measured quantity.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Channel {
    /// What it is: `q`, `dq`, `tau_J`, `tau_J_d`, `tau`, `position`, `rotation`.
    pub quantity: &'static str,
    /// Whose: `joint2`, `x`, `yaw`.
    pub place: String,
    /// The joint it belongs to, from 0; `None` for the object's.
    pub joint: Option<usize>,
    pub group: Group,
}

/// Where a residual stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Row {
    /// Index into the channels.
    pub channel: usize,
    /// Part of the clip.
    pub stage: StageName,
    /// What was going on: `slow forward`, `blow`, `in contact`.
    pub regime: &'static str,
    /// Seconds from the clip's start.
    pub time: f64,
}
