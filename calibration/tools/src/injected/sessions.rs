//! Clean sessions of known worlds. A session is a pure function of its sort and number.

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use rand::{RngExt, SeedableRng};
use rand_distr::StandardNormal;
use rand_pcg::Pcg64;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::frames::Pose;
use shared_mem::origin::Origin;
use shared_mem::recording::{Clip, JointSeries, ObjectSeries, Session};
use shared_mem::theta::Theta;
use std::f64::consts::PI;
use twin::rollout::{CellRollout, CellTrace, Course, ObjectState};
use twin::sim::SimError;
use worlds::session::{SessionError, record_paced};
use worlds::world::{Fault, Kind, World};

/// Sorts of sessions.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Sort {
    /// The arm alone.
    Motions,
    /// The same, every other clip at half the speed.
    Paces,
    /// The arm hits an object.
    Strokes,
    /// An object is tossed.
    Tosses,
    /// One of the twin's effects acts: a cause to be diagnosed, and no fault of the recording. Strokes by turns with motions.
    Causes,
}

/// A session without faults, in memory.
#[derive(Debug, Clone)]
pub struct Clean {
    /// What the laboratory knows.
    pub cell: Cell,
    /// Clips with their files.
    pub clips: Vec<(String, Clip)>,
}

/// A clean session cannot be made.
#[derive(Debug, thiserror::Error)]
pub enum CleanError {
    /// The world gives none.
    #[error(transparent)]
    World(#[from] SessionError),
    /// The object cannot be simulated.
    #[error(transparent)]
    Cell(#[from] SimError),
}

/// Clips in a session.
const CLIPS: usize = 3;
/// First stamp of a toss [ns], and poses a second: those of a fast tracker.
const START_NS: u64 = 1_000_000_000;
const TRACKER: f64 = 150.0;

impl Clean {
    /// Session `number` of a sort, in worlds around `cell`.
    ///
    /// # Errors
    /// [`CleanError`] when the cell has no arm or object that such a session needs.
    pub fn of(sort: Sort, number: u64, cell: &Cell) -> Result<Self, CleanError> {
        let strokes = number.is_multiple_of(2);
        let (kind, paces): (Kind, &[f64]) = match sort {
            Sort::Causes if strokes => (Kind::Strokes, &[1.0; CLIPS]),
            Sort::Causes => (Kind::Excitation, &[1.0; CLIPS]),
            Sort::Motions => (Kind::Excitation, &[1.0; CLIPS]),
            Sort::Paces => (Kind::Excitation, &[1.0, 0.5, 1.0, 0.5]),
            Sort::Strokes => (Kind::Strokes, &[1.0; CLIPS]),
            Sort::Tosses => return tossed(number, cell),
        };
        let fault = if sort == Sort::Causes { Fault::Single(number as usize / 2) } else { Fault::Nothing };
        let world = World::draw(number, kind, fault, cell);
        let clips = record_paced(&world, paces)?;
        let named = clips.into_iter().map(|clip| (clip.file.display().to_string(), clip)).collect();
        Ok(Self { cell: world.cell, clips: named })
    }

    /// A recorded session that is taken for clean; clips that cannot be read are left out.
    pub fn recorded(session: &Session) -> Self {
        let read =
            |entry: &shared_mem::cell::ClipEntry| Some((entry.file.display().to_string(), session.read(entry).ok()?));
        Self { cell: session.cell.clone(), clips: session.clips.iter().filter_map(read).collect() }
    }

    /// Whether there are poses of an object.
    pub fn has_poses(&self) -> bool {
        self.clips.iter().any(|(_, clip)| !clip.object.is_empty())
    }

    /// How many times as long as the shortest clip the longest is.
    pub fn paces(&self) -> f64 {
        let seconds = || self.clips.iter().map(|(_, clip)| clip.desired.duration());
        seconds().fold(0.0, f64::max) / seconds().fold(f64::INFINITY, f64::min).max(1e-3)
    }

    /// Whether there is an arm.
    pub fn has_arm(&self) -> bool {
        self.clips.iter().any(|(_, clip)| !clip.measured.is_empty())
    }
}

/// An object that is let go over its table, tumbles and slides to rest.
fn tossed(number: u64, cell: &Cell) -> Result<Clean, CleanError> {
    let mut rng = Pcg64::seed_from_u64(number.wrapping_mul(1000) + 900);
    let (mut cell, mut clips) = (cell.clone(), Vec::new());
    (cell.robot, cell.controller, cell.tool) = (None, None, None);
    for index in 0..2 * CLIPS {
        let poses_ns: Vec<u64> = (0..240).map(|i| START_NS + (f64::from(i) * 1e9 / TRACKER) as u64).collect();
        let mut between = |lo: f64, hi: f64| rng.random_range(lo..hi);
        let turn = UnitQuaternion::from_euler_angles(between(-0.5, 0.5), between(-0.5, 0.5), between(-PI, PI));
        let start = ObjectState {
            pose: Pose::from_isometry(Isometry3::from_parts(Translation3::new(0.4, 0.0, between(0.3, 0.45)), turn)),
            velocity: Vector3::new(between(-1.0, 1.0), between(-1.0, 1.0), between(0.0, 1.5)),
            angular_velocity: Vector3::new(between(-3.0, 3.0), between(-3.0, 3.0), between(-3.0, 3.0)),
        };
        let mut rollout = CellRollout::new(&cell, Some(&Theta::default()))?;
        rollout.start(START_NS, None, Some(&start), None);
        let mut trace = CellTrace::default();
        rollout.run(&Course { commands: None, joints_ns: &[], poses_ns: &poses_ns }, &mut trace);
        let noise = cell.object().and_then(|object| object.pose_noise);
        let sigma = noise.map_or([1e-3, 5e-3], |noise| [noise.position, noise.rotation]);
        let poses = trace.poses.iter().map(|pose| shaken(pose, sigma, &mut rng)).collect();
        let file = format!("toss_{index:02}.mcap");
        let clip = Clip {
            file: file.clone().into(),
            kind: ClipKind::FreeMotion,
            joint_names: Vec::new(),
            desired: JointSeries::default(),
            measured: JointSeries::default(),
            torques_end_at_rows: false,
            origins: Origin::Simulation.into(),
            object: ObjectSeries { stamps_ns: poses_ns, poses },
            others: Vec::new(),
            warnings: Vec::new(),
            damage: None,
        };
        clips.push((file, clip));
    }
    Ok(Clean { cell, clips })
}

fn shaken<A, B>(pose: &Pose<A, B>, [place, turn]: [f64; 2], rng: &mut Pcg64) -> Pose<A, B> {
    let mut draw = |sigma: f64| {
        Vector3::from_fn(|_, _| sigma * <StandardNormal as rand_distr::Distribution<f64>>::sample(&StandardNormal, rng))
    };
    let (shift, turned) = (draw(place), UnitQuaternion::from_scaled_axis(draw(turn)));
    let pose = pose.isometry();
    Pose::from_isometry(Isometry3::from_parts(
        Translation3::from(pose.translation.vector + shift),
        turned * pose.rotation,
    ))
}
