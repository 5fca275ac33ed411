//! The pictures of a clip, and the joints of their moments.

use super::error::ReadError;
use super::messages::{ClipMessages, Payload};
use super::picture::Picture;
use super::series::JointSeries;
use std::path::Path;

/// Pictures of a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PictureKind {
    /// Colour.
    Color,
    /// Depth.
    Depth,
}

/// Calls `each` with every picture of a kind in a clip and its stamp [ns], in the clock of the clip's joints. A TwinAligner
/// folder has none.
///
/// # Errors
/// [`ReadError`] when the clip cannot be read, or what `each` answers.
pub fn for_pictures<E: From<ReadError>>(
    path: &Path,
    kind: PictureKind,
    mut each: impl FnMut(u64, &Picture) -> Result<(), E>,
) -> Result<(), E> {
    if path.is_dir() {
        return Ok(());
    }
    for message in ClipMessages::of_pictures(path)? {
        let message = message?;
        if let Payload::Picture(picture) = &message.payload {
            let (stamp_ns, is_depth) = match picture {
                Picture::Pixels { header, .. } => (header.stamp_ns, header.depth_scale != 0.0),
                Picture::Compressed { stamp_ns, .. } => (*stamp_ns, message.topic.contains("depth")),
            };
            if is_depth == (kind == PictureKind::Depth) {
                each(stamp_ns, picture)?;
            }
        }
    }
    Ok(())
}

impl JointSeries {
    /// Joint positions [rad] and the fastest joint's speed [rad/s] at a time, between rows; `None` outside of the series.
    pub fn at(&self, time_ns: u64) -> Option<(Vec<f64>, f64)> {
        let next = self.stamps_ns.partition_point(|stamp| *stamp < time_ns);
        let before = next.checked_sub(1)?;
        let (a, b) = (*self.stamps_ns.get(before)?, *self.stamps_ns.get(next)?);
        let share = (time_ns - a) as f64 / (b - a).max(1) as f64;
        let (from, to) = (self.q_row(before), self.q_row(next));
        let q = from.iter().zip(to).map(|(from, to)| from + share * (to - from)).collect();
        let seconds = (b - a).max(1) as f64 * 1e-9;
        let speed = from.iter().zip(to).map(|(from, to)| (to - from).abs() / seconds).fold(0.0, f64::max);
        Some((q, speed))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_between_rows_are_interpolated() {
        let series = JointSeries { stamps_ns: vec![0, 10], dof: 1, q: vec![1.0, 2.0], dq: Vec::new(), tau: Vec::new() };
        let (q, speed) = series.at(5).expect("inside");
        assert_eq!((q, speed), (vec![1.5], 1e8));
        assert!(series.at(11).is_none());
    }
}
