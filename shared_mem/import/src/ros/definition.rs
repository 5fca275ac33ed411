//! Types of messages as their `.msg` texts define them: the message itself, and behind lines of `=` every type it uses. Arrays
//! of a type that takes no byte are no such types: any number of elements would be there.

use shared_mem::budget::{Budget, BudgetError};
use std::collections::HashMap;

/// The most fields that a type may have, nested ones counted, and how deep types may lie in each other: more than any real
/// one, and a bound for a text that defines itself by itself.
const MOST_FIELDS: usize = 20_000;
const DEEPEST: usize = 12;

/// A number, text or moment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Primitive {
    Bool,
    U8,
    I8,
    U16,
    I16,
    U32,
    I32,
    U64,
    I64,
    F32,
    F64,
    Text,
    /// ROS 1's `time` and `duration`: two 32-bit words.
    Moment,
}

/// How many of it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Arity {
    One,
    Fixed(usize),
    Sequence,
}

/// What a field holds.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) enum Kind {
    Primitive(Primitive),
    Message(Vec<Field>),
}

/// A field of a message.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Field {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) arity: Arity,
    /// What one element takes in a message, at least [bytes].
    pub(super) least: usize,
    /// Whether it is a `Time`: the stamp of a header.
    pub(super) is_time: bool,
}

/// Why a text defines no type.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Undefined {
    /// It cannot be understood.
    Text,
    /// It takes too much.
    Budget(BudgetError),
}

impl From<BudgetError> for Undefined {
    fn from(over: BudgetError) -> Self {
        Self::Budget(over)
    }
}

/// The fields of the type that `text` defines; `type_name` is its full name.
pub(super) fn parse(type_name: &str, text: &str, budget: &Budget) -> Result<Vec<Field>, Undefined> {
    budget.step(text.len())?;
    let texts = texts(type_name, text).ok_or(Undefined::Text)?;
    let mut types = Types { texts, left: MOST_FIELDS, budget };
    types.fields(&short(type_name), DEEPEST)
}

/// The text of each type by its short name.
fn texts<'a>(type_name: &str, text: &'a str) -> Option<HashMap<String, &'a str>> {
    let mut texts: HashMap<String, &str> = HashMap::new();
    let mut rest = text;
    let mut name = short(type_name);
    loop {
        let cut = rest.lines().find(|line| line.len() >= 10 && line.bytes().all(|b| b == b'='));
        let Some(rule) = cut else {
            texts.insert(name, rest);
            break;
        };
        let at = rule.as_ptr() as usize - rest.as_ptr() as usize;
        texts.insert(name, rest.get(..at)?);
        let after = rest.get(at + rule.len()..)?.trim_start();
        let (title, body) = after.split_once('\n').unwrap_or((after, ""));
        name = short(title.trim().strip_prefix("MSG: ")?.trim());
        rest = body;
    }
    Some(texts)
}

/// `sensor_msgs/msg/JointState` as `sensor_msgs/JointState`.
fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

/// Types that are being put together.
struct Types<'a> {
    texts: HashMap<String, &'a str>,
    /// Fields that there may still be.
    left: usize,
    budget: &'a Budget,
}

impl Types<'_> {
    fn fields(&mut self, name: &str, depth: usize) -> Result<Vec<Field>, Undefined> {
        let depth = depth.checked_sub(1).ok_or(Undefined::Text)?;
        let text = *self.texts.get(name).ok_or(Undefined::Text)?;
        // Comments take time, too, and each use of the type goes through them again.
        self.budget.step(text.len())?;
        let package = name.split_once('/').map_or("", |(package, _)| package);
        text.lines().filter_map(|line| self.field(line, package, depth).transpose()).collect()
    }

    /// The field of a line; `None` where it has none.
    fn field(&mut self, line: &str, package: &str, depth: usize) -> Result<Option<Field>, Undefined> {
        let line = line.split('#').next().unwrap_or("").trim();
        let mut words = line.split_whitespace();
        let (Some(kind), Some(name)) = (words.next(), words.next()) else { return Ok(None) };
        // A constant.
        if name.contains('=') || words.next().is_some_and(|word| word.starts_with('=')) {
            return Ok(None);
        }
        self.left = self.left.checked_sub(1).ok_or(Undefined::Text)?;
        self.budget.take(size_of::<Field>() + name.len())?;
        let (kind, arity) = arity(kind).ok_or(Undefined::Text)?;
        let kind = kind.split("<=").next().unwrap_or(kind);
        let is_time = matches!(kind, "time" | "builtin_interfaces/Time" | "builtin_interfaces/msg/Time");
        let (kind, least) = match primitive(kind) {
            Some(primitive) => (Kind::Primitive(primitive), primitive.least()),
            None => {
                let full = match short(kind) {
                    header if header == "Header" => "std_msgs/Header".to_owned(),
                    full if full.contains('/') => full,
                    local => format!("{package}/{local}"),
                };
                let inner = self.fields(&full, depth)?;
                let least = inner.iter().fold(0, |sum: usize, field| sum.saturating_add(field.least_of_all()));
                (Kind::Message(inner), least)
            }
        };
        if least == 0 && arity != Arity::One {
            return Err(Undefined::Text);
        }
        Ok(Some(Field { name: name.to_owned(), kind, arity, least, is_time }))
    }
}

impl Field {
    /// What all its elements take, at least [bytes].
    fn least_of_all(&self) -> usize {
        match self.arity {
            Arity::One => self.least,
            Arity::Fixed(count) => self.least.saturating_mul(count),
            // Their number.
            Arity::Sequence => size_of::<u32>(),
        }
    }
}

impl Primitive {
    /// What it takes in a message, at least [bytes].
    fn least(self) -> usize {
        match self {
            Self::Bool | Self::U8 | Self::I8 => 1,
            Self::U16 | Self::I16 => 2,
            // Of a text its length.
            Self::U32 | Self::I32 | Self::F32 | Self::Text => 4,
            Self::U64 | Self::I64 | Self::F64 | Self::Moment => 8,
        }
    }
}

fn arity(kind: &str) -> Option<(&str, Arity)> {
    let Some((kind, count)) = kind.split_once('[') else { return Some((kind, Arity::One)) };
    let count = count.strip_suffix(']')?;
    if count.is_empty() || count.starts_with("<=") {
        return Some((kind, Arity::Sequence));
    }
    Some((kind, Arity::Fixed(count.parse().ok()?)))
}

fn primitive(kind: &str) -> Option<Primitive> {
    Some(match kind {
        "bool" => Primitive::Bool,
        "uint8" | "char" | "byte" => Primitive::U8,
        "int8" => Primitive::I8,
        "uint16" => Primitive::U16,
        "int16" => Primitive::I16,
        "uint32" => Primitive::U32,
        "int32" => Primitive::I32,
        "uint64" => Primitive::U64,
        "int64" => Primitive::I64,
        "float32" => Primitive::F32,
        "float64" => Primitive::F64,
        "string" => Primitive::Text,
        "time" | "duration" => Primitive::Moment,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(type_name: &str, text: &str) -> Option<Vec<Field>> {
        super::parse(type_name, text, &Budget::of(text.len() as u64)).ok()
    }

    #[test]
    fn constants_comments_arrays_and_nested_types_are_understood() {
        let rule = "=".repeat(80);
        let text = format!(
            "# a state\nuint8 MODE_IDLE = 1\nuint8 MODE_MOVE=2\nHeader header # when\nfloat64[7] q\nstring<=8[<=3] name\n\
             Errors errors\n{rule}\nMSG: std_msgs/Header\nuint32 seq\ntime stamp\nstring frame_id\n{rule}\n\
             MSG: franka_msgs/Errors\nbool reflex\n"
        );
        let fields = parse("franka_msgs/State", &text).expect("a definition");
        let names: Vec<&str> = fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["header", "q", "name", "errors"]);
        assert_eq!((fields[1].arity, fields[2].arity), (Arity::Fixed(7), Arity::Sequence));
        assert!(matches!(&fields[3].kind, Kind::Message(inside) if inside[0].name == "reflex"));
    }

    #[test]
    fn a_type_that_holds_itself_or_an_unknown_one_is_refused() {
        assert_eq!(parse("a/Loop", "Loop loop\n"), None);
        assert_eq!(parse("a/B", "Missing m\n"), None);
    }

    #[test]
    fn arrays_of_what_takes_no_byte_are_refused_and_one_of_it_is_not() {
        let rule = "=".repeat(80);
        let with = |own: &str| parse("a/Msg", &format!("{own}\n{rule}\nMSG: a/E\n{rule}\nMSG: a/Holds\nE e\n"));
        assert_eq!(with("E[1000000000000] e"), None);
        assert_eq!(with("E[] e"), None);
        assert_eq!(with("Holds[] e"), None);
        assert_eq!(with("E e\nuint8 x").map(|fields| (fields[0].least, fields[1].least)), Some((0, 1)));
    }

    #[test]
    fn a_text_that_uses_long_comments_again_and_again_is_refused() {
        // 12 levels of 8 uses each of what lies below, and the last has a page of comments.
        let rule = "=".repeat(80);
        let level = |n: usize| format!("MSG: a/T{n}\n{}{rule}\n", format!("T{} x\n", n + 1).repeat(8));
        let levels: String = (1..4).map(level).collect();
        let text = format!("T1 x\n{rule}\n{levels}MSG: a/T4\n{}", "# nothing\n".repeat(1000));
        assert_eq!(parse("a/Top", &text).map(|fields| fields.len()), Some(1));
        let spent = super::parse("a/Top", &text, &Budget::with(1 << 30, 1_000_000));
        assert_eq!(spent, Err(Undefined::Budget(BudgetError::Steps(1_000_000))));
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in "[ -~\n]{0,200}", name in "[a-z/]{0,9}") {
            let _ = parse(&name, &text);
        }
    }
}
