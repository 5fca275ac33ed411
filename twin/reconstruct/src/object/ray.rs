//! One ray through the field: what it sees, and how that changes with every number of the field. The opacity of a section is
//! NeuS's (Wang et al. 2021, equation 13), from the logistic function of the signed distance at its ends; the derivatives are written
//! out by hand. Lengths in steps of the grid, so that every level is alike.

use super::band::Band;
use crate::field::{Cell, Grid};
use nalgebra::{RealField, convert};

/// Samples for which there is room from the start.
const SAMPLES: usize = 64;
/// Exponent of the logistic function at which all light passes.
const CLEAR_EXPONENT: f64 = 6.0;
/// What is left of the light behind which nothing counts.
const DARK: f64 = 1e-3;
/// A section of less weight shows no colour.
const FAINT: f64 = 1e-4;
/// Exponents of the logistic function are cut here.
const STEEPEST: f64 = 18.0;
/// Depth of a ray that enters the surface with less than this cosine to its normal says nothing: it changes with every unevenness.
const GRAZING: f64 = 0.1;
/// Opacities in logarithms keep this distance from 0 and 1: a mask that is wrong by some pixels pushes no harder.
const CLEAR: f64 = 0.1;

/// A ray [steps].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ray<T> {
    /// Where it begins: the camera.
    pub(crate) origin: [T; 3],
    /// Of length one.
    pub(crate) direction: [T; 3],
    /// Depth along the camera's axis of one step along the ray.
    pub(crate) axial: T,
}

/// What a picture says about a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Target<T> {
    /// Colour, where the object's is seen.
    pub(crate) colour: Option<[T; 3]>,
    /// 1 where the object is seen, else 0.
    pub(crate) mask: T,
    /// Depth along the camera's axis [step], where it was measured.
    pub(crate) depth: Option<T>,
}

/// Weights of the terms.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Weights<T> {
    pub(crate) colour: T,
    pub(crate) mask: T,
    pub(crate) depth: T,
    /// Depths off by more than this are of something else [step].
    pub(crate) depth_limit: T,
}

/// What a ray sees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sight<T> {
    pub(crate) colour: [T; 3],
    /// 0 to 1.
    pub(crate) opacity: T,
    /// Depth along the camera's axis where the ray enters the surface [step], 0 where it enters none or only grazes it.
    pub(crate) depth: T,
}

/// A field as rays read it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Medium<'a, T> {
    pub(crate) grid: &'a Grid,
    pub(crate) band: &'a Band,
    pub(crate) distance: &'a [T],
    pub(crate) colour: &'a [[T; 3]],
    /// Steepness of the logistic function [1/step].
    pub(crate) steepness: T,
    /// Distance of samples [step].
    pub(crate) pace: T,
}

pub(crate) trait Receiver<T> {
    /// Of the distances and colours at a node.
    fn distance(&mut self, node: usize, value: T);
    /// Of the colour at a node.
    fn colour(&mut self, node: usize, value: [T; 3]);
}

#[derive(Debug, Clone, Copy)]
struct Sample<T> {
    t: T,
    cell: Cell<T>,
    nodes: [T; 8],
    /// Signed distance [step].
    distance: T,
    /// Logistic function of it.
    phi: T,
    /// Whether it changes with the distance.
    live: bool,
}

#[derive(Debug, Clone, Copy)]
struct Section<T> {
    /// Its first sample.
    first: usize,
    /// Light that reaches it.
    light: T,
    opacity: T,
    middle: T,
    /// Cell of its middle and the colour there, where it counts.
    colour: Option<(Cell<T>, [T; 3])>,
}

/// Memory of one ray after the other.
#[derive(Debug)]
pub(crate) struct Tracer<T> {
    samples: Vec<Sample<T>>,
    sections: Vec<Section<T>>,
    /// First sample of the section in which the ray enters the surface.
    entry: Option<usize>,
}

/// Farther from the surface than this nothing takes light from a ray [step].
pub(crate) fn reach<T: RealField + Copy>(steepness: T) -> T {
    convert::<_, T>(CLEAR_EXPONENT) / steepness + T::one()
}

fn at<T: RealField + Copy>(ray: &Ray<T>, t: T) -> [T; 3] {
    [0, 1, 2].map(|axis| ray.origin[axis] + ray.direction[axis] * t)
}

impl<T: RealField + Copy> Tracer<T> {
    pub(crate) fn new() -> Self {
        Self { samples: Vec::with_capacity(SAMPLES), sections: Vec::with_capacity(SAMPLES), entry: None }
    }

    /// Follows a ray; samples lie at `(n + jitter) * pace` from its origin.
    pub(crate) fn see(&mut self, medium: &Medium<'_, T>, ray: &Ray<T>, jitter: T) -> Sight<T> {
        self.samples.clear();
        self.sections.clear();
        self.entry = None;
        let one = T::one();
        let mut sight = Sight { colour: [T::zero(); 3], opacity: T::zero(), depth: T::zero() };
        let Some((enter, leave)) = through(medium.grid, ray) else { return sight };
        let (mut number, last) = ((enter / medium.pace - jitter).ceil(), leave / medium.pace - jitter);
        let mut light = one;
        let mut linked = false;
        let reach = reach(medium.steepness);
        while number < last {
            let t = (number + jitter) * medium.pace;
            number += one;
            let Some(sample) = sample(medium, ray, t).filter(|sample| sample.distance < reach) else {
                linked = false;
                continue;
            };
            let before = self.samples.len();
            self.samples.push(sample);
            if linked {
                let Sample { distance, phi, .. } = self.samples[before - 1];
                let phi = [phi, sample.phi];
                if self.entry.is_none() && distance >= T::zero() && sample.distance < T::zero() {
                    self.entry = Some(before - 1);
                    sight.depth = depth(ray, t, [distance, sample.distance], medium.pace);
                }
                let opacity = (one - phi[1] / phi[0]).max(T::zero());
                let middle = t - medium.pace * convert(0.5);
                let weight = light * opacity;
                let colour = (weight > convert(FAINT)).then(|| colour(medium, ray, middle)).flatten();
                if let Some((_, colour)) = colour {
                    (0..3).for_each(|c| sight.colour[c] += weight * colour[c]);
                }
                self.sections.push(Section { first: before - 1, light, opacity, middle, colour });
                light *= one - opacity;
                if light < convert(DARK) {
                    break;
                }
            }
            linked = true;
        }
        sight.opacity = one - light;
        sight
    }

    /// Loss of the ray that was seen last, and its derivatives: by the field into `into`, by a shift of the ray and by a turn about
    /// `pivot` [step] in what is returned beside it.
    pub(crate) fn learn(
        &self,
        medium: &Medium<'_, T>,
        ray: &Ray<T>,
        sight: &Sight<T>,
        (target, weights): (&Target<T>, &Weights<T>),
        pivot: [T; 3],
        into: &mut impl Receiver<T>,
    ) -> (T, [T; 6]) {
        let (loss, by_colour, by_opacity, by_depth) = blame(sight, target, weights);
        let mut pose = [T::zero(); 6];
        let mut moved = |place: [T; 3], by: [T; 3]| {
            let arm = [0, 1, 2].map(|axis| place[axis] - pivot[axis]);
            for axis in 0..3 {
                let (next, after) = ((axis + 1) % 3, (axis + 2) % 3);
                pose[axis] += by[axis];
                pose[3 + axis] += arm[next] * by[after] - arm[after] * by[next];
            }
        };
        let mut behind = T::zero();
        for section in self.sections.iter().rev() {
            let mut by_weight = by_opacity;
            let weight = section.light * section.opacity;
            if let Some((cell, colour)) = section.colour {
                let mut slope = [T::zero(); 3];
                let nodes = medium.grid.nodes(cell.base);
                for c in 0..3 {
                    by_weight += by_colour[c] * colour[c];
                    if by_colour[c] != T::zero() {
                        let along = cell.slope(nodes.map(|node| medium.colour[node][c]));
                        (0..3).for_each(|axis| slope[axis] += weight * by_colour[c] * along[axis]);
                    }
                }
                if by_colour.iter().any(|c| *c != T::zero()) {
                    for (node, share) in nodes.into_iter().zip(cell.weights()) {
                        into.colour(node, by_colour.map(|c| c * weight * share));
                    }
                    moved(at(ray, section.middle), slope);
                }
            }
            let by_section = section.light * by_weight - behind / (T::one() - section.opacity).max(convert(1e-12));
            behind += weight * by_weight;
            if section.opacity <= T::zero() {
                continue;
            }
            let [near, far] = [self.samples[section.first], self.samples[section.first + 1]];
            let share = medium.steepness * far.phi / near.phi;
            for (sample, factor) in [(near, share * (T::one() - near.phi)), (far, -share * (T::one() - far.phi))] {
                if sample.live {
                    sample.moved(medium, ray, by_section * factor, into, &mut moved);
                }
            }
        }
        if let (Some(entry), true) = (self.entry, by_depth != T::zero()) {
            let [near, far] = [self.samples[entry], self.samples[entry + 1]];
            let each = by_depth * ray.axial * medium.pace / (near.distance - far.distance).powi(2);
            near.moved(medium, ray, -each * far.distance, into, &mut moved);
            far.moved(medium, ray, each * near.distance, into, &mut moved);
        }
        (loss, pose)
    }
}

impl<T: RealField + Copy> Sample<T> {
    /// Hands on a derivative by the distance at this sample: to the nodes around it, and to `moved` with the place.
    #[inline]
    fn moved(
        &self,
        medium: &Medium<'_, T>,
        ray: &Ray<T>,
        by_distance: T,
        into: &mut impl Receiver<T>,
        moved: &mut impl FnMut([T; 3], [T; 3]),
    ) {
        for (node, weight) in medium.grid.nodes(self.cell.base).into_iter().zip(self.cell.weights()) {
            into.distance(node, by_distance * weight);
        }
        moved(at(ray, self.t), self.cell.slope(self.nodes).map(|slope| slope * by_distance));
    }
}

/// Depth at which a ray enters the surface, between two samples with these distances, the second at `t`. The mean over all sections
/// would be off towards what stands behind a wall that is not quite opaque; an optimisation along it makes such walls thicker.
#[inline]
fn depth<T: RealField + Copy>(ray: &Ray<T>, t: T, [near, far]: [T; 2], pace: T) -> T {
    let fall = near - far;
    if fall < pace * convert(GRAZING) { T::zero() } else { (t + pace * far / fall) * ray.axial }
}

/// Where a ray enters and leaves the box [step]; `None` where it misses it.
fn through<T: RealField + Copy>(grid: &Grid, ray: &Ray<T>) -> Option<(T, T)> {
    let (mut enter, mut leave): (T, T) = (T::zero(), convert(1e9));
    for axis in 0..3 {
        let edge: T = convert((grid.dims[axis] - 1) as f64);
        let inverse = T::one() / ray.direction[axis];
        let (a, b) = (-ray.origin[axis] * inverse, (edge - ray.origin[axis]) * inverse);
        if a.is_finite() && b.is_finite() {
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        } else if ray.origin[axis] < T::zero() || ray.origin[axis] > edge {
            return None;
        }
    }
    (enter < leave).then_some((enter, leave))
}

#[inline]
fn sample<T: RealField + Copy>(medium: &Medium<'_, T>, ray: &Ray<T>, t: T) -> Option<Sample<T>> {
    let place = at(ray, t);
    let cell = medium.grid.cell(place)?;
    if !medium.band.holds(cell.node) {
        return None;
    }
    let nodes = medium.grid.nodes(cell.base).map(|node| medium.distance[node]);
    let distance = nodes.iter().zip(cell.weights()).fold(T::zero(), |sum, (value, weight)| sum + *value * weight);
    let exponent = (medium.steepness * distance).clamp(convert(-STEEPEST), convert(STEEPEST));
    let phi = T::one() / (T::one() + (-exponent).exp());
    Some(Sample { t, cell, nodes, distance, phi, live: exponent.abs() < convert(STEEPEST) })
}

#[inline]
fn colour<T: RealField + Copy>(medium: &Medium<'_, T>, ray: &Ray<T>, t: T) -> Option<(Cell<T>, [T; 3])> {
    let cell = medium.grid.cell(at(ray, t))?;
    let mut sum = [T::zero(); 3];
    for (node, weight) in medium.grid.nodes(cell.base).into_iter().zip(cell.weights()) {
        (0..3).for_each(|c| sum[c] += medium.colour[node][c] * weight);
    }
    Some((cell, sum))
}

/// The loss and its derivatives by colour, opacity and depth.
fn blame<T: RealField + Copy>(sight: &Sight<T>, target: &Target<T>, weights: &Weights<T>) -> (T, [T; 3], T, T) {
    let (mut loss, mut by_colour, mut by_depth) = (T::zero(), [T::zero(); 3], T::zero());
    let third: T = convert(1.0 / 3.0);
    if let Some(colour) = target.colour {
        for c in 0..3 {
            let off = sight.colour[c] - colour[c];
            loss += weights.colour * third * off.abs();
            by_colour[c] = weights.colour * third * off.signum();
        }
    }
    let (low, high) = (convert(CLEAR), convert(1.0 - CLEAR));
    let opacity = sight.opacity.clamp(low, high);
    let (inside, outside) = (target.mask, T::one() - target.mask);
    loss -= weights.mask * (inside * opacity.ln() + outside * (T::one() - opacity).ln());
    let cut = sight.opacity < low || sight.opacity > high;
    let by_opacity = if cut { T::zero() } else { weights.mask * (outside / (T::one() - opacity) - inside / opacity) };
    if let (Some(depth), true) = (target.depth, sight.depth > T::zero()) {
        let off = sight.depth - depth;
        if off.abs() < weights.depth_limit {
            loss += weights.depth * off.abs();
            by_depth = weights.depth * off.signum();
        }
    }
    (loss, by_colour, by_opacity, by_depth)
}

#[cfg(test)]
mod tests;
