//! Channels that never change while what they are about moves: placeholders that look like measurements.

use super::columns::{Columns, Signals};
use super::limits::LEAST_MOTION;
use super::remark::{Fault, Remark, Size};
use super::statistics::deviation;

/// Remarks on a clip.
pub(super) fn remarks(clip: &Columns) -> Vec<Remark> {
    let mut found = Vec::new();
    for (topic, signals) in clip.topics() {
        // A command may stay where it is, a joint that is commanded does not.
        if topic == "measured" {
            found.extend(joints(clip, (topic, "q"), &signals.q, |j| moves(&clip.desired, j)));
        }
        found.extend(joints(clip, (topic, "dq"), &signals.dq, |j| moves(signals, j)));
        found.extend(joints(clip, (topic, "effort"), &signals.tau, |j| moves(signals, j)));
    }
    found.extend(poses(clip));
    found
}

fn moves(signals: &Signals, joint: usize) -> bool {
    signals.q.get(joint).is_some_and(|q| deviation(q) > LEAST_MOTION)
}

fn constant(values: &[f64]) -> Option<f64> {
    let first = *values.first()?;
    (values.len() > 20 && values.iter().all(|v| *v == first)).then_some(first)
}

fn joints(
    clip: &Columns,
    (topic, what): (&str, &str),
    channels: &[Vec<f64>],
    should_move: impl Fn(usize) -> bool,
) -> Option<Remark> {
    let stands = |j: &usize| constant(&channels[*j]).is_some() && should_move(*j);
    let still: Vec<usize> = (0..channels.len()).filter(stands).collect();
    let first = *still.first()?;
    let value = constant(&channels[first])?;
    let who = match &still[..] {
        [one] => clip.joint(*one),
        many => format!("{} joints, from {} on,", many.len(), clip.joint(first)),
    };
    Some(
        Remark::new(
            Fault::PlaceholderConstant,
            &clip.file,
            format!("{topic} {what}"),
            format!(
                "{topic} {what} of {who} is {value} in every row while the joint moves: a placeholder, no measurement"
            ),
        )
        .sized(Size::count(still.len() as f64, "channels"))
        .mended_by(format!("fill {what} in where `{topic}` is published, or leave it out of the message")),
    )
}

/// Coordinates of the object that never change while others do.
fn poses(clip: &Columns) -> Option<Remark> {
    let poses = &clip.object.poses;
    let column = |k: usize| -> Vec<f64> { poses.iter().map(|pose| pose.position()[k]).collect() };
    let columns = [0, 1, 2].map(column);
    let travels = columns.iter().any(|column| deviation(column) > LEAST_MOTION);
    let still: Vec<&str> = ["x", "y", "z"]
        .into_iter()
        .zip(&columns)
        .filter(|(_, c)| constant(c).is_some())
        .map(|(name, _)| name)
        .collect();
    let turns = poses.windows(2).any(|w| w[0].wxyz() != w[1].wxyz());
    let named: Vec<&str> = still.into_iter().chain((!turns).then_some("orientation")).collect();
    (travels && poses.len() > 20 && !named.is_empty()).then(|| {
        let names = named.join(" and ");
        Remark::new(
            Fault::PlaceholderConstant,
            &clip.file,
            "object poses",
            format!("{names} of the object stay the same to the bit in all {} poses while it moves: no tracker measured them", poses.len()),
        )
        .sized(Size::count(named.len() as f64, "channels"))
        .mended_by("publish what the tracker measures, or say that it tracks in a plane: heights and leans say nothing then")
    })
}
