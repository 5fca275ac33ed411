//! Sizes that were found at an end of their search. The likelihood still rises there, so that no interval around them holds: what acts
//! is at least as strong, or something else.

use crate::diagnose::library::Library;
use crate::words::words;
use inference::estimate::Unknown;
use inference::likelihood::setting::Setting;
use std::collections::BTreeMap;

/// A size nearer to an end of its search than this share of its range stopped there.
const AT_AN_END: f64 = 1e-3;

/// Sizes of a candidate, among all numbers `full`, that stopped at an end of their search away from where it began: the parameter and
/// which of its values.
pub(crate) fn stopped(library: &Library, candidate: usize, full: &[f64]) -> Vec<(&'static str, usize)> {
    let candidate = &library.candidates[candidate];
    let (mut counts, mut stopped) = (BTreeMap::new(), Vec::new());
    for k in candidate.numbers.clone() {
        let Setting::Effect { parameter, .. } = library.settings.settings()[k] else { continue };
        let count = counts.entry(parameter).or_insert(0);
        if candidate.sizes.contains(&k) && is_at_an_end(&library.unknowns[k], full[k]) {
            stopped.push((parameter, *count));
        }
        *count += 1;
    }
    stopped
}

fn is_at_an_end(unknown: &Unknown, value: f64) -> bool {
    let near = AT_AN_END * (unknown.upper - unknown.lower);
    (value - unknown.start).abs() > near && unknown.room(value).iter().any(|room| room.abs() < near)
}

/// What has to be said of gains among all numbers that stopped at an end of their search: one sentence for stiffness, one for damping.
pub(crate) fn of_gains(library: &Library, full: &[f64]) -> Vec<String> {
    let mut stopped: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for ((setting, unknown), value) in library.settings.settings().iter().zip(&library.unknowns).zip(full) {
        let (Setting::Stiffness(joint) | Setting::Damping(joint)) = *setting else { continue };
        if is_at_an_end(unknown, *value) {
            let joints = stopped.entry(setting.parameter()).or_default();
            let joint = (joint + 1).to_string();
            // Two sessions have one each.
            if !joints.contains(&joint) {
                joints.push(joint);
            }
        }
    }
    let sentence = |(parameter, joints): (&String, &Vec<String>)| {
        let (joint, joints) = (if joints.len() == 1 { "joint" } else { "joints" }, joints.join(", "));
        format!(
            "{} of {joint} {joints} was found at the end of the range that is searched: it may lie beyond, or something else acts; \
             `{parameter}_range` under [controller] widens it",
            words(parameter)
        )
    };
    stopped.iter().map(sentence).collect()
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

    #[test]
    fn gains_at_the_ends_of_their_ranges_are_reported_and_those_inside_are_not() {
        let cell = shipped();
        let base = setting::complete(&cell, None).expect("a cell");
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        let mut full = library.start();
        assert!(of_gains(&library, &full).is_empty());
        full[1] = library.unknowns[1].upper;
        full[3] = library.unknowns[3].lower;
        let said = of_gains(&library, &full);
        assert!(said.len() == 1 && said[0].starts_with("stiffness of joints 2, 4 was found at the end"), "{said:?}");
    }
}
