//! What may have changed from one session to the other: each parameter of the baseline, and each effect.

use super::super::library::Library;
use std::ops::Range;

/// Something that may have changed.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Subject {
    /// `stiffness`, `friction`, or the effect's name.
    pub(super) name: String,
    /// The candidate of the library, where it is an effect.
    pub(super) effect: Option<usize>,
    /// All its numbers.
    pub(super) numbers: Range<usize>,
    /// Those that are fitted.
    pub(super) turned: Vec<usize>,
    /// Those that say how much of it there is.
    pub(super) sizes: Vec<usize>,
}

/// All of a library, the parameters of the baseline first.
pub(super) fn all(library: &Library) -> Vec<Subject> {
    let mut subjects: Vec<Subject> = Vec::new();
    for number in library.baseline.clone() {
        let name = library.settings.settings()[number].parameter();
        match subjects.last_mut().filter(|last| last.name == name) {
            Some(last) => {
                last.numbers.end = number + 1;
                last.turned.push(number);
                last.sizes.push(number);
            }
            None => subjects.push(Subject {
                name,
                effect: None,
                numbers: number..number + 1,
                turned: vec![number],
                sizes: vec![number],
            }),
        }
    }
    let effects = library.candidates.iter().enumerate().map(|(candidate, info)| Subject {
        name: info.effect.name.to_owned(),
        effect: Some(candidate),
        numbers: info.numbers.clone(),
        turned: info.turned.clone(),
        sizes: info.sizes.clone(),
    });
    subjects.extend(effects);
    subjects
}

impl Subject {
    /// Whether a model turns it already.
    pub(super) fn is_in(&self, turned: impl Fn(usize) -> bool) -> bool {
        self.effect.is_none() || self.turned.iter().any(|number| turned(*number))
    }

    /// Numbers that each session has of its own once it has changed. Where an effect was not there at all, its form is what both
    /// share: where it does not act its form is not seen.
    pub(super) fn parted(&self, was_there: bool) -> Vec<usize> {
        if was_there { self.turned.clone() } else { self.sizes.clone() }
    }
}
