//! Where a joint is over a clip: the pose of its part as seen from the body that carries it.

use super::subject::Subject;
use inference::statistics::median;
use nalgebra::{Isometry3, Quaternion, UnitQuaternion};
use shared_mem::recording::{Clip, ObjectSeries};
use shared_mem::time::seconds_between;
use std::f64::consts::{PI, TAU};
use twin::scene::joint_position;

/// A part that the poses show so far beside its joint is not on it [m, rad] (choices): its frame is another one than the URDF's. Gravity
/// pulls by the angle from the URDF's zero, so what is turned by more leaves another friction.
const OFF_THE_JOINT: f64 = 0.03;
const TURNED_OFF_THE_JOINT: f64 = 0.15;
/// A pose of the carrier counts for so long before its first and after its last stamp [s] (a choice).
const CARRIER_POSE_HOLDS: f64 = 0.2;
/// Fewest rows of use.
const FEWEST_ROWS: usize = 10;

/// A joint over a clip.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Positions {
    /// Since the first row [s].
    pub(super) times: Vec<f64>,
    /// [rad or m]
    pub(super) positions: Vec<f64>,
    /// From the frame of the link that carries the part to the base frame, whose z points up: the mean over the clip.
    pub(super) carrier: UnitQuaternion<f64>,
}

impl Positions {
    /// Of a clip, whose object in question is called `in_question`; or why the clip is of no use, in one line.
    pub(super) fn of(clip: &Clip, in_question: Option<&str>, subject: &Subject) -> Result<Self, String> {
        let series = |name: &String| {
            let other = || clip.others.iter().find(|other| other.name == *name).map(|other| &other.series);
            let found = if in_question == Some(name) { Some(&clip.object) } else { other() };
            found.filter(|series| !series.is_empty()).ok_or_else(|| {
                format!("has no poses of `{name}`; record them on /object/{name}/pose, in the frame of the URDF's link")
            })
        };
        let [carrier, part] = [series(&subject.bodies[0])?, series(&subject.bodies[1])?];
        let joint = &subject.joint;
        let middle = 0.5 * (joint.limits[0] + joint.limits[1]);
        let (mut stamps, mut positions, mut carriers) = (Vec::new(), Vec::<f64>::new(), Vec::new());
        let (mut beside, mut turned) = (Vec::new(), Vec::new());
        for (stamp, pose) in part.stamps_ns.iter().zip(&part.poses) {
            let Some(on) = between(carrier, *stamp) else { continue };
            let pose = pose.isometry();
            let mut position = joint_position(joint, &on, &pose);
            let off = (on * joint.pose_at(position)).inv_mul(&pose);
            if !joint.slides {
                // A pose tells an angle but for whole turns: the one nearest to the row before, or to the middle of the range.
                let near = positions.last().copied().unwrap_or(middle);
                position += TAU * ((near - position) / TAU).round();
            }
            stamps.push(*stamp);
            positions.push(position);
            carriers.push(on.rotation);
            beside.push(off.translation.vector.norm());
            turned.push(off.rotation.angle());
        }
        if positions.len() < FEWEST_ROWS {
            let [a, b] = &subject.bodies;
            return Err(format!("has only {} poses of `{b}` while `{a}` is seen, too", positions.len()));
        }
        // Medians: single poses of a tracker are anywhere.
        let [beside, turned] = [beside, turned].map(|values| median(values).unwrap_or(0.0));
        if beside > OFF_THE_JOINT || turned > TURNED_OFF_THE_JOINT {
            return Err(format!(
                "shows `{}` {:.0} mm and {:.0} degrees beside its joint; give poses in the frames of the URDF's links",
                subject.bodies[1],
                beside * 1e3,
                turned * 180.0 / PI
            ));
        }
        let times = stamps.iter().map(|stamp| seconds_between(stamps[0], *stamp)).collect();
        Ok(Self { times, positions, carrier: mean(&carriers) })
    }
}

/// Where a body is at a moment, on the straight way between two poses.
fn between(series: &ObjectSeries, stamp: u64) -> Option<Isometry3<f64>> {
    let pose = |row: usize| series.poses[row].isometry();
    let after = series.stamps_ns.partition_point(|other| *other < stamp);
    let near =
        |row: usize| (series.stamps_ns[row].abs_diff(stamp) as f64 * 1e-9 <= CARRIER_POSE_HOLDS).then(|| pose(row));
    if after == 0 {
        return near(0);
    }
    if after == series.len() {
        return near(after - 1);
    }
    let [low, high] = [series.stamps_ns[after - 1], series.stamps_ns[after]];
    pose(after - 1).try_lerp_slerp(&pose(after), (stamp - low) as f64 / (high - low) as f64, 1e-9)
}

/// Of rotations that are near to each other: quaternions of one hemisphere, summed.
fn mean(rotations: &[UnitQuaternion<f64>]) -> UnitQuaternion<f64> {
    let first = rotations.first().copied().unwrap_or_default();
    let sum = rotations.iter().fold(Quaternion::from_parts(0.0, nalgebra::zero()), |sum, turn| {
        let turn = turn.into_inner();
        sum + if turn.dot(&first) < 0.0 { -turn } else { turn }
    });
    UnitQuaternion::try_new(sum, 1e-9).unwrap_or(first)
}
