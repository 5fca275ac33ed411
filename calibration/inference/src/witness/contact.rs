//! The tool pushes the object: two that touch have no gap, so what is seen of one is the camera's, the tool's or the encoders' error.
//!
//! - Equation, with the unit vector `p` of the push (from the tool into the object), the place `r` of the touch from the middle of all
//!   touches, and the speed `v` of the push: `gap = p . t + w_z (p_y r_x - p_x r_y) + s (p . r) - L v + e`. `t` [m], `w_z` [rad] and `s`
//!   are shift, turn about z and scale of what the camera reports, `L` [s] its latency, `e` [m] what radius, dimensions and the contact's
//!   own softness are off by. With a tip that is `o` [m] beside where cell.toml has it, in the flange frame `R`: `gap = p . R o - L v + e`.
//! - Which rows: those in which the object cannot leave the tool. A tool that slows down more slowly than the least friction of cell.toml
//!   slows the object keeps it, once the first blow is over.
//! - What it does not separate: shifts of camera and tool, as long as the flange is turned alike in all clips; then the shift names both.

use super::corrected::Corrected;
use super::regression::{Regression, Sample, regress};
use super::reported::Off;
use super::{Axis, SHARED_SHARE_OF_NOISE, Shown, Witness};
use crate::likelihood::object::{SEEN_MOTION, noise_of};
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use shared_mem::cell::Cell;
use shared_mem::frames::Pose;
use twin::arm::ArmModel;
use twin::physics::touch::Capsule;
use twin::physics::{Material, TableObject};
use twin::scene::ObjectModel;
use twin::sliding::Coulomb;

const STAGE: &str = "contact";
/// After the object is first seen to move it may be ahead of the tool for so long [ns] (a choice: a blow at 0.4 m/s that returns a quarter
/// of the speed).
const AFTER_THE_BLOW_NS: u64 = 50_000_000;
/// Slower than this the tool does not push [m/s] (a choice).
const LEAST_SPEED: f64 = 0.02;
/// The tool's velocity and acceleration are differences over so much time [ns] (a choice: twice a pose's period at 60 Hz).
const DIFFERENCE_NS: f64 = 2e7;
/// Free fall [m/s^2].
const GRAVITY: f64 = 9.81;
/// The least friction of an object on a table where cell.toml states none.
const LEAST_FRICTION: f64 = 0.1;
/// A push along the table leans by less than this cosine (a choice).
const ALONG_THE_TABLE: f64 = 0.3;
/// A push of fewer rows may be a blow after which the object is ahead of the tool (a choice: 0.13 s at 60 Hz).
const FEWEST_ROWS: usize = 8;
/// So many more pushes than numbers say how much pushes differ (a choice).
const MORE_CLIPS: usize = 2;
/// Rows of a clip that share a larger error are not of a contact that holds, or of an object of other dimensions [m] (a choice).
const LARGEST_SHARED: f64 = 6e-4;
/// The tool explains what a camera does not where this share of the error that clips share stays (a choice).
const SHARE_THAT_DECIDES: f64 = 0.5;
/// One sigma of what is known of radius, dimensions and softness together [m].
const DIMENSIONS: f64 = 3e-4;
/// One sigma of shifts [m], turns [rad], scales and latencies [s] before anything is measured: far beyond what is plausible.
const PLAUSIBLE_SHIFT: f64 = 0.1;
const PLAUSIBLE_TURN: f64 = 1.0;
const PLAUSIBLE_SCALE: f64 = 1.0;
const PLAUSIBLE_LATENCY: f64 = 1.0;
/// A number is shown where the rows narrow it to this share of what was plausible (a choice).
const NARROWED: f64 = 0.1;

/// A pose during the push.
struct Push {
    clip: usize,
    /// Distance that is seen between tool and object [m].
    gap: f64,
    /// From the tool into the object, unit vector in the base frame.
    along: Vector3<f64>,
    /// The same in the flange frame.
    in_flange: Vector3<f64>,
    at: Point3<f64>,
    /// Of the tool along the push [m/s].
    speed: f64,
}

/// The arm, its tool and the object.
struct Bodies {
    arm: ArmModel,
    tool: Capsule,
    object: TableObject<Coulomb>,
    /// The least deceleration of an object that is let go [m/s^2].
    let_go: f64,
}

impl Bodies {
    fn of(cell: &Cell) -> Option<Self> {
        let tool = cell.tool.as_ref()?;
        let model = ObjectModel::new(cell, None).ok()??;
        let range = cell.object()?.friction_range;
        Some(Self {
            arm: ArmModel::from_cell(cell).ok()?,
            tool: Capsule { segment: tool.length - tool.radius, radius: tool.radius },
            object: TableObject::new(&model, Material::nominal(model.parameters()), None).ok()?,
            let_go: GRAVITY * range.map_or(LEAST_FRICTION, |[least, _]| least),
        })
    }

    /// The rows of a clip in which the tool cannot but touch the object.
    fn pushes(&mut self, clip: usize, recorded: &Corrected) -> Vec<Push> {
        let (stamps, poses) = (&recorded.stamps_ns, &recorded.poses);
        let moved =
            |pose: &Isometry3<f64>| (pose.translation.vector - poses[0].translation.vector).norm() > SEEN_MOTION;
        let Some(first) = poses.iter().position(moved) else { return Vec::new() };
        let after = |row: &usize| stamps[*row] > stamps[first] + AFTER_THE_BLOW_NS;
        let rows = (first..poses.len()).filter(after);
        rows.map_while(|row| self.push(recorded, row).map(|push| Push { clip, ..push })).collect()
    }

    /// The push in which a pose was taken; `None` where the tool may have left the object.
    fn push(&mut self, recorded: &Corrected, row: usize) -> Option<Push> {
        let at_ns = recorded.stamps_ns[row] as f64;
        let flange = |at_ns: f64| recorded.flange(&self.arm, at_ns);
        let [before, now, after] = [flange(at_ns - DIFFERENCE_NS)?, flange(at_ns)?, flange(at_ns + DIFFERENCE_NS)?];
        self.object.set(&Pose::from_isometry(recorded.poses[row]), Vector3::zeros(), Vector3::zeros());
        let touch = self.object.touch(&self.tool, &now);
        let in_flange = now.inverse() * touch.point;
        let [x0, x1, x2] = [before, now, after].map(|flange| (flange * in_flange).coords.dot(&touch.normal));
        let seconds = 1e-9 * DIFFERENCE_NS;
        let (speed, gains) = ((x2 - x0) / (2.0 * seconds), (x2 - 2.0 * x1 + x0) / seconds.powi(2));
        let level = touch.normal.z.abs() < ALONG_THE_TABLE;
        (level && speed > LEAST_SPEED && gains > -self.let_go).then(|| Push {
            clip: 0,
            gap: -touch.depth,
            along: touch.normal,
            in_flange: now.rotation.inverse() * touch.normal,
            at: touch.point,
            speed,
        })
    }
}

/// The witnesses of pushes.
pub(super) fn witnesses(cell: &Cell, clips: &[Corrected]) -> Vec<Witness> {
    let of_clip = |(clip, recorded): (usize, &Corrected)| Some(Bodies::of(cell)?.pushes(clip, recorded));
    let lasting = clips.par_iter().enumerate().filter_map(of_clip).filter(|pushes| pushes.len() >= FEWEST_ROWS);
    let pushes: Vec<Push> = lasting.flatten().collect();
    let least_shared = SHARED_SHARE_OF_NOISE * noise_of(cell).position;
    let (camera, tool) = (of_camera(&pushes), of_tool(&pushes));
    let found = |samples: &[Sample], scale: &[f64]| regress(samples, scale, scale.len() - 1, least_shared);
    let (scale, tool_scale) = (camera_scale(), tool_scale());
    let (Some(by_camera), Some(by_tool)) = (found(&camera, &scale), found(&tool, &tool_scale)) else {
        return Vec::new();
    };
    if by_tool.shared < SHARE_THAT_DECIDES * by_camera.shared {
        shown(shown_of_tool(), &tool, &by_tool, &tool_scale)
    } else {
        shown(shown_of_camera(), &camera, &by_camera, &scale)
    }
}

/// The witnesses of a regression whose contact holds.
fn shown(numbers: Vec<Shown>, samples: &[Sample], found: &Regression, scale: &[f64]) -> Vec<Witness> {
    if found.shared > LARGEST_SHARED || found.clips() < numbers.len() + MORE_CLIPS {
        return Vec::new();
    }
    let witness = |(k, number): (usize, Shown)| {
        if found.errors[k] < NARROWED * scale[k] { number.of(STAGE, k, samples, found) } else { None }
    };
    numbers.into_iter().enumerate().filter_map(witness).collect()
}

fn camera_scale() -> Vec<f64> {
    vec![PLAUSIBLE_SHIFT, PLAUSIBLE_SHIFT, PLAUSIBLE_TURN, PLAUSIBLE_SCALE, PLAUSIBLE_LATENCY, DIMENSIONS]
}

fn tool_scale() -> Vec<f64> {
    vec![PLAUSIBLE_SHIFT, PLAUSIBLE_SHIFT, PLAUSIBLE_SHIFT, PLAUSIBLE_LATENCY, DIMENSIONS]
}

fn of_camera(pushes: &[Push]) -> Vec<Sample> {
    let middle = pushes.iter().map(|push| push.at.coords).sum::<Vector3<f64>>() / pushes.len() as f64;
    let sample = |push: &Push| {
        let (p, r) = (push.along, push.at.coords - middle);
        let turn = p.y * r.x - p.x * r.y;
        let along = p.x * r.x + p.y * r.y;
        Sample { clip: push.clip, regressors: vec![p.x, p.y, turn, along, -push.speed, 1.0], measured: push.gap }
    };
    pushes.iter().map(sample).collect()
}

fn of_tool(pushes: &[Push]) -> Vec<Sample> {
    let sample = |push: &Push| {
        let p = push.in_flange;
        Sample { clip: push.clip, regressors: vec![p.x, p.y, p.z, -push.speed, 1.0], measured: push.gap }
    };
    pushes.iter().map(sample).collect()
}

const GAP: Axis = Axis { name: "gap that is seen while they touch", unit: "m" };

fn shown_of_camera() -> Vec<Shown> {
    let shift = |number, name| Shown {
        off: Off::Shift,
        number,
        unit: "m",
        alike: &[Off::Tip, Off::Encoders, Off::Scale],
        against: Axis { name, unit: "1" },
        measured: GAP,
        turned: false,
    };
    vec![
        shift("translation along x", "share of the push along x"),
        shift("translation along y", "share of the push along y"),
        Shown {
            off: Off::Turn,
            number: "rotation about z",
            unit: "rad",
            alike: &[],
            against: Axis { name: "lever of the push about the middle", unit: "m" },
            measured: GAP,
            turned: false,
        },
        Shown {
            off: Off::Scale,
            number: "scale",
            unit: "1",
            alike: &[],
            against: Axis { name: "way of the touch from the middle, along the push", unit: "m" },
            measured: GAP,
            turned: false,
        },
        latency(),
    ]
}

fn latency() -> Shown {
    Shown {
        off: Off::Late,
        number: "latency",
        unit: "s",
        alike: &[],
        against: Axis { name: "speed of the push", unit: "m/s" },
        measured: Axis { name: "how deep the tool seems to be in the object", unit: "m" },
        turned: true,
    }
}

fn shown_of_tool() -> Vec<Shown> {
    let offset = |number, name| Shown {
        off: Off::Tip,
        number,
        unit: "m",
        alike: &[Off::Encoders],
        against: Axis { name, unit: "1" },
        measured: GAP,
        turned: false,
    };
    vec![
        offset("offset along x of the flange", "share of the push along x of the flange"),
        offset("offset along y of the flange", "share of the push along y of the flange"),
        offset("offset along z of the flange", "share of the push along z of the flange"),
        latency(),
    ]
}
