//! The largest plane among points: three of them propose it (RANSAC, Fischler & Bolles 1981), all that lie on it fit it by least
//! squares, with a tolerance that shrinks to their own scatter.

use crate::Surface;
use nalgebra::{Matrix3, Point3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64Mcg;
use rayon::prelude::*;

/// A plane: points with `normal · p = offset`.
///
/// ```
/// use fusion::plane::{Plane, Wanted};
/// use nalgebra::{Point3, Vector3};
///
/// // A table 0.1 m high, and a few points above it.
/// let mut points: Vec<Point3<f64>> =
///     (0..400).map(|i| Point3::new(f64::from(i % 20) * 0.02, f64::from(i / 20) * 0.02, 0.1)).collect();
/// points.extend((0..20).map(|i| Point3::new(0.2, 0.2, 0.15 + 0.01 * f64::from(i))));
/// let normals = vec![Vector3::z(); points.len()];
/// let plane = Plane::largest(&points, &normals, &Wanted { tolerance: 2e-3, normal: None }).expect("a plane");
/// assert_eq!(plane.points, 400);
/// assert!(plane.distance(&Point3::new(0.0, 0.0, 0.1)).abs() < 1e-6); // m
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plane {
    /// Of length 1.
    pub normal: Vector3<f64>,
    /// Along the normal from the origin [m].
    pub offset: f64,
    /// Points that lie on it.
    pub points: usize,
}

/// Which plane is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wanted {
    /// How far points may lie off the plane while it is looked for [m].
    pub tolerance: f64,
    /// The direction that its normal has, and by how much it may differ [rad]; `None`: any.
    pub normal: Option<(Vector3<f64>, f64)>,
}

/// Proposals: enough to meet a plane that holds a sixth of the points that may lie on it with 99 %.
const TRIALS: u64 = 1000;
/// Points that are asked about each.
const ASKED: usize = 1000;
/// Refinements; and the tolerance in standard deviations of what lies on the plane.
const REFINEMENTS: usize = 12;
const DEVIATIONS: f64 = 2.5;
/// A normal of a point on the plane differs by less from the plane's: cosine.
const ALIKE: f64 = 0.8;

impl Plane {
    /// Distance of a point on the side of the normal [m].
    pub fn distance(&self, point: &Point3<f64>) -> f64 {
        self.normal.dot(&point.coords) - self.offset
    }

    /// The plane with most points; `normals` of the points, of length 1, or none at all. Its own normal points as most of
    /// them do, or as was wanted.
    pub fn largest(points: &[Point3<f64>], normals: &[Vector3<f64>], wanted: &Wanted) -> Option<Self> {
        if points.len() < 3 {
            return None;
        }
        let every = points.len().div_ceil(ASKED).max(1);
        let drawn = wanted.candidates(points, normals);
        if drawn.is_empty() {
            return None;
        }
        let proposed = (0..TRIALS)
            .into_par_iter()
            .filter_map(|trial| {
                let mut rng = Pcg64Mcg::seed_from_u64(trial);
                let [a, b, c] = [0; 3].map(|_| points[drawn[rng.random_range(0..drawn.len())]]);
                let normal = (b - a).cross(&(c - a)).try_normalize(1e-9)?;
                let plane = wanted.turned(Self { normal, offset: normal.dot(&a.coords), points: 0 })?;
                let on = (0..points.len()).step_by(every);
                let count = on.filter(|i| plane.holds(points, normals, *i, wanted.tolerance)).count();
                Some((count, trial, plane))
            })
            .max_by_key(|(count, trial, _)| (*count, *trial));
        let mut plane = proposed?.2;
        let mut tolerance = wanted.tolerance;
        for _ in 0..REFINEMENTS {
            let on: Vec<usize> = (0..points.len()).filter(|i| plane.holds(points, normals, *i, tolerance)).collect();
            if on.len() < 3 {
                break;
            }
            plane = plane.fitted(points, &on);
            let square: f64 = on.iter().map(|i| plane.distance(&points[*i]).powi(2)).sum();
            tolerance = (DEVIATIONS * (square / on.len() as f64).sqrt()).clamp(1e-6, wanted.tolerance);
        }
        plane.points = (0..points.len()).filter(|i| plane.holds(points, normals, *i, wanted.tolerance)).count();
        if wanted.normal.is_none() && !normals.is_empty() {
            let alike = |i: &usize| plane.distance(&points[*i]).abs() < wanted.tolerance;
            let along: f64 = (0..points.len()).filter(alike).map(|i| normals[i].dot(&plane.normal)).sum();
            if along < 0.0 {
                (plane.normal, plane.offset) = (-plane.normal, -plane.offset);
            }
        }
        Some(plane)
    }

    fn holds(&self, points: &[Point3<f64>], normals: &[Vector3<f64>], number: usize, tolerance: f64) -> bool {
        let near = self.distance(&points[number]).abs() < tolerance;
        near && normals.get(number).is_none_or(|normal| normal.dot(&self.normal).abs() > ALIKE)
    }

    /// The least squares through some points, on the same side.
    fn fitted(&self, points: &[Point3<f64>], on: &[usize]) -> Self {
        let middle = on.iter().map(|i| points[*i].coords).sum::<Vector3<f64>>() / on.len() as f64;
        let spread: Matrix3<f64> =
            (on.iter()).map(|i| points[*i].coords - middle).map(|off| off * off.transpose()).sum();
        let axes = spread.symmetric_eigen();
        let normal = axes.eigenvectors.column(axes.eigenvalues.imin()).into_owned();
        let normal = if normal.dot(&self.normal) < 0.0 { -normal } else { normal };
        Self { normal, offset: normal.dot(&middle), points: on.len() }
    }
}

impl Wanted {
    /// The points that may lie on such a plane, by their normals: three of those propose it, and not of all, of which walls are most.
    fn candidates(&self, points: &[Point3<f64>], normals: &[Vector3<f64>]) -> Vec<usize> {
        let Some((way, most)) = self.normal else { return (0..points.len()).collect() };
        let (way, least) = (way.normalize(), (ALIKE.acos() + most).cos());
        (0..points.len()).filter(|i| normals.get(*i).is_none_or(|normal| normal.dot(&way).abs() > least)).collect()
    }

    /// The plane with its normal on the wanted side, where it may have such a one.
    fn turned(&self, plane: Plane) -> Option<Plane> {
        let Some((way, most)) = self.normal else { return Some(plane) };
        let along = plane.normal.dot(&way.normalize());
        if along.abs() < most.cos() {
            return None;
        }
        let sign = along.signum();
        Some(Plane { normal: plane.normal * sign, offset: plane.offset * sign, ..plane })
    }
}

/// A level part of a scene: a table, a floor, a shelf.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Level {
    pub plane: Plane,
    /// The middle of its points [m].
    pub middle: Point3<f64>,
}

/// Points lie on a level that are nearer to it than this [m].
const LEVEL: f64 = 0.01;
/// A scene has so many levels at most, none with less than this share of the largest one's points.
const LEVELS: usize = 6;
const MIN_LEVEL_SHARE: f64 = 0.1;
/// The table has at least this share of them.
const OF_TABLE: f64 = 1.0 / 3.0;

/// The levels of a scene, the largest first: planes that face up, `within` so much of `up` [rad]; those after the first within 2
/// degrees of it.
pub fn levels(surface: &Surface, up: &Vector3<f64>, within: f64) -> Vec<Level> {
    let mut points: Vec<Point3<f64>> = surface.points.iter().map(|p| p.cast()).collect();
    let mut normals: Vec<Vector3<f64>> = surface.normals().iter().map(|n| n.cast()).collect();
    let mut levels: Vec<Level> = Vec::new();
    let mut wanted = Wanted { tolerance: LEVEL, normal: Some((*up, within)) };
    while levels.len() < LEVELS {
        let Some(plane) = Plane::largest(&points, &normals, &wanted) else { break };
        // Undersides are no levels.
        let is_on = |i: usize| plane.distance(&points[i]).abs() < LEVEL && normals[i].dot(&plane.normal) > ALIKE;
        let on: Vec<usize> = (0..points.len()).filter(|i| is_on(*i)).collect();
        let most = levels.first().map_or(0, |level| level.plane.points);
        if on.is_empty() || (on.len() as f64) < MIN_LEVEL_SHARE * most as f64 {
            break;
        }
        let middle = on.iter().map(|i| points[*i].coords).sum::<Vector3<f64>>() / on.len() as f64;
        levels.push(Level { plane: Plane { points: on.len(), ..plane }, middle: middle.into() });
        wanted.normal = Some((levels[0].plane.normal, 0.035));
        let left = |i: &usize| plane.distance(&points[*i]).abs() > 2.0 * LEVEL;
        let left: Vec<usize> = (0..points.len()).filter(left).collect();
        (points, normals) = left.iter().map(|i| (points[*i], normals[*i])).unzip();
    }
    levels
}

/// Which of the levels is the table: the highest that has a third of the largest one's points at least.
pub fn table(levels: &[Level]) -> Option<usize> {
    let up = levels.first()?.plane.normal;
    let least = OF_TABLE * levels[0].plane.points as f64;
    let large = (0..levels.len()).filter(|i| levels[*i].plane.points as f64 >= least);
    large.max_by(|a, b| up.dot(&levels[*a].middle.coords).total_cmp(&up.dot(&levels[*b].middle.coords)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_distr::{Distribution as _, Normal};

    #[test]
    fn a_table_is_found_below_what_stands_on_it_within_a_tenth_of_a_degree() {
        let mut rng = Pcg64Mcg::seed_from_u64(3);
        let noise = Normal::new(0.0, 0.003).expect("a deviation");
        let normal = Vector3::new(0.05, -0.08, 1.0).normalize();
        let mut points = Vec::new();
        let mut surface = |count: usize, low: [f64; 3], high: [f64; 3], on_table: bool| {
            for _ in 0..count {
                let p = Vector3::from_fn(|i, _| rng.random_range(low[i]..=high[i]));
                let height = if on_table { 0.31 - normal.dot(&p) } else { 0.0 };
                points.push(Point3::from(p + normal * (height + noise.sample(&mut rng))));
            }
        };
        surface(6000, [-0.6, -0.4, 0.2], [0.6, 0.4, 0.4], true);
        // A wall with more points, and things on the table.
        surface(9000, [0.7, -1.0, 0.0], [0.7, 1.0, 1.5], false);
        surface(3000, [0.1, 0.1, 0.3], [0.2, 0.25, 0.45], false);
        let wanted = Wanted { tolerance: 0.01, normal: Some((Vector3::z(), 0.26)) };
        let table = Plane::largest(&points, &[], &wanted).expect("a table");
        let off = table.normal.angle(&normal).to_degrees();
        assert!(off < 0.1 && (table.offset - 0.31).abs() < 1e-3 && table.points > 5500, "{off} {table:?}");
        let wall = Plane::largest(&points, &[], &Wanted { normal: None, ..wanted }).expect("a wall");
        assert!(wall.normal.x.abs() > 0.9999 && (wall.offset.abs() - 0.7).abs() < 1e-3, "{wall:?}");
        assert!(Plane::largest(&points[..2], &[], &wanted).is_none());
    }

    /// Squares of 5 mm that face up.
    fn plate(surface: &mut Surface, [x, y, z]: [f32; 3], [columns, rows]: [u32; 2]) {
        let first = surface.points.len() as u32;
        for i in 0..columns * rows {
            let (column, row) = (i % columns, i / columns);
            surface.points.push(Point3::new(x + 0.005 * column as f32, y + 0.005 * row as f32, z));
            surface.colors.push([0.5; 3]);
            if column + 1 < columns && row + 1 < rows {
                let a = first + i;
                surface.triangles.extend([[a, a + 1, a + columns], [a + 1, a + columns + 1, a + columns]]);
            }
        }
    }

    #[test]
    fn a_table_is_found_in_a_room_of_which_walls_are_nine_tenths() {
        let mut room = Surface::default();
        plate(&mut room, [0.0, 0.0, 0.0], [120, 80]);
        plate(&mut room, [0.2, 0.1, 0.7], [60, 60]);
        // A wall with nine times as many points as both.
        let first = room.points.len() as u32;
        let (columns, rows) = (400, 300);
        for i in 0..columns * rows {
            room.points.push(Point3::new(0.005 * (i % columns) as f32, -0.3, 0.005 * (i / columns) as f32));
            room.colors.push([0.5; 3]);
            if i % columns + 1 < columns && i / columns + 1 < rows {
                let a = first + i;
                room.triangles.extend([[a, a + 1, a + columns], [a + 1, a + columns + 1, a + columns]]);
            }
        }
        let levels = levels(&room, &Vector3::z(), 0.26);
        let at = table(&levels).expect("a table");
        assert!(levels.len() == 2 && (levels[at].middle.z - 0.7).abs() < 1e-6, "{levels:?}");
    }

    #[test]
    fn the_table_is_the_highest_of_the_large_levels() {
        let mut surface = Surface::default();
        plate(&mut surface, [0.0, 0.0, 0.0], [200, 100]);
        plate(&mut surface, [0.2, 0.0, 0.7], [100, 80]);
        plate(&mut surface, [0.3, 0.1, 0.9], [20, 20]);
        let found = levels(&surface, &Vector3::new(0.1, 0.0, 1.0), 0.3);
        let heights: Vec<f64> = found.iter().map(|level| level.middle.z).collect();
        assert!(found.len() == 2 && heights[0].abs() < 1e-6 && (heights[1] - 0.7).abs() < 1e-6, "{heights:?}");
        assert_eq!((table(&found), table(&[])), (Some(1), None));
        assert!((found[1].middle.x - 0.4475).abs() < 1e-5 && found[1].plane.points == 8000, "{found:?}");
    }
}
