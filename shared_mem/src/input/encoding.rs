//! Which letters the bytes of a text are: UTF-8 and UTF-16, with and without a mark in front, and the Latin letters of
//! Windows-1252 (of which Latin 1 is a part); ends of lines of any system.
//!
//! A text that is none of them is not guessed at: a name that is read wrongly is worse than a file that has to be saved anew.

use super::packing::Packing;

/// How the letters of a text were written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Encoding {
    /// UTF-8.
    Utf8,
    /// UTF-16, of either byte order.
    Utf16,
    /// One byte a letter, as Windows has it west of Poland. That it is this one is a guess.
    Windows1252,
}

/// A text with lines that end in `\n` or `\r\n`, without a mark in front.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Text {
    /// The text.
    pub text: String,
    /// How it was written.
    pub encoding: Encoding,
}

/// Bytes are no text: a sentence to be put behind the file's name and a colon.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum NoText {
    /// It is packed.
    #[error("it is packed with {}; {}", .0.name(), .0.remedy())]
    Packed(Packing),
    /// It is text, in an encoding that is not known.
    #[error(
        "line {0} is no UTF-8, but text in another encoding; save it as UTF-8 in an editor, or, where it comes from Windows, with \
         `iconv -f WINDOWS-1252 -t UTF-8`"
    )]
    Encoding(usize),
    /// Some of it is UTF-8.
    #[error("line {0} is no UTF-8, as the lines before it are: it is damaged; mend that line and save it as UTF-8")]
    Mixed(usize),
    /// It is something else.
    #[error("it is no text; give the path of a text file (UTF-8)")]
    Binary,
}

/// The text that bytes are.
///
/// # Errors
/// [`NoText`] when they are none, or in an encoding that cannot be known.
pub fn decode(bytes: Vec<u8>) -> Result<Text, NoText> {
    let (text, encoding) = match bytes.as_slice() {
        [0xef, 0xbb, 0xbf, rest @ ..] => (utf8(rest.to_vec())?, Encoding::Utf8),
        // The mark of UTF-32 begins like one of UTF-16.
        [0xff, 0xfe, 0, 0, ..] => return Err(NoText::Binary),
        [0xff, 0xfe, rest @ ..] => (utf16(rest, u16::from_le_bytes)?, Encoding::Utf16),
        [0xfe, 0xff, rest @ ..] => (utf16(rest, u16::from_be_bytes)?, Encoding::Utf16),
        start => {
            if let Some(packing) = Packing::of(start) {
                return Err(NoText::Packed(packing));
            }
            match zeros(start) {
                [false, true] => (utf16(start, u16::from_le_bytes)?, Encoding::Utf16),
                [true, false] => (utf16(start, u16::from_be_bytes)?, Encoding::Utf16),
                _ if is_latin(start) => (start.iter().map(|byte| latin(*byte)).collect(), Encoding::Windows1252),
                _ => (utf8(bytes)?, Encoding::Utf8),
            }
        }
    };
    // A system of long ago ended lines with this alone, and some exports still do.
    let text = if text.contains('\r') && !text.contains('\n') { text.replace('\r', "\n") } else { text };
    Ok(Text { text, encoding })
}

/// A text in UTF-8; what is left of a letter at its end, where the file was cut, is left out.
fn utf8(bytes: Vec<u8>) -> Result<String, NoText> {
    String::from_utf8(bytes).or_else(|error| {
        let (whole, is_cut) = (error.utf8_error().valid_up_to(), error.utf8_error().error_len().is_none());
        let mut bytes = error.into_bytes();
        if is_cut && whole > 0 {
            bytes.truncate(whole);
            return String::from_utf8(bytes).map_err(|_| NoText::Binary);
        }
        let before = bytes.get(..whole).unwrap_or(&[]);
        let line = 1 + before.iter().filter(|byte| **byte == b'\n').count();
        Err(if bytes.iter().any(|byte| is_control(*byte)) {
            NoText::Binary
        } else if before.is_ascii() {
            NoText::Encoding(line)
        } else {
            NoText::Mixed(line)
        })
    })
}

/// Half a letter at the end, where the file was cut, is left out.
fn utf16(bytes: &[u8], unit: fn([u8; 2]) -> u16) -> Result<String, NoText> {
    let units = bytes.chunks_exact(2).map(|pair| unit([pair[0], pair[1]]));
    let text: String = char::decode_utf16(units).collect::<Result<_, _>>().map_err(|_| NoText::Binary)?;
    if text.contains('\0') { Err(NoText::Binary) } else { Ok(text) }
}

/// Whether, of the first pairs of bytes, the first and the second ones are 0 for the most part: Latin letters in UTF-16.
fn zeros(bytes: &[u8]) -> [bool; 2] {
    /// Pairs that are looked at.
    const PAIRS: usize = 256;
    let pairs = bytes.chunks_exact(2).take(PAIRS);
    let count = pairs.len();
    [0, 1].map(|at| count > 1 && 2 * pairs.clone().filter(|pair| pair[at] == 0).count() > count)
}

/// What no text of one byte a letter holds.
fn is_control(byte: u8) -> bool {
    byte < b' ' && !matches!(byte, b'\t' | b'\n' | b'\r' | 0x0c) || byte == 0x7f
}

/// Whether bytes are Latin letters of one byte each: signs as `°` and `µ` one by one, letters two by two at most, and nothing that
/// is UTF-8. Of an alphabet with two bytes a letter, and of one that is not Latin, more stand together.
fn is_latin(bytes: &[u8]) -> bool {
    let is_high = |byte: &u8| *byte >= 0x80;
    let mut runs = bytes.split(|byte| !is_high(byte)).filter(|run| !run.is_empty()).peekable();
    let is_run = |run: &[u8]| match run {
        [one] => latin(*one) != char::REPLACEMENT_CHARACTER,
        [one, other] => [one, other].iter().all(|byte| latin(**byte).is_alphabetic()),
        _ => false,
    };
    runs.peek().is_some()
        // A letter that was cut at the end is one of UTF-8.
        && std::str::from_utf8(bytes).is_err_and(|error| error.error_len().is_some())
        && !bytes.iter().any(|byte| is_control(*byte))
        && bytes.utf8_chunks().all(|chunk| chunk.valid().is_ascii())
        && runs.all(is_run)
}

/// The letter that a byte is in Windows-1252.
fn latin(byte: u8) -> char {
    const FROM_0X80: [char; 32] = [
        '€', '\u{fffd}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{fffd}', 'Ž', '\u{fffd}',
        '\u{fffd}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{fffd}', 'ž', 'Ÿ',
    ];
    match byte {
        0x80..=0x9f => FROM_0X80.get(usize::from(byte - 0x80)).copied().unwrap_or(char::REPLACEMENT_CHARACTER),
        byte => char::from(byte),
    }
}

/// Whether an XML document says of itself that it is written so.
pub(super) fn declares_latin(text: &str) -> bool {
    let Some((declaration, _)) = text.trim_start().strip_prefix("<?xml").and_then(|rest| rest.split_once("?>")) else {
        return false;
    };
    let declaration = declaration.to_ascii_lowercase();
    ["iso-8859-1\"", "iso-8859-1'", "latin1", "latin-1", "windows-1252", "cp1252"]
        .iter()
        .any(|name| declaration.contains(name))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn in_utf16(text: &str, bytes: fn(u16) -> [u8; 2]) -> Vec<u8> {
        text.encode_utf16().flat_map(bytes).collect()
    }

    #[test]
    fn a_text_is_the_same_in_every_encoding() {
        let text = "Zeit [µs],Größe\r\n0,1\r\n";
        let mark = "\u{feff}";
        let one_byte: Vec<u8> = text.chars().map(|c| u8::try_from(u32::from(c)).expect("Latin 1")).collect();
        for (bytes, encoding) in [
            (text.as_bytes().to_vec(), Encoding::Utf8),
            (format!("{mark}{text}").into_bytes(), Encoding::Utf8),
            (in_utf16(text, u16::to_le_bytes), Encoding::Utf16),
            (in_utf16(text, u16::to_be_bytes), Encoding::Utf16),
            (in_utf16(&format!("{mark}{text}"), u16::to_le_bytes), Encoding::Utf16),
            (in_utf16(&format!("{mark}{text}"), u16::to_be_bytes), Encoding::Utf16),
            (one_byte, Encoding::Windows1252),
        ] {
            assert_eq!(decode(bytes), Ok(Text { text: text.into(), encoding }), "{encoding:?}");
        }
        assert_eq!(decode(b"5 \x80 \x96 \x95".to_vec()).expect("Windows-1252").text, "5 € – •");
        // Half a letter at the end was cut.
        assert_eq!(decode("a\n°".as_bytes()[..3].to_vec()).expect("a text").text, "a\n");
        assert_eq!(decode(in_utf16("ab\n", u16::to_le_bytes)[..5].to_vec()).expect("a text").text, "ab");
    }

    #[test]
    fn lines_of_any_system_are_lines() {
        for text in ["a\nb\n", "a\r\nb\r\n", "a\rb\r"] {
            let read = decode(text.as_bytes().to_vec()).expect("a text").text;
            assert_eq!(read.lines().collect::<Vec<_>>(), ["a", "b"], "{text:?}");
        }
    }

    #[test]
    fn what_cannot_be_known_is_refused_with_its_line() {
        let (chinese, russian) = (&b"a,b\n\xb9\xd8\xbd\xda,1\n"[..], &b"\xc2\xf0\xe5\xec\xff,q\n"[..]);
        assert_eq!(decode(chinese.to_vec()), Err(NoText::Encoding(2)), "GBK");
        assert_eq!(decode(russian.to_vec()), Err(NoText::Encoding(1)), "Windows-1251");
        let mixed = ["°\n".as_bytes(), b"\xb0\n"].concat();
        assert_eq!(decode(mixed), Err(NoText::Mixed(2)));
        assert_eq!(decode(vec![1, 2, 0xff, 0]), Err(NoText::Binary));
        assert_eq!(decode(b"\x28\xb5\x2f\xfd1234".to_vec()), Err(NoText::Packed(Packing::Zstd)));
        for error in [NoText::Encoding(1), NoText::Mixed(1), NoText::Binary, NoText::Packed(Packing::Xz)] {
            assert!(!error.to_string().contains('\n') && error.to_string().contains("it"), "{error}");
        }
    }

    #[test]
    fn an_xml_document_may_say_how_it_is_written() {
        assert!(declares_latin("<?xml version=\"1.0\" encoding=\"ISO-8859-1\"?><robot/>"));
        assert!(declares_latin("<?xml version='1.0' encoding='windows-1252'?><robot/>"));
        assert!(!declares_latin("<?xml version=\"1.0\" encoding=\"ISO-8859-15\"?><robot/>"));
        assert!(!declares_latin("<robot name=\"latin1\"/>"));
    }

    proptest! {
        #[test]
        fn no_bytes_make_it_panic(bytes in prop::collection::vec(any::<u8>(), 0..64)) {
            let _ = decode(bytes);
        }

        #[test]
        fn utf_8_stays_what_it_is(text in "[^\r\u{feff}\u{0}]{0,40}") {
            prop_assume!(Packing::of(text.as_bytes()).is_none());
            let read = decode(text.clone().into_bytes()).expect("a text");
            prop_assert_eq!(read, Text { text, encoding: Encoding::Utf8 });
        }
    }
}
