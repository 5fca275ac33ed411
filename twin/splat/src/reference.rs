//! The picture of splats and meshes together, in double precision on all cores: what the renderer must show, and what
//! serves where there is no graphics device.
//!
//! Splats are blended front to back in the order of their centres; a mesh is opaque and ends the light that reaches it.

use super::cloud::SplatCloud;
use super::lens::Lens;
use super::mesh::Mesh;
use super::project::{FAINTEST, Projected, View, project_from};
use super::raster::Raster;
use super::straight::Straight;
use nalgebra::{Isometry3, Vector3};
use rayon::prelude::*;

/// What a body looks like.
#[derive(Debug, Clone, Copy)]
pub enum Shape<'a> {
    /// Splats.
    Splats(&'a SplatCloud),
    /// A closed mesh of one colour.
    Mesh(&'a Mesh),
}

/// A body, where it is, and its number in the picture.
#[derive(Debug, Clone, Copy)]
pub struct Body<'a> {
    /// What it looks like.
    pub shape: Shape<'a>,
    /// Its frame in the camera's.
    pub camera_from_body: Isometry3<f64>,
    /// Its number, not 0.
    pub instance: u32,
}

/// What is around the bodies.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surroundings {
    /// What lies behind all: red, green, blue, 0 to 1.
    pub background: [f64; 3],
    /// Towards the light that meshes are shaded by, camera frame; splats carry their own.
    pub light: Vector3<f64>,
}

/// What the camera sees, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Columns and rows.
    pub size: [usize; 2],
    /// Red, green, blue, 0 to 1.
    pub color: Vec<[f32; 3]>,
    /// Distance along the optical axis [m]: the mean of what keeps light back, by how much it does; 0 where nothing is.
    pub depth: Vec<f32>,
    /// The body behind which less than half of the light is left; 0 where more than half passes all.
    pub instance: Vec<u32>,
    /// Share of light that bodies keep back.
    pub cover: Vec<f32>,
}

impl Picture {
    /// Red, green and blue of every pixel, one byte each, row by row.
    pub fn rgb8(&self) -> impl Iterator<Item = [u8; 3]> + '_ {
        self.color.iter().map(|color| color.map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8))
    }
}

/// Edge of a tile [pixel].
pub(super) const TILE: usize = 16;
/// No splat keeps back all light.
pub(super) const MAX_ALPHA: f64 = 0.99;
/// Light of which less is left does not change a picture any more.
pub(super) const SPENT: f64 = 1e-4;

struct Drawn {
    splat: Projected,
    instance: u32,
}

/// Draws bodies once; [`Canvas`] is for the same view again and again.
///
/// One red splat, a metre before the camera:
///
/// ```
/// use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
/// use splat::{Body, Distortion, Lens, Shape, Splat, SplatCloud, Surroundings, render};
///
/// let splat = Splat {
///     centre: Point3::new(0.0, 0.0, 1.0), // m; z forward, x right, y down
///     rotation: UnitQuaternion::identity(),
///     sigma: Vector3::repeat(0.05), // m
///     opacity: 0.9,
/// };
/// // A colour is 0.5 + 0.2821 h for the first harmonic h.
/// let cloud = SplatCloud { splats: vec![splat], degree: 0, harmonics: vec![[1.77, -1.77, -1.77]] };
/// let body = Body { shape: Shape::Splats(&cloud), camera_from_body: Isometry3::identity(), instance: 1 };
/// let lens = Lens { focal: [40.0; 2], centre: [15.5; 2], distortion: Distortion::NONE }; // pixels
/// let around = Surroundings { background: [0.0; 3], light: -Vector3::z() };
/// let picture = render(&[body], &lens, [32, 32], &around);
///
/// let middle = 16 * 32 + 16; // row by row
/// assert!(picture.color[middle][0] > 0.7 && picture.color[middle][1] < 0.05);
/// assert!((picture.depth[middle] - 1.0).abs() < 1e-3); // m along the optical axis
/// assert_eq!((picture.instance[middle], picture.instance[0]), (1, 0));
/// ```
pub fn render(bodies: &[Body<'_>], lens: &Lens, size: [usize; 2], around: &Surroundings) -> Picture {
    Canvas::new(*lens, size).render(bodies, around)
}

/// What stays the same from picture to picture: the lens, and what its bending makes of each pixel.
#[derive(Debug, Clone)]
pub struct Canvas {
    lens: Lens,
    size: [usize; 2],
    straight: Straight,
}

impl Canvas {
    /// For pictures of so many columns and rows.
    pub fn new(lens: Lens, size: [usize; 2]) -> Self {
        Self { lens, size, straight: Straight::new(&lens, size) }
    }

    /// Draws bodies.
    pub fn render(&self, bodies: &[Body<'_>], around: &Surroundings) -> Picture {
        let size = self.size;
        let (drawn, lists) = self.front_to_back(bodies);
        let solid = Solid::draw(bodies, &self.straight, &around.light);
        let pixels = size[0] * size[1];
        let mut picture = Picture {
            size,
            color: vec![[0.0; 3]; pixels],
            depth: vec![0.0; pixels],
            instance: vec![0; pixels],
            cover: vec![0.0; pixels],
        };
        let across = size[0].div_ceil(TILE).max(1);
        let band = (TILE * size[0]).max(1);
        (picture.color.par_chunks_mut(band))
            .zip(picture.depth.par_chunks_mut(band))
            .zip(picture.instance.par_chunks_mut(band).zip(picture.cover.par_chunks_mut(band)))
            .zip(lists.par_chunks(across))
            .enumerate()
            .for_each(|(row, (((color, depth), (instance, cover)), lists))| {
                for (column, list) in lists.iter().enumerate() {
                    let mut tile = Tile::new([column * TILE, row * TILE], size, &solid);
                    tile.blend(list.iter().map(|number| &drawn[*number as usize]));
                    for (at, light) in tile.finish() {
                        let at = at - row * band;
                        let left = light.left;
                        color[at] = [0, 1, 2].map(|c| (light.color[c] + left * around.background[c]) as f32);
                        cover[at] = (1.0 - left) as f32;
                        depth[at] = if left < 1.0 { (light.depth / (1.0 - left)) as f32 } else { 0.0 };
                        instance[at] = light.instance;
                    }
                }
            });
        picture
    }

    /// The splats that are seen, nearest first, and for each tile the numbers of those that reach it.
    fn front_to_back(&self, bodies: &[Body<'_>]) -> (Vec<Drawn>, Vec<Vec<u32>>) {
        let mut drawn: Vec<Drawn> = Vec::new();
        for body in bodies {
            if let Shape::Splats(cloud) = body.shape {
                let view = View::new(&body.camera_from_body, &self.lens, self.size);
                let one = |number| {
                    let splat = project_from(cloud, number, &view)?;
                    Some(Drawn { splat, instance: body.instance })
                };
                drawn.par_extend((0..cloud.splats.len()).into_par_iter().filter_map(one));
            }
        }
        // Splats at one depth keep the order of their bodies and files.
        let mut order: Vec<(f64, u32)> = drawn.iter().zip(0..).map(|(drawn, n)| (drawn.splat.depth, n)).collect();
        order.par_sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        let tiles = self.size.map(|pixels| pixels.div_ceil(TILE));
        let mut lists: Vec<Vec<u32>> = vec![Vec::new(); tiles[0] * tiles[1]];
        for (_, number) in order {
            let splat = &drawn[number as usize].splat;
            let range = |i: usize| {
                let tile = |at: f64| (at.max(0.0) as usize / TILE).min(tiles[i] - 1);
                tile(splat.centre[i] - splat.reach[i])..=tile(splat.centre[i] + splat.reach[i])
            };
            for y in range(1) {
                range(0).for_each(|x| lists[y * tiles[0] + x].push(number));
            }
        }
        (drawn, lists)
    }
}

/// What has been gathered at a pixel, front to back.
#[derive(Clone, Copy)]
struct Light {
    color: [f64; 3],
    depth: f64,
    instance: u32,
    /// What is left of the light behind.
    left: f64,
    /// Where a mesh ends it [m].
    end: f64,
}

impl Light {
    fn add(&mut self, alpha: f64, color: &[f64; 3], depth: f64, instance: u32) {
        let weight = self.left * alpha;
        (0..3).for_each(|c| self.color[c] += weight * color[c]);
        self.depth += weight * depth;
        self.left -= weight;
        if self.instance == 0 && self.left < 0.5 {
            self.instance = instance;
        }
    }
}

/// A square of pixels, blended at once.
struct Tile<'a> {
    first: [usize; 2],
    /// Columns and rows that lie in the picture.
    size: [usize; 2],
    width: usize,
    solid: &'a Solid<'a>,
    lights: [Light; TILE * TILE],
}

impl<'a> Tile<'a> {
    fn new(first: [usize; 2], picture: [usize; 2], solid: &'a Solid<'a>) -> Self {
        let dark = Light { color: [0.0; 3], depth: 0.0, instance: 0, left: 1.0, end: f64::INFINITY };
        let size = [0, 1].map(|i| TILE.min(picture[i] - first[i]));
        let mut tile = Self { first, size, width: picture[0], solid, lights: [dark; TILE * TILE] };
        for row in 0..size[1] {
            for column in 0..size[0] {
                let at = (first[1] + row) * picture[0] + first[0] + column;
                tile.lights[row * TILE + column].end = solid.end(at);
            }
        }
        tile
    }

    /// Lets splats keep back light, nearest first; each is asked only where it reaches.
    fn blend<'b>(&mut self, splats: impl Iterator<Item = &'b Drawn>) {
        let mut open = self.size[0] * self.size[1];
        for Drawn { splat, instance } in splats {
            if open == 0 {
                break;
            }
            let range = |i: usize| {
                let at = splat.centre[i] - self.first[i] as f64;
                let from = (at - splat.reach[i]).ceil().max(0.0) as usize;
                from..((at + splat.reach[i]).floor() + 1.0).clamp(0.0, self.size[i] as f64) as usize
            };
            let (rows, columns) = (range(1), range(0));
            // Below this the bell is lower than what counts; a hair is left for rounding.
            let lowest = (FAINTEST / splat.opacity).ln() - 1e-9;
            for row in rows {
                for column in columns.clone() {
                    let light = &mut self.lights[row * TILE + column];
                    if splat.depth >= light.end || light.left < SPENT {
                        continue;
                    }
                    let exponent = splat.exponent((self.first[0] + column) as f64, (self.first[1] + row) as f64);
                    if exponent < lowest {
                        continue;
                    }
                    let alpha = (splat.opacity * exponent.exp()).min(MAX_ALPHA);
                    if alpha >= FAINTEST {
                        light.add(alpha, &splat.color, splat.depth, *instance);
                        open -= usize::from(light.left < SPENT);
                    }
                }
            }
        }
    }

    /// Every pixel's number and its light, the meshes' included.
    fn finish(self) -> impl Iterator<Item = (usize, Light)> {
        let Self { first, size, width, solid, mut lights } = self;
        (0..size[1]).flat_map(move |row| {
            (0..size[0]).map(move |column| {
                let at = (first[1] + row) * width + first[0] + column;
                let light = &mut lights[row * TILE + column];
                if light.end.is_finite() {
                    let (color, instance) = solid.look(at);
                    light.add(1.0, &color, light.end, instance);
                }
                (at, *light)
            })
        })
    }
}

/// The meshes, drawn by a pinhole and looked up through the lens.
struct Solid<'a> {
    straight: &'a Straight,
    raster: Option<Raster>,
    owners: Vec<u32>,
}

impl<'a> Solid<'a> {
    fn draw(bodies: &[Body<'_>], straight: &'a Straight, light: &Vector3<f64>) -> Self {
        let meshes: Vec<(&Mesh, &Body<'_>)> = (bodies.iter())
            .filter_map(|body| if let Shape::Mesh(mesh) = body.shape { Some((mesh, body)) } else { None })
            .collect();
        if meshes.is_empty() {
            return Self { straight, raster: None, owners: Vec::new() };
        }
        let [width, height] = straight.size;
        let mut raster = Raster::new(width, height, straight.pinhole, light.cast::<f32>());
        raster.clear([0; 3]);
        let mut owners = vec![0; width * height];
        let mut before = vec![0.0f32; width * height];
        for (mesh, body) in meshes {
            let rows = raster.draw(mesh, &body.camera_from_body.cast::<f32>());
            let touched = rows.start * width..rows.end * width;
            let here = &raster.inverse_depth()[touched.clone()];
            for ((owner, known), here) in owners[touched.clone()].iter_mut().zip(&mut before[touched]).zip(here) {
                if here > known {
                    (*owner, *known) = (body.instance, *here);
                }
            }
        }
        Self { straight, raster: Some(raster), owners }
    }

    /// How far a mesh is at a pixel [m]; infinite where there is none.
    fn end(&self, pixel: usize) -> f64 {
        let Some(raster) = &self.raster else { return f64::INFINITY };
        self.straight.at(pixel).map_or(f64::INFINITY, |at| 1.0 / f64::from(raster.inverse_depth()[at]))
    }

    /// Colour and number of the mesh at a pixel.
    fn look(&self, pixel: usize) -> ([f64; 3], u32) {
        let (Some(raster), Some(at)) = (&self.raster, self.straight.at(pixel)) else { return ([0.0; 3], 0) };
        let [r, g, b, _] = raster.color()[at].to_le_bytes();
        ([r, g, b].map(|v| f64::from(v) / 255.0), self.owners[at])
    }
}
