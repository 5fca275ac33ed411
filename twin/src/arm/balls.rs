//! How much space an arm and its tool take: balls that move with the links. The hull of a link's balls encloses the link, so
//! the arm is above a plane where all its balls are. Base frame, m. [`ArmBalls::at`] allocates nothing: the bridge's guard asks it
//! for many poses in each control cycle.

use super::kernel::{Chain, first, with_dof};
use super::spatial::{add, rotate};
use super::{ArmModel, Joints, MAX_JOINTS};
use shared_mem::cell::Cell;

/// Balls of an FR3 behind joints 2 to 7: the joint counted from 0, centre in its link's frame, radius [m]. Fitted to the
/// vendor's meshes (`franka_description` 1.0.1) from outside; how closely is tested beside the meshes, in `render::robot`.
/// Base, first link and shoulder are left out: they stand on the table or turn upright above it.
const FR3: [(usize, [f64; 3], f64); 15] = [
    (1, [0.0, -0.144, 0.0], 0.075),
    (2, [0.0, 0.0, -0.077], 0.073),
    (2, [0.083, 0.054, 0.003], 0.063),
    (2, [0.082, 0.029, 0.0], 0.064),
    (3, [0.0, 0.0, 0.043], 0.071),
    (3, [-0.083, 0.079, 0.0], 0.072),
    (3, [-0.026, 0.031, 0.040], 0.058),
    (4, [0.0, 0.003, -0.211], 0.077),
    (4, [0.0, 0.082, -0.002], 0.060),
    (4, [0.0, 0.042, -0.001], 0.058),
    (5, [-0.003, 0.0, 0.012], 0.055),
    (5, [0.080, 0.035, 0.0], 0.054),
    (5, [0.088, -0.015, 0.0], 0.059),
    (6, [-0.002, -0.002, 0.079], 0.053),
    (6, [0.044, 0.044, 0.086], 0.041),
];

/// Balls at most: an FR3's, or one a joint, and the two ends of a tool.
pub const MOST_BALLS: usize = FR3.len() + 2;

#[derive(Debug, Clone, Copy, Default)]
struct Ball {
    /// Joint that it lies behind, from 0.
    link: usize,
    /// In that link's frame [m].
    centre: [f64; 3],
    radius: f64,
}

/// The space of one arm.
#[derive(Debug, Clone)]
pub struct ArmBalls {
    model: ArmModel,
    balls: [Ball; MOST_BALLS],
    count: usize,
}

/// Where the arm is, as far as a plane and a box ask.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Height of each ball's lowest point; infinite beyond the arm's number of balls. The last of them is the tip's.
    pub lowest: [f64; MOST_BALLS],
    /// Centre of the tip's cap.
    pub tip: [f64; 3],
}

impl ArmBalls {
    /// The hull of a cell's arm, whose model is `model`: the links of an arm built like an FR3, or the line from joint to joint of another arm, of
    /// which nobody says how thick it is; and the tool. `None` where positions in space mean nothing.
    pub fn of(cell: &Cell, model: &ArmModel) -> Option<Self> {
        if !model.has_geometry() {
            return None;
        }
        let mut hull = Self { model: model.clone(), balls: [Ball::default(); MOST_BALLS], count: 0 };
        if model.is_built_like(&ArmModel::fr3()) {
            FR3.into_iter().for_each(|(link, centre, radius)| hull.push(Ball { link, centre, radius }));
        } else {
            // The first joint's frame stays where it is.
            (1..model.dof()).for_each(|link| hull.push(Ball { link, ..Ball::default() }));
        }
        let radius = cell.tool.as_ref().map_or(0.0, |tool| tool.radius);
        let on_flange = |z: f64| (model.flange * nalgebra::Point3::new(0.0, 0.0, z)).coords.into();
        let link = model.dof() - 1;
        hull.push(Ball { link, centre: on_flange(0.0), radius });
        hull.push(Ball { link, centre: on_flange(model.tool_length() - radius), radius });
        Some(hull)
    }

    fn push(&mut self, ball: Ball) {
        if let Some(place) = self.balls.get_mut(self.count) {
            *place = ball;
            self.count += 1;
        }
    }

    /// Where the balls are at joint positions `q` [rad].
    pub fn at(&self, q: &Joints) -> Extent {
        with_dof!(self.model, N => {
            let frames = Chain::<N>::at(first(&self.model.links), first(q)).frames;
            let mut extent = Extent { lowest: [f64::INFINITY; MOST_BALLS], tip: [f64::NAN; 3] };
            for (lowest, ball) in extent.lowest.iter_mut().zip(&self.balls).take(self.count) {
                if let Some(frame) = frames.get(ball.link) {
                    extent.tip = add(frame.origin, rotate(&frame.rotation, ball.centre));
                    *lowest = extent.tip[2] - ball.radius;
                }
            }
            extent
        })
    }

    /// Its balls at joint positions `q` [rad], each with the joint that it lies behind, from 0, with its centre and its radius [m]; the
    /// last two are the ends of the tool.
    pub fn balls(&self, q: &Joints) -> Vec<(usize, [f64; 3], f64)> {
        with_dof!(self.model, N => {
            let frames = Chain::<N>::at(first(&self.model.links), first(q)).frames;
            let of_arm = self.balls.iter().take(self.count);
            let placed = of_arm.filter_map(|ball| {
                let frame = frames.get(ball.link)?;
                Some((ball.link, add(frame.origin, rotate(&frame.rotation, ball.centre)), ball.radius))
            });
            placed.collect()
        })
    }

    /// How fast any ball's centre moves at most while a joint moves at unit speed, whatever the pose, joint by joint:
    /// [m/rad], or 1 where a joint slides.
    pub fn levers(&self) -> Joints {
        let mut levers = [0.0; MAX_JOINTS];
        for (joint, lever) in levers.iter_mut().enumerate().take(self.model.dof) {
            *lever = if self.model.links[joint].slides { 1.0 } else { self.reach_behind(joint) };
        }
        levers
    }

    /// The same for heights alone: turning about an upright axis changes none. Only the first joint's axis stays as it is.
    pub fn height_levers(&self) -> Joints {
        let mut levers = self.levers();
        let [x, y, z] = self.model.links[0].rotation.map(|row| row[2]);
        levers[0] *= if self.model.links[0].slides { z.abs() } else { x.hypot(y) };
        levers
    }

    /// Longest way from a joint along the links behind it to the centre of a ball [m].
    fn reach_behind(&self, joint: usize) -> f64 {
        let norm = |v: &[f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
        let (mut along, mut reach) = (0.0, 0.0_f64);
        for link in joint..self.model.dof {
            if link > joint {
                let slid = if self.model.links[link].slides {
                    self.model.q_min()[link].abs().max(self.model.q_max()[link].abs())
                } else {
                    0.0
                };
                along += norm(&self.model.links[link].translation) + slid;
            }
            let balls = self.balls.iter().take(self.count).filter(|ball| ball.link == link);
            reach = balls.fold(reach, |reach, ball| reach.max(along + norm(&ball.centre)));
        }
        reach
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn shipped() -> ArmBalls {
        let text = include_str!("../../../config/fr3_cell.toml");
        let cell = Cell::parse(text, "cell.toml".as_ref()).expect("the shipped cell");
        ArmBalls::of(&cell, &ArmModel::from_cell(&cell).expect("an FR3")).expect("an arm with geometry")
    }

    #[test]
    fn the_tip_is_the_lowest_of_an_arm_that_reaches_down() {
        let hull = shipped();
        let low = shared_mem::msg::joints_from(&[0.0, 0.3, 0.0, -2.0, 0.0, 2.3, 0.785]);
        let (at, end) = (hull.at(&low), hull.model.tip(&low).position());
        let lowest = at.lowest.iter().copied().fold(f64::INFINITY, f64::min);
        assert!((lowest - end[2]).abs() < 1e-9 && (at.tip[2] - 0.012 - end[2]).abs() < 1e-9, "{at:?} and {end:?}");
    }

    #[test]
    fn an_arm_of_unknown_thickness_is_a_line_and_one_of_which_only_names_are_known_is_nowhere() {
        let mut model = ArmModel::fr3();
        model.links[4].translation[1] += 0.1;
        let hull = ArmBalls::of(&Cell::default(), &model).expect("an arm with geometry");
        let (at, ready) = (hull.at(model.ready()), *model.ready());
        let heights: Vec<f64> = model.joint_origins(&ready)[1..7].iter().map(|origin| origin[2]).collect();
        assert!(at.lowest[..6].iter().zip(&heights).all(|(a, b)| (a - b).abs() < 1e-12));
        let flange = model.flange(&ready).position();
        assert!(at.tip.iter().zip(flange).all(|(a, b)| (a - b).abs() < 1e-12));
        let cell = Cell::parse("[robot]\njoints = [\"pan\"]\n", "cell.toml".as_ref()).expect("a cell");
        assert!(ArmBalls::of(&cell, &ArmModel::from_cell(&cell).expect("one joint")).is_none());
    }

    proptest! {
        #[test]
        fn no_ball_moves_faster_than_the_levers_say(
            q in prop::array::uniform7(-2.5..2.5_f64), dq in prop::array::uniform7(-1.0..1.0_f64),
        ) {
            let (hull, dt) = (shipped(), 1e-4);
            let joints = |t: f64| -> Joints { std::array::from_fn(|i| q.get(i).map_or(0.0, |q| q + t * dq[i])) };
            let [before, after] = [0.0, dt].map(|t| hull.at(&joints(t)));
            let bound = |levers: Joints| dt * levers.iter().zip(&dq).map(|(l, dq)| l * dq.abs()).sum::<f64>() + 1e-12;
            let rises = bound(hull.height_levers());
            for (a, b) in before.lowest.iter().zip(&after.lowest).filter(|(a, _)| a.is_finite()) {
                prop_assert!((a - b).abs() <= rises, "{} of {rises}", a - b);
            }
            let moves = bound(hull.levers());
            let moved = before.tip.iter().zip(&after.tip).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt();
            prop_assert!(moved <= moves, "{moved} of {moves}");
        }
    }
}
