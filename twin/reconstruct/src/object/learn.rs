//! The optimisation, coarse to fine: in each step some thousand rays and the smoothness of the field around its surface, one step of
//! Adam along the sum; the poses of the cameras move along. The same state and step give the same next state on any machine.

use super::adam::{Adam, Gathered, Rates};
use super::band::Band;
use super::colours;
use super::extent::Bounds;
use super::hollow::{self, Search};
use super::pool::{Pixel, Stand, corrected};
use super::ray::{Medium, Receiver, Tracer, Weights, reach};
use super::smooth::{Smoothness, at_node};
use super::start::{self, Seen};
use crate::field::{Field, Grid};
use crate::scan::Frame;
use crate::sweep::signed_distance;
use nalgebra::{Isometry3, Point3, Vector3};
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use rayon::prelude::*;

/// Parts of a step that are gathered by themselves.
const PARTS: usize = 4;
/// Rays of a step.
const RAYS: usize = 8192;
/// Of the nodes around the surface one in so many is smoothed in a step.
const SMOOTHED: usize = 4;
/// Cameras stay for this share of a level: a field without colours would lead them anywhere.
const BEFORE_POSES: f32 = 0.25;
/// How far a step moves a camera at the beginning of a level [m].
const POSE_RATE: f64 = 5e-5;
/// A camera this far from where the scan has it is drawn back as strongly as its pixels push it on the average [m].
const POSE_SIGMA: f64 = 2e-3;
/// The band around the surface is found anew after so many steps.
const BAND_STEPS: u32 = 10;
/// Distance of samples [voxel].
const PACE: f32 = 0.7;
/// Steepness of the logistic function in the end [1/voxel].
const STEEPEST: f32 = 6.0;

/// One level of the optimisation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Level {
    /// About so many nodes.
    pub(crate) nodes: f64,
    pub(crate) steps: u32,
    /// Steepness of the logistic function at its beginning and end [1/voxel].
    pub(crate) steepness: [f32; 2],
    /// Whether the cameras' poses move.
    pub(crate) poses: bool,
    /// Whether the field shall bend little.
    pub(crate) smooth: bool,
}

/// The levels of a run, the last of about `edge` cubed nodes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Plan {
    pub(crate) levels: Vec<Level>,
}

impl Plan {
    /// Without depth colours have to draw the surface in from the hull, which stands over plane sides by millimetres, and find the hollows:
    /// from coarse to fine, since a step goes farther in a coarse grid and costs less. With depth they are known, and thin walls would be
    /// lost in a coarse grid: it only serves to find the cameras' places, with which depth is then fused again. Such a wall has the ridge
    /// of its distance beside its surface there, and would become thicker by a field that is smooth; cameras would then go back from it.
    pub(crate) fn new(edge: u32, with_depth: bool) -> Self {
        // Fewer nodes need fewer steps.
        let share = (f64::from(edge) / 128.0).sqrt().min(1.0);
        let level = |part: f64, steps: f64, steepness: [f32; 2], poses: bool| Level {
            nodes: (f64::from(edge) / part).powi(3),
            steps: (steps * share).ceil() as u32,
            steepness,
            poses,
            smooth: !with_depth || part < 2.0,
        };
        let first = if with_depth { None } else { Some(level(4.0, 1200.0, [1.5, 3.0], false)) };
        let others = [level(2.0, 300.0, [2.0, 4.0], true), level(1.0, 800.0, [2.5, STEEPEST], true)];
        Self { levels: first.into_iter().chain(others).collect() }
    }

    /// Steps of all levels.
    pub(crate) fn steps(&self) -> u64 {
        self.steps_left(0, 0)
    }

    /// Steps from a place on.
    pub(crate) fn steps_left(&self, level: usize, step: u32) -> u64 {
        self.levels.iter().skip(level).map(|level| u64::from(level.steps)).sum::<u64>() - u64::from(step)
    }
}

/// Moments of the cameras' corrections.
pub(crate) type PoseMoments = ([f64; 6], [f64; 6]);

/// All that goes on from step to step.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct State {
    pub(crate) level: usize,
    pub(crate) step: u32,
    pub(crate) field: Field<f32>,
    /// Where rays look until it is found anew.
    pub(crate) band: Option<Band>,
    pub(crate) adam: Adam,
    /// Shift [m] and turn [rad] of each frame's camera about the pivot.
    pub(crate) corrections: Vec<[f64; 6]>,
    pub(crate) moments: Vec<PoseMoments>,
}

impl State {
    /// A field with the distances of the start, in grey.
    pub(crate) fn new(grid: Grid, distance: Vec<f32>, frames: usize) -> Self {
        let nodes = grid.len();
        let field = Field { grid, distance, colour: vec![[0.5; 3]; nodes] };
        let none = ([0.0; 6], [0.0; 6]);
        let (corrections, moments) = (vec![[0.0; 6]; frames], vec![none; frames]);
        Self { level: 0, step: 0, field, band: None, adam: Adam::new(nodes), corrections, moments }
    }
}

/// What the steps of one run share.
pub(crate) struct Learner<'a> {
    plan: Plan,
    frames: &'a [Frame],
    /// Standard deviation of depth at one metre [m], where there is depth.
    depth_spread: Option<f64>,
    pixels: &'a [Pixel],
    bounds: &'a Bounds,
    pivot: Point3<f64>,
    parts: Vec<Gathered>,
    /// The nodes of the band.
    near: Option<Vec<u32>>,
}

impl<'a> Learner<'a> {
    pub(crate) fn new(
        plan: Plan,
        (frames, depth_spread): (&'a [Frame], Option<f64>),
        pixels: &'a [Pixel],
        bounds: &'a Bounds,
    ) -> Self {
        Self { plan, frames, depth_spread, pixels, bounds, pivot: bounds.centre(), parts: Vec::new(), near: None }
    }

    /// One step; at the end of a level the field goes on with nodes twice as dense. `true` while there are steps left.
    pub(crate) fn step(&mut self, state: &mut State) -> bool {
        let level = self.plan.levels[state.level];
        let nodes = state.field.grid.len();
        if self.parts.first().is_none_or(|part| !part.is_for(nodes)) {
            self.parts = vec![Gathered::new(nodes); PARTS];
            self.near = None;
        }
        let progress = state.step as f32 / level.steps as f32;
        let steepness = level.steepness[0] * (level.steepness[1] / level.steepness[0]).powf(progress);
        let anew = state.band.is_none() || state.step.is_multiple_of(BAND_STEPS);
        if anew {
            state.band = Some(Band::new(&state.field.grid, &state.field.distance, reach(steepness)));
            self.near = None;
        }
        if self.near.is_none() {
            self.near = state.band.as_ref().map(|band| band.nodes(&state.field.grid));
        }
        // With depth the surface is where depth says.
        if let (true, None, Some(near)) = (anew, self.depth_spread, &self.near) {
            colours::extend(&mut state.field, near);
        }
        let by_pose = self.gather(state, steepness);
        let decay = 0.1f32.powf(progress);
        let rates = Rates { distance: 0.03 * decay, colour: 0.03 * 0.2f32.powf(progress) };
        let State { field, adam, .. } = state;
        adam.step(&mut field.distance, &mut field.colour, &mut self.parts, rates);
        if level.poses && progress > BEFORE_POSES {
            self.move_cameras(state, &by_pose, POSE_RATE * f64::from(decay));
        }
        state.step += 1;
        if state.step == level.steps {
            state.step = 0;
            state.level += 1;
            if state.level < self.plan.levels.len() {
                self.refine(state);
            }
        }
        state.level < self.plan.levels.len()
    }

    /// Nodes twice as dense. Before the last level depth is fused anew, with the cameras where they are by now; without depth what the
    /// coarser grid could not show of walls and hollows is opened.
    fn refine(&self, state: &mut State) {
        let fine = state.field.refined();
        let is_last = state.level + 1 == self.plan.levels.len();
        let poses: Vec<_> = (0..self.frames.len()).map(|frame| self.pose(state, frame)).collect();
        let begun = || signed_distance(&fine.grid, &fine.distance);
        let distance = match self.depth_spread {
            Some(spread) if is_last => {
                start::distance(&fine.grid, &Seen::all(self.frames, Some(&poses)), self.bounds, Some(spread))
            }
            Some(_) => begun(),
            None => hollow::opened(&fine.grid, begun(), (self.frames, &poses), Search::REFINED),
        };
        state.adam = Adam::new(fine.grid.len());
        state.field = Field { distance, ..fine };
    }

    /// Derivatives of a step: of the field into the parts, of the poses in steps of the grid and radians.
    fn gather(&mut self, state: &State, steepness: f32) -> Vec<[f64; 6]> {
        let field = &state.field;
        let (Some(band), Some(near)) = (&state.band, &self.near) else { return Vec::new() };
        let medium =
            Medium { grid: &field.grid, band, distance: &field.distance, colour: &field.colour, steepness, pace: PACE };
        let stands: Vec<Stand> =
            (0..self.frames.len()).map(|f| Stand::new(&field.grid, &self.pose(state, f))).collect();
        let pivot: [f32; 3] = field.grid.steps(&self.pivot).coords.map(|v| v as f32).into();
        let weights = weights(&field.grid);
        let curvature = if self.plan.levels[state.level].smooth { 0.01 } else { 0.0 };
        let smoothness = Smoothness { eikonal: 0.02, curvature };
        let seed = (state.level as u64) << 32 | u64::from(state.step);
        let pixels = self.pixels;
        let part = |number: usize, into: &mut Gathered| {
            let mut random = Pcg64::seed_from_u64(seed * PARTS as u64 + number as u64);
            let mut tracer = Tracer::new();
            let mut by_pose = vec![[0.0f64; 6]; stands.len()];
            for _ in 0..RAYS / PARTS {
                let pixel = &pixels[random.random_range(0..pixels.len())];
                let (ray, target) = stands[usize::from(pixel.frame)].look(pixel);
                let sight = tracer.see(&medium, &ray, random.random_range(0.0..1.0));
                let (_, pose) = tracer.learn(&medium, &ray, &sight, (&target, &weights), pivot, into);
                let sum = &mut by_pose[usize::from(pixel.frame)];
                (0..6).for_each(|i| sum[i] += f64::from(pose[i]));
            }
            let first = random.random_range(0..SMOOTHED);
            for node in near.iter().skip(first * PARTS + number).step_by(SMOOTHED * PARTS) {
                at_node(&field.grid, &field.distance, *node as usize, &smoothness, into);
            }
            by_pose
        };
        let parts: Vec<Vec<[f64; 6]>> =
            self.parts.par_iter_mut().enumerate().map(|(number, into)| part(number, into)).collect();
        let mut sum = vec![[0.0; 6]; stands.len()];
        for part in parts {
            sum.iter_mut().zip(part).for_each(|(sum, part)| (0..6).for_each(|i| sum[i] += part[i]));
        }
        sum
    }

    /// A frame's pose with its correction.
    pub(crate) fn pose(&self, state: &State, frame: usize) -> Isometry3<f64> {
        corrected(&self.frames[frame].scan_from_camera, &state.corrections[frame], &self.pivot)
    }

    fn move_cameras(&self, state: &mut State, by_pose: &[[f64; 6]], rate: f64) {
        let State { corrections, moments, .. } = state;
        for ((correction, moments), slope) in corrections.iter_mut().zip(moments).zip(by_pose) {
            move_camera(correction, moments, slope, rate, self.bounds.radius());
        }
        let away: Vec<Vector3<f64>> =
            self.frames.iter().map(|frame| frame.scan_from_camera * Point3::origin() - self.pivot).collect();
        without_common(corrections, &away);
    }
}

/// Takes out of the cameras' corrections what the pictures cannot show, because the object may move and grow with all cameras together:
/// the mean shift and turn, and a common retreat from the pivot; `away`: from the pivot to each camera [m]. Left free, the cameras
/// retreat where a coarse grid makes thin walls too thick, and the object stays too thick in the fine grid.
fn without_common(corrections: &mut [[f64; 6]], away: &[Vector3<f64>]) {
    let cameras = corrections.len() as f64;
    for i in 0..6 {
        let mean = corrections.iter().map(|c| c[i]).sum::<f64>() / cameras;
        corrections.iter_mut().for_each(|c| c[i] -= mean);
    }
    // About the cameras' middle, so that taking out the growth shifts nothing.
    let middle = away.iter().sum::<Vector3<f64>>() / cameras;
    let away = || away.iter().map(|away| away - middle);
    let along = |(c, away): (&[f64; 6], Vector3<f64>)| away.dot(&Vector3::new(c[0], c[1], c[2]));
    let growth = corrections.iter().zip(away()).map(along).sum::<f64>()
        / away().map(|away| away.norm_squared()).sum::<f64>().max(f64::MIN_POSITIVE);
    for (correction, away) in corrections.iter_mut().zip(away()) {
        (0..3).for_each(|i| correction[i] -= growth * away[i]);
    }
}

/// A step of Adam for one camera. It is drawn back to where the scan has it, measured by how strongly its pixels push on the average:
/// what they do not agree on leaves it there.
fn move_camera(correction: &mut [f64; 6], (first, second): &mut PoseMoments, slope: &[f64; 6], rate: f64, radius: f64) {
    for i in 0..6 {
        let unit = if i < 3 { 1.0 } else { 1.0 / radius };
        let back = second[i].sqrt() * correction[i] / (POSE_SIGMA * unit);
        let slope = slope[i] + back;
        first[i] = 0.9 * first[i] + 0.1 * slope;
        second[i] = 0.99 * second[i] + 0.01 * slope * slope;
        correction[i] -= rate * unit * (first[i] / (second[i].sqrt() + 1e-9)).clamp(-3.0, 3.0);
    }
}

fn weights(grid: &Grid) -> Weights<f32> {
    // Beyond a hundredth of a metre a depth is of something else, or of a mirror.
    Weights { colour: 1.0, mask: 0.05, depth: 0.1, depth_limit: (0.01 / grid.voxel).max(4.0) as f32 }
}

/// Receives derivatives that nobody needs.
struct Discard;

impl Receiver<f32> for Discard {
    fn distance(&mut self, _: usize, _: f32) {}

    fn colour(&mut self, _: usize, _: [f32; 3]) {}
}

/// Steps in which a camera that took no part finds its place.
const PLACED: u32 = 100;
/// Rays of each of them.
const PLACED_RAYS: usize = 2048;

/// Where a camera stands whose pixels took no part in the optimisation: its pose moves, the field stays. Of the places on its way the
/// one of least loss counts, the first included.
pub(crate) fn placed(
    field: &Field<f32>,
    pixels: &[Pixel],
    start: &Isometry3<f64>,
    pivot: Point3<f64>,
    radius: f64,
) -> Isometry3<f64> {
    let grid = &field.grid;
    let band = Band::new(grid, &field.distance, reach(STEEPEST));
    let (distance, colour) = (&field.distance[..], &field.colour[..]);
    let medium = Medium { grid, band: &band, distance, colour, steepness: STEEPEST, pace: PACE };
    let pivot_steps: [f32; 3] = grid.steps(&pivot).coords.map(|v| v as f32).into();
    let weights = weights(grid);
    // The same rays in every step, so that losses can be compared.
    let mut random = Pcg64::seed_from_u64(1);
    let rays: Vec<(&Pixel, f32)> = (0..PLACED_RAYS)
        .map(|_| (&pixels[random.random_range(0..pixels.len())], random.random_range(0.0..1.0)))
        .collect();
    let look = |correction: &[f64; 6]| {
        let stand = Stand::new(grid, &corrected(start, correction, &pivot));
        let (mut tracer, mut sum, mut slope) = (Tracer::new(), 0.0, [0.0; 6]);
        for (pixel, jitter) in &rays {
            let (ray, target) = stand.look(pixel);
            let sight = tracer.see(&medium, &ray, *jitter);
            let (loss, pose) = tracer.learn(&medium, &ray, &sight, (&target, &weights), pivot_steps, &mut Discard);
            sum += f64::from(loss);
            (0..6).for_each(|i| slope[i] += f64::from(pose[i]));
        }
        (sum, slope)
    };
    let (mut correction, mut moments) = ([0.0; 6], ([0.0; 6], [0.0; 6]));
    let (mut best, mut least) = (correction, f64::INFINITY);
    for step in 0..PLACED {
        let (loss, slope) = look(&correction);
        if loss < least {
            (best, least) = (correction, loss);
        }
        let rate = POSE_RATE * 0.1f64.powf(f64::from(step) / f64::from(PLACED));
        move_camera(&mut correction, &mut moments, &slope, rate, radius);
    }
    corrected(start, &best, &pivot)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_all_cameras_do_together_is_taken_out_and_what_each_does_alone_stays() {
        let mut random = Pcg64::seed_from_u64(4);
        let away: Vec<Vector3<f64>> =
            (0..40).map(|_| Vector3::from_fn(|axis, _| random.random_range(-0.4..0.4) + 0.1 * axis as f64)).collect();
        let mut own: Vec<[f64; 6]> =
            (0..40).map(|_| std::array::from_fn(|_| random.random_range(-1e-3..1e-3))).collect();
        without_common(&mut own, &away);
        let mut moved = own.clone();
        for (correction, away) in moved.iter_mut().zip(&away) {
            for i in 0..3 {
                correction[i] += 0.002 * away[i] + 0.003;
                correction[3 + i] -= 0.001;
            }
        }
        without_common(&mut moved, &away);
        let apart = own.iter().flatten().zip(moved.iter().flatten()).map(|(a, b)| (a - b).abs());
        assert!(apart.fold(0.0, f64::max) < 1e-12);
        assert!(own.iter().flatten().any(|value| value.abs() > 5e-4));
    }
}
