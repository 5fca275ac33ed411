//! A picture as a worse camera would have taken it: what stereo matching does that the simulated camera does not.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

const WIDTH: usize = 640;
const HEIGHT: usize = 480;
/// Near surfaces grow by so many pixels.
const FATTENED: usize = 2;
/// To the left of a near surface one of the two imagers sees nothing of what lies behind [pixel].
const SHADOW: usize = 6;
/// Errors that neighbours share: a lattice of this width [pixel], and their size [1/m].
const LATTICE: usize = 12;
const SHARED: f32 = 0.0015;
/// All distances are too long by this factor.
const TOO_FAR: f32 = 1.01;
/// Squares without a measurement.
const HOLES: usize = 500;

/// Spoils colour and depth (millimetres, little-endian).
pub(crate) fn roughen(seed: u64, color: &mut [u8], depth: &mut [u8]) {
    let mut random = Pcg64::seed_from_u64(seed);
    let counts = depth.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]]));
    let mut seen: Vec<f32> = counts.map(|c| if c == 0 { 0.0 } else { 1000.0 / f32::from(c) }).collect();
    seen = fattened(&seen);
    let nodes: Vec<f32> = (0..(WIDTH / LATTICE + 2) * (HEIGHT / LATTICE + 2))
        .map(|_| SHARED * 1.7 * random.random_range(-1.0..1.0_f32))
        .collect();
    for v in 0..HEIGHT {
        for u in 0..WIDTH {
            let at = v * WIDTH + u;
            let node = |dv: usize, du: usize| nodes[(v / LATTICE + dv) * (WIDTH / LATTICE + 2) + u / LATTICE + du];
            let (x, y) = ((u % LATTICE) as f32 / LATTICE as f32, (v % LATTICE) as f32 / LATTICE as f32);
            let top = node(0, 0) * (1.0 - x) + node(0, 1) * x;
            let bottom = node(1, 0) * (1.0 - x) + node(1, 1) * x;
            if seen[at] > 0.0 {
                seen[at] += top * (1.0 - y) + bottom * y;
            }
        }
    }
    let whole = seen.clone();
    for v in 0..HEIGHT {
        for u in 0..WIDTH - SHADOW {
            let at = v * WIDTH + u;
            if whole[at + SHADOW] - whole[at] > 0.03 {
                seen[at..at + SHADOW].fill(0.0);
            }
        }
    }
    for _ in 0..HOLES {
        let (u, v) = (random.random_range(0..WIDTH - 5), random.random_range(0..HEIGHT - 5));
        for row in v..v + 5 {
            seen[row * WIDTH + u..row * WIDTH + u + 5].fill(0.0);
        }
    }
    for (bytes, seen) in depth.chunks_exact_mut(2).zip(&seen) {
        let count = if *seen > 0.0 { (1000.0 * TOO_FAR / seen + 0.5) as u16 } else { 0 };
        bytes.copy_from_slice(&count.to_le_bytes());
    }
    blur(color);
    for byte in color.iter_mut() {
        *byte = (i32::from(*byte) + random.random_range(-12..=12)).clamp(0, 255) as u8;
    }
}

fn fattened(seen: &[f32]) -> Vec<f32> {
    let mut out = seen.to_vec();
    for v in FATTENED..HEIGHT - FATTENED {
        for u in FATTENED..WIDTH - FATTENED {
            let at = v * WIDTH + u;
            let nearest = (v - FATTENED..=v + FATTENED)
                .flat_map(|y| seen[y * WIDTH + u - FATTENED..=y * WIDTH + u + FATTENED].iter())
                .fold(0.0_f32, |m, s| m.max(*s));
            // Only across an edge: within a surface the window's mean counts.
            if nearest - seen[at] > 0.015 {
                out[at] = nearest;
            }
        }
    }
    out
}

/// Mean of three by three pixels.
fn blur(color: &mut [u8]) {
    let sharp = color.to_vec();
    for v in 1..HEIGHT - 1 {
        for i in 3..3 * WIDTH - 3 {
            let at = |dv: usize, di: usize| u32::from(sharp[(v + dv - 1) * 3 * WIDTH + i + di - 3]);
            let sum: u32 = (0..3).map(|dv| at(dv, 0) + at(dv, 3) + at(dv, 6)).sum();
            color[v * 3 * WIDTH + i] = (sum / 9) as u8;
        }
    }
}
