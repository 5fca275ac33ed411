//! Constants of the statistics: what they are stands in their name, and how many numbers there are is known.

use tests::constants::{Constant, constants};
use tests::sources::below;
use tests::texts::root;

/// Where names of constants are read.
const READ: [&str; 4] =
    ["calibration/inference/src", "calibration/capture/src", "calibration/src/diagnose", "calibration/src/identify"];

/// Files that still have names of one generic word. The list only ever gets shorter.
const NOT_YET: &[&str] = &[
    "calibration/inference/src/estimate/descent.rs",
    "calibration/inference/src/estimate/leverage.rs",
    "calibration/inference/src/estimate/problem.rs",
    "calibration/inference/src/estimate/sandwich.rs",
    "calibration/inference/src/estimate/swarm.rs",
    "calibration/inference/src/forward/arm/clip.rs",
    "calibration/inference/src/forward/arm/encoder_age.rs",
    "calibration/inference/src/forward/arm/mod.rs",
    "calibration/inference/src/forward/arm/velocity.rs",
    "calibration/inference/src/forward/object/clearance.rs",
    "calibration/inference/src/forward/object/own.rs",
    "calibration/inference/src/forward/object/simulator.rs",
    "calibration/inference/src/forward/setting/search.rs",
    "calibration/inference/src/likelihood/arm/clip.rs",
    "calibration/inference/src/likelihood/arm/velocity.rs",
    "calibration/inference/src/likelihood/object/deviations.rs",
    "calibration/inference/src/likelihood/setting/search.rs",
    "calibration/src/diagnose/against/change.rs",
    "calibration/src/diagnose/against/conclude.rs",
    "calibration/src/diagnose/against/fits.rs",
    "calibration/src/diagnose/against/headline.rs",
    "calibration/src/diagnose/against/mod.rs",
    "calibration/src/diagnose/against/pair.rs",
    "calibration/src/diagnose/against/search.rs",
    "calibration/src/diagnose/clips/admit.rs",
    "calibration/src/diagnose/clips/ground.rs",
    "calibration/src/diagnose/clips/length.rs",
    "calibration/src/diagnose/clips/parts.rs",
    "calibration/src/diagnose/clips/split.rs",
    "calibration/src/diagnose/conclude/advice.rs",
    "calibration/src/diagnose/conclude/headline.rs",
    "calibration/src/diagnose/conclude/site.rs",
    "calibration/src/diagnose/conclude/verdict.rs",
    "calibration/src/diagnose/conclude/written.rs",
    "calibration/src/diagnose/criteria.rs",
    "calibration/src/diagnose/evidence/deviations.rs",
    "calibration/src/diagnose/evidence/regime.rs",
    "calibration/src/diagnose/evidence/scatter_scale.rs",
    "calibration/src/diagnose/fit/bench.rs",
    "calibration/src/diagnose/fit/descend.rs",
    "calibration/src/diagnose/fit/effort.rs",
    "calibration/src/diagnose/fit/restart.rs",
    "calibration/src/diagnose/fit/shortlist.rs",
    "calibration/src/diagnose/fit/stages.rs",
    "calibration/src/diagnose/fit/undetermined.rs",
    "calibration/src/diagnose/judge/confidence.rs",
    "calibration/src/diagnose/judge/drift.rs",
    "calibration/src/diagnose/judge/gap.rs",
    "calibration/src/diagnose/judge/localise.rs",
    "calibration/src/diagnose/judge/recorded_arm.rs",
    "calibration/src/diagnose/judge/remainder.rs",
    "calibration/src/diagnose/judge/score.rs",
    "calibration/src/diagnose/judge/trial.rs",
    "calibration/src/diagnose/propose/along_motion.rs",
    "calibration/src/diagnose/propose/ripple.rs",
    "calibration/src/diagnose/propose/screening.rs",
    "calibration/src/diagnose/propose/starts.rs",
    "calibration/src/diagnose/search/baseline.rs",
    "calibration/src/diagnose/search/combine.rs",
    "calibration/src/identify/arm/doubt.rs",
    "calibration/src/identify/arm/figures.rs",
    "calibration/src/identify/arm/law.rs",
    "calibration/src/identify/arm/measured_stiffness.rs",
    "calibration/src/identify/arm/saturation.rs",
    "calibration/src/identify/arm/time_step.rs",
    "calibration/src/identify/arm/verdict.rs",
    "calibration/src/identify/figures.rs",
    "calibration/src/identify/joint/agreement.rs",
    "calibration/src/identify/joint/alone.rs",
    "calibration/src/identify/joint/figures.rs",
    "calibration/src/identify/joint/fit.rs",
    "calibration/src/identify/joint/model.rs",
    "calibration/src/identify/joint/noise.rs",
    "calibration/src/identify/joint/positions.rs",
    "calibration/src/identify/joint/together.rs",
    "calibration/src/identify/object/doubt.rs",
    "calibration/src/identify/object/finding.rs",
    "calibration/src/identify/object/parts.rs",
    "calibration/src/identify/object/screen.rs",
    "calibration/src/identify/object/step.rs",
    "calibration/src/identify/object/vicinity.rs",
    "calibration/src/identify/run.rs",
    "calibration/src/identify/split.rs",
];

/// Numeric constants of `diagnose`: no more than there are today.
const MOST_NUMBERS_OF_DIAGNOSE: usize = 198;

/// The constants of every file below a folder that is no test, with its name.
fn by_file(folder: &str) -> Vec<(String, Vec<Constant>)> {
    let files = below(&root(), folder).into_iter().filter(|source| !source.is_test());
    files.map(|source| (source.file.clone(), constants(&source.code_text()))).collect()
}

#[test]
fn constants_are_named_for_what_they_are() {
    for (file, constants) in READ.iter().flat_map(|folder| by_file(folder)) {
        let generic: Vec<&str> = constants.iter().filter(|c| c.is_generic()).map(|c| c.name.as_str()).collect();
        let listed = NOT_YET.contains(&file.as_str());
        assert!(generic.is_empty() || listed, "{file}: {generic:?} say how much and not what");
        if generic.is_empty() && listed {
            eprintln!("{file} has no such name left: its line can go");
        }
    }
    for file in NOT_YET.iter().filter(|file| !root().join(file).exists()) {
        eprintln!("{file} is gone: its line can go");
    }
}

#[test]
fn the_diagnosis_has_no_more_numbers_than_before() {
    let all = by_file("calibration/src/diagnose");
    let count = all.iter().flat_map(|(_, constants)| constants).filter(|constant| constant.is_number()).count();
    eprintln!("{count} numeric constants in calibration/src/diagnose");
    assert!(count <= MOST_NUMBERS_OF_DIAGNOSE, "{count} numeric constants: put numbers where their like stand");
}
