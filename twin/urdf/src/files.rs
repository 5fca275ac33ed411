//! Files that a URDF names, meshes and textures, named otherwise: everything else of it stays as it is, byte for byte.

use crate::UrdfError;
use crate::tag::one_line;
use quick_xml::Reader;
use quick_xml::XmlVersion;
use quick_xml::events::{BytesStart, Event};

/// The text of a URDF with another name for each file of a `<mesh>` or `<texture>` for which `rename` has one.
///
/// # Errors
/// [`UrdfError`] where the text is no XML.
pub fn with_files(text: &str, rename: &dyn Fn(&str) -> Option<String>) -> Result<String, UrdfError> {
    let mut reader = Reader::from_str(text);
    let position = |reader: &Reader<&[u8]>| usize::try_from(reader.buffer_position()).unwrap_or(text.len());
    let (mut out, mut copied) = (String::with_capacity(text.len()), 0);
    loop {
        let before = position(&reader);
        let fault = |what: String| {
            let line = 1 + text.as_bytes()[..before.min(text.len())].iter().filter(|byte| **byte == b'\n').count();
            UrdfError { line, what }
        };
        let event = reader.read_event().map_err(|error| fault(one_line(&error)))?;
        let range = before..position(&reader);
        match event {
            Event::Start(start) | Event::Empty(start) if ["mesh", "texture"].contains(&start.name().0) => {
                if let Some((old, new)) = renamed(&start, rename).map_err(fault)? {
                    out.push_str(&text[copied..range.start]);
                    out.push_str(&text[range.clone()].replacen(&old, &new, 1));
                    copied = range.end;
                }
            }
            Event::Eof => break,
            _ => {}
        }
    }
    out.push_str(&text[copied..]);
    Ok(out)
}

/// The name of a file as it stands in its tag, between its quotes, and what takes its place.
fn renamed(
    start: &BytesStart<'_>,
    rename: &dyn Fn(&str) -> Option<String>,
) -> Result<Option<(String, String)>, String> {
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|error| one_line(&error))?;
        if attribute.key.0 == "filename" {
            let raw = attribute.value.to_string();
            let name = attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|error| one_line(&error))?;
            let new =
                rename(&name).map(|new| new.replace('&', "&amp;").replace('<', "&lt;").replace(['"', '\''], "&quot;"));
            return Ok(new.map(|new| (raw, new)));
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_named_anew_and_nothing_else_changes() {
        let text = "<!-- mesh a.stl -->\n<robot name='a.stl'><link name='l'><visual><geometry><mesh scale='1 1 1'  filename='a.stl'/></geometry>\
            <material name='m'><texture filename=\"t&amp;.png\" /></material></visual><collision><geometry><mesh filename='/b.stl'/></geometry>\
            </collision></link></robot>\n";
        let rename = |name: &str| (!name.starts_with('/')).then(|| format!("/lab & co/{name}"));
        let found = with_files(text, &rename).expect("XML");
        let wanted = text
            .replace("filename='a.stl'", "filename='/lab &amp; co/a.stl'")
            .replace("t&amp;.png", "/lab &amp; co/t&amp;.png");
        assert_eq!(found, wanted);
        assert!(with_files("<robot><mesh", &rename).is_err());
    }
}
