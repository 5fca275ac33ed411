//! A message as one row: its numbers in the order of its fields, what they are called, and the stamp of its header.

use super::definition::{Arity, Field, Kind, Primitive};
use super::wire::{Broken, Reader};

/// Arrays of bytes from this length on are pictures or the like, and no numbers to calculate with.
const BYTES: usize = 64;
/// More numbers than a row of any use has.
const MOST_NUMBERS: usize = 10_000;
/// What every header holds beside its stamp.
const HEADER: &str = "header";

/// The numbers of one message.
#[derive(Debug, Default)]
pub(super) struct Flat<'a> {
    /// Stamp of the first header, or the first moment of any name [ns].
    pub(super) stamp_ns: Option<u64>,
    pub(super) numbers: Vec<f64>,
    /// Lengths of its sequences: two messages of one shape have numbers of one meaning.
    pub(super) shape: Vec<usize>,
    /// What names its rows: joint names, the frame that a transform leads to.
    pub(super) texts: Vec<&'a str>,
    /// It holds a picture or the like.
    pub(super) has_bytes: bool,
    /// Within a header, whose numbers are none of the row's.
    in_header: bool,
    /// Names of the numbers, where they were asked for.
    names: Option<Vec<Name>>,
}

/// A field, and the place in its array.
#[derive(Debug, Clone)]
struct Name {
    base: String,
    index: Option<usize>,
}

impl<'a> Flat<'a> {
    /// Reads one message of these fields; `named`: with the names of its numbers.
    pub(super) fn read(fields: &[Field], reader: &mut Reader<'a>, named: bool) -> Result<Self, Broken> {
        let mut flat = Self { names: named.then(Vec::new), ..Self::default() };
        flat.fields(fields, reader, "")?;
        Ok(flat)
    }

    /// Names of the numbers: `q[0]`, `pose.position.x`; in place of a number the joint's name, where the message has as many.
    pub(super) fn names(&self) -> Vec<String> {
        let Some(names) = &self.names else { return Vec::new() };
        let label = |name: &Name| match name.index {
            None => name.base.clone(),
            Some(index) => {
                let count = names.iter().filter(|other| other.base == name.base).count();
                match self.texts.get(index).filter(|text| self.texts.len() == count && !text.is_empty()) {
                    Some(text) => format!("{}[{text}]", name.base),
                    None => format!("{}[{index}]", name.base),
                }
            }
        };
        names.iter().map(label).collect()
    }

    fn fields(&mut self, fields: &[Field], reader: &mut Reader<'a>, prefix: &str) -> Result<(), Broken> {
        for field in fields {
            let count = match field.arity {
                Arity::One => 1,
                Arity::Fixed(count) => count,
                Arity::Sequence => {
                    let count = reader.length()?;
                    self.shape.push(count);
                    count
                }
            };
            let path = match &self.names {
                Some(_) if prefix.is_empty() => field.name.clone(),
                Some(_) => format!("{prefix}.{}", field.name),
                None => String::new(),
            };
            match &field.kind {
                Kind::Message(_) if field.is_time => {
                    for _ in 0..count {
                        let (seconds, rest) = (reader.u32()?, reader.u32()?);
                        self.stamp_ns.get_or_insert(u64::from(seconds) * 1_000_000_000 + u64::from(rest));
                    }
                }
                Kind::Message(inner) => {
                    let around = self.in_header;
                    self.in_header |= field.name == HEADER;
                    for i in 0..count {
                        let at = if field.arity == Arity::One { path.clone() } else { format!("{path}[{i}]") };
                        self.fields(inner, reader, &at)?;
                    }
                    self.in_header = around;
                }
                Kind::Primitive(primitive) => self.primitives((*primitive, count), field, reader, path)?,
            }
        }
        Ok(())
    }

    fn primitives(
        &mut self,
        (primitive, count): (Primitive, usize),
        field: &Field,
        reader: &mut Reader<'a>,
        path: String,
    ) -> Result<(), Broken> {
        let is_byte = matches!(primitive, Primitive::U8 | Primitive::I8);
        if is_byte && count > BYTES {
            self.has_bytes = true;
            return reader.skip(count);
        }
        for i in 0..count {
            match primitive {
                Primitive::Text => {
                    let text = reader.text()?;
                    if field.arity == Arity::Sequence || field.name == "child_frame_id" {
                        self.texts.push(text);
                    }
                }
                Primitive::Moment => {
                    let moment = reader.moment()?;
                    self.stamp_ns.get_or_insert(moment);
                }
                number => {
                    let value = reader.number(number)?;
                    if self.in_header {
                        continue;
                    }
                    if self.numbers.len() >= MOST_NUMBERS {
                        return Err(Broken);
                    }
                    self.numbers.push(value);
                    if let Some(names) = &mut self.names {
                        let index = (field.arity != Arity::One).then_some(i);
                        names.push(Name { base: path.clone(), index });
                    }
                }
            }
        }
        Ok(())
    }
}
