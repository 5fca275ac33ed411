//! Blocks of voxels by their place, and views going into them.

use super::{Settings, View};
use nalgebra::{Isometry3, Point3, Vector3};
use rayon::prelude::*;
use std::collections::{HashMap, HashSet};

/// Voxels along the edge of a block.
pub(super) const EDGE: i32 = 8;
const VOXELS: usize = (EDGE * EDGE * EDGE) as usize;
/// Of the rays that look for blocks, one in so many columns and rows: neighbours meet the same ones.
const EVERY: usize = 2;
/// Nearer depths are no surface but the camera's own housing [m].
const NEAREST: f32 = 0.05;
/// Depths are off by less than so many standard deviations.
const NOISE: f32 = 3.0;

/// A block's voxels: x runs quickest, then y, then z.
#[derive(Debug, Clone)]
pub(super) struct Block {
    /// Distance to the surface over the band, 1 outside, -1 inside.
    pub(super) distance: Box<[f32; VOXELS]>,
    weight: Box<[f32; VOXELS]>,
    /// So many views saw it.
    pub(super) seen: Box<[u16; VOXELS]>,
    /// Red, green, blue, 0 to 1.
    pub(super) color: Box<[[f32; 3]; VOXELS]>,
    /// Views that had colour, by weight.
    colored: Box<[f32; VOXELS]>,
}

impl Block {
    fn new() -> Self {
        Self {
            distance: Box::new([1.0; VOXELS]),
            weight: Box::new([0.0; VOXELS]),
            seen: Box::new([0; VOXELS]),
            color: Box::new([[0.5; 3]; VOXELS]),
            colored: Box::new([0.0; VOXELS]),
        }
    }
}

/// A signed distance in blocks.
#[derive(Debug, Clone)]
pub struct Grid {
    pub(super) settings: Settings,
    numbers: HashMap<[i32; 3], usize>,
    places: Vec<[i32; 3]>,
    blocks: Vec<Block>,
}

impl Grid {
    /// An empty one.
    pub fn new(settings: Settings) -> Self {
        Self { settings, numbers: HashMap::new(), places: Vec::new(), blocks: Vec::new() }
    }

    /// Takes a view in.
    pub fn add(&mut self, view: &View<'_>) {
        let touched = self.near(view);
        let mut is_touched = vec![false; self.blocks.len()];
        for place in touched {
            let next = self.blocks.len();
            let number = *self.numbers.entry(place).or_insert(next);
            if number == next {
                self.places.push(place);
                self.blocks.push(Block::new());
                is_touched.push(true);
            } else {
                is_touched[number] = true;
            }
        }
        let settings = self.settings;
        (self.blocks.par_iter_mut().zip(&self.places).zip(&is_touched))
            .filter(|(_, is_touched)| **is_touched)
            .for_each(|((block, place), _)| take_in(block, *place, view, &settings));
    }

    /// The blocks within the band of what a view sees, in order.
    fn near(&self, view: &View<'_>) -> Vec<[i32; 3]> {
        let Settings { voxel, band, farthest, .. } = self.settings;
        let block = voxel * EDGE as f32;
        let reach = band * voxel;
        let world_from_camera = view.camera.camera_from_world.inverse().cast::<f32>();
        let [width, height] = view.size;
        let row = |y: usize| {
            let mut found = HashSet::new();
            for x in (0..width).step_by(EVERY) {
                let depth = view.depth[y * width + x];
                if !(depth > NEAREST && depth < farthest) {
                    continue;
                }
                let ray = view.camera.lens.ray([x as f64, y as f64]).cast::<f32>();
                let steps = (2.0 * reach / (0.5 * block)).ceil() as usize;
                for step in 0..=steps {
                    let at = depth - reach + 2.0 * reach * step as f32 / steps as f32;
                    let point = world_from_camera * Point3::from(ray * at);
                    found.insert([0, 1, 2].map(|i| (point[i] / block).floor() as i32));
                }
            }
            found
        };
        let rows = (0..height).into_par_iter().step_by(EVERY).map(row);
        let all = rows.reduce(HashSet::new, |mut a, b| {
            a.extend(b);
            a
        });
        // Blocks keep one order whatever the threads did.
        let mut all: Vec<[i32; 3]> = all.into_iter().collect();
        all.sort_unstable();
        all
    }

    /// The block at a place.
    pub(super) fn block(&self, place: [i32; 3]) -> Option<&Block> {
        self.numbers.get(&place).map(|number| &self.blocks[*number])
    }

    /// Where there are blocks.
    pub(super) fn places(&self) -> &[[i32; 3]] {
        &self.places
    }
}

/// The number of a voxel in its block.
pub(super) fn voxel([x, y, z]: [i32; 3]) -> usize {
    ((z * EDGE + y) * EDGE + x) as usize
}

/// How much a depth counts for a voxel that is so far before it. Behind the band a voxel may be in the next surface; but where noise is
/// wider than the band, depths that are short by it must count as much as those that are long by it, else the surface moves away from
/// the cameras.
fn counts(before: f32, reach: f32, noise: f32) -> f32 {
    if before >= -reach { 1.0 } else { (2.0 + 2.0 * before / noise.max(reach)).clamp(0.0, 1.0) }
}

fn take_in(block: &mut Block, place: [i32; 3], view: &View<'_>, settings: &Settings) {
    let camera: Isometry3<f32> = view.camera.camera_from_world.cast();
    let lens = &view.camera.lens;
    let (bent, [fx, fy], [cx, cy]) = (lens.is_bent(), lens.focal.map(|f| f as f32), lens.centre.map(|c| c as f32));
    let reach = settings.band * settings.voxel;
    for number in 0..VOXELS {
        let own = [number as i32 % EDGE, number as i32 / EDGE % EDGE, number as i32 / (EDGE * EDGE)];
        let point = Vector3::from_fn(|i, _| (place[i] * EDGE + own[i]) as f32 * settings.voxel);
        let at = camera * Point3::from(point);
        if at.z <= NEAREST {
            continue;
        }
        let [u, v] = if bent {
            lens.project(&at.cast()).0.map(|value| value as f32)
        } else {
            [fx * at.x / at.z + cx, fy * at.y / at.z + cy]
        };
        let (u, v) = (u.round(), v.round());
        if !(u >= 0.0 && v >= 0.0 && u < view.size[0] as f32 && v < view.size[1] as f32) {
            continue;
        }
        let pixel = v as usize * view.size[0] + u as usize;
        let depth = view.depth[pixel];
        let before = depth - at.z;
        if !(depth > NEAREST && depth < settings.farthest) {
            continue;
        }
        let share = counts(before, reach, NOISE * settings.spread * depth * depth);
        if share <= 0.0 {
            continue;
        }
        let weight = share * depth.powi(-4);
        let all = block.weight[number] + weight;
        let share = weight / all;
        block.distance[number] += share * ((before / reach).clamp(-1.0, 1.0) - block.distance[number]);
        block.weight[number] = all;
        block.seen[number] = block.seen[number].saturating_add(1);
        // Colours are those of the surface: a voxel far before it sees what lies behind.
        if let Some(rgb) = view.rgb.filter(|_| before.abs() < reach) {
            block.colored[number] += weight;
            let share = weight / block.colored[number];
            let color = rgb[pixel].map(|value| f32::from(value) / 255.0);
            (0..3).for_each(|c| block.color[number][c] += share * (color[c] - block.color[number][c]));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::counts;

    #[test]
    fn noise_as_wide_as_the_band_leaves_a_voxel_on_the_surface_there() {
        // Mean over normal noise of what a voxel on the surface gathers, in bands.
        let mean = |noise: f32| {
            let votes = (-400i16..=400).map(|i| {
                let off = f32::from(i) * 0.01;
                let weight = counts(off, 1.0, noise) * (-0.5 * off * off).exp();
                (weight * off.clamp(-1.0, 1.0), weight)
            });
            let (sum, total) = votes.fold((0.0, 0.0), |a, b| (a.0 + b.0, a.1 + b.1));
            sum / total
        };
        assert!(mean(3.0).abs() < 0.03 && mean(0.0) > 0.15, "{} {}", mean(3.0), mean(0.0));
    }
}
