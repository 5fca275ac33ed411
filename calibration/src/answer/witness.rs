//! What a stage says by itself, in words.

use crate::words::quantity::Unit;
use crate::words::words;
use inference::witness::Witness;

/// `camera latency (latency 20.4 ± 0.9 ms, 8 clips)`.
pub fn witness_in_words(witness: &Witness) -> String {
    format!("{} ({}, {} clips)", words(witness.effect), witnessed_number(witness), witness.clips)
}

/// `latency 20.4 ± 0.9 ms`.
pub fn witnessed_number(witness: &Witness) -> String {
    let unit = Unit::suited(witness.unit, witness.value.abs().max(witness.error));
    let [value, error] = [witness.value, witness.error].map(|si| unit.scaled(si));
    // Two digits of the error say enough.
    let digits = (1.0 - error.log10().floor()).clamp(0.0, 6.0) as usize;
    format!("{} {value:.digits$} \u{b1} {error:.digits$} {}", witness.number, unit.name()).trim_end().to_owned()
}
