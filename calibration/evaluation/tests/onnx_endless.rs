//! Networks without an end: one whose loop never stops, and one that wants a million million moments. In a process of its own,
//! which is asked to end. `ORT_DYLIB_PATH` has to name ONNX Runtime's library.

mod model;

use evaluation::policy::{Policy, PolicyError, Source};
use model::{bytes, graph_inputs, named, node, number, tensor, written};
use rmpv::Value;
use shared_mem::ending;
use std::path::Path;

/// A model that makes `action`, one number, of `state`, whose axes are given; ONNX version 8, operators of version 13.
fn model(state: &[u64], nodes: &[u8], constants: &[u8]) -> Vec<u8> {
    let action = vec![1; state.len()];
    let graph = [nodes, &bytes(2, b"policy"), constants, &tensor(11, "state", state), &tensor(12, "action", &action)];
    [number(1, 8), bytes(7, &graph.concat()), bytes(8, &number(2, 13))].concat()
}

/// A loop that adds its number to itself for ever.
fn endless() -> Vec<u8> {
    let body = [
        node("Identity", &["go"], "go_on", &[]),
        node("Add", &["x", "x"], "twice", &[]),
        bytes(2, b"body"),
        graph_inputs(),
        named(12, "go_on", 9, &[]),
        tensor(12, "twice", &[1, 1]),
    ];
    let body = bytes(5, &[bytes(1, b"body"), bytes(6, &body.concat()), number(20, 5)].concat());
    let constant = |name: &str, kind: u64, raw: &[u8]| {
        bytes(5, &[number(2, kind), bytes(8, name.as_bytes()), bytes(9, raw)].concat())
    };
    let constants = [constant("most", 7, &i64::MAX.to_le_bytes()), constant("yes", 9, &[1])].concat();
    model(&[1, 1], &node("Loop", &["most", "yes", "state"], "action", &body), &constants)
}

fn seen() -> Value {
    let key = |key: &str| Value::Binary(key.as_bytes().to_vec());
    let state = Value::Map(vec![
        (key("__ndarray__"), true.into()),
        (key("data"), Value::Binary(vec![0; 4])),
        (key("dtype"), "<f4".into()),
        (key("shape"), Value::Array(vec![1.into()])),
    ]);
    Value::Map(vec![("state".into(), state)])
}

fn open(folder: &Path, name: &str, bytes: &[u8]) -> Result<Policy, PolicyError> {
    Policy::open(&Source::Onnx(written(folder, name, bytes))).map(|policy| policy.expect("no script"))
}

#[test]
#[ignore = "needs ONNX Runtime: ORT_DYLIB_PATH=LIBRARY cargo test --release --workspace --test onnx_endless -- --ignored"]
fn what_has_no_end_is_refused_or_ended() {
    let folder = tempfile::tempdir().expect("a folder");
    let sum = node("ReduceSum", &["state"], "action", &[]);
    let moments = model(&[1, 1_000_000_000_000, 1], &sum, &[]);
    let mut policy = open(folder.path(), "moments.onnx", &moments).expect("a model");
    let told = policy.actions(&seen()).expect_err("too many moments").to_string();
    assert!(told.contains("1000000000000 moments") && !told.contains('\n'), "{told}");
    // Asked to end, a loop ends within the moment in which it is looked at.
    let mut policy = open(folder.path(), "loop.onnx", &endless()).expect("a model");
    ending::ask();
    let error = policy.actions(&seen()).expect_err("a loop without end");
    assert!(error.is_interruption(), "{error}");
    let told = policy.actions(&seen()).expect_err("it was ended").to_string();
    assert!(!told.contains('\n'), "{told}");
}
