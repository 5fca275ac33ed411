//! Holds: rests in poses around the start whose gravity torques differ as much as they can, each approached from both sides.
//! What sags, sticks or has play shows here. Pure; rad, s, N m.
//!
//! Poses are drawn at random and picked one by one, each the one whose gravity torques, as shares of what the joints may
//! give, are furthest from those already picked. Between poses all joints follow one quintic.

use super::body::Body;
use super::excess::Excess;
use super::jet::{Jet, quintic};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use shared_mem::msg::{Joints, MAX_JOINTS};
use twin::arm::JointLimits;

/// Poses that are looked at for each that is wanted.
const CANDIDATES_PER_POSE: usize = 60;
/// How far beside a pose the arm turns round before it comes to rest there [rad].
const REVERSAL_OFFSET: f64 = 0.05;
/// Shortest rest that shows a sag [s].
const SHORTEST_REST: f64 = 0.3;
/// A move between poses is no faster [rad/s] ...
const MAX_SPEED: f64 = 0.6;
/// ... nor accelerates more [rad/s²].
const MAX_ACCELERATION: f64 = 2.5;
/// No move takes less time [s].
const MIN_MOVE_TIME: f64 = 0.4;
/// Peaks of the quintic's first and second derivative.
const PEAKS: [f64; 2] = [1.875, 5.774];

/// What is asked for.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// Pose to start, move around and end in [rad].
    pub start: Joints,
    /// Largest excursion of each joint [rad].
    pub amplitude: f64,
    /// Joints that move.
    pub moving: [bool; MAX_JOINTS],
    /// How many poses.
    pub poses: usize,
    /// Length of the whole [s]; rests get what the moves leave.
    pub duration: f64,
    /// Draws the poses.
    pub seed: u64,
}

/// Poses one after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Hold {
    moves: Vec<Move>,
    duration: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Move {
    begin: f64,
    duration: f64,
    from: Joints,
    to: Joints,
}

impl Hold {
    /// Draws the poses. `refuse` says which limit a pose at rest breaks.
    ///
    /// # Errors
    /// What the first pose breaks, where none can be held.
    pub fn draw(
        wanted: &Wanted,
        limits: &[JointLimits],
        body: &Body,
        refuse: impl Fn(&Joints) -> Option<Excess>,
    ) -> Result<Self, Excess> {
        let mut rng = Pcg64Mcg::seed_from_u64(wanted.seed);
        let beside = REVERSAL_OFFSET.min(0.25 * wanted.amplitude);
        let reach = wanted.amplitude - beside;
        let (mut free, mut first) = (Vec::new(), None);
        for _ in 0..CANDIDATES_PER_POSE * wanted.poses {
            let offset = joints(&wanted.moving, |_| rng.random_range(-reach..reach));
            let around = [beside, -beside, 0.0].map(|side| sum(&offset, &joints(&wanted.moving, |_| side)));
            match around.iter().find_map(|offset| refuse(&sum(&wanted.start, offset))) {
                Some(excess) => first = first.or(Some(excess)),
                None => free.push((offset, load(&sum(&wanted.start, &offset), limits, body))),
            }
        }
        if let (true, Some(excess)) = (free.is_empty(), first) {
            return Err(excess);
        }
        let poses = furthest(&free, load(&wanted.start, limits, body), wanted.poses);
        Ok(Self::through(&poses, &joints(&wanted.moving, |_| beside), wanted.duration))
    }

    /// To each of `poses`, from one side and from the other, and back to the start.
    fn through(poses: &[Joints], beside: &Joints, duration: f64) -> Self {
        let mut stops = Vec::new();
        for pose in poses {
            let other: Joints = std::array::from_fn(|j| pose[j] - beside[j]);
            stops.extend([(sum(pose, beside), false), (*pose, true), (other, false), (*pose, true)]);
        }
        stops.push(([0.0; MAX_JOINTS], false));
        let mut at = [0.0; MAX_JOINTS];
        let mut moving = 0.0;
        for (stop, _) in &stops {
            moving += time(&at, stop);
            at = *stop;
        }
        let rests = stops.iter().filter(|(_, rests)| *rests).count().max(1);
        let rest = ((duration - moving) / rests as f64).max(SHORTEST_REST);
        let (mut moves, mut begin, mut from) = (Vec::new(), 0.0, [0.0; MAX_JOINTS]);
        for (to, rests) in stops {
            let duration = time(&from, &to);
            moves.push(Move { begin, duration, from, to });
            begin += duration + if rests { rest } else { 0.0 };
            from = to;
        }
        Self { moves, duration: begin }
    }

    /// Length [s].
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Excursion of `joint` at `t` [s] and its derivatives [rad].
    pub fn at(&self, joint: usize, t: f64) -> Jet {
        let Move { begin, duration, from, to } =
            self.moves[self.moves.partition_point(|m| m.begin <= t).saturating_sub(1)];
        if t > begin + duration {
            return [to[joint], 0.0, 0.0, 0.0];
        }
        let mut jet = quintic((t - begin) / duration, 1.0 / duration).map(|x| (to[joint] - from[joint]) * x);
        jet[0] += from[joint];
        jet
    }
}

/// Time of a move [s].
fn time(from: &Joints, to: &Joints) -> f64 {
    let way = from.iter().zip(to).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    MIN_MOVE_TIME.max(PEAKS[0] * way / MAX_SPEED).max((PEAKS[1] * way / MAX_ACCELERATION).sqrt())
}

fn joints(moving: &[bool; MAX_JOINTS], mut value: impl FnMut(usize) -> f64) -> Joints {
    std::array::from_fn(|joint| if moving[joint] { value(joint) } else { 0.0 })
}

fn sum(a: &Joints, b: &Joints) -> Joints {
    std::array::from_fn(|joint| a[joint] + b[joint])
}

/// Gravity torques as shares of what the joints may give.
fn load(q: &Joints, limits: &[JointLimits], body: &Body) -> Joints {
    let gravity = body.model().gravity(q);
    std::array::from_fn(|joint| limits.get(joint).map_or(0.0, |limit| gravity[joint] / limit.torque))
}

/// So many of the poses, each as unlike the ones before as it can be.
fn furthest(free: &[(Joints, Joints)], start: Joints, count: usize) -> Vec<Joints> {
    let apart = |a: &Joints, b: &Joints| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let mut distance: Vec<f64> = free.iter().map(|(_, load)| apart(load, &start)).collect();
    let mut picked = Vec::with_capacity(count);
    for _ in 0..count.min(free.len()) {
        let (best, _) =
            distance.iter().enumerate().fold((0, -1.0), |best, (i, d)| if *d > best.1 { (i, *d) } else { best });
        let (pose, load) = free[best];
        picked.push(pose);
        distance.iter_mut().zip(free).for_each(|(distance, (_, other))| *distance = distance.min(apart(other, &load)));
        distance[best] = -1.0;
    }
    picked
}

#[cfg(test)]
mod tests {
    use super::super::jet::tests::assert_derivatives;
    use super::*;
    use crate::limits;
    use shared_mem::cell::{Cell, Robot};

    fn drawn(poses: usize) -> (Hold, Body, Joints) {
        let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
        let cell = Cell { robot: Some(robot), ..Cell::default() };
        let body = Body::of(&cell).expect("an FR3");
        let limits = limits::of(&cell, &body);
        let start = *body.model().ready();
        let moving = std::array::from_fn(|joint| joint < 7);
        let wanted = Wanted { start, amplitude: 0.4, moving, poses, duration: 40.0, seed: 3 };
        let hold = Hold::draw(&wanted, &limits, &body, |_| None).expect("poses");
        (hold, body, start)
    }

    #[test]
    fn its_derivatives_are_those_of_its_value() {
        let (hold, ..) = drawn(3);
        // Not where a move begins or ends: there the jerk leaps.
        let inside = hold.moves.iter().flat_map(|m| [0.3, 0.7].map(|share| m.begin + share * m.duration));
        assert_derivatives(|t| hold.at(2, t), inside);
    }

    #[test]
    fn every_pose_is_reached_from_both_sides_and_held_and_gravity_pulls_in_many_ways() {
        let (hold, body, start) = drawn(8);
        let mut poses: Vec<(Joints, Vec<f64>)> = Vec::new();
        for pair in hold.moves.windows(2).filter(|w| w[1].begin > w[0].begin + w[0].duration + 0.25) {
            let side = pair[0].from[0] - pair[0].to[0];
            match poses.iter_mut().find(|(pose, _)| *pose == pair[0].to) {
                Some((_, sides)) => sides.push(side),
                None => poses.push((pair[0].to, vec![side])),
            }
        }
        assert_eq!(poses.len(), 8);
        assert!(poses.iter().all(|(_, sides)| sides.len() == 2 && sides[0] * sides[1] < 0.0), "{poses:?}");
        let pull = |joint: usize| -> Vec<f64> {
            poses.iter().map(|(offset, _)| body.model().gravity(&sum(&start, offset))[joint]).collect()
        };
        // Joint 3's torque changes its sign; the others' cannot so near to the ready pose, but they differ.
        let spans = [1, 2, 3, 4].map(|joint| {
            let pull = pull(joint);
            [pull.iter().copied().fold(f64::INFINITY, f64::min), pull.iter().copied().fold(f64::NEG_INFINITY, f64::max)]
        });
        assert!(spans[1][0] < 0.0 && spans[1][1] > 0.0, "{spans:?}");
        assert!(spans.iter().all(|[lo, hi]| hi - lo > 0.5), "{spans:?}");
        assert!((hold.duration() - 40.0).abs() < 1e-6, "{}", hold.duration());
        assert!(hold.at(3, hold.duration())[0].abs() < 1e-12);
    }
}
