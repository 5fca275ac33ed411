//! Checks of the object's poses. Base frame, metres.

use super::{clocks, gaps, left_out, order_sentence};
use crate::frames::{Base, Object, Pose};
use crate::recording::series::ObjectSeries;

/// No table reaches this far from its robot [m].
const FARTHEST: f64 = 20.0;

/// Mends an object series of stamps [ns] and poses, where `None` is a pose that makes no sense; fails with a sentence
/// when too many do not.
pub(in super::super) fn object(
    rows: Vec<(u64, Option<Pose<Base, Object>>)>,
    topic: &str,
) -> Result<(ObjectSeries, Vec<String>), String> {
    let mut warnings = Vec::new();
    let total = rows.len();
    let first_bad = rows.iter().position(|(_, pose)| pose.is_none());
    let mut good: Vec<_> = rows.into_iter().filter_map(|(stamp, pose)| Some((stamp, pose?))).collect();
    if let Some(first) = first_bad {
        let what = format!("the pose of row {first} is not finite or no rotation");
        warnings.push(left_out(topic, total - good.len(), total, &what)?);
    }
    if let Some((kept, told)) = clocks::one_time(&good.iter().map(|(stamp, _)| *stamp).collect::<Vec<_>>(), topic) {
        good = good.get(kept).map(<[_]>::to_vec).unwrap_or_default();
        warnings.push(told);
    }
    let unsorted = good.windows(2).filter(|w| matches!(w, [a, b] if b.0 < a.0)).count();
    good.sort_by_key(|(stamp, _)| *stamp);
    let sorted = good.len();
    good.dedup_by_key(|(stamp, _)| *stamp);
    warnings.extend(order_sentence(topic, unsorted, sorted - good.len()));
    let (stamps_ns, poses): (Vec<u64>, Vec<_>) = good.into_iter().unzip();
    warnings.extend(gaps(&stamps_ns, topic));
    warnings.extend(far_away(&poses, topic));
    warnings.extend(turned_over(&poses, topic));
    Ok((ObjectSeries { stamps_ns, poses }, warnings))
}

fn far_away(poses: &[Pose<Base, Object>], topic: &str) -> Option<String> {
    let farthest = poses.iter().map(|pose| pose.isometry().translation.vector.norm()).fold(0.0, f64::max);
    (farthest > FARTHEST).then(|| {
        format!("`{topic}`: poses lie up to {farthest:.0} m from the base: probably millimetres; publish metres")
    })
}

/// A quaternion whose parts are stored w first reads as half a turn about x where there is no turn at all.
fn turned_over(poses: &[Pose<Base, Object>], topic: &str) -> Option<String> {
    let turned = poses.iter().filter(|pose| pose.wxyz()[1].abs() > 0.999).count();
    (turned * 2 > poses.len()).then(|| {
        format!(
            "`{topic}`: the object is turned half about x in {turned} of {} poses: if it stands upright, the tracker \
             stores quaternions w first; ROS wants x, y, z, w",
            poses.len()
        )
    })
}
