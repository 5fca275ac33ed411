//! NumPy's `.npy` files: little-endian floats in C order. Bytes in, numbers out.

/// Shape and numbers of an array, row-major.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Array {
    pub(super) shape: Vec<usize>,
    pub(super) values: Vec<f64>,
}

/// Reads an array; a sentence when it is none or of another kind.
pub(super) fn parse(bytes: &[u8]) -> Result<Array, String> {
    let (header, data) = split(bytes).ok_or("is no complete .npy file; save it with numpy.save")?;
    let size = match text_behind(header, "'descr':").and_then(|v| v.split('\'').nth(1)) {
        Some("<f8") => 8,
        Some("<f4") => 4,
        other => {
            let found = other.unwrap_or("nothing");
            return Err(format!("holds numbers of type `{found}`; save float64 or float32, little-endian"));
        }
    };
    if !text_behind(header, "'fortran_order':").is_some_and(|v| v.trim_start().starts_with("False")) {
        return Err("is stored column by column; save numpy.ascontiguousarray of it".into());
    }
    let shape: Option<Vec<usize>> =
        text_behind(header, "'shape':").and_then(|v| v.split_once('(')?.1.split_once(')')).and_then(|(list, _)| {
            list.split(',').map(str::trim).filter(|s| !s.is_empty()).map(|s| s.parse().ok()).collect()
        });
    let shape = shape.ok_or("names no shape; save it with numpy.save")?;
    let count = shape.iter().try_fold(1usize, |product, n| product.checked_mul(*n));
    let needed = count.and_then(|count| count.checked_mul(size));
    let data = needed.and_then(|needed| data.get(..needed)).ok_or("is cut: it holds fewer numbers than its shape")?;
    let values = data.chunks_exact(size).map(|number| match *number {
        [a, b, c, d] => f64::from(f32::from_le_bytes([a, b, c, d])),
        [a, b, c, d, e, f, g, h] => f64::from_le_bytes([a, b, c, d, e, f, g, h]),
        _ => f64::NAN,
    });
    Ok(Array { shape, values: values.collect() })
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

    fn file(header: &str, data: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
        bytes.extend(u16::try_from(header.len()).expect("a short header").to_le_bytes());
        bytes.extend(header.as_bytes());
        bytes.extend(data);
        bytes
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
    fn a_cut_file_and_a_huge_shape_are_refused() {
        let header = "{'descr': '<f8', 'fortran_order': False, 'shape': (18446744073709551615, 4, 4), }\n";
        assert!(parse(&file(header, &[0; 64])).is_err());
        assert!(parse(&file("{'descr': '<f8', 'fortran_order': True, 'shape': (1,), }", &[0; 8])).is_err());
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
