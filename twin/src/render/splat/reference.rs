//! The picture of splats and meshes together, in double precision on all cores: what the renderer must show, and what
//! serves where there is no graphics device.
//!
//! Splats are blended front to back in the order of their centres; a mesh is opaque and ends the light that reaches it.

use super::cloud::SplatCloud;
use super::lens::Lens;
use super::project::{FAINTEST, Projected, project};
use crate::render::{Mesh, Pinhole, Raster};
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

/// Edge of a tile [pixel].
const TILE: usize = 16;
/// No splat keeps back all light.
const MOST: f64 = 0.99;
/// Light of which less is left does not change a picture any more.
const SPENT: f64 = 1e-4;

struct Drawn {
    splat: Projected,
    instance: u32,
}

/// Draws bodies.
#[must_use]
pub fn render(bodies: &[Body<'_>], lens: &Lens, size: [usize; 2], around: &Surroundings) -> Picture {
    let mut drawn: Vec<Drawn> = Vec::new();
    for body in bodies {
        if let Shape::Splats(cloud) = body.shape {
            let one = |number| project(cloud, number, &body.camera_from_body, lens, size);
            let splats: Vec<Projected> = (0..cloud.splats.len()).into_par_iter().filter_map(one).collect();
            drawn.extend(splats.into_iter().map(|splat| Drawn { splat, instance: body.instance }));
        }
    }
    // Splats at one depth keep the order of their bodies and files.
    drawn.par_sort_by(|a, b| a.splat.depth.total_cmp(&b.splat.depth));
    let tiles = size.map(|pixels| pixels.div_ceil(TILE));
    let mut lists: Vec<Vec<u32>> = vec![Vec::new(); tiles[0] * tiles[1]];
    for (number, Drawn { splat, .. }) in drawn.iter().enumerate() {
        let range = |i: usize| {
            let tile = |at: f64| (at.max(0.0) as usize / TILE).min(tiles[i] - 1);
            tile(splat.centre[i] - splat.reach[i])..=tile(splat.centre[i] + splat.reach[i])
        };
        for y in range(1) {
            range(0).for_each(|x| lists[y * tiles[0] + x].push(number as u32));
        }
    }
    let solid = Solid::draw(bodies, lens, size, &around.light);
    let pixel = |i: usize| {
        let (x, y) = (i % size[0], i / size[0]);
        let list = &lists[y / TILE * tiles[0] + x / TILE];
        blend(list.iter().map(|n| &drawn[*n as usize]), [x as f64, y as f64], solid.at(i), around.background)
    };
    let pixels: Vec<Pixel> = (0..size[0] * size[1]).into_par_iter().map(pixel).collect();
    Picture {
        size,
        color: pixels.iter().map(|p| p.color.map(|c| c as f32)).collect(),
        depth: pixels.iter().map(|p| p.depth as f32).collect(),
        instance: pixels.iter().map(|p| p.instance).collect(),
        cover: pixels.iter().map(|p| p.cover as f32).collect(),
    }
}

struct Pixel {
    color: [f64; 3],
    depth: f64,
    instance: u32,
    cover: f64,
}

/// A mesh's surface at a pixel.
struct Surface {
    depth: f64,
    color: [f64; 3],
    instance: u32,
}

fn blend<'a>(
    splats: impl Iterator<Item = &'a Drawn>,
    [u, v]: [f64; 2],
    surface: Option<Surface>,
    background: [f64; 3],
) -> Pixel {
    let end = surface.as_ref().map_or(f64::INFINITY, |surface| surface.depth);
    let mut left = 1.0;
    let mut out = Pixel { color: [0.0; 3], depth: 0.0, instance: 0, cover: 0.0 };
    let mut add = |weight: f64, color: &[f64; 3], depth: f64, instance: u32, left: &mut f64| {
        (0..3).for_each(|c| out.color[c] += weight * color[c]);
        out.depth += weight * depth;
        *left -= weight;
        if out.instance == 0 && *left < 0.5 {
            out.instance = instance;
        }
    };
    for Drawn { splat, instance } in splats {
        if splat.depth >= end || left < SPENT {
            break;
        }
        let alpha = splat.alpha(u, v).min(MOST);
        if alpha >= FAINTEST {
            add(left * alpha, &splat.color, splat.depth, *instance, &mut left);
        }
    }
    if let Some(Surface { depth, color, instance }) = surface {
        add(left, &color, depth, instance, &mut left);
    }
    out.cover = 1.0 - left;
    (0..3).for_each(|c| out.color[c] += left * background[c]);
    if out.cover > 0.0 {
        out.depth /= out.cover;
    }
    out
}

/// The meshes, drawn by a pinhole and looked up through the lens.
struct Solid {
    raster: Option<Raster>,
    owners: Vec<u32>,
    /// For every pixel the pinhole's one.
    lookup: Vec<Option<usize>>,
}

impl Solid {
    fn draw(bodies: &[Body<'_>], lens: &Lens, size: [usize; 2], light: &Vector3<f64>) -> Self {
        let meshes: Vec<(&Mesh, &Body<'_>)> = (bodies.iter())
            .filter_map(|body| if let Shape::Mesh(mesh) = body.shape { Some((mesh, body)) } else { None })
            .collect();
        if meshes.is_empty() {
            return Self { raster: None, owners: Vec::new(), lookup: Vec::new() };
        }
        // A lens that bends sees a little more or less than its pinhole: that one's picture is made large enough.
        let margin = if lens.is_bent() { size.map(|pixels| pixels / 4) } else { [0, 0] };
        let [width, height] = [0, 1].map(|i| size[i] + 2 * margin[i]);
        let [cx, cy] = [0, 1].map(|i| (lens.centre[i] + margin[i] as f64) as f32);
        let pinhole = Pinhole { fx: lens.focal[0] as f32, fy: lens.focal[1] as f32, cx, cy };
        let mut raster = Raster::new(width, height, pinhole, light.cast::<f32>());
        raster.clear([0; 3]);
        let mut owners = vec![0; width * height];
        let mut before = vec![0.0f32; width * height];
        for (mesh, body) in meshes {
            raster.draw(mesh, &body.camera_from_body.cast::<f32>());
            for ((owner, known), here) in owners.iter_mut().zip(&mut before).zip(raster.inverse_depth()) {
                if here > known {
                    (*owner, *known) = (body.instance, *here);
                }
            }
        }
        let pixel = |i: usize| {
            let (x, y) = (i % size[0], i / size[0]);
            if !lens.is_bent() {
                return Some(i);
            }
            let ray = lens.ray([x as f64, y as f64]);
            let [u, v] = [ray.x * f64::from(pinhole.fx) + f64::from(cx), ray.y * f64::from(pinhole.fy) + f64::from(cy)]
                .map(f64::round);
            let inside = u >= 0.0 && v >= 0.0 && u < width as f64 && v < height as f64;
            inside.then(|| v as usize * width + u as usize)
        };
        let lookup = (0..size[0] * size[1]).into_par_iter().map(pixel).collect();
        Self { raster: Some(raster), owners, lookup }
    }

    fn at(&self, pixel: usize) -> Option<Surface> {
        let (raster, at) = (self.raster.as_ref()?, self.lookup.get(pixel).copied().flatten()?);
        let near = f64::from(raster.inverse_depth()[at]);
        let [r, g, b, _] = raster.color()[at].to_le_bytes();
        let color = [r, g, b].map(|v| f64::from(v) / 255.0);
        (near > 0.0).then(|| Surface { depth: 1.0 / near, color, instance: self.owners[at] })
    }
}
