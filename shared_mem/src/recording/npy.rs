//! NumPy's `.npy` files: floats and integers of either byte order. Bytes in, numbers out.

use crate::budget::{Budget, BudgetError};

/// Shape and numbers of an array, row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Length of each axis; empty for a single number.
    pub shape: Vec<usize>,
    /// The numbers, row by row.
    pub values: Vec<f64>,
}

/// Bytes are no array: a sentence to be put behind the file's name.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum ArrayError {
    /// Some of them are missing.
    #[error("{0}")]
    Cut(&'static str),
    /// It holds something else.
    #[error("{0}")]
    Kind(String),
    /// It is too large.
    #[error(transparent)]
    Budget(#[from] BudgetError),
}

impl From<&str> for ArrayError {
    fn from(what: &str) -> Self {
        Self::Kind(what.to_owned())
    }
}

/// Reads an array of numbers; `budget` is that of the file it stands in.
///
/// # Errors
/// [`ArrayError`] when it is cut, of another kind, or too large.
///
/// # Example
/// ```
/// use shared_mem::budget::Budget;
/// use shared_mem::recording::parse_npy;
///
/// let header = b"{'descr': '<f8', 'fortran_order': False, 'shape': (2,), }\n";
/// let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
/// bytes.extend((header.len() as u16).to_le_bytes());
/// bytes.extend(header);
/// bytes.extend([1.5_f64, -2.0].iter().flat_map(|value| value.to_le_bytes()));
/// let array = parse_npy(&bytes, &Budget::of(1 << 20))?;
/// assert_eq!((array.shape, array.values), (vec![2], vec![1.5, -2.0]));
///
/// assert!(parse_npy(&bytes[..20], &Budget::of(1 << 20)).is_err(), "it is cut");
/// # Ok::<(), shared_mem::recording::ArrayError>(())
/// ```
pub fn parse(bytes: &[u8], budget: &Budget) -> Result<Array, ArrayError> {
    let cut = ArrayError::Cut("is no complete .npy file; save it with numpy.save");
    let (header, data) = split(bytes).ok_or(cut)?;
    let descr = text_behind(header, "'descr':").and_then(|v| v.trim_start().strip_prefix('\'')?.split('\'').next());
    let is_big_endian = descr.is_some_and(|descr| descr.starts_with('>'));
    let (size, number) = descr.and_then(|descr| kind(&descr.replace('>', "<"))).ok_or_else(|| {
        let found = descr.unwrap_or("a record");
        let what = format!("holds numbers of type `{found}`; save arrays of float64, float32 or integers");
        ArrayError::Kind(what)
    })?;
    let order = text_behind(header, "'fortran_order':").map(str::trim_start).unwrap_or("");
    let by_columns = order.starts_with("True");
    if !by_columns && !order.starts_with("False") {
        return Err("does not say in which order its numbers stand; save it with numpy.save".into());
    }
    let shape: Option<Vec<usize>> =
        text_behind(header, "'shape':").and_then(|v| v.split_once('(')?.1.split_once(')')).and_then(|(list, _)| {
            list.split(',').map(str::trim).filter(|s| !s.is_empty()).map(|s| s.parse().ok()).collect()
        });
    let shape = shape.ok_or("names no shape; save it with numpy.save")?;
    let count = shape.iter().try_fold(1usize, |product, n| product.checked_mul(*n));
    let needed = count.and_then(|count| count.checked_mul(size));
    let cut = ArrayError::Cut("is cut: it holds fewer numbers than its shape");
    let data = needed.and_then(|needed| data.get(..needed)).ok_or(cut)?;
    budget.elements(data.len() / size, size_of::<f64>())?;
    // Of the longest numbers; those of machines that count from the other end are turned round.
    let mut turned = [0; 8];
    let mut read = |bytes: &[u8]| match turned.get_mut(..size).filter(|_| is_big_endian) {
        Some(turned) => {
            turned.iter_mut().zip(bytes.iter().rev()).for_each(|(to, from)| *to = *from);
            number(turned)
        }
        None => number(bytes),
    };
    let mut values: Vec<f64> = data.chunks_exact(size).map(&mut read).collect();
    match *shape.as_slice() {
        _ if !by_columns => {}
        [_] | [] => {}
        [rows, columns] => {
            budget.elements(values.len(), size_of::<f64>())?;
            let stored = values;
            let at = |i: usize| stored.get((i % columns) * rows + i / columns).copied().unwrap_or(f64::NAN);
            values = (0..stored.len()).map(at).collect();
            budget.give_back(size_of_val(stored.as_slice()));
        }
        _ => return Err("is stored column by column; save numpy.ascontiguousarray of it".into()),
    }
    Ok(Array { shape, values })
}

/// Bytes of a number, and how it is read from them.
type NumberKind = (usize, fn(&[u8]) -> f64);

fn kind(descr: &str) -> Option<NumberKind> {
    /// The first bytes; a chunk has as many as its number.
    fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
        bytes.first_chunk().copied().unwrap_or([0; N])
    }
    Some(match descr {
        "<f8" => (8, |b| f64::from_le_bytes(array(b))),
        "<f4" => (4, |b| f64::from(f32::from_le_bytes(array(b)))),
        "<i8" => (8, |b| i64::from_le_bytes(array(b)) as f64),
        "<u8" => (8, |b| u64::from_le_bytes(array(b)) as f64),
        "<i4" => (4, |b| f64::from(i32::from_le_bytes(array(b)))),
        "<u4" => (4, |b| f64::from(u32::from_le_bytes(array(b)))),
        "<i2" => (2, |b| f64::from(i16::from_le_bytes(array(b)))),
        "<u2" => (2, |b| f64::from(u16::from_le_bytes(array(b)))),
        "|i1" => (1, |b| f64::from(i8::from_le_bytes(array(b)))),
        "|u1" | "|b1" => (1, |b| f64::from(u8::from_le_bytes(array(b)))),
        _ => return None,
    })
}

/// Header text and data.
fn split(bytes: &[u8]) -> Option<(&str, &[u8])> {
    let rest = bytes.strip_prefix(b"\x93NUMPY")?;
    let (&[major, _minor], rest) = rest.split_first_chunk::<2>()?;
    let (length, rest) = if major == 1 {
        let (length, rest) = rest.split_first_chunk::<2>()?;
        (usize::from(u16::from_le_bytes(*length)), rest)
    } else {
        let (length, rest) = rest.split_first_chunk::<4>()?;
        (usize::try_from(u32::from_le_bytes(*length)).ok()?, rest)
    };
    let (header, data) = rest.split_at_checked(length)?;
    Some((std::str::from_utf8(header).ok()?, data))
}

fn text_behind<'a>(header: &'a str, key: &str) -> Option<&'a str> {
    header.split_once(key).map(|(_, rest)| rest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(bytes: &[u8]) -> Result<Array, ArrayError> {
        super::parse(bytes, &Budget::of(bytes.len() as u64))
    }

    fn file(header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend(u16::try_from(header.len()).expect("a short header").to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
    }

    #[test]
    fn numbers_of_machines_that_count_from_the_other_end_are_read() {
        let doubles: Vec<u8> = [1.5f64, -2.0].iter().flat_map(|v| v.to_be_bytes()).collect();
        let header = "{'descr': '>f8', 'fortran_order': False, 'shape': (2,), }\n";
        assert_eq!(parse(&file(header, &doubles)).expect("an array").values, [1.5, -2.0]);
        let header = "{'descr': '>i2', 'fortran_order': False, 'shape': (1,), }\n";
        assert_eq!(parse(&file(header, &[1, 2])).expect("an array").values, [258.0]);
    }

    #[test]
    fn both_widths_of_floats_are_read() {
        let doubles: Vec<u8> = [1.5f64, -2.0].iter().flat_map(|v| v.to_le_bytes()).collect();
        let array = parse(&file("{'descr': '<f8', 'fortran_order': False, 'shape': (2, 1), }\n", &doubles));
        assert_eq!(array, Ok(Array { shape: vec![2, 1], values: vec![1.5, -2.0] }));
        let array = parse(&file("{'descr': '<f4', 'fortran_order': False, 'shape': (1,), }\n", &1.5f32.to_le_bytes()));
        assert_eq!(array, Ok(Array { shape: vec![1], values: vec![1.5] }));
    }

    #[test]
    fn integers_and_columns_are_read_and_records_are_refused() {
        let stamps: Vec<u8> = [1_500_000_000_000_i64, -3].iter().flat_map(|v| v.to_le_bytes()).collect();
        let array = parse(&file("{'descr': '<i8', 'fortran_order': False, 'shape': (2,), }\n", &stamps));
        assert_eq!(array, Ok(Array { shape: vec![2], values: vec![1.5e12, -3.0] }));
        let array = parse(&file("{'descr': '|u1', 'fortran_order': True, 'shape': (2, 3), }\n", &[1, 4, 2, 5, 3, 6]));
        assert_eq!(array, Ok(Array { shape: vec![2, 3], values: vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0] }));
        let error = parse(&file("{'descr': [('q', '<f8')], 'fortran_order': False, 'shape': (2,), }\n", &[0; 16]));
        assert!(error.is_err_and(|what| what.to_string().contains("a record")));
    }

    #[test]
    fn a_cut_file_and_a_huge_shape_are_refused() {
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (18446744073709551615, 4, 4), }\n";
        assert!(parse(&file(header, &[0; 64])).is_err());
        assert!(parse(&file("{'descr': '<f8', 'fortran_order': True, 'shape': (2, 2, 2), }", &[0; 64])).is_err());
    }

    #[test]
    fn bytes_that_become_more_doubles_than_there_is_room_for_are_refused() {
        let bytes = file("{'descr': '|u1', 'fortran_order': False, 'shape': (100,), }\n", &[7; 100]);
        let spent = super::parse(&bytes, &Budget::with(799, 1000));
        assert_eq!(spent, Err(ArrayError::Budget(BudgetError::Memory(799))));
        super::parse(&bytes, &Budget::with(800, 1000)).expect("room for a hundred doubles");
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..200), prefix in any::<bool>()) {
            let mut file = if prefix { b"\x93NUMPY\x01\x00\x20\x00".to_vec() } else { Vec::new() };
            file.extend(bytes);
            let _ = parse(&file);
        }
    }
}
