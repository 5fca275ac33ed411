//! Sizes that were found at an end of their search: what acts may be stronger, or something else.

use crate::diagnose::library::Library;
use crate::page::words;

/// A size nearer to an end of its search than this share of its range stopped there.
const AT_AN_END: f64 = 1e-3;

/// A sentence for each of the `effects` with such a size among the numbers `full`.
pub(super) fn remarks(library: &Library, effects: &[usize], full: &[f64]) -> Vec<String> {
    let stopped = |k: &usize| {
        let unknown = &library.unknowns[*k];
        let near = AT_AN_END * (unknown.upper - unknown.lower);
        (full[*k] - unknown.start).abs() > near && unknown.room(full[*k]).iter().any(|room| room.abs() < near)
    };
    let ended = effects.iter().map(|effect| &library.candidates[*effect]).filter(|c| c.sizes.iter().any(stopped));
    let sentence = |name| {
        format!(
            "{} was found as strong as it is looked for: what acts may be stronger, or something else that looks like it",
            words(name)
        )
    };
    ended.map(|candidate| sentence(candidate.effect.name)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_bench::shipped;
    use crate::forward::setting;
    use shared_mem::msg::MAX_JOINTS;

    #[test]
    fn a_size_at_an_end_of_its_search_is_remarked_and_one_inside_or_at_rest_is_not() {
        let cell = shipped();
        let base = setting::complete(&cell, None).expect("a cell");
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        let delay = library.find("command_delay").expect("a candidate");
        let k = library.candidates[delay].sizes[0];
        let at = |share: f64| {
            let mut full = library.start();
            let unknown = &library.unknowns[k];
            full[k] = unknown.start + share * (unknown.upper - unknown.start);
            remarks(&library, &[delay], &full)
        };
        assert!(at(0.0).is_empty() && at(0.5).is_empty() && remarks(&library, &[], &library.start()).is_empty());
        let [sentence] = &at(1.0)[..] else { panic!("{:?}", at(1.0)) };
        assert!(sentence.starts_with("command delay was found as strong as it is looked for"), "{sentence}");
    }
}
