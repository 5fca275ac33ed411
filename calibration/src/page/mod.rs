//! What all pages are made of: words for numbers, and pictures of plain numbers. Knows nothing of what is shown.
//!
//! | module | owns |
//! |---|---|
//! | `frame` | what all pages share: style, headings, legends |
//! | `figure` | pictures of plain numbers: bars, map, lines, intervals, matrix |
//! | `canvas`, `scale` | SVG, axes |
//! | `picture` | pictures by pixels |
//! | `trace` | what is left between robot and twin through a clip |
//! | `quantity`, `share`, `parameters` | numbers, units, shares and intervals as people read them |

pub(crate) mod canvas;
pub(crate) mod figure;
pub(crate) mod frame;
pub(crate) mod parameters;
pub(crate) mod picture;
pub(crate) mod quantity;
pub(crate) mod scale;
pub(crate) mod share;
pub mod trace;

pub use parameters::{Size, effect_in_words, number_in_words};
pub use quantity::{UNBOUNDED, in_unit};
pub use share::percent;
pub use trace::Trace;

/// Root mean square over the joints.
pub fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}

/// A name of files as words: `command delay` of `command_delay`.
pub fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// A channel as words: `joint2` as `joint 2`, others as they are.
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
