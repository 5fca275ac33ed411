//! Clips with an object: what the twin makes of every clip under any parameters, and how far that is from the poses that
//! were recorded. Called by identification and by the diagnosis.
//!
//! A clip's rows are its poses: position along x, y, z and rotation vector about them, measured less predicted, each in
//! sigmas of the tracker's noise, base frame. Every clip has numbers of its own ([`Own`]): the hit above all differs a
//! little from any simulated one, and read as structure that little would be taken for an effect that is not there.
//!
//! | file | owns |
//! |---|---|
//! | `own` | the numbers of a clip's own |
//! | `clip` | a recorded clip, prepared |
//! | `rollout` | a clip in the twin |

mod clip;
mod own;
mod rollout;

pub use own::{ALL, Axis, Own, Values};

use crate::estimate::{ClipModel, Impossible, Random};
use clip::ObjectClip;
use nalgebra::Isometry3;
use rollout::Trace;
use shared_mem::cell::{Cell, PoseNoise};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use twin::effects::CameraMemory;

/// What the tracker's noise is taken for where cell.toml does not tell it, one sigma.
const NOISE: PoseNoise = PoseNoise { position: 1e-3, rotation: 5e-3 };

/// Residuals of a pose.
pub const ROWS: usize = 6;

fn noise_of(cell: &Cell) -> PoseNoise {
    cell.object.as_ref().and_then(|object| object.pose_noise).unwrap_or(NOISE)
}

/// Clips with an object, and what numbers mean for the cell.
pub struct ObjectClips<F> {
    cell: Cell,
    noise: PoseNoise,
    clips: Vec<ObjectClip>,
    theta: F,
}

impl<F: Fn(&[f64]) -> Theta + Sync> ObjectClips<F> {
    /// Clips of a cell, in their order; those without poses are left out. `theta` gives the parameters that go with
    /// shared numbers.
    pub fn new(cell: &Cell, clips: Vec<Clip>, theta: F) -> Self {
        let noise = noise_of(cell);
        let clips = clips.into_iter().filter_map(|clip| ObjectClip::new(clip, noise.position)).collect();
        Self { cell: cell.clone(), noise, clips, theta }
    }

    /// What varies from clip to clip, in the order of [`ALL`], with the scatter that is assumed until it is estimated;
    /// 0 where it means nothing in any of these clips.
    pub fn random(&self) -> Vec<Random> {
        let acts = |own: Own| self.clips.iter().any(|clip| own.acts_in(clip.recorded.kind));
        let of = |own: Own| Random { sigma: if acts(own) { own.sigma(&self.cell) } else { 0.0 }, ..own.random() };
        ALL.map(of).to_vec()
    }

    /// The poses that the tracker would have reported, one for each recorded one.
    ///
    /// # Errors
    /// [`Impossible`] when the cell cannot be simulated with these numbers.
    pub fn predict(&self, clip: usize, shared: &[f64], own: &[f64]) -> Result<Vec<Pose<Base, Object>>, Impossible> {
        let clip = &self.clips[clip];
        let own = Values::new(own, clip.recorded.kind);
        let trace = rollout::run(&self.cell, clip, &(self.theta)(shared), &own)?;
        Ok(reported(&trace, clip, &own))
    }

    /// A recorded clip.
    pub fn clip(&self, clip: usize) -> &Clip {
        &self.clips[clip].recorded
    }
}

fn reported(trace: &Trace, clip: &ObjectClip, own: &Values) -> Vec<Pose<Base, Object>> {
    let camera = &trace.effects.camera;
    let late = camera.latency_ns() as f64 + own.of(Own::Clock) * 1e9;
    let mut memory = CameraMemory::default();
    let stamps = clip.recorded.object.stamps_ns.iter();
    let seen = |stamp: &u64| {
        let pose = Pose::from_isometry(trace.at(*stamp as f64 - late));
        camera.seen(&mut memory, *stamp, pose)
    };
    stamps.map(seen).collect()
}

impl<F: Fn(&[f64]) -> Theta + Sync> ClipModel for ObjectClips<F> {
    fn clips(&self) -> usize {
        self.clips.len()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let predicted = self.predict(clip, shared, own)?;
        out.clear();
        for (measured, predicted) in self.clip(clip).object.poses.iter().zip(&predicted) {
            out.extend(difference(&measured.isometry(), &predicted.isometry(), self.noise));
        }
        Ok(())
    }
}

/// Measured less predicted in sigmas: position along x, y, z, rotation vector about them, base frame.
fn difference(measured: &Isometry3<f64>, predicted: &Isometry3<f64>, noise: PoseNoise) -> [f64; ROWS] {
    let shift = (measured.translation.vector - predicted.translation.vector) / noise.position;
    let turn = (measured.rotation * predicted.rotation.inverse()).scaled_axis() / noise.rotation;
    [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z]
}
