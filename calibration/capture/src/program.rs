//! Which stroke is next: a session's strokes come from all sides, at all speeds, over the whole face, however few there are.
//! Pure. Base frame; m, s, rad.
//!
//! Wishes follow a sequence without gaps or clusters in all its dimensions (Roberts 2018: steps of powers of the generalised
//! golden ratio), counted by the clip's number, so that a session continued tomorrow fills what is still empty. Every
//! [`ANCHOR`]-th stroke repeats the first: the same stroke again tells scatter from gap and drift from both.

use super::body::Body;
use super::obstacle::{self, Blocked};
use super::stroke::{self, Stroke, StrokeError, StrokePlan};
use super::way::{WayError, Ways};
use shared_mem::cell::{Cell, GRAVITY};
use shared_mem::msg::Joints;
use shared_mem::msg::motion::SetPoint;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use twin::arm::JointLimits;

/// Every so many strokes the first is repeated.
pub const ANCHOR: usize = 6;
/// Root of `x⁵ = x + 1`: the golden ratio of four dimensions.
const GOLDEN: f64 = 1.167_303_978_261_418_7;
/// Speeds of the hit [m/s].
pub const SPEEDS: [f64; 2] = [0.22, 0.6];
/// How far a line passes beside the centre, as a share of half the narrower side.
const MAX_OFFSET_SHARE: f64 = 0.55;
/// Heights of the tool's end as a share of the object's.
const HEIGHTS: [f64; 2] = [0.2, 0.5];
/// How far from a face's normal a stroke may come [rad]: further round it would slip off the edge.
const MAX_OBLIQUITY: f64 = 0.35;
/// Middle of the area that an arm of this class reaches from all sides, and its radius [m].
pub const MIDDLE: [f64; 2] = [0.48, 0.0];
const RADIUS: f64 = 0.13;
/// Other directions that are tried when the wanted one leads out of the area [rad].
const TURN_STEP: f64 = PI / 9.0;
/// Shares of the wanted speed that are tried, where no direction allows more.
pub const PACES: [f64; 3] = [1.0, 0.8, 0.6];
/// The object slides further than reckoned by this much at most.
const SLIDE_RATIO: f64 = 1.3;
/// Rest before a stroke and after it [s].
pub const RESTS: [f64; 2] = [0.3, 0.8];

/// What a stroke should be like.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wish {
    /// Direction [rad].
    pub heading: f64,
    /// Speed of the hit [m/s].
    pub speed: f64,
    /// How far the line passes to the left of the centre, -1 to 1.
    pub aside: f64,
    /// Height of the tool's end, from the lowest that is tried (0) to the highest (1).
    pub height: f64,
}

impl Wish {
    /// The wish for a clip by its number in the session, from 0.
    pub fn of_clip(number: usize) -> Self {
        let turn = if number.is_multiple_of(ANCHOR) { 0 } else { number };
        // The powers of the ratio are irrational to each other: no two dimensions repeat together.
        let at = |dimension: i32| (0.5 + turn as f64 * GOLDEN.powi(-dimension)).fract();
        Self {
            heading: TAU * at(1) - PI,
            speed: SPEEDS[0] + (SPEEDS[1] - SPEEDS[0]) * at(2),
            aside: 2.0 * at(3) - 1.0,
            height: at(4),
        }
    }
}

/// An object's place on the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// Its geometric centre [m].
    pub place: [f64; 2],
    /// Its turn about the vertical [rad].
    pub yaw: f64,
}

/// What can be struck, and by what.
#[derive(Debug, Clone, Copy)]
pub struct Program<'a> {
    pub body: &'a Body,
    pub limits: &'a [JointLimits],
    /// Edge lengths of the object [m].
    pub size: [f64; 3],
    /// Radius of the tool [m].
    pub tool: f64,
    /// Height of the table [m].
    pub table: f64,
    /// Friction that is reckoned with.
    pub friction: f64,
    /// How many times as fast as it would be every stroke is.
    pub pace: f64,
    /// How far the tool is turned about its own axis [rad].
    pub turn: f64,
    /// The object's name, where there are several.
    pub name: Option<&'a str>,
}

/// A stroke that can be done.
#[derive(Debug, Clone, PartialEq)]
pub struct Next {
    /// What it is.
    pub stroke: Stroke,
    pub plan: StrokePlan,
    /// The way to where it begins.
    pub approach: Vec<SetPoint>,
    /// Where the object stands now.
    pub object: Standing,
    /// Where it will come to rest, about [m].
    pub rest: [f64; 2],
    /// How many strokes nearer to the wish are left out because of other objects, and what is in the way of the first of them,
    /// with its direction [rad].
    pub left_out: Option<(usize, f64, Blocked)>,
}

/// No stroke can be done where the object stands.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NoStroke {
    /// No direction keeps the object in the area.
    #[error(
        "the object stands at x {:.2} m, y {:.2} m, from where no stroke keeps it in reach; put it back near x {:.2} m, y {:.2} m",
        place[0], place[1], MIDDLE[0], MIDDLE[1]
    )]
    Away {
        /// Where [m].
        place: [f64; 2],
    },
    /// Directions that would keep it there cannot be done; the first refusal.
    #[error(transparent)]
    Refused(#[from] StrokeError),
    /// Strokes could be done, but there is no way to their begin or from their end; the first refusal.
    #[error(transparent)]
    Cut(WayError),
    /// Other objects are in the way of all that could be done otherwise; the stroke that lacks least.
    #[error("no stroke is free of other objects: {0}")]
    Blocked(Blocked),
}

impl NoStroke {
    /// Of what other objects are in the way of, the one that lacks least; `None` where they are in the way of nothing.
    pub fn least(refused: impl Iterator<Item = Self>) -> Option<Blocked> {
        let blocked = refused.filter_map(|error| if let Self::Blocked(blocked) = error { Some(blocked) } else { None });
        blocked.reduce(|a, b| if b.lacks() < a.lacks() { b } else { a })
    }
}

impl From<WayError> for NoStroke {
    fn from(error: WayError) -> Self {
        if let WayError::Blocked(blocked) = error { Self::Blocked(blocked) } else { Self::Cut(error) }
    }
}

impl<'a> Program<'a> {
    /// For the arm, tool and object of a cell; `size`: the object's edge lengths [m].
    #[must_use]
    pub fn of(cell: &'a Cell, size: [f64; 3], body: &'a Body, limits: &'a [JointLimits]) -> Self {
        Self {
            body,
            limits,
            size,
            tool: cell.tool.as_ref().map_or(0.0, |tool| tool.radius),
            table: cell.table.as_ref().map_or(0.0, |table| table.height),
            friction: cell.object().map_or(0.3, shared_mem::cell::Object::nominal_friction),
            pace: 1.0,
            turn: 0.0,
            name: cell.one_of_several(),
        }
    }

    /// The stroke nearest to the wish that can be done from rest at `from`, with the ways to it and from it, and that keeps
    /// the object in reach.
    ///
    /// # Errors
    /// [`NoStroke`] with the remedy.
    pub fn next(&self, wish: &Wish, object: &Standing, ways: &Ways<'_>, from: &Joints) -> Result<Next, NoStroke> {
        let (mut refused, mut blocked) = (None, Vec::new());
        let turns = (0..=9).flat_map(|k| [f64::from(k), -f64::from(k)]).skip(1);
        // A speed that was asked for is the one that is played.
        let paces = if self.pace == 1.0 { &PACES[..] } else { &PACES[..1] };
        let tries = paces.iter().flat_map(|pace| turns.clone().map(move |turn| (*pace, turn)));
        for (pace, turn) in tries {
            let (heading, speed) = (wish.heading + turn * TURN_STEP, pace * wish.speed);
            let stroke = self.stroke(&Wish { heading, speed, ..*wish }, object);
            let rest = self.rest(&stroke);
            let away = |place: [f64; 2]| (place[0] - MIDDLE[0]).hypot(place[1] - MIDDLE[1]);
            if away(rest) > RADIUS && away(rest) > 0.8 * away(object.place) {
                continue;
            }
            match self.whole(&stroke, ways, from) {
                Ok((plan, approach)) => {
                    let count = blocked.len();
                    let left_out = blocked.into_iter().next().map(|(heading, blocked)| (count, heading, blocked));
                    return Ok(Next { stroke, plan, approach, object: *object, rest, left_out });
                }
                Err(NoStroke::Blocked(in_way)) => blocked.push((stroke.heading, in_way)),
                Err(error) => refused = refused.or(Some(error)),
            }
        }
        // Moving another object away is what helps, whatever else is refused.
        let least = NoStroke::least(blocked.into_iter().map(|(_, blocked)| NoStroke::Blocked(blocked)));
        Err(least.map(NoStroke::Blocked).or(refused).unwrap_or(NoStroke::Away { place: object.place }))
    }

    /// The stroke's motion and the way to it, once there is one back as well.
    ///
    /// # Errors
    /// [`NoStroke`] with what stands in the way.
    pub fn whole(
        &self,
        stroke: &Stroke,
        ways: &Ways<'_>,
        from: &Joints,
    ) -> Result<(StrokePlan, Vec<SetPoint>), NoStroke> {
        self.check_slide(stroke, ways)?;
        let plan = stroke::plan(stroke, self.body.model().ready(), self.limits, self.body)?;
        self.check_motion(&plan, ways)?;
        let [begin, .., end] = &plan.set_points[..] else { return Err(NoStroke::Away { place: stroke.object }) };
        let approach = ways.over(from, &begin.q_d)?;
        ways.away(&end.q_d, stroke.heading)?;
        Ok((plan, approach))
    }

    /// Whether a stroke keeps clear of other objects: what slides, and the arm.
    ///
    /// # Errors
    /// [`NoStroke::Blocked`] with the object in the way.
    pub fn check_clear(&self, stroke: &Stroke, plan: &StrokePlan, ways: &Ways<'_>) -> Result<(), NoStroke> {
        self.check_slide(stroke, ways)?;
        self.check_motion(plan, ways)
    }

    fn check_slide(&self, stroke: &Stroke, ways: &Ways<'_>) -> Result<(), NoStroke> {
        let (ends, radius) = ([stroke.object, self.farthest(stroke)], 0.5 * self.size[0].hypot(self.size[1]));
        let called = self.name.map_or_else(|| "the object".to_owned(), |name| format!("`{name}`"));
        let blocked = obstacle::on_slide(ways.obstacles, &called, ends, radius);
        blocked.map_or(Ok(()), |blocked| Err(NoStroke::Blocked(blocked)))
    }

    fn check_motion(&self, plan: &StrokePlan, ways: &Ways<'_>) -> Result<(), NoStroke> {
        let blocked = obstacle::on_motion(ways.obstacles, self.body, &plan.set_points, false);
        blocked.map_or(Ok(()), |blocked| Err(NoStroke::Blocked(blocked)))
    }

    /// The wish as a stroke on the object, its direction turned towards the nearest face.
    pub fn stroke(&self, wish: &Wish, object: &Standing) -> Stroke {
        let [x, y, z] = self.size;
        let from_face = wish.heading - object.yaw;
        let face = (from_face / FRAC_PI_2).round();
        let oblique = from_face - face * FRAC_PI_2;
        let heading = object.yaw + face * FRAC_PI_2 + oblique * MAX_OBLIQUITY / (0.5 * FRAC_PI_2);
        let height = HEIGHTS[0] + (HEIGHTS[1] - HEIGHTS[0]) * wish.height;
        Stroke {
            object: object.place,
            clearance: 0.5 * x.hypot(y) + self.tool,
            heading: heading.sin().atan2(heading.cos()),
            offset: 0.5 * MAX_OFFSET_SHARE * wish.aside * x.min(y),
            speed: self.pace * wish.speed,
            height: self.table + (height * z).max(1.5 * self.tool),
            // Faster or slower, the way stays the same.
            rise: (0.5 * wish.speed).max(0.35) / self.pace,
            follow_through: 0.0,
            rest: RESTS,
            turn: self.turn,
        }
    }

    /// Where the object comes to rest, about: pushed until the tool slows down, then sliding freely.
    pub fn rest(&self, stroke: &Stroke) -> [f64; 2] {
        let pushed = 0.25 * stroke.speed * stroke.rise + stroke.clearance + stroke.follow_through;
        Self::after(stroke, pushed.max(self.slide(stroke)))
    }

    /// Where it comes at most: pushed until the tool has stopped, or sliding freely from where that begins to slow down.
    fn farthest(&self, stroke: &Stroke) -> [f64; 2] {
        let slowing = 0.5 * stroke.speed * stroke.rise;
        Self::after(stroke, stroke.clearance + stroke.follow_through + slowing.max(self.slide(stroke)))
    }

    /// A free slide at the speed of the hit [m].
    fn slide(&self, stroke: &Stroke) -> f64 {
        SLIDE_RATIO * stroke.speed * stroke.speed / (2.0 * self.friction * GRAVITY)
    }

    fn after(stroke: &Stroke, way: f64) -> [f64; 2] {
        let [x, y] = stroke.object;
        [x + way * stroke.heading.cos(), y + way * stroke.heading.sin()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::limits;
    use crate::obstacle::Obstacle;

    fn shipped() -> (Cell, Body, Vec<JointLimits>) {
        let text = include_str!("../../../config/fr3_cell.toml");
        let cell: Cell = shared_mem::toml_file::parse(text, "fr3_cell.toml".as_ref()).expect("the shipped file");
        let body = Body::of(&cell).expect("the shipped cell has an arm");
        let limits = limits::of(&cell, &body);
        (cell, body, limits)
    }

    #[test]
    fn twelve_wishes_come_from_all_sides_at_all_speeds_and_the_first_comes_again() {
        let wishes: Vec<Wish> = (0..12).map(Wish::of_clip).collect();
        assert_eq!(wishes[0], wishes[ANCHOR]);
        for quarter in 0..4 {
            let [lo, hi] = [0, 1].map(|k| -PI + f64::from(quarter + k) * FRAC_PI_2);
            assert!(wishes.iter().any(|wish| (lo..hi).contains(&wish.heading)), "no stroke towards {lo:.1} to {hi:.1}");
        }
        let fast = wishes.iter().filter(|wish| wish.speed > 0.5 * (SPEEDS[0] + SPEEDS[1])).count();
        assert!((3..=9).contains(&fast), "{fast} of 12 are fast");
        assert!(wishes.iter().any(|wish| wish.aside > 0.3) && wishes.iter().any(|wish| wish.aside < -0.3));
    }

    #[test]
    fn forty_strokes_one_after_the_other_keep_the_object_in_reach() {
        let (cell, body, limits) = shipped();
        let program = Program::of(&cell, [0.08, 0.06, 0.10], &body, &limits);
        let ways = Ways { body: &body, limits: &limits, height: 0.18, floor: 0.14, obstacles: &[] };
        let mut object = Standing { place: [0.55, 0.0], yaw: 0.2 };
        let mut at = *body.model().ready();
        for number in 0..40 {
            let next = program.next(&Wish::of_clip(number), &object, &ways, &at).expect("a stroke");
            let end = next.plan.set_points[next.plan.set_points.len() - 1].q_d;
            let away = ways.away(&end, next.stroke.heading).expect("a way back");
            at = away[away.len() - 1].q_d;
            object = Standing { place: next.rest, yaw: object.yaw + 0.7 };
            let away = (object.place[0] - MIDDLE[0]).hypot(object.place[1] - MIDDLE[1]);
            assert!(away < 2.0 * RADIUS, "stroke {number} leads {away:.2} m away");
        }
    }

    #[test]
    fn an_object_out_of_reach_is_asked_for() {
        let (cell, body, limits) = shipped();
        let program = Program::of(&cell, [0.08, 0.06, 0.10], &body, &limits);
        let far = Standing { place: [1.1, 0.4], yaw: 0.0 };
        let ways = Ways { body: &body, limits: &limits, height: 0.18, floor: 0.14, obstacles: &[] };
        let error =
            program.next(&Wish::of_clip(1), &far, &ways, body.model().ready()).expect_err("too far").to_string();
        assert!(error.contains("put it back") || error.contains("move the object"), "{error}");
    }

    /// A box of 8 by 6 by 10 cm.
    fn block(name: &str, [x, y]: [f64; 2]) -> Obstacle {
        let corner = |i: usize| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            nalgebra::Point3::new(0.04 * sign(0), 0.03 * sign(1), 0.05 * sign(2))
        };
        let corners: Vec<_> = (0..8).map(corner).collect();
        Obstacle::at(name, &corners, &nalgebra::Isometry3::translation(x, y, 0.05))
    }

    #[test]
    fn a_stroke_towards_another_object_is_left_out_and_one_past_it_is_done() {
        let (cell, body, limits) = shipped();
        let program = Program { name: Some("box"), ..Program::of(&cell, [0.08, 0.06, 0.10], &body, &limits) };
        let object = Standing { place: MIDDLE, yaw: 0.0 };
        let wish = Wish { heading: FRAC_PI_2, speed: 0.3, aside: 0.0, height: 0.2 };
        let next = |obstacles: &[Obstacle]| {
            let ways = Ways { body: &body, limits: &limits, height: 0.18, floor: 0.14, obstacles };
            program.next(&wish, &object, &ways, body.model().ready())
        };
        let alone = next(&[]).expect("a stroke");
        assert_eq!(alone.stroke.heading, FRAC_PI_2);
        assert_eq!(next(&[block("far", [0.48, 0.5])]).expect("a stroke"), alone);
        let in_way = [block("cup", [0.48, 0.2])];
        let turned = next(&in_way).expect("a stroke past it");
        let ways = Ways { body: &body, limits: &limits, height: 0.18, floor: 0.14, obstacles: &in_way };
        program.check_clear(&turned.stroke, &turned.plan, &ways).expect("clear");
        assert!(program.check_clear(&alone.stroke, &alone.plan, &ways).is_err());
        let (count, heading, blocked) = turned.left_out.expect("left out");
        assert!(count > 0 && heading == FRAC_PI_2 && blocked.name == "cup" && turned.stroke.heading != FRAC_PI_2);
        // Behind it there is no room for the tool, either.
        let behind = next(&[block("cup", [0.48, -0.13])]).expect("a stroke from elsewhere");
        assert!(behind.left_out.is_some_and(|(_, _, blocked)| blocked.what == "the arm"));
    }

    #[test]
    fn an_object_between_others_has_one_of_them_moved_away_by_what_is_missing() {
        let (cell, body, limits) = shipped();
        let program = Program { name: Some("box"), ..Program::of(&cell, [0.08, 0.06, 0.10], &body, &limits) };
        let around = [[0.0, 0.11], [0.0, -0.11], [0.13, 0.0], [-0.13, 0.0]];
        let around = around.map(|[x, y]| block("cup", [MIDDLE[0] + x, MIDDLE[1] + y]));
        let ways = Ways { body: &body, limits: &limits, height: 0.18, floor: 0.14, obstacles: &around };
        let object = Standing { place: MIDDLE, yaw: 0.0 };
        let error = program.next(&Wish::of_clip(1), &object, &ways, body.model().ready()).expect_err("no room");
        let line = error.to_string();
        assert!(line.starts_with("no stroke is free of other objects: ") && !line.contains('\n'), "{line}");
        assert!(line.contains("move `cup` away by about") && line.contains("mm along x"), "{line}");
    }
}
