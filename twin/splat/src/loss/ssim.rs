//! Structural similarity of two pictures (Wang et al. 2004: a Gaussian window of 11 pixels, sigma 1.5, black beyond the border,
//! as 3DGS trains with) and its slope over the first of them.

use crate::real::Real;
use rayon::prelude::*;

const WINDOW: usize = 11;
const REACH: usize = WINDOW / 2;
const SIGMA: f64 = 1.5;
/// Steadies the quotient where both are dark, and where both are even; values lie between 0 and 1.
const DARK: f64 = 1e-4;
const EVEN: f64 = 9e-4;

/// The window's weights, of which the sum is 1.
fn window<T: Real>() -> [T; WINDOW] {
    let bell: [f64; WINDOW] = std::array::from_fn(|i| {
        let x = i as f64 - REACH as f64;
        (-0.5 * x * x / (SIGMA * SIGMA)).exp()
    });
    let sum: f64 = bell.iter().sum();
    bell.map(|b| T::of(b / sum))
}

/// Planes of one size, seen through the window along rows; `rows` makes row `y` of each.
fn along_rows<T: Real, const P: usize>(size: [usize; 2], fill: impl Fn(usize, usize) -> [T; P] + Sync) -> [Vec<T>; P] {
    let [width, height] = size;
    let weights = window::<T>();
    let mut flat: Vec<T> = vec![T::zero(); P * width * height];
    flat.par_chunks_mut((P * width).max(1)).enumerate().with_min_len(8).for_each(|(y, out)| {
        let mut row = vec![T::zero(); P * (width + 2 * REACH)];
        for x in 0..width {
            let values = fill(x, y);
            (0..P).for_each(|p| row[p * (width + 2 * REACH) + REACH + x] = values[p]);
        }
        for (out, row) in out.chunks_exact_mut(width).zip(row.chunks_exact(width + 2 * REACH)) {
            for (weight, shifted) in weights.iter().zip(row.windows(width)) {
                out.iter_mut().zip(shifted).for_each(|(out, value)| *out += *weight * *value);
            }
        }
    });
    std::array::from_fn(|p| {
        flat.chunks_exact((P * width).max(1)).flat_map(|row| row[p * width..(p + 1) * width].iter().copied()).collect()
    })
}

/// Row `y` of planes, seen through the window along columns.
fn along_columns<T: Real, const P: usize>(planes: &[Vec<T>; P], y: usize, width: usize, out: &mut [Vec<T>; P]) {
    let height = planes[0].len() / width.max(1);
    let weights = window::<T>();
    for (out, plane) in out.iter_mut().zip(planes) {
        out.clear();
        out.resize(width, T::zero());
        for row in y.saturating_sub(REACH)..(y + REACH + 1).min(height) {
            let weight = weights[row + REACH - y];
            out.iter_mut().zip(&plane[row * width..][..width]).for_each(|(out, value)| *out += weight * *value);
        }
    }
}

/// Sum of the similarity over all pixels, and its slope over every value of `seen`.
pub(super) fn ssim<T: Real>(seen: &[T], wanted: &[T], size: [usize; 2]) -> (T, Vec<T>) {
    let width = size[0];
    let moments = along_rows(size, |x, y| {
        let (a, b) = (seen[y * width + x], wanted[y * width + x]);
        [a, b, a * a, b * b, a * b]
    });
    // At each pixel the similarity, and its slopes over what the window makes of seen, seen², and seen times wanted.
    let mut parts = vec![[T::zero(); 4]; seen.len()];
    parts.par_chunks_mut(width.max(1)).enumerate().with_min_len(8).for_each_init(
        || std::array::from_fn::<_, 5, _>(|_| Vec::new()),
        |rows, (y, parts)| {
            along_columns(&moments, y, width, rows);
            for (x, part) in parts.iter_mut().enumerate() {
                *part = similarity([0, 1, 2, 3, 4].map(|i| rows[i][x]));
            }
        },
    );
    let sum = parts.chunks(width.max(1)).map(|row| row.iter().fold(T::zero(), |sum, part| sum + part[0]));
    let sum = sum.fold(T::zero(), |sum, row| sum + row);
    let slopes = along_rows(size, |x, y| {
        let [_, a, b, c] = parts[y * width + x];
        [a, b, c]
    });
    let mut out = vec![T::zero(); seen.len()];
    out.par_chunks_mut(width.max(1)).enumerate().with_min_len(8).for_each_init(
        || std::array::from_fn::<_, 3, _>(|_| Vec::new()),
        |rows, (y, out)| {
            along_columns(&slopes, y, width, rows);
            for (x, out) in out.iter_mut().enumerate() {
                let at = y * width + x;
                *out = rows[0][x] + T::of(2.0) * seen[at] * rows[1][x] + wanted[at] * rows[2][x];
            }
        },
    );
    (sum, out)
}

/// From the means of a, b, a², b², ab: the similarity, and its slopes over the first, the third and the last.
fn similarity<T: Real>([a, b, aa, bb, ab]: [T; 5]) -> [T; 4] {
    let two = T::of(2.0);
    let (dark, even) = (T::of(DARK), T::of(EVEN));
    let (light, shape) = (two * a * b + dark, two * (ab - a * b) + even);
    let (lights, shapes) = (a * a + b * b + dark, (aa - a * a) + (bb - b * b) + even);
    let below = T::one() / (lights * shapes);
    let value = light * shape * below;
    let over_ab = two * light * below;
    let over_aa = -value / shapes;
    let over_a = two * b * shape * below - value * two * a / lights - over_ab * b - over_aa * two * a;
    [value, over_a, over_aa, over_ab]
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: [usize; 2] = [23, 17];

    fn pictures() -> (Vec<f64>, Vec<f64>) {
        let at = |i: usize| ((i % SIZE[0]) as f64, (i / SIZE[0]) as f64);
        let seen = (0..SIZE[0] * SIZE[1]).map(|i| 0.5 + 0.3 * (0.7 * at(i).0 + 0.2 * at(i).1).sin());
        let wanted = (0..SIZE[0] * SIZE[1]).map(|i| 0.5 + 0.4 * (0.6 * at(i).0 - 0.3 * at(i).1).cos());
        (seen.collect(), wanted.collect())
    }

    #[test]
    fn it_is_the_formula_in_the_middle_of_a_picture() {
        let (seen, wanted) = pictures();
        let at = |picture: &[f64], x: i32, y: i32| picture[y as usize * SIZE[0] + x as usize];
        let mean = |value: &dyn Fn(i32, i32) -> f64| {
            let weight = |x: i32, y: i32| (-f64::from((x - 11).pow(2) + (y - 8).pow(2)) / 4.5).exp();
            let each = (3..14).flat_map(|y| (6..17).map(move |x| (x, y)));
            let (sum, all) = each.fold((0.0, 0.0), |(s, n), (x, y)| (s + weight(x, y) * value(x, y), n + weight(x, y)));
            sum / all
        };
        let (a, b) = (mean(&|x, y| at(&seen, x, y)), mean(&|x, y| at(&wanted, x, y)));
        let va = mean(&|x, y| (at(&seen, x, y) - a).powi(2));
        let vb = mean(&|x, y| (at(&wanted, x, y) - b).powi(2));
        let ab = mean(&|x, y| (at(&seen, x, y) - a) * (at(&wanted, x, y) - b));
        let exact = (2.0 * a * b + 1e-4) * (2.0 * ab + 9e-4) / ((a * a + b * b + 1e-4) * (va + vb + 9e-4));
        // Its share of the sum is what the sum loses when everything else is left out: taken from the parts.
        let moments = along_rows(SIZE, |x, y| {
            let (a, b) = (seen[y * SIZE[0] + x], wanted[y * SIZE[0] + x]);
            [a, b, a * a, b * b, a * b]
        });
        let mut rows = std::array::from_fn(|_| Vec::new());
        along_columns(&moments, 8, SIZE[0], &mut rows);
        let found = similarity(rows.map(|row| row[11]))[0];
        assert!((found - exact).abs() < 1e-12, "{found} instead of {exact}");
        let same = ssim(&seen, &seen, SIZE);
        assert!((same.0 - seen.len() as f64).abs() < 1e-9 && same.1.iter().all(|slope| slope.abs() < 1e-9));
    }

    #[test]
    fn its_slope_is_the_difference_quotient() {
        let (seen, wanted) = pictures();
        let (_, slope) = ssim(&seen, &wanted, SIZE);
        for i in (0..seen.len()).step_by(7) {
            let moved = |by: f64| {
                let mut there = seen.clone();
                there[i] += by;
                ssim(&there, &wanted, SIZE).0
            };
            let quotient = (moved(1e-5) - moved(-1e-5)) / 2e-5;
            assert!((quotient - slope[i]).abs() < 1e-6 * quotient.abs().max(1.0), "{i}: {quotient} {}", slope[i]);
        }
    }
}
