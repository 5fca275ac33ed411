//! Text tables: CSV, TSV, columns apart by semicolons or blanks; a line of names first. Numbers, or lists of them in brackets.

use super::{libfranka, stem};
use crate::error::ImportError;
use crate::log::{Column, Log, Table};
use shared_mem::budget::{Budget, BudgetError};
use shared_mem::input::{self, Kind};
use std::collections::HashSet;
use std::path::Path;

/// Name of the only table of a file.
pub(super) const ROWS: &str = "rows";

/// More columns than any log has: the names of a thousand robots' joints are fewer.
const MOST_COLUMNS: usize = 100_000;
/// What a column, or a word, takes beside its own bytes.
const OVERHEAD: usize = 96;

/// A table with the columns that hold words.
pub(super) struct Text {
    pub(super) columns: Vec<Column>,
    /// Name and cells.
    pub(super) words: Vec<(String, Vec<String>)>,
}

pub(super) fn read(path: &Path, budget: &Budget) -> Result<Log, ImportError> {
    let mut columns = text(path, budget)?.columns;
    let franka = libfranka::recognise(&mut columns);
    Ok(Log {
        file: path.to_owned(),
        name: stem(path),
        format: if franka.is_some() { "libfranka log" } else { "text table" },
        tables: vec![Table { name: ROWS.into(), stamps_ns: None, columns }],
        facts: franka.unwrap_or_default(),
        ..Log::default()
    })
}

/// Reads a text table whole.
pub(super) fn text(path: &Path, budget: &Budget) -> Result<Text, ImportError> {
    let bytes = input::text(path, Kind::List)?;
    parse(&bytes, budget).map_err(|refused| match refused {
        Refused::Table(what) => ImportError::log(path, what),
        Refused::Budget(over) => ImportError::budget(path)(over),
    })
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

/// The cells of a table, row by row, one text and where each of them ends in it.
struct Cells {
    text: String,
    ends: Vec<usize>,
    width: usize,
}

impl Cells {
    fn read(text: &str, delimiter: u8, budget: &Budget) -> Result<Self, Refused> {
        let mut reader = csv::ReaderBuilder::new()
            .delimiter(delimiter)
            .has_headers(false)
            .trim(csv::Trim::All)
            .comment(Some(b'%'))
            .from_reader(text.as_bytes());
        let mut cells = Self { text: String::new(), ends: Vec::new(), width: 0 };
        let mut record = csv::StringRecord::new();
        let cut = |error: csv::Error| format!("{}; cut it to its whole lines with `head -n`", error_line(&error));
        while reader.read_record(&mut record).map_err(cut)? {
            cells.width = record.len();
            if cells.width > MOST_COLUMNS {
                let what = format!(
                    "has {} columns, a log at most {MOST_COLUMNS}; leave out what is not the robot's",
                    cells.width
                );
                return Err(what.into());
            }
            budget.elements(record.len(), size_of::<usize>())?;
            budget.take(record.as_slice().len())?;
            for cell in &record {
                cells.text += cell;
                cells.ends.push(cells.text.len());
            }
        }
        Ok(cells)
    }

    fn rows(&self) -> usize {
        self.ends.len().checked_div(self.width).unwrap_or(0)
    }

    fn at(&self, row: usize, column: usize) -> &str {
        let number = row * self.width + column;
        let begin = number.checked_sub(1).and_then(|before| self.ends.get(before)).copied().unwrap_or(0);
        self.ends.get(number).and_then(|end| self.text.get(begin..*end)).unwrap_or("")
    }
}

fn parse(text: &str, budget: &Budget) -> Result<Text, Refused> {
    let text = text.trim_start_matches('\u{feff}');
    if !text.ends_with('\n') {
        return Err("ends within a line, as a log that was cut; if it is whole, end it with `echo >> FILE`".into());
    }
    let first = text.lines().find(|line| !line.trim().is_empty()).ok_or("holds no line")?;
    let delimiter = delimiter(first);
    let cells = if delimiter == b' ' {
        budget.take(text.len())?;
        Cells::read(&blanks(text), delimiter, budget)?
    } else {
        Cells::read(text, delimiter, budget)?
    };
    if cells.rows() == 0 {
        return Err("holds no line".into());
    }
    // `# a b c` names columns, too.
    let first = || (0..cells.width).map(|column| cells.at(0, column));
    let unnamed = first().all(|cell| cell.is_empty() || cell.parse::<f64>().is_ok());
    let (names, begin): (Vec<String>, usize) = if unnamed {
        ((1..=cells.width).map(|n| format!("column[{n}]")).collect(), 0)
    } else {
        (first().map(|cell| cell.trim_start_matches('#').trim().to_owned()).collect(), 1)
    };
    if cells.rows() == begin {
        return Err("holds names of columns and no row".into());
    }
    let mut out = Text { columns: Vec::new(), words: Vec::new() };
    for (at, name) in names.iter().enumerate() {
        let column: Vec<&str> = (begin..cells.rows()).map(|row| cells.at(row, at)).collect();
        // There while the column is made.
        budget.elements(column.len(), 2 * size_of::<&str>())?;
        budget.give_back(column.len() * 2 * size_of::<&str>());
        self::column(name, &column, &mut out, budget)?;
    }
    distinguish(&mut out.columns);
    Ok(out)
}

/// A column of numbers, of lists, or of words.
fn column(name: &str, cells: &[&str], out: &mut Text, budget: &Budget) -> Result<(), Refused> {
    let Some(first) = cells.iter().find(|cell| !cell.is_empty()) else { return Ok(()) };
    if first.starts_with(['[', '(']) {
        return lists(name, cells, out, budget);
    }
    let numbers: Vec<Option<f64>> =
        cells.iter().map(|cell| if cell.is_empty() { Some(f64::NAN) } else { cell.parse().ok() }).collect();
    let good = numbers.iter().flatten().filter(|number| number.is_finite()).count();
    // A column of words has no numbers; one of numbers with a word in it is damaged.
    if good * 2 < cells.len() && numbers.iter().any(Option::is_none) {
        budget.elements(cells.len(), size_of::<String>())?;
        budget.take(cells.iter().map(|cell| cell.len()).sum())?;
        out.words.push((name.to_owned(), cells.iter().map(|&cell| cell.to_owned()).collect()));
        return Ok(());
    }
    if let Some(row) = numbers.iter().position(Option::is_none) {
        return Err(wrong(name, row, cells.get(row).unwrap_or(&"")).into());
    }
    budget.elements(cells.len(), size_of::<f64>())?;
    budget.take(name.len() + OVERHEAD)?;
    out.columns.push(Column { name: name.to_owned(), values: numbers.into_iter().flatten().collect() });
    Ok(())
}

/// The columns of a column whose cells are lists of numbers, all of one length.
fn lists(name: &str, cells: &[&str], out: &mut Text, budget: &Budget) -> Result<(), Refused> {
    let mut columns: Vec<Column> = Vec::new();
    for (row, cell) in cells.iter().enumerate() {
        let numbers = inside(cell).ok_or_else(|| wrong(name, row, cell))?;
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
            let value = number.parse().map_err(|_| wrong(name, row, cell))?;
            let column = columns.get_mut(filled).ok_or_else(|| wrong(name, row, OTHER_LENGTH))?;
            column.values.push(value);
            filled += 1;
        }
        if filled != columns.len() {
            return Err(wrong(name, row, OTHER_LENGTH).into());
        }
    }
    out.columns.extend(columns);
    Ok(())
}

/// What stands in a cell whose list is longer or shorter than the first.
const OTHER_LENGTH: &str = "a list of another length";

fn wrong(name: &str, row: usize, cell: &str) -> String {
    let cell: String = cell.chars().take(40).collect();
    format!("row {} holds `{cell}` in the column `{name}`, which is no number; mend that row or leave it out", row + 1)
}

/// The numbers of a list in brackets, as they are written.
fn inside(cell: &str) -> Option<impl Iterator<Item = &str> + Clone> {
    let inside = cell.strip_prefix(['[', '('])?.strip_suffix([']', ')'])?;
    Some(inside.split([',', ' ', ';']).map(str::trim).filter(|number| !number.is_empty()))
}

fn delimiter(line: &str) -> u8 {
    // Commas within brackets part the numbers of a list.
    let mut depth = 0_i32;
    let mut counts = [0; 3];
    for c in line.chars() {
        depth += i32::from(c == '[' || c == '(') - i32::from(c == ']' || c == ')');
        if let Some(at) = [',', '\t', ';'].iter().position(|d| *d == c && depth == 0) {
            counts[at] += 1;
        }
    }
    let best = (0..3).max_by_key(|at| counts[*at]).filter(|at| counts[*at] > 0);
    best.map_or(b' ', |at| b",\t;"[at])
}

/// One blank between the words of a line.
fn blanks(text: &str) -> String {
    let line = |line: &str| {
        let line = line.trim_start().strip_prefix('#').unwrap_or(line);
        line.split_whitespace().collect::<Vec<_>>().join(" ")
    };
    text.lines().map(line).filter(|line| !line.is_empty()).fold(String::new(), |all, line| all + &line + "\n")
}

/// What is wrong, without the library's own words about its records.
fn error_line(error: &csv::Error) -> String {
    match error.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let line = pos.as_ref().map_or(0, csv::Position::line);
            format!("line {line} has {len} columns, the others have {expected_len}: it is cut or damaged")
        }
        other => format!("{other:?}: it is damaged"),
    }
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
            ("t,q\n0,1\n1,2", "ends within a line"),
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
    fn more_columns_than_any_log_has_are_refused_and_as_many_are_read() {
        let of = |count: usize| format!("{}\n{}\n", "c,".repeat(count - 1) + "c", "1,".repeat(count - 1) + "1");
        assert_eq!(parse(&of(MOST_COLUMNS)).expect("a table").columns.len(), MOST_COLUMNS);
        let what = parse(&of(MOST_COLUMNS + 1)).err().expect("too many");
        assert!(what.contains("100001 columns"), "{what}");
        let list = format!("t,q\n0,\"[{}]\"\n", "1,".repeat(MOST_COLUMNS + 1));
        let what = parse(&list).err().expect("too many");
        assert!(what.contains("lists of 100001 numbers in the column `q`"), "{what}");
    }

    #[test]
    fn what_a_table_becomes_is_drawn_before_it_is_there() {
        let text = "t,word\n0,a\n1,b\n2,c\n";
        let spent = super::parse(text, &Budget::with(200, 1000)).err().expect("too little");
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
