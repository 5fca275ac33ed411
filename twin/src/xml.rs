//! The only code that writes XML: elements, attributes, comments, all of them escaped. For descriptions of robots and for models of
//! other simulators. `tree` reads a document that is changed and written again.

mod tree;

pub use tree::{Element, Node};

use quick_xml::Writer;
use quick_xml::events::{BytesEnd, BytesStart, BytesText, Event};

/// An XML document that is being written into memory.
pub struct Document {
    writer: Writer<Vec<u8>>,
    open: Vec<String>,
}

/// Attributes in their order.
pub type Attributes<'a> = &'a [(&'a str, String)];

impl Default for Document {
    fn default() -> Self {
        Self::new()
    }
}

impl Document {
    /// One with nothing but its declaration.
    pub fn new() -> Self {
        let mut document = Self { writer: Writer::new_with_indent(Vec::new(), b' ', 2), open: Vec::new() };
        document.write(Event::Decl(quick_xml::events::BytesDecl::new("1.0", Some("UTF-8"), None)));
        document
    }

    /// Writing into memory does not fail.
    fn write(&mut self, event: Event<'_>) {
        self.writer.write_event(event).expect("memory takes every byte");
    }

    fn start<'a>(name: &'a str, attributes: Attributes<'_>) -> BytesStart<'a> {
        let mut start = BytesStart::new(name);
        for (key, value) in attributes {
            // XML has no way of writing control characters.
            start.push_attribute((*key, value.replace(char::is_control, "_").as_str()));
        }
        start
    }

    /// Begins an element.
    pub fn open(&mut self, name: &str, attributes: Attributes<'_>) {
        self.write(Event::Start(Self::start(name, attributes)));
        self.open.push(name.to_owned());
    }

    /// Ends the element that was begun last.
    pub fn close(&mut self) {
        if let Some(name) = self.open.pop() {
            self.write(Event::End(BytesEnd::new(name)));
        }
    }

    /// An element with nothing in it.
    pub fn leaf(&mut self, name: &str, attributes: Attributes<'_>) {
        self.write(Event::Empty(Self::start(name, attributes)));
    }

    /// An element that holds a text.
    pub fn text(&mut self, name: &str, attributes: Attributes<'_>, text: &str) {
        self.write(Event::Start(Self::start(name, attributes)));
        self.write(Event::Text(BytesText::new(text)));
        self.write(Event::End(BytesEnd::new(name)));
    }

    /// Words between elements.
    pub fn words(&mut self, text: &str) {
        self.write(Event::Text(BytesText::new(text)));
    }

    /// A comment, in which XML allows no `--`.
    pub fn comment(&mut self, text: &str) {
        let plain = text.replace("--", "- -").replace(['<', '>'], "'").replace(char::is_control, "_");
        self.write(Event::Comment(BytesText::from_escaped(format!(" {plain} "))));
    }

    /// Ends what is open; the text.
    pub fn finish(mut self) -> String {
        while !self.open.is_empty() {
            self.close();
        }
        let mut text = String::from_utf8_lossy(&self.writer.into_inner()).into_owned();
        text.push('\n');
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_any_kind_stay_inside_of_their_attribute_and_their_comment() {
        let mut document = Document::new();
        document.open("robot", &[("name", "a\"><evil b='&'".to_owned())]);
        document.comment("joint --> <x/> of a--b-");
        document.text("plugin", &[], "<&>");
        let text = document.finish();
        assert!(text.contains("name=\"a&quot;&gt;&lt;evil b="), "{text}");
        assert!(!text.contains("<evil") && !text.contains("--> <x/>") && text.contains("&lt;&amp;&gt;"), "{text}");
        assert_eq!(text.matches("-->").count(), 1, "{text}");
    }
}
