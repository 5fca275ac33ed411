//! The page: one HTML file that opens anywhere, without network and without scripts.

use super::Story;
use super::plots::{self, AFTER, BEFORE, Bars, Line, PlotError, REAL};
use maud::{DOCTYPE, Markup, PreEscaped, html};

const STYLE: &str = "
body { font: 16px/1.5 system-ui, sans-serif; color: #222; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.6rem; line-height: 1.3; margin-bottom: .5rem; }
h2 { font-size: 1.1rem; margin: 2.2rem 0 .3rem; }
p.lead { font-size: 1.1rem; color: #444; }
svg { width: 100%; height: auto; }
table { border-collapse: collapse; margin-top: .5rem; }
th, td { padding: .25rem .9rem .25rem 0; text-align: right; font-variant-numeric: tabular-nums; border-bottom: 1px solid #ddd; }
th:first-child, td:first-child { text-align: left; }
footer { margin-top: 3rem; color: #777; font-size: .85rem; }
";

/// The whole page.
///
/// # Errors
/// [`PlotError`] when a plot cannot be drawn.
pub fn page(story: &Story) -> Result<String, PlotError> {
    let joint = story.joint + 1;
    let markup = html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { "twinalign: robot against twin" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                h1 { (story.sentence()) }
                p.lead { (story.setting) }
                h2 { "Gap by joint: RMS of twin minus robot" }
                (PreEscaped(gap_bars(story)?))
                h2 { "Joint " (joint) ", where the gap is largest: robot and twin" }
                (PreEscaped(motion(story)?))
                h2 { "Joint " (joint) ": how far off the twin is" }
                (PreEscaped(error(story)?))
                h2 { "Figures" }
                (table(story))
                footer { "twinalign " (env!("CARGO_PKG_VERSION")) ". " (story.origin) }
            }
        }
    };
    Ok(markup.into_string())
}

fn milli(values: &[f64]) -> Vec<f64> {
    values.iter().map(|v| 1e3 * v).collect()
}

fn gap_bars(story: &Story) -> Result<String, PlotError> {
    let (before, after) = (milli(&story.before), milli(&story.after));
    let groups = [
        Bars { name: "twin with the gains of cell.toml", color: BEFORE, values: &before },
        Bars { name: "twin with the true gains", color: AFTER, values: &after },
    ];
    plots::bars(&groups, "mrad")
}

fn motion(story: &Story) -> Result<String, PlotError> {
    let lines = [
        Line { name: "twin with the gains of cell.toml", color: BEFORE, width: 12, points: &story.twin },
        Line { name: "robot", color: REAL, width: 4, points: &story.real },
    ];
    plots::lines(&lines, "rad")
}

fn error(story: &Story) -> Result<String, PlotError> {
    let scale = |points: &[[f64; 2]]| -> Vec<[f64; 2]> { points.iter().map(|[t, e]| [*t, 1e3 * e]).collect() };
    let (before, after) = (scale(&story.error_before), scale(&story.error_after));
    let lines = [
        Line { name: "twin with the gains of cell.toml", color: BEFORE, width: 6, points: &before },
        Line { name: "twin with the true gains", color: AFTER, width: 6, points: &after },
    ];
    plots::lines(&lines, "mrad")
}

fn table(story: &Story) -> Markup {
    html! {
        table {
            tr { th { "joint" } th { "live [mrad]" } th { "replay, cell.toml [mrad]" } th { "replay, true gains [mrad]" } }
            @for (joint, (before, after)) in story.before.iter().zip(&story.after).enumerate() {
                tr {
                    td { (joint + 1) }
                    td { (story.live.get(joint).map_or("-".to_owned(), |live| format!("{:.3}", 1e3 * live))) }
                    td { (format!("{:.3}", 1e3 * before)) }
                    td { (format!("{:.3}", 1e3 * after)) }
                }
            }
        }
    }
}
