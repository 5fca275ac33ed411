//! Rows of PLY files as binary little-endian ones, whatever the file's own format: big-endian numbers turned round, written-out
//! numbers (ascii) parsed.

use super::ply::{Element, Kind};

/// How a file writes its numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Format {
    Little,
    Big,
    Ascii,
}

impl Format {
    pub(super) fn parse(name: &str) -> Result<Self, String> {
        match name {
            "binary_little_endian" => Ok(Self::Little),
            "binary_big_endian" => Ok(Self::Big),
            "ascii" => Ok(Self::Ascii),
            _ => Err(format!("its format is {name}, which no PLY file has")),
        }
    }

    /// Bytes that a row takes at least.
    pub(super) fn least(self, element: &Element) -> usize {
        match self {
            Self::Little | Self::Big => element.stride(),
            // A digit and a blank for each number; after the last of the file there may be none.
            Self::Ascii => (2 * element.kinds().count()).saturating_sub(1),
        }
    }
}

/// Big-endian rows as little-endian ones.
pub(super) fn turned(elements: &[Element], body: &[u8]) -> Vec<u8> {
    let mut out = body.to_vec();
    let mut left = &mut out[..];
    for element in elements {
        for _ in 0..element.count {
            for kind in element.kinds() {
                let Some((number, rest)) = left.split_at_mut_checked(kind.bytes()) else { return out };
                number.reverse();
                left = rest;
            }
        }
    }
    out
}

/// Written-out rows as little-endian ones; of a file that was cut those that are whole, which is then their count.
pub(super) fn parsed(elements: &mut [Element], body: &[u8]) -> Result<Vec<u8>, String> {
    let text = std::str::from_utf8(body).map_err(|_| "its format is ascii, and its rows are no text")?;
    let mut words = text.split_ascii_whitespace();
    // The last word of a file that was cut may be half a number.
    let is_cut_in_word = !text.ends_with(|letter: char| letter.is_ascii_whitespace());
    let mut out = Vec::new();
    for element in elements {
        for row in 0..element.count {
            let before = out.len();
            let mut missing = None;
            for (column, kind) in element.kinds().enumerate() {
                let Some(word) = words.next() else {
                    missing = Some(column);
                    break;
                };
                put(kind, word, &mut out)
                    .ok_or_else(|| format!("`{word}` stands in row {row} of its table `{}`", element.name))?;
            }
            if let Some(column) = missing {
                let half = usize::from(column == 0 && is_cut_in_word && row > 0);
                out.truncate(before - half * element.stride());
                element.count = row - half;
                break;
            }
        }
    }
    Ok(out)
}

/// One number.
fn put(kind: Kind, word: &str, out: &mut Vec<u8>) -> Option<()> {
    // Some programs write what is no number as `-nan(ind)`.
    let is_none = word.trim_start_matches('-').get(..3).is_some_and(|start| start.eq_ignore_ascii_case("nan"));
    let value: f64 = if is_none { f64::NAN } else { word.parse().ok()? };
    match kind {
        Kind::Byte => out.push((value as i64).to_le_bytes()[0]),
        Kind::Short => out.extend(&(value as i64).to_le_bytes()[..2]),
        Kind::Word => out.extend(&(value as i64).to_le_bytes()[..4]),
        Kind::Float => out.extend((value as f32).to_le_bytes()),
        Kind::Double => out.extend(value.to_le_bytes()),
    }
    Some(())
}
