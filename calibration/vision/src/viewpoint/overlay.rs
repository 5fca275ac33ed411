//! The pictures with the robot's outline drawn over them: found in red, started from in green.

use super::frame::Frame;
use super::grid::Grid;
use super::picture::Pixels;
use super::shape::Shape;
use nalgebra::Isometry3;

const FOUND: [u8; 3] = [255, 32, 32];
const STARTED: [u8; 3] = [40, 190, 60];
/// Widest picture, and most of them one below the other.
const WIDEST: usize = 960;
const MAX_PICTURES: usize = 6;

/// Columns, rows and pixels (red, green, blue) of a sheet with the first pictures below each other.
pub fn sheet(
    frames: &[Frame],
    pixels: &[Pixels],
    shape: &Shape,
    found: &Isometry3<f64>,
    start: Option<&Isometry3<f64>>,
) -> (u32, u32, Vec<u8>) {
    let pictures: Vec<(usize, usize, Vec<u8>)> = (frames.iter().zip(pixels).take(MAX_PICTURES))
        .map(|(frame, pixels)| {
            let mut picture = shrunk(pixels);
            if let Some(start) = start {
                draw(&mut picture, frame, shape, start, STARTED);
            }
            draw(&mut picture, frame, shape, found, FOUND);
            picture
        })
        .collect();
    let width = pictures.iter().map(|(width, ..)| *width).max().unwrap_or(1);
    let mut out = Vec::new();
    for (own, _, rgb) in &pictures {
        for row in rgb.chunks_exact(own * 3) {
            out.extend_from_slice(row);
            out.resize(out.len() + (width - own) * 3, 0);
        }
    }
    let height = out.len() / (width * 3);
    (width as u32, height as u32, out)
}

fn shrunk(pixels: &Pixels) -> (usize, usize, Vec<u8>) {
    let factor = pixels.size[0].div_ceil(WIDEST);
    let channels: Vec<Grid> = pixels.channels.iter().map(|grid| grid.shrunk(factor)).collect();
    let brightest = if channels.len() == 1 { channels[0].values.iter().copied().fold(1.0, f32::max) } else { 255.0 };
    let value = |i: usize, c: usize| {
        let grid = channels.get(c).or(channels.first());
        grid.map_or(0, |grid| (grid.values[i] / brightest * 255.0) as u8)
    };
    let count = channels[0].values.len();
    let rgb = (0..count).flat_map(|i| [value(i, 0), value(i, 1), value(i, 2)]).collect();
    (channels[0].width, channels[0].height, rgb)
}

/// The finest level is as wide as the drawn picture.
fn draw(
    (width, height, rgb): &mut (usize, usize, Vec<u8>),
    frame: &Frame,
    shape: &Shape,
    pose: &Isometry3<f64>,
    color: [u8; 3],
) {
    let mut outline = Vec::new();
    frame.outliner(Frame::FINEST).outline(&shape.fine, &frame.placed(pose), &mut outline);
    for place in &outline {
        let [u, v] = place.pixel.map(|value| value.round() as usize);
        if u < *width && v < *height {
            let at = (v * *width + u) * 3;
            rgb[at..at + 3].copy_from_slice(&color);
        }
    }
}
