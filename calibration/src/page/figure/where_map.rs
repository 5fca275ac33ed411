//! Where the gap lies: one grid a stage, regimes down, channels across, the share of the squared residual in each cell.

use crate::page::canvas::{Anchor, Canvas, WIDTH};
use crate::words::share::percent;
use maud::Markup;
use std::cmp::Ordering;

/// A cell of the map.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Cell<'a> {
    /// Part of the clip: `control`, `hit`, `slide`, `rest`, `camera`.
    pub(crate) stage: &'a str,
    /// What moves: `joint2`, `x`, `yaw`.
    pub(crate) channel: &'a str,
    /// Under which conditions.
    pub(crate) regime: &'a str,
    /// Share of the squared residual, 0 to 1.
    pub(crate) share: f64,
}

const STAGES: [&str; 5] = ["control", "hit", "slide", "rest", "camera"];
const LEFT: f64 = 230.0;
/// Room for the sum of a row.
const RIGHT: f64 = 90.0;
const ROW: f64 = 30.0;
const WIDEST: f64 = 86.0;

/// The map. The colour is scaled to the largest cell; numbers are shares of everything.
pub(crate) fn where_map(cells: &[Cell]) -> Markup {
    let mut canvas = Canvas::new();
    let largest = cells.iter().map(|cell| cell.share).filter(|share| share.is_finite()).fold(1e-9, f64::max);
    let mut stages = distinct(cells.iter().map(|cell| cell.stage));
    stages.sort_by_key(|stage| STAGES.iter().position(|known| known == stage).unwrap_or(STAGES.len()));
    let mut y = 4.0;
    for stage in stages {
        let inside: Vec<&Cell> = cells.iter().filter(|cell| cell.stage == stage).collect();
        y = draw_stage(&mut canvas, stage, &inside, largest, y);
    }
    canvas.finish([WIDTH, f64::max(y, 20.0)], "shares of the gap by stage, channel and regime")
}

/// One stage's grid; where the next one begins.
fn draw_stage(canvas: &mut Canvas, stage: &str, cells: &[&Cell], largest: f64, top: f64) -> f64 {
    let mut channels = distinct(cells.iter().map(|cell| cell.channel));
    channels.sort_by(|a, b| natural(a, b));
    let sum = |regime: &str| cells.iter().filter(|cell| cell.regime == regime).map(|cell| cell.share).sum::<f64>();
    let mut regimes = distinct(cells.iter().map(|cell| cell.regime));
    regimes.sort_by(|a, b| sum(b).total_cmp(&sum(a)));
    let width = ((WIDTH - LEFT - RIGHT) / channels.len().max(1) as f64).min(WIDEST);
    let left = |column: usize| LEFT + width * column as f64;
    let total: f64 = cells.iter().map(|cell| cell.share).sum();
    canvas.text("strong", [0.0, top + 14.0], Anchor::Start, &format!("{stage}: {}", percent(total)));
    for (column, channel) in channels.iter().enumerate() {
        let at = [left(column) + 0.5 * width, top + 14.0];
        canvas.text_within("soft", at, Anchor::Middle, &spaced(channel), width);
    }
    let first = top + 22.0;
    for (row, regime) in regimes.iter().enumerate() {
        let y = first + ROW * row as f64;
        canvas.text_within("", [LEFT - 10.0, y + 19.0], Anchor::End, regime, LEFT - 12.0);
        for (column, channel) in channels.iter().enumerate() {
            let cell = cells.iter().find(|cell| cell.regime == *regime && cell.channel == *channel);
            draw_cell(canvas, cell.copied(), largest, [left(column), y], width);
        }
        canvas.text("small", [left(channels.len()) + 8.0, y + 19.0], Anchor::Start, &percent(sum(regime)));
    }
    first + ROW * regimes.len() as f64 + 16.0
}

fn draw_cell(canvas: &mut Canvas, cell: Option<&Cell>, largest: f64, [x, y]: [f64; 2], width: f64) {
    canvas.rect("cell", [x, y], [width, ROW]);
    let Some(cell) = cell else { return };
    let strength = (cell.share / largest).max(0.0);
    let words = format!("{}, {}, {}: {}", cell.stage, cell.channel, cell.regime, percent(cell.share));
    canvas.hint(&words, |canvas| {
        canvas.tint("before", 0.95 * strength, [x + 1.0, y + 1.0], [width - 2.0, ROW - 2.0]);
        if cell.share >= 0.005 {
            let number = format!("{:.0}", 100.0 * cell.share);
            let number = if width > 50.0 { format!("{number} %") } else { number };
            let class = if strength > 0.65 { "on" } else { "" };
            canvas.text(class, [x + 0.5 * width, y + 19.5], Anchor::Middle, &number);
        }
    });
}

/// `joint2` as `joint 2`.
fn spaced(channel: &str) -> String {
    let digits = channel.find(|c: char| c.is_ascii_digit());
    digits.map_or_else(|| channel.to_owned(), |place| format!("{} {}", channel[..place].trim_end(), &channel[place..]))
}

/// Names in order, with `joint2` before `joint10`.
fn natural(a: &str, b: &str) -> Ordering {
    let split = |name: &str| -> (String, u64) {
        let place = name.find(|c: char| c.is_ascii_digit()).unwrap_or(name.len());
        (name[..place].to_owned(), name[place..].parse().unwrap_or(0))
    };
    split(a).cmp(&split(b))
}

fn distinct<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut found = Vec::new();
    for name in names {
        if !found.contains(&name) {
            found.push(name);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::canvas::tests::assert_well_formed;

    fn cell<'a>(stage: &'a str, channel: &'a str, regime: &'a str, share: f64) -> Cell<'a> {
        Cell { stage, channel, regime, share }
    }

    #[test]
    fn stages_follow_the_clip_and_the_largest_regime_comes_first() {
        let cells = [
            cell("slide", "x", "after the hit", 0.1),
            cell("control", "joint10", "slow", 0.1),
            cell("control", "joint2", "slow", 0.05),
            cell("control", "joint2", "turning", 0.75),
        ];
        let svg = where_map(&cells).into_string();
        assert_well_formed(&svg);
        let place = |text: &str| svg.find(text).unwrap_or_else(|| panic!("no {text} in {svg}"));
        assert!(place(">control: 90 %<") < place(">slide: 10 %<"));
        assert!(place(">joint 2<") < place(">joint 10<"));
        assert!(place(">turning<") < place(">slow<"));
        assert!(svg.contains("fill-opacity=\"0.95\"") && svg.contains(">75 %<"));
    }

    #[test]
    fn neither_many_channels_nor_long_names_nor_nothing_break_the_map() {
        let names: Vec<String> = (0..30).map(|i| format!("some_channel_{i}")).collect();
        let long = "fast reversal under a heavy load far from the centre of the table";
        let cells: Vec<Cell> = names.iter().map(|name| cell("control", name, long, 1.0 / 30.0)).collect();
        assert_well_formed(&where_map(&cells).into_string());
        assert_well_formed(&where_map(&[cell("new stage", "", "", f64::NAN)]).into_string());
        assert_well_formed(&where_map(&[]).into_string());
    }
}
