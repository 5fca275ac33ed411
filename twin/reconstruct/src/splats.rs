//! Splats of a scan: photographs as they are trained on, the picture of a cloud, and how near it comes.

use crate::scan::{Camera, Frame};
use nalgebra::{Isometry3, Vector3};
use shared_mem::ending;
use shared_mem::progress::Progress;
use splat::{
    Body, COLOR_PLANE, Lens, Mesh, Parameters, Photograph, Picture, Settings, Shape, SplatCloud, Surroundings, Target,
    TrainError, train,
};
use std::ops::ControlFlow;

/// Room that is left around a mask [pixel]: more than the window of the similarity reaches.
const ROOM: usize = 12;

/// A camera as splats are drawn with: the middle of its first pixel is (0, 0).
fn lens(camera: &Camera) -> Lens {
    Lens { focal: camera.focal, centre: camera.centre.map(|c| c - 0.5), distortion: camera.lens }
}

/// A view from a pose (scan from camera), for the splats of what its mask shows: the part of the picture around the mask.
pub(crate) fn of_object(frame: &Frame, scan_from_camera: &Isometry3<f64>) -> Photograph {
    let (width, height) = (frame.camera.width as usize, frame.camera.height as usize);
    let (mut low, mut high) = ([width, height], [0, 0]);
    for at in (0..frame.mask.len()).filter(|at| frame.mask[*at]) {
        let pixel = [at % width, at / width];
        (0..2).for_each(|i| (low[i], high[i]) = (low[i].min(pixel[i]), high[i].max(pixel[i] + 1)));
    }
    let low = [0, 1].map(|i| low[i].min(high[i]).saturating_sub(ROOM));
    let high = [(high[0] + ROOM).min(width), (high[1] + ROOM).min(height)];
    let cut = || (low[1]..high[1]).flat_map(|y| (low[0]..high[0]).map(move |x| y * width + x));
    let mut lens = lens(&frame.camera);
    (0..2).for_each(|i| lens.centre[i] -= low[i] as f64);
    Photograph {
        camera: splat::Camera { lens, camera_from_world: scan_from_camera.inverse() },
        size: [high[0] - low[0], high[1] - low[1]],
        rgb: cut().map(|at| frame.rgb[at]).collect(),
        mask: Some(cut().map(|at| if frame.mask[at] { u8::MAX } else { 0 }).collect()),
        depth: (!frame.depth.is_empty()).then(|| cut().map(|at| frame.depth[at]).collect()),
    }
}

/// The camera of a view, and its columns and rows.
pub(crate) fn camera(frame: &Frame) -> (splat::Camera, [usize; 2]) {
    let camera = splat::Camera { lens: lens(&frame.camera), camera_from_world: frame.scan_from_camera.inverse() };
    (camera, [frame.camera.width as usize, frame.camera.height as usize])
}

/// A view for the splats of all that it shows.
pub(crate) fn of_scene(frame: &Frame) -> Photograph {
    let (camera, size) = camera(frame);
    Photograph {
        camera,
        size,
        rgb: frame.rgb.clone(),
        mask: None,
        depth: (!frame.depth.is_empty()).then(|| frame.depth.clone()),
    }
}

/// What lies behind a scene: the mean colour of pixels without depth, 0 to 1; black where all have one.
pub(crate) fn behind(photographs: &[Photograph]) -> [f32; 3] {
    let (mut sum, mut count) = ([0.0; 3], 0usize);
    for photograph in photographs {
        for (rgb, z) in photograph.rgb.iter().zip(photograph.depth.iter().flatten()) {
            if *z <= 0.0 {
                (0..3).for_each(|c| sum[c] += f64::from(rgb[c]) / 255.0);
                count += 1;
            }
        }
    }
    sum.map(|sum| (sum / count.max(1) as f64) as f32)
}

/// Trains splats, as a stage of a bar; ends once the end was asked for.
pub(crate) fn trained(
    (bar, stage): (&Progress, &'static str),
    start: &SplatCloud,
    photographs: &[Photograph],
    settings: &Settings,
) -> Result<SplatCloud, TrainError> {
    bar.stage(stage, settings.steps as u64);
    train(start, photographs, settings, |progress| {
        bar.show(progress.step as u64, stage);
        if ending::asked() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    })
}

/// A cloud as a camera of the scan sees it, over a background.
pub(crate) fn draw(
    cloud: &SplatCloud,
    camera: &Camera,
    scan_from_camera: &Isometry3<f64>,
    background: [f32; 3],
) -> Picture {
    draw_shape(Shape::Splats(cloud), camera, scan_from_camera, background.map(f64::from))
}

/// Depth [m] of a cloud whose splats are flat: where rays meet their planes; 0 where it keeps back less than half of the light.
pub(crate) fn plane_depth(cloud: &SplatCloud, camera: &Camera, scan_from_camera: &Isometry3<f64>) -> Vec<f32> {
    let (lens, size) = (lens(camera), [camera.width as usize, camera.height as usize]);
    let splats = Parameters::<f32>::of(cloud);
    let frame = splat::Frame::<f32, COLOR_PLANE>::new(&splats, &scan_from_camera.inverse(), &lens, size);
    let planes = frame.planes();
    let cover: Vec<f32> = planes.left.iter().map(|left| 1.0 - left).collect();
    planes.depth(&cover, &Target::rays(&lens, size))
}

/// A mesh as a camera of the scan sees it, lit from there, over black.
pub(crate) fn draw_mesh(mesh: &Mesh, camera: &Camera, scan_from_camera: &Isometry3<f64>) -> Picture {
    draw_shape(Shape::Mesh(mesh), camera, scan_from_camera, [0.0; 3])
}

fn draw_shape(shape: Shape<'_>, camera: &Camera, scan_from_camera: &Isometry3<f64>, background: [f64; 3]) -> Picture {
    let body = Body { shape, camera_from_body: scan_from_camera.inverse(), instance: 1 };
    let around = Surroundings { background, light: -Vector3::z() };
    splat::render(&[body], &lens(camera), [camera.width as usize, camera.height as usize], &around)
}

/// Peak signal-to-noise ratio over the pixels that count [dB]; at most 78.
pub(crate) fn psnr(wanted: &[[u8; 3]], drawn: &[[u8; 3]], counts: impl Fn(usize) -> bool) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for at in (0..wanted.len()).filter(|at| counts(*at)) {
        let off = |c: usize| f64::from(wanted[at][c].abs_diff(drawn[at][c]));
        sum += (0..3).map(|c| off(c) * off(c)).sum::<f64>();
        count += 3;
    }
    let mean = (sum / count.max(1) as f64).max(1e-3);
    10.0 * (255.0 * 255.0 / mean).log10()
}
