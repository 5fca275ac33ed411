//! Text tables: CSV, TSV, columns apart by semicolons or blanks; a line of names first, where there is one. Numbers, or lists of
//! them in brackets. Encodings, ends of lines and decimal signs are those of [`shared_mem::input`].
//!
//! | file | owns |
//! |---|---|
//! | `cells` | rows and names (the only csv code) |
//! | `echoed` | stamps as `rostopic echo -p` and `ros2 topic echo --csv` write them |
//! | `long` | tables with a row of each joint |
//! | `moments` | stamps that are written as dates or times of a day |

mod cells;
mod echoed;
mod long;
mod moments;

pub(super) use echoed::may_be_echoed;

use super::{libfranka, stem};
use crate::error::ImportError;
use crate::log::{Column, Log, Table};
use cells::{Cells, MOST_COLUMNS, is_missing};
use shared_mem::budget::{Budget, BudgetError};
use shared_mem::input::{self, Decimal, Encoding, InputError, Kind, Said, Text as Letters};
use shared_mem::recording::few_rows;
use std::collections::HashSet;
use std::path::Path;

/// Name of the only table of a file.
pub(super) const ROWS: &str = "rows";

/// What a column, or a word, takes beside its own bytes.
const OVERHEAD: usize = 96;

/// A table with the columns that hold words.
#[derive(Debug, Default)]
pub(super) struct Text {
    pub(super) columns: Vec<Column>,
    /// Name and cells.
    pub(super) words: Vec<(String, Vec<String>)>,
    /// Stamps that the form of the table gives [ns].
    stamps_ns: Option<Vec<u64>>,
    /// What was odd.
    pub(super) warnings: Vec<String>,
    /// Cells that are no numbers, and the first of them.
    bad: usize,
    first_bad: Option<String>,
}

pub(super) fn read(path: &Path, budget: &Budget) -> Result<Log, ImportError> {
    let mut table = text(path, budget)?;
    moments::take(&mut table);
    long::by_joint(&mut table);
    let Text { mut columns, stamps_ns, warnings, .. } = table;
    let franka = libfranka::recognise(&mut columns);
    Ok(Log {
        file: path.to_owned(),
        name: stem(path),
        format: if franka.is_some() { "libfranka log" } else { "text table" },
        tables: vec![Table { name: ROWS.into(), stamps_ns, columns }],
        facts: franka.unwrap_or_default(),
        warnings,
        ..Log::default()
    })
}

/// Reads a text table whole.
pub(super) fn text(path: &Path, budget: &Budget) -> Result<Text, ImportError> {
    let is_no_text = |what| InputError::NotText { path: path.to_owned(), what };
    let Letters { text, encoding } = input::decode(input::bytes(path, Kind::List)?).map_err(is_no_text)?;
    let mut table = parse(&text, budget).map_err(|refused| match refused {
        Refused::Table(what) => ImportError::log(path, what),
        Refused::Budget(over) => ImportError::budget(path)(over),
    })?;
    if encoding == Encoding::Windows1252 {
        let what = "it is no UTF-8, and read as Windows-1252 (Latin 1); where a name looks wrong, save it as UTF-8";
        table.warnings.push(what.into());
    }
    Ok(table)
}

/// A text is not read as a table.
#[derive(Debug)]
enum Refused {
    /// What is wrong with it.
    Table(String),
    /// It takes too much.
    Budget(BudgetError),
}

impl From<String> for Refused {
    fn from(what: String) -> Self {
        Self::Table(what)
    }
}

impl From<&str> for Refused {
    fn from(what: &str) -> Self {
        Self::Table(what.to_owned())
    }
}

impl From<BudgetError> for Refused {
    fn from(over: BudgetError) -> Self {
        Self::Budget(over)
    }
}

fn parse(text: &str, budget: &Budget) -> Result<Text, Refused> {
    let cells = Cells::read(text, budget)?;
    let mut out = Text { warnings: cells.warnings.clone(), ..Text::default() };
    let signs: Vec<Said<'_>> = (0..cells.width).map(|at| Said::by(column_of(&cells, at))).collect();
    let of_table =
        [Decimal::Comma, Decimal::Point].into_iter().find(|sign| signs.iter().any(|said| said.sign == Some(*sign)));
    budget.elements(cells.rows(), 3 * size_of::<u64>())?;
    out.stamps_ns = echoed::stamps(&cells, &mut out.warnings);
    for (at, said) in signs.iter().enumerate() {
        let name = match &cells.names {
            Some(names) => names.get(at).map_or("", String::as_str).trim_start_matches(['#', '%']).trim().to_owned(),
            None => format!("column[{}]", at + 1),
        };
        let sign = match (said.sign.or(of_table), said.either) {
            (Some(sign), _) => sign,
            (None, None) => Decimal::Point,
            (None, Some(cell)) => {
                let what = format!(
                    "holds `{cell}` in the column `{name}`, and nothing tells whether its comma is a decimal one; write decimal points, \
                     and no sign for thousands"
                );
                return Err(what.into());
            }
        };
        let column: Vec<&str> = column_of(&cells, at).collect();
        // There while the column is made.
        budget.elements(column.len(), 2 * size_of::<&str>())?;
        budget.give_back(column.len() * 2 * size_of::<&str>());
        self::column(&name, (&column, sign), &mut out, budget)?;
    }
    if let Some(first) = out.first_bad.take() {
        let others = if out.bad > 1 { format!(", as {} more cells are", out.bad - 1) } else { String::new() };
        out.warnings.push(format!("{first}, which is no number: it is left out{others}"));
    }
    distinguish(&mut out.columns);
    Ok(out)
}

fn column_of(cells: &Cells, at: usize) -> impl Iterator<Item = &str> {
    (0..cells.rows()).map(move |row| cells.at(row, at))
}

/// A column of numbers, of lists, or of words.
fn column(name: &str, (cells, sign): (&[&str], Decimal), out: &mut Text, budget: &Budget) -> Result<(), Refused> {
    let Some(first) = cells.iter().find(|cell| !is_missing(cell)) else { return Ok(()) };
    if first.starts_with(['[', '(']) {
        return lists(name, cells, out, budget);
    }
    let number = |cell: &&str| if is_missing(cell) { Some(f64::NAN) } else { sign.number(cell) };
    let numbers: Vec<Option<f64>> = cells.iter().map(number).collect();
    let good = numbers.iter().flatten().filter(|number| number.is_finite()).count();
    // A column of words has no numbers; one of numbers with a word in it is damaged.
    if good * 2 < cells.len() && numbers.iter().any(Option::is_none) {
        budget.elements(cells.len(), size_of::<String>())?;
        budget.take(cells.iter().map(|cell| cell.len()).sum())?;
        out.words.push((name.to_owned(), cells.iter().map(|&cell| cell.to_owned()).collect()));
        return Ok(());
    }
    let bad = numbers.iter().filter(|number| number.is_none()).count();
    if let Some(row) = numbers.iter().position(Option::is_none) {
        let first = wrong(name, row, cells.get(row).unwrap_or(&""));
        if bad > few_rows(cells.len()) {
            return Err(format!("{first}, which is no number; mend that row or leave it out").into());
        }
        out.first_bad.get_or_insert(first);
        out.bad += bad;
    }
    budget.elements(cells.len(), size_of::<f64>())?;
    budget.take(name.len() + OVERHEAD)?;
    let values = numbers.into_iter().map(|number| number.unwrap_or(f64::NAN)).collect();
    out.columns.push(Column { name: name.to_owned(), values });
    Ok(())
}

/// The columns of a column whose cells are lists of numbers, all of one length.
fn lists(name: &str, cells: &[&str], out: &mut Text, budget: &Budget) -> Result<(), Refused> {
    let mut columns: Vec<Column> = Vec::new();
    for (row, cell) in cells.iter().enumerate() {
        let refused = |cell: &str| format!("{}; mend that row or leave it out", wrong(name, row, cell));
        let numbers = inside(cell).ok_or_else(|| refused(cell))?;
        if row == 0 {
            let width = numbers.clone().count();
            if out.columns.len() + width > MOST_COLUMNS {
                let what = format!(
                    "holds lists of {width} numbers in the column `{name}`, and a log has at most {MOST_COLUMNS}; leave that column out"
                );
                return Err(what.into());
            }
            budget.elements(width, name.len() + OVERHEAD)?;
            columns = (0..width).map(|i| Column { name: format!("{name}[{i}]"), values: Vec::new() }).collect();
        }
        budget.elements(columns.len(), size_of::<f64>())?;
        let mut filled = 0;
        for number in numbers {
            let value = number.parse().map_err(|_| refused(cell))?;
            let column = columns.get_mut(filled).ok_or_else(|| refused(OTHER_LENGTH))?;
            column.values.push(value);
            filled += 1;
        }
        if filled != columns.len() {
            return Err(refused(OTHER_LENGTH).into());
        }
    }
    out.columns.extend(columns);
    Ok(())
}

/// What stands in a cell whose list is longer or shorter than the first.
const OTHER_LENGTH: &str = "a list of another length";

fn wrong(name: &str, row: usize, cell: &str) -> String {
    let cell: String = cell.chars().take(40).collect();
    format!("row {} holds `{cell}` in the column `{name}`", row + 1)
}

/// The numbers of a list in brackets, as they are written.
fn inside(cell: &str) -> Option<impl Iterator<Item = &str> + Clone> {
    let inside = cell.strip_prefix(['[', '('])?.strip_suffix([']', ')'])?;
    Some(inside.split([',', ' ', ';']).map(str::trim).filter(|number| !number.is_empty()))
}

/// A name that stands twice gets the number of its place.
fn distinguish(columns: &mut [Column]) {
    let mut before = HashSet::new();
    for column in columns {
        if before.contains(&column.name) {
            column.name = format!("again.{}", column.name);
        }
        before.insert(column.name.clone());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn parse(text: &str) -> Result<Text, String> {
        super::parse(text, &Budget::of(text.len() as u64)).map_err(|refused| match refused {
            Refused::Table(what) => what,
            Refused::Budget(over) => over.to_string(),
        })
    }

    fn names(text: &Text) -> Vec<&str> {
        text.columns.iter().map(|column| column.name.as_str()).collect()
    }

    #[test]
    fn commas_tabs_semicolons_and_blanks_part_columns() {
        for text in ["t,q1\n0,1\n0.1,2\n", "t\tq1\n0\t1\n0.1\t2\n", "t; q1\n0; 1\n0.1; 2\n", "# t q1\n 0  1\n0.1 2\n"] {
            let found = parse(text).expect("a table");
            assert_eq!(names(&found), ["t", "q1"], "{text}");
            assert_eq!(found.columns[1].values, [1.0, 2.0]);
        }
    }

    #[test]
    fn lists_words_and_missing_names_are_understood() {
        let found = parse("type,timestamp,positions\nCONTROL,1.5,\"[0.1, -2e-3]\"\nCONTROL,2.5,\"[0.2, 0]\"\n")
            .expect("a table");
        assert_eq!(names(&found), ["timestamp", "positions[0]", "positions[1]"]);
        assert_eq!(found.words[0].0, "type");
        assert_eq!(names(&parse("0,1\n1,2\n").expect("a table")), ["column[1]", "column[2]"]);
        assert_eq!(names(&parse("q,q\n1,2\n").expect("a table")), ["q", "again.q"]);
    }

    #[test]
    fn what_was_cut_or_changed_is_told_in_a_line() {
        for (text, told) in [
            ("t,q\n0,1", "ends within a line"),
            ("t,q\n0,1\n1\n", "line 3 has 1 columns"),
            ("t,q\n0,1\n1,2x\n2,3\n", "row 2 holds `2x`"),
            ("t,q\n", "no row"),
            ("t,\"q\n0,1\n", "holds"),
            ("q\n\"[1,2]\"\n\"[1]\"\n", "row 2 holds `a list of another length`"),
            ("q\n\"[1,2]\"\n\"[1,2,3]\"\n", "row 2 holds `a list of another length`"),
        ] {
            let what = parse(text).err().unwrap_or_else(|| panic!("{text}"));
            assert!(what.contains(told) && !what.contains('\n'), "{what}");
        }
    }

    #[test]
    fn names_stand_above_numbers_or_in_a_remark_and_words_in_rows_are_none() {
        // As `rostopic echo -p` prints a topic.
        let text = "%time,field.header.stamp,field.name0,field.position0\n".to_owned()
            + &(0..250_u64).map(|k| format!("{},{},arm,0.5\n", k * 10 + 13, k * 10)).collect::<String>();
        let found = parse(&text).expect("a table");
        assert_eq!(names(&found), ["time", "field.header.stamp", "field.position0"]);
        let stamps = found.stamps_ns.expect("stamps");
        assert_eq!((stamps.len(), stamps[3]), (250, 30), "the message's own");
        // As `ros2 topic echo --csv` does: without names, and no row is lost.
        let row = |k: u64| format!("{},{},,arm,{}\n", 1_700_000_000 + k / 100, k % 100 * 10_000_000, 0.5 + k as f64);
        let found = parse(&(0..250).map(row).collect::<String>()).expect("a table");
        assert_eq!(names(&found), ["column[1]", "column[2]", "column[5]"]);
        assert_eq!(
            found.stamps_ns.as_ref().map(|stamps| (stamps.len(), stamps[101])),
            Some((250, 1_700_000_001_010_000_000))
        );
        assert!(found.warnings[0].contains("`column[1]` and `column[2]` are seconds and nanoseconds"));
        assert_eq!(found.words[0].0, "column[4]");
        // A counter beside counts is no clock.
        let counts: String = (0..50).map(|k| format!("{k},{},0.5\n", 5_000_000 + k)).collect();
        assert_eq!(parse(&counts).expect("a table").stamps_ns, None);
        for (text, columns) in [
            ("# a run of Monday\n#\n# t,q1\n0,1\n1,2\n", ["t", "q1"]),
            ("% t q1\n0 1\n1 2\n", ["t", "q1"]),
            ("t,q1\n# in between\n0,1\n1,2\n", ["t", "q1"]),
            ("t,q1\ns,rad\n0,1\n1,2\n", ["t [s]", "q1 [rad]"]),
            ("time,1\n0,1\n1,2\n", ["time", "1"]),
            ("t,q1,\n0,1,\n1,2,\n", ["t", "q1"]),
            ("t;q1\n0,0;1\n1,5;2\n", ["t", "q1"]),
        ] {
            let found = parse(text).unwrap_or_else(|what| panic!("{text}: {what}"));
            assert_eq!(names(&found), columns, "{text}");
            assert_eq!(found.columns[1].values, [1.0, 2.0], "{text}");
        }
    }

    #[test]
    fn decimal_signs_are_those_of_the_column_and_else_of_the_table() {
        let values = |text: &str| -> Vec<Vec<f64>> {
            let found = parse(text).unwrap_or_else(|what| panic!("{text}: {what}"));
            found.columns.into_iter().map(|column| column.values).collect()
        };
        assert_eq!(values("t;q\n0,5;1.234,5\n1,0;-0,25\n"), [vec![0.5, 1.0], vec![1234.5, -0.25]]);
        assert_eq!(values("t,q\n0.5,\"1,234\"\n1.5,\"2,345.5\"\n"), [vec![0.5, 1.5], vec![1234.0, 2345.5]]);
        assert_eq!(values("0,000;0,1\n0,010;0,2\n"), [vec![0.0, 0.01], vec![0.1, 0.2]], "no names");
        assert_eq!(values("0,000 0,1\n0,010 0,2\n"), [vec![0.0, 0.01], vec![0.1, 0.2]], "blanks");
        // Another column says that commas are decimal signs.
        assert_eq!(values("t;q\n0,5;1,234\n1,0;2,345\n"), [vec![0.5, 1.0], vec![1.234, 2.345]]);
        let what = parse("t;q\n1;1,234\n2;2,345\n").expect_err("it may be either");
        assert!(what.contains("`1,234` in the column `q`"), "{what}");
        assert!(values("t;q\n0,5;NA\n1,0;2\n")[1][0].is_nan());
        // Commas between columns and in numbers.
        let what = parse("t,q\n0,5,1,5\n1,5,2,5\n2,5,3,5\n").expect_err("no columns");
        assert!(what.contains("part the columns with `;`"), "{what}");
    }

    #[test]
    fn few_bad_rows_are_left_out_and_said() {
        let rows = |odd: &'static str| {
            (0..100).map(move |k| if k == 50 { format!("{odd}\n") } else { format!("{k},{k}.5\n") })
        };
        for (odd, words) in [("50", "line 52 has 1 columns, the others have 2: 1 of 101"), ("50,x", "row 51 holds `x`")]
        {
            let found = parse(&("t,q\n".to_owned() + &rows(odd).collect::<String>())).expect("a table");
            assert!(found.warnings.len() == 1 && found.warnings[0].contains(words), "{:?}", found.warnings);
        }
        // A quotation mark that is never closed takes the rest of the file along.
        let open = "t,q\n".to_owned() + &rows("50,\"x").collect::<String>();
        assert!(parse(&open).is_err());
        let cut = parse("t,q\n0,1\n1,2").expect("a table");
        assert!(cut.columns[0].values == [0.0] && cut.warnings[0].contains("has no end"), "{:?}", cut.warnings);
    }

    #[test]
    fn more_columns_than_any_log_has_are_refused_and_as_many_are_read() {
        let of = |count: usize| format!("{}\n{}\n", "c,".repeat(count - 1) + "c", "1,".repeat(count - 1) + "1");
        assert_eq!(parse(&of(MOST_COLUMNS)).expect("a table").columns.len(), MOST_COLUMNS);
        let what = parse(&of(MOST_COLUMNS + 1)).expect_err("too many");
        assert!(what.contains("100001 columns"), "{what}");
        let list = format!("t,q\n0,\"[{}]\"\n", "1,".repeat(MOST_COLUMNS + 1));
        let what = parse(&list).expect_err("too many");
        assert!(what.contains("lists of 100001 numbers in the column `q`"), "{what}");
    }

    #[test]
    fn what_a_table_becomes_is_drawn_before_it_is_there() {
        let text = "t,word\n0,a\n1,b\n2,c\n";
        let spent = super::parse(text, &Budget::with(200, 1000)).expect_err("too little");
        assert!(matches!(spent, Refused::Budget(BudgetError::Memory(200))), "{spent:?}");
        super::parse(text, &Budget::with(2000, 1000)).expect("a table");
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in "[ -~\n\t]{0,200}") {
            let _ = parse(&text);
        }
    }
}
