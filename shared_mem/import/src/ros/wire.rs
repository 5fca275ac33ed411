//! Numbers and texts of a message, front to back: CDR (ROS 2) aligns each to its size, ROS 1 packs them. No length is
//! believed beyond the message's end.

use super::definition::Primitive;

/// How messages are encoded.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Encoding {
    /// ROS 2.
    Cdr,
    /// ROS 1.
    Ros1,
}

/// Reads one message.
#[derive(Debug, Clone)]
pub(super) struct Reader<'a> {
    data: &'a [u8],
    at: usize,
    /// Bytes in front of what alignment counts from.
    origin: usize,
    /// Largest alignment; 1 where values are packed.
    align: usize,
    big_endian: bool,
    encoding: Encoding,
}

/// A message ends early, or is not what its type says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Broken;

impl<'a> Reader<'a> {
    pub(super) fn new(data: &'a [u8], encoding: Encoding) -> Result<Self, Broken> {
        let packed = Self { data, at: 0, origin: 0, align: 1, big_endian: false, encoding };
        match encoding {
            Encoding::Ros1 => Ok(packed),
            Encoding::Cdr => {
                let (&[0, representation, _, _], _) = data.split_first_chunk::<4>().ok_or(Broken)? else {
                    return Err(Broken);
                };
                // Plain CDR of the first version, and of the second.
                let align = match representation {
                    0 | 1 => 8,
                    6 | 7 => 4,
                    _ => return Err(Broken),
                };
                let big_endian = representation.is_multiple_of(2);
                Ok(Self { at: 4, origin: 4, align, big_endian, ..packed })
            }
        }
    }

    /// Whether nothing but padding is left.
    pub(super) fn is_at_end(&self) -> bool {
        self.at + 4 > self.data.len() && self.at <= self.data.len()
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], Broken> {
        let align = N.min(self.align);
        self.at = self.origin + (self.at - self.origin).next_multiple_of(align);
        let mut bytes = *self.data.get(self.at..).and_then(|rest| rest.first_chunk::<N>()).ok_or(Broken)?;
        self.at += N;
        if self.big_endian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    pub(super) fn u32(&mut self) -> Result<u32, Broken> {
        Ok(u32::from_le_bytes(self.take()?))
    }

    /// How many follow; never more than bytes are left.
    pub(super) fn length(&mut self) -> Result<usize, Broken> {
        let length = self.u32()? as usize;
        self.holds(length, 1)?;
        Ok(length)
    }

    /// Whether so many elements may follow that take `least` bytes each, at least.
    pub(super) fn holds(&self, count: usize, least: usize) -> Result<(), Broken> {
        let left = self.data.len().saturating_sub(self.at);
        if count.saturating_mul(least) > left { Err(Broken) } else { Ok(()) }
    }

    /// Passes over `length` bytes.
    pub(super) fn skip(&mut self, length: usize) -> Result<(), Broken> {
        self.at = self.at.checked_add(length).filter(|at| *at <= self.data.len()).ok_or(Broken)?;
        Ok(())
    }

    pub(super) fn text(&mut self) -> Result<&'a str, Broken> {
        let length = self.length()?;
        let from = self.at;
        self.skip(length)?;
        let text = std::str::from_utf8(self.data.get(from..self.at).ok_or(Broken)?).map_err(|_| Broken)?;
        match self.encoding {
            Encoding::Cdr => Ok(text.strip_suffix('\0').unwrap_or(text)),
            Encoding::Ros1 => Ok(text),
        }
    }

    /// A moment of ROS 1 [ns].
    pub(super) fn moment(&mut self) -> Result<u64, Broken> {
        Ok(u64::from(self.u32()?) * 1_000_000_000 + u64::from(self.u32()?))
    }

    /// A number of that type. Texts and moments are none.
    pub(super) fn number(&mut self, kind: Primitive) -> Result<f64, Broken> {
        Ok(match kind {
            Primitive::Bool | Primitive::U8 => f64::from(self.take::<1>()?[0]),
            Primitive::I8 => f64::from(self.take::<1>()?[0].cast_signed()),
            Primitive::U16 => f64::from(u16::from_le_bytes(self.take()?)),
            Primitive::I16 => f64::from(i16::from_le_bytes(self.take()?)),
            Primitive::U32 => f64::from(self.u32()?),
            Primitive::I32 => f64::from(i32::from_le_bytes(self.take()?)),
            Primitive::U64 => u64::from_le_bytes(self.take()?) as f64,
            Primitive::I64 => i64::from_le_bytes(self.take()?) as f64,
            Primitive::F32 => f64::from(f32::from_le_bytes(self.take()?)),
            Primitive::F64 => f64::from_le_bytes(self.take()?),
            Primitive::Text | Primitive::Moment => return Err(Broken),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_aligns_and_the_other_packs() {
        let mut cdr = vec![0, 1, 0, 0, 7, 0, 0, 0, 0, 0, 0, 0];
        cdr.extend(2.5f64.to_le_bytes());
        let mut reader = Reader::new(&cdr, Encoding::Cdr).expect("a header");
        assert_eq!((reader.number(Primitive::U8), reader.number(Primitive::F64)), (Ok(7.0), Ok(2.5)));
        let mut ros1 = vec![7];
        ros1.extend(2.5f64.to_le_bytes());
        let mut reader = Reader::new(&ros1, Encoding::Ros1).expect("no header");
        assert_eq!((reader.number(Primitive::U8), reader.number(Primitive::F64)), (Ok(7.0), Ok(2.5)));
        assert_eq!(reader.number(Primitive::U8), Err(Broken));
    }

    #[test]
    fn a_length_beyond_the_message_is_refused() {
        let mut reader = Reader::new(&[0xff, 0xff, 0xff, 0x7f, 1], Encoding::Ros1).expect("no header");
        assert_eq!(reader.clone().length(), Err(Broken));
        assert_eq!(reader.text(), Err(Broken));
        assert_eq!(
            (reader.holds(1, 1), reader.holds(1, 2), reader.holds(usize::MAX, 8)),
            (Ok(()), Err(Broken), Err(Broken))
        );
    }
}
