//! A scene out of a scan, with depth that was measured or is computed: what stands around, as one surface, its levels, splats, and a mesh
//! of fewer triangles to collide with.
//!
//! | file | owns |
//! |---|---|
//! | `views` | the views' pixels; whether poses and depth belong together |
//! | `upright` | which way is up; whether the views look from one side alone |
//! | `judge` | held-out views |

mod judge;
mod upright;
mod views;

pub use judge::HeldOut;

use crate::computed::{self, Computed, DEPTH, Wanted};
use crate::mesh::{self, Mesh};
use crate::remark::Remark;
use crate::scan::{Frame, Scale, ScaleSource, Scan, ScanError};
use crate::splats;
use crate::views::spread;
use fusion::Surface;
use fusion::fuse::{Grid, Settings as Fineness, View};
use fusion::plane::{Level, levels, table};
use shared_mem::ending;
use shared_mem::progress::{Planned, Progress};
use splat::{Photograph, Settings, SplatCloud, TrainError};
use std::path::Path;
use views::Views;

/// Triangles of the mesh to collide with.
pub const COLLISION: usize = 10_000;
/// Splats at most.
const MOST_SPLATS: usize = 60_000;
/// Degree of their harmonics.
const DEGREE: usize = 1;
/// Depths beyond are left out: a stereo camera's are off by centimetres there [m].
const FARTHEST: f32 = 4.0;
/// Voxels that fewer views saw are no surface.
const MIN_VIEWS: u16 = 3;
/// Parts of a surface with fewer triangles are noise.
const ISLAND: usize = 200;

/// What pictures without depth show lies no nearer [m].
const NEAREST: f64 = 0.15;

/// Stages of the work with how long each takes of 60 views on two cores [s].
const STAGES: [Planned; 6] = [(READ, 5.0), (DEPTH, 110.0), (FUSE, 15.0), (MESH, 12.0), (SPLATS, 300.0), (JUDGE, 8.0)];
const READ: &str = "read";
const FUSE: &str = "fuse";
const MESH: &str = "mesh";
const SPLATS: &str = "splats";
const JUDGE: &str = "judge";

/// No scene came of a scan.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// The scan cannot be used.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// Depth pictures and poses have different units.
    #[error("depth pictures say that one unit of the poses is {metres:.3} m, not 1 m: give --scale {metres:.3}")]
    Scale {
        /// Metres for one unit, as depth has it.
        metres: f64,
    },
    /// Depth was measured nowhere twice.
    #[error(
        "no surface is seen by {MIN_VIEWS} views nearer than {FARTHEST} m: take pictures that overlap, from nearer"
    )]
    Nothing,
    /// All views stand on one side.
    #[error(
        "all views look at the scene from within {degrees:.0} degrees, from one side: take pictures from around it"
    )]
    OneSide {
        /// The largest angle between two views, seen from the middle of the scene.
        degrees: f64,
    },
    /// The splats cannot be trained.
    #[error(transparent)]
    Splats(#[from] TrainError),
    #[error("interrupted; the same command goes on from {0:.0} % of the training of splats")]
    Interrupted(f64),
}

/// What a person may choose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Metres for one unit of the poses; `None`: as depth or the robot says.
    pub scale: Option<f64>,
    /// Edge of a voxel [m].
    pub voxel: f64,
    /// Whether splats are drawn into planes.
    pub planar: bool,
    /// Steps of their training.
    pub steps: usize,
}

/// A scene as its scan shows it. All in the scan's frame, in metres: of a robot's scan the robot's base frame.
#[derive(Debug, Clone)]
pub struct Scene {
    /// The surface that the views see together.
    pub surface: Surface,
    /// The same, coarser, in at most [`COLLISION`] triangles, as far as its holes leave that.
    pub collision: Mesh,
    pub splats: SplatCloud,
    /// Planes that face up, the largest first.
    pub levels: Vec<Level>,
    /// Which of them is the table.
    pub table: Option<usize>,
    /// Whether the frame is a robot's base frame.
    pub of_robot: bool,
    /// Where its scale comes from.
    pub scale: Scale,
    /// Edge of a voxel [m].
    pub voxel: f64,
    /// Whether splats were drawn into planes.
    pub planar: bool,
    /// How the held-out views look.
    pub held_out: Vec<HeldOut>,
    /// Views that it was made from.
    pub train: Vec<Frame>,
    /// The depth that was computed where none was measured.
    pub computed: Option<Computed>,
    /// What a person should know.
    pub remarks: Vec<Remark>,
}

/// Makes a scene of a scan; the training of the splats is kept in the file `kept`, and a run that finds it goes on from there.
///
/// # Errors
/// [`SceneError`] in one line.
pub fn reconstruct(scan: Scan, options: &Options, kept: &Path) -> Result<Scene, SceneError> {
    let bar = Progress::planned("reconstruct", &computed::stages(&STAGES, &scan), scan.views.len() as u64);
    let of_robot = scan.is_of_robot();
    let scale = scan.scale(options.scale)?;
    let scan = scan.scaled(scale.metres);
    let mut views = views::read(&scan, |done| bar.show(done, READ))?;
    let computed = if scan.has_depth() { None } else { Some(computed(&bar, &mut views.train)?) };
    views::agree(&views.train, scale.source == ScaleSource::Poses)?;
    let surface = fused(&bar, &views, options)?;
    upright::from_around(&surface, &views.train)?;
    bar.stage(MESH, 3);
    let (up, within) = upright::up(&views.train, of_robot);
    let levels = levels(&surface, &up, within);
    bar.show(1, MESH);
    let coarse = coarse(&surface, options.voxel as f32);
    let collision = mesh::reduced(&solid(&coarse), COLLISION);
    not_interrupted()?;
    let (splats, background) = trained(&bar, &coarse, &views, options, kept)?;
    bar.stage(JUDGE, 1 + views.held_out.len() as u64);
    let looks = judge::looks(&surface);
    let mut held_out = Vec::new();
    for frame in &views.held_out {
        bar.show(1 + held_out.len() as u64, JUDGE);
        not_interrupted()?;
        held_out.push(judge::held_out((&splats, options.planar), &looks, frame, background));
    }
    let mut remarks = views.remarks;
    remarks.extend(judge::remarks(&levels, computed.as_ref()));
    Ok(Scene {
        surface,
        collision,
        splats,
        table: table(&levels),
        levels,
        of_robot,
        scale,
        voxel: options.voxel,
        planar: options.planar,
        held_out,
        train: views.train,
        computed,
        remarks,
    })
}

/// Computes depth of the views that learn, of which none was measured.
fn computed(bar: &Progress, frames: &mut [Frame]) -> Result<Computed, SceneError> {
    let range = [NEAREST, f64::from(FARTHEST)];
    computed::fill(bar, frames, |_| Wanted { range, fine: Vec::new() }).ok_or(SceneError::Interrupted(0.0))
}

/// Before the splats there is little to keep.
fn not_interrupted() -> Result<(), SceneError> {
    if ending::asked() { Err(SceneError::Interrupted(0.0)) } else { Ok(()) }
}

/// The surface that the views see together, without the islands that noise leaves.
fn fused(bar: &Progress, views: &Views, options: &Options) -> Result<Surface, SceneError> {
    bar.stage(FUSE, 2 + views.train.len() as u64);
    let settings = Fineness {
        voxel: options.voxel as f32,
        least: MIN_VIEWS,
        farthest: FARTHEST,
        spread: spread(&views.train).unwrap_or_default() as f32,
        ..Fineness::default()
    };
    let mut grid = Grid::new(settings);
    for (number, frame) in views.train.iter().enumerate() {
        not_interrupted()?;
        let (camera, size) = splats::camera(frame);
        grid.add(&View { camera, size, depth: &frame.depth, rgb: Some(&frame.rgb) });
        bar.show(1 + number as u64, FUSE);
    }
    let surface = grid.surface().without_islands(ISLAND);
    not_interrupted()?;
    if surface.triangles.is_empty() { Err(SceneError::Nothing) } else { Ok(surface) }
}

/// The surface in double precision.
fn solid(surface: &Surface) -> Mesh {
    Mesh { points: surface.points.iter().map(|point| point.cast()).collect(), triangles: surface.triangles.clone() }
}

/// The surface with as many corners as there may be splats: their number falls with the square of the cell's edge.
fn coarse(surface: &Surface, voxel: f32) -> Surface {
    let mut coarse = surface.clone();
    let mut cell = voxel;
    while coarse.points.len() > MOST_SPLATS {
        cell *= (coarse.points.len() as f32 / MOST_SPLATS as f32).sqrt().max(1.05);
        coarse = surface.clustered(cell);
    }
    coarse
}

/// Splats that start on the corners of a surface, and what lies behind them.
fn trained(
    bar: &Progress,
    coarse: &Surface,
    views: &Views,
    options: &Options,
    kept: &Path,
) -> Result<(SplatCloud, [f32; 3]), SceneError> {
    let start = SplatCloud::on_mesh(&coarse.points, &coarse.triangles, &coarse.colors, DEGREE);
    let photographs: Vec<Photograph> = views.train.iter().map(splats::of_scene).collect();
    let background = splats::behind(&photographs);
    let planar = Settings::scene(options.steps);
    let settings = if options.planar {
        planar
    } else {
        Settings { flatten: 0.0, weights: splat::Weights { normals: 0.0, ..planar.weights }, ..planar }
    };
    let settings = Settings { background, state: Some(kept.to_owned()), ..settings };
    let trained = splats::trained((bar, SPLATS), &start, &photographs, &settings);
    let trained = trained.map_err(|error| match error {
        TrainError::Stopped(done) => SceneError::Interrupted(100.0 * done as f64 / options.steps as f64),
        error => error.into(),
    })?;
    Ok((trained, background))
}

impl Scene {
    /// The table's plane and the middle of its points.
    pub fn table(&self) -> Option<&Level> {
        self.table.map(|number| &self.levels[number])
    }

    /// Mean PSNR of the held-out views by splats [dB].
    pub fn psnr(&self) -> f64 {
        self.held_out.iter().map(|view| view.psnr).sum::<f64>() / self.held_out.len().max(1) as f64
    }

    /// Mean of the held-out views' middle difference between the surface's depth and the measured one [m]; `None` where none was measured.
    pub fn depth_off(&self) -> Option<f64> {
        let all: Vec<f64> = self.held_out.iter().filter_map(|view| view.depth_off).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    }
}
