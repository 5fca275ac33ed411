//! A message as one row: its numbers in the order of its fields, what they are called, and the stamp of its header.

use super::definition::{Arity, Field, Kind, Primitive};
use super::wire::{Broken, Reader};
use shared_mem::budget::{Budget, BudgetError};
use std::collections::HashMap;

/// Arrays of bytes from this length on are pictures or the like, and no numbers to calculate with.
const BYTES: usize = 64;
/// More numbers, lists or texts than a row of any use has.
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
    /// It has more numbers, lists or texts than a row of any use; those above are the first of them.
    pub(super) is_long: bool,
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

/// A message is not read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Unread {
    /// It is not what its type says.
    Broken,
    /// It takes too much.
    Budget(BudgetError),
}

impl From<Broken> for Unread {
    fn from(_: Broken) -> Self {
        Self::Broken
    }
}

impl From<BudgetError> for Unread {
    fn from(over: BudgetError) -> Self {
        Self::Budget(over)
    }
}

impl<'a> Flat<'a> {
    /// Reads one message of these fields; `named`: with the names of its numbers.
    pub(super) fn read(
        fields: &[Field],
        reader: &mut Reader<'a>,
        named: bool,
        budget: &Budget,
    ) -> Result<Self, Unread> {
        let mut flat = Self { names: named.then(Vec::new), ..Self::default() };
        flat.fields(fields, (reader, budget), "")?;
        Ok(flat)
    }

    /// Names of the numbers: `q[0]`, `pose.position.x`; in place of a number the joint's name, where the message has as many.
    pub(super) fn names(&self) -> Vec<String> {
        let Some(names) = &self.names else { return Vec::new() };
        let mut counts: HashMap<&str, usize> = HashMap::new();
        for name in names {
            *counts.entry(&name.base).or_default() += 1;
        }
        let label = |name: &Name| match name.index {
            None => name.base.clone(),
            Some(index) => {
                let count = counts.get(name.base.as_str()).copied().unwrap_or(0);
                match self.texts.get(index).filter(|text| self.texts.len() == count && !text.is_empty()) {
                    Some(text) => format!("{}[{text}]", name.base),
                    None => format!("{}[{index}]", name.base),
                }
            }
        };
        names.iter().map(label).collect()
    }

    fn fields(
        &mut self,
        fields: &[Field],
        (reader, budget): (&mut Reader<'a>, &Budget),
        prefix: &str,
    ) -> Result<(), Unread> {
        for field in fields {
            budget.step(1)?;
            let count = match field.arity {
                Arity::One => 1,
                Arity::Fixed(count) => count,
                Arity::Sequence => {
                    let count = reader.length()?;
                    self.is_long |= self.shape.len() >= MOST_NUMBERS;
                    if !self.is_long {
                        self.shape.push(count);
                    }
                    count
                }
            };
            reader.holds(count, field.least)?;
            let path = match &self.names {
                Some(_) if prefix.is_empty() => field.name.clone(),
                Some(_) => format!("{prefix}.{}", field.name),
                None => String::new(),
            };
            match &field.kind {
                Kind::Message(_) if field.is_time => {
                    for _ in 0..count {
                        budget.step(1)?;
                        let (seconds, rest) = (reader.u32()?, reader.u32()?);
                        self.stamp_ns.get_or_insert(u64::from(seconds) * 1_000_000_000 + u64::from(rest));
                    }
                }
                Kind::Message(inner) => {
                    let around = self.in_header;
                    self.in_header |= field.name == HEADER;
                    for i in 0..count {
                        let at = if field.arity == Arity::One { path.clone() } else { format!("{path}[{i}]") };
                        self.fields(inner, (reader, budget), &at)?;
                    }
                    self.in_header = around;
                }
                Kind::Primitive(primitive) => self.primitives((*primitive, count), field, (reader, budget), path)?,
            }
        }
        Ok(())
    }

    fn primitives(
        &mut self,
        (primitive, count): (Primitive, usize),
        field: &Field,
        (reader, budget): (&mut Reader<'a>, &Budget),
        path: String,
    ) -> Result<(), Unread> {
        let is_byte = matches!(primitive, Primitive::U8 | Primitive::I8);
        if is_byte && count > BYTES {
            self.has_bytes = true;
            return Ok(reader.skip(count)?);
        }
        budget.step(count)?;
        for i in 0..count {
            match primitive {
                Primitive::Text => {
                    let text = reader.text()?;
                    if field.arity == Arity::Sequence || field.name == "child_frame_id" {
                        self.is_long |= self.texts.len() >= MOST_NUMBERS;
                        if !self.is_long {
                            self.texts.push(text);
                        }
                    }
                }
                Primitive::Moment => {
                    let moment = reader.moment()?;
                    self.stamp_ns.get_or_insert(moment);
                }
                number => {
                    let value = reader.number(number)?;
                    self.is_long |= !self.in_header && self.numbers.len() >= MOST_NUMBERS;
                    if self.in_header || self.is_long {
                        continue;
                    }
                    self.numbers.push(value);
                    if let Some(names) = &mut self.names {
                        budget.take(size_of::<Name>() + path.len())?;
                        let index = (field.arity != Arity::One).then_some(i);
                        names.push(Name { base: path.clone(), index });
                    }
                }
            }
        }
        Ok(())
    }
}
