//! Whole elements of a URDF added at its end or taken out, and the encoding that it declares: everything else of it stays as it is, byte
//! for byte.

use crate::UrdfError;
use crate::tag::{Tag, one_line};
use quick_xml::Reader;
use quick_xml::events::Event;
use std::ops::Range;

/// The text of a URDF with `more` before the end of its root, and without those of its elements for which `drop` holds, by kind and name:
/// a `link` or a `joint`. What was written by another program in another encoding is text in UTF-8 now, and declared so.
///
/// # Errors
/// [`UrdfError`] where the text is no XML, or has no root that ends.
pub fn with_elements(text: &str, more: &str, drop: &dyn Fn(&str, &str) -> bool) -> Result<String, UrdfError> {
    let mut reader = Reader::from_str(text);
    let position = |reader: &Reader<&[u8]>| usize::try_from(reader.buffer_position()).unwrap_or(text.len());
    let fault = |at: usize, what: String| {
        let line = 1 + text.as_bytes()[..at.min(text.len())].iter().filter(|byte| **byte == b'\n').count();
        UrdfError { line, what }
    };
    let (mut depth, mut begun, mut cuts) = (0_usize, None, Vec::<Range<usize>>::new());
    let end = loop {
        let before = position(&reader);
        let event = reader.read_event().map_err(|error| fault(before, one_line(&error)))?;
        match event {
            Event::Start(start) | Event::Empty(start) if depth == 1 && begun.is_none() => {
                let kind = start.name().0;
                let name = Tag::new(&start, kind).ok().and_then(|tag| tag.find("name").map(str::to_owned));
                let is_dropped = name.is_some_and(|name| drop(kind, &name));
                let is_empty = text[..position(&reader)].ends_with("/>");
                match (is_dropped, is_empty) {
                    (true, true) => cuts.push(before..position(&reader)),
                    (true, false) => begun = Some(before),
                    (false, _) => {}
                }
                depth += usize::from(!is_empty);
            }
            Event::Start(_) => depth += 1,
            Event::End(_) => {
                depth = depth.saturating_sub(1);
                if let Some(begin) = begun.filter(|_| depth == 1) {
                    cuts.push(begin..position(&reader));
                    begun = None;
                }
                if depth == 0 {
                    break before;
                }
            }
            Event::Eof => return Err(fault(before, "it does not end with </robot>".into())),
            _ => {}
        }
    };
    let (mut out, mut copied) = (String::with_capacity(text.len() + more.len()), 0);
    for cut in cuts {
        out.push_str(text[copied..cut.start].trim_end_matches([' ', '\t']));
        copied = cut.end + usize::from(text[cut.end..].starts_with('\n'));
    }
    out.push_str(&text[copied..end]);
    out.push_str(more);
    out.push_str(&text[end..]);
    Ok(declared(out))
}

/// A text whose declaration says that it is in UTF-8, as it is.
fn declared(text: String) -> String {
    let Some(declaration) = text.trim_start_matches('\u{feff}').strip_prefix("<?xml") else { return text };
    let Some((declaration, _)) = declaration.split_once("?>") else { return text };
    let Some((_, value)) = declaration.split_once("encoding") else { return text };
    let value = value.trim_start_matches([' ', '\t', '=']);
    let Some(quote) = value.chars().next().filter(|c| ['"', '\''].contains(c)) else { return text };
    let Some(encoding) = value[1..].split(quote).next().map(str::to_owned) else { return text };
    text.replacen(&format!("{quote}{encoding}{quote}"), &format!("{quote}UTF-8{quote}"), 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARM: &str = "<?xml version=\"1.0\" encoding='UTF-16'?>\n<robot name='UTF-16'>\n  <link name='a'/>\n  <link name='load'><inertial/></link>\n  \
                       <joint name='load' type='fixed'>\n  </joint>\n  <joint name='j'/>\n</robot>\n<!-- </robot> -->\n";

    #[test]
    fn elements_go_in_before_the_end_of_the_root_and_out_where_they_stand() {
        let same = with_elements(ARM, "", &|_, _| false).expect("XML");
        assert_eq!(same, ARM.replacen("encoding='UTF-16'", "encoding='UTF-8'", 1));
        let found = with_elements(ARM, "  <link name='load'/>\n", &|kind, name| kind == "link" && name == "load");
        let wanted = same.replacen("  <link name='load'><inertial/></link>\n", "", 1);
        assert_eq!(found.expect("XML"), wanted.replacen("\n</robot>", "\n  <link name='load'/>\n</robot>", 1));
        let found = with_elements(ARM, "", &|kind, _| kind == "joint").expect("XML");
        assert!(!found.contains("joint") && found.contains("</link>\n</robot>"), "{found}");
        assert!(with_elements("<robot><link name='a'/>", "", &|_, _| false).is_err());
    }
}
