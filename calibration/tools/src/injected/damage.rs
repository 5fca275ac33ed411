//! What each fault does to a clean clip; sizes, joints and rows are drawn.

use super::faults::Injected;
use super::sessions::Clean;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::arm::ArmState;
use shared_mem::msg::joints_from;
use shared_mem::recording::{Clip, ClipInfo, ClipWriter, JointSeries, ObjectSeries, read_clip};
use shared_mem::{input, output};
use std::f64::consts::TAU;
use std::path::Path;
use twin::arm::ArmModel;
use twin::replay::in_model_order;

/// What is the same in all clips.
struct Draw {
    /// Joints that are exchanged; the first is the one that is turned or silent.
    joints: [usize; 2],
    /// A size, 0 to 1.
    size: f64,
    sign: f64,
    /// Which of two ways, or topics.
    first: bool,
    /// Which of several channels.
    which: usize,
}

impl Draw {
    fn new(rng: &mut Pcg64, session: &Clean) -> Option<Self> {
        let dof = session.clips.first()?.1.measured.dof.max(2);
        let a = rng.random_range(0..dof);
        let b = (a + rng.random_range(1..dof)) % dof;
        let sign = if rng.random_range(0.0..1.0) < 0.5 { -1.0 } else { 1.0 };
        let first = rng.random_range(0.0..1.0) < 0.5;
        Some(Self { joints: [a, b], size: rng.random_range(0.0..1.0), sign, first, which: rng.random_range(0..5) })
    }

    /// A size between two, evenly in its logarithm.
    fn between(&self, lo: f64, hi: f64) -> f64 {
        lo * (hi / lo).powf(self.size)
    }
}

/// A session with the fault, as it is after reading; `None` where it has nothing that could have it.
pub fn inject(fault: Injected, session: &Clean, seed: u64) -> Option<Clean> {
    if !fault.fits(session) {
        return None;
    }
    let mut damaged = session.clone();
    if fault == Injected::HalfWidths {
        let size = damaged.cell.object_mut()?.size.as_mut()?;
        size.iter_mut().for_each(|edge| *edge *= 0.5);
        return Some(damaged);
    }
    let mut rng = Pcg64::seed_from_u64(seed.wrapping_mul(31) + fault as u64);
    // What a driver does wrong it does in every clip.
    let draw = Draw::new(&mut rng, session)?;
    for (_, clip) in &mut damaged.clips {
        damage(fault, clip, &draw, &mut rng, &session.cell)?;
        *clip = clip.clone().checked().ok()?;
    }
    Some(damaged)
}

/// Puts the fault into a clip; `None` where the clip lacks what it needs.
fn damage(fault: Injected, clip: &mut Clip, draw: &Draw, rng: &mut Pcg64, cell: &Cell) -> Option<()> {
    let dof = clip.measured.dof;
    let [a, b] = draw.joints;
    match fault {
        Injected::LostPackets => lose(clip, draw.between(3.0, 40.0) as usize, rng),
        Injected::StartGlitch => {
            clip.measured.q.iter_mut().take(dof).for_each(|q| *q += draw.sign * draw.between(0.05, 3.0))
        }
        Injected::UnevenStamps => uneven(clip, draw, rng),
        Injected::OneTopicInDegrees if draw.first => scale(&mut clip.desired, 1f64.to_degrees()),
        Injected::OneTopicInDegrees => scale(&mut clip.measured, 1f64.to_degrees()),
        Injected::BothTopicsInDegrees => {
            scale(&mut clip.desired, 1f64.to_degrees());
            scale(&mut clip.measured, 1f64.to_degrees());
        }
        Injected::TwoPublishers => clip.measured = interleaved(&clip.measured, draw, rng),
        Injected::AngleWraps => wrap(&mut clip.measured, draw, true),
        Injected::VelocitySpikes => wrap(&mut clip.measured, draw, false),
        Injected::TorqueWithoutGravity => exchange_weight(clip, cell, [0.0; 3])?,
        Injected::BaseOnItsSide => {
            let (side, size) = (usize::from(draw.first), draw.sign * 9.81);
            exchange_weight(clip, cell, std::array::from_fn(|k| if k == side { size } else { 0.0 }))?;
        }
        Injected::TorqueSignOfOneJoint => {
            // The first joint carries no weight, and the last one none where the tool is round.
            let joint = [1, 3, 5][a % 3].min(dof - 1);
            clip.measured.tau.iter_mut().skip(joint).step_by(dof).for_each(|tau| *tau = -*tau);
        }
        Injected::CopiedCommands => {
            clip.desired.stamps_ns.clone_from(&clip.measured.stamps_ns);
            clip.desired.q.clone_from(&clip.measured.q);
            clip.desired.dq.clone_from(&clip.measured.dq);
            clip.desired.tau.clear();
        }
        Injected::HalfWidths => {}
        Injected::Millimetres => change_poses(&mut clip.object, |pose| {
            Isometry3::from_parts(Translation3::from(pose.translation.vector * 1e3), pose.rotation)
        }),
        Injected::QuaternionWFirst => change_poses(&mut clip.object, w_first),
        Injected::HeldStates => held(clip, draw),
        Injected::HeldPoses => clip.object = logged_by_a_loop(&clip.object, draw)?,
        Injected::UnsynchronisedCommands => {
            clip.desired = resampled(&clip.desired, 1.15 + 0.7 * draw.size + draw.which as f64)
        }
        Injected::PlaceholderConstant => placeholder(clip, draw),
        Injected::FallScale => {
            let factor = if draw.first { draw.between(1.08, 2.0) } else { draw.between(0.5, 0.92) };
            change_poses(&mut clip.object, |pose| {
                Isometry3::from_parts(Translation3::from(pose.translation.vector * factor), pose.rotation)
            });
        }
        Injected::FallClock => {
            let factor = if draw.first { draw.between(1.05, 1.5) } else { draw.between(0.65, 0.95) };
            clip.object.stamps_ns.iter_mut().for_each(|stamp| *stamp = (*stamp as f64 * factor) as u64);
        }
        Injected::MisalignedLogs => {
            // The lag of a clip goes with its length: what takes twice as long is half as fast.
            let lag = draw.sign * draw.between(0.1, 1.0) * clip.desired.duration() / 6.0;
            shift(clip, -lag);
        }
        Injected::LeadingLogs => shift(clip, draw.between(0.03, 1.0)),
        Injected::CutFile => cut(clip, draw, cell)?,
        Injected::OrderOfOneTopic => swap(&mut clip.measured, a, b),
        Injected::OrderOfBothTopics => {
            swap(&mut clip.measured, a, b);
            swap(&mut clip.desired, a, b);
        }
        Injected::SignOfOneTopic => turn(&mut clip.measured, a),
        Injected::SignOfBothTopics => {
            // About its own axis a round tool weighs and turns the same either way: the last joint's sign shows in no torque.
            let joint = a % (dof - 1);
            turn(&mut clip.measured, joint);
            turn(&mut clip.desired, joint);
        }
        Injected::StampsInMilliseconds => stamped(clip, 1e-6),
        Injected::StampsInMicroseconds => stamped(clip, 1e-3),
        Injected::CommandsDividedTwice => {
            clip.desired.q.iter_mut().chain(&mut clip.desired.dq).for_each(|v| *v = v.to_radians());
        }
        Injected::VelocityUnit => clip.measured.dq.iter_mut().for_each(|v| *v = v.to_degrees()),
        Injected::VelocityFilter => low_pass(&mut clip.measured, draw.between(6e-3, 4e-2)),
    }
    Some(())
}

fn lose(clip: &mut Clip, count: usize, rng: &mut Pcg64) {
    let rows = clip.measured.len();
    let lost: Vec<usize> = (0..count).map(|_| rng.random_range(1..rows - 1)).collect();
    let kept: Vec<usize> = (0..rows).filter(|row| !lost.contains(row)).collect();
    clip.measured = clip.measured.select_rows(&kept);
    if clip.desired.len() == rows {
        clip.desired = clip.desired.select_rows(&kept);
    }
}

fn uneven(clip: &mut Clip, draw: &Draw, rng: &mut Pcg64) {
    let share = draw.between(0.15, 0.45);
    let mut late = 0_u64;
    let stamps: Vec<u64> = clip
        .measured
        .stamps_ns
        .windows(2)
        .map(|w| {
            let step = (w[1] - w[0]) as f64;
            // Now and then rows queue up behind a gap.
            if rng.random_range(0.0..1.0) < 2e-3 {
                late = rng.random_range(2_000_000..8_000_000);
            }
            late = late.saturating_sub((step * 0.8) as u64);
            w[0] + late + (step * share * rng.random_range(0.0..1.0)) as u64
        })
        .collect();
    let mut stamps = stamps;
    stamps.sort_unstable();
    let rows: Vec<usize> = (0..stamps.len()).collect();
    let whole = clip.desired.len() == clip.measured.len();
    clip.measured = JointSeries { stamps_ns: stamps.clone(), ..clip.measured.select_rows(&rows) };
    if whole {
        clip.desired = JointSeries { stamps_ns: stamps, ..clip.desired.select_rows(&rows) };
    }
}

fn scale(series: &mut JointSeries, factor: f64) {
    series.q.iter_mut().chain(&mut series.dq).for_each(|v| *v *= factor);
}

/// Rows of another arm, that stands elsewhere, among the arm's own.
fn interleaved(series: &JointSeries, draw: &Draw, rng: &mut Pcg64) -> JointSeries {
    let off = draw.sign * draw.between(0.01, 1.0);
    let share = if draw.first { 0.5 } else { draw.between(0.02, 0.3) };
    let mut out = JointSeries { dof: series.dof, ..JointSeries::default() };
    let mut push = |stamp: u64, row: usize, off: f64| {
        out.stamps_ns.push(stamp);
        out.q.extend(series.q_row(row).iter().map(|q| q + off));
        out.dq.extend(series.dq_row(row).unwrap_or_default());
        out.tau.extend(series.tau_row(row).unwrap_or_default());
    };
    for row in 0..series.len() {
        push(series.stamps_ns[row], row, 0.0);
        let second = if draw.which < 2 {
            row.is_multiple_of((1.0 / share) as usize)
        } else {
            rng.random_range(0.0..1.0) < share
        };
        if second {
            push(series.stamps_ns[row] + 350_000, row, off);
        }
    }
    out
}

/// An angle that wraps in the middle of its range, with velocities computed across; `visible` in the positions as well.
fn wrap(series: &mut JointSeries, draw: &Draw, visible: bool) {
    let dof = series.dof;
    let joint = (0..dof).max_by(|a, b| spread(series, *a).total_cmp(&spread(series, *b))).unwrap_or(draw.joints[0]);
    let q: Vec<f64> = series.q.iter().skip(joint).step_by(dof).copied().collect();
    let mut sorted = q.clone();
    sorted.sort_unstable_by(f64::total_cmp);
    let limit = sorted[(sorted.len() as f64 * (0.3 + 0.4 * draw.size)) as usize];
    let wrapped: Vec<f64> = q.iter().map(|q| if *q > limit { q - TAU } else { *q }).collect();
    for row in 1..q.len() {
        let seconds = (series.stamps_ns[row] - series.stamps_ns[row - 1]) as f64 * 1e-9;
        if (wrapped[row] - wrapped[row - 1]).abs() > 3.0 {
            series.dq[row * dof + joint] = (wrapped[row] - wrapped[row - 1]) / seconds;
        }
        if visible {
            series.q[row * dof + joint] = wrapped[row];
        }
    }
    if visible {
        series.q[joint] = wrapped[0];
    }
}

fn spread(series: &JointSeries, joint: usize) -> f64 {
    let values = || series.q.iter().skip(joint).step_by(series.dof);
    values().copied().fold(f64::MIN, f64::max) - values().copied().fold(f64::MAX, f64::min)
}

/// Measured torques that hold the arm against another free fall in the base frame than the model's [m/s²].
fn exchange_weight(clip: &mut Clip, cell: &Cell, falls: [f64; 3]) -> Option<()> {
    let arm = ArmModel::from_cell(cell).ok()?;
    let ordered = in_model_order(clip.clone(), &arm).ok()?;
    let dof = ordered.measured.dof;
    if ordered.measured.tau.is_empty() {
        return None;
    }
    *clip = ordered;
    for row in 0..clip.measured.len() {
        let q = joints_from(clip.measured.q_row(row));
        let more = arm.holding(&q, falls).into_iter().zip(arm.gravity(&q)).map(|(new, old)| new - old);
        clip.measured.tau.iter_mut().skip(row * dof).take(dof).zip(more).for_each(|(tau, more)| *tau += more);
    }
    Some(())
}

fn change_poses(object: &mut ObjectSeries, change: impl Fn(Isometry3<f64>) -> Isometry3<f64>) {
    object.poses.iter_mut().for_each(|pose| *pose = Pose::<Base, Object>::from_isometry(change(pose.isometry())));
}

/// What is read as x, y, z, w where w was written first.
fn w_first(pose: Isometry3<f64>) -> Isometry3<f64> {
    let q = pose.rotation;
    let read = UnitQuaternion::from_quaternion(Quaternion::new(q.k, q.w, q.i, q.j));
    Isometry3::from_parts(pose.translation, read)
}

/// Rows of one topic or both that repeat the newest state of a slower robot.
fn held(clip: &mut Clip, draw: &Draw) {
    let period = draw.between(1.25, 6.0);
    let hold = |series: &mut JointSeries| {
        let dof = series.dof;
        for row in 0..series.len() {
            let newest = ((row as f64 / period).floor() * period).ceil() as usize;
            for values in [&mut series.q, &mut series.dq, &mut series.tau] {
                if !values.is_empty() && newest < row {
                    values.copy_within(newest * dof..(newest + 1) * dof, row * dof);
                }
            }
        }
    };
    hold(&mut clip.measured);
    if draw.first {
        hold(&mut clip.desired);
    }
}

/// The newest pose at each turn of a loop that is faster than the camera.
fn logged_by_a_loop(object: &ObjectSeries, draw: &Draw) -> Option<ObjectSeries> {
    let (first, last) = (*object.stamps_ns.first()?, *object.stamps_ns.last()?);
    let step = ((last - first) as f64 / (object.len() - 1) as f64 / draw.between(1.3, 5.0)) as u64;
    let stamps_ns: Vec<u64> = (0..).map(|i| first + i * step).take_while(|stamp| *stamp <= last).collect();
    let newest = |stamp: &u64| object.stamps_ns.partition_point(|taken| taken <= stamp).saturating_sub(1);
    let poses = stamps_ns.iter().map(|stamp| object.poses[newest(stamp)]).collect();
    Some(ObjectSeries { stamps_ns, poses })
}

/// Every so many-th row, at stamps of its own.
fn resampled(series: &JointSeries, every: f64) -> JointSeries {
    let rows: Vec<usize> =
        (0..).map(|i| (f64::from(i) * every) as usize).take_while(|row| *row < series.len()).collect();
    let mut out = series.select_rows(&rows);
    let first = series.stamps_ns[0];
    let step = (series.stamps_ns[series.len() - 1] - first) as f64 / (series.len() - 1) as f64;
    out.stamps_ns = (0..rows.len()).map(|i| first + (i as f64 * every * step) as u64).collect();
    out
}

fn placeholder(clip: &mut Clip, draw: &Draw) {
    let dof = clip.measured.dof;
    let set = |values: &mut Vec<f64>, value: f64| {
        values.iter_mut().skip(draw.joints[0]).step_by(dof).for_each(|v| *v = value)
    };
    match draw.which {
        0 => set(&mut clip.measured.dq, 0.0),
        1 => set(&mut clip.measured.tau, draw.size),
        2 => set(&mut clip.measured.q, draw.size),
        3 => set(&mut clip.desired.dq, 0.0),
        _ => clip.measured.tau.iter_mut().for_each(|tau| *tau = 0.0),
    }
}

/// Moves the commands by so much against everything else [s].
fn shift(clip: &mut Clip, seconds: f64) {
    const ROOM_NS: u64 = 10_000_000_000;
    let by = (seconds * 1e9) as i64;
    for stamps in [&mut clip.measured.stamps_ns, &mut clip.object.stamps_ns] {
        stamps.iter_mut().for_each(|stamp| *stamp += ROOM_NS);
    }
    clip.desired.stamps_ns.iter_mut().for_each(|stamp| *stamp = (*stamp + ROOM_NS).saturating_add_signed(by));
}

/// The clip as it is read from a file that was cut.
fn cut(clip: &mut Clip, draw: &Draw, cell: &Cell) -> Option<()> {
    let folder = std::env::temp_dir().join(format!("twinalign-cut-{}-{:x}", std::process::id(), draw.size.to_bits()));
    std::fs::create_dir_all(&folder).ok()?;
    let read = cut_within(clip, draw, cell, &folder);
    let _gone = std::fs::remove_dir_all(&folder);
    *clip = Clip { file: clip.file.clone(), warnings: Vec::new(), ..read? };
    Some(())
}

fn cut_within(clip: &Clip, draw: &Draw, cell: &Cell, folder: &Path) -> Option<Clip> {
    let (whole, file) = (folder.join("whole.mcap"), folder.join("clip.mcap"));
    let mut writer = ClipWriter::create(&whole, &ClipInfo::default()).ok()?;
    for row in 0..clip.measured.len() {
        let (measured, desired, stamp_ns) = (&clip.measured, &clip.desired, clip.measured.stamps_ns[row]);
        let state = ArmState {
            stamp_ns,
            device_ns: stamp_ns,
            cycle: row as u64,
            dof: measured.dof as u32,
            q: joints_from(measured.q_row(row)),
            dq: joints_from(measured.dq_row(row)?),
            tau_J: joints_from(measured.tau_row(row)?),
            q_d: joints_from(desired.q_row(row)),
            dq_d: joints_from(desired.dq_row(row)?),
            tau_J_d: joints_from(desired.tau_row(row)?),
            ..ArmState::default()
        };
        writer.arm_state(&state).ok()?;
        // As a recorder does twice a second.
        if row % 500 == 499 {
            writer.flush().ok()?;
        }
    }
    writer.finish().ok()?;
    let bytes = input::bytes(&whole, input::Kind::List).ok()?;
    let kept = (bytes.len() as f64 * draw.between(0.5, 0.98)) as usize;
    output::write(&file, &bytes[..kept]).ok()?;
    read_clip(&file, ClipKind::Excitation, cell).ok()
}

fn swap(series: &mut JointSeries, a: usize, b: usize) {
    for values in [&mut series.q, &mut series.dq, &mut series.tau] {
        values.chunks_exact_mut(series.dof).for_each(|row| row.swap(a, b));
    }
}

fn turn(series: &mut JointSeries, joint: usize) {
    for values in [&mut series.q, &mut series.dq, &mut series.tau] {
        values.iter_mut().skip(joint).step_by(series.dof).for_each(|v| *v = -*v);
    }
}

fn stamped(clip: &mut Clip, factor: f64) {
    let firsts = [clip.measured.stamps_ns.first(), clip.desired.stamps_ns.first()];
    let first = firsts.into_iter().flatten().min().copied().unwrap_or(0);
    for stamps in [&mut clip.measured.stamps_ns, &mut clip.desired.stamps_ns, &mut clip.object.stamps_ns] {
        stamps.iter_mut().for_each(|stamp| *stamp = ((*stamp - first.min(*stamp)) as f64 * factor).round() as u64 + 1);
    }
}

fn low_pass(series: &mut JointSeries, time_constant: f64) {
    let dof = series.dof;
    for row in 1..series.len() {
        let seconds = (series.stamps_ns[row] - series.stamps_ns[row - 1]) as f64 * 1e-9;
        let share = 1.0 - (-seconds / time_constant).exp();
        for joint in 0..dof {
            let before = series.dq[(row - 1) * dof + joint];
            let now = &mut series.dq[row * dof + joint];
            *now = before + share * (*now - before);
        }
    }
}
