//! Two closed meshes out of one that is cut along the border between the parts.

use super::body::Body;
use crate::field::Field;
use crate::mesh::{Mesh, surface};

/// Half of the gap between the parts [voxel].
const GAP: f32 = 0.25;

/// The base and the part that moves, each as its largest piece; `None` where nothing is left of one of them.
pub(super) fn split(body: &Body, border: &Field<f32>) -> Option<[Mesh; 2]> {
    let cut = |sign: f32| {
        let both = body.field.distance.iter().zip(&border.distance);
        let distance = both.map(|(own, border)| own.max(sign * border + GAP)).collect();
        surface(&Field { grid: body.field.grid, distance, colour: Vec::new() }).map(|(mesh, _)| mesh)
    };
    Some([cut(-1.0)?, cut(1.0)?])
}
