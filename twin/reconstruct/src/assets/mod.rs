//! What a simulation takes: meshes, convex pieces, URDF, a block for cell.toml, numbers, and a page that shows how good it is. All in
//! the object's own frame: the scan's axes, with the origin in the middle of the mesh's bounding box.
//!
//! | file | owns |
//! |---|---|
//! | `dataset` | pictures, poses and splats for other trainers |
//! | `description` | URDF and the block for cell.toml |
//! | `frame` | what all reports have in common |
//! | `page` | the report |
//! | `stems` | names of files that pictures become |
//! | `summary` | the numbers as JSON |
//! | `articulated` | the same for an object with a part that moves |
//! | `scene` | the files of a scene, in the scan's frame |

mod articulated;
mod dataset;
mod description;
mod frame;
mod page;
mod scene;
mod stems;
mod summary;

pub use articulated::{
    ArticulatedSummary, JointNumbers, LINKS, PartNumbers, articulated_files, in_frame, links_from_mesh,
};
pub use dataset::dataset_files;
pub use scene::{LevelNumbers, SceneSummary, ViewNumbers, scene_files};
pub use summary::Summary;

use description::escaped;
use stems::stems;

use crate::mesh::{Mesh, obj, ply};
use crate::object::{Certainty, Object};
use nalgebra::{Point3, Similarity3, Vector3};
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::pack_picture;
use splat::SplatCloud;
use std::path::PathBuf;

/// Colour of what is not known.
const UNKNOWN: [u8; 3] = [128, 128, 128];
/// Density where nobody weighed the object [kg/m³]: that of a filled package.
pub const DENSITY: f64 = 500.0;

/// What the files are called, and what the scan cannot say.
#[derive(Debug, Clone)]
pub struct Labels {
    /// The object's name.
    pub name: String,
    /// Its mass, where it was weighed [kg].
    pub mass: Option<f64>,
    /// The command that made it, for the report's foot.
    pub command: String,
}

/// Splats in the object's frame.
pub fn centred_splats(splats: &SplatCloud, middle: &Point3<f64>) -> SplatCloud {
    splats.moved(&Similarity3::new(-middle.coords, Vector3::zeros(), 1.0))
}

/// A mesh in the object's frame.
pub fn centred(mesh: &Mesh, middle: &Point3<f64>) -> Mesh {
    Mesh { points: mesh.points.iter().map(|p| p - middle.coords).collect(), triangles: mesh.triangles.clone() }
}

/// All files with their paths in the output folder; `pieces` are convex and in the object's frame.
pub fn files(object: &Object, pieces: &[Mesh], labels: &Labels) -> Vec<(PathBuf, Vec<u8>)> {
    let middle = object.middle();
    let (fine, coarse) = (centred(&object.fine, &middle), centred(&object.coarse, &middle));
    let colours: Vec<[u8; 3]> = (0..object.fine.points.len()).map(|corner| colour(object, corner)).collect();
    let splats = centred_splats(&object.splats, &middle);
    let summary = Summary::of(object, pieces, labels);
    let mut files = vec![
        ("object.obj".into(), obj(&coarse).into_bytes()),
        ("object_fine.obj".into(), obj(&fine).into_bytes()),
        ("object.ply".into(), ply(&fine, &colours, Some(&object.shown))),
        ("splats.ply".into(), splats.ply()),
        ("object.urdf".into(), description::urdf(&summary, pieces.len()).into_bytes()),
        ("cell_object.toml".into(), description::block(&summary).into_bytes()),
        ("object.json".into(), summary.json()),
        ("report.html".into(), page::page(object, &summary, labels).into_bytes()),
    ];
    for (number, piece) in pieces.iter().enumerate() {
        files.push((description::piece_file(number).into(), obj(piece).into_bytes()));
    }
    let stems = stems(object.held_out.iter().map(|view| view.name.as_str()));
    for (view, stem) in object.held_out.iter().zip(stems) {
        for (rgb, of) in [(&view.drawn.rgb, ""), (&view.splats, "_splats")] {
            let packed = pack_picture(PixelEncoding::Rgb8, view.width, view.height, rgb.as_flattened());
            files.extend(packed.ok().map(|bytes| (format!("held_out/{stem}{of}.png").into(), bytes)));
        }
    }
    files
}

/// Of a corner of the fine mesh; grey where it is a guess.
fn colour(object: &Object, corner: usize) -> [u8; 3] {
    let is_known = object.certainty[corner] == Certainty::Known;
    let known = object.field.colour_at(&object.fine.points[corner]).filter(|_| is_known);
    known.map_or(UNKNOWN, |colour| colour.map(|c| (c * 255.0).round() as u8))
}
