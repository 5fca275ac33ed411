//! The JSON schema of cell.toml, out of the types that read it: for editors that complete keys and mark mistakes while one
//! types, and for programs that write the file.

use super::Cell;
use serde_json::Value;

impl Cell {
    /// JSON Schema (draft 2020-12) of a cell.toml: every key with its meaning, unit and default, no others allowed. What hangs
    /// together between keys, such as one gain a joint, is checked in reading alone.
    pub fn schema() -> Value {
        let mut schema = schemars::schema_for!(Self).to_value();
        if let Some(root) = schema.as_object_mut() {
            root.insert("title".into(), "cell.toml".into());
        }
        schema
    }
}
