//! Tables of PLY files: their columns, and their rows as binary little-endian ones, whatever the file's own format: big-endian
//! numbers turned round, written-out numbers (ascii) parsed.

/// One table of the file.
#[derive(Debug)]
pub(super) struct Element {
    pub(super) name: String,
    /// Rows, and those that the header claims.
    pub(super) count: usize,
    pub(super) claimed: usize,
    /// Names and sizes of the columns [bytes].
    pub(super) columns: Vec<(String, Kind)>,
    /// Where it begins among the rows [bytes].
    pub(super) begin: usize,
}

/// Where a number stands in a row, and what it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    at: usize,
    pub(super) kind: Kind,
}

/// What a number is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Byte,
    Short,
    Word,
    Float,
    Double,
}

impl Kind {
    pub(super) fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "uchar" | "int8" | "uint8" => Self::Byte,
            "short" | "ushort" | "int16" | "uint16" => Self::Short,
            "int" | "uint" | "int32" | "uint32" => Self::Word,
            "float" | "float32" => Self::Float,
            "double" | "float64" => Self::Double,
            _ => return None,
        })
    }

    pub(super) fn bytes(self) -> usize {
        match self {
            Self::Byte => 1,
            Self::Short => 2,
            Self::Word | Self::Float => 4,
            Self::Double => 8,
        }
    }
}

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

impl Element {
    pub(super) fn stride(&self) -> usize {
        self.kinds().map(Kind::bytes).sum()
    }

    /// What its columns hold.
    pub(super) fn kinds(&self) -> impl Iterator<Item = Kind> {
        self.columns.iter().map(|(_, kind)| *kind)
    }

    /// Where a column of this type begins within a row [bytes].
    pub(super) fn column(&self, wanted: &str, kind: Kind) -> Option<usize> {
        self.find(wanted).filter(|column| column.kind == kind).map(|column| column.at)
    }

    /// A column, whatever its type.
    pub(super) fn find(&self, wanted: &str) -> Option<Column> {
        let mut at = 0;
        for (name, kind) in &self.columns {
            if name == wanted {
                return Some(Column { at, kind: *kind });
            }
            at += kind.bytes();
        }
        None
    }

    pub(super) fn has(&self, wanted: &str) -> bool {
        self.columns.iter().any(|(name, _)| name == wanted)
    }
}

impl Column {
    pub(super) fn value(self, row: &[u8]) -> f32 {
        match self.kind {
            Kind::Double => {
                let bytes = row.get(self.at..self.at + 8).and_then(|b| b.try_into().ok());
                bytes.map_or(f32::NAN, |bytes| f64::from_le_bytes(bytes) as f32)
            }
            _ => float(row, self.at),
        }
    }
}

/// Four bytes of a row as a number.
pub(super) fn float(row: &[u8], at: usize) -> f32 {
    f32::from_bits(word(row, at))
}

/// Four bytes of a row as an unsigned number.
pub(super) fn word(row: &[u8], at: usize) -> u32 {
    row.get(at..at + 4).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes)
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
