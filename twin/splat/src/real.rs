//! The two precisions in which splats are drawn and their gradients taken: `f64` for the reference and for checks, `f32`
//! for training.

use nalgebra::RealField;

/// `f32` or `f64`.
pub trait Real: RealField + Copy + Default {
    /// The nearest number of this precision.
    fn of(value: f64) -> Self;
    /// The same number in double precision.
    fn wide(self) -> f64;
    /// e to the power of a number that is not above 0, within two units of the last place down to e^-80; below, e^-80.
    fn bell(self) -> Self;
}

impl Real for f64 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        self
    }

    #[inline(always)]
    fn bell(self) -> Self {
        self.max(-80.0).exp()
    }
}

/// Adding it rounds a small number to a whole one, which then stands in the last bits.
const ROUNDER: f32 = 12_582_912.0;

impl Real for f32 {
    #[inline(always)]
    fn of(value: f64) -> Self {
        value as Self
    }

    #[inline(always)]
    fn wide(self) -> f64 {
        f64::from(self)
    }

    // Free of branches and calls, so that a loop over pixels becomes vector instructions.
    #[inline(always)]
    fn bell(self) -> Self {
        let x = if self > -80.0 { self } else { -80.0 };
        let shifted = x * std::f32::consts::LOG2_E + ROUNDER;
        let whole = shifted - ROUNDER;
        // ln 2 in two parts, of which the first has zeros enough to be multiplied exactly.
        let rest = (x - whole * 0.693_359_4) + whole * 2.121_944_4e-4;
        let series = 1.0
            + rest
                * (1.0
                    + rest
                        * (0.5
                            + rest
                                * (0.166_666_67
                                    + rest * (0.041_666_67 + rest * (8.333_334e-3 + rest * 1.388_889e-3)))));
        let power = shifted.to_bits().wrapping_sub(ROUNDER.to_bits()).wrapping_add(127) << 23;
        series * Self::from_bits(power)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bell_is_the_exponential_function() {
        for i in 0..=80_000 {
            let x = i as f32 * -1e-3;
            let (exact, found) = (f64::from(x).exp(), f64::from(x.bell()));
            assert!((found / exact - 1.0).abs() < 2.4e-7, "{x}: {found} instead of {exact}");
        }
        assert_eq!((-1e30f32).bell(), (-80f32).bell());
    }
}
