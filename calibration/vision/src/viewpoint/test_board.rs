//! Pictures of a board whose place is known, through any lens.

use super::board::Board;
use super::dictionary::Dictionary;
use super::grid::Grid;
use super::lens::Lens;
use super::picture::Pixels;
use nalgebra::{Isometry3, Point3, Vector3};
use shared_mem::lens::Distortion;

/// A picture of the board, 640 x 480, every pixel the mean of four rays; the room around is grey.
pub fn picture(
    board: &Board,
    first: u32,
    camera_from_board: &Isometry3<f64>,
    lens: &Lens,
    distortion: &Distortion,
) -> Pixels {
    let fields = board.fields(first);
    let across = Dictionary::named(&board.dictionary).expect("a dictionary").side as usize + 2;
    let board_from_camera = camera_from_board.inverse();
    let eye = board_from_camera * Point3::origin();
    let shade = |u: f64, v: f64| {
        let [u, v] = lens.straight(distortion, [u, v]).expect("a lens that shows all of the picture");
        let ray = Vector3::new((u - lens.centre[0]) / lens.focal[0], (v - lens.centre[1]) / lens.focal[1], 1.0);
        let ray = board_from_camera * ray;
        let at = eye + ray * (-eye.z / ray.z);
        let [column, row] = [at.x, at.y].map(|v| (v / board.square).floor());
        let beyond = [column - f64::from(board.squares[0]), row - f64::from(board.squares[1])];
        if column.min(row) < -1.0 || beyond[0].max(beyond[1]) > 0.0 {
            return 120.0;
        }
        if column.min(row) < 0.0 || beyond[0].max(beyond[1]) >= 0.0 {
            return 235.0;
        }
        // Where in its marker, in fields; beyond it the square is bare.
        let field = |v: f64| ((v / board.square).fract() - 0.5) * board.square / board.marker + 0.5;
        let [i, j] = [at.x, at.y].map(|v| (field(v) * across as f64).floor());
        let marked = i.min(j) >= 0.0 && i.max(j) < across as f64;
        let before = board.squares[0] as usize * row as usize + first as usize;
        let number = before / 2 + column as usize / 2;
        let is_light = match (column + row + f64::from(first)).rem_euclid(2.0) > 0.5 {
            true if marked => fields[(number * across + j as usize) * across + i as usize].1,
            is_white => is_white,
        };
        if is_light { 235.0 } else { 20.0 }
    };
    let halves = [-0.25, 0.25];
    let grid = Grid::from_fn(640, 480, |x, y| {
        let rays = halves.iter().flat_map(|dv| halves.iter().map(move |du| (*du, *dv)));
        rays.map(|(du, dv)| shade(x as f64 + du, y as f64 + dv)).sum::<f64>() as f32 / 4.0
    });
    Pixels { size: [640, 480], channels: vec![grid.clone(), grid.clone(), grid] }
}
