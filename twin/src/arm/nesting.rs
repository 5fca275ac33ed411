//! How deep the elements of an XML text lie in each other: what reads and frees them calls itself for every level, and a
//! file of some hundred kilobytes can hold more levels than a thread's stack. Called by `urdf` before anything is built.

/// The deepest nesting that is read: a URDF needs six levels, and what simulators add to it a few more.
pub(super) const DEEPEST: usize = 64;

/// The largest number of elements that are open at once. Whether the text is well formed is for its reader to find out.
pub(super) fn depth(text: &str) -> usize {
    let (mut rest, mut open, mut deepest) = (text, 0_usize, 0);
    while let Some((_, tag)) = rest.split_once('<') {
        let skipped = [("!--", "-->"), ("![CDATA[", "]]>"), ("?", "?>"), ("!", ">")];
        if let Some((begin, end)) = skipped.into_iter().find(|(begin, _)| tag.starts_with(begin)) {
            rest = tag[begin.len()..].split_once(end).map_or("", |(_, behind)| behind);
            continue;
        }
        let (inside, behind) = split_tag(tag);
        if inside.starts_with('/') {
            open = open.saturating_sub(1);
        } else {
            deepest = deepest.max(open + 1);
            open += usize::from(!inside.ends_with('/'));
        }
        rest = behind;
    }
    deepest
}

/// A tag up to its `>`, of which its quoted values may hold more, and what is behind.
fn split_tag(text: &str) -> (&str, &str) {
    let mut quote = None;
    for (at, byte) in text.bytes().enumerate() {
        match (quote, byte) {
            (None, b'>') => return (&text[..at], &text[at + 1..]),
            (None, b'"' | b'\'') => quote = Some(byte),
            (Some(open), _) if open == byte => quote = None,
            _ => {}
        }
    }
    (text, "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn open_elements_are_counted_and_what_only_looks_like_one_is_not() {
        let cases = [
            ("", 0),
            ("<a/>", 1),
            ("<a><b/><b></b></a>", 2),
            ("<?xml version=\"1.0\"?><!DOCTYPE a><a b='/>' c=\"<a><a>\"><!-- <a><a> --><![CDATA[<a><a>]]></a>", 1),
            ("<a><b><c", 3),
            ("</a></a><a/>", 1),
        ];
        for (text, deep) in cases {
            assert_eq!(depth(text), deep, "{text}");
        }
        assert_eq!(depth(&"<a>".repeat(1_000_000)), 1_000_000);
    }
}
