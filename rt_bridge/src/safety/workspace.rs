//! Where the arm may be: all of it above the table, the tool tip in a box besides. Asked of a whole way to rest, it looks at
//! the commanded positions of that way, and passes over those which the arm is too slow to leave the space by.
//!
//! What is kept inside here is what is *commanded*, as long as the arm gets it; for the arm that is there, which does not
//! follow exactly, see [`super::Measured`]. Where set points are lost, a robot goes on by itself with its last acceleration;
//! the first set point that reaches it again is one from which it can stop inside, or braking begins with it, and then the
//! arm may be beyond by what it moved meanwhile.
//!
//! An arm that is outside when command of it is taken may hold, and may move where it gets no deeper than it was: see
//! [`Outside`].

use super::{Limits, Stopping, Trace};
use shared_mem::cell::Cell;
use shared_mem::msg::{Joints, MAX_JOINTS};
use twin::arm::{ArmBalls, ArmModel, MOST_BALLS};

/// Gap that is kept between the table and tool or links [m].
pub const TABLE_GAP: f64 = 2e-3;
/// Half edge of the box around the base: beyond the reach of an FR3 with a short tool [m].
const REACH: f64 = 1.2;
/// How much deeper than it was an arm that began outside may get on its way [m]: joints do not come to rest together, so a
/// way up may dip a little where it is stopped.
const DIP: f64 = 1e-3;
/// What is forgiven to rounding [m].
const ROUNDING: f64 = 1e-7;
/// How much nearer than a command a measured arm may come [m]: a quarter of the gap, so that one which rests where it may just
/// be commanded to rest is not outside for its noise.
const FORGIVEN: f64 = 0.5e-3;

/// Bounds that are kept: every ball of the arm above the table, then the tip in its box.
const BOUNDS: usize = MOST_BALLS + 1;

/// The space of one cell.
#[derive(Debug, Clone)]
pub struct Workspace {
    /// `None` where positions in space mean nothing: then everything is inside.
    arm: Option<ArmBalls>,
    /// Lowest corner of the box for the centre of the tip's cap [m].
    low: [f64; 3],
    high: [f64; 3],
    /// Height that every ball of the arm stays above; minus infinity without a table.
    floor: f64,
    /// How fast the tip, and how fast any ball's height, changes with each joint at most.
    levers: [Joints; 2],
}

/// How far the arm is outside each bound. A bound that is not kept may be passed no deeper than the arm was when it last came
/// to rest, and a millimetre.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outside {
    /// Negative [m]; 0 inside.
    by: [f64; BOUNDS],
    /// How far a bound that is kept may be passed [m].
    forgiven: f64,
}

impl Outside {
    /// How deep each bound may be passed, negative [m].
    fn let_to(&self) -> [f64; BOUNDS] {
        // Half, so that noise does not take an arm that rests at the edge of what is forgiven beyond it.
        self.by.map(|by| if by < -0.5 * self.forgiven { by - DIP } else { -self.forgiven })
    }
}

impl Workspace {
    /// The space of a cell, whose arm is `model`: tool and links 2 mm above its table, the tip within 1.2 m of the base along
    /// each axis.
    pub fn of(cell: &Cell, model: &ArmModel) -> Self {
        let arm = ArmBalls::of(cell, model);
        let levers = arm.as_ref().map_or([[0.0; MAX_JOINTS]; 2], |arm| [arm.levers(), arm.height_levers()]);
        Self {
            arm,
            low: [-REACH; 3],
            high: [REACH, REACH, 2.0 * REACH],
            floor: cell.table.map_or(f64::NEG_INFINITY, |table| table.height + TABLE_GAP),
            levers,
        }
    }

    /// Distance to the nearest bound at joint positions `q` [m]; negative outside.
    pub fn room(&self, q: &Joints) -> f64 {
        let [above, within] = self.left(q, &Outside { by: [0.0; BOUNDS], forgiven: 0.0 });
        smaller(above, within)
    }

    /// How far outside an arm is that is commanded to be at `q`.
    pub fn outside(&self, q: &Joints) -> Outside {
        Outside { by: self.distances(q).map(|distance| distance.min(0.0)), forgiven: 0.0 }
    }

    /// How far outside an arm is that was measured at `q`.
    pub fn outside_measured(&self, q: &Joints) -> Outside {
        Outside { forgiven: FORGIVEN, ..self.outside(q) }
    }

    /// The same of an arm that came to rest at `q` and was `before` where it rested last: what it came nearer is kept, and
    /// no motion that was admitted makes it more. Only an arm that lost set points is deeper than it was let.
    pub fn outside_after(&self, q: &Joints, before: &Outside) -> Outside {
        let mut outside = *before;
        let bounds = outside.by.iter_mut().zip(before.let_to()).zip(self.distances(q));
        for ((by, let_to), distance) in bounds {
            *by = if distance < let_to - 2.0 * ROUNDING { distance } else { by.max(distance.min(0.0)) };
        }
        outside
    }

    /// `true` when the whole way to rest from `trace` is inside, or no deeper outside than `outside` lets it.
    pub fn keeps(&self, trace: &Trace, limits: &Limits, period_s: f64, outside: &Outside) -> bool {
        if self.arm.is_none() {
            return true;
        }
        let way = Stopping::of(trace, limits, period_s);
        let last = (way.duration() / period_s).ceil() as usize;
        let mut period = 0;
        loop {
            let moment = way.at(period as f64 * period_s);
            let left @ [above, within] = self.left(&moment.q, outside);
            if !is_inside(left) {
                return false;
            }
            if self.is_too_little(&moment.left, left) {
                return true;
            }
            let closing = self.at_most(&moment.fastest);
            // So many periods pass before any bound can be reached, however the joints move.
            let free = |room: f64, closing: f64| (room / (closing * period_s)) as usize;
            period += 1 + free(within, closing[0]).min(free(above, closing[1])).min(last);
            if period > last {
                return true;
            }
        }
    }

    /// Distance of each ball from the table, then of the tip from the nearest face of its box; negative outside.
    fn distances(&self, q: &Joints) -> [f64; BOUNDS] {
        let mut distances = [f64::INFINITY; BOUNDS];
        if let Some(arm) = &self.arm {
            let extent = arm.at(q);
            for (distance, lowest) in distances.iter_mut().zip(extent.lowest) {
                *distance = lowest - self.floor;
            }
            let faces = extent.tip.iter().zip(self.low.iter().zip(&self.high));
            let within =
                faces.fold(f64::INFINITY, |least, (x, (low, high))| smaller(least, smaller(x - low, high - x)));
            distances[BOUNDS - 1] = within;
        }
        distances
    }

    /// What is left at `q` before the table, and before the box, is passed deeper than `outside` lets [m].
    pub(super) fn left(&self, q: &Joints, outside: &Outside) -> [f64; 2] {
        let mut left = self.distances(q);
        for (left, let_to) in left.iter_mut().zip(outside.let_to()) {
            *left -= let_to;
        }
        let [above @ .., within] = left;
        [above.into_iter().fold(f64::INFINITY, smaller), within]
    }

    /// Whether joints that move by no more than this [rad] use up nothing of what is `left`.
    pub(super) fn is_too_little(&self, way: &Joints, left: [f64; 2]) -> bool {
        let [within, above] = self.at_most(way);
        above <= left[0] && within <= left[1]
    }

    /// How far the tip, and how far any ball's height, moves at most when each joint moves as given [m].
    fn at_most(&self, joints: &Joints) -> [f64; 2] {
        self.levers.map(|levers| levers.iter().zip(joints).map(|(lever, q)| lever * q).sum())
    }

    /// Whether places in space mean something for this arm.
    pub(super) fn is_somewhere(&self) -> bool {
        self.arm.is_some()
    }
}

/// Whether nothing is passed deeper than it is let; what is no number is.
pub(super) fn is_inside([above, within]: [f64; 2]) -> bool {
    above >= -ROUNDING && within >= -ROUNDING
}

/// The smaller of two numbers, or the one that is none.
fn smaller(a: f64, b: f64) -> f64 {
    if a < b || a.is_nan() { a } else { b }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use shared_mem::cell::Table;

    const T: f64 = 1e-3;

    fn shipped() -> (Cell, ArmModel) {
        let text = include_str!("../../../config/fr3_cell.toml");
        let cell = Cell::parse(text, "cell.toml".as_ref()).expect("the shipped cell");
        let model = ArmModel::from_cell(&cell).expect("an FR3");
        (cell, model)
    }

    /// The tool looks down beside the base, lower than any link.
    const LOW: Joints = [0.0, 0.3, 0.0, -2.0, 0.0, 2.3, 0.785, 0.0];

    #[test]
    fn the_tool_keeps_two_millimetres_above_the_table_and_what_is_nowhere_is_outside() {
        let (mut cell, model) = shipped();
        // The centre of the tip's cap lies a radius behind the end of the tool.
        let cap = model.tip(&LOW).transform_point(&[0.0, 0.0, -0.012].into()).z;
        assert!((Workspace::of(&cell, &model).room(&LOW) - (cap - 0.014)).abs() < 1e-9);
        cell.table = Some(Table { height: cap - 0.013 });
        assert!((Workspace::of(&cell, &model).room(&LOW) + 0.001).abs() < 1e-9);
        let nowhere = [f64::NAN; MAX_JOINTS];
        let still = Trace::at_rest(nowhere);
        let space = Workspace::of(&cell, &model);
        assert!(!space.keeps(&still, &Limits::fr3(), T, &space.outside(&nowhere)));
    }

    #[test]
    fn a_cell_without_a_table_has_the_box_alone() {
        let (mut cell, model) = shipped();
        cell.table = None;
        let room = Workspace::of(&cell, &model).room(model.ready());
        let tip = model.tip(model.ready()).position();
        assert!((room - (1.2 - tip[0])).abs() < 1e-9, "{room}");
    }

    #[test]
    fn an_arm_that_began_outside_may_rise_and_sinks_no_deeper_however_often_it_rests() {
        let (mut cell, model) = shipped();
        let mut q = LOW;
        cell.table = Some(Table { height: model.tip(&q).position()[2] + 0.01 });
        let space = Workspace::of(&cell, &model);
        let mut outside = space.outside(&q);
        let keeps = |q: &Joints, outside: &Outside| space.keeps(&Trace::at_rest(*q), &Limits::fr3(), T, outside);
        assert!(keeps(&q, &outside), "it may hold");
        let height = |q: &Joints| model.tip(q).position()[2];
        // The shoulder forward lowers the tool.
        let (start, at_first) = (q[1], height(&q));
        for _ in 0..1000 {
            let mut lower = q;
            lower[1] += 1e-4;
            if keeps(&lower, &outside) {
                q = lower;
                outside = space.outside_after(&q, &outside);
            }
        }
        let sunk = at_first - height(&q);
        assert!((0.9e-3..1.001e-3).contains(&sunk), "{sunk} m");
        q[1] = start - 0.05;
        assert!(keeps(&q, &outside), "it may rise");
        outside = space.outside_after(&q, &outside);
        q[1] = start;
        assert!(!keeps(&q, &outside), "and what it came out it stays out");
    }

    proptest! {
        /// Positions on the way are passed over only where all of them are inside.
        #[test]
        fn a_way_is_kept_when_each_of_its_commanded_positions_is_inside(
            places in prop::array::uniform7(0.05..0.95_f64),
            v in prop::array::uniform7(-1.5..1.5_f64),
            a in prop::array::uniform7(-10.0..10.0_f64),
            gap in -0.02..0.05_f64,
        ) {
            let (mut cell, model) = shipped();
            let limits = Limits::fr3();
            let mut trace = Trace::at_rest([0.0; MAX_JOINTS]);
            for (i, joint) in limits.counted().enumerate() {
                trace.q[i] = joint.q_min + places[i] * (joint.q_max - joint.q_min);
                (trace.v[i], trace.a[i]) = (v[i], a[i]);
            }
            // A table just about where the arm will have its lowest point.
            let way = Stopping::of(&trace, &limits, T);
            let last = (way.duration() / T).ceil() as usize;
            cell.table = Some(Table { height: 0.0 });
            let level = Workspace::of(&cell, &model);
            let least = |space: &Workspace| {
                let rooms = (0..=last).map(|k| space.room(&way.at(k as f64 * T).q));
                rooms.fold(f64::INFINITY, f64::min)
            };
            cell.table = Some(Table { height: least(&level) - gap });
            let space = Workspace::of(&cell, &model);
            prop_assert_eq!(space.keeps(&trace, &limits, T, &Outside { by: [0.0; BOUNDS], forgiven: 0.0 }), least(&space) >= -ROUNDING);
        }
    }
}
