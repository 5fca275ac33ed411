//! Where a table's stamps are, and in which unit.

use super::Notes;
use super::follow;
use super::track::Track;
use crate::log::{Column, HEADER, Log, Table};
use crate::mapping::{JointColumns, TimeUnit};
use crate::naming;
use shared_mem::statistics::median;

/// Rows of a robot's log come between these rates [Hz]; a thousand apart, so that one unit alone fits.
const SLOWEST: f64 = 4.0;
const FASTEST: f64 = 4000.0;
/// Steps of a clock differ by less than this share of the one in the middle, but for one in ten.
const SAME_STEP: f64 = 0.25;
/// So many steps show that they are the same.
const FEWEST_STEPS: usize = 20;
/// Rates at which robots are logged [Hz], and how near one has to be [1].
const USUAL_RATES: [f64; 18] = [
    10.0, 15.0, 20.0, 25.0, 30.0, 40.0, 50.0, 60.0, 100.0, 120.0, 125.0, 200.0, 240.0, 250.0, 400.0, 500.0, 800.0,
    1000.0,
];
const NEAR_RATE: f64 = 0.02;
const UNITS: [(TimeUnit, &str); 4] = [
    (TimeUnit::Second, "seconds"),
    (TimeUnit::Millisecond, "milliseconds"),
    (TimeUnit::Microsecond, "microseconds"),
    (TimeUnit::Nanosecond, "nanoseconds"),
];

/// The stamps of a table.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Clock {
    pub(super) stamps: Option<String>,
    pub(super) unit: TimeUnit,
    pub(super) rate: Option<f64>,
}

pub(super) fn choose(log: &Log, table: &Table, block: &str, notes: &mut Notes) -> Clock {
    if table.stamps_ns.is_some() {
        if let Some(why) = &log.facts.two_columns {
            notes.why(&format!("{block}.stamps"), why.clone());
        }
        if let Some(rate) = log.facts.rate {
            notes.why(&format!("{block}.stamps"), format!("the data set says {rate} rows a second"));
        }
        return Clock { stamps: Some(HEADER.into()), ..Clock::default() };
    }
    let Some(column) = column(table) else {
        let question = match table.columns.iter().find_map(|column| Some((column, repeated(column)?))) {
            Some((column, count)) => format!(
                "`{}` gives {count} of {} rows the stamp of the row before: how many rows a second?",
                column.name,
                table.rows()
            ),
            None => "the log has no stamps: how many rows a second?".to_owned(),
        };
        notes.open(&format!("{block}.rate"), question);
        return Clock::default();
    };
    if counts(log, column) {
        let question = format!(
            "`{}` counts 0, 1, 2: of milliseconds, or of rows? How many rows a second: 1000 where it is milliseconds",
            column.name
        );
        notes.open(&format!("{block}.rate"), question);
        return Clock::default();
    }
    if !naming::is_time(&column.name) {
        let why = format!("`{}` rises by the same in every row, as a clock does and no joint", column.name);
        notes.why(&format!("{block}.stamps"), why);
    }
    let line = format!("{block}.stamp_unit");
    let (unit, why) = unit(log, &column.name, &column.values);
    notes.why(&line, why);
    Clock { stamps: Some(column.name.clone()), unit, rate: None }
}

/// Whether a table has no stamps at all.
pub(super) fn is_missing(log: &Log, table: &Table) -> bool {
    table.stamps_ns.is_none() && column(table).is_none_or(|column| counts(log, column))
}

/// Whether a column counts from 0 or 1 on, one a row, and does not say what: rows, or milliseconds.
fn counts(log: &Log, column: &Column) -> bool {
    let starts = column.values.first().is_some_and(|first| *first == 0.0 || *first == 1.0);
    let says = log.facts.stamp_unit.is_some() || naming::time_unit(&column.name).is_some();
    starts && !says && column.values.windows(2).all(|w| w[1] - w[0] == 1.0)
}

/// Rows a second of a table whose stamps count rows, by velocities that are the slope of the positions; the question is then answered.
pub(super) fn by_slope(table: &Table, columns: &JointColumns, notes: &mut Notes) -> Option<f64> {
    let name = &column(table).filter(|_| columns.stamps.is_none() && columns.rate.is_none())?.name;
    let track = Track::of(table, &JointColumns { rate: Some(1.0), ..columns.clone() })?;
    if track.dq.is_empty() || !follow::is_slope(&track) {
        return None;
    }
    let (mut product, mut square) = (0.0, 0.0);
    for (joint, dq) in track.dq.iter().enumerate() {
        for (slope, dq) in track.slopes(joint).iter().zip(dq).filter(|(s, v)| s.is_finite() && v.is_finite()) {
            product += slope * dq;
            square += slope * slope;
        }
    }
    let rate = product / square;
    let usual = USUAL_RATES.into_iter().find(|usual| (rate / usual - 1.0).abs() < NEAR_RATE)?;
    notes.0.retain(|note| !(note.open && note.line.ends_with(".rate")));
    notes.why(
        "measured.rate",
        format!("`{name}` counts rows: the velocities are the slope of the positions at {rate:.1} rows a second"),
    );
    Some(usual)
}

/// The column of stamps: named so and rising, or, where none is, the only one that rises by the same in every row.
fn column(table: &Table) -> Option<&Column> {
    let rises = |values: &[f64]| {
        values.len() > 1 && values.windows(2).filter(|w| w[1] > w[0]).count() * 10 >= 9 * (values.len() - 1)
    };
    let named = table.columns.iter().filter(|column| naming::is_time(&column.name) && rises(&column.values));
    // When it was measured counts, and not when it was written down.
    let is_header = |name: &str| naming::words(name).windows(2).any(|pair| pair == ["header", "stamp"]);
    named.min_by_key(|column| (!is_header(&column.name), naming::words(&column.name).len())).or_else(|| ticking(table))
}

/// How many rows of a column of stamps have that of the row before, where it never falls.
fn repeated(column: &Column) -> Option<usize> {
    let falls = column.values.windows(2).any(|w| w[1] < w[0]);
    let count = column.values.windows(2).filter(|w| w[1] == w[0]).count();
    let rises = column.values.last() > column.values.first();
    (naming::is_time(&column.name) && !falls && rises && count > 0).then_some(count)
}

/// The only column that rises by the same in every row, counts no rows and has no others of its kind: a joint that turns at one speed
/// stands among joints.
fn ticking(table: &Table) -> Option<&Column> {
    let ticks = |column: &&Column| {
        let steps: Vec<f64> = column.values.windows(2).map(|w| w[1] - w[0]).collect();
        let middle = median(steps.iter().copied()).unwrap_or(0.0);
        let equal = steps.iter().filter(|step| (*step - middle).abs() < SAME_STEP * middle).count();
        let counts = middle == 1.0 && steps.iter().all(|step| step.fract() == 0.0);
        steps.len() >= FEWEST_STEPS
            && steps.first().is_some_and(|step| *step > 0.0)
            && 10 * equal >= 9 * steps.len()
            && !counts
    };
    let mut ticking = table.columns.iter().filter(ticks);
    let only = ticking.next().filter(|_| ticking.next().is_none())?;
    let is_named = |group: &naming::Group| group.names.contains(&only.name) && !group.base.starts_with("column");
    let groups = naming::groups(table);
    let own = groups.iter().find(|group| is_named(group));
    own.is_none_or(|group| group.names.len() == 1).then_some(only)
}

fn unit(log: &Log, name: &str, values: &[f64]) -> (TimeUnit, String) {
    let of = |seconds: f64| {
        UNITS.iter().find(|(unit, _)| (unit.seconds() - seconds).abs() < 1e-3 * seconds).map(|(unit, _)| *unit)
    };
    if let Some((seconds, why)) = log.facts.stamp_unit
        && let Some(unit) = of(seconds)
    {
        return (unit, why.to_owned());
    }
    if let Some(unit) = naming::time_unit(name).and_then(of) {
        return (unit, format!("`{name}` names its unit"));
    }
    let step = median(values.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0)).unwrap_or(f64::NAN);
    // As many digits as a person reads: differences of decimal numbers end in rounding.
    let step = format!("{step:.5e}").parse().unwrap_or(step);
    let fits = |(unit, _): &&(TimeUnit, &str)| (SLOWEST..FASTEST).contains(&(1.0 / (step * unit.seconds())));
    match UNITS.iter().find(fits) {
        Some((unit, word)) => {
            let rate = 1.0 / (step * unit.seconds());
            (*unit, format!("`{name}` rises by {step} a row: {rate:.0} rows a second in {word}"))
        }
        None => {
            (TimeUnit::Second, format!("`{name}` rises by {step} a row, which fits no unit of a robot's log: check it"))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_milli_micro_and_nanoseconds_are_told_by_the_rate_they_give() {
        for (step, expected) in [
            (0.001, TimeUnit::Second),
            (0.02, TimeUnit::Second),
            (1.0, TimeUnit::Millisecond),
            (33.3, TimeUnit::Millisecond),
            (20_000.0, TimeUnit::Microsecond),
            (5e6, TimeUnit::Nanosecond),
        ] {
            let values: Vec<f64> = (0..100).map(|i| 1e3 + f64::from(i) * step).collect();
            let table = Table { columns: vec![Column { name: "t".into(), values }], ..Table::default() };
            let mut notes = Notes::default();
            let clock = choose(&Log::default(), &table, "measured", &mut notes);
            assert_eq!((clock.stamps.as_deref(), clock.unit), (Some("t"), expected), "{step}");
            assert!(notes.0[0].why.contains("rows a second in"), "{:?}", notes.0);
        }
        let clock = Column { name: "Zeit [s]".into(), values: (0..100).map(|i| 0.01 * f64::from(i)).collect() };
        let sine = Column { name: "q1".into(), values: (0..100).map(|i| (0.1 * f64::from(i)).sin()).collect() };
        let row = Column { name: "row".into(), values: (0..100).map(f64::from).collect() };
        let mut table = Table { columns: vec![row, sine, clock], ..Table::default() };
        let mut notes = Notes::default();
        let found = choose(&Log::default(), &table, "measured", &mut notes);
        assert_eq!((found.stamps.as_deref(), found.unit), (Some("Zeit [s]"), TimeUnit::Second), "{:?}", notes.0);
        table.columns.pop();
        let twice = Column { name: "time".into(), values: (0..100).map(|i| f64::from(i / 2)).collect() };
        let coarse = Table { columns: vec![twice], ..Table::default() };
        let mut notes = Notes::default();
        choose(&Log::default(), &coarse, "measured", &mut notes);
        assert!(notes.0[0].why.contains("`time` gives 50 of 100 rows"), "{:?}", notes.0);
        assert!(is_missing(&Log::default(), &table), "a counter of rows is no clock");
        let mut notes = Notes::default();
        choose(&Log::default(), &Table::default(), "measured", &mut notes);
        assert!(notes.0[0].open && notes.0[0].line == "measured.rate");
    }
}
