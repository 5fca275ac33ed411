//! Tele-operation: a task's arm steered by a person at a page in a browser, and what it does recorded as clips.
//!
//! ```text
//! page --input--> server --orders--> steering thread: jog, step, draw, pack --watch--> server --picture and state--> pages
//! ```
//!
//! | file | owns |
//! |---|---|
//! | `message` | what a page sends and is sent |
//! | `orders` | what of it waits for the thread that steers, and a stop that waits behind nothing |
//! | `steering` | the thread that simulates, draws and records: one episode after the other |
//! | `seats` | which of the pages steers |
//! | `server` | the page, and a WebSocket for each that is open |
//! | `page.html` | the page itself: nothing else is fetched |

mod message;
mod orders;
mod seats;
mod server;
mod steering;

pub use server::{ServeError, serve};
pub use steering::{Recording, Summary, TeleopError};
