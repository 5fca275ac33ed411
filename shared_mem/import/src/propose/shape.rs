//! What columns of numbers are by themselves, whatever they are called: nothing, one number over and over, sines and cosines, a
//! quaternion.

/// How far sums of squares may be off 1: those of single precision are off by less.
const ROUNDED: f64 = 1e-3;

/// Whether there is no finite number in them.
pub(super) fn is_empty(columns: &[&[f64]]) -> bool {
    columns.iter().all(|column| !column.iter().any(|v| v.is_finite()))
}

/// Whether every column holds one number in all its rows.
pub(super) fn is_constant(columns: &[&[f64]]) -> bool {
    let one = |column: &&[f64]| {
        let mut finite = column.iter().filter(|v| v.is_finite());
        let first = finite.next();
        finite.all(|v| Some(v) == first)
    };
    columns.iter().all(one)
}

/// Whether these sums of squares are 1, in rows enough to mean it.
fn are_one(sums: impl Iterator<Item = f64>) -> bool {
    let mut rows = 0;
    for sum in sums.filter(|sum| sum.is_finite()) {
        if (sum - 1.0).abs() > ROUNDED {
            return false;
        }
        rows += 1;
    }
    rows > 2
}

/// Whether one group holds the sines and the other the cosines of the same angles.
pub(super) fn on_circle(some: &[&[f64]], others: &[&[f64]]) -> bool {
    let pair = |(a, b): (&&[f64], &&[f64])| are_one(a.iter().zip(b.iter()).map(|(a, b)| a * a + b * b));
    !some.is_empty()
        && some.len() == others.len()
        && some.iter().zip(others).all(pair)
        && !(is_constant(some) && is_constant(others))
}

/// Whether one group holds sines and cosines of the same angles: in turn, or first the ones and then the others.
pub(super) fn are_sines(columns: &[&[f64]]) -> bool {
    let half = columns.len() / 2;
    if !columns.len().is_multiple_of(2) || half == 0 {
        return false;
    }
    let (first, second) = columns.split_at(half);
    let even: Vec<&[f64]> = columns.iter().step_by(2).copied().collect();
    let odd: Vec<&[f64]> = columns.iter().skip(1).step_by(2).copied().collect();
    on_circle(first, second) || on_circle(&even, &odd)
}

/// Whether four columns beside each other are a quaternion that turns.
pub(super) fn is_turned(columns: &[&[f64]]) -> bool {
    let is_one = |four: &[&[f64]]| {
        let rows = four.iter().map(|column| column.len()).min().unwrap_or(0);
        are_one((0..rows).map(|row| four.iter().map(|column| column[row] * column[row]).sum())) && !is_constant(four)
    };
    columns.windows(4).any(is_one)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(w: f64, of: fn(f64) -> f64) -> Vec<f64> {
        (0..50).map(|i| of(w * f64::from(i) * 0.02)).collect()
    }

    #[test]
    fn sines_with_their_cosines_are_told_from_angles() {
        let (a, b) = (wave(2.0, f64::sin), wave(2.0, f64::cos));
        let (c, d) = (wave(3.0, f64::sin), wave(3.0, f64::cos));
        assert!(on_circle(&[&a, &c], &[&b, &d]) && !on_circle(&[&a, &c], &[&d, &b]));
        assert!(are_sines(&[&a, &b, &c, &d]) && are_sines(&[&a, &c, &b, &d]) && !are_sines(&[&a, &c, &d, &b]));
        // Joints that rest at 1 and 0 are no pair.
        assert!(!on_circle(&[&[1.0; 9]], &[&[0.0; 9]]));
    }

    #[test]
    fn a_quaternion_is_found_wherever_it_stands_in_a_group() {
        let (w, z, none, x) = (wave(1.0, f64::cos), wave(1.0, f64::sin), vec![0.0; 50], wave(5.0, f64::sin));
        assert!(is_turned(&[&x, &x, &w, &none, &none, &z]));
        assert!(!is_turned(&[&x, &w, &none, &x, &z]));
    }

    #[test]
    fn one_number_over_and_over_is_constant_whatever_is_missing() {
        assert!(is_constant(&[&[1.0, f64::NAN, 1.0], &[2.0; 3]]) && !is_constant(&[&[1.0, 1.0, 1.1]]));
        assert!(is_empty(&[&[f64::NAN; 3]]) && !is_empty(&[&[f64::NAN, 0.0]]));
    }
}
