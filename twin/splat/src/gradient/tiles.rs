//! The splats that a camera sees, nearest first, and which of them reach a tile of the picture.

use super::{COLOR_PLANE, Parameters};
use crate::project::View;
use crate::real::Real;
use crate::reference::TILE;
use nalgebra::Vector3;
use rayon::prelude::*;

/// A splat in the picture, with the value of each channel.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drawn<T, const C: usize> {
    /// Its number among all.
    pub(super) number: u32,
    pub(super) centre: [T; 2],
    pub(super) conic: [T; 3],
    pub(super) opacity: T,
    pub(super) reach: [T; 2],
    pub(super) depth: T,
    pub(super) values: [T; C],
}

/// All that are seen, nearest first; at one depth in the order of their numbers.
pub(super) fn drawn<T: Real, const C: usize>(splats: &Parameters<T>, view: &View<T>) -> Vec<Drawn<T, C>> {
    let one = |number: usize| {
        let bell = splats.bell(number);
        let seen = view.project(&bell, splats.degree, splats.colors(number))?;
        let mut values = [T::zero(); C];
        values[..3].copy_from_slice(&seen.color);
        values[3] = seen.depth;
        if C == COLOR_PLANE {
            let forward = view.forward(&bell)?;
            let (axis, sign) = normal(&bell.sigma, &forward.axes, &forward.at);
            let normal = forward.axes.column(axis) * sign;
            values[3] = normal.dot(&forward.at);
            (0..3).for_each(|i| values[4 + i] = normal[i]);
        }
        let (centre, conic, opacity, reach, depth) = (seen.centre, seen.conic, seen.opacity, seen.reach, seen.depth);
        Some(Drawn { number: number as u32, centre, conic, opacity, reach, depth, values })
    };
    let mut drawn: Vec<Drawn<T, C>> = (0..splats.len()).into_par_iter().with_min_len(64).filter_map(one).collect();
    let nearer = |a: &Drawn<T, C>, b: &Drawn<T, C>| a.depth.wide().total_cmp(&b.depth.wide());
    drawn.par_sort_unstable_by(|a, b| nearer(a, b).then(a.number.cmp(&b.number)));
    drawn
}

/// The axis along which a splat is flattest, and the sign by which it points to the camera.
pub(super) fn normal<T: Real>(sigma: &Vector3<T>, axes: &nalgebra::Matrix3<T>, at: &Vector3<T>) -> (usize, T) {
    let axis = sigma.imin();
    let away = axes.column(axis).dot(at) > T::zero();
    (axis, if away { -T::one() } else { T::one() })
}

/// For each tile the splats that reach it, and for each splat where it stands in the tiles' lists.
#[derive(Debug)]
pub(super) struct Lists {
    /// Where each tile's list begins, and the end of the last.
    begins: Vec<u32>,
    entries: Vec<u32>,
    /// Where each splat's places begin, and the end of the last.
    place_begins: Vec<u32>,
    /// Tile, and place in its list.
    places: Vec<(u32, u32)>,
}

impl Lists {
    pub(super) fn new<T: Real, const C: usize>(drawn: &[Drawn<T, C>], size: [usize; 2]) -> Self {
        let tiles = size.map(|pixels| pixels.div_ceil(TILE));
        let ranges = |splat: &Drawn<T, C>| {
            [0, 1].map(|i| {
                let tile = |at: T| (at.wide().max(0.0) as usize / TILE).min(tiles[i] - 1);
                tile(splat.centre[i] - splat.reach[i])..tile(splat.centre[i] + splat.reach[i]) + 1
            })
        };
        let mut begins = vec![0u32; tiles[0] * tiles[1] + 1];
        let mut place_begins = Vec::with_capacity(drawn.len() + 1);
        let mut places = Vec::with_capacity(4 * drawn.len());
        for splat in drawn {
            place_begins.push(places.len() as u32);
            let [columns, rows] = ranges(splat);
            for y in rows {
                for tile in columns.clone().map(|x| y * tiles[0] + x) {
                    // So many are before it in this tile's list.
                    places.push((tile as u32, begins[tile + 1]));
                    begins[tile + 1] += 1;
                }
            }
        }
        place_begins.push(places.len() as u32);
        (1..begins.len()).for_each(|i| begins[i] += begins[i - 1]);
        let mut entries = vec![0; places.len()];
        for (number, ends) in place_begins.windows(2).enumerate() {
            for (tile, place) in &places[ends[0] as usize..ends[1] as usize] {
                entries[(begins[*tile as usize] + place) as usize] = number as u32;
            }
        }
        Self { begins, entries, place_begins, places }
    }

    /// How many tiles.
    pub(super) fn tiles(&self) -> usize {
        self.begins.len() - 1
    }

    /// The splats of a tile, nearest first.
    pub(super) fn of(&self, tile: usize) -> &[u32] {
        &self.entries[self.begins[tile] as usize..self.begins[tile + 1] as usize]
    }

    /// Tiles of a splat, and its places in their lists.
    pub(super) fn places(&self, splat: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
        let ends = self.place_begins[splat] as usize..self.place_begins[splat + 1] as usize;
        self.places[ends].iter().map(|(tile, place)| (*tile as usize, *place as usize))
    }
}
