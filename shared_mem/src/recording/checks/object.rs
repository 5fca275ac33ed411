//! Checks of the object's poses. Base frame, metres.

use super::{clocks, gaps, left_out, order_sentence, outlying};
use crate::frames::{Base, Object, Pose};
use crate::recording::series::{JointSeries, ObjectSeries};
use crate::time::seconds_between;

/// No table reaches this far from its robot [m].
const FARTHEST: f64 = 20.0;
/// Nothing was ever tracked there, whatever its unit [m].
const NOWHERE: f64 = 1e6;
/// A tracker may run this long before an arm moves and after it [ns].
const LONGEST_ALONE_NS: u64 = 60_000_000_000;

/// Mends an object series of stamps [ns] and poses, where `None` is a pose that makes no sense; fails with a sentence
/// when too many do not.
pub(in super::super) fn object(
    mut rows: Vec<(u64, Option<Pose<Base, Object>>)>,
    topic: &str,
) -> Result<(ObjectSeries, Vec<String>), String> {
    let mut warnings = Vec::new();
    if let Some(outlying) = outlying::find(&rows.iter().map(|(stamp, _)| *stamp).collect::<Vec<_>>(), topic)? {
        rows = outlying.kept.iter().filter_map(|row| rows.get(*row).copied()).collect();
        warnings.push(outlying.warning);
    }
    let somewhere = |pose: &Pose<Base, Object>| pose.position().iter().all(|v| v.abs() < NOWHERE);
    rows.iter_mut().for_each(|(_, pose)| *pose = pose.filter(somewhere));
    let total = rows.len();
    let first_bad = rows.iter().position(|(_, pose)| pose.is_none());
    let mut good: Vec<_> = rows.into_iter().filter_map(|(stamp, pose)| Some((stamp, pose?))).collect();
    if let Some(first) = first_bad {
        let what = format!("the pose of row {first} is not finite, no rotation, or {NOWHERE:e} m away");
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

/// Leaves out the poses that were taken long before the arm's rows or long behind them; fails with a sentence when none
/// would be left.
pub(in super::super) fn beside_arm(
    object: ObjectSeries,
    arm: &JointSeries,
    topic: &str,
) -> Result<(ObjectSeries, Option<String>), String> {
    let (Some(first), Some(last)) = (arm.stamps_ns.first(), arm.stamps_ns.last()) else { return Ok((object, None)) };
    let beside = first.saturating_sub(LONGEST_ALONE_NS)..=last.saturating_add(LONGEST_ALONE_NS);
    let kept: Vec<usize> = (0..object.len()).filter(|row| beside.contains(&object.stamps_ns[*row])).collect();
    let out = object.len() - kept.len();
    if out == 0 {
        return Ok((object, None));
    }
    if kept.is_empty() {
        let off = seconds_between(*first, object.stamps_ns[0]);
        return Err(format!(
            "the poses begin {:.0} s {} the arm's rows: their stamps come from different clocks; let one machine stamp both",
            off.abs(),
            if off < 0.0 { "before" } else { "behind" }
        ));
    }
    let warning = format!(
        "`{topic}`: {out} of {} poses left out, which were taken more than {:.0} s before or behind the arm's rows; let one \
         machine stamp both",
        object.len(),
        seconds_between(0, LONGEST_ALONE_NS)
    );
    Ok((object.select_rows(&kept), Some(warning)))
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
