//! A z-buffer: nearest surface and its colour for every pixel. One triangle is one plane, so `1/z` is linear in the
//! picture and a row of pixels is a straight run that the compiler turns into vector code. Allocates when made, and for
//! the first mesh that is larger than all before.

use super::mesh::Mesh;
use nalgebra::{Isometry3, Point3, Vector3};
use std::ops::Range;

/// Where a point of the camera frame lands [pixel].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pinhole {
    /// Focal length along a row.
    pub fx: f32,
    /// Focal length along a column.
    pub fy: f32,
    /// Principal point, column.
    pub cx: f32,
    /// Principal point, row.
    pub cy: f32,
}

/// Colour and depth of one picture.
#[derive(Debug, Clone)]
pub struct Raster {
    width: usize,
    height: usize,
    pinhole: Pinhole,
    /// Unit vector towards the light, camera frame.
    light: Vector3<f32>,
    /// 1/z of the nearest surface [1/m]; 0 where there is none.
    inverse_depth: Vec<f32>,
    /// Its colour, 0x00BBGGRR.
    color: Vec<u32>,
    corners: Vec<Point3<f32>>,
    /// Rows of the body that is being drawn.
    touched: Range<usize>,
}

/// Nearer surfaces are cut away [m].
const NEAREST: f32 = 0.05;
/// Share of light in full shadow.
const AMBIENT: f32 = 0.45;

impl Raster {
    /// An empty picture; `light` points towards the light, camera frame.
    pub fn new(width: usize, height: usize, pinhole: Pinhole, light: Vector3<f32>) -> Self {
        let pixels = width * height;
        Self {
            width,
            height,
            pinhole,
            light: light.normalize(),
            inverse_depth: vec![0.0; pixels],
            color: vec![0; pixels],
            corners: Vec::with_capacity(1024),
            touched: 0..0,
        }
    }

    /// Lights what is drawn from now on from elsewhere: a direction towards the light, camera frame.
    pub fn light_from(&mut self, light: Vector3<f32>) {
        self.light = light.normalize();
    }

    /// Empties the picture; `background` is the colour where nothing is drawn.
    pub fn clear(&mut self, background: [u8; 3]) {
        self.inverse_depth.fill(0.0);
        self.color.fill(packed(background));
    }

    /// `1/z` of the nearest surface for every pixel, row by row [1/m]; 0 where there is none.
    pub fn inverse_depth(&self) -> &[f32] {
        &self.inverse_depth
    }

    /// Colour of every pixel, row by row, as 0x00BBGGRR.
    pub fn color(&self) -> &[u32] {
        &self.color
    }

    /// Draws a closed body; its far sides are left out. Answers with the rows outside of which nothing has changed.
    pub fn draw(&mut self, mesh: &Mesh, camera_from_body: &Isometry3<f32>) -> Range<usize> {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        corners.extend(mesh.points.iter().map(|p| camera_from_body * p));
        self.touched = self.height..0;
        for triangle in &mesh.triangles {
            self.triangle(triangle.map(|i| corners[i as usize]), mesh.color);
        }
        self.corners = corners;
        self.touched.start.min(self.touched.end)..self.touched.end
    }

    fn triangle(&mut self, [a, b, c]: [Point3<f32>; 3], color: [u8; 3]) {
        let normal = (b - a).cross(&(c - a));
        let distance = normal.dot(&a.coords);
        // Seen from behind when the camera (the origin) lies on the inner side of the plane.
        if distance >= -1e-12 {
            return;
        }
        let color = packed(shaded(color, normal.dot(&self.light) / normal.norm().max(1e-20)));
        // On the plane normal . P = distance, so 1/z = normal . ray / distance with ray = ((u - cx)/fx, (v - cy)/fy, 1).
        let Pinhole { fx, fy, cx, cy } = self.pinhole;
        let n = normal / distance;
        let (du, dv) = (n.x / fx, n.y / fy);
        let plane = Plane { du, dv, at_origin: n.z - du * cx - dv * cy };
        let (polygon, count) = clip_near([a, b, c]);
        for i in 2..count {
            let [a, b, c] =
                [polygon[0], polygon[i - 1], polygon[i]].map(|p| (fx * p.x / p.z + cx, fy * p.y / p.z + cy));
            self.fill([a, b, c], &plane, color);
        }
    }

    /// Fills the pixels whose centre lies inside. Left borders belong to a triangle, right ones to its neighbour.
    fn fill(&mut self, mut corners: [(f32, f32); 3], plane: &Plane, color: u32) {
        corners.sort_by(|a, b| a.1.total_cmp(&b.1));
        let [top, middle, bottom] = corners;
        let first = top.1.ceil().max(0.0) as usize;
        let end = (bottom.1.ceil().max(0.0) as usize).min(self.height);
        self.touched = self.touched.start.min(first)..self.touched.end.max(end);
        let slope = |a: (f32, f32), b: (f32, f32)| if b.1 > a.1 { (b.0 - a.0) / (b.1 - a.1) } else { 0.0 };
        let (long, upper, lower) = (slope(top, bottom), slope(top, middle), slope(middle, bottom));
        for row in first..end {
            let y = row as f32;
            let on_long = top.0 + (y - top.1) * long;
            let on_short = if y < middle.1 { top.0 + (y - top.1) * upper } else { middle.0 + (y - middle.1) * lower };
            let (left, right) = if on_long < on_short { (on_long, on_short) } else { (on_short, on_long) };
            let from = (left.ceil().max(0.0) as usize).min(self.width);
            let to = (right.ceil().max(0.0) as usize).min(self.width);
            if from < to {
                let start = plane.at_origin + plane.dv * y + plane.du * from as f32;
                let row = row * self.width;
                run(
                    &mut self.inverse_depth[row + from..row + to],
                    &mut self.color[row + from..row + to],
                    start,
                    plane.du,
                    color,
                );
            }
        }
    }
}

/// `1/z` as a linear function of the pixel.
struct Plane {
    du: f32,
    dv: f32,
    at_origin: f32,
}

/// One row of one triangle.
#[inline]
fn run(inverse_depth: &mut [f32], colors: &mut [u32], start: f32, step: f32, color: u32) {
    for (i, (depth, pixel)) in inverse_depth.iter_mut().zip(colors).enumerate() {
        let here = start + step * (i as i32) as f32;
        let nearer = here > *depth;
        *depth = if nearer { here } else { *depth };
        *pixel = if nearer { color } else { *pixel };
    }
}

/// The part of a triangle beyond [`NEAREST`]: up to four corners, and how many.
fn clip_near(triangle: [Point3<f32>; 3]) -> ([Point3<f32>; 4], usize) {
    let mut polygon = [Point3::origin(); 4];
    let mut count = 0;
    for i in 0..3 {
        let (a, b) = (triangle[i], triangle[(i + 1) % 3]);
        if a.z >= NEAREST {
            polygon[count] = a;
            count += 1;
        }
        if (a.z >= NEAREST) != (b.z >= NEAREST) {
            polygon[count] = a + (b - a) * ((NEAREST - a.z) / (b.z - a.z));
            count += 1;
        }
    }
    (polygon, count)
}

/// `facing` is the cosine between the surface's normal and the light.
fn shaded(color: [u8; 3], facing: f32) -> [u8; 3] {
    let light = AMBIENT + (1.0 - AMBIENT) * facing.max(0.0);
    color.map(|c| (f32::from(c) * light).min(255.0) as u8)
}

fn packed([r, g, b]: [u8; 3]) -> u32 {
    u32::from(r) | u32::from(g) << 8 | u32::from(b) << 16
}

#[cfg(test)]
mod tests {
    use super::*;

    const PINHOLE: Pinhole = Pinhole { fx: 100.0, fy: 100.0, cx: 31.5, cy: 23.5 };

    /// A plate facing the camera, `z` metres away.
    fn plate(raster: &mut Raster, z: f32, half: f32, color: [u8; 3]) {
        let camera_from_plate = Isometry3::from_parts(
            Vector3::new(0.0, 0.0, z).into(),
            nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f32::consts::PI),
        );
        raster.draw(&Mesh::plate([0.0; 3], [half; 2], color), &camera_from_plate);
    }

    #[test]
    fn the_nearer_surface_wins_whatever_is_drawn_first() {
        for nearer_first in [true, false] {
            let mut raster = Raster::new(64, 48, PINHOLE, -Vector3::z());
            raster.clear([0; 3]);
            let mut draws = [(1.0, 0.1), (2.0, 2.0)];
            if !nearer_first {
                draws.reverse();
            }
            for (z, half) in draws {
                plate(&mut raster, z, half, [200; 3]);
            }
            let at = |x: usize, y: usize| raster.inverse_depth()[y * 64 + x];
            assert!((at(31, 23) - 1.0).abs() < 1e-6, "{}", at(31, 23));
            assert!((at(5, 5) - 0.5).abs() < 1e-6, "{}", at(5, 5));
        }
    }

    #[test]
    fn two_triangles_share_an_edge_without_gap_or_overlap() {
        let mut raster = Raster::new(64, 48, PINHOLE, -Vector3::z());
        raster.clear([0; 3]);
        plate(&mut raster, 1.0, 0.1, [200; 3]);
        // 0.1 m at 1 m are 10 pixels: centres from 21.5 to 41.5, so 20 columns and rows are covered.
        let covered = raster.inverse_depth().iter().filter(|d| **d > 0.0).count();
        assert_eq!(covered, 400);
    }

    #[test]
    fn a_surface_that_passes_the_camera_is_cut_and_not_smeared() {
        let mut raster = Raster::new(64, 48, PINHOLE, -Vector3::z());
        raster.clear([0; 3]);
        // A floor 1 m below that begins 5 m behind the camera.
        let floor = Mesh::plate([0.0, 0.0, 0.0], [5.0, 5.0], [200; 3]);
        let camera_from_floor = Isometry3::from_parts(
            Vector3::new(0.0, 1.0, 0.0).into(),
            nalgebra::UnitQuaternion::from_axis_angle(&Vector3::x_axis(), std::f32::consts::FRAC_PI_2),
        );
        raster.draw(&floor, &camera_from_floor);
        let at = |x: usize, y: usize| raster.inverse_depth()[y * 64 + x];
        assert_eq!(at(31, 10), 0.0, "above the horizon");
        // Row 47 looks down by (47 - 23.5) / 100, so it meets the floor at 1 / 0.235 m.
        assert!((at(31, 47) - 0.235).abs() < 1e-5, "{}", at(31, 47));
    }
}
