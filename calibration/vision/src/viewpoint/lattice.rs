//! Chessboards among crossings: beginning at one, its neighbours lie along the two edges that cross there, one square
//! away, with light and dark exchanged; every crossing found says where to look for the next.

use super::planar::homography;
use nalgebra::Vector3;
use std::collections::{BTreeMap, VecDeque};
use std::f64::consts::PI;

/// Where four squares seem to meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Corner {
    /// Column and row.
    pub at: [f64; 2],
    /// How much it looks like one, above zero: only compared with the others'.
    pub response: f64,
    /// Directions of the two edges [rad], from the column axis towards the row axis: turning from the first to the second,
    /// by less than half a turn, sweeps over a dark square.
    pub axes: [f64; 2],
}

/// A crossing of four squares: its place in a lattice that begins anywhere and may be turned, and where it is seen [pixel].
pub type Crossing = ([i32; 2], [f64; 2]);

/// How far from where its neighbours say it must be a crossing may lie, in squares. A marker's fields cross no nearer to
/// a corner of its square than about twice that.
const ASTRAY: f64 = 0.25;
/// How far from where all together say it must be a crossing may lie, in squares: a board is flat.
const UNEVEN: f64 = 0.12;
/// How much less a neighbour may look like a crossing: one board is in about one light.
const FAINTER: f64 = 0.3;
/// How much the edges of neighbours may differ in direction [rad].
const TURNED: f64 = 0.35;
/// How far beside the edge a neighbour may lie as long as no other says how far away it is: tangent of the angle.
const BESIDE: f64 = 0.25;
/// How often a square's one edge may look as long as its other.
const OBLONG: f64 = 4.0;
/// Fewer crossings than this are chance.
const CROSSINGS: usize = 6;

/// To the four neighbours: those along the first axis, then those along the second.
const WAYS: [[i32; 2]; 4] = [[1, 0], [-1, 0], [0, 1], [0, -1]];

/// The lattices that the corners form, the one around the strongest corner first. Each lies as the chessboard does: its
/// second axis is a quarter turn from its first, from columns towards rows. Two may share crossings; the board there tells.
pub fn lattices(corners: &[Corner]) -> Vec<Vec<Crossing>> {
    let mut order: Vec<usize> = (0..corners.len()).collect();
    order.sort_by(|a, b| corners[*b].response.total_cmp(&corners[*a].response));
    let mut used = vec![false; corners.len()];
    let mut found = Vec::new();
    for seed in order {
        if used[seed] {
            continue;
        }
        let mut lattice = Lattice::from(corners, seed);
        lattice.settle();
        let on_a_line = [0, 1].iter().any(|axis| {
            let mut along = lattice.places.keys().map(|at| at[*axis]);
            along.next().is_none_or(|first| along.all(|other| other == first))
        });
        if lattice.places.len() >= CROSSINGS && !on_a_line {
            lattice.places.values().for_each(|corner| used[*corner] = true);
            let mirrored = lattice.mirrored();
            let place = |[a, b]: [i32; 2]| if mirrored { [b, a] } else { [a, b] };
            found.push(lattice.places.iter().map(|(at, corner)| (place(*at), corners[*corner].at)).collect());
        }
    }
    found
}

struct Lattice<'a> {
    corners: &'a [Corner],
    /// The corner at each place, the seed's at the origin.
    places: BTreeMap<[i32; 2], usize>,
    taken: Vec<bool>,
}

impl<'a> Lattice<'a> {
    fn from(corners: &'a [Corner], seed: usize) -> Self {
        let mut taken = vec![false; corners.len()];
        taken[seed] = true;
        Self { corners, places: BTreeMap::from([([0, 0], seed)]), taken }
    }

    /// Grows, drops what does not fit the rest, and looks again in the gaps, until nothing is dropped.
    fn settle(&mut self) {
        let mut dropped = 0;
        loop {
            self.grow();
            let grown = self.places.len();
            self.drop_astray();
            if self.places.len() == grown {
                return;
            }
            dropped += grown - self.places.len();
            // A board loses a corner or two beside it; what chance has put together falls apart.
            if self.places.len() < CROSSINGS.max(2 * dropped) {
                return self.places.clear();
            }
        }
    }

    fn grow(&mut self) {
        let mut waiting: VecDeque<_> = self.places.keys().copied().collect();
        while let Some(from) = waiting.pop_front() {
            for axis in [0, 1] {
                if self.step(from, WAYS[2 * axis]).is_none()
                    && let Some((to, corner)) = self.along_the_edge(from, axis)
                {
                    self.put(to, corner);
                    waiting.push_back(to);
                }
            }
            for way in WAYS {
                let to = add(from, way, 1);
                if self.places.contains_key(&to) {
                    continue;
                }
                if let Some(corner) = self.step(from, way).and_then(|step| self.neighbour(from, step)) {
                    self.put(to, corner);
                    waiting.push_back(to);
                }
            }
        }
    }

    fn put(&mut self, place: [i32; 2], corner: usize) {
        self.places.insert(place, corner);
        self.taken[corner] = true;
    }

    fn seen(&self, place: [i32; 2]) -> Option<[f64; 2]> {
        self.places.get(&place).map(|corner| self.corners[*corner].at)
    }

    /// From a place to its neighbour, between the two places.
    fn edge(&self, from: [i32; 2], way: [i32; 2]) -> Option<[f64; 2]> {
        Some(minus(self.seen(add(from, way, 1))?, self.seen(from)?))
    }

    /// What the edges around say about the way from a place to a neighbour [pixel]: the one before, longer or shorter by
    /// as much as it is than the one before that, and those beside; without them, those beyond.
    fn step(&self, from: [i32; 2], way: [i32; 2]) -> Option<[f64; 2]> {
        let side = [-way[1], way[0]];
        let before = self.edge(add(from, way, -1), way).map(|edge| {
            let earlier = self.edge(add(from, way, -2), way);
            let ratio = earlier.map_or(1.0, |earlier| (length(edge) / length(earlier)).clamp(0.7, 1.4));
            edge.map(|v| v * ratio)
        });
        let beside = [1, -1].map(|by| self.edge(add(from, side, by), way));
        let near: Vec<_> = beside.into_iter().chain([before]).flatten().collect();
        if !near.is_empty() {
            return Some(mean(&near));
        }
        let beyond = [[1, -1], [-1, -1], [2, 0], [-2, 0], [0, -2]];
        let far = beyond.iter().filter_map(|[to_side, on]| self.edge(add(add(from, side, *to_side), way, *on), way));
        let far: Vec<_> = far.collect();
        (!far.is_empty()).then(|| mean(&far))
    }

    /// Whether a free corner may be a neighbour: edges that run alike, with light and dark exchanged.
    fn may_follow(&self, one: usize, other: usize) -> bool {
        let (from, to) = (self.corners[one], self.corners[other]);
        let turned = |axis: usize| (from.axes[axis] - to.axes[1 - axis]).rem_euclid(PI);
        let alike = [0, 1].iter().all(|axis| turned(*axis).min(PI - turned(*axis)) < TURNED);
        alike && !self.taken[other] && to.response > FAINTER * from.response
    }

    /// The free corner nearest to where a step leads, if it is near.
    fn neighbour(&self, from: [i32; 2], step: [f64; 2]) -> Option<usize> {
        let here = *self.places.get(&from)?;
        let start = self.corners[here].at;
        let aim = [start[0] + step[0], start[1] + step[1]];
        let mut best = (ASTRAY * length(step), None);
        for (number, corner) in self.corners.iter().enumerate() {
            let off = length(minus(corner.at, aim));
            if off < best.0 && self.may_follow(here, number) {
                best = (off, Some(number));
            }
        }
        best.1
    }

    /// The nearest free corner on either side along an axis, and its place.
    fn along_the_edge(&self, from: [i32; 2], axis: usize) -> Option<([i32; 2], usize)> {
        let here = *self.places.get(&from)?;
        let corner = self.corners[here];
        // From one crossing to the next the axes change places; the second is always a quarter turn from the first.
        let (mut sin, mut cos) = corner.axes[(axis as i32 + from[0] + from[1]).rem_euclid(2) as usize].sin_cos();
        let across = self.step(from, WAYS[2 - 2 * axis]);
        if across.is_some_and(|across| (across[0] * sin - across[1] * cos > 0.0) != (axis == 1)) {
            (sin, cos) = (-sin, -cos);
        }
        let across = across.map(length);
        let mut best: Option<(f64, [i32; 2], usize)> = None;
        for (number, other) in self.corners.iter().enumerate() {
            let off = minus(other.at, corner.at);
            let (on, beside) = (cos * off[0] + sin * off[1], cos * off[1] - sin * off[0]);
            let oblong = across.is_some_and(|across| on.abs() > OBLONG * across || on.abs() * OBLONG < across);
            if beside.abs() > BESIDE * on.abs() || oblong || best.is_some_and(|(nearest, ..)| nearest <= on.abs()) {
                continue;
            }
            if self.may_follow(here, number) {
                let way = WAYS[2 * axis + usize::from(on < 0.0)];
                best = Some((on.abs(), add(from, way, 1), number));
            }
        }
        best.filter(|(_, to, _)| !self.places.contains_key(to)).map(|(_, to, number)| (to, number))
    }

    /// Takes out, one by one, what lies farthest from where all the others together say.
    fn drop_astray(&mut self) {
        while self.places.len() >= CROSSINGS {
            let seen: Vec<_> = self.places.iter().map(|(at, c)| (at.map(f64::from), self.corners[*c].at)).collect();
            let Some(map) = homography(&seen) else { return };
            let project = |x: f64, y: f64| {
                let at = map * Vector3::new(x, y, 1.0);
                [at.x / at.z, at.y / at.z]
            };
            let off = |[x, y]: [f64; 2], at: [f64; 2]| {
                let here = project(x, y);
                let sides = [project(x + 1.0, y), project(x, y + 1.0)].map(|next| length(minus(next, here)));
                length(minus(at, here)) / sides[0].min(sides[1])
            };
            let offs = self.places.keys().zip(&seen).map(|(place, (x, at))| (off(*x, *at), *place));
            let Some((most, place)) = offs.max_by(|(a, _), (b, _)| a.total_cmp(b)) else { return };
            if most < UNEVEN {
                return;
            }
            self.places.remove(&place);
        }
    }

    /// Whether the second axis is a quarter turn from the first the wrong way, as a wrong start can leave it.
    fn mirrored(&self) -> bool {
        let area = |at: &[i32; 2]| {
            let (first, second) = (self.edge(*at, WAYS[0])?, self.edge(*at, WAYS[2])?);
            Some(first[0] * second[1] - first[1] * second[0])
        };
        self.places.keys().filter_map(area).sum::<f64>() < 0.0
    }
}

fn add(place: [i32; 2], way: [i32; 2], times: i32) -> [i32; 2] {
    [place[0] + times * way[0], place[1] + times * way[1]]
}

fn minus(a: [f64; 2], b: [f64; 2]) -> [f64; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn length(way: [f64; 2]) -> f64 {
    way[0].hypot(way[1])
}

fn mean(ways: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|i| ways.iter().map(|way| way[i]).sum::<f64>() / ways.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use rand_distr::{Distribution as _, Normal};
    use rand_pcg::Pcg64;

    /// Crossings of a board of 8 x 10 squares of about 40 pixels, seen obliquely, with their places, and of a row more on
    /// every side.
    fn board(random: &mut Pcg64) -> Vec<([i32; 2], Corner)> {
        let turn: f64 = random.random_range(-PI..PI);
        let tilt = [0, 1].map(|_| random.random_range(-0.02..0.02));
        let see = |x: f64, y: f64| {
            let depth = 1.0 + tilt[0] * x + tilt[1] * y;
            let (sin, cos) = turn.sin_cos();
            [320.0 + 40.0 * (cos * x - sin * y) / depth, 240.0 + 40.0 * (sin * x + cos * y) / depth]
        };
        let noise = Normal::new(0.0, 0.3).expect("a spread");
        let mut out = Vec::new();
        for (i, j) in (-1..10).flat_map(|j| (-1..8).map(move |i| (i, j))) {
            let (x, y) = (f64::from(i) - 3.0, f64::from(j) - 4.0);
            let along = |dx: f64, dy: f64| {
                let way = minus(see(x + dx, y + dy), see(x, y));
                way[1].atan2(way[0])
            };
            let mut lines = [along(1e-3, 0.0), along(0.0, 1e-3)].map(|v| v + random.random_range(-0.1..0.1));
            if (i + j) % 2 != 0 {
                lines.reverse();
            }
            let first = lines[0].rem_euclid(PI);
            let axes = [first, first + (lines[1] - first).rem_euclid(PI)];
            let at = see(x, y).map(|v| v + noise.sample(random));
            out.push(([i, j], Corner { at, response: random.random_range(100.0..300.0), axes }));
        }
        out
    }

    fn clutter(count: usize, random: &mut Pcg64) -> Vec<Corner> {
        let corner = |_| {
            let first = random.random_range(0.0..PI);
            let axes = [first, first + random.random_range(0.8..2.3)];
            let at = [random.random_range(0.0..640.0), random.random_range(0.0..480.0)];
            Corner { at, response: random.random_range(20.0..250.0), axes }
        };
        (0..count).map(corner).collect()
    }

    #[test]
    fn a_board_with_holes_among_clutter_gets_the_right_places() {
        for seed in 0..40 {
            let random = &mut Pcg64::seed_from_u64(seed);
            let mut truth = board(random);
            // What looks like a crossing where one belongs cannot be distinguished from one.
            let mut clutter = clutter(60, random);
            clutter.retain(|c| truth.iter().all(|(_, corner)| length(minus(corner.at, c.at)) > 8.0));
            truth.retain(|([i, j], _)| (0..7).contains(i) && (0..9).contains(j));
            // No two of the holes are neighbours, so that the rest hangs together.
            truth.retain(|([i, j], _)| !(i % 2 == 1 && j % 2 == 1 && (i + 2 * j + seed as i32) % 3 != 0));
            let mut corners: Vec<Corner> = truth.iter().map(|(_, corner)| *corner).collect();
            corners.extend(clutter);
            let found = lattices(&corners).into_iter().max_by_key(Vec::len).expect("a lattice");
            let fits = (0..4).any(|quarter| {
                let turned = |[a, b]: [i32; 2]| [[a, b], [-b, a], [-a, -b], [b, -a]][quarter];
                let shifts = found.iter().map(|(place, at)| {
                    let (known, _) = truth.iter().find(|(_, corner)| corner.at == *at)?;
                    Some(add(*known, turned(*place), -1))
                });
                let shifts: Vec<_> = shifts.collect();
                shifts[0].is_some() && shifts.iter().all(|shift| *shift == shifts[0])
            });
            assert!(fits && found.len() == truth.len(), "board {seed}: {} of {}", found.len(), truth.len());
        }
    }

    #[test]
    fn chance_makes_no_board() {
        for seed in 0..10 {
            let found = lattices(&clutter(300, &mut Pcg64::seed_from_u64(seed)));
            let most = found.iter().map(Vec::len).max().unwrap_or(0);
            assert!(most < 12, "{seed}: {most}");
        }
    }
}
