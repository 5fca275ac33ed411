//! Faults put into clean sessions, seed by seed: how often each is found, and how often one is found where there is none.
//!
//! | file | owns |
//! |---|---|
//! | `sessions` | clean sessions: motions of the arm, strokes, tosses, one motion at two speeds |
//! | `faults`, `damage` | every fault, and what it does to a clean clip |
//! | `score` | found, missed, false alarms |

mod damage;
pub mod faults;
pub mod score;
pub mod sessions;

pub use damage::inject;
pub use faults::Injected;
pub use score::{Score, Trial, table};
pub use sessions::{Clean, Sort};
