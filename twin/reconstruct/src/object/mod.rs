//! One object out of a scan.
//!
//! | file | owns |
//! |---|---|
//! | `pictures` | the views' pixels, and which of them say nothing |
//! | `extent`, `bounds` | the box that holds the object, and how it is found |
//! | `start` | visual hull, fused depth |
//! | `ground` | the table, and depth where none was measured |
//! | `hollow` | hollows that no silhouette shows, by colour |
//! | `simple` | nodes that may change sides: no wall is pierced |
//! | `stereo` | how far behind a surface the views agree best |
//! | `band` | the parts of the box that a surface may be in |
//! | `pool` | pixels as rays |
//! | `ray` | what a ray sees, and how it depends on the field |
//! | `smooth` | the field's own terms |
//! | `colours` | colours beside the surface |
//! | `adam` | steps along derivatives |
//! | `learn` | the optimisation, coarse to fine |
//! | `table` | where the table is, and that nothing lies below it |
//! | `view` | whole pictures of the field |
//! | `appearance` | splats on the surface, trained on the views |
//! | `neighbours` | which corners of a surface are beside each other |
//! | `corners` | which views show the corners of a surface, and in which colour |
//! | `evidence` | what views show of the surface, and whether they say where it is |
//! | `walls` | walls that are thin for the grid |
//! | `judge` | held-out views, and what a person should know |
//! | `state` | what there is when the work is interrupted |

mod adam;
mod appearance;
mod band;
mod bounds;
mod colours;
mod corners;
mod evidence;
mod extent;
mod ground;
mod hollow;
mod judge;
mod learn;
mod neighbours;
mod pictures;
mod pool;
mod ray;
mod simple;
mod smooth;
mod start;
mod state;
mod stereo;
mod table;
mod view;
mod walls;

pub use evidence::Certainty;
pub use judge::HeldOut;
pub use state::StateError;
pub use table::{Support, TableSource};
pub use view::{Drawn, draw};

use crate::closing;
use crate::computed::{Computed, DEPTH, stages};
use crate::field::{Field, Grid};
use crate::mesh::{self, Flaw, Islands, Mesh, Solid, Topology};
use crate::remark::Remark;
use crate::scan::{Frame, Scale, ScaleSource, Scan, ScanError, Table};
use evidence::Evidence;
use ground::Ground;
use judge::Found;
use learn::{Learner, Plan, State};
use nalgebra::{Isometry3, Point3};
use pictures::Pictures;
use shared_mem::ending;
use shared_mem::progress::{Planned, Progress};
use splat::{SplatCloud, TrainError};
use start::Seen;
use state::Keeper;
use std::path::Path;

/// Triangles of the fine mesh and of the coarse one.
pub const FINE: usize = 20_000;
/// Triangles of the coarse mesh.
pub const COARSE: usize = 700;

/// Stages of the work with how long each takes of 60 views on two cores [s].
const STAGES: [Planned; 7] =
    [(READ, 6.0), (DEPTH, 100.0), (START, 12.0), (LEARN, 110.0), (MESH, 8.0), (SPLATS, 120.0), (JUDGE, 15.0)];
const READ: &str = "read";
const START: &str = "start";
const LEARN: &str = "optimise";
const MESH: &str = "mesh";
const SPLATS: &str = "splats";
const JUDGE: &str = "judge";

/// No object came of a scan.
#[derive(Debug, thiserror::Error)]
pub enum ObjectError {
    /// The scan cannot be used.
    #[error(transparent)]
    Scan(#[from] ScanError),
    /// What was kept of an interrupted run cannot be read or written.
    #[error(transparent)]
    State(#[from] StateError),
    /// Nothing is left inside.
    #[error(
        "nothing is left of the object: masks, depth and poses contradict each other; look at the scan's poses and scale"
    )]
    Nothing,
    /// The mesh is no surface of a body.
    #[error("{0}; please report this with the scan: by construction it cannot be")]
    Flaw(#[from] Flaw),
    /// Depth pictures and poses have different units.
    #[error("depth pictures say that one unit of the poses is {metres:.4} m, not 1 m: give --scale {metres:.4}")]
    Scale {
        /// Metres for one unit, as depth has it.
        metres: f64,
    },
    /// The splats cannot be trained.
    #[error(transparent)]
    Splats(#[from] TrainError),
    /// Ctrl-C: how much is done [%], of what.
    #[error("interrupted; the same command goes on from {0:.0} % of the {1}")]
    Interrupted(f64, &'static str),
}

/// An object as its scan shows it.
#[derive(Debug, Clone)]
pub struct Object {
    /// Signed distance and colour in the scan's frame.
    pub field: Field<f32>,
    /// The surface of at most [`FINE`] triangles, in the scan's frame [m].
    pub fine: Mesh,
    /// That of at most [`COARSE`] triangles.
    pub coarse: Mesh,
    /// Splats that show it, in the scan's frame [m].
    pub splats: SplatCloud,
    /// What kind of surface it is.
    pub topology: Topology,
    /// Its volume and inertia.
    pub solid: Solid,
    /// How many views show each corner of the fine mesh.
    pub shown: Vec<u8>,
    /// Whether these views say where it is.
    pub certainty: Vec<Certainty>,
    /// The table at which the base is closed, a guess, where something says where that is.
    pub support: Option<Support>,
    /// What was left out beside it.
    pub islands: Islands,
    /// Where its scale comes from.
    pub scale: Scale,
    /// How the held-out views look.
    pub held_out: Vec<HeldOut>,
    /// Views that it was made from, from where their cameras stand by now.
    pub train: Vec<Frame>,
    /// Whether they had depth.
    pub with_depth: bool,
    /// What was computed where they had none.
    pub computed: Option<Computed>,
    /// Middle shift of the cameras, root mean square [m].
    pub moved: f64,
    /// What a person should know.
    pub remarks: Vec<Remark>,
}

/// What a person may choose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Metres for one unit of the poses; `None`: as depth or the robot says.
    pub scale: Option<f64>,
    /// The grid has about as many nodes as a cube with so many along each edge.
    pub edge: u32,
    /// The plane on which the object stands, in the frame and the unit of the poses; `None`: as the scan or its pictures say.
    pub table: Option<Table>,
}

/// Makes an object of a scan; what is done is kept in the file `kept` now and then, and a run that finds it goes on from there.
///
/// # Errors
/// [`ObjectError`] in one line.
pub fn reconstruct(scan: Scan, options: &Options, kept: &Path) -> Result<Object, ObjectError> {
    let bar = Progress::planned("reconstruct", &stages(&STAGES, &scan), scan.views.len() as u64);
    let scale = scan.scale(options.scale)?;
    let scan = scan.scaled(scale.metres);
    let mut pictures = pictures::read(&scan, |done| bar.show(done, READ))?;
    let mut bounds = bounds::find(&pictures.train)?;
    pictures.remarks.extend(bounds.remark(pictures.train.len()));
    let given = options.table.map(|table| table.scaled(scale.metres));
    let Ground { support, computed } = Ground::find((&bar, &scan), given, &mut pictures, &mut bounds)?;
    let plan = Plan::new(options.edge, pictures.depth_spread.is_some());
    bar.stage(START, 2);
    let seen = Seen::all(&pictures.train, None);
    let grid = Grid::filling(&bounds.low, &bounds.high, plan.levels[0].nodes, 2);
    let distance = start::distance(&grid, &seen, &bounds, pictures.depth_spread);
    let metres = judge::depth_scale(&grid, &start::distance(&grid, &seen, &bounds, None), &pictures.train);
    if let (ScaleSource::Poses, Some(metres)) = (scale.source, metres.filter(|m| (m - 1.0).abs() > 0.03)) {
        return Err(ObjectError::Scale { metres });
    }
    let pixels = pool::pixels(&pictures.train);
    let mut keeper = Keeper::new(kept, options.edge, &bounds, (&pictures, &pixels));
    let fresh = || State::new(grid, begun(&grid, distance, &pictures), pictures.train.len());
    let mut state = keeper.take()?.unwrap_or_else(fresh);
    if state.level < plan.levels.len() {
        keeper.forget_splats()?;
    }
    interrupted(&plan, &state)?;
    let train = (pictures.train.as_slice(), pictures.depth_spread);
    let learner = Learner::new(plan.clone(), train, &pixels, &bounds);
    let poses = learn(&bar, &plan, learner, &mut state, &mut keeper)?;
    if let Some(support) = &support {
        table::cut(&mut state.field, &support.table);
    }
    bar.stage(MESH, 3);
    let gap = if scan.has_depth() { closing::PINHOLE } else { closing::TUNNEL };
    let shape = Shape::of(&closing::closed(&state.field, gap), &bar)?;
    interrupted(&plan, &state)?;
    let trained = (pictures.train.as_slice(), poses.as_slice());
    let steps = appearance::steps(options.edge);
    let splats = appearance::trained(&bar, (&state.field, &shape.fine), trained, steps, keeper.splats())?;
    bar.stage(JUDGE, 1 + pictures.held_out.len() as u64);
    let evidence = Evidence::of(&state.field, &shape.fine, (&pictures.train, &poses), scan.has_depth());
    let mut held_out = Vec::new();
    for frame in &pictures.held_out {
        bar.show(1 + held_out.len() as u64, JUDGE);
        interrupted(&plan, &state)?;
        held_out.push(judge::held_out(&state.field, &splats, frame, &bounds));
    }
    let mut remarks = pictures.remarks;
    remarks.extend(judge::remarks(&Found {
        evidence: &evidence,
        field: &state.field,
        mesh: &shape.fine,
        islands: &shape.islands,
        genus: shape.topology.genus,
        edge: options.edge,
        support: support.as_ref(),
        frames: [&pictures.train, &pictures.held_out],
        held_out: &held_out,
        computed: computed.as_ref(),
    }));
    let moved = moved(&state.corrections);
    let Shape { fine, coarse, topology, solid, islands } = shape;
    Ok(Object {
        field: state.field,
        fine,
        coarse,
        splats,
        topology,
        solid,
        shown: evidence.views,
        certainty: evidence.certainty,
        support,
        islands,
        scale,
        held_out,
        train: moved_to(pictures.train, poses),
        with_depth: scan.has_depth(),
        computed,
        moved,
        remarks,
    })
}

/// Middle shift of cameras, root mean square [m].
fn moved(corrections: &[[f64; 6]]) -> f64 {
    let shifts = corrections.iter().map(|c| c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    (shifts.sum::<f64>() / corrections.len() as f64).sqrt()
}

/// Views from where their cameras stand by now.
fn moved_to(frames: Vec<Frame>, poses: Vec<Isometry3<f64>>) -> Vec<Frame> {
    frames.into_iter().zip(poses).map(|(frame, pose)| Frame { scan_from_camera: pose, ..frame }).collect()
}

/// The distance that the optimisation begins with: without depth, that of the hull without its hollows.
fn begun(grid: &Grid, distance: Vec<f32>, pictures: &Pictures) -> Vec<f32> {
    if pictures.depth_spread.is_some() {
        return distance;
    }
    let poses: Vec<Isometry3<f64>> = pictures.train.iter().map(|frame| frame.scan_from_camera).collect();
    hollow::opened(grid, distance, (&pictures.train, &poses), hollow::Search::FROM_HULL)
}

/// The surface of a field without narrow gaps, and what follows from it.
struct Shape {
    fine: Mesh,
    coarse: Mesh,
    topology: Topology,
    solid: Solid,
    islands: Islands,
}

impl Shape {
    fn of(field: &Field<f32>, bar: &Progress) -> Result<Self, ObjectError> {
        let (surface, islands) = mesh::surface(field).ok_or(ObjectError::Nothing)?;
        Topology::of(&surface)?;
        let fine = mesh::reduced(&surface, FINE);
        let topology = Topology::of(&fine)?;
        bar.show(2, MESH);
        let coarse = mesh::reduced(&fine, COARSE);
        Topology::of(&coarse)?;
        let solid = Solid::of(&fine);
        Ok(Self { fine, coarse, topology, solid, islands })
    }
}

/// All steps; the cameras' poses at the end.
fn learn(
    bar: &Progress,
    plan: &Plan,
    mut learner: Learner<'_>,
    state: &mut State,
    keeper: &mut Keeper<'_>,
) -> Result<Vec<Isometry3<f64>>, ObjectError> {
    bar.stage(LEARN, plan.steps());
    let was_done = state.level == plan.levels.len();
    while state.level < plan.levels.len() {
        learner.step(state);
        bar.show(plan.steps() - plan.steps_left(state.level, state.step), LEARN);
        if ending::asked() {
            // At the beginning of a level its hollows may be opened in part: it is begun anew from what was kept before.
            if state.step > 0 || state.level == plan.levels.len() {
                keeper.keep(state)?;
            }
            interrupted(plan, state)?;
        }
        keeper.keep_now_and_then(state)?;
    }
    if !was_done {
        keeper.keep(state)?;
    }
    Ok((0..state.corrections.len()).map(|frame| learner.pose(state, frame)).collect())
}

/// An error once the end was asked for.
fn interrupted(plan: &Plan, state: &State) -> Result<(), ObjectError> {
    let done = 1.0 - plan.steps_left(state.level, state.step) as f64 / plan.steps() as f64;
    if ending::asked() { Err(ObjectError::Interrupted(done * 100.0, "optimisation")) } else { Ok(()) }
}

/// Removes what was kept, once the outputs are there.
///
/// # Errors
/// [`StateError`] when the file cannot be removed.
pub fn forget(kept: &Path) -> Result<(), StateError> {
    state::forget(kept)
}

impl Object {
    /// Middle of the fine mesh's box: where the object's own frame has its origin, in the scan's frame [m].
    pub fn middle(&self) -> Point3<f64> {
        self.fine.middle()
    }

    /// Which share of the fine mesh's surface is so [1].
    pub fn share(&self, is: Certainty) -> f64 {
        evidence::share(&self.fine, |corner| self.certainty[corner] == is)
    }

    /// Mean PSNR of the held-out views inside the mask [dB].
    pub fn psnr(&self) -> f64 {
        self.held_out.iter().map(|view| view.psnr).sum::<f64>() / self.held_out.len().max(1) as f64
    }

    /// The same of the splats [dB].
    pub fn psnr_splats(&self) -> f64 {
        self.held_out.iter().map(|view| view.psnr_splats).sum::<f64>() / self.held_out.len().max(1) as f64
    }
}
