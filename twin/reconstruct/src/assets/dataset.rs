//! What other trainers of splats begin with: pictures with the mask as alpha, where their cameras stand as a COLMAP model, and the splats, which such
//! a trainer takes in place of the model's points (`init.ply`). The format: <https://colmap.github.io/format.html>.

use super::stems::stems;
use crate::scan::Frame;
use nalgebra::{Isometry3, Point3};
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::{pack_picture, pack_with_alpha};
use splat::SplatCloud;
use std::fmt::Write as _;
use std::path::PathBuf;

/// All files with their paths in the output folder; frames and splats are in one frame, of which `origin` becomes the new origin.
pub fn dataset_files(frames: &[Frame], splats: &SplatCloud, origin: &Point3<f64>) -> Vec<(PathBuf, Vec<u8>)> {
    let splats = super::centred_splats(splats, origin);
    let mut cameras = String::from("# number, model, width, height, parameters\n");
    let mut images = String::from("# number, qw qx qy qz, x y z, camera, name; places of points in it\n");
    let mut files = Vec::new();
    let stems = stems(frames.iter().map(|frame| frame.name.as_str()));
    for ((number, frame), stem) in (1..).zip(frames).zip(stems) {
        let (model, parameters) = frame.camera.to_colmap();
        let (width, height) = (frame.camera.width, frame.camera.height);
        // A string takes whatever is written to it.
        let _written = writeln!(cameras, "{number} {model} {width} {height} {}", listed(&parameters));
        let name = format!("{stem}.png");
        let pose = listed(&camera_from(&frame.scan_from_camera, origin));
        let _written = writeln!(images, "{number} {pose} {number} {name}\n");
        let packed = if frame.mask.iter().all(|inside| *inside) {
            pack_picture(PixelEncoding::Rgb8, width, height, frame.rgb.as_flattened())
        } else {
            let pixels = frame.rgb.iter().zip(&frame.mask);
            let rgba: Vec<[u8; 4]> = pixels.map(|([r, g, b], inside)| [*r, *g, *b, 255 * u8::from(*inside)]).collect();
            pack_with_alpha(width, height, rgba.as_flattened())
        };
        files.extend(packed.ok().map(|bytes| (format!("dataset/images/{name}").into(), bytes)));
    }
    let model = [("cameras", cameras), ("images", images), ("points3D", points(&splats))];
    files.extend(model.map(|(name, text)| (format!("dataset/sparse/0/{name}.txt").into(), text.into_bytes())));
    files.push(("dataset/init.ply".into(), splats.ply()));
    files
}

/// Quaternion and shift of the points' way into a camera.
fn camera_from(scan_from_camera: &Isometry3<f64>, origin: &Point3<f64>) -> [f64; 7] {
    let mut moved = *scan_from_camera;
    moved.translation.vector -= origin.coords;
    let camera = moved.inverse();
    let (turn, shift) = (camera.rotation.coords, camera.translation.vector);
    [turn.w, turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]
}

/// The splats' centres, for trainers that begin with points.
fn points(splats: &SplatCloud) -> String {
    let mut text = String::from("# number, x y z, red green blue, error; views that show it\n");
    for (number, splat) in splats.splats.iter().enumerate() {
        let place = splat.centre.coords.map(f64::from);
        let [red, green, blue] = splats.colour(number).map(|c| (255.0 * c.clamp(0.0, 1.0)).round());
        let _written = writeln!(text, "{} {} {red} {green} {blue} 0", number + 1, listed(place.as_slice()));
    }
    text
}

fn listed(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
}
