//! Sizes that were found at an end of their search. The likelihood still rises there, so that no interval around them holds: what acts
//! is at least as strong, or something else.

use crate::diagnose::library::Library;
use inference::likelihood::setting::Setting;
use std::collections::BTreeMap;

/// A size nearer to an end of its search than this share of its range stopped there.
const AT_AN_END: f64 = 1e-3;

/// Sizes of a candidate, among all numbers `full`, that stopped at an end of their search away from where it began: the parameter and
/// which of its values.
pub(crate) fn stopped(library: &Library, candidate: usize, full: &[f64]) -> Vec<(&'static str, usize)> {
    let at_an_end = |k: usize| {
        let unknown = &library.unknowns[k];
        let near = AT_AN_END * (unknown.upper - unknown.lower);
        (full[k] - unknown.start).abs() > near && unknown.room(full[k]).iter().any(|room| room.abs() < near)
    };
    let candidate = &library.candidates[candidate];
    let (mut counts, mut stopped) = (BTreeMap::new(), Vec::new());
    for k in candidate.numbers.clone() {
        let Setting::Effect { parameter, .. } = library.settings.settings()[k] else { continue };
        let count = counts.entry(parameter).or_insert(0);
        if candidate.sizes.contains(&k) && at_an_end(k) {
            stopped.push((parameter, *count));
        }
        *count += 1;
    }
    stopped
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_bench::shipped;
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;

    #[test]
    fn a_size_at_an_end_of_its_search_stopped_there_and_one_inside_or_at_rest_did_not() {
        let cell = shipped();
        let base = setting::complete(&cell, None).expect("a cell");
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        let delay = library.find("command_delay").expect("a candidate");
        let k = library.candidates[delay].sizes[0];
        let at = |share: f64| {
            let mut full = library.start();
            let unknown = &library.unknowns[k];
            full[k] = unknown.start + share * (unknown.upper - unknown.start);
            stopped(&library, delay, &full)
        };
        assert_eq!([at(0.0), at(0.5), at(1.0)], [vec![], vec![], vec![("delay", 0)]]);
    }
}
