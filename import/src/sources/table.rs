//! Text tables: CSV, TSV, columns apart by semicolons or blanks; a line of names first. Numbers, or lists of them in brackets.

use super::{go_on, libfranka, stem};
use crate::error::ImportError;
use crate::log::{Column, Log, Table};
use shared_mem::input::{self, Kind};
use std::path::Path;

/// Name of the only table of a file.
pub(super) const ROWS: &str = "rows";

/// A table with the columns that hold words.
pub(super) struct Text {
    pub(super) columns: Vec<Column>,
    /// Name and cells.
    pub(super) words: Vec<(String, Vec<String>)>,
}

pub(super) fn read(path: &Path) -> Result<Log, ImportError> {
    let mut columns = text(path)?.columns;
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
pub(super) fn text(path: &Path) -> Result<Text, ImportError> {
    let bytes = input::text(path, Kind::List)?;
    go_on(path)?;
    parse(&bytes).map_err(|what| ImportError::log(path, what))
}

fn parse(text: &str) -> Result<Text, String> {
    let text = text.trim_start_matches('\u{feff}');
    if !text.ends_with('\n') {
        return Err("ends within a line, as a log that was cut; if it is whole, end it with `echo >> FILE`".into());
    }
    let first = text.lines().find(|line| !line.trim().is_empty()).ok_or("holds no line")?;
    let delimiter = delimiter(first);
    let cleaned = if delimiter == b' ' { blanks(text) } else { text.to_owned() };
    let mut reader = csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .has_headers(false)
        .trim(csv::Trim::All)
        .comment(Some(b'%'))
        .from_reader(cleaned.as_bytes());
    let mut records = Vec::new();
    for record in reader.records() {
        records
            .push(record.map_err(|error| format!("{}; cut it to its whole lines with `head -n`", error_line(&error)))?);
    }
    let Some((first, rest)) = records.split_first() else { return Err("holds no line".into()) };
    // `# a b c` names columns, too.
    let unnamed = first.iter().all(|cell| cell.is_empty() || cell.parse::<f64>().is_ok());
    let (names, rows): (Vec<String>, &[csv::StringRecord]) = if unnamed {
        ((1..=first.len()).map(|n| format!("column[{n}]")).collect(), &records)
    } else {
        (first.iter().map(|cell| cell.trim_start_matches('#').trim().to_owned()).collect(), rest)
    };
    if rows.is_empty() {
        return Err("holds names of columns and no row".into());
    }
    let mut out = Text { columns: Vec::new(), words: Vec::new() };
    for (at, name) in names.iter().enumerate() {
        column(name, at, rows, &mut out)?;
    }
    distinguish(&mut out.columns);
    Ok(out)
}

/// A column of numbers, of lists, or of words.
fn column(name: &str, at: usize, rows: &[csv::StringRecord], out: &mut Text) -> Result<(), String> {
    let cells = || rows.iter().map(|row| row.get(at).unwrap_or(""));
    if cells().all(str::is_empty) {
        return Ok(());
    }
    let first = cells().find(|cell| !cell.is_empty()).unwrap_or("");
    if first.starts_with(['[', '(']) {
        let lists: Vec<Vec<f64>> = cells()
            .enumerate()
            .map(|(row, cell)| list(cell).ok_or_else(|| wrong(name, row, cell)))
            .collect::<Result<_, _>>()?;
        let width = lists.first().map_or(0, Vec::len);
        if let Some(row) = lists.iter().position(|list| list.len() != width) {
            return Err(wrong(name, row, "a list of another length"));
        }
        out.columns.extend((0..width).map(|i| Column {
            name: format!("{name}[{i}]"),
            values: lists.iter().map(|list| list.get(i).copied().unwrap_or(f64::NAN)).collect(),
        }));
        return Ok(());
    }
    let numbers: Vec<Option<f64>> =
        cells().map(|cell| if cell.is_empty() { Some(f64::NAN) } else { cell.parse().ok() }).collect();
    let good = numbers.iter().flatten().filter(|number| number.is_finite()).count();
    // A column of words has no numbers; one of numbers with a word in it is damaged.
    if good * 2 < rows.len() && numbers.iter().any(Option::is_none) {
        out.words.push((name.to_owned(), cells().map(str::to_owned).collect()));
        return Ok(());
    }
    if let Some(row) = numbers.iter().position(Option::is_none) {
        return Err(wrong(name, row, cells().nth(row).unwrap_or("")));
    }
    out.columns.push(Column { name: name.to_owned(), values: numbers.into_iter().flatten().collect() });
    Ok(())
}

fn wrong(name: &str, row: usize, cell: &str) -> String {
    let cell: String = cell.chars().take(40).collect();
    format!("row {} holds `{cell}` in the column `{name}`, which is no number; mend that row or leave it out", row + 1)
}

fn list(cell: &str) -> Option<Vec<f64>> {
    let inside = cell.strip_prefix(['[', '('])?.strip_suffix([']', ')'])?;
    inside.split([',', ' ', ';']).map(str::trim).filter(|s| !s.is_empty()).map(|s| s.parse().ok()).collect()
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
    for at in 1..columns.len() {
        let (before, rest) = columns.split_at_mut(at);
        if let Some(column) = rest.first_mut()
            && before.iter().any(|other| other.name == column.name)
        {
            column.name = format!("again.{}", column.name);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

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
        ] {
            let what = parse(text).err().unwrap_or_else(|| panic!("{text}"));
            assert!(what.contains(told) && !what.contains('\n'), "{what}");
        }
    }

    proptest! {
        #[test]
        fn no_text_makes_it_panic(text in "[ -~\n\t]{0,200}") {
            let _ = parse(&text);
        }
    }
}
