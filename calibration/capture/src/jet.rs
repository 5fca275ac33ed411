//! A value with its first three derivatives in time, and the courses from 0 to 1 that motions are built of. Pure.

/// Value and first three derivatives in time.
pub type Jet = [f64; 4];

/// `10 u³ - 15 u⁴ + 6 u⁵` and its derivatives in time where `du/dt = rate`; 0 before and 1 after. Its first and second
/// derivative are 0 at both ends.
pub fn quintic(u: f64, rate: f64) -> Jet {
    let u = u.clamp(0.0, 1.0);
    [
        u.powi(3) * (10.0 + u * (6.0 * u - 15.0)),
        30.0 * u.powi(2) * (1.0 - u).powi(2) * rate,
        60.0 * u * (1.0 - u) * (1.0 - 2.0 * u) * rate.powi(2),
        60.0 * (1.0 + 6.0 * u * (u - 1.0)) * rate.powi(3),
    ]
}

/// Integral over `u` of the value of [`quintic`] from 0; 1/2 at `u = 1`.
pub fn swept(u: f64) -> f64 {
    u.powi(4) * (2.5 + u * (u - 3.0))
}

/// Product rule up to the third derivative.
pub fn product(a: Jet, b: Jet) -> Jet {
    [
        a[0] * b[0],
        a[1] * b[0] + a[0] * b[1],
        a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2],
        a[3] * b[0] + 3.0 * a[2] * b[1] + 3.0 * a[1] * b[2] + a[0] * b[3],
    ]
}

/// A window over a motion of so many seconds: rises along a quintic for `rise` seconds, stays at 1, falls along the mirrored
/// one; speed and acceleration are 0 at both ends.
pub fn window(t: f64, duration: f64, rise: f64) -> Jet {
    if t < rise {
        quintic(t / rise, 1.0 / rise)
    } else if t > duration - rise {
        quintic((duration - t) / rise, -1.0 / rise)
    } else {
        [1.0, 0.0, 0.0, 0.0]
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// Checks derivatives against differences of the derivative below, at `times`.
    pub(crate) fn assert_derivatives(at: impl Fn(f64) -> Jet, times: impl Iterator<Item = f64>) {
        let h = 1e-5;
        for t in times {
            let (before, here, after) = (at(t - h), at(t), at(t + h));
            for order in 0..3 {
                let slope = (after[order] - before[order]) / (2.0 * h);
                let tolerance = 1e-4 * (1.0 + here[order + 1].abs());
                assert!(
                    (slope - here[order + 1]).abs() < tolerance,
                    "derivative {} at {t} s: {slope} instead of {}",
                    order + 1,
                    here[order + 1]
                );
            }
        }
    }

    #[test]
    fn a_product_of_windows_has_the_derivatives_it_says() {
        let at = |t: f64| product(window(t, 3.0, 0.7), window(t, 3.0, 1.1));
        assert_derivatives(at, (1..58).map(|i| 0.05 * f64::from(i) + 0.013));
        assert!((swept(1.0) - 0.5).abs() < 1e-12);
        let slope = (swept(0.4 + 1e-6) - swept(0.4 - 1e-6)) / 2e-6;
        assert!((slope - quintic(0.4, 1.0)[0]).abs() < 1e-8);
    }
}
