//! Covariance matrix adaptation (Hansen & Ostermeier 2001), active and bounded: the only user of `fcmaes-core`.

use super::search::Search;
use fcmaes_core::{Cmaes, CmaesParams, Fitness};

/// First width of the cloud of points, in units of the bounds.
const INITIAL_WIDTH: f64 = 0.2;

/// An evolution strategy that learns the shape of the valley.
pub struct Evolution(Cmaes);

impl Evolution {
    /// Around `start`, coordinates in units of the bounds.
    pub fn new(start: &[f64], seed: u64) -> Self {
        Self::of_width(start, INITIAL_WIDTH, seed)
    }

    /// The same, the cloud at first of this width, in units of the bounds.
    pub fn of_width(start: &[f64], width: f64, seed: u64) -> Self {
        let n = start.len();
        let bounds = Fitness::bounded(n, 1, &vec![0.0; n], &vec![1.0; n]);
        // The usual number of points a round.
        let points = 4 + (3.0 * (n.max(1) as f64).ln()) as i32;
        let parameters =
            CmaesParams { popsize: points.max(8), seed, max_evaluations: u64::MAX, ..CmaesParams::default() };
        Self(Cmaes::new(bounds, start, &vec![width; n], &parameters))
    }
}

impl Search for Evolution {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        self.0.ask()
    }

    fn tell(&mut self, costs: &[f64]) {
        self.0.tell(costs);
    }

    fn arrived(&self) -> bool {
        self.0.stop() != 0
    }
}
