//! Axes: from values to places, and the round numbers to mark.

use crate::words::quantity::power;

/// A stretch of values laid along a stretch of the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    from: [f64; 2],
    to: [f64; 2],
}

impl Scale {
    /// Lays `from` along `to`. Where there is nothing to span, one unit is.
    pub(crate) fn new([lo, hi]: [f64; 2], to: [f64; 2]) -> Self {
        let from = if hi - lo > 1e-300 && (hi - lo).is_finite() {
            [lo, hi]
        } else if lo.is_finite() {
            [lo, lo + 1.0]
        } else {
            [0.0, 1.0]
        };
        Self { from, to }
    }

    /// Where a value lies, held inside the picture.
    pub(crate) fn at(&self, value: f64) -> f64 {
        let share = ((value - self.from[0]) / (self.from[1] - self.from[0])).clamp(0.0, 1.0);
        self.to[0] + share * (self.to[1] - self.to[0])
    }

    /// Round numbers within, about `count`, with their names.
    pub(crate) fn ticks(&self, count: usize) -> Vec<(f64, String)> {
        let [lo, hi] = self.from;
        let rough = (hi - lo) / count.max(1) as f64;
        let decade = 10_f64.powf(rough.log10().floor());
        let step = decade * [1.0, 2.0, 5.0, 10.0].into_iter().find(|m| m * decade >= rough * 0.999).unwrap_or(10.0);
        let digits = (-step.log10().floor()).clamp(0.0, 9.0) as usize;
        let first = (lo / step - 1e-9).ceil() as i64;
        let last = (hi / step + 1e-9).floor() as i64;
        (first..=last)
            .map(|k| k as f64 * step)
            .map(|tick| match tick {
                0.0 => (tick, format!("{:.digits$}", 0.0)),
                _ if step >= 1e4 => (tick, power(tick)),
                _ => (tick, format!("{tick:.digits$}")),
            })
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_are_round_and_inside() {
        let names = |scale: Scale| scale.ticks(4).into_iter().map(|(_, name)| name).collect::<Vec<_>>();
        assert_eq!(names(Scale::new([0.0, 9.3], [0.0, 1.0])), ["0", "5"]);
        assert_eq!(names(Scale::new([-0.11, 0.12], [0.0, 1.0])), ["-0.1", "0.0", "0.1"]);
        assert_eq!(names(Scale::new([0.0, 9e8], [0.0, 1.0])), ["0", "5\u{b7}10\u{2078}"]);
        assert_eq!(names(Scale::new([0.0, 0.0], [0.0, 1.0])), ["0.0", "0.5", "1.0"]);
    }

    #[test]
    fn values_outside_stay_in_the_picture() {
        let scale = Scale::new([0.0, 10.0], [100.0, 200.0]);
        assert_eq!([-5.0, 5.0, 50.0].map(|value| scale.at(value)), [100.0, 150.0, 200.0]);
    }
}
