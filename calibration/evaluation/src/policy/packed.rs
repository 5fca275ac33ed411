//! Arrays in msgpack, as openpi's client and server exchange numpy's: a map with the binary keys `__ndarray__`, `data`, `dtype` and
//! `shape`, little-endian. What comes in is believed only as far as its sizes agree, and only so much of it is taken.

use rmpv::Value;
use std::io::{self, Read};

/// Pieces that a message may be read in, of which a value has one or two: it takes a hundred times the byte that it is sent as.
const MOST_VALUES: usize = 1 << 20;
/// Numbers that an answer may have: a thousand actions of a thousand numbers.
pub(super) const MOST_NUMBERS: usize = 1 << 20;

/// An array of numbers as it came in, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Array {
    /// Length along each axis.
    pub shape: Vec<usize>,
    /// All numbers.
    pub values: Vec<f32>,
}

/// A message says nothing that can be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct PackedError(pub(super) String);

const MARK: &str = "__ndarray__";

/// An array of little-endian bytes of a numpy `dtype`, `<f4` for example.
pub(super) fn array(dtype: &str, shape: &[usize], data: Vec<u8>) -> Value {
    let key = |key: &str| Value::Binary(key.as_bytes().to_vec());
    let shape = shape.iter().map(|length| Value::from(*length as u64)).collect();
    Value::Map(vec![
        (key(MARK), Value::Boolean(true)),
        (key("data"), Value::Binary(data)),
        (key("dtype"), Value::from(dtype)),
        (key("shape"), Value::Array(shape)),
    ])
}

/// An array of single precision.
pub(super) fn floats(shape: &[usize], values: &[f32]) -> Value {
    array("<f4", shape, values.iter().flat_map(|value| value.to_le_bytes()).collect())
}

/// The bytes of a message.
pub fn pack(message: &Value) -> Vec<u8> {
    let mut bytes = Vec::new();
    // A vector takes whatever is written.
    let _cannot_fail = rmpv::encode::write_value(&mut bytes, message);
    bytes
}

/// A message out of its bytes.
///
/// # Errors
/// [`PackedError`] when they are no msgpack, more than one message, or too many values: arrays count as one each.
pub fn unpack(bytes: &[u8]) -> Result<Value, PackedError> {
    let mut counted = Counted { bytes, left: MOST_VALUES };
    let message = rmpv::decode::read_value_with_max_depth(&mut counted, 64);
    if counted.left == 0 {
        return Err(PackedError(format!("more than {MOST_VALUES} single values; send arrays of numbers")));
    }
    let message = message.map_err(|error| PackedError(format!("it is no msgpack ({error})")))?;
    if counted.bytes.is_empty() { Ok(message) } else { Err(PackedError("more bytes follow the message".into())) }
}

/// Bytes out of which so many pieces may be read; a value has one at least.
struct Counted<'a> {
    bytes: &'a [u8],
    left: usize,
}

impl Read for Counted<'_> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        self.left = self.left.saturating_sub(1);
        if self.left == 0 {
            return Err(io::ErrorKind::QuotaExceeded.into());
        }
        self.bytes.read(into)
    }
}

/// What stands in a map under a key, be it text or bytes.
pub(super) fn entry<'a>(map: &'a Value, key: &str) -> Option<&'a Value> {
    let is = |found: &Value| match found {
        Value::String(text) => text.as_bytes() == key.as_bytes(),
        Value::Binary(bytes) => bytes == key.as_bytes(),
        _ => false,
    };
    map.as_map()?.iter().find(|(found, _)| is(found)).map(|(_, value)| value)
}

impl Array {
    /// Out of a message: numpy's, or lists of numbers.
    ///
    /// # Errors
    /// [`PackedError`] saying what it is instead.
    pub fn read(value: &Value) -> Result<Self, PackedError> {
        Self::within(value, usize::MAX)
    }

    /// The same of `most` numbers at most.
    pub(super) fn within(value: &Value, most: usize) -> Result<Self, PackedError> {
        let is_numpy = entry(value, MARK).and_then(Value::as_bool) == Some(true);
        if is_numpy { Self::numpy(value, most) } else { Self::list(value, most) }
    }

    fn numpy(value: &Value, most: usize) -> Result<Self, PackedError> {
        let lacks = |key: &str| PackedError(format!("an array without a usable `{key}`"));
        let data = entry(value, "data").and_then(Value::as_slice).ok_or_else(|| lacks("data"))?;
        let dtype = entry(value, "dtype").and_then(|dtype| match dtype {
            Value::String(text) => text.as_str(),
            Value::Binary(bytes) => std::str::from_utf8(bytes).ok(),
            _ => None,
        });
        let dtype = dtype.ok_or_else(|| lacks("dtype"))?;
        let shape = entry(value, "shape").and_then(Value::as_array).ok_or_else(|| lacks("shape"))?;
        let length = |length: &Value| length.as_u64().and_then(|length| usize::try_from(length).ok());
        let shape: Option<Vec<usize>> = shape.iter().map(length).collect();
        let shape = shape.ok_or_else(|| lacks("shape"))?;
        let count = shape.iter().try_fold(1_usize, |count, length| count.checked_mul(*length));
        if count.is_none_or(|count| count > most) {
            return Err(PackedError(format!("an array of the shape {shape:?}; {most} numbers at most are taken")));
        }
        let values = numbers(dtype, data).ok_or_else(|| {
            PackedError(format!("an array of the type {dtype}; send float32, float64 or whole numbers, little-endian"))
        })?;
        if count == Some(values.len()) {
            Ok(Self { shape, values })
        } else {
            Err(PackedError(format!("an array of the shape {shape:?} with {} numbers", values.len())))
        }
    }

    fn list(value: &Value, most: usize) -> Result<Self, PackedError> {
        let Some(items) = value.as_array() else {
            let number =
                value.as_f64().ok_or_else(|| PackedError(format!("no array of numbers but {}", kind(value))))?;
            if most == 0 {
                return Err(PackedError(format!("lists of more than {MOST_NUMBERS} numbers")));
            }
            return Ok(Self { shape: Vec::new(), values: vec![number as f32] });
        };
        let mut left = most;
        let mut item = |item: &Value| {
            let item = Self::within(item, left)?;
            left = left.saturating_sub(item.values.len());
            Ok(item)
        };
        let items = items.iter().map(&mut item).collect::<Result<Vec<_>, PackedError>>()?;
        let within = items.first().map_or(Vec::new(), |first| first.shape.clone());
        if items.iter().any(|item| item.shape != within) {
            return Err(PackedError("a list of arrays of different shapes".into()));
        }
        let shape = std::iter::once(items.len()).chain(within).collect();
        Ok(Self { shape, values: items.into_iter().flat_map(|item| item.values).collect() })
    }

    /// The rows of a table; a single row of a list.
    ///
    /// # Errors
    /// [`PackedError`] for more or fewer axes, and where there is none.
    pub fn into_rows(self) -> Result<Rows, PackedError> {
        let columns = match self.shape[..] {
            [columns] => columns,
            [_, columns] => columns,
            _ => return Err(PackedError(format!("an array of the shape {:?}; give [actions, numbers]", self.shape))),
        };
        if columns == 0 || self.values.is_empty() {
            return Err(PackedError("an array with nothing in it".into()));
        }
        Ok(Rows { columns, values: self.values })
    }
}

/// A table of numbers: of a policy's answer, an action a row.
#[derive(Debug, Clone, PartialEq)]
pub struct Rows {
    /// At least one.
    columns: usize,
    values: Vec<f32>,
}

impl Rows {
    /// Row by row; there is one at least.
    pub fn iter(&self) -> std::slice::ChunksExact<'_, f32> {
        self.values.chunks_exact(self.columns)
    }
}

impl<'a> IntoIterator for &'a Rows {
    type Item = &'a [f32];
    type IntoIter = std::slice::ChunksExact<'a, f32>;

    fn into_iter(self) -> Self::IntoIter {
        self.iter()
    }
}

/// Numbers of a numpy type; `None` for a type that is not read, or half a number.
fn numbers(dtype: &str, data: &[u8]) -> Option<Vec<f32>> {
    fn of<const N: usize>(data: &[u8], number: fn([u8; N]) -> f32) -> Option<Vec<f32>> {
        let (chunks, rest) = data.as_chunks::<N>();
        rest.is_empty().then(|| chunks.iter().map(|chunk| number(*chunk)).collect())
    }
    match dtype {
        "<f4" => of(data, f32::from_le_bytes),
        "<f8" => of(data, |bytes| f64::from_le_bytes(bytes) as f32),
        "<i4" => of(data, |bytes| i32::from_le_bytes(bytes) as f32),
        "<i8" => of(data, |bytes| i64::from_le_bytes(bytes) as f32),
        "|u1" => of(data, |[byte]: [u8; 1]| f32::from(byte)),
        "|i1" => of(data, |[byte]: [u8; 1]| f32::from(byte.cast_signed())),
        "<u2" => of(data, |bytes| f32::from(u16::from_le_bytes(bytes))),
        _ => None,
    }
}

fn kind(value: &Value) -> &'static str {
    match value {
        Value::Nil => "nothing",
        Value::Boolean(_) => "a flag",
        Value::String(_) => "text",
        Value::Map(_) => "a map",
        _ => "something else",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `msgpack_numpy.packb({"actions": np.arange(6, dtype=np.float32).reshape(2, 3)})` of openpi-client 0.1.2.
    const RECORDED: &str = "81a7616374696f6e7384c40b5f5f6e6461727261795f5fc3c40464617461c41800000000\
                            0000803f00000040000040400000804000\
                            00a040c4056474797065a33c6634c4057368617065920203";

    fn recorded() -> Vec<u8> {
        let digits: Vec<u8> = RECORDED.bytes().filter(u8::is_ascii_hexdigit).collect();
        digits
            .chunks(2)
            .map(|pair| u8::from_str_radix(std::str::from_utf8(pair).expect("ASCII"), 16).expect("hex"))
            .collect()
    }

    #[test]
    fn what_openpi_s_own_codec_wrote_is_read_and_written_to_the_byte() {
        let message = unpack(&recorded()).expect("a message");
        let array = Array::read(entry(&message, "actions").expect("actions")).expect("an array");
        assert_eq!(array, Array { shape: vec![2, 3], values: vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0] });
        let again = Value::Map(vec![("actions".into(), floats(&[2, 3], &array.values))]);
        let rows = array.into_rows().expect("a table");
        assert_eq!(rows.iter().collect::<Vec<_>>(), [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0]]);
        assert_eq!(pack(&again), recorded());
    }

    #[test]
    fn what_does_not_add_up_is_refused_and_nothing_panics() {
        let bytes = recorded();
        for cut in 0..bytes.len() {
            assert!(unpack(&bytes[..cut]).is_err(), "{cut}");
        }
        for at in 0..bytes.len() {
            let mut changed = bytes.clone();
            changed[at] ^= 0x55;
            let _any = unpack(&changed).map(|message| entry(&message, "actions").map(Array::read));
        }
        let wrong = array("<f4", &[2, 4], vec![0; 24]);
        assert!(Array::read(&wrong).is_err_and(|error| error.to_string().contains("[2, 4] with 6 numbers")));
        assert!(
            Array::read(&array(">f4", &[1], vec![0; 4]))
                .is_err_and(|error| error.to_string().contains("little-endian"))
        );
        assert!(Array::read(&Value::from("no")).is_err_and(|error| error.to_string().contains("text")));
        assert!(
            floats(&[0, 3], &[]).as_map().is_some()
                && Array::read(&floats(&[0, 3], &[])).expect("an array").into_rows().is_err()
        );
    }

    #[test]
    fn lists_of_numbers_are_arrays_too() {
        let list = Value::Array(vec![Value::Array(vec![1.into(), 2.5.into()]), Value::Array(vec![3.into(), 4.into()])]);
        let rows = Array::read(&list).and_then(Array::into_rows).expect("a table");
        assert_eq!(rows.iter().collect::<Vec<_>>(), [[1.0, 2.5], [3.0, 4.0]]);
    }

    #[test]
    fn a_message_of_more_values_than_an_answer_has_is_refused_while_it_is_read() {
        let many = pack(&Value::Array(vec![1.into(); MOST_VALUES]));
        let told = unpack(&many).expect_err("too many").to_string();
        assert!(told.contains("more than 1048576 single values"), "{told}");
        unpack(&pack(&Value::Array(vec![1.into(); MOST_VALUES / 2]))).expect("half as many");
        // Bytes are one value, however many there are.
        unpack(&pack(&array("|u1", &[1 << 24], vec![0; 1 << 24]))).expect("a large picture");
    }

    #[test]
    fn an_answer_of_more_numbers_than_are_taken_is_refused_before_they_are_decoded() {
        let answer = |count: usize| array("|u1", &[count, 1], vec![0; count]);
        let told = Array::within(&answer(11), 10).expect_err("too many").to_string();
        assert!(told.contains("[11, 1]") && told.contains("10 numbers at most"), "{told}");
        Array::within(&Value::Array(vec![answer(5), answer(5)]), 10).expect("ten");
        Array::within(&Value::Array(vec![answer(6), answer(6)]), 10).expect_err("twelve");
        let wide = array("|u1", &[usize::MAX, 2], vec![0; 2]);
        assert!(Array::read(&wide).is_err_and(|error| error.to_string().contains("shape")));
        let numbers: Vec<Value> = vec![1.into(); 11];
        Array::within(&Value::Array(numbers), 10).expect_err("eleven single ones");
    }
}
