//! A scene for other programs: meshes, splats, the block for cell.toml, numbers and a page. All in the scan's frame, in metres.

mod page;

use super::stems::stems;
use crate::mesh::{Mesh, obj, ply};
use crate::remark::Remark;
use crate::scan::Scale;
use crate::scene::{HeldOut, Scene};
use serde::Serialize;
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::pack_picture;
use std::path::PathBuf;

/// One count of a depth picture of splats [m].
const DEPTH_UNIT: f32 = 1e-4;
/// A table is level in a robot's base frame that is tilted by less [degrees].
const LEVEL: f64 = 2.0;

/// The numbers of a scene.
#[derive(Debug, Clone, Serialize)]
pub struct SceneSummary {
    /// The table: one of the levels; none where nothing is level.
    pub table: Option<LevelNumbers>,
    /// Planes that face up, the largest first.
    pub levels: Vec<LevelNumbers>,
    /// Whether the frame is the base frame of the robot that held the camera.
    pub in_base_frame: bool,
    /// Corners and triangles of the surface.
    pub surface: [usize; 2],
    /// Triangles of the mesh to collide with.
    pub collision_triangles: usize,
    pub splats: usize,
    /// Whether they were drawn into planes.
    pub planar: bool,
    /// Edge of a voxel [m].
    pub voxel_m: f64,
    /// Metres for one unit of the scan's poses, and who says so.
    pub scale: Scale,
    /// Views that it was made from.
    pub views: usize,
    pub held_out: Vec<ViewNumbers>,
    /// Their mean PSNR by splats, over whole pictures [dB].
    pub psnr_db: f64,
    /// Mean of their middle differences between the surface's depth and the measured one, with its noise [m]; `None` where none was
    /// measured.
    pub depth_off_m: Option<f64>,
    /// Of the pixels of the views that it was made from, the share of which depth was computed [1]; `None` where it was measured.
    pub computed_depth: Option<f64>,
    /// What a person should know.
    pub remarks: Vec<Remark>,
}

/// A plane that faces up.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct LevelNumbers {
    /// Of length 1, in the scan's frame.
    pub normal: [f64; 3],
    /// Along the normal from the origin: points p of the plane have normal · p = offset [m].
    pub offset_m: f64,
    /// Middle of its points [m].
    pub middle_m: [f64; 3],
    /// Corners of the surface on it.
    pub points: usize,
    /// About their area [m²].
    pub area_m2: f64,
}

/// The numbers of one held-out view.
#[derive(Debug, Clone, Serialize)]
pub struct ViewNumbers {
    pub view: String,
    /// PSNR of the splats over the whole picture [dB].
    pub psnr_db: f64,
    /// Middle difference between the surface's depth and the measured one [m]; `None` where none was measured.
    pub depth_off_m: Option<f64>,
    /// Share of the measured pixels at which there is a surface.
    pub covered: f64,
}

impl SceneSummary {
    /// The numbers of a scene.
    pub fn of(scene: &Scene) -> Self {
        let numbers = |level: &fusion::plane::Level| LevelNumbers {
            normal: level.plane.normal.into(),
            offset_m: level.plane.offset,
            middle_m: level.middle.coords.into(),
            points: level.plane.points,
            area_m2: level.plane.points as f64 * scene.voxel * scene.voxel,
        };
        let view = |view: &HeldOut| ViewNumbers {
            view: view.name.clone(),
            psnr_db: view.psnr,
            depth_off_m: view.depth_off,
            covered: view.covered,
        };
        Self {
            table: scene.table().map(numbers),
            levels: scene.levels.iter().map(numbers).collect(),
            in_base_frame: scene.of_robot,
            surface: [scene.surface.points.len(), scene.surface.triangles.len()],
            collision_triangles: scene.collision.triangles.len(),
            splats: scene.splats.splats.len(),
            planar: scene.planar,
            voxel_m: scene.voxel,
            scale: scene.scale,
            views: scene.train.len(),
            held_out: scene.held_out.iter().map(view).collect(),
            psnr_db: scene.psnr(),
            depth_off_m: scene.depth_off(),
            computed_depth: scene.computed.map(|computed| computed.share),
            remarks: scene.remarks.clone(),
        }
    }

    /// The `[table]` block of cell.toml; `None` where the frame is no robot's, or no table is level in it.
    fn block(&self) -> Option<String> {
        let table = self.table.filter(|_| self.in_base_frame)?;
        let tilt = table.normal[2].clamp(-1.0, 1.0).acos().to_degrees();
        (tilt < LEVEL).then(|| {
            format!(
                "# Of a scan: {} views, {} points, tilted by {tilt:.2} degrees.\n[table]\nheight = {:.4}\n",
                self.views, table.points, table.middle_m[2]
            )
        })
    }
}

/// All files with their paths in the output folder; `command` is the one that made it, for the report's foot.
pub fn scene_files(scene: &Scene, command: &str) -> Vec<(PathBuf, Vec<u8>)> {
    let summary = SceneSummary::of(scene);
    let surface = Mesh {
        points: scene.surface.points.iter().map(|point| point.cast()).collect(),
        triangles: scene.surface.triangles.clone(),
    };
    let byte = |value: f32| (value.clamp(0.0, 1.0) * 255.0).round() as u8;
    let colours: Vec<[u8; 3]> = scene.surface.colors.iter().map(|color| color.map(byte)).collect();
    let mut json = serde_json::to_vec_pretty(&summary).unwrap_or_default();
    json.push(b'\n');
    let mut files: Vec<(PathBuf, Vec<u8>)> = vec![
        ("scene.ply".into(), ply(&surface, &colours, None)),
        ("scene.obj".into(), obj(&scene.collision).into_bytes()),
        ("splats.ply".into(), scene.splats.ply()),
        ("scene.json".into(), json),
        ("report.html".into(), page::page(scene, &summary, command).into_bytes()),
    ];
    files.extend(summary.block().map(|block| ("cell_scene.toml".into(), block.into_bytes())));
    let stems = stems(scene.held_out.iter().map(|view| view.name.as_str()));
    for (view, stem) in scene.held_out.iter().zip(stems) {
        let rgb = pack_picture(PixelEncoding::Rgb8, view.width, view.height, view.splats.as_flattened());
        files.extend(rgb.ok().map(|bytes| (format!("held_out/{stem}.png").into(), bytes)));
        // Beyond what 16 bits hold there is none.
        let count = |z: &f32| (z / DEPTH_UNIT).round();
        let counts = view.splat_depth.iter().map(|z| if count(z) < 65_535.0 { count(z) as u16 } else { 0 });
        let depth: Vec<u8> = counts.flat_map(u16::to_le_bytes).collect();
        let depth = pack_picture(PixelEncoding::Depth16, view.width, view.height, &depth);
        files.extend(depth.ok().map(|bytes| (format!("held_out/{stem}_depth.png").into(), bytes)));
    }
    files
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::ScaleSource;

    fn summary(normal: [f64; 3]) -> SceneSummary {
        let table = LevelNumbers { normal, offset_m: 0.02, middle_m: [0.5, 0.1, 0.0213], points: 9000, area_m2: 0.1 };
        SceneSummary {
            table: Some(table),
            levels: vec![table],
            in_base_frame: true,
            surface: [9000, 17_000],
            collision_triangles: 100,
            splats: 9000,
            planar: true,
            voxel_m: 4e-3,
            scale: Scale { metres: 1.0, source: ScaleSource::Robot, spread: 0.0 },
            views: 52,
            held_out: Vec::new(),
            psnr_db: 30.0,
            depth_off_m: Some(2e-3),
            computed_depth: None,
            remarks: Vec::new(),
        }
    }

    #[test]
    fn the_block_is_one_that_cell_toml_takes_and_a_tilted_table_has_none() {
        #[derive(serde::Deserialize)]
        struct Cell {
            table: shared_mem::cell::Table,
        }
        let cell: Cell = toml::from_str(&summary([0.0, 0.01, 1.0]).block().expect("a block")).expect("a table");
        assert!((cell.table.height - 0.0213).abs() < 1e-9);
        assert_eq!(summary([0.0, 0.1, 0.995]).block(), None);
        assert_eq!(SceneSummary { in_base_frame: false, ..summary([0.0, 0.0, 1.0]) }.block(), None);
    }
}
