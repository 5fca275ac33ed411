//! Policies: who acts, and what is asked of it.
//!
//! | file | owns |
//! |---|---|
//! | `fit` | what is seen in the shape of a network's input |
//! | `named` | a policy by its name on a command line |
//! | `observation` | what a policy sees: numbers and pictures by keys |
//! | `onnx` | a policy in an ONNX file |
//! | `opened` | a policy ready to be asked, wherever it is computed |
//! | `patient` | a connection on which one waits so long, whatever comes meanwhile |
//! | `packed` | arrays in msgpack, as numpy's come over openpi's protocol |
//! | `served` | a policy behind openpi's websocket protocol |

mod fit;
mod named;
mod observation;
mod onnx;
mod opened;
mod packed;
mod patient;
mod served;

pub use named::{Named, NamedError, Source};
pub use observation::{ActionKind, Keys, Seen};
pub use onnx::{Onnx, OnnxError};
pub use opened::{Policy, PolicyError};
pub use packed::{Array, PackedError, Rows, pack, unpack};
pub use served::{Served, ServedError};
