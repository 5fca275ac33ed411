//! Default classes of an MJCF: what an element has that does not say it itself.

use std::collections::HashMap;
use twin::xml::Element;

/// The class that all others come from.
pub(super) const MAIN: &str = "main";
/// All kinds of actuators share their defaults.
pub(super) const ACTUATORS: [&str; 12] = [
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "dcmotor",
    "plugin",
    "orientation",
];

/// The default classes of a document.
pub(super) struct Classes {
    /// By class: the one that it comes from, and the elements in it.
    classes: HashMap<String, (Option<String>, Vec<Element>)>,
}

impl Classes {
    pub(super) fn of(root: &Element) -> Self {
        let mut classes = Self { classes: HashMap::new() };
        for section in root.elements().filter(|section| section.name == "default") {
            classes.read(section, None);
        }
        classes
    }

    fn read(&mut self, element: &Element, parent: Option<&str>) {
        let name = if parent.is_none() { MAIN } else { element.get("class").unwrap_or(MAIN) };
        let (nested, own): (Vec<&Element>, Vec<&Element>) =
            element.elements().partition(|element| element.name == "default");
        let entry = self.classes.entry(name.to_owned()).or_insert_with(|| (parent.map(str::to_owned), Vec::new()));
        entry.1.extend(own.into_iter().cloned());
        for element in nested {
            self.read(element, Some(name));
        }
    }

    /// An attribute of an element whose surroundings have the class `around`; its `kinds` share their defaults.
    pub(super) fn get(&self, element: &Element, around: &str, kinds: &[&str], key: &str) -> Option<String> {
        if let Some(value) = element.get(key) {
            return Some(value.to_owned());
        }
        let mut class = Some(element.get("class").unwrap_or(around).to_owned());
        // A class is within another one, so that no way is longer than their number.
        for _ in 0..=self.classes.len() {
            let (parent, elements) = self.classes.get(class.as_deref()?).or_else(|| self.classes.get(MAIN))?;
            let defaults = elements.iter().rev().filter(|default| kinds.contains(&default.name.as_str()));
            if let Some(value) = defaults.filter_map(|default| default.get(key)).next() {
                return Some(value.to_owned());
            }
            class.clone_from(parent);
        }
        None
    }
}

/// Numbers in an attribute, with spaces between them.
pub(super) fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map_while(|word| word.parse().ok()).collect()
}
