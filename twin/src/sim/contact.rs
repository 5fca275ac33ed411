//! One control period of arm and object together. While they are apart the object moves in one go and the arm in
//! another; a touch begins inside the period where the gap closes, is followed in short steps, and its force acts on both
//! at the same point with opposite signs.

use super::arm::SimArm;
use super::tool_path::{ToolMotion, ToolPath};
use super::{Drive, SimObject};
use crate::arm::{FlangeMotion, Joints};
use crate::contact_law::ContactLaw;
use crate::effects::HitEffects;
use crate::physics::hit::{ContactMotion, Press};
use crate::physics::touch::{Capsule, Touch};
use crate::scene::ObjectParameters;
use nalgebra::{Isometry3, Point3, Translation3, Vector3};
use shared_mem::cell::Tool;
use shared_mem::time::TICK;

/// A gap that is wider than this plus a period's approach stays open for the period [m].
const MARGIN: f64 = 1e-3;
/// Longest step between two looks at the gap, but for one in which half of it could close [s].
const LONGEST_STEP: f64 = 2.5e-4;
/// A step that closes the gap goes on for so long, so that it ends in touch [s].
const STEP_INTO_TOUCH: f64 = 2e-7;
/// Nothing closes a gap of this width within a millisecond [m].
const UNCLOSABLE_GAP: f64 = 0.02;
/// Tool and object that do not touch gain no more speed of approach than this in a second [m/s²]: far more than an arm's
/// torques or a table give them.
const SURGE: f64 = 500.0;

/// What the gap may do within the coming period.
enum Outlook {
    /// It stays open for so many periods, at least one.
    Open { periods: u32 },
    /// It may close; the flange's motion now.
    Near(FlangeMotion),
}

/// The tool as it is held, for a world of many bodies.
pub(super) struct Held {
    /// From the origin along z to the far end of the segment [m].
    pub(super) segment: f64,
    /// Around the segment [m].
    pub(super) radius: f64,
    /// Where its origin is in the flange.
    pub(super) flange_from_tool: Isometry3<f64>,
}

/// The contact between tool and object.
#[derive(Clone)]
pub(super) struct ToolContact {
    /// Tool and what the law asks of the object; `None` without a tool or an object.
    pair: Option<(Capsule, ContactMotion)>,
    /// From where the flange should hold the tool to where it does, in the flange frame.
    tool_shift: Option<Translation3<f64>>,
    /// Steps are so many times shorter than they need be.
    parts: u32,
    pub(super) record: ContactRecord,
}

/// What is known about the contact so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct ContactRecord {
    /// Normal force, mean over the last period [N].
    pub(super) mean_force: f64,
    /// Force on the tool and its moment about the base's origin, base frame, mean over the last period [N, N m].
    pub(super) on_tool: [Vector3<f64>; 2],
    /// First touch and end of the last one, in simulated time [ns].
    pub(super) span: Option<(u64, u64)>,
    /// Periods for which the gap certainly stays open: nobody needs to look at it.
    clear_periods: u32,
}

impl ToolContact {
    pub(super) fn without_object() -> Self {
        Self { pair: None, tool_shift: None, parts: 1, record: ContactRecord::default() }
    }

    pub(super) fn new(tool: Option<&Tool>, object: &ObjectParameters, effects: &HitEffects) -> Self {
        let motion = effects.real_law(ContactLaw::nominal(object.tip_friction)).motion(object.mass);
        let capsule = |tool: &Tool| Capsule { segment: tool.length - tool.radius, radius: tool.radius };
        let pair = tool.map(|tool| (capsule(tool), motion));
        Self { pair, tool_shift: effects.tool_shift(), ..Self::without_object() }
    }

    /// Other parameters of the same pair; what is on record stays.
    pub(super) fn set_parameters(&mut self, tool: Option<&Tool>, object: &ObjectParameters, effects: &HitEffects) {
        *self = Self { record: self.record, parts: self.parts, ..Self::new(tool, object, effects) };
        self.look_again();
    }

    /// See [`super::SimCell::refine`].
    pub(super) fn refine(&mut self, parts: u32) {
        self.parts = parts;
    }

    /// The tool as it is held.
    pub(super) fn held_tool(&self, tool: &Tool) -> Held {
        let flange_from_tool = self.held(&Isometry3::identity());
        Held { segment: tool.length - tool.radius, radius: tool.radius, flange_from_tool }
    }

    /// Whether the tool may touch the object within the coming period; asked once in each in which [`Self::advance`] is not.
    pub(super) fn is_near(&mut self, arm: &SimArm, object: &SimObject) -> bool {
        self.approaching(arm, object).is_some()
    }

    /// Nothing touches the object in the coming period.
    pub(super) fn let_go(&mut self) {
        (self.record.mean_force, self.record.on_tool) = (0.0, Default::default());
    }

    /// One period of an object that nothing touches.
    pub(super) fn pass(&self, object: &mut SimObject) {
        for _ in 0..self.parts {
            object.step(TICK / f64::from(self.parts), &[]);
        }
    }

    /// One period of arm and object from the simulated time `now_ns` on.
    pub(super) fn advance(&mut self, arm: &mut SimArm, object: &mut SimObject, drive: &Drive, now_ns: u64) {
        (self.record.mean_force, self.record.on_tool) = (0.0, Default::default());
        let Some((tool, motion, from)) = self.approaching(arm, object) else {
            arm.period(drive);
            self.pass(object);
            return;
        };
        arm.begin_period(drive);
        let stretches = arm.stretches();
        let length = TICK / f64::from(stretches);
        for stretch in 0..stretches {
            let from = if stretch == 0 { from } else { arm.flange_motion() };
            let mut close = Close { contact: self, object, tool: &tool, motion: &motion };
            let mut path = arm.path(drive, from, length);
            close.follow(&mut path, now_ns, length * f64::from(stretch));
            arm.end_path(&path);
        }
        arm.end_period();
    }

    /// Tool, law and the flange's motion where the gap may close within the coming period.
    fn approaching(&mut self, arm: &SimArm, object: &SimObject) -> Option<(Capsule, ContactMotion, FlangeMotion)> {
        let (tool, motion) = self.pair.filter(|_| arm.model().has_geometry())?;
        if self.record.clear_periods > 0 {
            self.record.clear_periods -= 1;
            return None;
        }
        match self.outlook(&tool, arm, object) {
            Outlook::Near(flange) => Some((tool, motion, flange)),
            Outlook::Open { periods } => {
                self.record.clear_periods = periods - 1;
                None
            }
        }
    }

    /// Whether the gap may close within a period.
    pub(super) fn may_touch(&self, arm: &SimArm, object: &SimObject) -> bool {
        let Some((tool, _)) = self.pair.as_ref().filter(|_| arm.model().has_geometry()) else { return false };
        self.record.clear_periods == 0 && matches!(self.outlook(tool, arm, object), Outlook::Near(_))
    }

    fn outlook(&self, tool: &Capsule, arm: &SimArm, object: &SimObject) -> Outlook {
        let flange = arm.flange_motion();
        let held = self.held(&flange.pose);
        let centre = Point3::from(object.pose().isometry().translation.vector);
        let on_tool = held.inverse_transform_point(&centre);
        let nearest = Point3::new(0.0, 0.0, on_tool.z.clamp(0.0, tool.segment));
        let mut gap = (on_tool - nearest).norm() - tool.radius - object.bounding_radius();
        if gap <= UNCLOSABLE_GAP {
            let touch = object.touch(tool, &held);
            let moving = ToolMotion::from(flange);
            let approach = (moving.velocity_at(&touch.point) - object.velocity_at(&touch.point)).norm();
            gap = -touch.depth;
            if gap.is_nan() || gap < MARGIN + approach * TICK {
                return Outlook::Near(flange);
            }
        }
        let reach = tool.segment + tool.radius + (held.translation.vector - flange.pose.translation.vector).norm();
        let of_tool = flange.velocity.norm() + flange.angular_velocity.norm() * reach;
        let of_object = object.centre_velocity().norm() + object.angular_velocity().norm() * object.bounding_radius();
        let open = time_to_close(gap - MARGIN, of_tool + of_object);
        Outlook::Open { periods: ((open / TICK) as u32).max(1) }
    }

    /// Arm or object are somewhere else now.
    pub(super) fn look_again(&mut self) {
        self.record.clear_periods = 0;
    }

    /// Gap between object and tool for an arm at `q` [m]; without bound where there is no tool.
    pub(super) fn gap_at(&self, arm: &SimArm, q: &Joints, object: &SimObject) -> f64 {
        let Some((tool, _)) = self.pair.as_ref().filter(|_| arm.model().has_geometry()) else { return f64::INFINITY };
        -object.touch(tool, &self.held(&arm.model().flange(q).isometry())).depth
    }

    /// Where the tool is that should be at the flange.
    fn held(&self, flange: &Isometry3<f64>) -> Isometry3<f64> {
        self.tool_shift.map_or(*flange, |shift| flange * shift)
    }
}

/// The least time in which a gap can close whose sides approach with `speed` at most now [s].
fn time_to_close(gap: f64, speed: f64) -> f64 {
    ((speed * speed + 2.0 * SURGE * gap).sqrt() - speed) / SURGE
}

/// Tool and object close to each other.
struct Close<'a> {
    contact: &'a mut ToolContact,
    object: &'a mut SimObject,
    tool: &'a Capsule,
    motion: &'a ContactMotion,
}

impl Close<'_> {
    /// Follows the tool along its path, `since` seconds after `now_ns`.
    fn follow(&mut self, path: &mut ToolPath, now_ns: u64, since: f64) {
        while path.left() > STEP_INTO_TOUCH {
            let tool = path.now();
            let touches = self.object.touches(self.tool, &self.contact.held(&tool.pose));
            if touches.iter().all(|touch| touch.depth <= 0.0) {
                let dt = self.until_touch(&tool, &touches[0], path.left());
                self.object.step(dt, &[]);
                path.advance(dt, &[], &tool.pose.translation.vector);
            } else {
                let before = path.time();
                self.press(path, &tool, &touches);
                let at = |time: f64| now_ns + ((since + time) * 1e9).round() as u64;
                let (start, end) = (at(before), at(path.time()));
                let first = self.contact.record.span.map_or(start, |(first, _)| first);
                self.contact.record.span = Some((first, end));
            }
        }
    }

    /// How long the gap stays open for certain, or a step that ends in touch.
    fn until_touch(&self, tool: &ToolMotion, nearest: &Touch, left: f64) -> f64 {
        let approach = tool.velocity_at(&nearest.point) - self.object.velocity_at(&nearest.point);
        let (gap, closing) = (-nearest.depth, approach.dot(&nearest.normal));
        let open = if closing > 0.0 { gap / closing + STEP_INTO_TOUCH } else { f64::INFINITY };
        open.min(LONGEST_STEP.max(0.5 * gap / approach.norm())).min(left)
    }

    /// One step in touch.
    fn press(&mut self, path: &mut ToolPath, tool: &ToolMotion, touches: &[Touch; 2]) {
        let (left, longest) = (path.left(), self.motion.step().max(self.object.pushed_step()));
        let mut presses = touches.map(|touch| Press {
            touch,
            tool_velocity: tool.velocity_at(&touch.point),
            tool_acceleration: path.acceleration_at(tool, &touch.point),
            motion: *self.motion,
            steady: false,
        });
        let calm = presses.iter().all(|press| press.is_calm(&self.object.velocity_at(&press.touch.point), longest));
        presses.iter_mut().for_each(|press| press.steady = calm);
        let step = if calm { longest } else { self.motion.step() };
        let dt = left / (left * f64::from(self.contact.parts) / step).ceil();
        let forces = self.object.step(dt, &presses);
        let pressing: f64 = touches.iter().zip(&forces).map(|(touch, force)| force.dot(&touch.normal)).sum();
        self.contact.record.mean_force += pressing * dt / TICK;
        let on_tool = [0, 1].map(|i| (touches[i].point, -forces[i]));
        let [force, moment] = &mut self.contact.record.on_tool;
        for (point, push) in &on_tool {
            *force += push * (dt / TICK);
            *moment += point.coords.cross(push) * (dt / TICK);
        }
        path.advance(dt, &on_tool, &tool.pose.translation.vector);
    }
}
