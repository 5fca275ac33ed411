//! Pictures of a robot, and of what stands around it, that fill their frame: for pages.

use super::{Mesh, Pinhole, Raster, RobotSurface, looks};
use crate::arm::Joints;
use nalgebra::{Isometry3, Matrix3, Point3, Rotation3, Translation3, UnitQuaternion, Vector3};

/// From where it is looked at, base frame: its front, its right and a little above.
const FROM: [f64; 3] = [1.0, -0.9, 0.35];
/// How far away the eye is, in radii of the robot: near and far links look alike from there.
const AWAY: f64 = 6.0;
/// Left free at each edge [pixel].
const MARGIN: f64 = 6.0;
/// A pixel is the mean of so many squared: edges are smooth.
const FINER: usize = 2;

/// A robot in a picture of `width` x `height` pixels that it fills, at joint positions `q` [rad]; red, green and blue, row by row.
/// `colour`: that of each link by its number as in [`RobotSurface::links`]; `None` leaves a part its own.
pub fn portrait(
    surface: &RobotSurface,
    q: &Joints,
    size: [usize; 2],
    background: [u8; 3],
    colour: impl Fn(usize) -> Option<[u8; 3]>,
) -> Vec<u8> {
    let look = Framing::of(&points_of(surface, q)).look(size);
    let mut raster = look.raster(background);
    look.draw_robot(&mut raster, surface, q, colour);
    look.pixels(&raster)
}

/// Corners of a robot at joint positions `q` [rad], base frame.
pub(crate) fn points_of(surface: &RobotSurface, q: &Joints) -> Vec<Point3<f64>> {
    let mut points = Vec::new();
    surface.for_each(q, |part, base_from_part| {
        points.extend(surface.parts()[part].points.iter().map(|point| base_from_part * point.cast::<f64>()));
    });
    points
}

/// From where things are looked at, and how far they reach there: whatever the size of the picture.
#[derive(Clone, Copy)]
pub(crate) struct Framing {
    camera_from_base: Isometry3<f64>,
    /// Of all points on the plane at 1 m from the eye: least and largest to the right and downwards.
    spans: [[f64; 2]; 2],
}

impl Framing {
    /// One in which all these points are seen.
    pub(crate) fn of(points: &[Point3<f64>]) -> Self {
        let camera_from_base = eye(points).inverse();
        let mut spans = [[f64::INFINITY, f64::NEG_INFINITY]; 2];
        for seen in points.iter().map(|point| camera_from_base * point) {
            for ([low, high], x) in spans.iter_mut().zip([seen.x / seen.z, seen.y / seen.z]) {
                (*low, *high) = (low.min(x), high.max(x));
            }
        }
        Self { camera_from_base, spans }
    }

    /// The lens through which they fill a picture of `width` x `height` pixels.
    pub(crate) fn look(&self, size: [usize; 2]) -> Look {
        let pinhole = filling(self.spans, size.map(|n| n * FINER));
        Look { camera_from_base: self.camera_from_base, pinhole, size }
    }
}

/// From where, and through which lens, things fill a picture.
pub(crate) struct Look {
    camera_from_base: Isometry3<f64>,
    pinhole: Pinhole,
    size: [usize; 2],
}

impl Look {
    /// An empty picture.
    pub(crate) fn raster(&self, background: [u8; 3]) -> Raster {
        let [wide, high] = self.size.map(|pixels| pixels * FINER);
        let light = (self.camera_from_base.rotation * Vector3::from(looks::LIGHT)).cast::<f32>();
        let mut raster = Raster::new(wide, high, self.pinhole, light);
        raster.clear(background);
        raster
    }

    /// Draws a body where it is in the base frame.
    pub(crate) fn draw(&self, raster: &mut Raster, mesh: &Mesh, base_from_body: &Isometry3<f64>) {
        raster.draw(mesh, &(self.camera_from_base * base_from_body).cast());
    }

    /// Draws a robot, its links in the colours that `colour` gives them.
    pub(crate) fn draw_robot(
        &self,
        raster: &mut Raster,
        surface: &RobotSurface,
        q: &Joints,
        colour: impl Fn(usize) -> Option<[u8; 3]>,
    ) {
        let links = surface.links();
        surface.for_each(q, |part, base_from_part| {
            let mut mesh = surface.parts()[part].clone();
            mesh.color = colour(links[part]).unwrap_or(mesh.color);
            self.draw(raster, &mesh, &base_from_part);
        });
    }

    /// Red, green and blue of the picture, row by row: of each square of finer pixels the mean.
    pub(crate) fn pixels(&self, raster: &Raster) -> Vec<u8> {
        coarser(raster.color(), self.size)
    }
}

/// Base from camera: looking at the middle of all points.
fn eye(points: &[Point3<f64>]) -> Isometry3<f64> {
    let (low, high) = points.iter().fold(
        (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY)),
        |(low, high): (Vector3<f64>, Vector3<f64>), point| (low.inf(&point.coords), high.sup(&point.coords)),
    );
    let (middle, radius) = (0.5 * (low + high), 0.5 * (high - low).norm());
    let forward = -Vector3::from(FROM).normalize();
    let right = forward.cross(&Vector3::z()).normalize();
    let axes = Matrix3::from_columns(&[right, forward.cross(&right), forward]);
    let turn = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(axes));
    Isometry3::from_parts(Translation3::from(middle - AWAY * radius * forward), turn)
}

/// The pinhole through which what reaches so far on the plane at 1 m fills a picture.
fn filling([[left, right], [top, bottom]]: [[f64; 2]; 2], size: [usize; 2]) -> Pinhole {
    let room = |pixels: usize| (pixels as f64 - 2.0 * MARGIN * FINER as f64).max(1.0);
    let focal = (room(size[0]) / (right - left)).min(room(size[1]) / (bottom - top));
    let middle = |pixels: usize, mean: f64| (0.5 * (pixels as f64 - 1.0) - focal * mean) as f32;
    let [cx, cy] = [middle(size[0], 0.5 * (left + right)), middle(size[1], 0.5 * (top + bottom))];
    Pinhole { fx: focal as f32, fy: focal as f32, cx, cy }
}

/// The mean of each square of pixels.
fn coarser(pixels: &[u32], [width, height]: [usize; 2]) -> Vec<u8> {
    let mut out = Vec::with_capacity(3 * width * height);
    for row in 0..height {
        for column in 0..width {
            let mut sum = [0_usize; 3];
            for y in 0..FINER {
                let first = (row * FINER + y) * width * FINER + column * FINER;
                for packed in &pixels[first..first + FINER] {
                    let [red, green, blue, _] = packed.to_le_bytes();
                    sum = [sum[0] + usize::from(red), sum[1] + usize::from(green), sum[2] + usize::from(blue)];
                }
            }
            out.extend(sum.map(|value| (value / (FINER * FINER)) as u8));
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Hand;
    use crate::shipped::shipped;

    #[test]
    fn the_robot_fills_the_picture_and_a_link_has_the_colour_that_it_is_given() {
        let surface = RobotSurface::new(&shipped(), Hand::None).expect("a robot");
        let (size, white) = ([120, 160], [255; 3]);
        let red = |link: usize| Some(if link == 4 { [255, 0, 0] } else { [128, 128, 128] });
        let picture = portrait(&surface, surface.model().ready(), size, white, red);
        assert_eq!(picture.len(), 3 * 120 * 160);
        let pixels: Vec<(usize, [u8; 3])> =
            picture.chunks_exact(3).map(|rgb| [rgb[0], rgb[1], rgb[2]]).enumerate().collect();
        let drawn = pixels.iter().filter(|(_, rgb)| *rgb != white);
        let (rows, columns): (Vec<usize>, Vec<usize>) = drawn.map(|(at, _)| (at / 120, at % 120)).unzip();
        let span = |of: &[usize]| of.iter().max().expect("drawn") - of.iter().min().expect("drawn");
        assert!(span(&rows) > 140 || span(&columns) > 100, "{} {}", span(&rows), span(&columns));
        assert!(span(&rows) < 160 && span(&columns) < 120);
        let reddish = pixels.iter().filter(|(_, [red, green, _])| *red > 90 && *green < 30).count();
        assert!((50..4000).contains(&reddish), "{reddish} pixels of link 4");
    }
}
