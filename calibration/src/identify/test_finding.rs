//! Fits of two numbers to clips that see sums of them, to try on what is said of a fit.

use super::finding::Finding;
use inference::estimate::interval::LEVEL;
use inference::estimate::{ClipModel, Impossible, Intervals, Schedule, Unknown, at_bounds, fit};
use inference::likelihood::Setting;

/// A clip whose rows say one sum of both numbers, which are a half each.
#[derive(Clone, Copy)]
pub(super) struct Seen {
    /// What of each number is in the sum.
    pub(super) of: [f64; 2],
    /// Noise of a row.
    pub(super) sigma: f64,
}

/// Rows of a clip.
const ROWS: u32 = 20;
/// A sum is seen as if the numbers were as large as this; where it is 0.1 of one of them alone, as if that were far beyond its bound.
const TRUTH: f64 = 0.5;

struct Sums<'a>(&'a [Seen]);

impl ClipModel for Sums<'_> {
    fn clips(&self) -> usize {
        self.0.len()
    }

    fn residuals(&self, clip: usize, shared: &[f64], _: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let Seen { of, sigma } = self.0[clip];
        let alone = of == [0.1, 0.0];
        let measured = if alone { 1.0 } else { TRUTH * (of[0] + of[1]) };
        let noise = |row: u32| 0.5 * (f64::from(row * 7 % 5) - 2.0);
        out.clear();
        out.extend((0..ROWS).map(|row| (of[0] * shared[0] + of[1] * shared[1] - measured) / sigma + noise(row)));
        Ok(())
    }

    fn stretches(&self, _: usize) -> Vec<usize> {
        (1..=4).map(|stretch| (ROWS * stretch / 4) as usize).collect()
    }
}

/// What is found of two numbers between 0 and 1.
pub(super) fn found(settings: &[Setting; 2], clips: &[Seen], ask: impl FnOnce(&Finding<'_>)) {
    let unknown = |setting: &Setting| Unknown { name: setting.name(), start: 0.4, lower: 0.0, upper: 1.0, step: 1e-3 };
    let unknowns = settings.each_ref().map(unknown);
    let fit = fit(&Sums(clips), &unknowns, &[], &Schedule::default(), |_, _| true).expect("an answer");
    let held = at_bounds(&unknowns, &fit.shared);
    let intervals = Intervals::new(&fit, &held, LEVEL);
    let (settings, unknowns) = (&settings[..], &unknowns[..]);
    ask(&Finding { settings, unknowns, fit, held, intervals, simulated: 8, convergence: Vec::new(), arrived: true });
}
