//! Positions against the ranges of the model's joints: a sign, a zero or a unit that is not the model's shows there.

use super::columns::{Columns, Signals};
use super::limits::{MOST, NEARLY_ALL, RANGE_MARGIN};
use super::remark::{Fault, Remark, Size};
use twin::arm::ArmModel;

/// Share of a joint's rows within its range, if the rows were multiplied by `factor` first.
fn inside(q: &[f64], [lo, hi]: [f64; 2], factor: f64) -> f64 {
    let within = |q: &&f64| (lo - RANGE_MARGIN..=hi + RANGE_MARGIN).contains(&(**q * factor));
    q.iter().filter(within).count() as f64 / q.len().max(1) as f64
}

/// Share of all joints' rows within their ranges.
pub(super) fn share_inside(signals: &Signals, arm: &ArmModel) -> f64 {
    let shares = signals.q.iter().take(arm.dof()).enumerate().map(|(j, q)| inside(q, bounds(arm, j), 1.0));
    shares.sum::<f64>() / signals.dof().min(arm.dof()).max(1) as f64
}

fn bounds(arm: &ArmModel, joint: usize) -> [f64; 2] {
    [arm.q_min()[joint], arm.q_max()[joint]]
}

/// Joints whose measured positions lie outside of their ranges for most of a clip.
pub(super) fn remarks(clip: &Columns, arm: &ArmModel) -> Vec<Remark> {
    let measured = &clip.measured;
    let beyond: Vec<usize> =
        (0..measured.dof().min(arm.dof())).filter(|j| inside(&measured.q[*j], bounds(arm, *j), 1.0) < MOST).collect();
    let all = |factor: f64| beyond.iter().all(|j| inside(&measured.q[*j], bounds(arm, *j), factor) > NEARLY_ALL);
    let degrees = std::f64::consts::PI / 180.0;
    if beyond.len() > 1 && all(degrees) {
        let what =
            format!("{} joints lie outside of their ranges, and inside if their positions are degrees", beyond.len());
        return vec![
            Remark::new(Fault::Degrees, &clip.file, "measured q", what)
                .sized(Size::count(beyond.len() as f64, "joints"))
                .mended_by("publish radians on both joint topics"),
        ];
    }
    swapped(clip, arm, &beyond)
        .map_or_else(|| beyond.iter().map(|joint| one(clip, arm, *joint)).collect(), |remark| vec![remark])
}

/// Two joints that would both be inside if they were exchanged.
fn swapped(clip: &Columns, arm: &ArmModel, beyond: &[usize]) -> Option<Remark> {
    let q = &clip.measured.q;
    let fits = |a: usize, b: usize| {
        inside(&q[a], bounds(arm, b), 1.0) > NEARLY_ALL && inside(&q[b], bounds(arm, a), 1.0) > NEARLY_ALL
    };
    let &[a, b] = beyond else { return None };
    fits(a, b).then(|| {
        let what = format!(
            "{} and {} lie outside of their ranges, and inside if they are exchanged",
            clip.joint(a),
            clip.joint(b)
        );
        Remark::new(Fault::JointOrder, &clip.file, "joint order", what)
            .sized(Size::count(2.0, "joints"))
            .mended_by("put the names of `[robot] joints` or of the topics into the order of their columns")
    })
}

fn one(clip: &Columns, arm: &ArmModel, joint: usize) -> Remark {
    let q = &clip.measured.q[joint];
    let [lo, hi] = bounds(arm, joint);
    let share = 1.0 - inside(q, [lo, hi], 1.0);
    let who = clip.joint(joint);
    let said =
        format!("{who} lies outside of its range of {lo:.2} to {hi:.2} rad in {:.0} % of the rows", 100.0 * share);
    let size = Size::count(share, "share of rows");
    if inside(q, [lo, hi], -1.0) > NEARLY_ALL {
        return Remark::new(
            Fault::JointSign,
            &clip.file,
            who,
            format!("{said}, and inside if it is counted the other way round"),
        )
        .sized(size)
        .mended_by("turn the sign of its q, dq and effort in the driver, or its axis in the URDF");
    }
    Remark::new(Fault::BeyondLimits, &clip.file, who, said)
        .sized(size)
        .mended_by("look at the joint's zero and unit in the driver, or at its limits in the URDF")
}
