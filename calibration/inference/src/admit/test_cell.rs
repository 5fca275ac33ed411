//! A cell in which every key that cell.toml may hold is there, made of its schema, so that a new key is there as well: what is made of
//! a cell keeps all that it does not change.

use serde_json::{Map, Value, json};
use shared_mem::cell::Cell;
use std::collections::BTreeSet;

/// The cell; no two of its numbers are the same, and no key has its default.
pub(super) fn filled() -> Cell {
    let schema = Cell::schema();
    let value = Filler { schema: &schema, count: 0 }.value(&schema);
    let cell: Cell = serde_json::from_value(value.clone()).expect("a cell");
    assert_eq!(keys(&json!(cell)), keys(&value), "a key with its default would not show that it is kept");
    cell
}

/// The keys in which two cells differ, as `controller.kind`.
pub(super) fn changed(one: &Cell, other: &Cell) -> BTreeSet<String> {
    let (one, other) = (leaves(&json!(one)), leaves(&json!(other)));
    let differs = one.symmetric_difference(&other);
    differs.map(|(key, _)| key.clone()).collect()
}

fn keys(value: &Value) -> BTreeSet<String> {
    leaves(value).into_iter().map(|(key, _)| key).collect()
}

/// Keys of tables with what they hold, lists as they are.
fn leaves(value: &Value) -> BTreeSet<(String, String)> {
    let Value::Object(table) = value else { return BTreeSet::from([(String::new(), value.to_string())]) };
    let below = |(key, value): (&String, &Value)| {
        let name = |below: String| if below.is_empty() { key.clone() } else { format!("{key}.{below}") };
        leaves(value).into_iter().map(move |(below, value)| (name(below), value)).collect::<Vec<_>>()
    };
    table.iter().flat_map(below).collect()
}

struct Filler<'a> {
    schema: &'a Value,
    count: u32,
}

impl Filler<'_> {
    fn value(&mut self, of: &Value) -> Value {
        if let Some(place) = of["$ref"].as_str() {
            let schema = self.schema;
            return self.value(schema.pointer(place.trim_start_matches('#')).expect("a definition"));
        }
        for choice in ["anyOf", "oneOf", "allOf"] {
            if let Some(several) = of[choice].as_array() {
                // The last that holds something: the first may be the default.
                return self.value(several.iter().rfind(|one| one["type"] != "null").expect("a type"));
            }
        }
        if let Some(only) = of.get("const").or_else(|| of["enum"].as_array()?.last()) {
            return only.clone();
        }
        let named = |kind: &Value| kind.as_str().filter(|kind| *kind != "null").map(str::to_owned);
        let kind = named(&of["type"]).or_else(|| of["type"].as_array()?.iter().find_map(named)).expect("a type");
        self.count += 1;
        match &kind[..] {
            "object" => {
                let keys = of["properties"].as_object().into_iter().flatten();
                let mut table: Map<_, _> = keys.map(|(key, of)| (key.clone(), self.value(of))).collect();
                if let Some(of) = of["additionalProperties"].as_object() {
                    table.insert("any".into(), self.value(&json!(of)));
                }
                json!(table)
            }
            "array" => {
                let count = of["minItems"].as_u64().unwrap_or(2);
                json!((0..count).map(|_| self.value(&of["items"])).collect::<Vec<_>>())
            }
            "number" => json!(0.125 * f64::from(self.count)),
            "integer" => json!(self.count),
            "boolean" => json!(of["default"] != true),
            "string" => json!(format!("other_{}", self.count)),
            other => panic!("a value of the type {other}"),
        }
    }
}
