//! Fewer triangles: edges are drawn together where that moves the surface least, by the quadrics of Garland and Heckbert (1997). An edge
//! is left alone where the surface would not stay a closed manifold (its ends must have two neighbours in common) or a triangle would
//! turn over, so that genus and closedness stay as they were. Where a surface has a rim, planes across it hold the rim in place.

use super::Mesh;
use nalgebra::{Matrix3, Point3, Vector3};
use shared_mem::ending;
use std::cmp::Ordering;
use std::collections::{BinaryHeap, HashMap};

/// A triangle may turn by so much (cosine).
const TURN: f64 = 0.2;
/// Pull towards the middle of the edge where the quadric leaves the place open, of its trace.
const PULL: f64 = 1e-3;

/// Sum of squared distances from planes: x A x + 2 b x + c.
#[derive(Debug, Clone, Copy, Default)]
struct Quadric {
    a: Matrix3<f64>,
    b: Vector3<f64>,
    c: f64,
}

impl Quadric {
    fn of(corners: [Point3<f64>; 3]) -> Self {
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let area = normal.norm();
        Self::of_plane(normal, &corners[0], area)
    }

    fn of_plane(normal: Vector3<f64>, point: &Point3<f64>, weight: f64) -> Self {
        let Some(unit) = normal.try_normalize(1e-30) else { return Self::default() };
        let offset = -unit.dot(&point.coords);
        Self { a: unit * unit.transpose() * weight, b: unit * (offset * weight), c: offset * offset * weight }
    }

    fn plus(&self, other: &Self) -> Self {
        Self { a: self.a + other.a, b: self.b + other.b, c: self.c + other.c }
    }

    fn at(&self, point: &Point3<f64>) -> f64 {
        let x = &point.coords;
        (x.dot(&(self.a * x)) + 2.0 * self.b.dot(x) + self.c).max(0.0)
    }

    /// The place of least error, near to `middle` where it is open.
    fn best(&self, middle: &Point3<f64>) -> Point3<f64> {
        let pull = PULL * self.a.trace().max(1e-30);
        let matrix = self.a + Matrix3::from_diagonal_element(pull);
        let right = middle.coords * pull - self.b;
        matrix.cholesky().map_or(*middle, |solved| Point3::from(solved.solve(&right)))
    }
}

/// An edge that may be drawn together.
#[derive(Debug, Clone, Copy)]
struct Edge {
    error: f64,
    ends: [u32; 2],
    /// Changes of the ends' surroundings when it was looked at.
    stamps: [u32; 2],
    place: Point3<f64>,
}

impl PartialEq for Edge {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Edge {}

impl PartialOrd for Edge {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Edge {
    fn cmp(&self, other: &Self) -> Ordering {
        other.error.total_cmp(&self.error).then_with(|| other.ends.cmp(&self.ends))
    }
}

struct Work {
    points: Vec<Point3<f64>>,
    triangles: Vec<Option<[u32; 3]>>,
    around: Vec<Vec<u32>>,
    quadrics: Vec<Quadric>,
    stamps: Vec<u32>,
    /// Corners at which the surface ends.
    is_rim: Vec<bool>,
}

/// A mesh with at most so many triangles, or as near to that as it stays a surface: closed where it was closed. Ends early, with more
/// triangles, once the end was asked for.
pub fn reduced(mesh: &Mesh, triangles: usize) -> Mesh {
    let mut work = Work::new(mesh);
    let mut left = mesh.triangles.len();
    let mut heap: BinaryHeap<Edge> = BinaryHeap::new();
    for triangle in &mesh.triangles {
        for i in 0..3 {
            let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
            if a < b || work.shared([a, b]) == 1 {
                heap.push(work.edge([a.min(b), a.max(b)]));
            }
        }
    }
    while left > triangles.max(4) && !ending::asked() {
        let Some(edge) = heap.pop() else { break };
        let [a, b] = edge.ends.map(|end| end as usize);
        if [work.stamps[a], work.stamps[b]] != edge.stamps || !work.may_join(&edge) {
            continue;
        }
        left -= work.shared(edge.ends);
        work.join(&edge);
        for neighbour in work.neighbours(edge.ends[0]) {
            heap.push(work.edge([edge.ends[0].min(neighbour), edge.ends[0].max(neighbour)]));
        }
    }
    let kept: Vec<[u32; 3]> = work.triangles.into_iter().flatten().collect();
    Mesh { points: work.points, triangles: Vec::new() }.compact(kept)
}

impl Work {
    fn new(mesh: &Mesh) -> Self {
        let count = mesh.points.len();
        let (mut around, mut quadrics) = (vec![Vec::new(); count], vec![Quadric::default(); count]);
        for (number, triangle) in mesh.triangles.iter().enumerate() {
            let quadric = Quadric::of(mesh.corners(number));
            for corner in triangle {
                around[*corner as usize].push(number as u32);
                quadrics[*corner as usize] = quadrics[*corner as usize].plus(&quadric);
            }
        }
        let mut is_rim = vec![false; count];
        for ([a, b], number) in rim(mesh) {
            let [p, q, r] = mesh.corners(number);
            let (from, to) = (mesh.points[a as usize], mesh.points[b as usize]);
            let across = (q - p).cross(&(r - p)).cross(&(to - from));
            let quadric = Quadric::of_plane(across, &from, (to - from).norm_squared());
            for corner in [a as usize, b as usize] {
                is_rim[corner] = true;
                quadrics[corner] = quadrics[corner].plus(&quadric);
            }
        }
        let triangles = mesh.triangles.iter().copied().map(Some).collect();
        Self { points: mesh.points.clone(), triangles, around, quadrics, stamps: vec![0; count], is_rim }
    }

    fn edge(&self, ends: [u32; 2]) -> Edge {
        let [a, b] = ends.map(|end| end as usize);
        let quadric = self.quadrics[a].plus(&self.quadrics[b]);
        let place = quadric.best(&nalgebra::center(&self.points[a], &self.points[b]));
        Edge { error: quadric.at(&place), ends, stamps: [self.stamps[a], self.stamps[b]], place }
    }

    /// Triangles that have both ends of an edge.
    fn shared(&self, [a, b]: [u32; 2]) -> usize {
        self.triangles_at(a).filter(|triangle| triangle.contains(&b)).count()
    }

    fn triangles_at(&self, corner: u32) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.around[corner as usize].iter().filter_map(|number| self.triangles[*number as usize])
    }

    fn neighbours(&self, corner: u32) -> Vec<u32> {
        let mut found: Vec<u32> = self.triangles_at(corner).flatten().filter(|other| *other != corner).collect();
        found.sort_unstable();
        found.dedup();
        found
    }

    fn may_join(&self, edge: &Edge) -> bool {
        let [a, b] = edge.ends;
        let (of_a, of_b) = (self.neighbours(a), self.neighbours(b));
        let common: Vec<u32> = of_a.iter().copied().filter(|n| of_b.binary_search(n).is_ok()).collect();
        // Where one of the two has three neighbours, joining would lay two triangles onto each other.
        let thin = common.iter().any(|n| self.neighbours(*n).len() <= 3);
        // A rim stays one: two of its corners join along it alone.
        let shared = self.shared(edge.ends);
        let is_between_rims = self.is_rim[a as usize] && self.is_rim[b as usize];
        if shared != if is_between_rims { 1 } else { 2 } {
            return false;
        }
        if common.len() != shared || thin || of_a.len() + of_b.len() < 7 {
            return false;
        }
        [(a, b), (b, a)].iter().all(|(corner, other)| {
            self.triangles_at(*corner).filter(|triangle| !triangle.contains(other)).all(|triangle| {
                let before = triangle.map(|c| self.points[c as usize]);
                let after = triangle.map(|c| if c == *corner { edge.place } else { self.points[c as usize] });
                let normal = |p: [Point3<f64>; 3]| (p[1] - p[0]).cross(&(p[2] - p[0]));
                let (before, after) = (normal(before), normal(after));
                let longest = (0..3).map(|i| (self.side(&triangle, i, *corner, &edge.place)).norm_squared());
                // Neither turned over nor a needle.
                before.dot(&after) > TURN * before.norm() * after.norm()
                    && after.norm() > 0.02 * longest.fold(0.0, f64::max)
            })
        })
    }

    fn side(&self, triangle: &[u32; 3], i: usize, moved: u32, place: &Point3<f64>) -> Vector3<f64> {
        let at = |c: u32| if c == moved { *place } else { self.points[c as usize] };
        at(triangle[(i + 1) % 3]) - at(triangle[i])
    }

    /// The second end becomes the first, at the edge's place.
    fn join(&mut self, edge: &Edge) {
        let [a, b] = edge.ends;
        let (first, second) = (a as usize, b as usize);
        self.quadrics[first] = self.quadrics[first].plus(&self.quadrics[second]);
        self.points[first] = edge.place;
        self.is_rim[first] |= self.is_rim[second];
        for number in std::mem::take(&mut self.around[second]) {
            let Some(triangle) = &mut self.triangles[number as usize] else { continue };
            if triangle.contains(&a) {
                self.triangles[number as usize] = None;
            } else {
                triangle.iter_mut().filter(|corner| **corner == b).for_each(|corner| *corner = a);
                self.around[first].push(number);
            }
        }
        let Self { around, triangles, .. } = self;
        around[first].retain(|number| triangles[*number as usize].is_some());
        self.stamps[first] += 1;
        self.stamps[second] += 1;
    }
}

/// Edges of one triangle alone, with its number, in a fixed order.
fn rim(mesh: &Mesh) -> Vec<([u32; 2], usize)> {
    let mut found: HashMap<[u32; 2], (usize, usize)> = HashMap::new();
    for (number, triangle) in mesh.triangles.iter().enumerate() {
        for i in 0..3 {
            let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
            found.entry([a.min(b), a.max(b)]).or_insert((0, number)).0 += 1;
        }
    }
    let mut rim: Vec<_> = found.into_iter().filter(|(_, (count, _))| *count == 1).map(|(e, (_, n))| (e, n)).collect();
    rim.sort_unstable();
    rim
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::field::{Field, Grid};
    use crate::mesh::{Solid, Topology, surface};

    #[test]
    fn a_ring_of_few_triangles_is_still_a_ring_of_the_same_volume() {
        let grid = Grid { dims: [40, 40, 20], origin: Point3::new(-0.2, -0.2, -0.1), voxel: 0.01 };
        let value = |p: Point3<f64>| ((p.x.hypot(p.y) - 0.1).powi(2) + p.z * p.z).sqrt() - 0.04;
        let distance = (0..grid.len()).map(|i| (value(grid.position(grid.node(i))) / 0.01) as f32).collect();
        let (mesh, _) = surface(&Field { grid, distance, colour: vec![[0.5; 3]; grid.len()] }).expect("a ring");
        let few = reduced(&mesh, 400);
        assert!((390..=400).contains(&few.triangles.len()), "{}", few.triangles.len());
        assert_eq!(Topology::of(&few).expect("closed").genus, 1);
        let (before, after) = (Solid::of(&mesh).volume, Solid::of(&few).volume);
        // Facets within a round surface take some of it.
        assert!((after / before - 1.0).abs() < 0.03, "{before} {after}");
        // With nothing left to draw together it ends, closed.
        assert_eq!(Topology::of(&reduced(&mesh, 4)).expect("closed").genus, 1);
    }

    #[test]
    fn a_plate_with_a_step_of_few_triangles_keeps_its_rim_and_its_step() {
        let (columns, rows) = (60u32, 40u32);
        let height = |column: u32| if column < 30 { 0.0 } else { 0.05 };
        let points = (0..columns * rows)
            .map(|i| Point3::new(0.01 * f64::from(i % columns), 0.01 * f64::from(i / columns), height(i % columns)));
        let mut triangles = Vec::new();
        for row in 0..rows - 1 {
            for column in 0..columns - 1 {
                let a = row * columns + column;
                triangles.extend([[a, a + 1, a + columns], [a + 1, a + columns + 1, a + columns]]);
            }
        }
        let few = reduced(&Mesh { points: points.collect(), triangles }, 60);
        assert!(few.triangles.len() <= 60, "{}", few.triangles.len());
        let (low, high) = few.bounds();
        assert!((low - Point3::origin()).norm() < 1e-3 && (high - Point3::new(0.59, 0.39, 0.05)).norm() < 1e-3);
        let area = (0..few.triangles.len()).map(|number| {
            let [a, b, c] = few.corners(number);
            0.5 * (b - a).cross(&(c - a)).norm()
        });
        let wanted = 0.39 * (0.29 + 0.29 + 0.05f64.hypot(0.01));
        assert!((area.sum::<f64>() / wanted - 1.0).abs() < 0.01);
    }
}
