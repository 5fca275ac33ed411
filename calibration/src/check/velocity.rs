//! Velocities against the slope of the positions: another unit or sign, a filter, spikes where an angle wraps.
//!
use super::columns::{Columns, Signals};
use super::conversion;
use super::limits::{MOTION_OVER_NOISE, NEAR_TURN, NOT_ITS_SLOPE};
use super::remark::{Fault, Remark, Severity, Size};
use super::statistics::{median, quantile, range};
use inference::likelihood::arm::velocity::{Compared, Motion, late};
use std::f64::consts::TAU;

/// Every joint that moves enough to tell.
pub(super) fn compared(signals: &Signals) -> Vec<Compared> {
    let of = |joint: usize| {
        let motion =
            Motion { t: &signals.t, q: &signals.q[joint], dq: &signals.dq[joint], noise: signals.noise[joint] };
        motion.compared(joint)
    };
    (0..signals.dq.len()).filter_map(of).collect()
}

/// Remarks on both topics of a clip.
pub(super) fn remarks(clip: &Columns) -> Vec<Remark> {
    let of = |(topic, signals): (&'static str, &Signals)| {
        let joints = compared(signals);
        let mut found = unit(clip, topic, &joints);
        if found.is_empty() {
            found.extend(filter(clip, topic, signals, &joints));
        }
        found.extend(wraps(clip, topic, signals));
        found
    };
    clip.topics().into_iter().flat_map(of).collect()
}

fn unit(clip: &Columns, topic: &str, joints: &[Compared]) -> Vec<Remark> {
    let odd: Vec<&Compared> = joints.iter().filter(|joint| joint.is_not_its_slope()).collect();
    let factors: Vec<f64> = odd.iter().map(|c| c.factor.value).collect();
    let Some(interval) = range(&factors) else { return Vec::new() };
    let value = median(factors);
    let whole = odd.len() * 2 > joints.len();
    let channel = if whole { format!("{topic} dq") } else { format!("{topic} dq, {}", clip.joint(odd[0].joint)) };
    let who = if whole {
        format!("the {topic} velocities are")
    } else {
        format!("the {topic} velocity of {} is", clip.joint(odd[0].joint))
    };
    let (severity, meaning) = match conversion::known(value) {
        Some((_, what)) => (Severity::Wrong, format!(": {what}")),
        None if (value + 1.0).abs() < NOT_ITS_SLOPE => (Severity::Wrong, ": counted the other way round".into()),
        None => (Severity::Warning, ": not the slope of these positions".into()),
    };
    let remedy =
        format!("publish dq in rad/s of the same joints as q, or leave dq out of `{topic}`: it is then taken from q");
    vec![
        Remark::new(
            Fault::VelocityUnit,
            &clip.file,
            channel,
            format!("{who} {value:.3} times the slope of the positions{meaning}"),
        )
        .sized(Size { value, interval, unit: "1" })
        .mended_by(remedy)
        .weighed(severity),
    ]
}

fn filter(clip: &Columns, topic: &str, signals: &Signals, joints: &[Compared]) -> Option<Remark> {
    let late = late(joints, signals.step())?;
    Some(
        Remark::new(
            Fault::VelocityFilter,
            &clip.file,
            format!("{topic} dq"),
            format!(
                "the {topic} velocities come {:.1} ms behind the slope of the positions: they were filtered",
                late.delay * 1e3
            ),
        )
        .sized(Size { value: late.delay, interval: late.interval, unit: "s" })
        .mended_by("log the unfiltered velocity, or set the filter of the driver to its highest frequency"),
    )
}

/// Velocities that are off the slope by a turn within a step.
fn wraps(clip: &Columns, topic: &str, signals: &Signals) -> Option<Remark> {
    let t = &signals.t;
    let mut rows: Vec<(usize, usize)> = Vec::new();
    for (joint, dq) in signals.dq.iter().enumerate() {
        let q = &signals.q[joint];
        let off = |i: &usize| dq[*i] - (q[i + 1] - q[i - 1]) / (t[i + 1] - t[i - 1]);
        let mut sizes: Vec<f64> =
            (1..t.len().saturating_sub(1)).map(|i| off(&i).abs()).filter(|v| v.is_finite()).collect();
        let usual = quantile(&mut sizes, 0.5);
        let turns = |i: &usize| off(i).abs() * (t[*i] - t[i - 1]) / TAU;
        rows.extend(
            (1..t.len().saturating_sub(1))
                .filter(|i| off(i).abs() > MOTION_OVER_NOISE * usual && (turns(i) - 1.0).abs() < NEAR_TURN)
                .map(|i| (i, joint)),
        );
    }
    let (row, joint) = *rows.iter().min()?;
    Some(
        Remark::new(
            Fault::AngleWraps,
            &clip.file,
            format!("{topic} dq"),
            format!("{} velocities of the {topic} joints are a whole turn within one step off: computed across a wrap of the angle", rows.len()),
        )
        .at(t[row])
        .sized(Size::count(rows.len() as f64, "rows"))
        .mended_by(format!("compute the velocity of {} before its angle is wrapped, or unwrap q first", clip.joint(joint))),
    )
}
