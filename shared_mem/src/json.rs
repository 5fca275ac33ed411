//! JSON that other programs wrote: read within the budget of its input, and what is wrong with it said by key and line.

use crate::budget::{Budget, BudgetError};
use crate::input::{Encoding, NoText, Text, decode};
use serde::de::DeserializeOwned;
use serde_json::error::Category;
use std::borrow::Cow;

/// What one element may become [bytes]: a short text with its key, or a list that holds nothing.
const ELEMENT: usize = 48;
/// Bytes that are looked through between two draws.
const PIECE: usize = 1 << 20;
/// Characters of a text in the wrong place that are shown.
const SHOWN: usize = 40;

/// Reads JSON within the budget of the file that it stands in.
///
/// # Errors
/// A sentence to be put behind the input's name: the budget is spent, it is no JSON, or holds something else than a `T`.
///
/// # Example
/// ```
/// use shared_mem::{budget::Budget, json};
///
/// let numbers: Vec<f64> = json::read(b"[1.0, 2.5]", &Budget::of(1 << 16))?;
/// assert_eq!(numbers, [1.0, 2.5]);
/// assert!(json::read::<Vec<f64>>(b"[1.0, ", &Budget::of(1 << 16)).is_err());
/// # Ok::<(), String>(())
/// ```
pub fn read<T: DeserializeOwned>(bytes: &[u8], budget: &Budget) -> Result<T, String> {
    let text = text(bytes)?;
    draw(text.as_bytes(), budget).map_err(|spent| spent.to_string())?;
    serde_json::from_str(&text).map_err(|error| match no_number(&text) {
        Some((line, name)) if error.classify() == Category::Syntax => {
            format!("holds {name}, which is no number of JSON (line {line}): leave its key out, or write null")
        }
        _ => sentence(&error),
    })
}

/// Its letters; a name that is guessed at is worse than none.
fn text(bytes: &[u8]) -> Result<Cow<'_, str>, String> {
    let plain = std::str::from_utf8(bytes).ok().filter(|text| !text.starts_with('\u{feff}') && !text.contains('\0'));
    if let Some(plain) = plain {
        return Ok(Cow::Borrowed(plain));
    }
    match decode(bytes.to_vec()) {
        Ok(Text { encoding: Encoding::Windows1252, .. }) => {
            let before = bytes.iter().take_while(|byte| byte.is_ascii());
            let line = 1 + before.filter(|byte| **byte == b'\n').count();
            Err(format!("is no JSON: {}", NoText::Encoding(line)))
        }
        Ok(Text { text, .. }) => Ok(Cow::Owned(text)),
        Err(what) => Err(format!("is no JSON: {what}")),
    }
}

/// The first word outside of texts that other programs write for what is no number, and its line.
fn no_number(text: &str) -> Option<(usize, &'static str)> {
    let (mut inside, mut escaped, mut line) = (false, false, 1);
    for (at, byte) in text.bytes().enumerate() {
        match byte {
            _ if escaped => escaped = false,
            b'\\' => escaped = inside,
            b'"' => inside = !inside,
            b'\n' => line += 1,
            b'N' | b'n' | b'I' | b'i' if !inside => {
                let found = ["NaN", "nan", "Infinity", "inf"].into_iter().find(|name| text[at..].starts_with(name));
                if let Some(name) = found {
                    return Some((line, name));
                }
            }
            _ => {}
        }
    }
    None
}

/// Draws what its elements may become: what stands between commas and brackets outside of texts.
fn draw(bytes: &[u8], budget: &Budget) -> Result<(), BudgetError> {
    let (mut inside, mut escaped) = (false, false);
    for piece in bytes.chunks(PIECE) {
        let mut elements = 0;
        for byte in piece {
            match byte {
                _ if escaped => escaped = false,
                b'\\' => escaped = inside,
                b'"' => inside = !inside,
                b',' | b'[' | b'{' if !inside => elements += 1,
                _ => {}
            }
        }
        budget.elements(elements, ELEMENT)?;
    }
    Ok(())
}

fn sentence(error: &serde_json::Error) -> String {
    let (line, column) = (error.line(), error.column());
    let text = error.to_string();
    let what = text.strip_suffix(&format!(" at line {line} column {column}")).unwrap_or(&text);
    let what = match error.classify() {
        Category::Eof => "ends in the middle of its JSON".to_owned(),
        Category::Syntax | Category::Io => "is no JSON".to_owned(),
        Category::Data => wrong(what),
    };
    if line == 0 { what } else { format!("{what} (line {line}, column {column})") }
}

/// What is wrong with its content, in words.
fn wrong(what: &str) -> String {
    if let Some(key) = what.strip_prefix("missing field ") {
        return format!("has no {key}");
    }
    if let Some(key) = what.strip_prefix("duplicate field ") {
        return format!("holds {key} twice");
    }
    let found = ["invalid type: ", "invalid value: ", "invalid length "].iter().find_map(|start| {
        let (found, wanted) = what.strip_prefix(start)?.split_once(", expected ")?;
        let found = if *start == "invalid length " { format!("{found} elements") } else { shown(found) };
        Some(format!("holds {found} where {} is wanted", named(wanted)))
    });
    found.unwrap_or_else(|| what.to_owned())
}

/// A value as it stands in the file.
fn shown(found: &str) -> String {
    if let Some(text) = found.strip_prefix("string ") {
        let cut: String = text.chars().take(SHOWN).collect();
        return format!("the text {cut}{}", if cut.len() < text.len() { "..." } else { "" });
    }
    match found {
        "map" => "a table of keys".into(),
        "sequence" => "a list".into(),
        "null" => "null".into(),
        _ => found.split('`').nth(1).map_or_else(|| found.to_owned(), |value| format!("`{value}`")),
    }
}

/// What is wanted in its place.
fn named(wanted: &str) -> String {
    match wanted {
        "f64" | "f32" | "u64" | "u32" | "usize" | "i64" | "i32" | "u8" => "a number".into(),
        "a sequence" => "a list".into(),
        "a string" | "path string" => "a text".into(),
        "a boolean" => "true or false".into(),
        "a map" => "a table of keys".into(),
        _ if wanted.starts_with("struct ") => "a table of keys".into(),
        _ => match wanted.strip_prefix("an array of length ") {
            Some(length) => format!("a list of {length}"),
            None => wanted.to_owned(),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde::Deserialize;
    use std::collections::HashMap;

    #[derive(Debug, Deserialize)]
    #[allow(dead_code, reason = "what is read of it is its error")]
    struct Pose {
        place: [f64; 3],
        name: String,
        rows: Vec<Vec<f64>>,
    }

    #[test]
    fn what_is_wrong_is_said_in_words_with_its_line() {
        let cases = [
            (r#"{"place": [1, 2]}"#, "holds 2 elements where a list of 3 is wanted (line 1, column 16)"),
            (r#"{"place": "here"}"#, r#"holds the text "here" where a list of 3 is wanted"#),
            ("{\"place\": [1, 2,\n null]}", "holds null where a number is wanted (line 2, column 5)"),
            (r#"{"place": [1, 2, 3], "name": 7.5}"#, "holds `7.5` where a text is wanted"),
            (r#"{"place": [1, 2, 3], "name": "", "rows": [1]}"#, "holds `1` where a list is wanted"),
            (r#"{"place": [1, 2, 3], "name": ""}"#, "has no `rows`"),
            (r#"{"name": "a", "name": "b"}"#, "holds `name` twice"),
            ("[1]", "holds"),
            (r#"{"place": [1, 2"#, "ends in the middle of its JSON"),
            ("{\"name\": \"NaN\",\n\"place\": [NaN]}", "holds NaN, which is no number of JSON (line 2)"),
            (r#"{"place": [-Infinity]}"#, "holds Infinity"),
            (r#"{"place": here}"#, "is no JSON"),
        ];
        for (text, wanted) in cases {
            let line = read::<Pose>(text.as_bytes(), &Budget::of(text.len() as u64)).expect_err("it is wrong");
            assert!(line.starts_with(wanted) && !line.contains("expected") && !line.contains('\n'), "{line}");
        }
    }

    #[test]
    fn a_mark_in_front_and_utf_16_are_read_as_everywhere() {
        let text = "{\"ä\": 1}";
        let wide: Vec<u8> = [0xfeff].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect();
        for bytes in [text.as_bytes().to_vec(), [&[0xef, 0xbb, 0xbf], text.as_bytes()].concat(), wide] {
            let read = read::<HashMap<String, i32>>(&bytes, &Budget::of(bytes.len() as u64)).expect("JSON");
            assert_eq!(read["ä"], 1);
        }
        let latin = b"{\n\"K\xe4\": 1}";
        let line = read::<HashMap<String, i32>>(latin, &Budget::of(12)).expect_err("a guess");
        assert!(line.contains("line 2 is no UTF-8"), "{line}");
    }

    #[test]
    fn what_it_becomes_is_drawn_before_it_is_built() {
        let text = format!("[{}[]]", "[],".repeat(1000));
        let read = |room: u64| read::<Vec<Vec<f64>>>(text.as_bytes(), &Budget::with(room, 1 << 20));
        assert_eq!(read(1 << 20).expect("room enough").len(), 1001);
        assert!(read(1 << 10).expect_err("too little").contains("becomes more than"));
        // Commas and brackets of a text are its own.
        let text = format!(r#"{{"a\"": "{}"}}"#, "[,\\\\".repeat(1000));
        let texts: HashMap<String, String> =
            super::read(text.as_bytes(), &Budget::with(1 << 10, 1 << 20)).expect("one text");
        assert_eq!(texts["a\""].len(), 3000);
    }
}
