//! Parameters with their intervals, each on its own scale from bound to bound or around what was believed before.

use crate::page::canvas::{Anchor, Canvas, WIDTH, width_of};
use crate::page::scale::Scale;
use crate::words::quantity::{Unit, short, span};
use maud::Markup;

/// Parameters of one kind, which share an axis.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Group<'a> {
    /// What they are.
    pub(crate) name: &'a str,
    pub(crate) unit: &'a str,
    pub(crate) rows: Vec<Row>,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Row {
    /// Which of them.
    pub(crate) name: String,
    pub(crate) value: f64,
    pub(crate) interval: [f64; 2],
    /// What cell.toml says.
    pub(crate) nominal: Option<f64>,
    /// A remark: `at its bound`, `not identifiable`.
    pub(crate) warning: Option<String>,
}

/// Room for names, at least and at most.
const NAMES: [f64; 2] = [150.0, 300.0];
/// Where the axis ends.
const END: f64 = 560.0;
const ROW: f64 = 25.0;
/// From this ratio on, values are laid out by their powers of ten.
const DECADES: f64 = 50.0;
/// Room for a remark under a row.
const WARNING: f64 = 13.0;

impl Row {
    /// Value and ends of the interval.
    fn ends(&self) -> impl Iterator<Item = f64> {
        self.interval.into_iter().chain([self.value])
    }
}

/// The plot. A group in which every row has a nominal value other than 0 is laid out in percent of it.
pub(crate) fn forest(groups: &[Group]) -> Markup {
    let mut canvas = Canvas::new();
    let names = groups.iter().flat_map(|group| &group.rows).map(|row| width_of(&row.name) + 20.0);
    let left = names.fold(NAMES[0], f64::max).min(NAMES[1]);
    let mut y = 4.0;
    for group in groups {
        y = draw_group(&mut canvas, group, [left, y]);
    }
    canvas.finish([WIDTH, f64::max(y, 20.0)], "parameters with intervals")
}

/// Maps a row's values to its axis.
#[derive(Debug, Clone)]
enum Axis {
    /// Percent above the nominal value.
    Relative,
    /// A share, always from none to all.
    Share(Unit),
    /// The value itself.
    Absolute(Unit),
    /// The power of ten of a value that spans decades.
    Logarithmic(Unit),
}

impl Axis {
    fn of(group: &Group) -> Self {
        let relative = !group.rows.is_empty() && group.rows.iter().all(|row| row.nominal.is_some_and(|n| n != 0.0));
        let [lo, hi] = span(group.rows.iter().flat_map(Row::ends));
        match relative {
            true => Self::Relative,
            false if group.unit == "%" => Self::Share(unit(group)),
            false if lo > 0.0 && hi > DECADES * lo => Self::Logarithmic(unit(group)),
            false => Self::Absolute(unit(group)),
        }
    }

    fn place(&self, row: &Row, value: f64) -> f64 {
        match self {
            Self::Relative => 100.0 * (value / row.nominal.unwrap_or(1.0) - 1.0),
            Self::Share(unit) | Self::Absolute(unit) => unit.scaled(value),
            Self::Logarithmic(unit) => unit.scaled(value).log10(),
        }
    }

    /// The name of a tick at a place; none where it would be no round number.
    fn tick(&self, place: f64, name: String) -> Option<String> {
        match self {
            Self::Logarithmic(_) if place.fract() != 0.0 => None,
            Self::Logarithmic(_) => Some(short(10_f64.powf(place))),
            _ => Some(name),
        }
    }

    fn title(&self) -> String {
        match self {
            Self::Relative => "difference from cell.toml [%]".into(),
            Self::Share(unit) | Self::Absolute(unit) | Self::Logarithmic(unit) if unit.name().is_empty() => {
                String::new()
            }
            Self::Share(unit) | Self::Absolute(unit) | Self::Logarithmic(unit) => format!("[{}]", unit.name()),
        }
    }
}

fn unit(group: &Group) -> Unit {
    let [lo, hi] = span(group.rows.iter().flat_map(Row::ends));
    Unit::suited(group.unit, lo.abs().max(hi.abs()))
}

/// One group; where the next one begins.
fn draw_group(canvas: &mut Canvas, group: &Group, [left, top]: [f64; 2]) -> f64 {
    let (axis, unit) = (Axis::of(group), unit(group));
    let values = group.rows.iter().flat_map(|row| {
        row.interval.into_iter().chain([row.value]).chain(row.nominal).map(|value| axis.place(row, value))
    });
    let [lo, hi] = match &axis {
        Axis::Share(unit) => [unit.scaled(0.0), unit.scaled(1.0)],
        _ => {
            let [lo, hi] = span(values);
            let room = 0.06 * (hi - lo);
            [lo - room, hi + room]
        }
    };
    let scale = Scale::new([lo, hi], [left, END]);
    canvas.text_within("strong", [0.0, top + 14.0], Anchor::Start, group.name, left - 10.0);
    canvas.text("small", [0.5 * (left + END), top + 14.0], Anchor::Middle, &axis.title());
    let first = top + 22.0;
    let height = |row: &Row| if row.warning.is_some() { ROW + WARNING } else { ROW };
    let bottom = first + group.rows.iter().map(height).sum::<f64>();
    for (value, name) in scale.ticks(6).into_iter().filter_map(|(at, name)| Some((at, axis.tick(at, name)?))) {
        canvas.line("grid", [scale.at(value), first], [scale.at(value), bottom]);
        canvas.text("small", [scale.at(value), bottom + 14.0], Anchor::Middle, &name);
    }
    let mut y = first;
    for row in &group.rows {
        draw_row(canvas, row, (&axis, &unit, &scale), [left, y + 0.5 * ROW]);
        y += height(row);
    }
    bottom + 34.0
}

fn draw_row(canvas: &mut Canvas, row: &Row, (axis, unit, scale): (&Axis, &Unit, &Scale), [left, y]: [f64; 2]) {
    canvas.text_within("", [left - 12.0, y + 4.5], Anchor::End, &row.name, left - 14.0);
    let at = |value: f64| scale.at(axis.place(row, value));
    if let Some(nominal) = row.nominal {
        canvas.line("nominal", [at(nominal), y - 10.0], [at(nominal), y + 10.0]);
    }
    let [lo, hi] = row.interval;
    if lo.is_finite() && hi.is_finite() {
        canvas.line("whisker", [at(lo), y], [at(hi), y]);
    }
    let right = END + 16.0;
    let room = WIDTH - right;
    canvas.circle(if row.warning.is_some() { "hit" } else { "dot" }, [at(row.value), y], 4.5);
    let words = unit.interval(row.value, row.interval);
    canvas.text_within("", [right, y + 4.5], Anchor::Start, &words, room);
    if let Some(warning) = &row.warning {
        canvas.text_within("warn", [right, y + 19.0], Anchor::Start, &format!("\u{25b2} {warning}"), room);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::page::canvas::tests::assert_well_formed;

    fn row(value: f64, nominal: Option<f64>, warning: Option<&str>) -> Row {
        let interval = [value - 0.01 * value.abs(), value + 0.01 * value.abs()];
        Row { name: "joint 1".into(), value, interval, nominal, warning: warning.map(str::to_owned) }
    }

    #[test]
    fn gains_are_laid_out_in_percent_of_what_was_believed() {
        let rows = vec![row(660.0, Some(600.0), None), row(40.0, Some(50.0), Some("at its lower bound"))];
        let svg = forest(&[Group { name: "stiffness", unit: "N m/rad", rows }]).into_string();
        assert_well_formed(&svg);
        for text in ["difference from cell.toml [%]", "660 [653, 667] N m/rad", "\u{25b2} at its lower bound", ">-20<"]
        {
            assert!(svg.contains(text), "no {text} in {svg}");
        }
    }

    #[test]
    fn a_centre_of_mass_is_laid_out_in_millimetres() {
        let rows = vec![row(0.0051, Some(0.0), None), row(-0.002, Some(0.0), None)];
        let svg = forest(&[Group { name: "centre of mass", unit: "m", rows }]).into_string();
        assert_well_formed(&svg);
        assert!(svg.contains(">[mm]<") && svg.contains("5.10 [5.05, 5.15] mm"), "{svg}");
    }

    #[test]
    fn what_spans_decades_is_laid_out_by_powers_of_ten() {
        let rows = vec![row(3e4, None, None), row(2e7, None, None)];
        let svg = forest(&[Group { name: "stiffness", unit: "N m/rad", rows }]).into_string();
        assert_well_formed(&svg);
        assert!(svg.contains(">100000<") && svg.contains(">1\u{b7}10\u{2076}<"), "{svg}");
    }

    #[test]
    fn neither_long_words_nor_missing_intervals_break_the_plot() {
        let mut strange =
            row(1.0, None, Some("the arm is so much heavier than the object that nothing of its mass can be seen"));
        strange.name = "joint_elasticity.stiffness of the second joint".into();
        strange.interval = [f64::NAN, f64::INFINITY];
        let group = Group { name: "something with a very long name indeed", unit: "N m s/rad", rows: vec![strange] };
        assert_well_formed(&forest(&[group, Group { name: "none", unit: "1", rows: vec![] }]).into_string());
        assert_well_formed(&forest(&[]).into_string());
    }
}
