//! The state an arm was in when its recording begins, from noisy rows.

use super::{ArmRollout, CommandTrack};
use crate::arm::{JointState, MAX_JOINTS};
use shared_mem::msg::joints_from;
use shared_mem::recording::JointSeries;

/// Rows within this time of the first one count [ns]: a velocity is then known to 8e-5 rad/s from encoders good to 4e-6 rad, and what
/// the simulation lacks, as a load, has little time to pass for velocity.
const WINDOW_NS: u64 = 30_000_000;
/// With fewer rows in the first 20 ms a resolver's steps would pass for velocity, and the logged velocity is better.
const ENOUGH_ROWS: usize = 10;
const NEAR_NS: u64 = 20_000_000;
/// Each pass corrects the start by what the pass before left over.
const PASSES: usize = 2;
/// The start is moved by so much to see what the rows make of it [rad, rad/s]: what encoders and logged velocities are off by.
const POSITION_STEP: f64 = 1e-5;
const VELOCITY_STEP: f64 = 1e-3;
/// Share of what a free joint would make of its velocity that is added to what this one makes of it: the velocity of a joint that
/// friction stops at once does not matter, and must not grow out of noise.
const HOLD: f64 = 0.01;

impl ArmRollout<'_> {
    /// Where the arm was and how fast at row `from` of `measured`; `None` when there is no such row.
    ///
    /// A first guess, the row itself, is simulated for 30 ms under the commands; position and velocity at its beginning are then those
    /// that bring the simulation nearest to the measured positions (least squares, joint by joint). So a motion that sets off in
    /// this time does not pass for initial velocity, nor does what the controller does about a guess that is off.
    pub fn start_state(&self, measured: &JointSeries, from: usize, commands: &CommandTrack) -> Option<JointState> {
        let first = *measured.stamps_ns.get(from)?;
        let within = |time: u64| measured.stamps_ns[from..].iter().take_while(|stamp| **stamp - first <= time).count();
        let mut start = first_guess(measured, from);
        if within(NEAR_NS) < ENOUGH_ROWS {
            return Some(start);
        }
        let stamps_ns = &measured.stamps_ns[from..from + within(WINDOW_NS)];
        let simulated = |start: &JointState| {
            let mut states = vec![JointState::default(); stamps_ns.len()];
            self.run(start, first, commands, stamps_ns, &mut states);
            states
        };
        let dof = measured.dof.min(MAX_JOINTS);
        let (mut further, mut faster) = (start, start);
        further.q[..dof].iter_mut().for_each(|q| *q += POSITION_STEP);
        faster.dq[..dof].iter_mut().for_each(|dq| *dq += VELOCITY_STEP);
        let (mut base, further, faster) = (simulated(&start), simulated(&further), simulated(&faster));
        let slopes: Vec<Vec<[f64; 3]>> = (0..dof)
            .map(|joint| {
                let slope = |row: usize| {
                    let from = base[row].q[joint];
                    let time = (stamps_ns[row] - first) as f64 * 1e-9;
                    let by_position = (further[row].q[joint] - from) / POSITION_STEP;
                    [by_position, (faster[row].q[joint] - from) / VELOCITY_STEP, time]
                };
                (0..stamps_ns.len()).map(slope).collect()
            })
            .collect();
        for pass in 0..PASSES {
            for (joint, slopes) in slopes.iter().enumerate() {
                let ahead = |(row, state): (usize, &JointState)| measured.q_row(from + row)[joint] - state.q[joint];
                let (position, velocity) = nearest(slopes, base.iter().enumerate().map(ahead));
                start.q[joint] += position;
                start.dq[joint] += velocity;
            }
            if pass + 1 < PASSES {
                base = simulated(&start);
            }
        }
        Some(start)
    }
}

/// The row itself; where no velocities were logged, the slope to the next one.
fn first_guess(measured: &JointSeries, from: usize) -> JointState {
    let mut state = JointState::at_rest(joints_from(measured.q_row(from)));
    if let Some(dq) = measured.dq_row(from) {
        state.dq = joints_from(dq);
    } else if let [a, b, ..] = measured.stamps_ns[from..] {
        let dt = (b - a) as f64 * 1e-9;
        for (joint, dq) in state.dq.iter_mut().enumerate().take(measured.dof) {
            *dq = (measured.q_row(from + 1)[joint] - measured.q_row(from)[joint]) / dt;
        }
    }
    state
}

/// By how much position and velocity at the beginning have to change for the rows to move by `ahead`. `slopes`: what each row makes
/// of a change of either, and its time.
fn nearest(slopes: &[[f64; 3]], ahead: impl Iterator<Item = f64>) -> (f64, f64) {
    let ([mut pp, mut pv, mut vv, mut held], [mut p, mut v]) = ([0.0; 4], [0.0; 2]);
    for ([by_position, by_velocity, time], ahead) in slopes.iter().zip(ahead) {
        pp += by_position * by_position;
        pv += by_position * by_velocity;
        vv += by_velocity * by_velocity;
        held += HOLD * time * time;
        p += by_position * ahead;
        v += by_velocity * ahead;
    }
    let vv = vv + held;
    let determinant = pp * vv - pv * pv;
    if determinant > 0.0 { ((vv * p - pv * v) / determinant, (pp * v - pv * p) / determinant) } else { (0.0, 0.0) }
}
