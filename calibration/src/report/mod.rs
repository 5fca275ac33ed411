//! Reports: what was found, as one offline HTML file with pictures inside.
//!
//! | module | owns |
//! |---|---|
//! | [`diagnosis`] | the page of a diagnosis |
//! | [`against`] | the page of what changed between two sessions |
//! | [`check`] | the page of what is odd about a recording |
//! | [`benchmark`] | the page of how good the diagnosis is |
//! | [`demo_page`] | the page of the demo |
//! | [`identification`] | the page of what was identified about arm or object |
//! | [`stroke`] | a stroke from above, before it is done |
//! | [`terminal`] | diagnosis, identification and benchmark in a few lines for a terminal |
//! | [`trace`] | what is left between robot and twin through a clip |
//! | `frame` | what all pages share: style, headings, legends |
//! | `figure` | pictures of plain numbers: bars, map, lines, intervals, matrix |
//! | `canvas`, `scale` | SVG, axes |
//! | `change` | what a number was and what it is |
//! | `quantity`, `share`, `parameters` | numbers, units, shares and intervals as people read them |

pub mod against;
pub mod benchmark;
mod canvas;
mod change;
pub mod check;
pub mod demo_page;
pub mod diagnosis;
mod figure;
mod frame;
pub mod identification;
mod parameters;
mod quantity;
mod scale;
mod share;
pub mod stroke;
pub mod terminal;
pub mod trace;

pub use change::{between, smallest_in_words};
pub use demo_page::Story;
pub use parameters::{effect_in_words, number_in_words};
pub use quantity::in_unit;
pub use share::percent;
pub use trace::Trace;

/// Root mean square over the joints.
#[must_use]
pub fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// A channel as words: `joint2` as `joint 2`, others as they are.
#[must_use]
pub fn channel_in_words(channel: &str) -> String {
    match channel.strip_prefix("joint") {
        Some(number) if !number.is_empty() && number.bytes().all(|c| c.is_ascii_digit()) => format!("joint {number}"),
        _ => channel.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_are_counted_from_1_in_words() {
        assert_eq!([channel_in_words("joint5"), channel_in_words("yaw")], ["joint 5", "yaw"]);
    }
}
