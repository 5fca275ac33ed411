//! Clips with an object as evidence: the arm before the touch ([`ArmClips`]), the object's poses and the arm's joints while
//! the tool pushes the object ([`ObjectClips`], [`Contact`]), each in sigmas of its sensor.
//!
//! Every clip has a friction and a clock of its own, and its object deviates from the simulated path: nobody simulates an
//! impact exactly, and the error grows along the path. That deviation is a random effect, added to the simulated poses, so it
//! costs no simulation; its scale is what an effect must beat to be believed
//! ([`super::random_effects_scale`]).

use super::arm::ArmClips;
use super::arm::following::Moment;
use super::contact::Contact;
use super::object::{self, ModelError, ObjectClips, Part, diagnosed};
use super::random_effects::{RandomEffects, WithOwn};
use super::recent::Recent;
use super::{Channel, Group, Likelihood, Near, Reach, Row, Setting, StageName};
use crate::engine::Engine;
use crate::estimate::{ClipModel, Impossible};
use shared_mem::cell::{ClipKind, PoseNoise};
use shared_mem::theta::Theta;
use std::sync::Arc;

/// Coordinates of a pose.
const COORDINATES: [(&str, &str); 6] = [
    ("position", "x"),
    ("position", "y"),
    ("position", "z"),
    ("rotation", "roll"),
    ("rotation", "pitch"),
    ("rotation", "yaw"),
];
/// Parts of a clip with weights of their own: a twin is right about rest long before it is right about a hit.
const PARTS: usize = 3;
/// The blow and what it does to the object at once [s], a choice; what comes after is sliding, pushed or free.
const HIT_DURATION: f64 = 0.05;

/// Coordinates that sliding changes: x, y, yaw.
const IN_THE_PLANE: [usize; 3] = [0, 1, 5];
/// How far a moving object may tip and rise otherwise than simulated, one sigma [m, rad]: how a table and its edges yield
/// under a blow is not modelled well enough to learn from.
const TIPPING: PoseNoise = PoseNoise { position: 3e-3, rotation: 0.05 };

/// Those of the numbers that an arm feels that touches nothing.
type FeltByArm<'a> = Box<dyn Fn(&[f64]) -> Vec<f64> + Sync + 'a>;

/// The arm where there is one, and the object.
pub struct CellClips<'a, F> {
    felt_by_arm: FeltByArm<'a>,
    arm: Option<ArmClips<F>>,
    object: ObjectClips,
    channels: Vec<Channel>,
    rows: Vec<Vec<Row>>,
    /// What each clip has of its own: its friction first, the deviations of its path last.
    random_effects: RandomEffects,
    /// For each clip and deviation, what one unit of it takes off every residual.
    deviations: Vec<Vec<Vec<f64>>>,
    /// Index of the shared friction among the numbers.
    friction: Option<usize>,
    /// Index of the object's first channel.
    first: usize,
    /// For each clip the joints' residuals in contact.
    contact: Vec<Contact>,
    /// For each clip the last numbers that the arm feels with its residuals there: most of what a search turns is the
    /// object's.
    arm_alone: Vec<Recent<Vec<f64>, Vec<f64>>>,
    /// By the twin since the touch, where a step or a point around which another program is looked at begins.
    stepped_from: Vec<Recent<Vec<f64>, Vec<f64>>>,
}

/// Measured less predicted of a clip, at shared parameters and its own.
type Errors = fn(&ObjectClips, usize, &[f64], &[f64]) -> Result<Vec<f64>, Impossible>;

impl<'a, F: Fn(&[f64]) -> Theta + Sync> CellClips<'a, F> {
    /// Both on the same clips in the same order; without an arm, objects that move by themselves. `felt_by_arm`: those of the numbers
    /// that an arm feels that touches nothing.
    pub fn new(
        arm: Option<ArmClips<F>>,
        mut object: ObjectClips,
        felt_by_arm: impl Fn(&[f64]) -> Vec<f64> + Sync + 'a,
    ) -> Self {
        object.set_model_error(ModelError { joints: arm.as_ref().map(|_| 1.0), ..object.model_error() });
        let mut channels = arm.as_ref().map_or_else(Vec::new, |arm| arm.channels().to_vec());
        let first = channels.len();
        for _ in 0..PARTS {
            let of = |(quantity, place): (&'static str, &str)| Channel {
                quantity,
                place: place.into(),
                joint: None,
                group: Group::Object,
            };
            channels.extend(COORDINATES.map(of));
        }
        let in_contact = channels.len();
        let encoders: Vec<Channel> =
            channels[..first].iter().filter(|channel| channel.quantity == "q").cloned().collect();
        channels.extend(encoders.into_iter().map(|encoder| Channel { group: Group::Contact, ..encoder }));
        let alone = arm.is_none();
        let object =
            object.with_nuisance(diagnosed(if alone { ClipKind::FreeMotion } else { ClipKind::ControlHitSlide }));
        let (mut rows, mut deviations, mut contact) = (Vec::new(), Vec::new(), Vec::new());
        for clip in 0..object.clips() {
            let of_arm = arm.as_ref().map_or(&[][..], |arm| arm.rows(clip));
            let joints = Contact::of(arm.as_ref(), &object, clip);
            let poses = pose_rows(&object, clip, first);
            let none = |rows: usize| vec![0.0; rows];
            let padded = |slopes: Vec<f64>| [none(of_arm.len()), slopes, none(joints.rows.len())].concat();
            deviations.push(object.path_slopes(clip).into_iter().map(padded).collect());
            rows.push([of_arm, &poses, &joints.evidence(&object.rows(clip), in_contact)].concat());
            contact.push(joints);
        }
        let friction = object.settings().settings().iter().position(|setting| *setting == Setting::Friction);
        let random_effects = object.random();
        let arm_alone = rows.iter().map(|_| Recent::default()).collect();
        let stepped_from = rows.iter().map(|_| Recent::default()).collect();
        Self {
            felt_by_arm: Box::new(felt_by_arm),
            arm,
            object,
            channels,
            rows,
            random_effects,
            deviations,
            friction,
            first,
            contact,
            arm_alone,
            stepped_from,
        }
    }

    /// The residuals of the arm that moves alone at numbers; none where there is no arm.
    fn arm(&self, clip: usize, shared: &[f64]) -> Result<Arc<Vec<f64>>, Impossible> {
        let Some(arm) = &self.arm else { return Ok(Arc::default()) };
        self.arm_alone[clip].at((self.felt_by_arm)(shared), || arm.residuals_in(1, (clip, shared, &[])))
    }

    /// The residuals of the poses and of the joints in contact at numbers, nuisance parameters among them, out of errors that are given.
    fn since_touch(
        &self,
        errors: Errors,
        (clip, shared, own): (usize, &[f64], &[f64]),
    ) -> Result<Vec<f64>, Impossible> {
        let (mut shared, mut simulated) = (shared.to_vec(), own.to_vec());
        // The whole clip has its friction, not what comes after the hit alone.
        if let (Some(friction), Some(ln_friction)) = (self.friction, simulated.first_mut().map(std::mem::take)) {
            shared[friction] *= ln_friction.exp();
        }
        let mut residuals = errors(&self.object, clip, &shared, &simulated)?;
        let (noise, contact) = (self.object.noise(), &self.contact[clip]);
        let joints: Vec<f64> = residuals[contact.rows.clone()].to_vec();
        residuals.truncate(self.poses(clip));
        let of_arm = self.of_arm(clip);
        for (residual, row) in residuals.iter_mut().zip(&self.rows[clip][of_arm..]) {
            let coordinate = (row.channel - self.first) % COORDINATES.len();
            let (noise, tipping) =
                if coordinate < 3 { (noise.position, TIPPING.position) } else { (noise.rotation, TIPPING.rotation) };
            let tips = row.stage != StageName::Rest && !IN_THE_PLANE.contains(&coordinate);
            *residual /= if tips { noise.hypot(tipping) } else { noise };
        }
        for (slopes, value) in self.deviations[clip]
            .iter()
            .zip(own.iter().skip(self.random_effects.heavy.start))
            .filter(|(_, u)| **u != 0.0)
        {
            residuals.iter_mut().zip(&slopes[of_arm..]).for_each(|(residual, slope)| *residual += slope * value);
        }
        let gains = self.object.settings().theta(&shared).arm;
        residuals.extend(contact.in_sigmas(&joints, gains.as_ref().map_or(&[], |gains| &gains.stiffness)));
        Ok(residuals)
    }

    /// How many rows the arm has that moves alone.
    fn of_arm(&self, clip: usize) -> usize {
        self.arm.as_ref().map_or(0, |arm| arm.rows(clip).len())
    }

    /// How many rows the object's poses have.
    fn poses(&self, clip: usize) -> usize {
        self.rows[clip].len() - self.of_arm(clip) - self.contact[clip].rows.len()
    }
}

fn pose_rows(object: &ObjectClips, clip: usize, first: usize) -> Vec<Row> {
    let rows = object.rows(clip);
    let start_ns = rows.first().map_or(0, |row| row.stamp_ns);
    let alone = object.clip(clip).kind == ClipKind::FreeMotion;
    let onset_ns = rows.iter().filter(|row| row.part == Part::Before).map(|row| row.stamp_ns).max().unwrap_or(start_ns);
    let one = |row: &object::Row| {
        let coordinate = match row.channel {
            object::Channel::Position(axis) => axis,
            object::Channel::Rotation(axis) => 3 + axis,
            object::Channel::Joint(_) => return None,
        };
        let since = row.stamp_ns.saturating_sub(onset_ns) as f64 * 1e-9;
        let (part, stage, regime) = match row.part {
            Part::Before if alone => (0, StageName::Rest, "at the start"),
            Part::Before => (0, StageName::Rest, "before the hit"),
            Part::After => (0, StageName::Rest, "after the slide"),
            Part::Hit | Part::Slide if alone => (2, StageName::Slide, "by itself"),
            _ if since < HIT_DURATION => (1, StageName::Hit, "blow"),
            Part::Hit => (2, StageName::Slide, "in contact with the tool"),
            Part::Slide => (2, StageName::Slide, "free"),
        };
        let time = row.stamp_ns.saturating_sub(start_ns) as f64 * 1e-9;
        Some(Row { channel: first + part * COORDINATES.len() + coordinate, stage, regime, time })
    };
    rows.iter().filter_map(one).collect()
}

impl<F: Fn(&[f64]) -> Theta + Sync> ClipModel for CellClips<'_, F> {
    fn clips(&self) -> usize {
        self.object.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.changed(clip, (shared, own), (Reach::All, &[], None), out)
    }
}

impl<F: Fn(&[f64]) -> Theta + Sync> Likelihood for CellClips<'_, F> {
    type Own = WithOwn;

    fn changed(
        &self,
        clip: usize,
        (shared, own): (&[f64], &[f64]),
        (reach, base, at): Near<'_>,
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        let (of_arm, numbers) = (self.of_arm(clip), (clip, shared, own));
        // Where another program simulates, the twin says what a step changes.
        let stepped = at.filter(|_| self.engine().is_some());
        out.clear();
        match (&self.arm, stepped) {
            (None, _) => {}
            _ if reach == Reach::Object => out.extend(&base[..of_arm]),
            (Some(arm), Some((at, _))) => arm.stepped(clip, (shared, &[]), ((at, &[]), &base[..of_arm]), out)?,
            (Some(_), None) => out.extend_from_slice(&self.arm(clip, shared)?),
        }
        match stepped {
            _ if reach == Reach::Arm => out.extend(&base[of_arm..]),
            None => out.extend(self.since_touch(ObjectClips::errors, numbers)?),
            Some((at, at_own)) => {
                let twins = |numbers: (usize, &[f64], &[f64])| self.since_touch(ObjectClips::twins_errors, numbers);
                let before = self.stepped_from[clip].at([at, at_own].concat(), || twins((clip, at, at_own)))?;
                let rows = base[of_arm..].iter().zip(&*before).zip(twins(numbers)?);
                out.extend(rows.map(|((base, before), after)| base + after - before));
            }
        }
        Ok(())
    }

    fn following(&self, clip: usize) -> Vec<Moment> {
        self.arm.as_ref().map_or_else(Vec::new, |arm| arm.following(clip))
    }

    fn engine(&self) -> Option<&Arc<Engine>> {
        self.object.engine()
    }

    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn rows(&self, clip: usize) -> &[Row] {
        &self.rows[clip]
    }

    fn scatter(&self) -> RandomEffects {
        self.random_effects.clone()
    }

    fn own_slope(&self, clip: usize, own: usize) -> Option<&[f64]> {
        Some(self.deviations[clip].get(own.checked_sub(self.random_effects.heavy.start)?)?)
    }
}
