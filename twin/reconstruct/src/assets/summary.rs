//! The numbers of an object, as JSON and for the other files.

use super::{DENSITY, Labels};
use crate::mesh::{Mesh, Solid, Topology};
use crate::object::{Certainty, Object, TableSource};
use crate::remark::Remark;
use crate::scan::Scale;
use serde::Serialize;

/// The numbers of an object.
#[derive(Debug, Clone, Serialize)]
pub struct Summary {
    /// The object's name.
    pub name: String,
    /// Edges of its box along the scan's axes [m].
    pub size_m: [f64; 3],
    /// Where its frame's origin lies in the scan's frame [m].
    pub origin_in_scan_m: [f64; 3],
    /// Volume [m³].
    pub volume_m3: f64,
    /// Volume of the convex pieces together [m³].
    pub pieces_volume_m3: f64,
    pub pieces: usize,
    /// Mass [kg].
    pub mass_kg: f64,
    /// Whether it was weighed; else it is the volume's at [`DENSITY`].
    pub weighed: bool,
    /// Centre of mass from the origin, as if of one material [m].
    pub centre_of_mass_m: [f64; 3],
    /// Inertia about it: xx, xy, xz, yy, yz, zz [kg m²].
    pub inertia_kg_m2: [f64; 6],
    /// The fine mesh.
    pub surface: Topology,
    /// Triangles of the coarse mesh.
    pub coarse_triangles: usize,
    pub splats: usize,
    /// Metres for one unit of the scan's poses, and who says so.
    pub scale: Scale,
    /// Views that it was made from.
    pub views: usize,
    /// Whether they had depth.
    pub with_depth: bool,
    /// Of the object's pixels, the share of which depth was computed from the pictures [1]; `None` where it was measured.
    pub computed_depth: Option<f64>,
    /// How far the cameras' poses were moved, root mean square [m].
    pub cameras_moved_m: f64,
    pub held_out: Vec<HeldOutNumbers>,
    /// Their mean PSNR inside the mask [dB].
    pub psnr_db: f64,
    /// That of the splats [dB].
    pub psnr_splats_db: f64,
    /// Distance of the grid's nodes [m].
    pub voxel_m: f64,
    /// The table at which the base is closed, a guess; `None` where nothing says where it is.
    pub table: Option<TableNumbers>,
    /// Of the surface, what is not known.
    pub unknown: UnknownNumbers,
    /// What a person should know.
    pub remarks: Vec<Remark>,
}

/// The plane under an object: the points p with `normal · p = offset_m`, in the scan's frame.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct TableNumbers {
    /// Up, of length 1.
    pub normal: [f64; 3],
    /// Along it from the origin [m].
    pub offset_m: f64,
    pub source: TableSource,
}

/// Shares of the surface of which views do not say where it is [1]; `object.ply` has them in grey.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct UnknownNumbers {
    /// Fewer than two views show it.
    pub unseen: f64,
    /// Their colours there contradict each other.
    pub contradicted: f64,
    /// Their colours agree as well two voxels deeper, and no outline shows it.
    pub ambiguous: f64,
}

/// The numbers of one held-out view.
#[derive(Debug, Clone, Serialize)]
pub struct HeldOutNumbers {
    pub view: String,
    /// PSNR inside the mask with the camera fitted to the object [dB].
    pub psnr_db: f64,
    /// PSNR inside the mask with the camera where the scan has it [dB].
    pub psnr_as_given_db: f64,
    /// PSNR of the splats inside the mask, from where the object has put the camera [dB].
    pub psnr_splats_db: f64,
    /// Silhouette and mask: what they have in common, of what either has.
    pub overlap: f64,
}

impl Summary {
    /// The numbers of an object with its convex pieces.
    pub fn of(object: &Object, pieces: &[Mesh], labels: &Labels) -> Self {
        let (low, high) = object.fine.bounds();
        let middle = object.middle();
        let solid = &object.solid;
        let mass = labels.mass.unwrap_or(DENSITY * solid.volume);
        let inertia = solid.unit_inertia * mass;
        let held_out = object.held_out.iter().map(|view| HeldOutNumbers {
            view: view.name.clone(),
            psnr_db: view.psnr,
            psnr_as_given_db: view.psnr_as_given,
            psnr_splats_db: view.psnr_splats,
            overlap: view.overlap,
        });
        Self {
            name: labels.name.clone(),
            size_m: (high - low).into(),
            origin_in_scan_m: middle.coords.into(),
            volume_m3: solid.volume,
            pieces_volume_m3: pieces.iter().map(|piece| Solid::of(piece).volume).sum(),
            pieces: pieces.len(),
            mass_kg: mass,
            weighed: labels.mass.is_some(),
            centre_of_mass_m: (solid.centroid - middle).into(),
            inertia_kg_m2: [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| inertia[at]),
            surface: object.topology,
            coarse_triangles: object.coarse.triangles.len(),
            splats: object.splats.splats.len(),
            scale: object.scale,
            views: object.train.len(),
            with_depth: object.with_depth,
            computed_depth: object.computed.map(|computed| computed.share),
            cameras_moved_m: object.moved,
            held_out: held_out.collect(),
            psnr_db: object.psnr(),
            psnr_splats_db: object.psnr_splats(),
            voxel_m: object.field.grid.voxel,
            table: object.support.map(|support| TableNumbers {
                normal: support.table.normal.into(),
                offset_m: support.table.offset,
                source: support.source,
            }),
            unknown: UnknownNumbers {
                unseen: object.share(Certainty::Unseen),
                contradicted: object.share(Certainty::Contradicted),
                ambiguous: object.share(Certainty::Ambiguous),
            },
            remarks: object.remarks.clone(),
        }
    }

    pub(super) fn json(&self) -> Vec<u8> {
        let mut bytes = serde_json::to_vec_pretty(self).unwrap_or_default();
        bytes.push(b'\n');
        bytes
    }
}
