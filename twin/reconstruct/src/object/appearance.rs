//! Splats of the object: they start on the corners of its mesh, in the colours of the field, and are trained on the views from
//! where the optimisation has put the cameras.

use super::{ObjectError, SPLATS};
use crate::field::Field;
use crate::mesh::Mesh;
use crate::scan::Frame;
use crate::splats::{self, of_object};
use nalgebra::Isometry3;
use shared_mem::progress::Progress;
use splat::{Photograph, Settings, SplatCloud, TrainError};
use std::path::PathBuf;

/// Steps with a grid of 128 nodes along an edge; fewer with fewer.
const STEPS_AT_128: f64 = 2000.0;
/// Degree of the harmonics.
const DEGREE: usize = 1;

/// Steps for a grid of so many nodes along an edge.
pub(super) fn steps(edge: u32) -> usize {
    (STEPS_AT_128 * (f64::from(edge) / 128.0).sqrt().min(1.0)).ceil() as usize
}

/// Trains the splats of a mesh. `state`: where an interrupted training is kept.
pub(super) fn trained(
    bar: &Progress,
    (field, mesh): (&Field<f32>, &Mesh),
    (frames, poses): (&[Frame], &[Isometry3<f64>]),
    steps: usize,
    state: PathBuf,
) -> Result<SplatCloud, ObjectError> {
    let points: Vec<_> = mesh.points.iter().map(|point| point.cast::<f32>()).collect();
    let colours: Vec<[f32; 3]> = mesh.points.iter().map(|point| field.colour_at(point).unwrap_or([0.5; 3])).collect();
    let start = SplatCloud::on_mesh(&points, &mesh.triangles, &colours, DEGREE);
    let photographs: Vec<Photograph> = frames.iter().zip(poses).map(|(frame, pose)| of_object(frame, pose)).collect();
    let settings = Settings { state: Some(state), ..Settings::object(steps) };
    splats::trained((bar, SPLATS), &start, &photographs, &settings).map_err(|error| match error {
        TrainError::Stopped(done) => ObjectError::Interrupted(100.0 * done as f64 / steps as f64, "training of splats"),
        error => error.into(),
    })
}
