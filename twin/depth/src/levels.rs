//! From few pixels to many: planes are found from nothing in small pictures, whose windows hold more of the world, and are improved in
//! larger ones; after the first pass over all views, each is also held against the depth of the others (Xu and Tao 2019, section 4).

use crate::agree::agreed;
use crate::camera::{Depth, View};
use crate::neighbours;
use crate::picture::Picture;
use crate::plane::{Lens, Pair, Plane};
use crate::random::Random;
use crate::similarity::OPPOSITE;
use crate::sweep::{Cell, Cells, MOST, Pass, Round, Source};
use shared_mem::ending;

/// The smallest pictures have at least so many columns or rows, whichever are more.
const SMALLEST: usize = 80;

/// Pictures of fewer pixels than one in so many each way are worked on whatever of a view is wanted finely.
const FINE: usize = 2;
/// Windows of less variance say too little [of 255, squared]: their pixels keep the plane that larger ones have found.
const TEXTURED: f32 = 9.0;

/// One pass over all views.
#[derive(Debug, Clone, Copy)]
struct Step {
    /// So many pixels in each direction are one.
    by: usize,
    /// Rounds over each view.
    rounds: u32,
    /// Of these so many try planes from anywhere.
    anew: u32,
    /// How far planes are changed at first in what other views see [pixel].
    change: f32,
    /// Whether each view is held against the depth of the others.
    against: bool,
}

impl Step {
    /// Its rounds, from large changes to small ones.
    fn round(&self, number: u32) -> Round {
        Round { number, anew: number < self.anew, change: self.change * 0.7f32.powi(number as i32), changes: 6 }
    }
}

/// The steps for pictures with this longer edge: from nothing, once more finer, and from there on each against the others.
fn steps(edge: usize) -> Vec<Step> {
    let mut by = 1;
    while edge >= 2 * by * SMALLEST {
        by *= 2;
    }
    let mut steps = vec![Step { by, rounds: 6, anew: 4, change: 2.0, against: false }];
    if by > 1 {
        steps.push(Step { by: by / 2, rounds: 2, anew: 1, change: 1.0, against: false });
    }
    while by > 1 {
        by /= 2;
        let rounds = if by > 1 { 2 } else { 1 };
        steps.push(Step { by, rounds, anew: 0, change: 0.7, against: true });
    }
    steps
}

/// Depth, normal and confidence of every pixel of every view, the same for the same seed; `done` is told which share of the work is done.
/// `None` once the end was asked for, within a second. Pictures have fewer than eight million pixels each.
///
/// # Example
/// ```
/// use depth::{Camera, View, estimate};
/// use nalgebra::Isometry3;
///
/// // A printed wall half a metre before cameras that stand 6 cm beside each other.
/// let camera = Camera { size: [96, 72], focal: [100.0; 2], centre: [48.0, 36.0] };
/// let view = |number: usize| {
///     let x = 0.06 * number as f64;
///     let print = |at: usize| {
///         let [u, v] = [(at % 96) as f64, (at / 96) as f64].map(|pixel| 0.5 * (pixel + 0.5) / 100.0);
///         let [u, v] = [u + x, v].map(|place| 300.0 * place);
///         (128.0 + 40.0 * (u.sin() + (0.7 * u + v).sin() + (1.3 * v).cos())) as f32
///     };
///     View {
///         camera,
///         camera_from_world: Isometry3::translation(-x, 0.0, 0.0),
///         grey: (0..96 * 72).map(print).collect(),
///         fine: Vec::new(),
///         range: [0.2, 2.0],
///     }
/// };
/// let depths = estimate(&[view(0), view(1), view(2)], 1, &|_| ()).expect("nobody asked for the end");
/// let middle = depths[1].depth[36 * 96 + 48];
/// assert!((middle - 0.5).abs() < 5e-3, "{middle}");
/// ```
pub fn estimate(views: &[View], seed: u64, done: &dyn Fn(f64)) -> Option<Vec<Depth>> {
    let others: Vec<Vec<usize>> = (0..views.len()).map(|view| neighbours::best(views, view, MOST)).collect();
    let edges = views.iter().map(|view| view.camera.size[0].max(view.camera.size[1]));
    let steps = steps(edges.min().unwrap_or(0));
    let work = |step: &Step| views.iter().map(|view| f64::from(step.rounds) * visited(view, step.by)).sum::<f64>();
    let all: f64 = steps.iter().map(work).sum();
    let mut spent = 0.0;
    let mut planes: Vec<Cells> = Vec::new();
    for (number, step) in steps.iter().enumerate() {
        let pictures: Vec<Picture> =
            views.iter().map(|view| Picture::reduced(&view.grey, view.camera.size, step.by)).collect();
        for of in 0..views.len() {
            let pass = pass(views, (&pictures, &planes), (of, &others[of]), (step, [seed, of as u64, number as u64]));
            let mut cells = match planes.get(of) {
                Some(cells) if cells.size == pictures[of].size => cells.clone(),
                Some(cells) => finer(cells, pictures[of].size),
                None => begun(&pass),
            };
            for round in 0..step.rounds {
                pass.sweep(&mut cells, step.round(round));
            }
            if ending::asked() {
                return None;
            }
            spent += f64::from(step.rounds) * visited(&views[of], step.by);
            done(spent / all);
            if number > 0 { planes[of] = cells } else { planes.push(cells) }
        }
    }
    let one = |of: usize| (!ending::asked()).then(|| agreed(views, &planes, of, &others[of]));
    (0..views.len()).map(one).collect()
}

/// How many pixels a round over a view works on.
fn visited(view: &View, by: usize) -> f64 {
    let wanted = if by <= FINE { wanted(view, by) } else { Vec::new() };
    let all = (view.camera.size[0] / by * (view.camera.size[1] / by)) as f64;
    if wanted.is_empty() { all } else { wanted.iter().filter(|wanted| **wanted).count() as f64 }
}

/// What a step does to a view.
fn pass<'a>(
    views: &'a [View],
    (pictures, planes): (&'a [Picture], &'a [Cells]),
    (of, others): (usize, &[usize]),
    (step, counters): (&Step, [u64; 3]),
) -> Pass<'a> {
    let view = &views[of];
    let source = |other: &usize| {
        let other = *other;
        let (there, back) = (Pair::new(view, &views[other], step.by), Pair::new(&views[other], view, step.by));
        let cells = planes.get(other).filter(|_| step.against);
        let coarser = |cells: &'a Cells| (cells, (pictures[other].size[0] / cells.size[0]) as f32);
        Source { picture: &pictures[other], pairs: [there, back], cells: cells.map(coarser) }
    };
    let sources: Vec<Source<'a>> = others.iter().map(source).collect();
    let range = [view.range[1], view.range[0]].map(|depth| 1.0 / depth as f32);
    let middle = pictures[of].size.map(|n| 0.5 * n as f32);
    let per_pixel = per_pixel(&sources, middle, range);
    Pass {
        picture: &pictures[of],
        lens: Lens::of(&view.camera.reduced(step.by)),
        sources,
        range,
        per_pixel,
        wanted: if step.by <= FINE { wanted(view, step.by) } else { Vec::new() },
        least_variance: if counters[2] == 0 { 0.0 } else { TEXTURED },
        counters,
    }
}

/// Change of inverse depth that moves the place at the middle of the picture by a pixel in the others, on the average [1/m].
fn per_pixel(sources: &[Source<'_>], middle: [f32; 2], range: [f32; 2]) -> f32 {
    let moved = |source: &Source<'_>| {
        let middle_inverse = 0.5 * (range[0] + range[1]);
        let [near, far] = [1.01, 0.99].map(|share| source.pairs[0].place(middle, share * middle_inverse));
        let (near, far) = (near?, far?);
        Some((near.at[0] - far.at[0]).hypot(near.at[1] - far.at[1]) / (0.02 * middle_inverse))
    };
    let all: Vec<f32> = sources.iter().filter_map(moved).collect();
    let mean = all.iter().sum::<f32>() / all.len().max(1) as f32;
    if mean > 0.0 { 1.0 / mean } else { range[1] - range[0] }
}

/// Planes from nowhere; a pixel's own is tried first, so its cost may be the worst.
fn begun(pass: &Pass<'_>) -> Cells {
    Cells::new(pass.picture.size, |column, row| {
        let mut random = Random::of([pass.counters[0], pass.counters[1], u64::MAX, (row as u64) << 32 | column as u64]);
        Cell { plane: pass.anywhere([column as f32 + 0.5, row as f32 + 0.5], &mut random), cost: OPPOSITE }
    })
}

/// The planes of a picture of more pixels.
fn finer(coarse: &Cells, size: [usize; 2]) -> Cells {
    let share = [0, 1].map(|i| coarse.size[i] as f32 / size[i] as f32);
    Cells::new(size, |column, row| {
        let at = [(column as f32 + 0.5) * share[0], (row as f32 + 0.5) * share[1]];
        let (x, y) = (at[0] as usize, at[1] as usize);
        let cell = coarse.at(x.min(coarse.size[0] - 1), y.min(coarse.size[1] - 1));
        let plane = cell.plane.moved([at[0] - x as f32 - 0.5, at[1] - y as f32 - 0.5]);
        let slope = [0, 1].map(|i| plane.slope[i] * share[i]);
        Cell { plane: Plane { inverse: plane.inverse, slope }, cost: cell.cost }
    })
}

/// Which pixels of fewer are wanted finely.
fn wanted(view: &View, by: usize) -> Vec<bool> {
    if view.fine.is_empty() || by == 1 {
        return view.fine.clone();
    }
    let [width, height] = view.camera.size.map(|n| n / by);
    let any = |at: usize| {
        let (column, row) = (at % width * by, at / width * by);
        (row..row + by).any(|row| view.fine[row * view.camera.size[0] + column..][..by].contains(&true))
    };
    (0..width * height).map(any).collect()
}
