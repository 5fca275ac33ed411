//! NumPy's `.npy` and `.npz` (a ZIP of `.npy` files): arrays of single or double precision in C order. Bytes in, numbers
//! out, and back.

use super::super::npy::{self, Array};
use crate::budget::Budget;

/// Signatures of a ZIP's records.
const LOCAL: [u8; 4] = *b"PK\x03\x04";
const CENTRAL: [u8; 4] = *b"PK\x01\x02";
const END: [u8; 4] = *b"PK\x05\x06";
/// Version of the format that is needed to read it, as the records state it.
const VERSION: u16 = 20;
/// The first day that a ZIP can name: files that hold the same are the same.
const DATE: u16 = 0x21;

/// A `.npy` of numbers that are encoded already: `descr` is `<f4` or `<f8`.
pub(super) fn npy(descr: &str, shape: &[usize], data: &[u8]) -> Vec<u8> {
    let sizes: String = shape.iter().map(|size| format!("{size}, ")).collect();
    let mut header = format!("{{'descr': '{descr}', 'fortran_order': False, 'shape': ({}), }}", sizes.trim_end());
    // Data begins at a multiple of 64 bytes.
    let padding = 63 - (10 + header.len()) % 64;
    header.extend(std::iter::repeat_n(' ', padding));
    header.push('\n');
    let length = u16::try_from(header.len()).unwrap_or(u16::MAX).to_le_bytes();
    [b"\x93NUMPY\x01\x00", &length[..], header.as_bytes(), data].concat()
}

/// A `.npz` with one array called `name`, not compressed.
pub(super) fn npz(name: &str, array: &[u8]) -> Vec<u8> {
    let file = format!("{name}.npy");
    let (length, crc) = (array.len() as u32, crc32fast::hash(array));
    // What both records of a file say: version, flags, method (stored), time, date, check sum, sizes, length of the name.
    let mut common = Vec::new();
    for half in [VERSION, 0, 0, 0, DATE] {
        common.extend(half.to_le_bytes());
    }
    for word in [crc, length, length] {
        common.extend(word.to_le_bytes());
    }
    common.extend((file.len() as u16).to_le_bytes());
    let local = [&LOCAL[..], &common, &[0; 2], file.as_bytes(), array].concat();
    // Made by; then the same; no extra, comment, disk or attributes; the file's record begins at 0.
    let central = [&CENTRAL[..], &VERSION.to_le_bytes(), &common, &[0; 16], file.as_bytes()].concat();
    let mut end = END.to_vec();
    for half in [0_u16, 0, 1, 1] {
        end.extend(half.to_le_bytes());
    }
    for word in [central.len() as u32, local.len() as u32] {
        end.extend(word.to_le_bytes());
    }
    end.extend([0; 2]);
    [local, central, end].concat()
}

/// The array called `name` of a `.npz` whose arrays are stored as `numpy.savez` does; a sentence for anything else.
pub(super) fn parse(bytes: &[u8], name: &str) -> Result<Array, String> {
    let broken = || "is no complete .npz file; save it with numpy.savez".to_owned();
    let half =
        |at: usize| bytes.get(at..at + 2).map(|b| usize::from(u16::from_le_bytes([b[0], b[1]]))).ok_or_else(broken);
    let word = |at: usize| {
        let found = bytes.get(at..at + 4).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]));
        found.map(|word| word as usize).ok_or_else(broken)
    };
    // The directory stands at the end, before a comment of 64 kB at most.
    let last = bytes.len().saturating_sub(22);
    let end =
        (last.saturating_sub(65_536)..=last).rev().find(|at| bytes[*at..].starts_with(&END)).ok_or_else(broken)?;
    let (count, mut at) = (half(end + 10)?, word(end + 16)?);
    for _ in 0..count {
        if !bytes.get(at..).is_some_and(|rest| rest.starts_with(&CENTRAL)) {
            return Err(broken());
        }
        let (method, size, local) = (half(at + 10)?, word(at + 20)?, word(at + 42)?);
        let [name_length, extra, comment] = [28, 30, 32].map(|offset| half(at + offset));
        let (name_length, rest) = (name_length?, extra? + comment?);
        let found = bytes.get(at + 46..at + 46 + name_length).ok_or_else(broken)?;
        at += 46 + name_length + rest;
        if found != format!("{name}.npy").as_bytes() {
            continue;
        }
        if method != 0 {
            return Err("is compressed; save it with numpy.savez, not savez_compressed".into());
        }
        let start = local + 30 + half(local + 26)? + half(local + 28)?;
        let data = start.checked_add(size).and_then(|stop| bytes.get(start..stop)).ok_or_else(broken)?;
        return npy::parse(data, &Budget::of(data.len() as u64)).map_err(|what| what.to_string());
    }
    Err(format!("holds no array `{name}`"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn an_array_comes_back_bit_by_bit(values in prop::collection::vec(-1e9_f32..1e9, 0..40), name in "[a-z]{1,9}") {
            let data: Vec<u8> = values.iter().flat_map(|v| v.to_le_bytes()).collect();
            let array = npy("<f4", &[values.len(), 1], &data);
            prop_assert_eq!((array.len() - data.len()) % 64, 0);
            let read = parse(&npz(&name, &array), &name).expect("own bytes");
            prop_assert_eq!(read.shape, [values.len(), 1]);
            prop_assert_eq!(read.values, values.iter().map(|v| f64::from(*v)).collect::<Vec<_>>());
        }

        #[test]
        fn no_bytes_make_it_panic(mut bytes in prop::collection::vec(any::<u8>(), 0..300), at in 0_usize..300, value: u8) {
            let _ = parse(&bytes, "depth");
            bytes = npz("depth", &npy("<f8", &[2], &[0; 16]));
            let at = at % bytes.len();
            bytes[at] = value;
            let _ = parse(&bytes, "depth");
            let _ = parse(&bytes[..at], "depth");
        }
    }
}
