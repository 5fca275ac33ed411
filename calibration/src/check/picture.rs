//! What the page of a recording draws: numbers over an axis, with what to see in them. Data alone; the page is drawn elsewhere.

use super::columns::{Columns, Signals};
use super::look::{Known, Looked};
use super::remark::{Fault, Remark};
use super::statistics::{deviation, root_mean_square};
use super::{fall, torque};

#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// What is shown.
    pub heading: &'static str,
    /// How to read it.
    pub reading: String,
    /// Above the axes: clip and channel.
    pub title: String,
    /// Below the axis.
    pub x: &'static str,
    /// SI unit of the values.
    pub unit: &'static str,
    /// Lines with their classes (`before` orange, `after` blue, `data` ink) and what they are.
    pub lines: Vec<(&'static str, &'static str, Vec<[f64; 2]>)>,
}

/// Seconds around a jump that are shown, each side.
const AROUND: f64 = 0.05;

/// All pictures of a session.
pub(super) fn all(known: &Known<'_>, clips: &[Looked], remarks: &[Remark]) -> Vec<Picture> {
    let pick = |faults: &[Fault]| {
        let remark = remarks.iter().find(|remark| faults.contains(&remark.fault));
        let named = |file: &String| clips.iter().find(|looked| looked.columns.file == *file);
        remark.and_then(|remark| remark.clips.first()).and_then(named).or_else(|| clips.first())
    };
    let mut out = Vec::new();
    let aligned = [Fault::CommandUnit, Fault::JointSign, Fault::JointOrder, Fault::MisalignedLogs, Fault::Degrees];
    out.extend(pick(&aligned).and_then(|looked| commands(&looked.columns)));
    out.extend(lags(clips));
    out.extend(pick(&[Fault::StampUnit, Fault::LostSamples, Fault::UnevenStamps]).and_then(|l| stamps(&l.columns)));
    let slopes = pick(&[Fault::VelocityUnit, Fault::VelocityFilter, Fault::AngleWraps]);
    out.extend(slopes.and_then(|looked| velocities(&looked.columns)));
    if let Some(arm) = &known.arm {
        let weighed = pick(&[Fault::TorqueGravity, Fault::TorqueUnit]);
        out.extend(weighed.and_then(|looked| torques(&looked.columns, torque::beside(&looked.columns, arm)?)));
    }
    for remark in remarks.iter().filter(|remark| remark.fault == Fault::TwoPublishers) {
        let looked = clips.iter().find(|looked| remark.clips.first() == Some(&looked.columns.file));
        out.extend(looked.and_then(|looked| jumps(&looked.columns, remark)));
    }
    out.extend(clips.iter().find_map(|looked| Some(falls(&looked.columns, looked.fall.as_ref()?))));
    out
}

fn points(t: &[f64], values: &[f64]) -> Vec<[f64; 2]> {
    t.iter().zip(values).map(|(t, v)| [*t, *v]).collect()
}

/// The joint that is farthest from its commands, of those that move.
fn commands(clip: &Columns) -> Option<Picture> {
    let (measured, desired) = (&clip.measured, &clip.desired);
    let off = |j: usize| {
        let rows = measured.t.iter().zip(&measured.q[j]).step_by(10);
        let off: Vec<f64> = rows.filter_map(|(t, q)| Some(q - desired.q_at(j, *t)?)).collect();
        root_mean_square(&off)
    };
    let joints = 0..measured.dof().min(desired.dof());
    let joint = joints.max_by(|a, b| off(*a).total_cmp(&off(*b)))?;
    Some(Picture {
        heading: "Command against measurement",
        reading: "The joint that is farthest from its commands: shifted in time, of another size, turned round, or as it should be."
            .into(),
        title: format!("{}, {}", clip.file, clip.joint(joint)),
        x: "time [s]",
        unit: "rad",
        lines: vec![
            ("before", "commanded", points(&desired.t, &desired.q[joint])),
            ("after", "measured", points(&measured.t, &measured.q[joint])),
        ],
    })
}

fn lags(clips: &[Looked]) -> Option<Picture> {
    let mut lags: Vec<[f64; 4]> = clips
        .iter()
        .filter_map(|l| l.lag)
        .map(|lag| [lag.rate, lag.seconds, lag.interval[0], lag.interval[1]])
        .collect();
    if lags.len() < 2 {
        return None;
    }
    lags.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let column = |k: usize| lags.iter().map(|lag| [lag[0], lag[k]]).collect();
    Some(Picture {
        heading: "Lag by speed",
        reading: "How much later than commanded the arm moves, clip by clip, slow ones left. A delay stays the same; of logs that \
                  were laid against each other wrongly it halves where the speed doubles."
            .into(),
        title: "lag between command and measurement".into(),
        x: "speed over excursion of the commands [1/s]",
        unit: "s",
        lines: vec![
            ("data", "95 % interval", column(2)),
            ("data", "", column(3)),
            ("after", "lag", column(1)),
        ],
    })
}

fn stamps(clip: &Columns) -> Option<Picture> {
    let steps = |t: &[f64]| t.windows(2).map(|w| [w[1], w[1] - w[0]]).collect::<Vec<_>>();
    let lines: Vec<_> = [
        ("before", "desired", &clip.desired.t),
        ("after", "measured", &clip.measured.t),
        ("data", "object poses", &clip.pose_t),
    ]
    .into_iter()
    .filter(|(_, _, t)| t.len() > 2)
    .map(|(class, name, t)| (class, name, steps(t)))
    .collect();
    (!lines.is_empty()).then(|| Picture {
        heading: "Stamps",
        reading: "Time from each row to the one before: an even log is a straight line, a lost sample a peak of a whole number of \
                  steps."
            .into(),
        title: format!("{}, step from row to row", clip.file),
        x: "time [s]",
        unit: "s",
        lines,
    })
}

fn liveliest(signals: &Signals) -> Option<usize> {
    (0..signals.dof()).max_by(|a, b| deviation(&signals.q[*a]).total_cmp(&deviation(&signals.q[*b])))
}

fn velocities(clip: &Columns) -> Option<Picture> {
    let signals = &clip.measured;
    let joint = liveliest(signals)?;
    let (t, q, dq) = (&signals.t, &signals.q[joint], signals.dq.get(joint)?);
    let stride = ((0.02 / signals.step().max(1e-9)) as usize).max(1);
    let slopes = (stride..q.len())
        .step_by(stride)
        .map(|i| [0.5 * (t[i] + t[i - stride]), (q[i] - q[i - stride]) / (t[i] - t[i - stride])]);
    Some(Picture {
        heading: "Velocity against the slope of the positions",
        reading: "Both are the same quantity: one times the other is another unit, one behind the other a filter, peaks are wraps of \
                  an angle."
            .into(),
        title: format!("{}, {}", clip.file, clip.joint(joint)),
        x: "time [s]",
        unit: "rad/s",
        lines: vec![("before", "slope of q", slopes.collect()), ("after", "dq", points(t, dq))],
    })
}

fn torques(clip: &Columns, beside: torque::Beside) -> Option<Picture> {
    let joint = (0..beside.joints.len()).max_by(|a, b| {
        let size = |j: usize| root_mean_square(&beside.joints[j][1]);
        size(*a).total_cmp(&size(*b))
    })?;
    let [measured, model] = &beside.joints[joint];
    Some(Picture {
        heading: "Torque against the model",
        reading:
            "The joint that carries most: inverse dynamics of the links with gravity beside the torque that was logged."
                .into(),
        title: format!("{}, {}", clip.file, clip.joint(joint)),
        x: "time [s]",
        unit: "N m",
        lines: vec![("before", "model", points(&beside.t, model)), ("after", "measured", points(&beside.t, measured))],
    })
}

fn jumps(clip: &Columns, remark: &Remark) -> Option<Picture> {
    let signals = if remark.channel.contains("desired") { &clip.desired } else { &clip.measured };
    let middle = remark.at_s.unwrap_or_else(|| 0.5 * signals.duration());
    let joint = liveliest(signals)?;
    let near = |p: &[f64; 2]| (p[0] - middle).abs() < AROUND;
    Some(Picture {
        heading: "Two publishers",
        reading: "Positions row by row around a jump: two motions in one topic.".into(),
        title: format!("{}, {}", clip.file, clip.joint(joint)),
        x: "time [s]",
        unit: "rad",
        lines: vec![("after", "rows", points(&signals.t, &signals.q[joint]).into_iter().filter(near).collect())],
    })
}

fn falls(clip: &Columns, fall: &fall::Fall) -> Picture {
    let [from, to] = fall.poses;
    let z: Vec<f64> = clip.object.poses.iter().map(|pose| pose.position()[2]).collect();
    let start = clip.pose_t[from];
    let curve = clip.pose_t[from..=to].iter().map(|t| {
        let s = t - start;
        [*t, fall.curve[0] + fall.curve[1] * s + fall.curve[2] * s * s]
    });
    Picture {
        heading: "Free fall",
        reading: format!(
            "Height of the object, and the parabola through its fall: {:.2} \u{b1} {:.2} m/s\u{b2} downwards.",
            fall.acceleration,
            1.96 * fall.sigma
        ),
        title: format!("{}, height", clip.file),
        x: "time [s]",
        unit: "m",
        lines: vec![("data", "poses", points(&clip.pose_t, &z)), ("before", "parabola", curve.collect())],
    }
}
