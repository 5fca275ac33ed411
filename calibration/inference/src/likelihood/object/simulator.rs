//! A clip by another program ([`crate::engine`]) in place of the twin. As with an arm alone ([`crate::likelihood::motion`]) the nominal
//! cell is the engine's, and what it does not know is added as the twin's own difference:
//!
//! ```text
//! outcome(theta, own) = engine(known) + twin(theta, own) - twin(known)
//! ```
//!
//! Encoders add up as numbers. Of poses the places add up, and turns are put one behind the other: the engine's, then the one from
//! `twin(known)` to `twin(theta, own)`, each about the base's axes. All three begin with the object where the recorded poses have it
//! and the arm in one state. Camera effects are applied to the outcome, so that they are exact. Of a clip's nuisance parameters
//! the engine gets none.
//!
//! The difference is taken at equal times. The twin may touch the object some milliseconds before or after the engine does, and let it go
//! with another speed: what an effect changes then is right to first order, the less the nearer both hits are to each other.

use super::outcome::{Outcome, Path};
use super::rollout::{Job, impossible};
use crate::engine::{Engine, ObjectBody, ObjectQuestion, POSE, Quantity, Question};
use crate::estimate::Impossible;
use crate::likelihood::motion::{commands, states};
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};
use shared_mem::cell::Cell;
use shared_mem::frames::Pose;
use shared_mem::place;
use shared_mem::theta::Theta;
use shared_mem::time::TICK_NS;
use std::sync::Arc;
use twin::arm::{Joints, MAX_JOINTS};
use twin::physics::{Material, Outline};
use twin::scene::ObjectModel;

/// The object has been touched once it is so far from where it stood [m]; what an engine's contact sinks in by is less.
const TOUCHED_MOTION: f64 = 1e-4;

/// Another program, and what it is not asked to change.
#[derive(Debug, Clone)]
pub(super) struct Simulator {
    pub(super) engine: Arc<Engine>,
    /// The cell's nominal parameters.
    pub(super) nominal: Theta,
}

impl Simulator {
    /// The part of the parameters that the engine knows.
    pub(super) fn part(&self, theta: &Theta) -> Theta {
        self.engine.ability().part(theta, &self.nominal)
    }

    /// The clip as the engine alone simulates it, the object's path from the first measured row on. Of the job's parameters it must know all.
    pub(super) fn outcome(&self, job: &mut Job<'_>) -> Result<Outcome, Impossible> {
        job.worker.set_parameters(job.theta).map_err(impossible)?;
        let model = ObjectModel::new(job.cell, Some(job.theta)).map_err(impossible)?;
        let model = model.ok_or_else(|| impossible("the cell has no object"))?;
        let camera = job.worker.cell().camera_effects();
        let (start, (track, first)) = (job.standing(&model)?, job.begun()?);
        let dof = job.clip.recorded.measured.dof;
        let start_ns = job.clip.recorded.measured.stamps_ns[0];
        let end_ns = job.joints_ns.last().map_or(job.clip.end_ns, |last| job.clip.end_ns.max(*last));
        let periods = end_ns.saturating_sub(start_ns).div_ceil(TICK_NS).max(1);
        let (rows, before) = commands(track, start_ns..start_ns + periods * TICK_NS, dof);
        let after = |stamp: u64| stamp.saturating_sub(start_ns) as f64 * 1e-9;
        let times: Vec<f64> = job.joints_ns.iter().map(|stamp| after(*stamp)).collect();
        let pose_times: Vec<f64> = (0..=periods).map(|period| after(start_ns + period * TICK_NS)).collect();
        let body = body(&model, job.cell)?;
        let numbers = states(
            &self.engine,
            &Question {
                theta: job.theta,
                dof,
                start: &[&first.q[..dof], &first.dq[..dof]].concat(),
                before,
                commands: &rows,
                readings: &[Quantity::Position],
                times: &times,
                object: Some(ObjectQuestion { body: &body, start: &Pose::from_isometry(start), times: &pose_times }),
            },
        )?;
        let (joints, poses) = numbers.split_at(times.len() * dof);
        let path = Path { start_ns, poses: poses.chunks_exact(POSE).map(pose).collect() };
        let moved =
            |pose: &Isometry3<f64>| (pose.translation.vector - start.translation.vector).norm() > TOUCHED_MOTION;
        let touched = path.poses.iter().position(moved);
        Ok(Outcome {
            contact_ns: touched.map(|period| start_ns + period as u64 * TICK_NS),
            object: path,
            joints: joints.chunks_exact(dof).map(padded).collect(),
            camera,
        })
    }
}

/// The engine's outcome plus the twin's difference.
pub(super) fn composed(theirs: &Outcome, with: &Outcome, without: &Outcome) -> Outcome {
    let start_ns = theirs.object.start_ns;
    let pose = |(period, theirs): (usize, &Isometry3<f64>)| {
        let stamp = (start_ns + period as u64 * TICK_NS) as f64;
        let [with, without] = [with, without].map(|outcome| outcome.object.at(stamp));
        let place = theirs.translation.vector + with.translation.vector - without.translation.vector;
        let turn = with.rotation * without.rotation.inverse() * theirs.rotation;
        Isometry3::from_parts(place.into(), UnitQuaternion::new_normalize(turn.into_inner()))
    };
    let joints = |((theirs, with), without): ((&Joints, &Joints), &Joints)| {
        std::array::from_fn(|joint| theirs[joint] + with[joint] - without[joint])
    };
    Outcome {
        object: Path { start_ns, poses: theirs.object.poses.iter().enumerate().map(pose).collect() },
        joints: theirs.joints.iter().zip(&with.joints).zip(&without.joints).map(joints).collect(),
        contact_ns: theirs.contact_ns,
        camera: with.camera,
    }
}

/// The object's numbers, without what effects change of them.
fn body(model: &ObjectModel, cell: &Cell) -> Result<ObjectBody, Impossible> {
    let inertia = Outline::of(model, &Material::nominal(model.parameters())).map_err(impossible)?.inertia;
    let mesh = cell.object().and_then(|object| object.mesh.as_ref()).map(|mesh| cell.folder.join(mesh));
    let mesh = mesh.map(|mesh| place::from_anywhere(&mesh).display().to_string());
    Ok(ObjectBody {
        mass: model.mass,
        centre_of_mass: model.centre_of_mass.into(),
        inertia: std::array::from_fn(|i| std::array::from_fn(|j| inertia[(i, j)])),
        friction: model.friction,
        tip_friction: model.tip_friction,
        restitution: model.restitution,
        size: (model.shape.half_extents() * 2.0).into(),
        mesh,
    })
}

fn pose(numbers: &[f64]) -> Isometry3<f64> {
    let turn = Quaternion::new(numbers[3], numbers[4], numbers[5], numbers[6]);
    Isometry3::from_parts(Translation3::new(numbers[0], numbers[1], numbers[2]), UnitQuaternion::new_normalize(turn))
}

fn padded(joints: &[f64]) -> Joints {
    let mut all = [0.0; MAX_JOINTS];
    all[..joints.len()].copy_from_slice(joints);
    all
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Vector3;
    use twin::effects::CameraEffects;

    fn outcome(start_ns: u64, joint: f64, pose: Isometry3<f64>) -> Outcome {
        let object = Path { start_ns, poses: vec![pose; 3] };
        Outcome {
            object,
            joints: vec![[joint; MAX_JOINTS]],
            contact_ns: Some(start_ns),
            camera: CameraEffects::default(),
        }
    }

    #[test]
    fn places_and_encoders_add_up_and_turns_follow_each_other() {
        let turned = |place: [f64; 3], axis: Vector3<f64>| Isometry3::new(place.into(), axis);
        let theirs = outcome(5, 0.3, turned([0.5, 0.1, 0.05], Vector3::z() * 1.2));
        let with = outcome(7, 0.02, turned([0.41, 0.0, 0.05], Vector3::z() * 0.5));
        let without = outcome(9, 0.01, turned([0.4, 0.02, 0.05], Vector3::z() * 0.4));
        let sum = composed(&theirs, &with, &without);
        assert_eq!((sum.object.start_ns, sum.object.poses.len(), sum.contact_ns), (5, 3, Some(5)));
        let pose = sum.object.poses[1];
        assert!((pose.translation.vector - Vector3::new(0.51, 0.08, 0.05)).norm() < 1e-15, "{pose}");
        assert!((pose.rotation.scaled_axis() - Vector3::z() * 1.3).norm() < 1e-12, "{pose}");
        assert!((sum.joints[0][0] - 0.31).abs() < 1e-15);
        // About an axis of the base, whichever way the object lies.
        let tipped = outcome(5, 0.0, turned([0.0; 3], Vector3::x() * 0.7));
        let turn = composed(&tipped, &with, &without).object.poses[0].rotation;
        let expected = UnitQuaternion::from_scaled_axis(Vector3::z() * 0.1) * tipped.object.poses[0].rotation;
        assert!(turn.angle_to(&expected) < 1e-12, "{turn}");
    }
}
