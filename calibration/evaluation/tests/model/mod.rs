//! Models in ONNX files, written byte by byte.
#![allow(dead_code, reason = "each test uses its part")]

use std::path::{Path, PathBuf};

/// A field of a protocol buffer that holds bytes.
pub(crate) fn bytes(field: u64, content: &[u8]) -> Vec<u8> {
    [number_of(field << 3 | 2), number_of(content.len() as u64), content.to_vec()].concat()
}

/// A field that holds a number.
pub(crate) fn number(field: u64, value: u64) -> Vec<u8> {
    [number_of(field << 3), number_of(value)].concat()
}

fn number_of(mut value: u64) -> Vec<u8> {
    let mut encoded = Vec::new();
    while value > 127 {
        encoded.push((value & 127) as u8 | 128);
        value >>= 7;
    }
    encoded.push(value as u8);
    encoded
}

/// A node of one output.
pub(crate) fn node(kind: &str, inputs: &[&str], output: &str, attributes: &[u8]) -> Vec<u8> {
    let inputs: Vec<u8> = inputs.iter().flat_map(|name| bytes(1, name.as_bytes())).collect();
    bytes(1, &[inputs, bytes(2, output.as_bytes()), bytes(4, kind.as_bytes()), attributes.to_vec()].concat())
}

/// An input or output of float32.
pub(crate) fn tensor(field: u64, name: &str, lengths: &[u64]) -> Vec<u8> {
    named(field, name, 1, lengths)
}

/// An input or output of an element's type by its number.
pub(crate) fn named(field: u64, name: &str, element: u64, lengths: &[u64]) -> Vec<u8> {
    let axes: Vec<u8> = lengths.iter().flat_map(|length| bytes(1, &number(1, *length))).collect();
    let kind = bytes(1, &[number(1, element), bytes(2, &axes)].concat());
    bytes(field, &[bytes(1, name.as_bytes()), bytes(2, &kind)].concat())
}

/// What the body of a loop gets: its count, whether it goes on, and a number.
pub(crate) fn graph_inputs() -> Vec<u8> {
    [named(11, "i", 7, &[]), named(11, "go", 9, &[]), tensor(11, "x", &[1, 1])].concat()
}

/// A file of these bytes.
pub(crate) fn written(folder: &Path, name: &str, bytes: &[u8]) -> PathBuf {
    let file = folder.join(name);
    std::fs::write(&file, bytes).expect("a file");
    file
}
