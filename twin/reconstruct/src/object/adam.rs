//! Adam (Kingma and Ba 2015) where a step has touched the field, with derivatives gathered in as many parts as there are: the sum does
//! not depend on how many threads there were.

use super::ray::Receiver;
use rayon::prelude::*;

/// Nodes of a run: whether a step has touched it is kept for all of them together.
const RUN: usize = 64;
const FIRST: f32 = 0.9;
const SECOND: f32 = 0.99;

/// Derivatives of one part of a step: distance, red, green, blue at each node.
#[derive(Debug, Clone)]
pub(crate) struct Gathered {
    values: Vec<[f32; 4]>,
    touched: Vec<bool>,
}

impl Gathered {
    pub(crate) fn new(nodes: usize) -> Self {
        Self { values: vec![[0.0; 4]; nodes], touched: vec![false; nodes.div_ceil(RUN)] }
    }

    /// Whether it is for a field of so many nodes.
    pub(crate) fn is_for(&self, nodes: usize) -> bool {
        self.values.len() == nodes
    }
}

impl Receiver<f32> for Gathered {
    #[inline]
    fn distance(&mut self, node: usize, value: f32) {
        self.values[node][0] += value;
        self.touched[node / RUN] = true;
    }

    #[inline]
    fn colour(&mut self, node: usize, [r, g, b]: [f32; 3]) {
        let values = &mut self.values[node];
        values[1] += r;
        values[2] += g;
        values[3] += b;
        self.touched[node / RUN] = true;
    }
}

/// First and second moments of every number of a field.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Adam {
    pub(crate) first: Vec<[f32; 4]>,
    pub(crate) second: Vec<[f32; 4]>,
}

/// How far a step goes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rates {
    /// Of distances [voxel].
    pub(crate) distance: f32,
    pub(crate) colour: f32,
}

impl Adam {
    pub(crate) fn new(nodes: usize) -> Self {
        Self { first: vec![[0.0; 4]; nodes], second: vec![[0.0; 4]; nodes] }
    }

    /// One step along what was gathered, which is empty afterwards.
    pub(crate) fn step(&mut self, distance: &mut [f32], colour: &mut [[f32; 3]], parts: &mut [Gathered], rates: Rates) {
        let runs = distance.len().div_ceil(RUN);
        let touched: Vec<bool> = (0..runs).map(|run| parts.iter().any(|part| part.touched[run])).collect();
        let values: Vec<_> = parts.iter_mut().map(|part| part.values.par_chunks_mut(RUN)).collect();
        let sums = sum(values, &touched);
        let fields = distance.par_chunks_mut(RUN).zip(colour.par_chunks_mut(RUN));
        let moments = self.first.par_chunks_mut(RUN).zip(self.second.par_chunks_mut(RUN));
        fields.zip(moments).zip(sums).for_each(|((field, moments), sum)| {
            let Some(sum) = sum else { return };
            let ((distance, colour), (first, second)) = (field, moments);
            for node in 0..distance.len() {
                let mut way = [0.0; 4];
                for i in 0..4 {
                    let slope = sum[node][i];
                    let (m, v) = (&mut first[node][i], &mut second[node][i]);
                    *m = FIRST * *m + (1.0 - FIRST) * slope;
                    *v = SECOND * *v + (1.0 - SECOND) * slope * slope;
                    // Both begin at nothing: the ratio of their corrections tends to one within a few steps.
                    way[i] = *m / (v.sqrt() + 1e-8);
                }
                distance[node] -= rates.distance * way[0].clamp(-3.0, 3.0);
                (0..3).for_each(|c| colour[node][c] -= rates.colour * way[1 + c].clamp(-3.0, 3.0));
            }
        });
        parts.par_iter_mut().for_each(|part| part.touched.fill(false));
    }
}

type Chunks<'a> = rayon::slice::ChunksMut<'a, [f32; 4]>;

/// The sum of all parts run by run, `None` where none was touched; the parts are empty afterwards.
fn sum(parts: Vec<Chunks<'_>>, touched: &[bool]) -> Vec<Option<Vec<[f32; 4]>>> {
    let mut sums: Vec<Option<Vec<[f32; 4]>>> =
        touched.iter().map(|touched| touched.then(|| vec![[0.0; 4]; RUN])).collect();
    for part in parts {
        part.zip(&mut sums).for_each(|(values, sum)| {
            let Some(sum) = sum else { return };
            for (sum, value) in sum.iter_mut().zip(values.iter_mut()) {
                (0..4).for_each(|i| sum[i] += value[i]);
                *value = [0.0; 4];
            }
        });
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_goes_down_where_something_was_gathered_and_nowhere_else() {
        let (mut distance, mut colour) = (vec![1.0; 200], vec![[0.5; 3]; 200]);
        let mut adam = Adam::new(200);
        let mut parts = vec![Gathered::new(200); 2];
        for _ in 0..100 {
            parts[0].distance(3, 2.0 * distance[3]);
            parts[1].colour(70, [colour[70][0] - 0.9, 0.0, 0.0]);
            adam.step(&mut distance, &mut colour, &mut parts, Rates { distance: 0.05, colour: 0.02 });
        }
        assert!(distance[3].abs() < 0.2 && (colour[70][0] - 0.9).abs() < 0.05, "{} {:?}", distance[3], colour[70]);
        assert!(distance[4] == 1.0 && distance[199] == 1.0 && colour[71] == [0.5; 3]);
    }
}
