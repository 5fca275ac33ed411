//! Policies: who acts, and what is asked of it.
//!
//! | file | owns |
//! |---|---|
//! | `named` | a policy by its name on a command line |
//! | `observation` | what a policy sees: numbers and pictures by keys |
//! | `packed` | arrays in msgpack, as numpy's come over openpi's protocol |
//! | `served` | a policy behind openpi's websocket protocol |

mod named;
mod observation;
mod packed;
mod served;

pub use named::{Named, NamedError, Source};
pub use observation::{ActionKind, Keys, Seen};
pub use packed::{Array, PackedError, pack, unpack};
pub use served::{Served, ServedError};
