//! Types of messages as their `.msg` texts define them: the message itself, and behind lines of `=` every type it uses.

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
    /// Whether it is a `Time`: the stamp of a header.
    pub(super) is_time: bool,
}

/// The fields of the type that `text` defines; `None` where it cannot be understood. `type_name` is its full name.
pub(super) fn parse(type_name: &str, text: &str) -> Option<Vec<Field>> {
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
    let mut left = MOST_FIELDS;
    fields(&short(type_name), &texts, &mut left, DEEPEST)
}

/// `sensor_msgs/msg/JointState` as `sensor_msgs/JointState`.
fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

fn fields(name: &str, texts: &HashMap<String, &str>, left: &mut usize, depth: usize) -> Option<Vec<Field>> {
    let package = name.split_once('/').map_or("", |(package, _)| package);
    let depth = depth.checked_sub(1)?;
    let mut found = Vec::new();
    for line in texts.get(name)?.lines() {
        let line = line.split('#').next().unwrap_or("").trim();
        let mut words = line.split_whitespace();
        let (Some(kind), Some(field)) = (words.next(), words.next()) else { continue };
        // A constant.
        if field.contains('=') || words.next().is_some_and(|word| word.starts_with('=')) {
            continue;
        }
        *left = left.checked_sub(1)?;
        let (kind, arity) = arity(kind)?;
        let kind = kind.split("<=").next()?;
        let is_time = matches!(kind, "time" | "builtin_interfaces/Time" | "builtin_interfaces/msg/Time");
        let kind = match primitive(kind) {
            Some(primitive) => Kind::Primitive(primitive),
            None => {
                let full = match short(kind) {
                    header if header == "Header" => "std_msgs/Header".to_owned(),
                    full if full.contains('/') => full,
                    local => format!("{package}/{local}"),
                };
                Kind::Message(fields(&full, texts, left, depth)?)
            }
        };
        found.push(Field { name: field.to_owned(), kind, arity, is_time });
    }
    Some(found)
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

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in "[ -~\n]{0,200}", name in "[a-z/]{0,9}") {
            let _ = parse(&name, &text);
        }
    }
}
