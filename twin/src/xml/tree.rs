//! An XML document as a tree, to be changed and written again: elements, attributes, comments and text in their order.

use super::Document;
use quick_xml::escape::resolve_predefined_entity;
use quick_xml::events::{BytesStart, Event};
use quick_xml::{Reader, XmlVersion};

/// Elements within elements. A body for each link of a chain of 64 joints, each within the one before, stays below.
const DEEPEST: usize = 256;
/// Elements of a document. A scene of a thousand bodies has some ten thousand.
const MAX_ELEMENTS: usize = 1_000_000;

/// An element with what is in it.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Element {
    pub name: String,
    /// Its attributes, in their order.
    pub attributes: Vec<(String, String)>,
    /// What is in it.
    pub nodes: Vec<Node>,
}

/// Something in an element.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Node {
    Element(Element),
    Comment(String),
    /// Text that is more than space.
    Text(String),
}

impl Element {
    /// An element of this name with these attributes and nothing in it.
    pub fn new(name: &str, attributes: &[(&str, String)]) -> Self {
        let attributes = attributes.iter().map(|(key, value)| ((*key).to_owned(), value.clone())).collect();
        Self { name: name.to_owned(), attributes, nodes: Vec::new() }
    }

    /// The root of a document.
    ///
    /// # Errors
    /// The line and what is wrong there, in one line of text.
    pub fn read(text: &str) -> Result<Self, String> {
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let mut reader = Reader::from_str(text);
        let (mut open, mut root, mut count): (Vec<Self>, Option<Self>, usize) = (Vec::new(), None, 0);
        loop {
            let at = reader.buffer_position();
            let fault = |what: String| {
                let end = usize::try_from(at).map_or(text.len(), |at| at.min(text.len()));
                let line = 1 + text.as_bytes()[..end].iter().filter(|byte| **byte == b'\n').count();
                format!("line {line}: {}", what.replace(char::is_control, " "))
            };
            let mut done = |open: &mut Vec<Self>, element: Self| match open.last_mut() {
                Some(parent) => parent.nodes.push(Node::Element(element)),
                None => root = Some(element),
            };
            match reader.read_event().map_err(|error| fault(format!("this is no XML ({error})")))? {
                Event::Start(start) => {
                    count += 1;
                    if open.len() >= DEEPEST || count > MAX_ELEMENTS {
                        return Err(fault(format!(
                            "more than {DEEPEST} elements in each other, or {MAX_ELEMENTS} in all"
                        )));
                    }
                    open.push(element(&start).map_err(fault)?);
                }
                Event::Empty(start) => {
                    count += 1;
                    if count > MAX_ELEMENTS {
                        return Err(fault(format!("more than {MAX_ELEMENTS} elements")));
                    }
                    let read = element(&start).map_err(fault)?;
                    done(&mut open, read);
                }
                Event::End(_) => {
                    let Some(mut ended) = open.pop() else { return Err(fault("an end without a beginning".into())) };
                    ended.trim();
                    done(&mut open, ended);
                }
                Event::Comment(comment) => {
                    if let Some(parent) = open.last_mut() {
                        parent.nodes.push(Node::Comment(comment.trim().to_owned()));
                    }
                }
                Event::Text(words) => open.last_mut().into_iter().for_each(|parent| parent.add(&words)),
                Event::CData(words) => open.last_mut().into_iter().for_each(|parent| parent.add(&words)),
                // `&amp;`, `&#176;`: a part of the text around it.
                Event::GeneralRef(reference) => {
                    let sign = reference.resolve_char_ref().map_err(|error| fault(error.to_string()))?;
                    let sign = sign.map(String::from);
                    let named = || resolve_predefined_entity(&reference).map(str::to_owned);
                    let Some(sign) = sign.or_else(named) else {
                        return Err(fault(format!("`&{};` is no sign that XML knows", &*reference)));
                    };
                    open.last_mut().into_iter().for_each(|parent| parent.add(&sign));
                }
                Event::Eof => break,
                _ => {}
            }
        }
        match (root, open.is_empty()) {
            (Some(root), true) => Ok(root),
            (_, false) => Err("its end is missing".into()),
            (None, true) => Err("it holds no element, so it is no XML file".into()),
        }
    }

    /// Text behind what is there already.
    fn add(&mut self, words: &str) {
        match self.nodes.last_mut() {
            Some(Node::Text(text)) => text.push_str(words),
            _ => self.nodes.push(Node::Text(words.to_owned())),
        }
    }

    /// Takes blanks around texts off, and texts that are nothing else.
    fn trim(&mut self) {
        self.nodes.retain_mut(|node| match node {
            Node::Text(text) => {
                *text = text.trim().to_owned();
                !text.is_empty()
            }
            _ => true,
        });
    }

    /// The document whose root this is.
    pub fn document(&self) -> String {
        let mut document = Document::new();
        self.write(&mut document);
        document.finish()
    }

    fn write(&self, document: &mut Document) {
        let attributes: Vec<(&str, String)> = self.attributes.iter().map(|(k, v)| (k.as_str(), v.clone())).collect();
        match self.nodes[..] {
            [] => document.leaf(&self.name, &attributes),
            [Node::Text(ref text)] => document.text(&self.name, &attributes, text),
            _ => {
                document.open(&self.name, &attributes);
                for node in &self.nodes {
                    match node {
                        Node::Element(element) => element.write(document),
                        Node::Comment(comment) => document.comment(comment),
                        Node::Text(text) => document.words(text),
                    }
                }
                document.close();
            }
        }
    }

    pub fn get(&self, key: &str) -> Option<&str> {
        self.attributes.iter().find(|(known, _)| known == key).map(|(_, value)| value.as_str())
    }

    /// Gives an attribute a value, in its place where it is there.
    pub fn set(&mut self, key: &str, value: impl Into<String>) {
        match self.attributes.iter_mut().find(|(known, _)| known == key) {
            Some((_, old)) => *old = value.into(),
            None => self.attributes.push((key.to_owned(), value.into())),
        }
    }

    /// Takes an attribute away.
    pub fn remove(&mut self, key: &str) {
        self.attributes.retain(|(known, _)| known != key);
    }

    /// The elements in it.
    pub fn elements(&self) -> impl DoubleEndedIterator<Item = &Self> {
        self.nodes.iter().filter_map(|node| match node {
            Node::Element(element) => Some(element),
            _ => None,
        })
    }

    /// The same, to be changed.
    pub fn elements_mut(&mut self) -> impl DoubleEndedIterator<Item = &mut Self> {
        self.nodes.iter_mut().filter_map(|node| match node {
            Node::Element(element) => Some(element),
            _ => None,
        })
    }

    /// The last element of this name in it; a new one at its end where there is none.
    pub fn last_or_new(&mut self, name: &str) -> &mut Self {
        let is_called = |node: &Node| matches!(node, Node::Element(element) if element.name == name);
        let at = self.nodes.iter().rposition(is_called).unwrap_or_else(|| {
            self.nodes.push(Node::Element(Self::new(name, &[])));
            self.nodes.len() - 1
        });
        match &mut self.nodes[at] {
            Node::Element(element) => element,
            Node::Comment(_) | Node::Text(_) => unreachable!("an element is looked for or added"),
        }
    }

    /// It and all elements below it, each before what is in it.
    pub fn all(&self) -> Vec<&Self> {
        let (mut found, mut open) = (Vec::new(), vec![self]);
        while let Some(element) = open.pop() {
            found.push(element);
            open.extend(element.elements().rev());
        }
        found
    }

    /// The first below it for which this holds, to be changed.
    pub fn find_mut(&mut self, holds: &dyn Fn(&Self) -> bool) -> Option<&mut Self> {
        if holds(self) {
            return Some(self);
        }
        self.elements_mut().find_map(|element| element.find_mut(holds))
    }

    /// Does something to it and to all elements below it.
    pub fn each_mut(&mut self, change: &mut dyn FnMut(&mut Self)) {
        change(self);
        self.elements_mut().for_each(|element| element.each_mut(change));
    }
}

fn element(start: &BytesStart<'_>) -> Result<Element, String> {
    let name = start.name().0;
    let mut element = Element::new(name, &[]);
    for attribute in start.attributes() {
        let attribute = attribute.map_err(|error| format!("<{name}>: {error}"))?;
        let value =
            attribute.normalized_value(XmlVersion::Implicit1_0).map_err(|error| format!("<{name}>: {error}"))?;
        element.attributes.push((attribute.key.0.to_owned(), value.into_owned()));
    }
    Ok(element)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_read_and_written_again_is_the_same() {
        let text = "<?xml version='1.0'?>\n<!-- by hand --><a x='1 &lt; 2' y=\"'\"><!-- of b --><b/><c>words &amp; more</c><b k='2'><d/></b></a>";
        let root = Element::read(text).expect("XML");
        assert_eq!((root.get("x"), root.get("y"), root.all().len()), (Some("1 < 2"), Some("'"), 5));
        assert_eq!(Element::read(&root.document()).expect("own text"), root);
        for wrong in ["<a>", "", "<a></b>", "<a x=1/>"] {
            let error = Element::read(wrong).expect_err(wrong);
            assert!(!error.contains('\n'), "{error}");
        }
    }

    #[test]
    fn elements_without_end_in_each_other_are_refused() {
        assert!(Element::read(&"<a>".repeat(100_000)).expect_err("too deep").contains("256"));
    }
}
