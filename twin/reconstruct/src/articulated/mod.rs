//! An object with a part that moves, out of two states of it, or out of one with marks of a person: the motion of the part as a hinge or
//! a slide, and both parts as closed meshes.
//!
//! | file | owns |
//! |---|---|
//! | `body` | one state: points of its surface, distances around it |
//! | `motion` | hinges and slides, and what of a motion may change |
//! | `search` | poses without a start |
//! | `fit` | surfaces laid onto each other |
//! | `estimate` | the joint that explains both states best |
//! | `label` | which part of the surface moves |
//! | `marks` | marks in pictures, out of a file |
//! | `marked` | joint and part as marked in pictures |
//! | `split` | two closed meshes out of one |

mod body;
mod estimate;
mod fit;
mod label;
mod marked;
mod marks;
mod motion;
mod search;
mod split;

pub use marked::{MarkedView, marked};
pub use marks::Marks;
pub use motion::Joint;

use crate::field::Field;
use crate::mesh::{self, Flaw, Mesh, Topology};
use crate::object::{COARSE, FINE};
use body::Body;
use estimate::{Estimate, estimate};
use fit::Pair;
use motion::Motion;
use nalgebra::{Isometry3, Point3, Vector3};
use shared_mem::ending;
use shared_mem::progress::{Planned, Progress};

const READ: &str = "distances";
const SEARCH: &str = "joint";
const SPLIT: &str = "parts";
/// Stages of the work with how long each takes on two cores [s].
const STAGES: [Planned; 3] = [(READ, 2.0), (SEARCH, 12.0), (SPLIT, 6.0)];
/// The part has moved if some of it has by so many tolerances.
const MOVED: f64 = 1.5;
/// Least share of the surfaces that a part has.
const PART: f64 = 0.01;
/// Most of both surfaces that no motion explains.
const UNEXPLAINED: f64 = 0.15;

/// Nothing articulated came of two states.
#[derive(Debug, thiserror::Error)]
pub enum ArticulatedError {
    /// No part moves.
    #[error(
        "no part moves by more than {:.1} mm between the two states, which is their noise; move it further and scan again",
        noise * 1e3
    )]
    Still {
        /// What is noise [m].
        noise: f64,
    },
    /// Too much is left over.
    #[error(
        "{:.0} % of both surfaces fit neither a base that stays nor one part that moves; give two scans of one object of the same \
         scale, in which one part has moved",
        share * 100.0
    )]
    Unexplained {
        /// Share of both surfaces.
        share: f64,
    },
    /// The marks show nothing.
    #[error("{0}")]
    Marks(String),
    /// The mesh is no surface of a body.
    #[error("{0}; a mesh of `twin reconstruct object` is closed")]
    Flaw(#[from] Flaw),
    /// Nothing is left of a part.
    #[error("nothing is left of one of the two parts; move it further and scan again")]
    Nothing,
    #[error("interrupted")]
    Interrupted,
}

/// How sure a joint is that was found from two states.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Certainty {
    /// How much worse a joint of the other kind explains the states: the difference of BIC.
    pub evidence: f64,
    /// Standard deviation of the axis' direction [rad].
    pub direction: f64,
    /// Standard deviation of the hinge's place, across its axis [m].
    pub place: f64,
    /// Standard deviation of the travel [rad or m].
    pub travel: f64,
    /// Noise of both surfaces together, standard deviation [m].
    pub noise: f64,
    /// Share of both surfaces that neither stays nor moves along.
    pub unexplained: f64,
}

/// A mesh, and for each triangle whether it belongs to the part that moves.
#[derive(Debug, Clone)]
pub struct State {
    /// The mesh, in the frame of the second state [m].
    pub mesh: Mesh,
    /// Of each triangle.
    pub moves: Vec<bool>,
}

/// A closed part.
#[derive(Debug, Clone)]
pub struct Part {
    /// At most [`FINE`] triangles, in the frame of the second state and as it is there [m].
    pub fine: Mesh,
    /// At most [`COARSE`] triangles.
    pub coarse: Mesh,
    /// What kind of surface it is.
    pub topology: Topology,
}

/// An object with one part that moves.
#[derive(Debug, Clone)]
pub struct Articulated {
    /// The joint in the frame of the meshes, which is that of the second state; it moves the part from the first state to the second.
    pub joint: Joint,
    /// Least and largest position [rad or m]: 0 is the first state, the travel the second one.
    pub limits: [f64; 2],
    /// Where the joint is in the meshes [rad or m].
    pub position: f64,
    /// How sure it is; `None` where a person gave it.
    pub certainty: Option<Certainty>,
    pub base: Part,
    pub part: Part,
    /// The states, the first one with its base where the second one's is.
    pub states: Vec<State>,
    /// Negative nearer to the part that moves [voxel].
    border: Field<f32>,
}

/// A joint and where it is.
struct Moves {
    joint: Joint,
    limits: [f64; 2],
    position: f64,
    certainty: Option<Certainty>,
}

/// The part that moves between two states, each a closed mesh in a frame of its own [m].
///
/// # Errors
/// [`ArticulatedError`] in one line.
pub fn between(first: Mesh, second: Mesh) -> Result<Articulated, ArticulatedError> {
    let bar = Progress::planned("articulated", &STAGES, 2);
    Topology::of(&first)?;
    Topology::of(&second)?;
    let (mut first, mut second) = rayon::join(|| Body::of(first), || Body::of(second));
    go_on()?;
    let pair = Pair { first: &first, second: &second };
    bar.stage(SEARCH, 7);
    let found = estimate(&pair, &bar)?;
    checked(&pair, &found)?;
    bar.stage(SPLIT, 4);
    let [whole, part] = found.motion.poses();
    let within = found.tolerance;
    let slide = found.motion.slide();
    let borders = |known: [Option<&Field<f32>>; 2]| {
        let of = |(body, slide): (&Body, Option<Vector3<f64>>), other: (&Body, Option<&Field<f32>>), poses: [_; 2]| {
            let seen = |place: &_, normal: &_| label::seen_in(other, &poses, (within, slide.as_ref()), (place, normal));
            label::border(body, slide, seen)
        };
        rayon::join(
            || of((&first, slide), (&second, known[1]), [whole, part]),
            || of((&second, slide.map(|way| whole * way)), (&first, known[0]), [whole.inverse(), part.inverse()]),
        )
    };
    let (before, after) = borders([None; 2]);
    go_on()?;
    let (before, border) = borders([Some(&before), Some(&after)]);
    go_on()?;
    bar.show(1, SPLIT);
    for (body, border) in [(&mut first, &before), (&mut second, &border)] {
        body.samples.iter_mut().for_each(|sample| sample.moves = Some(is_beyond(border, &sample.point)));
    }
    let found = found.again(&Pair { first: &first, second: &second });
    let Motion::Jointed(whole, joint) = found.motion else { return Err(ArticulatedError::Nothing) };
    let states =
        vec![State::of(&first.mesh, &before, &whole), State::of(&second.mesh, &border, &Isometry3::identity())];
    let certainty = Certainty {
        evidence: found.evidence,
        direction: found.deviations[0],
        place: found.deviations[1],
        travel: found.deviations[2],
        noise: found.sigma,
        unexplained: found.unexplained,
    };
    let joint = joint.seen_from(&whole);
    let travel = joint.travel();
    let moves = Moves { joint, limits: [0.0, travel], position: travel, certainty: Some(certainty) };
    Articulated::of(&second, border, moves, states, &bar)
}

/// Ends the work where that was asked for.
fn go_on() -> Result<(), ArticulatedError> {
    if ending::asked() { Err(ArticulatedError::Interrupted) } else { Ok(()) }
}

/// Refuses what is no single part that moves.
fn checked(pair: &Pair<'_>, found: &Estimate) -> Result<(), ArticulatedError> {
    let [whole, part] = found.motion.poses();
    if found.unexplained > UNEXPLAINED {
        return Err(ArticulatedError::Unexplained { share: found.unexplained });
    }
    let noise = MOVED * found.tolerance;
    if found.share < PART || search::apart(pair.first, &whole, &part) < noise {
        return Err(ArticulatedError::Still { noise });
    }
    Ok(())
}

impl State {
    fn of(mesh: &Mesh, border: &Field<f32>, pose: &Isometry3<f64>) -> Self {
        let moves = (0..mesh.triangles.len()).map(|number| {
            let [a, b, c] = mesh.corners(number);
            is_beyond(border, &Point3::from((a.coords + b.coords + c.coords) / 3.0))
        });
        let moves = moves.collect();
        let points = mesh.points.iter().map(|point| pose * point).collect();
        Self { mesh: Mesh { points, triangles: mesh.triangles.clone() }, moves }
    }
}

impl Part {
    fn of(surface: &Mesh) -> Result<Self, ArticulatedError> {
        let fine = mesh::reduced(surface, FINE);
        let coarse = mesh::reduced(&fine, COARSE);
        Topology::of(&coarse)?;
        Ok(Self { topology: Topology::of(&fine)?, fine, coarse })
    }
}

fn is_beyond(border: &Field<f32>, place: &Point3<f64>) -> bool {
    let grid = &border.grid;
    // Of places outside of the grid the nearest one within it.
    let last = grid.position(grid.dims.map(|n| n - 1));
    let inside = |axis: usize| place[axis].clamp(grid.origin[axis], last[axis] - 1e-3 * grid.voxel);
    border.distance_at(&Point3::new(inside(0), inside(1), inside(2))).is_some_and(|d| d < 0.0)
}

impl Articulated {
    fn of(
        body: &Body,
        border: Field<f32>,
        moves: Moves,
        states: Vec<State>,
        bar: &Progress,
    ) -> Result<Self, ArticulatedError> {
        let [base, part] = split::split(body, &border).ok_or(ArticulatedError::Nothing)?;
        bar.show(2, SPLIT);
        go_on()?;
        let (base, part) = rayon::join(|| Part::of(&base), || Part::of(&part));
        let (base, part) = (base?, part?);
        let (low, high) = part.fine.bounds();
        let Moves { joint, limits, position, certainty } = moves;
        let joint = joint.near(&nalgebra::center(&low, &high));
        Ok(Self { joint, limits, position, certainty, base, part, states, border })
    }

    /// Whether a place of the second state, on or beside its surface, belongs to the part that moves.
    pub fn moves(&self, place: &Point3<f64>) -> bool {
        is_beyond(&self.border, place)
    }
}
