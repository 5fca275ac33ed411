//! One recorded clip, prepared for being held against the twin: joints in the model's order, stretches that can be
//! simulated, rows that are averaged, joints that are dead. Stamps of the recording, SI.

use super::{stamps, velocity};
use crate::likelihood::object::noise_of;
use crate::statistics::extent;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::msg::MAX_JOINTS;
use shared_mem::recording::{Clip, JointSeries, ReadError};
use shared_mem::time::seconds_between;
use std::ops::{Range, RangeInclusive};
use twin::arm::ArmModel;
use twin::control::CommandTrack;
use twin::replay::in_model_order;

/// Rows within this time are averaged: no motion of an arm is that fast, and the average of white noise loses nothing [ns].
const AVERAGED_NS: u64 = 5_000_000;
/// A log slower than this does not show how a joint follows its command [Hz]: logs of 30 Hz with some jitter do.
const MIN_RATE: f64 = 28.0;
/// A clip shorter than this says nothing [s]: a choice.
const MIN_DURATION: f64 = 0.5;
/// A stretch that counts as a witness of its own: several times as long as a joint remembers [s].
const WITNESS_DURATION: f64 = 0.7;
/// The tool may touch the object this long before its poses show it: a slow camera's latency [ns].
const BEFORE_MOTION_NS: u64 = 150_000_000;
/// An object moves when a pose is so many sigmas from the first ones [1]: a choice.
const MOVED_SIGMAS: f64 = 6.0;
/// A command that moves a joint this far should show [rad]: a choice.
const COMMANDED_MOTION: f64 = 0.02;
/// A joint that follows less than this share of its command is dead [1]: a choice.
const DEAD_SHARE: f64 = 0.01;

/// So many usual steps between two rows may be a jump of the clock [1]: a choice.
const JUMP_STEPS: u64 = 10;
/// Rows before it show how fast the arm was [1].
const ROWS_BEFORE_JUMP: usize = 5;
/// The arm went on by a step rather than by the gap when that leaves less than this share of the other's error [1]: a choice.
const JUMP_SHARE: f64 = 0.2;

/// A clip cannot be used for the arm.
#[derive(Debug, thiserror::Error)]
pub enum ArmClipError {
    /// Other joints than the model's.
    #[error(transparent)]
    Joints(#[from] ReadError),
    /// Nothing was logged.
    #[error("it holds no measured joints; record it again")]
    Empty,
    /// Nobody logged what the arm was commanded to do.
    #[error(
        "it holds no commands, without which the twin's arm cannot be led: what can be explained are its torques, where it has any, by `calibration diagnose --torques`"
    )]
    NoCommands,
    /// The log is too slow.
    #[error("it is logged at {0:.0} Hz; below 30 Hz a log does not show how a joint follows: record at 100 Hz or more")]
    Slow(f64),
    /// Too little is left.
    #[error("only {0:.2} s of it can be simulated; at least {MIN_DURATION} s are needed")]
    Short(f64),
    /// Commands and measurements are of different times.
    #[error("commands and measured joints do not overlap in time: let one machine stamp both, then record again")]
    Apart,
    /// A joint does not follow.
    #[error(
        "joint {joint} `{name}` does not move though it is commanded; look whether it is enabled, then record again"
    )]
    DeadJoint {
        /// Its number, from 1.
        joint: usize,
        name: String,
    },
    /// It falls into pieces.
    #[error("{0}; a stroke has to be recorded in one piece: record it again")]
    Broken(String),
    /// No joint moves.
    #[error("no joint moves though commands ask for it; look whether the arm was enabled")]
    Dead,
}

/// A prepared clip.
#[derive(Debug, Clone)]
pub struct ArmClip {
    /// Joints in the model's order.
    pub recorded: Clip,
    pub(super) commands: CommandTrack,
    /// Measured rows that count.
    pub(super) rows: Vec<usize>,
    /// The row of the commands at each of them, where the torques that were asked for count.
    pub(super) desired_rows: Vec<usize>,
    /// When the twin is asked what the sensors read [ns]: once or more often for each of these.
    pub(super) asked_ns: Vec<u64>,
    /// What of it is simulated in one go, each from its own start.
    pub(super) runs: Vec<Run>,
    /// Which of `rows` are averaged, ascending.
    pub(super) bins: Vec<Range<usize>>,
    /// From here on the tool may touch the object [ns].
    pub alone_until_ns: u64,
    /// Joints that do not follow, or whose readings stand still.
    pub dead: [bool; MAX_JOINTS],
    /// The commands as they were given, where dead joints were commanded to stay instead.
    pub(super) given: Option<JointSeries>,
    /// What a reader has to know, one sentence each.
    pub warnings: Vec<String>,
    /// How uncertain the time of a row is, one sigma [s].
    pub(super) jitter: f64,
    /// Bins of a witness; 0 where the whole clip is one.
    pub(super) stretch: usize,
    /// Stretches of one clock and without a hole in the commands, from stamp to stamp [ns].
    pub(super) pieces: Vec<RangeInclusive<u64>>,
    /// How much of it can be simulated before an object is touched [s].
    pub(super) seconds: f64,
}

/// A part of a clip that is simulated in one go.
#[derive(Debug, Clone)]
pub(super) struct Run {
    /// The measured row at which it begins.
    pub(super) from: usize,
    /// Which of the stamps that are asked for lie in it.
    pub(super) asked: Range<usize>,
}

impl ArmClip {
    pub(super) fn new(recorded: Clip, cell: &Cell, arm: &ArmModel) -> Result<Self, ArmClipError> {
        let mut recorded = in_model_order(recorded, arm)?;
        if recorded.measured.len() < 2 {
            return Err(ArmClipError::Empty);
        }
        if recorded.desired.is_empty() {
            return Err(ArmClipError::NoCommands);
        }
        let evened = stamps::evened(&mut recorded);
        let step_ns = usual_step(&recorded.measured.stamps_ns);
        let rate = 1e9 / step_ns as f64;
        if rate < MIN_RATE {
            return Err(ArmClipError::Slow(rate));
        }
        let (commanded, rows) = (&recorded.desired.stamps_ns, &recorded.measured.stamps_ns);
        if commanded.last() < rows.first() || rows.last() < commanded.first() {
            return Err(ArmClipError::Apart);
        }
        let dead = dead_joints(&recorded);
        if dead.iter().take(arm.dof()).all(|dead| *dead) {
            return Err(ArmClipError::Dead);
        }
        let given = dead.contains(&true).then(|| recorded.desired.clone());
        hold_dead(&mut recorded, &dead);
        let commands = CommandTrack::of_cell(&recorded.desired, cell).ok_or(ArmClipError::NoCommands)?;
        let mut warnings = warnings(&recorded, &commands, &dead);
        warnings.extend(evened);
        if velocity::late_in(&recorded.measured).is_some() {
            // What the filter did is no gap of the twin; the positions say the same without it.
            recorded.measured.dq.clear();
            warnings
                .push("the measured velocities were filtered and come late: the positions count in their place".into());
        } else if velocity::contradict_positions(&recorded.measured) {
            recorded.measured.dq.clear();
            let said =
                "the measured velocities are not the slopes of the positions: the positions count in their place";
            warnings.push(said.into());
        }
        let jump = clock_jump(&recorded.measured, step_ns);
        let until_ns = jump.map_or(u64::MAX, |row| recorded.measured.stamps_ns[row]);
        if let Some(row) = jump {
            let stamps = &recorded.measured.stamps_ns;
            let (at, by) = (seconds_between(stamps[0], stamps[row]), seconds_between(stamps[row], stamps[row + 1]));
            warnings.push(format!("the robot's clock jumps by {by:.3} s at {at:.3} s: what follows was left out"));
        }
        let pieces = pieces(&recorded, &commands, until_ns);
        let alone_until_ns = contact_ns(&recorded, cell);
        let simulated = runs(&recorded.measured.stamps_ns, &pieces, alone_until_ns);
        let rows: Vec<usize> = simulated.iter().flat_map(Clone::clone).collect();
        let asked_ns: Vec<u64> = rows.iter().map(|row| recorded.measured.stamps_ns[*row]).collect();
        let mut runs: Vec<Run> = Vec::new();
        for run in simulated {
            let begins = runs.last().map_or(0, |run| run.asked.end);
            runs.push(Run { from: run.start, asked: begins..begins + run.len() });
        }
        let bins = bins(&asked_ns, &runs, step_ns);
        let seconds = rows.len() as f64 / rate;
        let stretches = (seconds / WITNESS_DURATION).round().max(1.0) as usize;
        let stretch = bins.len().div_ceil(stretches);
        let jitter = stamps::jitter(&recorded.measured);
        Ok(Self {
            recorded,
            commands,
            rows,
            desired_rows: Vec::new(),
            asked_ns,
            runs,
            bins,
            alone_until_ns,
            dead,
            given,
            warnings,
            jitter,
            stretch,
            pieces,
            seconds,
        })
    }

    /// Whether a joint is dead and commanded to stay where it is, rather than to follow its commands unseen.
    pub fn stands_still(&self, joint: usize) -> bool {
        self.dead[joint] && self.given.is_some()
    }

    /// The same with dead joints that follow their commands unseen; `None` where no joint is dead.
    pub(super) fn unseen(&self, cell: &Cell) -> Option<Self> {
        let mut clip = Self { given: None, ..self.clone() };
        clip.recorded.desired = self.given.clone()?;
        clip.commands = CommandTrack::of_cell(&clip.recorded.desired, cell)?;
        for joint in (0..clip.recorded.measured.dof).filter(|joint| self.dead[*joint]) {
            let name = clip.recorded.joint_names.get(joint).map_or("", String::as_str);
            let joint = format!("joint {} `{name}`", joint + 1);
            clip.warnings.retain(|warning| !warning.starts_with(&joint));
            clip.warnings.push(format!(
                "{joint} stands still in its readings, but the other joints feel it move: only they tell its gains; mend its \
                 encoder or the log"
            ));
        }
        Some(clip)
    }

    /// One sigma of what the jitter of stamps makes of a joint's position at a row [rad]: its speed over the neighbouring rows times that.
    pub(super) fn jitter_at(&self, row: usize, joint: usize) -> f64 {
        let JointSeries { stamps_ns, q, dof, .. } = &self.recorded.measured;
        let (before, after) = (row.saturating_sub(1), (row + 1).min(stamps_ns.len() - 1));
        let way = q[after * dof + joint] - q[before * dof + joint];
        self.jitter * way / seconds_between(stamps_ns[before], stamps_ns[after]).max(f64::EPSILON)
    }

    /// The clip, unless it is too short to say anything about the arm.
    pub(super) fn long_enough(self) -> Result<Self, ArmClipError> {
        if self.seconds < MIN_DURATION { Err(ArmClipError::Short(self.seconds)) } else { Ok(self) }
    }

    /// The longest stretch of one clock and without a hole, where there is more than one of them or something is cut off.
    pub(super) fn longest_stretch(&self) -> Option<RangeInclusive<u64>> {
        let last = self.recorded.desired.stamps_ns.last().copied()?;
        let whole = matches!(&self.pieces[..], [one] if *one.end() >= last);
        let longest = self.pieces.iter().max_by_key(|piece| piece.end().saturating_sub(*piece.start()));
        longest.filter(|_| !whole).cloned()
    }

    /// Name of its file.
    pub fn name(&self) -> String {
        name(&self.recorded)
    }

    /// Measured rows that count, in the groups that are averaged.
    pub fn averaged(&self) -> impl Iterator<Item = &[usize]> {
        self.bins.iter().map(|bin| &self.rows[bin.clone()])
    }
}

/// Name of a clip's file.
pub(super) fn name(clip: &Clip) -> String {
    clip.file.file_name().unwrap_or(clip.file.as_os_str()).to_string_lossy().into_owned()
}

/// Median distance of the stamps [ns].
fn usual_step(stamps_ns: &[u64]) -> u64 {
    let mut steps: Vec<u64> = stamps_ns.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_unstable();
    steps.get(steps.len() / 2).copied().unwrap_or(1).max(1)
}

/// The last row before stamps go on by many steps while the arm went on by one: a clock that jumped, not rows that were
/// lost.
fn clock_jump(measured: &JointSeries, step_ns: u64) -> Option<usize> {
    let stamps = &measured.stamps_ns;
    (ROWS_BEFORE_JUMP..stamps.len() - 1).find(|&row| {
        let gap_ns = stamps[row + 1] - stamps[row];
        if gap_ns < JUMP_STEPS * step_ns {
            return false;
        }
        let before_ns = (stamps[row] - stamps[row - ROWS_BEFORE_JUMP]).max(1) as f64;
        let (mut by_clock, mut by_step) = (0.0, 0.0);
        let rows = measured.q_row(row - ROWS_BEFORE_JUMP).iter().zip(measured.q_row(row)).zip(measured.q_row(row + 1));
        for ((earlier, last), next) in rows {
            let rate = (last - earlier) / before_ns;
            by_clock += (next - last - rate * gap_ns as f64).abs();
            by_step += (next - last - rate * step_ns as f64).abs();
        }
        by_step < JUMP_SHARE * by_clock
    })
}

/// Distance between the lowest and highest value of a joint.
fn travel(series: &JointSeries, joint: usize) -> f64 {
    let values = series.q.iter().skip(joint).step_by(series.dof.max(1));
    let [low, high] = extent(values.copied());
    (high - low).max(0.0)
}

fn dead_joints(clip: &Clip) -> [bool; MAX_JOINTS] {
    std::array::from_fn(|joint| {
        let commanded = travel(&clip.desired, joint);
        joint < clip.measured.dof
            && commanded > COMMANDED_MOTION
            && travel(&clip.measured, joint) < DEAD_SHARE * commanded
    })
}

/// A dead joint is commanded to stay where it is, so that the others feel it as it was.
fn hold_dead(clip: &mut Clip, dead: &[bool; MAX_JOINTS]) {
    let dof = clip.desired.dof;
    for joint in (0..dof).filter(|joint| dead[*joint]) {
        let stays = clip.measured.q_row(0)[joint];
        clip.desired.q.iter_mut().skip(joint).step_by(dof).for_each(|q| *q = stays);
        clip.desired.dq.iter_mut().skip(joint).step_by(dof).for_each(|dq| *dq = 0.0);
    }
}

fn warnings(clip: &Clip, commands: &CommandTrack, dead: &[bool; MAX_JOINTS]) -> Vec<String> {
    let mut warnings = clip.warnings.clone();
    warnings.extend(clip.damage.clone());
    let first = clip.measured.stamps_ns[0];
    for hole in commands.holes() {
        let (at, long) = (seconds_between(first, hole.from_ns), seconds_between(hole.from_ns, hole.to_ns));
        warnings.push(format!("no commands for {long:.3} s from {at:.3} s on: left out, and started anew behind it"));
    }
    for joint in (0..clip.measured.dof).filter(|joint| dead[*joint]) {
        let name = clip.joint_names.get(joint).map_or("", String::as_str);
        warnings.push(format!("joint {} `{name}` does not move though it is commanded: it is not fitted", joint + 1));
    }
    warnings
}

/// When the tool may first touch the object; never, in a clip without.
fn contact_ns(clip: &Clip, cell: &Cell) -> u64 {
    let poses = &clip.object.poses;
    let (ClipKind::ControlHitSlide, Some(first)) = (clip.kind, poses.first()) else { return u64::MAX };
    let sigma = noise_of(cell).position;
    let away = |i: &usize| {
        let (a, b) = (poses[*i].position(), first.position());
        // The first pose is as noisy as the others.
        a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt() > MOVED_SIGMAS * sigma * 6.0_f64.sqrt()
    };
    let moved = (0..poses.len()).find(away);
    moved.map_or(u64::MAX, |i| clip.object.stamps_ns[i].saturating_sub(BEFORE_MOTION_NS))
}

/// From the first command on to the last; behind every hole anew, and no further than `until_ns`.
fn pieces(clip: &Clip, commands: &CommandTrack, until_ns: u64) -> Vec<RangeInclusive<u64>> {
    let desired = &clip.desired.stamps_ns;
    let (Some(first), Some(last)) = (desired.first(), desired.last()) else { return Vec::new() };
    // The last command holds as long as commands usually do.
    let last = (last + usual_step(desired)).min(until_ns);
    let starts = std::iter::once(*first).chain(commands.holes().iter().map(|hole| hole.to_ns));
    let ends = commands.holes().iter().map(|hole| hole.from_ns.min(last)).chain(std::iter::once(last));
    starts.zip(ends).filter(|(from, to)| from < to).map(|(from, to)| from..=to).collect()
}

/// Rows of each piece, up to `until_ns`.
fn runs(rows: &[u64], pieces: &[RangeInclusive<u64>], until_ns: u64) -> Vec<Range<usize>> {
    let run = |piece: &RangeInclusive<u64>| {
        let to_ns = until_ns.min(*piece.end());
        rows.partition_point(|stamp| stamp < piece.start())..rows.partition_point(|stamp| *stamp <= to_ns)
    };
    pieces.iter().map(run).filter(|run| run.len() > 1).collect()
}

fn bins(stamps_ns: &[u64], runs: &[Run], step_ns: u64) -> Vec<Range<usize>> {
    let rows = ((AVERAGED_NS + step_ns / 2) / step_ns).max(1) as usize;
    let mut bins = Vec::new();
    for run in runs.iter().map(|run| &run.asked) {
        let mut from = run.start;
        while from < run.end {
            let together = |row: &usize| stamps_ns[*row] - stamps_ns[from] < AVERAGED_NS;
            let to = (from + 1..run.end.min(from + rows)).take_while(together).last().unwrap_or(from) + 1;
            bins.push(from..to);
            from = to;
        }
    }
    bins
}

/// For every measured row the desired one of the same moment; `None` where that was not logged.
pub(super) fn desired_rows(clip: &Clip) -> Vec<Option<usize>> {
    let step_ns = usual_step(&clip.measured.stamps_ns);
    let desired = &clip.desired.stamps_ns;
    let row_at = |stamp: &u64| {
        let after = desired.partition_point(|other| other < stamp);
        let near = [after.checked_sub(1), Some(after)].into_iter().flatten().filter(|row| *row < desired.len());
        near.min_by_key(|row| desired[*row].abs_diff(*stamp))
            .filter(|row| desired[*row].abs_diff(*stamp) * 2 <= step_ns)
    };
    clip.measured.stamps_ns.iter().map(row_at).collect()
}
