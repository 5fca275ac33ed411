//! What may have changed from one session to the other: each parameter of the baseline, and each effect. Numbers of one block of
//! theta.toml change together: a load on a joint moves constant, sine and cosine of its weight at once, and tried apart each of them
//! is less than what imitates it.

use super::super::library::Library;
use inference::likelihood::Setting;
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
    /// Whether a mass, a length or a friction is behind it: parameters of the baseline, and effects that move bodies.
    pub(super) is_of_bodies: bool,
}

/// The block of theta.toml in which a number of the baseline stands; of gains and of an object's parameters each kind by itself.
fn block(setting: &Setting) -> String {
    match setting {
        Setting::Effect { name, .. } => (*name).to_owned(),
        other => other.parameter(),
    }
}

/// All of a library, the parameters of the baseline first.
pub(super) fn all(library: &Library) -> Vec<Subject> {
    let mut subjects: Vec<Subject> = Vec::new();
    for number in library.baseline.clone() {
        let name = block(&library.settings.settings()[number]);
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
                is_of_bodies: true,
            }),
        }
    }
    let effects = library.candidates.iter().enumerate().map(|(candidate, info)| Subject {
        name: info.effect.name.to_owned(),
        effect: Some(candidate),
        numbers: info.numbers.clone(),
        turned: info.turned.clone(),
        sizes: info.sizes.clone(),
        is_of_bodies: info.effect.is_of_bodies(),
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

#[cfg(test)]
mod tests {
    use super::*;
    use inference::likelihood::setting;
    use shared_mem::cell::Cell;
    use shared_mem::msg::MAX_JOINTS;
    use std::path::Path;

    #[test]
    fn the_weight_of_links_of_unknown_masses_is_one_subject_and_not_three() {
        let text = "[robot]\njoints = [\"a\", \"b\"]\n[controller]\nkind = \"joint_pd\"\nstiffness = [2.0, 2.0]\n\
                    damping = [0.1, 0.1]\nrotor_inertia = [0.004, 0.004]\ntorque_limit = [0.6, 0.6]\n";
        let cell = Cell::parse(text, Path::new("cell.toml")).expect("a cell");
        let base = setting::complete(&cell, None).expect("parameters");
        let library = Library::new(&cell, &base, None, &[0.6; MAX_JOINTS]);
        let subjects = all(&library);
        let weights: Vec<&Subject> =
            subjects.iter().filter(|subject| subject.name.starts_with("joint_weight")).collect();
        assert_eq!(weights.len(), 1, "{:?}", subjects.iter().map(|subject| &subject.name).collect::<Vec<_>>());
        assert_eq!((weights[0].turned.len(), weights[0].effect, weights[0].is_of_bodies), (6, None, true));
        let of_bodies =
            |name: &str| subjects.iter().find(|subject| subject.name == name).expect("a subject").is_of_bodies;
        assert!(of_bodies("stiffness") && of_bodies("joint_coulomb_friction"));
        assert!(!of_bodies("torque_sensor_bias") && !of_bodies("torque_ripple"));
    }
}
