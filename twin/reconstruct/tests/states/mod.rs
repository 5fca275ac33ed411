//! Objects of known parts and joints in random states, as scans show them: laptop, drawer, box with a lid.

use nalgebra::{Isometry3, Point3, Translation3, Unit, UnitQuaternion, Vector3};
use rand::{Rng, RngExt as _, SeedableRng as _};
use rand_distr::{Distribution as _, StandardNormal};
use reconstruct::articulated::Joint;
use reconstruct::field::{Field, Grid};
use reconstruct::mesh::{Mesh, distances, surface};

/// Gaps narrower than twice this look closed in a scan [m].
const CLOSED: f64 = 2.5e-3;

/// A box by its low and high corner [m].
type Cuboid = [[f64; 3]; 2];

/// A state of an object as a scan shows it.
pub(crate) struct State {
    /// How far its joint is [rad or m].
    pub(crate) travel: f64,
    /// The scan's frame from the object's.
    pub(crate) frame: Isometry3<f64>,
    pub(crate) mesh: Mesh,
}

pub(crate) struct Kind {
    pub(crate) name: &'static str,
    base: Vec<Cuboid>,
    part: Vec<Cuboid>,
    pub(crate) joint: Joint,
    /// The first state is drawn from the first range, how far the part moves from the second [rad or m].
    ranges: [[f64; 2]; 2],
}

/// Five walls of a box that is open at the side `open` (axis, whether at its high end), with walls of the thickness `wall`.
fn walls([low, high]: Cuboid, wall: f64, open: (usize, bool)) -> Vec<Cuboid> {
    let mut walls = Vec::new();
    for axis in 0..3 {
        for is_high in [false, true] {
            if (axis, is_high) == open {
                continue;
            }
            let (mut from, mut to) = (low, high);
            if is_high {
                from[axis] = high[axis] - wall;
            } else {
                to[axis] = low[axis] + wall;
            }
            walls.push([from, to]);
        }
    }
    walls
}

pub(crate) fn kinds() -> [Kind; 3] {
    let laptop = Kind {
        name: "laptop",
        base: vec![[[0.0, -0.155, 0.0], [0.22, 0.155, 0.016]]],
        part: vec![[[0.004, -0.152, 0.0165], [0.219, 0.152, 0.0235]]],
        joint: Joint::Revolute { point: Point3::new(0.0, 0.0, 0.0165), axis: -Vector3::y_axis(), angle: 1.0 },
        ranges: [[0.0, 0.6], [0.35, 1.4]],
    };
    let mut drawer = walls([[0.004, -0.116, 0.014], [0.235, 0.116, 0.142]], 0.006, (2, true));
    drawer.push([[-0.012, -0.126, 0.005], [-0.001, 0.126, 0.15]]);
    drawer.push([[-0.035, -0.05, 0.076], [-0.012, 0.05, 0.09]]);
    let drawer = Kind {
        name: "drawer",
        base: walls([[0.0, -0.13, 0.0], [0.26, 0.13, 0.22]], 0.012, (0, false))
            .into_iter()
            .chain([[[0.0, -0.13, 0.145], [0.26, 0.13, 0.157]], [[0.0, -0.13, 0.157], [0.012, 0.13, 0.22]]])
            .collect(),
        part: drawer,
        joint: Joint::Prismatic { travel: -Vector3::x() },
        ranges: [[0.0, 0.05], [0.04, 0.13]],
    };
    let chest = Kind {
        name: "lid",
        base: walls([[0.0, -0.1, 0.0], [0.15, 0.1, 0.1]], 0.006, (2, true)),
        part: vec![[[-0.003, -0.103, 0.101], [0.156, 0.103, 0.109]], [[0.156, -0.03, 0.095], [0.162, 0.03, 0.109]]],
        joint: Joint::Revolute { point: Point3::new(0.0, 0.0, 0.101), axis: -Vector3::y_axis(), angle: 1.0 },
        ranges: [[0.0, 0.4], [0.35, 1.6]],
    };
    [laptop, drawer, chest]
}

fn outside(cuboids: &[Cuboid], point: &Point3<f64>) -> f64 {
    let one = |[low, high]: &Cuboid| {
        let away: Vector3<f64> = Vector3::from_fn(|a, _| (low[a] - point[a]).max(point[a] - high[a]));
        away.map(|v| v.max(0.0)).norm() + away.max().min(0.0)
    };
    cuboids.iter().map(one).fold(f64::INFINITY, f64::min)
}

/// The same joint, moved so far.
fn moved(joint: &Joint, by: f64) -> Joint {
    match *joint {
        Joint::Revolute { point, axis, .. } => Joint::Revolute { point, axis, angle: by },
        Joint::Prismatic { travel } => Joint::Prismatic { travel: travel.normalize() * by },
    }
}

impl Kind {
    /// How far a place of the object's frame is outside of the base and of the part.
    fn outside(&self, travel: f64, point: &Point3<f64>) -> [f64; 2] {
        [outside(&self.base, point), outside(&self.part, &(moved(&self.joint, travel).motion().inverse() * point))]
    }

    /// The same of a place of a state's frame.
    pub(crate) fn distances(&self, state: &State, point: &Point3<f64>) -> [f64; 2] {
        self.outside(state.travel, &(state.frame.inverse() * point))
    }

    /// Whether a place of a state's frame is nearer to the part than to the base.
    pub(crate) fn is_part(&self, state: &State, point: &Point3<f64>) -> bool {
        let [base, part] = self.distances(state, point);
        part < base
    }

    /// The surface that a scan shows of a state: narrow gaps closed, hollows filled, corners displaced by noise [m].
    fn scanned(&self, travel: f64, voxel: f64, frame: &Isometry3<f64>, noise: f64, random: &mut impl Rng) -> Mesh {
        let motion = moved(&self.joint, travel).motion();
        let corners = |cuboids: &[Cuboid], pose: Isometry3<f64>| -> Vec<Point3<f64>> {
            let all =
                cuboids.iter().flat_map(|c| (0..8).map(|i| Point3::from(Vector3::from_fn(|a, _| c[i >> a & 1][a]))));
            all.map(|p| pose * p).collect()
        };
        let points = [corners(&self.base, *frame), corners(&self.part, frame * motion)].concat();
        let (low, high) = Mesh { points, triangles: Vec::new() }.bounds();
        let size = (high - low) / voxel + Vector3::repeat(8.0);
        let grid =
            Grid { dims: [0, 1, 2].map(|a| size[a] as usize), origin: low - Vector3::repeat(4.0 * voxel), voxel };
        let back = frame.inverse();
        let open = CLOSED / voxel;
        let level = (0..grid.len()).map(|i| {
            let [base, part] = self.outside(travel, &(back * grid.position(grid.node(i))));
            (base.min(part) / voxel - open) as f32
        });
        let (grown, _) = surface(&Field { grid, distance: level.collect(), colour: Vec::new() }).expect("an object");
        let mut shrunk = distances(&grown, grid.len() as f64, 4);
        let open = CLOSED / shrunk.grid.voxel;
        shrunk.distance.iter_mut().for_each(|d| *d += open as f32);
        let (mut mesh, _) = surface(&shrunk).expect("an object");
        for point in &mut mesh.points {
            *point += Vector3::from_fn(|_, _| StandardNormal.sample(random)) * noise;
        }
        mesh
    }

    /// The joint in the frame of a state, moved so far.
    pub(crate) fn joint_in(&self, state: &State, by: f64) -> Joint {
        moved(&self.joint, by).seen_from(&state.frame)
    }

    /// Two states, drawn by lot, in frames of their own.
    pub(crate) fn states(&self, seed: u64) -> [State; 2] {
        let mut random = rand_pcg::Pcg64::seed_from_u64(seed);
        let [first, more] = self.ranges;
        let closed = random.random_range(first[0]..first[1]);
        let opened = closed + random.random_range(more[0]..more[1]);
        let noise = random.random_range(0.5e-3..1e-3);
        [(closed, 3.1e-3), (opened, 3.7e-3)].map(|(travel, voxel)| {
            let axis: Vector3<f64> = Vector3::from_fn(|_, _| StandardNormal.sample(&mut random));
            let turn = UnitQuaternion::from_axis_angle(&Unit::new_normalize(axis), random.random_range(0.0..3.1));
            let frame = Isometry3::from_parts(Translation3::new(random.random_range(-0.3..0.3), 0.1, 0.2), turn);
            let mesh = self.scanned(travel, voxel, &frame, noise, &mut random);
            State { travel, frame, mesh }
        })
    }
}
