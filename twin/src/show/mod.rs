//! Recorded clips beside the twin on one time line, at a page in a browser.
//!
//! | file | owns |
//! |---|---|
//! | `film` | a clip and what the twin makes of its commands, moment by moment |
//! | `stage` | a picture of both, their difference as large as is asked for |
//! | `server` | the page, its numbers and its pictures |
//! | `page.html` | the page itself: nothing else is fetched |

mod film;
mod server;
mod stage;

pub use film::Film;
pub use server::{ShowError, serve};
pub use stage::{Stage, Staged};
