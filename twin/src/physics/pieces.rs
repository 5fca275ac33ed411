//! A mesh as convex pieces, by parry's volumetric decomposition (V-HACD): what contact takes in place of a mug.

use super::convert;
use nalgebra::{Point3, Vector3};
use parry3d_f64::math::Vector;
use parry3d_f64::transformation::vhacd::{VHACD, VHACDParameters};

/// Voxels along the longest edge.
const RESOLUTION: u32 = 96;
/// A piece is cut while its hull is larger than it by more than this [share of the volume].
const CONCAVITY: f64 = 0.002;
/// Pieces at most.
const MAX_PIECES: u32 = 64;

/// Corners [m] and triangles of one convex piece.
pub type Piece = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// The convex pieces of a closed mesh, counter-clockwise seen from outside. Lengths are metres.
pub fn convex_pieces(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Vec<Piece> {
    let points: Vec<Vector> = points.iter().map(convert::point).collect();
    let parameters = VHACDParameters {
        resolution: RESOLUTION,
        concavity: CONCAVITY,
        max_convex_hulls: MAX_PIECES,
        ..VHACDParameters::default()
    };
    let decomposed = VHACD::decompose(&parameters, &points, triangles, true);
    let pieces = decomposed.compute_exact_convex_hulls(&points, triangles).into_iter();
    let pieces = pieces.filter(|(corners, triangles)| corners.len() >= 4 && triangles.len() >= 4);
    pieces.map(|(corners, triangles)| outwards(corners, triangles)).collect()
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
}
