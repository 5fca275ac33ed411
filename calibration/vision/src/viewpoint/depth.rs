//! The robot in a depth picture, where there is none of the empty cell: the largest piece that hangs together and lies in
//! no large plane.
//!
//! Table, floor and walls are planes. They are found one after the other by consensus (Fischler & Bolles 1981), each fitted
//! once more to all that lies in it, and taken out.

use super::grid::Grid;
use super::lens::Lens;
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

/// A pixel lies in a plane when it is no further from it along its line of sight: a step of the sensor, and three sigmas of
/// a stereo camera's noise at this distance squared [m, 1/m]. A D455 has 1.3 mm at 1 m at full resolution, 2.6 mm at half.
const STEP: f64 = 1.5e-3;
const NOISE: f64 = 8e-3;
/// A plane is large when so much of it is seen [m²], in so many of the pixels: a robot's flat faces are smaller.
const LARGE_PLANE: f64 = 0.08;
const MIN_PLANE_SHARE: f64 = 0.01;
/// At most so many planes are taken out.
const PLANES: usize = 8;
/// Planes that are tried for each, and pixels that are asked about each.
const TRIES: usize = 1500;
const ASKED: usize = 3000;
/// Neighbours further apart than this do not hang together [m]: one limb before another does, what stands behind does not.
const JUMP: f64 = 0.12;

/// A plane `n . p = 1` in the optical frame [1/m]; it does not pass through the camera.
type Plane = Vector3<f64>;

/// The robot's share of every pixel, from depths [mm] of a picture without distortion; 0 everywhere where all that is seen
/// lies in planes.
pub fn silhouette(depth: &Grid, lens: &Lens) -> Grid {
    let sights: Vec<Vector3<f64>> = (0..depth.values.len()).map(|i| sight(i, depth.width, lens)).collect();
    let depths: Vec<f64> = depth.values.iter().map(|d| f64::from(*d) * 1e-3).collect();
    let mut standing: Vec<usize> = (0..depths.len()).filter(|i| depths[*i] > 0.0).collect();
    let few = MIN_PLANE_SHARE * depths.len() as f64;
    let mut rng = Pcg64::seed_from_u64(1);
    for _ in 0..PLANES {
        let lies_in = |plane: &Plane, i: usize| {
            let expected = 1.0 / plane.dot(&sights[i]);
            (depths[i] - expected).abs() < STEP + NOISE * depths[i] * depths[i]
        };
        let point = |i: usize| depths[i] * sights[i];
        let Some(rough) = consensus(&standing, &point, &lies_in, &mut rng) else { break };
        let members: Vec<usize> = standing.iter().copied().filter(|i| lies_in(&rough, *i)).collect();
        let plane = fitted(members.iter().map(|i| (point(*i), depths[*i]))).unwrap_or(rough);
        let (inside, outside): (Vec<usize>, Vec<usize>) = standing.iter().partition(|i| lies_in(&plane, **i));
        // A pixel covers the more of a plane the more the line of sight grazes it.
        let seen: f64 = inside.iter().map(|i| plane.norm() * depths[*i].powi(3)).sum();
        if (inside.len() as f64) < few || seen / (lens.focal[0] * lens.focal[1]) < LARGE_PLANE {
            break;
        }
        standing = outside;
    }
    let robot = largest_piece(&standing, depth.width, &depths);
    let mut share = Grid::from_fn(depth.width, depth.height, |_, _| 0.0);
    robot.iter().for_each(|i| share.values[*i] = 1.0);
    closed(&share, &depths)
}

/// Direction of a pixel's line of sight, one metre deep.
fn sight(pixel: usize, width: usize, lens: &Lens) -> Vector3<f64> {
    let at = [(pixel % width) as f64, (pixel / width) as f64];
    Vector3::new((at[0] - lens.centre[0]) / lens.focal[0], (at[1] - lens.centre[1]) / lens.focal[1], 1.0)
}

/// Of planes through three points drawn by lot the one that holds most.
fn consensus(
    standing: &[usize],
    point: &impl Fn(usize) -> Vector3<f64>,
    lies_in: &impl Fn(&Plane, usize) -> bool,
    rng: &mut Pcg64,
) -> Option<Plane> {
    if standing.len() < 3 {
        return None;
    }
    let asked: Vec<usize> = standing.iter().copied().step_by(standing.len().div_ceil(ASKED)).collect();
    let mut drawn = || {
        let three = [(); 3].map(|()| point(standing[rng.random_range(0..standing.len())]));
        Matrix3::from_rows(&three.map(|p| p.transpose())).lu().solve(&Vector3::repeat(1.0))
    };
    let held = |plane: &Plane| asked.iter().filter(|i| lies_in(plane, **i)).count();
    let planes = (0..TRIES).filter_map(|_| drawn().map(|plane| (held(&plane), plane)));
    planes.max_by_key(|(held, _)| *held).map(|(_, plane)| plane)
}

/// Least squares on inverse depths, in which a stereo camera's noise is the same everywhere.
fn fitted(points: impl Iterator<Item = (Vector3<f64>, f64)>) -> Option<Plane> {
    let (mut square, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for (point, depth) in points {
        let sight = point / depth;
        square += sight * sight.transpose();
        right += sight / depth;
    }
    square.cholesky().map(|square| square.solve(&right))
}

/// Pixels of the piece with the largest surface across the lines of sight.
fn largest_piece(standing: &[usize], width: usize, depths: &[f64]) -> Vec<usize> {
    let mut open = vec![false; depths.len()];
    standing.iter().for_each(|i| open[*i] = true);
    let mut best: (f64, Vec<usize>) = (0.0, Vec::new());
    for first in standing {
        if !std::mem::take(&mut open[*first]) {
            continue;
        }
        let (mut piece, mut next) = (vec![*first], 0);
        while let Some(i) = piece.get(next).copied() {
            next += 1;
            let column = i % width;
            let beside = [(column > 0).then(|| i - 1), (column + 1 < width).then_some(i + 1)];
            for other in beside.into_iter().chain([i.checked_sub(width), Some(i + width)]).flatten() {
                if other < open.len() && open[other] && (depths[other] - depths[i]).abs() < JUMP {
                    open[other] = false;
                    piece.push(other);
                }
            }
        }
        let surface = piece.iter().map(|i| depths[*i] * depths[*i]).sum();
        if surface > best.0 {
            best = (surface, piece);
        }
    }
    best.1
}

/// Where nothing was measured, the robot if most of the neighbours are: a hole in it, not what is beside it.
fn closed(share: &Grid, depths: &[f64]) -> Grid {
    let (width, height) = (share.width as isize, share.height as isize);
    Grid::from_fn(share.width, share.height, |x, y| {
        let i = y * share.width + x;
        if depths[i] > 0.0 {
            return share.values[i];
        }
        let around = (-2..=2).flat_map(|dy| (-2..=2).map(move |dx| (x as isize + dx, y as isize + dy)));
        let inside = around.filter(|(u, v)| (0..width).contains(u) && (0..height).contains(v));
        let (robot, all) =
            inside.fold((0.0, 0.0), |(robot, all), (u, v)| (robot + share.values[(v * width + u) as usize], all + 1.0));
        f32::from(u8::from(robot > 0.5 * all))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const LENS: Lens = Lens { focal: [190.0, 190.0], centre: [79.5, 59.5] };

    /// A wall, a floor, a small box, and a column that leans, each as deep as its lines of sight say.
    fn scene(noise: f64) -> (Grid, Vec<bool>) {
        let mut rng = Pcg64::seed_from_u64(3);
        let mut robot = Vec::new();
        let depth = Grid::from_fn(160, 120, |x, y| {
            let s = sight(y * 160 + x, 160, &LENS);
            let wall = 2.5 / (1.0 + 0.2 * s.x);
            let floor = if s.y > 0.0 { 0.45 / s.y } else { f64::INFINITY };
            let behind = wall.min(floor);
            let lean = x as f64 - 70.0 - 0.2 * (y as f64 - 60.0);
            let column = (10..100).contains(&y) && lean.abs() < 9.0;
            let small = (118..130).contains(&x) && (85..95).contains(&y);
            robot.push(column);
            let z = if column {
                1.26 - 0.06 * (1.0 - (lean / 9.0).powi(2)).sqrt()
            } else if small {
                1.3
            } else {
                behind
            };
            let error = noise * z * z * (rng.random_range(0.0..1.0) + rng.random_range(0.0..1.0) - 1.0);
            if (x + 7 * y) % 61 == 0 { 0.0 } else { ((z + error) * 1e3).round() as f32 }
        });
        (depth, robot)
    }

    #[test]
    fn what_stands_before_planes_is_found_and_neither_they_nor_a_small_thing_are() {
        for noise in [0.0, 5e-3] {
            let (depth, robot) = scene(noise);
            let share = silhouette(&depth, &LENS);
            let wrong = share.values.iter().zip(&robot).filter(|(share, robot)| (**share > 0.5) != **robot).count();
            let all = robot.iter().filter(|robot| **robot).count();
            assert!(wrong * 50 < all, "{wrong} of {all} pixels are wrong, noise {noise}");
        }
    }

    #[test]
    fn before_a_bare_wall_nothing_stands() {
        let wall = Grid::from_fn(160, 120, |x, _| 2000.0 + x as f32);
        assert!(silhouette(&wall, &LENS).values.iter().filter(|share| **share > 0.0).count() < 20);
        let unseen = Grid::from_fn(160, 120, |_, _| 0.0);
        assert!(silhouette(&unseen, &LENS).values.iter().all(|share| *share == 0.0));
    }
}
