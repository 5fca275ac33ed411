//! Strokes for which the object has to stand in a certain place: one that is repeated, slides in several headings through the
//! same place, straight hits on the object turned. Base frame; m, s, rad. Pure but for reading the clips that are repeated.
//!
//! A stroke is repeated with the same set points on the object in the same place: what then differs is scatter, of the cell
//! or of the hand that put the object back.

use super::body::Body;
use super::line::{self, about_itself};
use super::pace;
use super::program::{NoStroke, PACES, Program, RESTS, SPEEDS, Standing, Wish};
use super::rate::RATE;
use super::recorded::Repeated;
use super::stroke::{Stroke, StrokePlan};
use super::way::Ways;
use nalgebra::Vector3;
use shared_mem::msg::motion::SetPoint;
use shared_mem::msg::{Joints, MAX_JOINTS};
use std::f64::consts::{FRAC_PI_2, TAU};

/// Speed of the hit where nothing else is asked for [m/s]: the middle of what a session's strokes have.
const DEFAULT_SPEED: f64 = 0.5 * (SPEEDS[0] + SPEEDS[1]);
/// Height of the tool's end, from the lowest (0) to the highest (1).
const TIP_HEIGHT_SHARE: f64 = 0.4;

/// A stroke and where the object has to stand for it.
#[derive(Debug, Clone, PartialEq)]
pub struct Staged {
    /// Where the object has to stand.
    pub standing: Standing,
    /// What it is.
    pub stroke: Stroke,
    pub plan: StrokePlan,
    /// What it is for, in words.
    pub words: String,
}

/// A clip's stroke again, with the program's pace and turn of the tool.
///
/// # Errors
/// One line with what stands in the way.
pub fn again(program: &Program<'_>, clip: &Repeated) -> anyhow::Result<Staged> {
    let number = clip.number;
    let Some(standing) = clip.object else {
        anyhow::bail!("clip {number} has no poses of the object, so nobody knows where to put it; repeat another clip");
    };
    let Program { body, limits, .. } = *program;
    let turned = turned(body, &clip.set_points, program.turn).ok_or_else(|| {
        anyhow::anyhow!("the tool cannot be turned so far along clip {number}; give a smaller --turn-tool")
    })?;
    let moving = pace::paced(&turned, program.pace, limits, body)?;
    let set_points = with_rests(moving);
    let stroke = geometry(program, &set_points, &standing);
    Ok(Staged { standing, stroke, plan: StrokePlan { set_points }, words: format!("clip {number} again") })
}

/// Straight strokes in `count` headings, evenly all round, through `place`; the object is turned so that a face meets each.
/// Headings that cannot be done are left out: in words which, and why.
pub fn headings(
    program: &Program<'_>,
    count: usize,
    place: [f64; 2],
    yaw: f64,
    ways: &Ways<'_>,
) -> (Vec<Staged>, Vec<(String, NoStroke)>) {
    let (mut possible, mut refused) = (Vec::new(), Vec::new());
    for k in 0..count {
        let heading = TAU * k as f64 / count as f64;
        let beside = heading - yaw - ((heading - yaw) / FRAC_PI_2).round() * FRAC_PI_2;
        let standing = Standing { place, yaw: yaw + beside };
        let towards = format!("towards {:.0} degrees", heading.to_degrees());
        match straight(program, heading, &standing, ways) {
            Ok((stroke, plan)) => possible.push(Staged { standing, stroke, plan, words: "a straight slide".into() }),
            Err(error) => refused.push((towards, error)),
        }
    }
    (possible, refused)
}

/// One straight stroke, always the same, on the object where it stands turned by each of `turns` [rad].
///
/// # Errors
/// [`NoStroke`] where none of the four faces can be struck.
pub fn turned_objects(
    program: &Program<'_>,
    turns: &[f64],
    standing: &Standing,
    ways: &Ways<'_>,
) -> Result<Vec<Staged>, NoStroke> {
    let tries = (0..4).map(|face| straight(program, standing.yaw + f64::from(face) * FRAC_PI_2, standing, ways));
    let mut first = None;
    let mut found = None;
    for tried in tries {
        match tried {
            Ok(stroke) => {
                found = Some(stroke);
                break;
            }
            Err(error) => first = first.or(Some(error)),
        }
    }
    let (stroke, plan) = found.ok_or_else(|| first.unwrap_or(NoStroke::Away { place: standing.place }))?;
    let staged = |turn: &f64| Staged {
        standing: Standing { yaw: standing.yaw + turn, ..*standing },
        stroke,
        plan: plan.clone(),
        words: format!("a straight hit, the object turned by {:.0} degrees", turn.to_degrees()),
    };
    Ok(turns.iter().map(staged).collect())
}

/// The straight stroke along a heading, as fast as it can be done.
fn straight(
    program: &Program<'_>,
    heading: f64,
    standing: &Standing,
    ways: &Ways<'_>,
) -> Result<(Stroke, StrokePlan), NoStroke> {
    let paces = if program.pace == 1.0 { &PACES[..] } else { &PACES[..1] };
    let mut first = None;
    for pace in paces {
        let stroke = program
            .stroke(&Wish { heading, speed: pace * DEFAULT_SPEED, aside: 0.0, height: TIP_HEIGHT_SHARE }, standing);
        match program.whole(&stroke, ways, program.body.model().ready()) {
            Ok((plan, _)) => return Ok((stroke, plan)),
            Err(error) => first = first.or(Some(error)),
        }
    }
    Err(first.unwrap_or(NoStroke::Away { place: standing.place }))
}

/// The same way of the tool's end with the tool turned about its own axis; `None` where the arm cannot follow.
fn turned(body: &Body, points: &[SetPoint], turn: f64) -> Option<Vec<SetPoint>> {
    if turn == 0.0 {
        return Some(points.to_vec());
    }
    let tips: Vec<_> = points.iter().map(|point| body.model().tip(&point.q_d).isometry()).collect();
    let mut q = line::reach_turned(body, &points.first()?.q_d, tips.first()?, turn)?;
    let mut turned = Vec::with_capacity(points.len());
    for (i, tip) in tips.iter().enumerate() {
        let mut target = *tip;
        target.rotation *= about_itself(turn);
        q = line::reach(body, &q, &target)?;
        let (before, after) = (i.saturating_sub(1), (i + 1).min(tips.len() - 1));
        let way = tips[after].translation.vector - tips[before].translation.vector;
        let is_end = i == 0 || i + 1 == tips.len();
        let velocity = if is_end { Vector3::zeros() } else { 0.5 * RATE * way };
        turned.push(SetPoint { q_d: q, dq_d: line::joint_velocity(body, &q, &velocity) });
    }
    Some(turned)
}

/// Rests before and after a motion that begins and ends at rest.
fn with_rests(moving: Vec<SetPoint>) -> Vec<SetPoint> {
    let [before, after] = RESTS.map(|rest| (rest * RATE) as usize);
    let still = |q_d: Joints| SetPoint { q_d, dq_d: [0.0; MAX_JOINTS] };
    let [Some(first), Some(last)] = [moving.first(), moving.last()].map(|end| end.map(|point| still(point.q_d))) else {
        return moving;
    };
    [vec![first; before], moving, vec![last; after]].concat()
}

/// Heading, speed, height and offset of a stroke from its set points.
fn geometry(program: &Program<'_>, points: &[SetPoint], standing: &Standing) -> Stroke {
    let tip = |point: &SetPoint| program.body.model().tip(&point.q_d).isometry().translation.vector;
    let [first, last] = [tip(&points[0]), tip(&points[points.len() - 1])];
    let way = last - first;
    let heading = way.y.atan2(way.x);
    let speed = points.windows(2).map(|w| (tip(&w[1]) - tip(&w[0])).norm() * RATE).fold(0.0, f64::max);
    let wish = Wish { heading, speed: speed / program.pace, aside: 0.0, height: TIP_HEIGHT_SHARE };
    let beside = [first.x - standing.place[0], first.y - standing.place[1]];
    let offset = beside[1] * heading.cos() - beside[0] * heading.sin();
    Stroke { heading, offset, height: first.z, ..program.stroke(&wish, standing) }
}

#[cfg(test)]
mod tests {
    use super::super::program::MIDDLE;
    use super::super::stroke;
    use super::*;
    use crate::limits;
    use shared_mem::cell::Cell;
    use twin::arm::JointLimits;

    fn shipped() -> (Cell, Body, Vec<JointLimits>) {
        let text = include_str!("../../../config/fr3_cell.toml");
        let cell: Cell = shared_mem::toml_file::parse(text, "fr3_cell.toml".as_ref()).expect("the shipped file");
        let body = Body::of(&cell).expect("the shipped cell has an arm");
        let limits = limits::of(&cell, &body);
        (cell, body, limits)
    }

    const SIZE: [f64; 3] = [0.08, 0.06, 0.10];

    #[test]
    fn a_stroke_is_repeated_with_the_same_set_points_and_at_half_speed_along_the_same_way() {
        let (cell, body, limits) = shipped();
        let mut program = Program::of(&cell, SIZE, &body, &limits);
        let object = Standing { place: [0.5, 0.05], yaw: 0.3 };
        let asked = program.stroke(&Wish { heading: 0.4, speed: 0.4, aside: 0.5, height: 0.2 }, &object);
        let recorded = stroke::plan(&asked, body.model().ready(), &limits, &body).expect("a stroke").set_points;
        let moving = recorded[299..recorded.len() - 799].to_vec();
        let clip = Repeated { number: 3, set_points: moving, object: Some(object) };
        let same = again(&program, &clip).expect("again");
        assert_eq!(same.plan.set_points.len(), recorded.len() + 2);
        assert!(same.plan.set_points[1..].iter().zip(&recorded).all(|(a, b)| a.q_d == b.q_d));
        assert!((same.stroke.heading - asked.heading).abs() < 1e-6 && (same.stroke.speed - 0.4).abs() < 1e-3);
        assert!((same.stroke.offset - asked.offset).abs() < 1e-6, "{} {}", same.stroke.offset, asked.offset);
        program.pace = 0.5;
        let half = again(&program, &clip).expect("again");
        assert!((half.stroke.speed - 0.2).abs() < 1e-3 && half.words == "clip 3 again");
        program.pace = 1.0;
        program.turn = -1.2;
        let tips = |staged: &Staged| -> Vec<_> {
            staged.plan.set_points.iter().step_by(100).map(|p| body.model().tip(&p.q_d).isometry()).collect()
        };
        for (a, b) in tips(&same).iter().zip(tips(&again(&program, &clip).expect("again"))) {
            assert!((a.translation.vector - b.translation.vector).norm() < 1e-6);
            assert!(((a.rotation.inverse() * b.rotation).scaled_axis().z + 1.2).abs() < 1e-6);
        }
        program.pace = 6.0;
        let error = again(&program, &clip).expect_err("too fast").to_string();
        assert!(error.contains("joint") && error.contains("largest factor"), "{error}");
    }

    #[test]
    fn slides_all_round_go_through_one_place_each_against_a_face() {
        let (cell, body, limits) = shipped();
        let program = Program::of(&cell, SIZE, &body, &limits);
        let ways = Ways { body: &body, limits: &limits, height: 0.18, floor: 0.14, obstacles: &[] };
        let (slides, refused) = headings(&program, 8, MIDDLE, 0.2, &ways);
        assert!(slides.len() >= 6, "{refused:?}");
        for slide in &slides {
            let from_face = (slide.stroke.heading - slide.standing.yaw) / FRAC_PI_2;
            assert!((from_face - from_face.round()).abs() < 1e-9 && slide.stroke.offset == 0.0);
            assert_eq!(slide.stroke.object, MIDDLE);
            assert!((slide.standing.yaw - 0.2).abs() < 0.8, "turned no further than it has to be");
        }
        let turns = [0.0, FRAC_PI_2, 2.0 * FRAC_PI_2];
        let hits = turned_objects(&program, &turns, &Standing { place: MIDDLE, yaw: 0.2 }, &ways).expect("a hit");
        assert!(hits.iter().all(|hit| hit.plan == hits[0].plan) && hits[2].standing.yaw > 3.3);
    }
}
