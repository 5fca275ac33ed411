//! What counts of trials say: intervals and tests for shares of success, and how far one world predicts another.
//!
//! Pure: numbers in, numbers out; what is drawn is drawn from a seed. A level is that of a two-sided interval, 0.95 say.
//!
//! | file | owns | source |
//! |---|---|---|
//! | `share` | a share of successes, its interval; the difference of two independent ones | Wilson 1927; Newcombe 1998 (873), method 10 |
//! | `paired` | two policies or worlds on the same starts | McNemar 1947, exact; Newcombe 1998 (2635), method 10 |
//! | `agreement` | Pearson's correlation and the mean maximum rank violation of shares in two worlds | Li et al. 2024 (SIMPLER) |
//! | `powered` | few real trials and many simulated ones together | Angelopoulos et al. 2023 (PPI++) |
//! | `detectable` | the smallest difference that so many trials show | Fleiss 2003, without correction of continuity |
//! | `ranks` | whether groups of trials are of one distribution | Kruskal and Wallis 1952, with ties |

mod agreement;
mod detectable;
mod paired;
mod powered;
mod ranks;
mod share;

pub use agreement::{Agreement, Cell, agreement, mean_maximum_rank_violation, pearson};
pub use detectable::{POWER, smallest_difference};
pub use paired::Pairs;
pub use powered::{Powered, powered};
pub use ranks::{Kruskal, kruskal_wallis};
pub use share::{Share, difference};

use statrs::distribution::{ContinuousCDF as _, Normal};

/// The level of the intervals that the programs report.
pub const LEVEL: f64 = 0.95;

/// How many sigmas a two-sided interval of a level reaches.
fn sigmas(level: f64) -> f64 {
    Normal::standard().inverse_cdf(0.5 + 0.5 * level)
}
