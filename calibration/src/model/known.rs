//! Numbers of a model with where they come from, and how they stand in comments.

use serde::Serialize;

/// A number and its sources.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Known {
    pub(super) value: f64,
    from: Vec<String>,
}

impl Known {
    pub(super) fn new(value: f64, from: &str) -> Self {
        Self { value, from: vec![from.to_owned()] }
    }

    /// What a format takes where nothing is said.
    pub(super) fn by_default(value: f64) -> Self {
        Self { value, from: Vec::new() }
    }

    /// Another value, which came about by one more source.
    pub(super) fn becomes(&mut self, value: f64, from: &str) {
        self.value = value;
        if !self.from.iter().any(|known| known == from) {
            self.from.push(from.to_owned());
        }
    }

    pub(super) fn add(&mut self, more: f64, from: &str) {
        self.becomes(self.value + more, from);
    }

    pub(super) fn sources(&self) -> Vec<&str> {
        self.from.iter().map(String::as_str).collect()
    }

    /// Whether anything but the format's own default is known.
    pub(super) fn is_known(&self) -> bool {
        !self.from.is_empty()
    }
}

/// One line of a model: what it stands for.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Line {
    /// Joint, body or contact.
    pub of: String,
    /// What it is, in words.
    pub what: &'static str,
    pub values: Vec<f64>,
    /// SI unit; `1` without.
    pub unit: &'static str,
    /// cell.toml, theta.toml, or an effect in theta.toml.
    pub from: Vec<String>,
}

impl Line {
    pub(super) fn new(of: &str, what: &'static str, unit: &'static str, known: &Known) -> Self {
        Self { of: of.to_owned(), what, values: vec![known.value], unit, from: known.from.clone() }
    }

    pub(super) fn list(of: &str, what: &'static str, unit: &'static str, values: &[f64], from: &[&str]) -> Self {
        let from = from.iter().map(|source| (*source).to_owned()).collect();
        Self { of: of.to_owned(), what, values: values.to_vec(), unit, from }
    }

    /// The line with the key that holds it, as a comment.
    pub(super) fn comment(&self, key: &str) -> String {
        let unit = if self.unit == "1" { String::new() } else { format!(" [{}]", self.unit) };
        format!("{key}{unit}: {}, from {}", self.what, self.from.join(" and "))
    }
}

/// Something that was found and that the format has no key for.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    /// What, with its numbers.
    pub what: String,
    /// Why, and what to do about it.
    pub why: String,
}

/// Least moment of inertia of a body in a file [kg m²]: next to nothing, and simulators load it.
pub(super) const LEAST_MOMENT: f64 = 1e-9;

/// A number with ten digits that count; what is nothing but rounding is 0.
pub(super) fn number(value: f64) -> String {
    if value.abs() < 1e-14 {
        return "0".into();
    }
    let rounded: f64 = format!("{value:.9e}").parse().unwrap_or(value);
    format!("{rounded}")
}

/// Numbers with spaces between them.
pub(super) fn numbers(values: impl IntoIterator<Item = f64>) -> String {
    values.into_iter().map(number).collect::<Vec<_>>().join(" ")
}
