//! Constants of the statistics: what they are stands in their name, and how many numbers there are is known.

use tests::constants::{Constant, constants};
use tests::sources::below;
use tests::texts::root;

/// Where names of constants are read.
const READ: [&str; 4] =
    ["calibration/inference/src", "calibration/capture/src", "calibration/src/diagnose", "calibration/src/identify"];

/// Numeric constants of `diagnose`: no more than there are today.
const MOST_NUMBERS_OF_DIAGNOSE: usize = 117;

/// The constants of every file below a folder that is no test, with its name.
fn by_file(folder: &str) -> Vec<(String, Vec<Constant>)> {
    let files = below(&root(), folder).into_iter().filter(|source| !source.is_test());
    files.map(|source| (source.file.clone(), constants(&source.code_text()))).collect()
}

#[test]
fn constants_are_named_for_what_they_are() {
    for (file, constants) in READ.iter().flat_map(|folder| by_file(folder)) {
        let generic: Vec<&str> = constants.iter().filter(|c| c.is_generic()).map(|c| c.name.as_str()).collect();
        assert!(generic.is_empty(), "{file}: {generic:?} say how much and not what");
    }
}

#[test]
fn the_diagnosis_has_no_more_numbers_than_before() {
    let all = by_file("calibration/src/diagnose");
    let count = all.iter().flat_map(|(_, constants)| constants).filter(|constant| constant.is_number()).count();
    eprintln!("{count} numeric constants in calibration/src/diagnose");
    assert!(count <= MOST_NUMBERS_OF_DIAGNOSE, "{count} numeric constants: put numbers where their like stand");
}
