//! Numbers of a joint written into a URDF, its friction or its limits: everything else of the file stays as it is, byte for byte.

use crate::UrdfError;
use crate::tag::{Tag, one_line, quoted};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::ops::Range;

/// Where the numbers go.
enum Place {
    /// In place of this tag, which has these other attributes and content or none.
    Tag(Range<usize>, String, bool),
    /// Before the end of the joint, which begins here.
    End(usize),
}

/// The text of a URDF with the dry friction [N m or N] and the damping [N m s/rad or N s/m] of a joint in its `<dynamics>`.
///
/// # Errors
/// [`UrdfError`] where the text is no XML, or has no joint of this name.
pub fn with_dynamics(text: &str, joint: &str, friction: f64, damping: f64) -> Result<String, UrdfError> {
    with_numbers(text, joint, "dynamics", &[("friction", friction), ("damping", damping)])
}

/// The text of a URDF with these attributes of a joint's `<dynamics>` or `<limit>`, in the format's units; other attributes stay. A
/// `<limit>` that is not there stays away, since the format wants more of one than single numbers.
///
/// # Errors
/// [`UrdfError`] where the text is no XML, or has no joint of this name.
pub fn with_numbers(text: &str, joint: &str, tag: &str, values: &[(&str, f64)]) -> Result<String, UrdfError> {
    let numbers: Vec<String> = values.iter().map(|(key, value)| format!("{key}=\"{value}\"")).collect();
    let numbers = numbers.join(" ");
    let keys: Vec<&str> = values.iter().map(|(key, _)| *key).collect();
    Ok(match place(text, joint, tag, &keys)? {
        Place::Tag(range, others, is_empty) => {
            let end = if is_empty { "/>" } else { ">" };
            format!("{}<{tag} {numbers}{others}{end}{}", &text[..range.start], &text[range.end..])
        }
        Place::End(_) if tag == "limit" => text.to_owned(),
        Place::End(at) => {
            // On a line of its own where the end of the joint is.
            let before = &text[..at];
            let indent = before.len() - before.trim_end_matches([' ', '\t']).len();
            let indent = if before[..at - indent].ends_with('\n') { &before[at - indent..] } else { "" };
            let line = if indent.is_empty() { String::new() } else { format!("\n{indent}") };
            let step = if indent.is_empty() { "" } else { "  " };
            format!("{before}{step}<{tag} {numbers}/>{line}{}", &text[at..])
        }
    })
}

fn place(text: &str, joint: &str, tag: &str, keys: &[&str]) -> Result<Place, UrdfError> {
    let mut reader = Reader::from_str(text);
    let (mut depth, mut within) = (0_usize, false);
    let position = |reader: &Reader<&[u8]>| usize::try_from(reader.buffer_position()).unwrap_or(text.len());
    let fault = |at: usize, what: String| {
        let line = 1 + text.as_bytes()[..at.min(text.len())].iter().filter(|byte| **byte == b'\n').count();
        UrdfError { line, what }
    };
    loop {
        let before = position(&reader);
        let event = reader.read_event().map_err(|error| fault(before, one_line(&error)))?;
        let range = before..position(&reader);
        match event {
            Event::Start(start) => {
                if within && depth == 2 && start.name().0 == tag {
                    let others = others(&start, keys).map_err(|what| fault(before, what))?;
                    return Ok(Place::Tag(range, others, false));
                }
                within |= depth == 1 && is_joint(&start, joint).map_err(|what| fault(before, what))?;
                depth += 1;
            }
            Event::Empty(start) if within && depth == 2 && start.name().0 == tag => {
                return Ok(Place::Tag(range, others(&start, keys).map_err(|what| fault(before, what))?, true));
            }
            Event::End(_) => {
                depth = depth.saturating_sub(1);
                if within && depth == 1 {
                    return Ok(Place::End(before));
                }
            }
            Event::Eof => return Err(fault(before, format!("no joint is called `{}`", quoted(joint)))),
            _ => {}
        }
    }
}

fn is_joint(start: &BytesStart<'_>, joint: &str) -> Result<bool, String> {
    let name = start.name().0;
    Ok(name == "joint" && Tag::new(start, name)?.find("name") == Some(joint))
}

/// Attributes beside those of these names, as they stand there.
fn others(start: &BytesStart<'_>, keys: &[&str]) -> Result<String, String> {
    let mut out = String::new();
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|error| format!("<{}>: {}", start.name().0, one_line(&error)))?;
        let key = attribute.key.0;
        if !keys.contains(&key) {
            let quote = if attribute.value.contains('"') { '\'' } else { '"' };
            out.push_str(&format!(" {key}={quote}{}{quote}", attribute.value));
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::read_from_string;

    const LAPTOP: &str =
        "<?xml version=\"1.0\"?>\n<!-- by hand -->\n<robot name='laptop'>\n  <link name='base'/><link name='lid'/>
  <joint name='hinge' type='revolute'>
    <parent link='base'/><child link='lid'/><limit lower='0' upper='1' effort='9' velocity='9'/>
  </joint>
  <joint name='glue' type='fixed'><parent link='base'/><child link='foot'/></joint>\n  <link name='foot'/>\n</robot>\n";

    fn numbers(text: &str) -> [f64; 2] {
        let robot = read_from_string(text).expect("a URDF");
        let joint = robot.joints.iter().find(|joint| joint.name == "hinge").expect("a hinge");
        [joint.friction, joint.damping]
    }

    #[test]
    fn numbers_are_written_where_none_stand_and_nothing_else_changes() {
        let found = with_dynamics(LAPTOP, "hinge", 0.35, 0.002).expect("a joint");
        assert_eq!(numbers(&found), [0.35, 0.002]);
        assert_eq!(found.replace("    <dynamics friction=\"0.35\" damping=\"0.002\"/>\n", ""), LAPTOP);
        let one_line = LAPTOP.replace("\n  </joint>", "</joint>");
        let found = with_dynamics(&one_line, "hinge", 0.35, 0.002).expect("a joint");
        assert_eq!(found.replace("<dynamics friction=\"0.35\" damping=\"0.002\"/>", ""), one_line);
    }

    #[test]
    fn numbers_that_stand_there_are_replaced_and_other_attributes_kept() {
        for tag in ["<dynamics damping='1' spring='\"2'/>", "<dynamics spring='\"2' friction='3'></dynamics>"] {
            let text = LAPTOP.replace("<limit", &format!("{tag}<limit"));
            let found = with_dynamics(&text, "hinge", 0.35, 0.002).expect("a joint");
            assert_eq!(numbers(&found), [0.35, 0.002]);
            assert_eq!(found.matches("dynamics ").count(), 1);
            assert!(found.contains(" spring='\"2'"), "{found}");
        }
    }

    #[test]
    fn what_is_no_joint_or_no_xml_is_refused_in_one_line() {
        for (text, joint, wanted) in [
            (LAPTOP, "lid", "no joint is called `lid`"),
            ("<robot><joint name='hinge'></robot>", "hinge", "line 1"),
            ("", "hinge", "no joint is called `hinge`"),
        ] {
            let error = with_dynamics(text, joint, 0.1, 0.1).expect_err("nothing to change").to_string();
            assert!(error.contains(wanted) && !error.contains('\n'), "{error}");
        }
    }
}
