//! What is asked of a set of clips, in numbers.

/// A positive number whose bounds are so many times apart is known by its order of magnitude alone.
const RATIO_OF_UNKNOWN_MAGNITUDE: f64 = 100.0;

/// A number that all clips share and that is to be found.
#[derive(Debug, Clone, PartialEq)]
pub struct Unknown {
    /// Name in reports: `stiffness[2]`, `friction`, `command_delay.delay`.
    pub name: String,
    /// Where the search begins; inside the bounds.
    pub start: f64,
    /// Lowest value of the search.
    pub lower: f64,
    /// Highest value of the search.
    pub upper: f64,
    /// Difference step: small against the scale on which the answer bends, large against rounding and events.
    pub step: f64,
}

impl Unknown {
    /// How far down (at most 0 inside the bounds) and how far up the number may go from a value.
    pub fn room(&self, from: f64) -> [f64; 2] {
        [self.lower - from, self.upper - from]
    }

    /// The same for one step of a search: a positive number that is known by its order of magnitude alone, as gains that nobody has
    /// published, is at most halved or doubled, since slopes say nothing about another order of magnitude.
    pub fn reach(&self, from: f64) -> [f64; 2] {
        let [down, up] = self.room(from);
        if self.lower <= 0.0 || self.upper < RATIO_OF_UNKNOWN_MAGNITUDE * self.lower || down > 0.0 || up < 0.0 {
            return [down, up];
        }
        [down.max(-0.5 * from), up.min(from)]
    }
}

/// A number of which every clip has its own, scattered around zero.
#[derive(Debug, Clone, PartialEq)]
pub struct Random {
    /// Name in reports: `ln friction`, `start x`.
    pub name: String,
    /// One sigma of its scatter from clip to clip; 0 holds it at zero.
    pub sigma: f64,
    pub step: f64,
}

impl Random {
    /// The square of a clip's value in its sigmas; 0 of one that is held.
    pub fn square(&self, value: f64) -> f64 {
        if self.sigma > 0.0 { (value / self.sigma).powi(2) } else { 0.0 }
    }

    /// `-2 ln` of the normal prior density of a clip's values, but for a constant.
    pub fn penalty(random: &[Self], values: &[f64]) -> f64 {
        random.iter().zip(values).map(|(random, value)| random.square(*value)).sum()
    }
}

/// The model has no answer there: the simulation left all bounds, or a number has no meaning.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct Impossible(pub String);

/// Clips and what a model says about them.
pub trait ClipModel: Sync {
    /// How many clips there are.
    fn clips(&self) -> usize;

    /// Measured less predicted of clip `clip`, every row divided by its standard deviation, into `out` (cleared first).
    ///
    /// `shared` in the order of the unknowns, `own` in the order of the random effects. The same number of rows in
    /// the same order on every call for a clip; the same bits for the same input on whatever thread.
    ///
    /// # Errors
    /// [`Impossible`] where the model has no answer.
    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible>;

    /// The same a difference step away from numbers at which the residuals are `base`: for slopes, which a model that is cheaper than
    /// the residuals' own may give.
    ///
    /// # Errors
    /// As [`ClipModel::residuals`].
    fn stepped(
        &self,
        clip: usize,
        (shared, own): (&[f64], &[f64]),
        (_from, _base): ((&[f64], &[f64]), &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        self.residuals(clip, shared, own, out)
    }

    /// Where the stretches of a clip's rows end that are witnesses of their own: so long that what residuals of
    /// neighbouring rows share has died away from one stretch to the next. Empty: the clip is a single witness.
    fn stretches(&self, _clip: usize) -> Vec<usize> {
        Vec::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_known_by_its_order_of_magnitude_is_at_most_halved_or_doubled() {
        let unknown = |lower, upper| Unknown { name: "k".into(), start: 1.0, lower, upper, step: 1e-6 };
        assert_eq!(unknown(1.0, 1000.0).reach(100.0), [-50.0, 100.0]);
        assert_eq!(unknown(60.0, 6500.0).reach(100.0), [-40.0, 100.0]);
        assert_eq!(unknown(1.0, 1000.0).reach(800.0), [-400.0, 200.0]);
        assert_eq!(unknown(50.0, 200.0).reach(100.0), [-50.0, 100.0], "known within a factor of four");
        assert_eq!(unknown(-1.0, 1000.0).reach(100.0), [-101.0, 900.0], "it may be 0");
        assert_eq!(unknown(1.0, 1000.0).reach(0.5), [0.5, 999.5], "outside");
    }
}
