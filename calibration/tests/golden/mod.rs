//! Answers held against what they were: numbers to a millionth, everything else to the letter, but for sentences, which may be said
//! better.

use serde_json::{Map, Value, json};
use std::path::Path;

/// Parameters and intervals agree so far, relative to the larger [1]: fits end at steps of about 1e-8, and the C library's sine and
/// cosine differ in their last bit from processor to processor.
const SAME: f64 = 1e-6;
/// Numbers below this count as equal [SI units].
const NOTHING: f64 = 1e-9;
/// These parts of an answer, without what is said in sentences.
pub(crate) fn kept(answer: &Value, keys: &[&str]) -> Value {
    let mut of: Map<String, Value> =
        keys.iter().filter_map(|key| Some(((*key).to_owned(), answer.get(*key)?.clone()))).collect();
    of.values_mut().for_each(without_sentences);
    Value::Object(of)
}

fn without_sentences(value: &mut Value) {
    match value {
        Value::Object(table) => {
            table.retain(|_, value| !value.as_str().is_some_and(|text| text.contains(' ')));
            table.values_mut().for_each(without_sentences);
        }
        Value::Array(list) => list.iter_mut().for_each(without_sentences),
        _ => {}
    }
}

/// Where two answers differ, as `candidates.0.parameters.mass: 0.8 was 0.7`.
fn differences(place: &str, is: &Value, was: &Value, found: &mut Vec<String>) {
    let below = |key: &str| if place.is_empty() { key.to_owned() } else { format!("{place}.{key}") };
    match (is, was) {
        (Value::Object(a), Value::Object(b)) => {
            let keys: std::collections::BTreeSet<&String> = a.keys().chain(b.keys()).collect();
            for key in keys {
                let [a, b] = [a, b].map(|of| of.get(key).unwrap_or(&Value::Null));
                differences(&below(key), a, b, found);
            }
        }
        (Value::Array(a), Value::Array(b)) if a.len() == b.len() => {
            a.iter().zip(b).enumerate().for_each(|(i, (a, b))| differences(&below(&i.to_string()), a, b, found));
        }
        (Value::Number(a), Value::Number(b)) => {
            let [a, b] = [a, b].map(|number| number.as_f64().unwrap_or(f64::NAN));
            if (a - b).abs() > NOTHING.max(SAME * a.abs().max(b.abs())) {
                found.push(format!("{place}: {a} was {b}"));
            }
        }
        _ if is == was => {}
        _ => found.push(format!("{place}: {is} was {was}")),
    }
}

/// Holds an answer against what stands under its name in the text of a file; what it is now goes to a folder of this name in
/// `target/tmp`.
pub(crate) fn holds((folder, before): (&str, &str), name: &str, is: &Value) {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(folder);
    std::fs::create_dir_all(&folder).expect("a folder");
    let text = serde_json::to_string_pretty(&json!({ name: is })).expect("numbers") + "\n";
    std::fs::write(folder.join(format!("{name}.json")), text).expect("room");
    let all: Value = serde_json::from_str(before).expect("the answers of before");
    let mut found = Vec::new();
    differences("", is, &all[name], &mut found);
    assert!(found.is_empty(), "{name}:\n{}", found.join("\n"));
}
