//! What a policy's server may answer: msgpack with arrays as numpy's, or lists of numbers. Whatever comes, there is a table of numbers or
//! one line.
#![no_main]

use evaluation::policy::{Array, pack, unpack};
use libfuzzer_sys::fuzz_target;
use rmpv::Value;

fn seeds() -> Vec<Vec<u8>> {
    let key = |key: &str| Value::Binary(key.as_bytes().to_vec());
    let array = |dtype: &str, data: Vec<u8>, shape: [u64; 2]| {
        let shape = Value::Array(shape.map(Value::from).to_vec());
        let dtype = Value::from(dtype);
        Value::Map(vec![
            (key("__ndarray__"), true.into()),
            (key("data"), Value::Binary(data)),
            (key("dtype"), dtype),
            (key("shape"), shape),
        ])
    };
    let rows = Value::Array(vec![Value::Array(vec![1.5.into(), 2.into()]); 3]);
    [array("<f4", vec![0; 24], [2, 3]), array("<f8", vec![0; 16], [1, 2]), array("|u1", vec![7; 4], [2, 2]), rows]
        .map(|answer| pack(&answer))
        .to_vec()
}

fuzz_target!(
    init: fuzz::seeds(seeds()),
    |bytes: &[u8]| {
        let Some(message) = fuzz::accepted(unpack(bytes)) else { return };
        let Some(array) = fuzz::accepted(Array::read(&message)) else { return };
        let count = array.values.len();
        if let Some(rows) = fuzz::accepted(array.into_rows()) {
            assert_eq!(rows.iter().map(<[f32]>::len).sum::<usize>(), count);
        }
    }
);
