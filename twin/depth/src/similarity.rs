//! How alike two views see a slanted window: normalised cross-correlation, in which pixels count that look like the middle one, since
//! they are of the same surface (Schoenberger et al., "Pixelwise view selection for unstructured multi-view stereo", ECCV 2016, section 4).

use crate::picture::Picture;

/// Pixels along an edge of the window, every second of eleven.
const EDGE: usize = 6;
/// Pixels of a window.
pub(crate) const SAMPLES: usize = EDGE * EDGE;
/// Half an edge of the window [pixel].
pub(crate) const HALF: f32 = 5.0;
/// Sums are taken in so many parts, which a processor adds at once.
const LANES: usize = 4;
/// Brightness this far from the middle one's counts half [of 255], as the source has it (0.2 of 1).
const SAME_SURFACE: f32 = 51.0;
/// Variance that is noise of the pixels [of 255, squared]: where there is no more, pictures are not alike.
const NOISE: f32 = 2.0;
/// The most that windows can differ: of opposite sign.
pub(crate) const OPPOSITE: f32 = 2.0;

/// Columns and rows of the window's pixels from its middle.
const OFFSETS: [[f32; SAMPLES]; 2] = offsets();

const fn offsets() -> [[f32; SAMPLES]; 2] {
    let mut all = [[0.0; SAMPLES]; 2];
    let mut at = 0;
    while at < SAMPLES {
        all[0][at] = (2 * (at % EDGE)) as f32 - HALF;
        all[1][at] = (2 * (at / EDGE)) as f32 - HALF;
        at += 1;
    }
    all
}

/// The pixels around one, as they count.
pub(crate) struct Window {
    /// They add up to 1.
    weight: [f32; SAMPLES],
    /// Weight times the distance of the brightness from its mean.
    centred: [f32; SAMPLES],
    /// Of the brightness [of 255, squared].
    pub(crate) variance: f32,
}

impl Window {
    /// Around a pixel; beyond the picture's edge its last pixels go on.
    pub(crate) fn of(picture: &Picture, column: usize, row: usize) -> Self {
        let [width, height] = picture.size;
        let within = |at: usize, by: f32, size: usize| (at as i64 + by as i64).clamp(0, size as i64 - 1) as usize;
        let mut grey = [0.0; SAMPLES];
        for (grey, (x, y)) in grey.iter_mut().zip(OFFSETS[0].iter().zip(&OFFSETS[1])) {
            *grey = picture.grey[within(row, *y, height) * width + within(column, *x, width)];
        }
        let own = picture.grey[row * width + column];
        let (mut weight, mut total, mut mean) = ([0.0; SAMPLES], 0.0, 0.0);
        for (at, weight) in weight.iter_mut().enumerate() {
            let (off, away) = ((grey[at] - own) / SAME_SURFACE, OFFSETS.map(|o| o[at] / (2.0 * HALF)));
            *weight = 1.0 / ((1.0 + off * off) * (1.0 + away[0] * away[0] + away[1] * away[1]));
            total += *weight;
            mean += *weight * grey[at];
        }
        mean /= total;
        let (mut centred, mut variance) = ([0.0; SAMPLES], 0.0);
        for (at, weight) in weight.iter_mut().enumerate() {
            *weight /= total;
            centred[at] = *weight * (grey[at] - mean);
            variance += centred[at] * (grey[at] - mean);
        }
        Self { weight, centred, variance }
    }

    /// One minus the correlation with what another picture shows through a homography, from 0 to [`OPPOSITE`]: that where the middle is
    /// not in the picture.
    pub(crate) fn difference(&self, other: &Picture, homography: &[[f32; 3]; 3]) -> f32 {
        let [h_u, h_v, h_q] = homography;
        let ([width, height], middle) = (other.size, [h_u[0] / h_q[0], h_v[0] / h_q[0]]);
        let inside = middle[0] >= 0.0 && middle[1] >= 0.0 && middle[0] < width as f32 && middle[1] < height as f32;
        // All of the window lies before the camera.
        if !inside || h_q[0] <= HALF * (h_q[1].abs() + h_q[2].abs()) {
            return OPPOSITE;
        }
        let last = [(width - 2) as f32, (height - 2) as f32];
        let (mut index, mut right, mut down) = ([0u32; SAMPLES], [0.0; SAMPLES], [0.0; SAMPLES]);
        for at in 0..SAMPLES {
            let (x, y) = (OFFSETS[0][at], OFFSETS[1][at]);
            let per = 1.0 / (h_q[0] + h_q[1] * x + h_q[2] * y);
            let u = within((h_u[0] + h_u[1] * x + h_u[2] * y) * per - 0.5, last[0]);
            let v = within((h_v[0] + h_v[1] * x + h_v[2] * y) * per - 0.5, last[1]);
            let (column, row) = (whole(u), whole(v));
            right[at] = u - column;
            down[at] = v - row;
            index[at] = (row * width as f32 + column + BITS).to_bits() - BITS.to_bits();
        }
        let mut corners = [[0.0; SAMPLES]; 4];
        let (grey, under) = (&other.grey[..], &other.grey[width..]);
        let under = &under[..under.len()];
        for at in 0..SAMPLES {
            let index = index[at] as usize;
            let (above, below) = (&grey[index..index + 2], &under[index..index + 2]);
            (corners[0][at], corners[1][at]) = (above[0], above[1]);
            (corners[2][at], corners[3][at]) = (below[0], below[1]);
        }
        let mut seen = [0.0; SAMPLES];
        for (at, seen) in seen.iter_mut().enumerate() {
            let above = corners[0][at] + right[at] * (corners[1][at] - corners[0][at]);
            let below = corners[2][at] + right[at] * (corners[3][at] - corners[2][at]);
            *seen = above + down[at] * (below - above);
        }
        let (mut sum, mut squares, mut products) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);

        for ((seen, weight), centred) in lanes(&seen).iter().zip(lanes(&self.weight)).zip(lanes(&self.centred)) {
            for lane in 0..LANES {
                sum[lane] += weight[lane] * seen[lane];
                squares[lane] += weight[lane] * seen[lane] * seen[lane];
                products[lane] += centred[lane] * seen[lane];
            }
        }
        let [mean, squares, products] = [sum, squares, products].map(|lanes| lanes.iter().sum::<f32>());
        let variance = (squares - mean * mean).max(0.0);
        (1.0 - products / ((self.variance + NOISE) * (variance + NOISE)).sqrt()).clamp(0.0, OPPOSITE)
    }
}

/// Added to a whole number below it, this makes the number the lowest bits of the sum: 2^23. Pictures have fewer pixels.
const BITS: f32 = 8_388_608.0;
/// Added to a smaller number of either sign, this leaves no room for parts of one: 1.5 times as much.
const WHOLE: f32 = 12_582_912.0;

/// The pixel before a place, or where the place is in its middle the one before that: both are as good for a mean of the two.
#[inline(always)]
fn whole(at: f32) -> f32 {
    (at - 0.5 + WHOLE) - WHOLE
}

#[inline(always)]
fn within(at: f32, last: f32) -> f32 {
    let at = if at > 0.0 { at } else { 0.0 };
    if at < last { at } else { last }
}

#[inline(always)]
fn lanes(values: &[f32; SAMPLES]) -> &[[f32; LANES]] {
    values.as_chunks::<LANES>().0
}
