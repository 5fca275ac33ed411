//! A model file that is being written: its XML, what stands in it, and what its format has no key for.

use super::known::{LeftOut, Line};
use super::xml::Document;

pub(super) struct Sheet {
    pub(super) xml: Document,
    pub(super) lines: Vec<Line>,
    pub(super) left_out: Vec<LeftOut>,
}

impl Sheet {
    pub(super) fn new() -> Self {
        Self { xml: Document::new(), lines: Vec::new(), left_out: Vec::new() }
    }

    /// Notes a line that `key` holds, and gives its comment.
    pub(super) fn note(&mut self, key: &str, line: Line) -> String {
        let comment = line.comment(key);
        self.lines.push(line);
        comment
    }

    pub(super) fn lacks(&mut self, what: impl Into<String>, why: &str) {
        self.left_out.push(LeftOut { what: what.into(), why: why.into() });
    }
}
