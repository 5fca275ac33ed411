//! A mesh as convex pieces, by parry's volumetric decomposition (V-HACD): what contact takes in place of a mug.

use super::convert;
use super::hull::{Face, Hull};
use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::transformation::vhacd::{VHACD, VHACDParameters};

/// Voxels along the longest edge.
const RESOLUTION: u32 = 96;
/// A piece is cut while its hull is larger than it by more than this [share of the volume].
const CONCAVITY: f64 = 0.002;
/// Cells of a raster along a piece's longest edge.
const RASTERS: [f64; 4] = [128.0, 64.0, 32.0, 16.0];
/// A corner may stand out of a face by so much [share of the piece's diagonal]: half of what a task takes.
const STANDS_OUT: f64 = 2.5e-4;
/// To what files round [m].
const ROUNDED: f64 = 1e-7;
/// Pieces at most.
const MOST: u32 = 64;

/// Corners [m] and triangles of one convex piece.
pub type Piece = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// The convex pieces of a closed mesh, counter-clockwise seen from outside. Lengths are metres.
#[must_use]
pub fn convex_pieces(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<Piece> {
    let points: Vec<Vector> = points.iter().map(convert::point).collect();
    let parameters = VHACDParameters {
        resolution: RESOLUTION,
        concavity: CONCAVITY,
        max_convex_hulls: MOST,
        ..VHACDParameters::default()
    };
    let decomposed = VHACD::decompose(&parameters, &points, triangles, true);
    let pieces = decomposed.compute_exact_convex_hulls(&points, triangles).into_iter();
    let pieces = pieces.filter(|(corners, triangles)| corners.len() >= 4 && triangles.len() >= 4);
    pieces.filter_map(|(corners, triangles)| sound(outwards(corners, triangles))).collect()
}

/// A piece of which no corner stands out of a face. Among faces as narrow as a hair rounding turns some; corners on a raster, the finest
/// that does, have none of them.
fn sound(piece: Piece) -> Option<Piece> {
    if is_convex(&piece) {
        return Some(piece);
    }
    let (low, high) = bounds(&piece.0);
    let rastered = RASTERS.iter().filter_map(|cells| {
        let cell = (high - low).max() / cells;
        let snapped: Vec<Point3<f64>> =
            piece.0.iter().map(|p| low + (p - low).map(|v| (v / cell).round() * cell)).collect();
        of_hull(&snapped)
    });
    let corner =
        |i: usize| Point3::from(Vector3::from_fn(|axis, _| if i >> axis & 1 == 0 { low[axis] } else { high[axis] }));
    let around: Vec<Point3<f64>> = (0..8).map(corner).collect();
    rastered.chain(of_hull(&around)).find(is_convex)
}

fn bounds(corners: &[Point3<f64>]) -> (Point3<f64>, Point3<f64>) {
    let low = corners.iter().fold(Vector3::repeat(f64::INFINITY), |low, p| low.inf(&p.coords));
    let high = corners.iter().fold(Vector3::repeat(f64::NEG_INFINITY), |high, p| high.sup(&p.coords));
    (low.into(), high.into())
}

fn of_hull(points: &[Point3<f64>]) -> Option<Piece> {
    let hull = Hull::of(points)?;
    let fan = |face: &Face| -> Vec<[u32; 3]> {
        (1..face.rim.len() - 1).map(|i| [face.rim[0], face.rim[i], face.rim[i + 1]]).collect()
    };
    Some((hull.corners.clone(), hull.faces.iter().flat_map(fan).collect()))
}

/// Whether no corner stands out of a face, once places are rounded as files have them.
fn is_convex((corners, triangles): &Piece) -> bool {
    let (low, high) = bounds(corners);
    let rounded: Vec<Point3<f64>> = corners.iter().map(|p| p.map(|v| (v / ROUNDED).round() * ROUNDED)).collect();
    triangles.iter().all(|triangle| {
        let [a, b, c] = triangle.map(|corner| rounded[corner as usize]);
        let normal = (b - a).cross(&(c - a)).try_normalize(0.0);
        normal.is_none_or(|n| rounded.iter().all(|p| (p - a).dot(&n) < STANDS_OUT * (high - low).norm()))
    })
}

fn outwards(corners: Vec<Vector>, mut triangles: Vec<[u32; 3]>) -> Piece {
    let corners: Vec<Point3<f64>> = corners.into_iter().map(|p| convert::to_vector(p).into()).collect();
    let sixth = |t: &[u32; 3]| {
        let [a, b, c]: [Vector3<f64>; 3] = t.map(|corner| corners[corner as usize] - corners[0]);
        a.dot(&b.cross(&c))
    };
    if triangles.iter().map(sixth).sum::<f64>() < 0.0 {
        triangles.iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
    }
    (corners, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume((corners, triangles): &Piece) -> f64 {
        let corner = |i: u32| corners[i as usize].coords;
        triangles.iter().map(|t| corner(t[0]).dot(&corner(t[1]).cross(&corner(t[2]))) / 6.0).sum()
    }

    #[test]
    fn an_angle_becomes_pieces_with_its_volume() {
        // An L of two boxes, 100 x 100 mm with legs of 30 mm, 40 mm thick.
        let outline = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.03], [0.03, 0.03], [0.03, 0.1], [0.0, 0.1]];
        let points: Vec<Point3<f64>> =
            [0.0, 0.04].iter().flat_map(|z| outline.map(|[x, y]| Point3::new(x, y, *z))).collect();
        let lid = [[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 5]];
        let mut triangles: Vec<[u32; 3]> = lid.iter().map(|[a, b, c]| [*a, *c, *b]).collect();
        triangles.extend(lid.map(|t| t.map(|c| c + 6)));
        for i in 0..6u32 {
            let next = (i + 1) % 6;
            triangles.extend([[i, next, next + 6], [i, next + 6, i + 6]]);
        }
        let pieces = convex_pieces(&points, &triangles);
        let whole: f64 = pieces.iter().map(volume).sum();
        let truth = 0.04 * (0.1 * 0.03 + 0.03 * 0.07);
        assert!(pieces.len() >= 2 && (whole / truth - 1.0).abs() < 0.05, "{} pieces, {}", pieces.len(), whole / truth);
    }

    #[test]
    fn a_piece_with_faces_as_narrow_as_a_hair_stays_convex() {
        // A rounded slab whose corners lie within less than files can tell of each other.
        let ring = (0..60).flat_map(|i| {
            let (sin, cos) = (f64::from(i / 2) * 0.21 + f64::from(i % 2) * 2e-6).sin_cos();
            [0.0, 1e-7, 4e-3].map(|z| Point3::new(0.05 * cos, 0.03 * sin, z + 2e-7 * f64::from(i % 3)))
        });
        let piece = of_hull(&ring.collect::<Vec<_>>()).expect("a slab");
        let (low, high) = bounds(&piece.0);
        let found = sound(piece).expect("a piece");
        assert!(is_convex(&found));
        let (own_low, own_high) = bounds(&found.0);
        assert!((low - own_low).norm() < 2e-3 && (high - own_high).norm() < 2e-3);
    }
}
