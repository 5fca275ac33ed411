//! One control period of arm and object together: coarse steps while they are apart, fine ones around a contact, whose
//! force acts on both at the same point with opposite signs.

use super::arm::SimArm;
use super::{Drive, PERIOD, PERIOD_NS, Vector3};
use crate::arm::PointForce;
use crate::effects::HitEffects;
use crate::physics::TableObject;
use crate::physics::hit::{ContactLaw, ContactMotion, Press};
use crate::physics::touch::Capsule;
use crate::scene::ObjectParameters;
use nalgebra::{Isometry3, Point3, Translation3};
use shared_mem::cell::Tool;

/// Steps of the object in a period without contact: 0.25 ms each.
const COARSE_STEPS: usize = 4;
/// Steps of both in a period with contact: 62.5 µs, a twentieth of a contact's duration. Twice as many change the
/// object's speed after a hit by less than 2 %: `a_finer_step_changes_the_hit_by_less_than_two_per_cent`.
const FINE_STEPS: usize = 16;
/// A gap that is wider than this plus a period's approach stays open for the period [m].
const MARGIN: f64 = 1e-3;

/// The contact between tool and object.
#[derive(Clone)]
pub(super) struct ToolContact {
    /// Tool and what the law asks of the object; `None` without a tool or an object.
    pair: Option<(Capsule, ContactMotion)>,
    /// From where the flange should hold the tool to where it does, in the flange frame.
    tool_shift: Option<Translation3<f64>>,
    fine_steps: usize,
    pub(super) record: ContactRecord,
}

/// What is known about the contact so far.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct ContactRecord {
    /// Normal force, mean over the last period [N].
    pub(super) mean_force: f64,
    /// First touch and end of the last one, in simulated time [ns].
    pub(super) span: Option<(u64, u64)>,
}

impl ToolContact {
    pub(super) fn without_object() -> Self {
        Self { pair: None, tool_shift: None, fine_steps: FINE_STEPS, record: ContactRecord::default() }
    }

    pub(super) fn new(tool: Option<&Tool>, object: &ObjectParameters, effects: &HitEffects) -> Self {
        let motion = effects.real_law(ContactLaw::nominal(object.tip_friction)).motion(object.mass);
        let capsule = |tool: &Tool| Capsule { segment: tool.length - tool.radius, radius: tool.radius };
        let pair = tool.map(|tool| (capsule(tool), motion));
        Self { pair, tool_shift: effects.tool_shift(), ..Self::without_object() }
    }

    /// Other parameters of the same pair; what is on record stays.
    pub(super) fn set_parameters(&mut self, tool: Option<&Tool>, object: &ObjectParameters, effects: &HitEffects) {
        *self = Self { record: self.record, fine_steps: self.fine_steps, ..Self::new(tool, object, effects) };
    }

    /// Makes the fine steps `times` finer: for the test that they are fine enough.
    #[cfg(test)]
    pub(super) fn refine(&mut self, times: usize) {
        self.fine_steps = FINE_STEPS * times;
    }

    /// One period of arm and object from the simulated time `now_ns` on.
    pub(super) fn advance(&mut self, arm: &mut SimArm, object: &mut TableObject, drive: &Drive, now_ns: u64) {
        self.record.mean_force = 0.0;
        match self.pair.filter(|_| self.may_touch(arm, object)) {
            Some((tool, motion)) => {
                arm.begin_period(drive);
                self.advance_finely(arm, object, &tool, &motion, now_ns);
                arm.end_period();
            }
            None => {
                arm.period(drive);
                settle(object);
            }
        }
    }

    fn advance_finely(
        &mut self,
        arm: &mut SimArm,
        object: &mut TableObject,
        tool: &Capsule,
        motion: &ContactMotion,
        now_ns: u64,
    ) {
        let dt = PERIOD / self.fine_steps as f64;
        let stamp = |step: usize| now_ns + PERIOD_NS * step as u64 / self.fine_steps as u64;
        for step in 0..self.fine_steps {
            let touches = object.touches(tool, &self.tool_frame(arm));
            let presses =
                touches.map(|touch| Press { touch, tool_velocity: tool_velocity(arm, &touch.point), motion: *motion });
            let forces = object.step(dt, &presses);
            let pressing: f64 = touches.iter().zip(&forces).map(|(touch, force)| force.dot(&touch.normal)).sum();
            if pressing > 0.0 {
                let start = self.record.span.map_or_else(|| stamp(step), |(start, _)| start);
                self.record.span = Some((start, stamp(step + 1)));
                self.record.mean_force += pressing / self.fine_steps as f64;
            }
            let loads = [0, 1].map(|i| PointForce { point: touches[i].point.into(), force: (-forces[i]).into() });
            arm.advance(dt, if pressing > 0.0 { &loads } else { &[] });
        }
    }

    /// Whether the gap may close within a period.
    pub(super) fn may_touch(&self, arm: &SimArm, object: &TableObject) -> bool {
        let Some((tool, _)) = self.pair.as_ref().filter(|_| arm.model().has_geometry()) else { return false };
        let held = self.tool_frame(arm);
        let centre = Point3::from(object.pose().isometry().translation.vector);
        let on_tool = held.inverse_transform_point(&centre);
        let nearest = Point3::new(0.0, 0.0, on_tool.z.clamp(0.0, tool.segment));
        // Nothing closes a gap of 20 mm within a millisecond; most periods end here.
        let rough_gap = (on_tool - nearest).norm() - tool.radius - object.bounding_radius();
        if rough_gap > 0.02 {
            return false;
        }
        let touch = object.touch(tool, &held);
        let approach = (tool_velocity(arm, &touch.point) - object.velocity_at(&touch.point)).norm();
        -touch.depth < MARGIN + approach * PERIOD
    }

    /// Where the flange holds the tool, in the base frame.
    fn tool_frame(&self, arm: &SimArm) -> Isometry3<f64> {
        let flange = arm.model().flange(&arm.state().q).isometry();
        self.tool_shift.map_or(flange, |shift| flange * shift)
    }
}

/// One period of the object alone.
pub(super) fn settle(object: &mut TableObject) {
    for _ in 0..COARSE_STEPS {
        object.step(PERIOD / COARSE_STEPS as f64, &[]);
    }
}

/// Velocity of the last link's point that is at `point` now [m/s].
fn tool_velocity(arm: &SimArm, point: &Point3<f64>) -> Vector3<f64> {
    let columns = arm.model().jacobian(&arm.state().q, (*point).into());
    columns
        .iter()
        .zip(&arm.state().dq)
        .fold(Vector3::zeros(), |sum, (column, rate)| sum + Vector3::new(column[0], column[1], column[2]) * *rate)
}
