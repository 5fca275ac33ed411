//! Exact distances to the nearest marked pixel (Felzenszwalb & Huttenlocher 2012: lower envelope of parabolas, rows
//! then columns, linear in the number of pixels).

use super::grid::Grid;

/// Stands for "nowhere": larger than any squared distance in a picture, small enough to keep its digits.
const NOWHERE: f32 = 1e9;

/// Distance of every pixel centre to the nearest one that is `marked` [pixel]; `f32::INFINITY` where none is.
pub(super) fn distance(width: usize, height: usize, mut marked: impl FnMut(usize) -> bool) -> Grid {
    let mut squared: Vec<f32> = (0..width * height).map(|i| if marked(i) { 0.0 } else { NOWHERE }).collect();
    let mut line = Envelope::new(width.max(height));
    let mut column = vec![0.0; height];
    for x in 0..width {
        for y in 0..height {
            column[y] = squared[y * width + x];
        }
        line.transform(&mut column);
        for y in 0..height {
            squared[y * width + x] = column[y];
        }
    }
    for row in squared.chunks_exact_mut(width) {
        line.transform(row);
    }
    let root = |d: f32| if d >= NOWHERE / 2.0 { f32::INFINITY } else { d.sqrt() };
    Grid { width, height, values: squared.into_iter().map(root).collect() }
}

/// Distance to the border between inside and outside [pixel], negative inside; the border runs half-way between pixel
/// centres. The picture's own edge is no border.
pub(super) fn signed_distance(width: usize, height: usize, inside: &[bool]) -> Grid {
    let mut out = distance(width, height, |i| inside[i]);
    let within = distance(width, height, |i| !inside[i]);
    for ((value, within), inside) in out.values.iter_mut().zip(&within.values).zip(inside) {
        *value = if *inside { 0.5 - within } else { *value - 0.5 };
    }
    out
}

struct Envelope {
    /// Which parabola is lowest from `begins` on.
    lowest: Vec<usize>,
    begins: Vec<f32>,
    source: Vec<f32>,
}

impl Envelope {
    fn new(longest: usize) -> Self {
        Self { lowest: vec![0; longest], begins: vec![0.0; longest + 1], source: vec![0.0; longest] }
    }

    fn transform(&mut self, line: &mut [f32]) {
        let n = line.len();
        self.source[..n].copy_from_slice(line);
        let f = &self.source;
        let square = |i: usize| (i * i) as f32;
        let mut k = 0;
        self.lowest[0] = 0;
        self.begins[0] = f32::NEG_INFINITY;
        self.begins[1] = f32::INFINITY;
        for q in 1..n {
            // The first parabola begins at minus infinity, so the search for the one before ends there.
            let meets = loop {
                let p = self.lowest[k];
                let meets = ((f[q] - f[p]) + (square(q) - square(p))) / (2 * (q - p)) as f32;
                if meets > self.begins[k] {
                    break meets;
                }
                k -= 1;
            };
            k += 1;
            self.lowest[k] = q;
            self.begins[k] = meets;
            self.begins[k + 1] = f32::INFINITY;
        }
        let mut k = 0;
        for (x, value) in line.iter_mut().enumerate() {
            while self.begins[k + 1] < x as f32 {
                k += 1;
            }
            let p = self.lowest[k];
            *value = f[p] + square(x.abs_diff(p));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn distances_are_those_of_a_search_over_all_marked_pixels(
            width in 1usize..14, height in 1usize..14, marks in prop::collection::vec(0usize..196, 0..9),
        ) {
            let found = distance(width, height, |i| marks.contains(&i));
            for i in 0..width * height {
                let to = |m: &usize| {
                    let (dx, dy) = ((i % width).abs_diff(m % width), (i / width).abs_diff(m / width));
                    ((dx * dx + dy * dy) as f32).sqrt()
                };
                let nearest = marks.iter().filter(|m| **m < width * height).map(to).fold(f32::INFINITY, f32::min);
                prop_assert!(found.values[i] == nearest || (found.values[i] - nearest).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn the_border_lies_half_way_between_inside_and_outside() {
        let inside: Vec<bool> = (0..10).map(|x| x >= 4).collect();
        let distance = signed_distance(10, 1, &inside);
        assert_eq!(distance.sample(3.5, 0.0), Some(0.0));
        assert_eq!((distance.at(0, 0), distance.at(9, 0)), (3.5, -5.5));
    }
}
