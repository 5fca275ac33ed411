//! One pass over a picture: each pixel tries the planes of its neighbours and changes of its own, the pixels of one colour of a
//! checkerboard at a time, so that all of one colour can be worked on at once (Galliani, Lasinger and Schindler, "Massively parallel multiview
//! stereopsis by surface normal diffusion", ICCV 2015, section 3). Neighbours are the best pixels of eight areas, and which views count
//! is decided pixel by pixel by how they judge these planes (Xu and Tao, "Multi-scale geometric consistency guided multi-view stereo",
//! CVPR 2019, section 3).

use crate::picture::Picture;
use crate::plane::{Lens, Pair, Plane};
use crate::random::Random;
use crate::similarity::{HALF, OPPOSITE, Window};
use nalgebra::Vector3;
use rayon::prelude::*;
use shared_mem::ending;

/// A view is compared with so many others at most.
pub(crate) const MOST: usize = 8;
/// Planes of neighbours that are tried, and the pixel's own.
const TRIED: usize = 9;
/// A plane matches in a view by this difference at first and falls below it by `exp(-t^2 / FASTER)` in round t; these and the next
/// number are the source's (equation 3: 0.8, 90; equation 5: 0.3).
const MATCHES: f32 = 0.8;
const FASTER: f32 = 90.0;
const SPREAD: f32 = 0.3;
/// So many views count for a pixel.
const COUNTED: usize = 4;
/// Where fewer match, each plane is judged by those in which it matches best.
const FEWEST: usize = 2;
/// What a pixel that another view's depth puts elsewhere adds to the difference, and the distance from which on it is no farther
/// [pixel] (equation 8 of the source).
const ELSEWHERE: f32 = 0.2;
const FARTHEST: f32 = 3.0;
/// Planes are the same that differ by less in what other views see [pixel].
const SAME: f32 = 0.03;

/// A pixel's plane, and how much views differ on it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cell {
    pub(crate) plane: Plane,
    pub(crate) cost: f32,
}

/// The planes of a picture, the two colours of its checkerboard apart, each row by row.
#[derive(Debug, Clone)]
pub(crate) struct Cells {
    pub(crate) size: [usize; 2],
    colours: [Vec<Cell>; 2],
}

impl Cells {
    /// Of all pixels, from column and row.
    pub(crate) fn new(size: [usize; 2], cell: impl Fn(usize, usize) -> Cell + Sync) -> Self {
        let half = size[0].div_ceil(2);
        let colours = [0, 1].map(|colour| {
            let one = |at: usize| {
                let row = at / half;
                cell((2 * (at % half) + (row + colour) % 2).min(size[0] - 1), row)
            };
            (0..half * size[1]).into_par_iter().map(one).collect()
        });
        Self { size, colours }
    }

    #[inline]
    pub(crate) fn at(&self, column: usize, row: usize) -> &Cell {
        &self.colours[(column + row) % 2][row * self.size[0].div_ceil(2) + column / 2]
    }

    /// That of the pixel which holds a place, and its middle; `None` outside.
    #[inline]
    pub(crate) fn around(&self, [u, v]: [f32; 2]) -> Option<(&Cell, [f32; 2])> {
        let inside = u >= 0.0 && v >= 0.0 && u < self.size[0] as f32 && v < self.size[1] as f32;
        inside.then(|| {
            let (column, row) = (u as usize, v as usize);
            (self.at(column, row), [column as f32 + 0.5, row as f32 + 0.5])
        })
    }
}

/// Another view, as a view is compared with it.
pub(crate) struct Source<'a> {
    pub(crate) picture: &'a Picture,
    /// From the view to it and back.
    pub(crate) pairs: [Pair; 2],
    /// Its planes, where they count, and by how much fewer pixels they are.
    pub(crate) cells: Option<(&'a Cells, f32)>,
}

/// What a pass works on.
pub(crate) struct Pass<'a> {
    pub(crate) picture: &'a Picture,
    pub(crate) lens: Lens,
    pub(crate) sources: Vec<Source<'a>>,
    /// Inverse depths [1/m].
    pub(crate) range: [f32; 2],
    /// Change of inverse depth at which other views see a pixel a pixel farther on [1/m].
    pub(crate) per_pixel: f32,
    /// Pixels that change; empty: all.
    pub(crate) wanted: Vec<bool>,
    /// Pixels in whose windows brightness has less variance stay as they are [of 255, squared].
    pub(crate) least_variance: f32,
    /// Numbers of seed, view and level.
    pub(crate) counters: [u64; 3],
}

/// How far a round looks.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Round {
    pub(crate) number: u32,
    /// Whether planes from nowhere near are tried.
    pub(crate) anew: bool,
    /// Planes are changed by so much at most in what other views see [pixel].
    pub(crate) change: f32,
    /// How often.
    pub(crate) changes: u32,
}

/// How views judge planes.
struct Judged {
    planes: [Plane; TRIED],
    differences: [[f32; MOST]; TRIED],
    count: usize,
}

impl Pass<'_> {
    /// A plane of any depth and direction.
    pub(crate) fn anywhere(&self, at: [f32; 2], random: &mut Random) -> Plane {
        let inverse = self.range[0] + random.unit() * (self.range[1] - self.range[0]);
        let ray = self.lens.ray(at).normalize();
        let normal = loop {
            let normal = Vector3::new(random.signed(), random.signed(), random.signed());
            let (length, along) = (normal.norm_squared(), normal.dot(&ray));
            if length < 1.0 && along * along > 0.04 * length {
                break normal;
            }
        };
        Plane::facing(&normal, inverse, at, &self.lens)
    }

    /// Both colours of the checkerboard, one after the other.
    pub(crate) fn sweep(&self, cells: &mut Cells, round: Round) {
        for colour in 0..2 {
            let [width, _] = cells.size;
            let half = width.div_ceil(2);
            let mut own = std::mem::take(&mut cells.colours[colour]);
            let neighbours = &*cells;
            own.par_chunks_mut(half).enumerate().for_each(|(row, own)| {
                // What is left as it is comes to nothing: the work ends.
                if ending::asked() {
                    return;
                }
                for (number, cell) in own.iter_mut().enumerate() {
                    let column = 2 * number + (row + colour) % 2;
                    let wanted = column < width && (self.wanted.is_empty() || self.wanted[row * width + column]);
                    if wanted {
                        *cell = self.improved(cell, neighbours, [column, row], round);
                    }
                }
            });
            cells.colours[colour] = own;
        }
    }

    /// The best plane of a pixel's own, its neighbours' and changes of these.
    fn improved(&self, own: &Cell, neighbours: &Cells, pixel: [usize; 2], round: Round) -> Cell {
        let [column, row] = pixel;
        let at = [column as f32 + 0.5, row as f32 + 0.5];
        let window = Window::of(self.picture, column, row);
        if window.variance < self.least_variance {
            return *own;
        }
        let mut judged = Judged { planes: [own.plane; TRIED], differences: [[0.0; MOST]; TRIED], count: 0 };
        self.judge(&mut judged, own.plane, at, &window);
        for area in 0..TRIED - 1 {
            let Some((plane, by)) = best_of(neighbours, pixel, area) else { continue };
            let plane = plane.moved(by);
            let known = judged.planes[..judged.count].iter().any(|known| self.is_same(known, &plane));
            if !known && plane.is_seen(at, &self.lens, self.range) {
                self.judge(&mut judged, plane, at, &window);
            }
        }
        let weights = self.weights(&judged, round.number);
        let cost = |number: usize| cost(&judged.differences[number], &weights, self.sources.len());
        let mut best = Cell { plane: own.plane, cost: cost(0) };
        for number in 1..judged.count {
            let cost = cost(number);
            if cost < best.cost {
                best = Cell { plane: judged.planes[number], cost };
            }
        }
        let [seed, view, level] = self.counters;
        let place = (row as u64) << 32 | column as u64;
        let mut random = Random::of([seed, view << 8 | level, u64::from(round.number), place]);
        self.changed(&mut best, at, (&window, &weights), (round, &mut random));
        best
    }

    /// Tries changes of a plane.
    fn changed(
        &self,
        best: &mut Cell,
        at: [f32; 2],
        (window, weights): (&Window, &[f32; MOST]),
        (round, random): (Round, &mut Random),
    ) {
        let mut change = round.change * self.per_pixel;
        for number in 0..round.changes {
            let mut plane = best.plane;
            if round.anew && number == 0 {
                plane = self.anywhere(at, random);
                if random.unit() < 0.5 {
                    plane.inverse = best.plane.inverse;
                }
            } else {
                // Depth, slope, both, and again by less.
                if number % 3 != 1 {
                    plane.inverse += change * random.signed();
                }
                if number % 3 != 0 {
                    plane.slope.iter_mut().for_each(|slope| *slope += change / HALF * random.signed());
                }
                if number % 3 == 2 {
                    change *= 0.5;
                }
            }
            if !plane.is_seen(at, &self.lens, self.range) {
                continue;
            }
            let mut differences = [OPPOSITE; MOST];
            for (source, difference) in differences[..self.sources.len()].iter_mut().enumerate() {
                if weights[source] > 0.0 || weights[0] < 0.0 {
                    *difference = self.difference(source, &plane, at, window);
                }
            }
            let cost = cost(&differences, weights, self.sources.len());
            if cost < best.cost {
                *best = Cell { plane, cost };
            }
        }
    }

    fn is_same(&self, a: &Plane, b: &Plane) -> bool {
        let least = SAME * self.per_pixel;
        let slope = (a.slope[0] - b.slope[0]).abs() + (a.slope[1] - b.slope[1]).abs();
        (a.inverse - b.inverse).abs() + HALF * slope < least
    }

    fn judge(&self, judged: &mut Judged, plane: Plane, at: [f32; 2], window: &Window) {
        judged.planes[judged.count] = plane;
        for source in 0..self.sources.len() {
            judged.differences[judged.count][source] = self.difference(source, &plane, at, window);
        }
        judged.count += 1;
    }

    /// How much a view differs on a plane: in what it shows, and in where its own depth puts the pixel.
    fn difference(&self, source: usize, plane: &Plane, at: [f32; 2], window: &Window) -> f32 {
        let Source { picture, pairs: [there, back], cells } = &self.sources[source];
        let shown = window.difference(picture, &there.homography(at, plane));
        let Some((cells, by)) = cells else { return shown };
        shown + ELSEWHERE * elsewhere(at, plane, [there, back], (cells, *by)).min(FARTHEST)
    }

    /// How much views count for a pixel: at most [`COUNTED`] of them, by how planes match in them; the first is negative where too few do.
    fn weights(&self, judged: &Judged, round: u32) -> [f32; MOST] {
        let limit = MATCHES * (-(round as f32).powi(2) / FASTER).exp();
        let mut weights = [0.0; MOST];
        for (source, weight) in weights[..self.sources.len()].iter_mut().enumerate() {
            let matching = judged.differences[..judged.count].iter().map(|d| d[source]).filter(|d| *d < limit);
            let sum: f32 = matching.map(|d| (-d * d / (2.0 * SPREAD * SPREAD)).exp()).sum();
            *weight = sum / judged.count as f32;
        }
        let mut sorted = weights;
        sorted.sort_by(|a, b| b.total_cmp(a));
        if sorted[FEWEST - 1] <= 0.0 {
            return [-1.0; MOST];
        }
        let least = sorted[COUNTED - 1];
        weights.iter_mut().for_each(|weight| *weight = if *weight < least { 0.0 } else { *weight });
        weights
    }
}

/// The mean of the differences by the weights of their views; of the least ones where there are no weights.
fn cost(differences: &[f32; MOST], weights: &[f32; MOST], sources: usize) -> f32 {
    if weights[0] < 0.0 {
        let mut sorted = *differences;
        sorted[..sources].sort_by(f32::total_cmp);
        let count = FEWEST.min(sources);
        return sorted[..count].iter().sum::<f32>() / count.max(1) as f32;
    }
    let sum: f32 = (0..sources).map(|source| weights[source] * differences[source]).sum();
    sum / weights[..sources].iter().sum::<f32>()
}

/// How far from a pixel the depth of another view puts what the pixel's plane shows it [pixel]; [`FARTHEST`] where it has none.
fn elsewhere(at: [f32; 2], plane: &Plane, [there, back]: [&Pair; 2], (cells, by): (&Cells, f32)) -> f32 {
    let Some(seen) = there.place(at, plane.inverse) else { return FARTHEST };
    let Some((cell, middle)) = cells.around(seen.at.map(|v| v / by)) else { return FARTHEST };
    let away = [0, 1].map(|i| seen.at[i] / by - middle[i]);
    let Some(again) = back.place(seen.at, cell.plane.moved(away).inverse) else { return FARTHEST };
    (again.at[0] - at[0]).hypot(again.at[1] - at[1])
}

/// The plane of the best pixel of an area beside one, and how far the one is from it: four near areas, widening away from the pixel, and
/// four strips that reach far.
fn best_of(neighbours: &Cells, [column, row]: [usize; 2], area: usize) -> Option<(Plane, [f32; 2])> {
    const NEAR: [[i32; 2]; 7] = [[0, 1], [-1, 2], [1, 2], [-2, 3], [2, 3], [-3, 4], [3, 4]];
    const FAR: [[i32; 2]; 11] =
        [[0, 3], [0, 5], [0, 7], [0, 9], [0, 11], [0, 13], [0, 15], [0, 17], [0, 19], [0, 21], [0, 23]];
    let places: &[[i32; 2]] = if area < 4 { &NEAR } else { &FAR };
    let mut best: Option<(&Cell, [i32; 2])> = None;
    for [across, along] in places {
        let by = match area % 4 {
            0 => [*across, *along],
            1 => [*along, *across],
            2 => [*across, -*along],
            _ => [-*along, *across],
        };
        let (x, y) = (column as i32 + by[0], row as i32 + by[1]);
        if x < 0 || y < 0 || x as usize >= neighbours.size[0] || y as usize >= neighbours.size[1] {
            continue;
        }
        let cell = neighbours.at(x as usize, y as usize);
        if best.is_none_or(|(best, _)| cell.cost < best.cost) {
            best = Some((cell, by));
        }
    }
    best.map(|(cell, by)| (cell.plane, by.map(|v| -v as f32)))
}
