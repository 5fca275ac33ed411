//! A ChArUco board at a known place: a chessboard with a marker in each white square, so that every corner between four
//! squares is distinguished from the others even when only some are seen (Garrido-Jurado et al. 2014). Rough is enough:
//! the robot's outline has the last word on where the camera stands.

use super::dictionary::Dictionary;
use super::grid::Grid;
use super::lattice::{self, Corner, Crossing};
use super::lens::Lens;
use super::picture::Pixels;
use super::planar::{self, Seen};
use anyhow::Context as _;
use chess_corners::DetectorConfig;
use nalgebra::{Isometry3, Point3};

/// The board as OpenCV draws it: the first square black, or, of an even number of rows drawn before OpenCV 4.6, white. Its
/// frame: origin at the outer corner of that square, x along the rows, y down the columns, z into the board.
#[derive(Debug, Clone, PartialEq)]
pub struct Board {
    /// Squares in a row and in a column.
    pub squares: [u32; 2],
    /// Edge of a square [m].
    pub square: f64,
    /// Edge of a marker [m].
    pub marker: f64,
    /// Name of the markers' dictionary as OpenCV has it, ArUco's or AprilTag's: `DICT_5X5_100`, `DICT_APRILTAG_36h11`.
    pub dictionary: String,
}

/// A picture read as one of the board.
#[derive(Debug, Clone, PartialEq)]
pub struct Reading {
    /// How well the board explains what is light and dark there, 1 at best.
    pub explained: f64,
    /// The board's frame in the camera's.
    pub camera_from_board: Isometry3<f64>,
    /// Corners between squares.
    pub seen: Vec<Seen>,
}

/// Middle of a field of a marker in the board's frame [m], and whether it is light.
type Field = ([f64; 2], bool);

/// Less of a picture's light and dark at the markers explained by the board there than this, and it is not there: a
/// lattice laid over other crossings explains next to nothing.
const EXPLAINED: f64 = 0.6;

/// Crossings fainter than this are noise: differences of grey values, summed around a ring (Bennett & Lasenby 2014).
const CONTRAST: f32 = 15.0;
/// Pictures are looked at as they are and enlarged by this: small squares' crossings lie too near to one another.
const ENLARGED: [usize; 2] = [1, 2];

impl Board {
    /// From `COLUMNSxROWS,SQUARE,MARKER,DICTIONARY`, lengths in metres.
    ///
    /// # Errors
    /// A sentence that says what does not fit.
    pub fn parse(text: &str) -> Result<Self, String> {
        let expected = "give COLUMNSxROWS,SQUARE,MARKER,DICTIONARY, for example 5x7,0.04,0.03,DICT_5X5_100";
        let parts: Vec<&str> = text.split(',').map(str::trim).collect();
        let [squares, square, marker, dictionary] = parts[..] else { return Err(expected.into()) };
        let (columns, rows) = squares.split_once('x').ok_or(expected)?;
        let count = |text: &str| text.parse::<u32>().ok().filter(|n| (3..=50).contains(n)).ok_or("3 to 50 squares");
        let length = |text: &str| text.parse::<f64>().ok().filter(|l| (1e-3..=1.0).contains(l)).ok_or(expected);
        let (squares, square, marker) = ([count(columns)?, count(rows)?], length(square)?, length(marker)?);
        if marker >= square {
            return Err("a marker is smaller than its square; both in metres".into());
        }
        let Some(known) = Dictionary::named(dictionary) else {
            return Err(format!("no dictionary is called {dictionary}; OpenCV's names hold, like DICT_4X4_50"));
        };
        let (needed, has) = (squares[0] * squares[1] / 2, known.markers());
        if has < needed as usize {
            return Err(format!("the board has {needed} markers, {dictionary} only {has}"));
        }
        Ok(Self { squares, square, marker, dictionary: dictionary.into() })
    }

    /// The camera's pose from pictures without distortion of one camera that stood still, as did the board: from the one
    /// that shows the board best.
    ///
    /// # Errors
    /// When no picture shows the board.
    pub fn camera_from_board(&self, pictures: &[Pixels], lens: &Lens) -> anyhow::Result<Isometry3<f64>> {
        let mut best: Option<Reading> = None;
        for picture in pictures {
            let found = self.seen(picture, lens)?;
            if found.as_ref().map(|found| found.explained) > best.as_ref().map(|best| best.explained) {
                best = found;
            }
        }
        let [columns, rows] = self.squares;
        let best = best.with_context(|| {
            format!(
                "no picture shows the board of {columns} x {rows} squares with {}: check --board and the light",
                self.dictionary
            )
        })?;
        Ok(best.camera_from_board)
    }

    /// The board in a picture without distortion, as it is read best; `None` where it is not there.
    ///
    /// # Errors
    /// When the picture cannot be searched.
    pub fn seen(&self, picture: &Pixels, lens: &Lens) -> anyhow::Result<Option<Reading>> {
        let mut best: Option<Reading> = None;
        let patterns: Vec<_> = [0, 1][..if self.squares[1].is_multiple_of(2) { 2 } else { 1 }]
            .iter()
            .map(|black| self.fields(*black))
            .collect();
        let grey = picture.grey();
        for factor in ENLARGED {
            for crossings in lattices(&grey, factor)? {
                for seen in self.readings(&crossings) {
                    let Some(camera_from_board) = planar::pose(&seen, lens) else { continue };
                    let explained = patterns.iter().map(|fields| explained(fields, &grey, lens, &camera_from_board));
                    let explained = explained.fold(0.0, f64::max);
                    // Of two lattices that fit alike, the one with more of the board's corners.
                    let worth = |explained: f64, corners: usize| explained * (corners as f64).powf(0.1);
                    let least = best.as_ref().map_or(0.0, |best| worth(best.explained, best.seen.len()));
                    if explained > EXPLAINED && worth(explained, seen.len()) > least {
                        best = Some(Reading { explained, camera_from_board, seen });
                    }
                }
            }
        }
        Ok(best)
    }

    /// Every field of every marker, for a board whose first square is black (0) or white (1).
    pub(super) fn fields(&self, first: u32) -> Vec<Field> {
        let Some(dictionary) = Dictionary::named(&self.dictionary) else { return Vec::new() };
        let fields = dictionary.side + 2;
        let [columns, rows] = self.squares;
        let white = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
        let white = white.filter(|[column, row]| (column + row + first) % 2 == 1);
        let mut out = Vec::new();
        for (marker, [column, row]) in white.take(dictionary.markers()).enumerate() {
            for (i, j) in (0..fields).flat_map(|j| (0..fields).map(move |i| (i, j))) {
                let across = |square: u32, field: u32| {
                    (f64::from(square) + 0.5) * self.square
                        + ((f64::from(field) + 0.5) / f64::from(fields) - 0.5) * self.marker
                };
                // The border is black.
                let inside = i.checked_sub(1).zip(j.checked_sub(1));
                let is_light = inside.and_then(|(i, j)| dictionary.is_light(marker, i, j)).unwrap_or(false);
                out.push(([across(column, i), across(row, j)], is_light));
            }
        }
        out
    }

    /// All ways to lay the board under a lattice so that every crossing is one of the board's.
    fn readings(&self, crossings: &[Crossing]) -> Vec<Vec<Seen>> {
        let inner = self.squares.map(|squares| squares as i32 - 1);
        let mut out = Vec::new();
        for quarter in 0..4 {
            let turned = |[a, b]: [i32; 2]| [[a, b], [-b, a], [-a, -b], [b, -a]][quarter];
            let span = [0, 1].map(|axis| {
                let values = || crossings.iter().map(|(at, _)| turned(*at)[axis]);
                [values().min().unwrap_or(0), values().max().unwrap_or(0)]
            });
            let shifts = |axis: usize| 1 - span[axis][0]..=inner[axis] - span[axis][1];
            for (x, y) in shifts(1).flat_map(|y| shifts(0).map(move |x| (x, y))) {
                let place = |at: [i32; 2]| {
                    let [a, b] = turned(at);
                    [a + x, b + y].map(|n| f64::from(n) * self.square)
                };
                out.push(crossings.iter().map(|(at, pixel)| Seen { place: place(*at), pixel: *pixel }).collect());
            }
        }
        out
    }
}

/// How well the fields of a board at a pose say what is light and dark there: their correlation, 1 at best.
fn explained(fields: &[Field], grey: &Grid, lens: &Lens, camera_from_board: &Isometry3<f64>) -> f64 {
    let mut sums = [0.0; 6];
    for (place, is_light) in fields {
        let at = camera_from_board * Point3::new(place[0], place[1], 0.0);
        let [u, v] = lens.project(&at);
        let Some(seen) = grey.sample(u, v).filter(|_| at.z > 0.0) else { continue };
        let said = f64::from(u8::from(*is_light));
        let terms = [1.0, said, seen, said * said, said * seen, seen * seen];
        sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }
    let [count, said, seen, said_said, said_seen, seen_seen] = sums;
    let spread = (count * said_said - said * said) * (count * seen_seen - seen * seen);
    if spread > 0.0 { (count * said_seen - said * seen) / spread.sqrt() } else { 0.0 }
}

/// The chessboards that a picture shows, looked for in one that is `factor` times as large.
fn lattices(grey: &Grid, factor: usize) -> anyhow::Result<Vec<Vec<Crossing>>> {
    let (width, height) = (grey.width * factor, grey.height * factor);
    // Pixel centres lie at whole numbers in both.
    let smaller = |at: f64| (at + 0.5) / factor as f64 - 0.5;
    let larger = Grid::from_fn(width, height, |x, y| {
        let (u, v) = (smaller(x as f64).max(0.0), smaller(y as f64).max(0.0));
        let (u, v) = (u.min((grey.width - 1) as f64), v.min((grey.height - 1) as f64));
        grey.sample(u, v).unwrap_or(0.0) as f32
    });
    let bytes: Vec<u8> = larger.values.iter().map(|value| value.clamp(0.0, 255.0) as u8).collect();
    let settings = DetectorConfig::chess().with_threshold(CONTRAST);
    let found = chess_corners::Detector::new(settings)?.detect_u8(&bytes, width as u32, height as u32)?;
    let corners = found.iter().filter_map(|found| {
        let axes = found.axes?.map(|axis| f64::from(axis.angle));
        Some(Corner {
            at: [found.x, found.y].map(|v| smaller(f64::from(v))),
            response: f64::from(found.response),
            axes,
        })
    });
    Ok(lattice::lattices(&corners.collect::<Vec<_>>()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::viewpoint::test_board::picture;
    use nalgebra::{Translation3, UnitQuaternion};
    use shared_mem::lens::Distortion;

    const LENS: Lens = Lens { focal: [520.0, 520.0], centre: [319.5, 239.5] };

    fn close(board: &str, first: u32, camera_from_board: &Isometry3<f64>) {
        let board = Board::parse(board).expect("a board");
        let found = board
            .camera_from_board(&[picture(&board, first, camera_from_board, &LENS, &Distortion::NONE)], &LENS)
            .expect("a pose");
        let off = (found.translation.vector - camera_from_board.translation.vector).norm();
        let angle = found.rotation.angle_to(&camera_from_board.rotation);
        assert!(off < 3e-3 && angle < 0.01, "{off} m and {angle} rad off");
    }

    fn before(x: f64, y: f64, z: f64, angles: [f64; 3]) -> Isometry3<f64> {
        let turn = UnitQuaternion::from_euler_angles(angles[0], angles[1], angles[2]);
        Isometry3::from_parts(Translation3::new(x, y, z), turn)
    }

    #[test]
    fn a_board_of_aruco_markers_tells_where_the_camera_stands() {
        close("5x7,0.04,0.03,DICT_5X5_100", 0, &before(-0.1, -0.12, 0.55, [0.35, -0.2, 0.1]));
        close("7x5,0.05,0.037,DICT_4X4_50", 0, &before(0.16, -0.12, 0.7, [-0.3, 0.3, 1.4]));
        close("4x6,0.05,0.04,DICT_5X5_50", 1, &before(-0.1, -0.12, 0.6, [0.2, 0.3, 0.1]));
    }

    #[test]
    fn a_picture_without_the_board_says_so_and_a_board_that_cannot_be_is_refused() {
        let board = Board::parse("5x7,0.04,0.03,DICT_5X5_100").expect("a board");
        let blank = Grid::from_fn(640, 480, |x, y| ((x / 7 + y / 5) % 11) as f32 * 20.0);
        let blank = Pixels { size: [640, 480], channels: vec![blank] };
        let error = board.camera_from_board(&[blank], &LENS).expect_err("no board").to_string();
        assert!(error.contains("5 x 7") && !error.contains('\n'), "{error}");
        for wrong in [
            "5x7",
            "2x7,0.04,0.03,DICT_4X4_50",
            "5x7,0.03,0.04,DICT_4X4_50",
            "5x7,0.04,0.03,DICT_9",
            "50x7,0.04,0.03,DICT_4X4_50",
        ] {
            assert!(Board::parse(wrong).is_err(), "{wrong}");
        }
    }
}
