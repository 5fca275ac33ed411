//! What is said beside a result.

use serde::Serialize;

/// Something that a person should know about the result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Remark(pub String);
