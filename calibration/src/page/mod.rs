//! What all pages are made of: pictures of plain numbers. Knows nothing of what is shown.
//!
//! | module | owns |
//! |---|---|
//! | `frame` | what all pages share: style, headings, legends |
//! | `figure` | pictures of plain numbers: bars, map, lines, intervals, matrix |
//! | `canvas`, `scale` | SVG, axes |
//! | `picture` | pictures by pixels |
//! | `trace` | pictures of what is left between robot and twin through a clip |
//! | `parameters` | parameters as rows of a picture |

pub(crate) mod canvas;
pub(crate) mod figure;
pub(crate) mod frame;
mod parameters;
pub(crate) mod picture;
pub(crate) mod scale;
pub mod trace;

/// Root mean square over the joints.
pub fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len().max(1) as f64).sqrt()
}
