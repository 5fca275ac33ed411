//! The files of an object with a part that moves: both parts, their convex pieces, a URDF with the joint, a block for a task, a report.
//! The base has the frame of the meshes that it was made from; the part's frame lies on the joint, where the part is in the middle of
//! its axis, with the base's axes at position 0.
//!
//! | file | owns |
//! |---|---|
//! | `description` | URDF and block |
//! | `drawing` | pictures of both states |
//! | `page` | the report |
//! | `summary` | the numbers as JSON |

mod description;
mod drawing;
mod page;
mod summary;

pub use summary::{ArticulatedSummary, JointNumbers, PartNumbers};

use super::Labels;
use crate::articulated::{Articulated, Joint};
use crate::mesh::{Mesh, obj};
use nalgebra::{Isometry3, Point3, Translation3};
use std::path::PathBuf;

/// The two links, in the order of all lists here.
pub const LINKS: [&str; 2] = ["base", "part"];

/// From the frame of the meshes to each link's frame.
pub fn links_from_mesh(object: &Articulated) -> [Isometry3<f64>; 2] {
    let back = object.joint.by(-object.position);
    [Isometry3::identity(), Translation3::from(-origin(object, &back).coords) * back]
}

/// Where the part's frame lies in the base's at position 0.
fn origin(object: &Articulated, back: &Isometry3<f64>) -> Point3<f64> {
    let (low, high) = object.part.fine.bounds();
    match object.joint {
        Joint::Revolute { point, .. } => point,
        Joint::Prismatic { .. } => back * nalgebra::center(&low, &high),
    }
}

/// A mesh in another frame.
pub fn in_frame(mesh: &Mesh, frame: &Isometry3<f64>) -> Mesh {
    Mesh { points: mesh.points.iter().map(|p| frame * p).collect(), triangles: mesh.triangles.clone() }
}

/// All files with their paths in the output folder; `pieces` are convex and in the links' frames.
pub fn articulated_files(object: &Articulated, pieces: &[Vec<Mesh>; 2], labels: &Labels) -> Vec<(PathBuf, Vec<u8>)> {
    let summary = ArticulatedSummary::of(object, labels);
    let frames = links_from_mesh(object);
    let mut files = vec![
        ("articulated.urdf".into(), description::urdf(&summary, pieces).into_bytes()),
        ("task_articulated.toml".into(), description::block(&summary).into_bytes()),
        ("articulated.json".into(), summary.json()),
        ("report.html".into(), page::page(object, &summary, labels).into_bytes()),
    ];
    for (number, part) in [&object.base, &object.part].into_iter().enumerate() {
        let link = LINKS[number];
        files.push((format!("{link}.obj").into(), obj(&in_frame(&part.coarse, &frames[number])).into_bytes()));
        files.push((format!("{link}_fine.obj").into(), obj(&in_frame(&part.fine, &frames[number])).into_bytes()));
        for (piece, mesh) in pieces[number].iter().enumerate() {
            let (low, high) = mesh.bounds();
            let middle = nalgebra::center(&low, &high);
            files.push((description::piece_file(link, piece).into(), obj(&super::centred(mesh, &middle)).into_bytes()));
        }
    }
    files
}
