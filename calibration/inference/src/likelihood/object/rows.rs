//! What every residual of a clip with an object is about: when, in which part of the clip, in which coordinate.

use super::clip::ObjectClip;

/// Part of a clip.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Part {
    /// The object stands and waits, or was just let go.
    Before,
    /// The tool hits and pushes it.
    Hit,
    /// It slides by itself.
    Slide,
    /// It rests where it came to.
    After,
}

/// Coordinate of a residual.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Channel {
    /// Place along x, y, z of the base frame: 0, 1, 2.
    Position(usize),
    /// Rotation vector about x, y, z of the base frame: 0, 1, 2; 2 is yaw.
    Rotation(usize),
    /// A joint's encoder.
    Joint(usize),
}

/// What a residual is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Row {
    /// Stamp of the recording.
    pub stamp_ns: u64,
    /// Part of the clip.
    pub part: Part,
    pub channel: Channel,
}

/// The rows of a clip, in the order of its residuals.
pub(super) fn rows(clip: &ObjectClip, with_arm: bool) -> Vec<Row> {
    let of = |stamp_ns: u64, channel| Row { stamp_ns, part: part(clip, stamp_ns), channel };
    let stamps = clip.recorded.object.stamps_ns.iter();
    let pose = |stamp: &u64| {
        let stamp = *stamp;
        let place = (0..3).map(Channel::Position).chain((0..3).map(Channel::Rotation));
        place.map(move |channel| of(stamp, channel))
    };
    let mut rows: Vec<Row> = stamps.flat_map(pose).collect();
    if with_arm {
        let dof = clip.recorded.measured.dof;
        rows.extend(clip.arm_ns.iter().flat_map(|stamp| (0..dof).map(move |i| of(*stamp, Channel::Joint(i)))));
    }
    rows
}

fn part(clip: &ObjectClip, stamp_ns: u64) -> Part {
    if stamp_ns <= clip.onset_ns {
        Part::Before
    } else if stamp_ns > clip.rest_ns {
        Part::After
    } else if clip.commands.is_some() && stamp_ns < clip.free_ns {
        Part::Hit
    } else {
        Part::Slide
    }
}
