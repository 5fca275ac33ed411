//! The cells of a text table: which sign parts its columns, which lines are remarks, where its names stand, and which rows are none.

use super::Refused;
use shared_mem::budget::Budget;
use shared_mem::input::Decimal;
use shared_mem::recording::few_rows;
use std::borrow::Cow;
use std::collections::HashMap;

/// More columns than any log has: the names of a thousand robots' joints are fewer.
pub(super) const MOST_COLUMNS: usize = 100_000;
/// Lines by which the form of a table is found out.
const SAMPLE: usize = 50;
/// A cell of more lines than a remark has is the rest of a file behind a quotation mark that is never closed.
const MOST_LINES: usize = 10;

/// The cells of a table, row by row, one text and where each of them ends in it.
#[derive(Default)]
pub(super) struct Cells {
    text: String,
    ends: Vec<usize>,
    pub(super) width: usize,
    /// Names as they stand in the file; `None` where it has none.
    pub(super) names: Option<Vec<String>>,
    /// Whether they stand in a line that begins with `%time`, as `rostopic echo -p` writes it.
    pub(super) is_echoed: bool,
    /// Rows of names and units before the first row of numbers.
    first: usize,
    /// What was odd.
    pub(super) warnings: Vec<String>,
}

/// Lines of another number of columns than the others.
#[derive(Default)]
struct Odd {
    bad: usize,
    /// Line and columns of the first.
    first_bad: Option<(u64, usize)>,
    /// Those above the first row.
    above: usize,
    first_above: Option<(u64, usize)>,
    /// One of those may be names of other columns.
    is_misnamed: bool,
}

/// What a cell says by its form alone.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Nothing,
    Number,
    Word,
}

fn form(cell: &str) -> Form {
    let is_number = || [Decimal::Point, Decimal::Comma].iter().any(|sign| sign.number(cell).is_some());
    if is_missing(cell) {
        Form::Nothing
    } else if cell.starts_with(['[', '(']) && cell.ends_with([']', ')']) && cell.contains(|c: char| c.is_ascii_digit())
        || is_number()
    {
        Form::Number
    } else {
        Form::Word
    }
}

/// Whether a cell says that there is nothing: empty, or a word for it.
pub(super) fn is_missing(cell: &str) -> bool {
    const WORDS: [&str; 9] = ["", "-", "na", "n/a", "#n/a", "#nv", "null", "none", "nil"];
    WORDS.iter().any(|word| cell.eq_ignore_ascii_case(word))
}

impl Cells {
    /// Takes a text apart.
    pub(super) fn read(text: &str, budget: &Budget) -> Result<Self, Refused> {
        let (head, body) = head(text);
        let mut warnings = Vec::new();
        let body = whole_lines(body, &mut warnings)?;
        let sample: Vec<&str> = body.lines().filter(|line| !line.trim().is_empty()).take(SAMPLE).collect();
        if sample.is_empty() {
            let what = if head.is_empty() { "holds no line" } else { "holds names of columns and no row" };
            return Err(what.into());
        }
        let delimiter = delimiter(&sample);
        let plain = plain(body, delimiter, budget)?;
        let mut cells = Self { width: width(&plain, delimiter), warnings, ..Self::default() };
        let odd = cells.records(&plain, delimiter, budget)?;
        cells.find_names(&head, delimiter);
        cells.leave_out(odd, delimiter)?;
        if cells.rows() == 0 {
            return Err("holds names of columns and no row".into());
        }
        Ok(cells)
    }

    /// Takes the rows of that width over; of the others there may be few.
    fn records(&mut self, text: &str, delimiter: u8, budget: &Budget) -> Result<Odd, Refused> {
        let mut reader = reader(text, delimiter);
        let mut record = csv::StringRecord::new();
        let mut odd = Odd::default();
        while reader.read_record(&mut record).map_err(|error| format!("{:?}: it is damaged", error.kind()))? {
            if record.len() > MOST_COLUMNS {
                let what = format!(
                    "has {} columns, a log at most {MOST_COLUMNS}; leave out what is not the robot's",
                    record.len()
                );
                return Err(what.into());
            }
            budget.elements(record.len(), size_of::<usize>())?;
            budget.take(record.as_slice().len())?;
            let lines = record.as_slice().matches('\n').count();
            let behind = record.iter().skip(self.width).all(str::is_empty);
            // Names without the sign behind the last of them, above rows with it.
            let lacking = self.width.saturating_sub(record.len());
            let is_lacking = lacking > usize::from(self.ends.is_empty());
            if !behind || is_lacking || lines > MOST_LINES {
                let place = (record.position().map_or(0, csv::Position::line), record.len());
                if self.ends.is_empty() {
                    odd.above += 1 + lines;
                    odd.first_above = odd.first_above.or(Some(place));
                    // Names of other columns than there are, and no title.
                    odd.is_misnamed |= record.len() > 1 && record.iter().all(|cell| form(cell) == Form::Word);
                } else {
                    odd.bad += 1 + lines;
                    odd.first_bad = odd.first_bad.or(Some(place));
                }
                continue;
            }
            for cell in record.iter().chain(std::iter::repeat_n("", lacking)).take(self.width) {
                self.text += cell;
                self.ends.push(self.text.len());
            }
        }
        Ok(odd)
    }

    /// Says which lines are left out: those above the names are a title.
    fn leave_out(&mut self, mut odd: Odd, delimiter: u8) -> Result<(), Refused> {
        if self.first > 0 && odd.above > 0 {
            self.warnings.push(format!("{} lines above the names are left out", odd.above));
            (odd.above, odd.first_above, odd.is_misnamed) = (0, None, false);
        }
        let Some((line, width)) = odd.first_above.or(odd.first_bad) else { return Ok(()) };
        let bad = odd.bad + odd.above;
        let rows = self.ends.len().checked_div(self.width).unwrap_or(0);
        let what = format!("line {line} has {width} columns, the others have {}", self.width);
        if bad > few_rows(rows + bad) || odd.is_misnamed {
            let commas = delimiter == b',' && (2 * width == self.width || width == 2 * self.width);
            let remedy = if commas { "; where commas are decimal signs, part the columns with `;`" } else { "" };
            return Err(format!("{what}: it is cut or damaged; mend that line or leave it out{remedy}").into());
        }
        self.warnings.push(format!("{what}: {bad} of {} lines are left out", rows + bad));
        Ok(())
    }

    /// Looks for names in the first row, or in the remarks above it, and for a row of units below them.
    fn find_names(&mut self, head: &[&str], delimiter: u8) {
        let row =
            |cells: &Self, row: usize| -> Vec<Form> { (0..cells.width).map(|at| form(cells.at(row, at))).collect() };
        let below = |cells: &Self, from: usize| -> Vec<Vec<Form>> {
            (from..cells.rows().min(from + 10)).map(|at| row(cells, at)).collect()
        };
        // A word above numbers is a name; one above words, beside a number, is a row like the others.
        let is_above = |first: &[Form], rows: &[Vec<Form>]| {
            first
                .iter()
                .enumerate()
                .any(|(at, form)| *form == Form::Word && rows.iter().any(|row| row.get(at) == Some(&Form::Number)))
        };
        let first = row(self, 0);
        let is_names =
            is_above(&first, &below(self, 1)) || !first.contains(&Form::Number) && first.contains(&Form::Word);
        if is_names {
            self.names = Some((0..self.width).map(|at| self.at(0, at).to_owned()).collect());
            self.first = 1;
        } else {
            let found = head.iter().rev().find_map(|line| Some((line, names(line, delimiter, self.width)?)));
            self.is_echoed = found.as_ref().is_some_and(|(line, _)| line.starts_with("%time"));
            self.names = found.map(|(_, names)| names);
        }
        let Some(names) = self.names.clone().filter(|_| self.rows() > 1) else { return };
        let units = row(self, 0);
        if !units.contains(&Form::Number) && is_above(&units, &below(self, 1)) {
            let with_unit = |(at, name): (usize, &String)| match self.at(0, at) {
                "" => name.clone(),
                unit if name.contains('[') => format!("{name} {unit}"),
                unit => format!("{name} [{}]", unit.trim_matches(['[', ']', '(', ')'])),
            };
            self.names = Some(names.iter().enumerate().map(with_unit).collect());
            self.first += 1;
        }
    }

    pub(super) fn rows(&self) -> usize {
        self.ends.len().checked_div(self.width).unwrap_or(0).saturating_sub(self.first)
    }

    /// A cell, by its row below the names.
    pub(super) fn at(&self, row: usize, column: usize) -> &str {
        let number = (row + self.first) * self.width + column;
        let begin = number.checked_sub(1).and_then(|before| self.ends.get(before)).copied().unwrap_or(0);
        self.ends.get(number).and_then(|end| self.text.get(begin..*end)).unwrap_or("")
    }
}

fn reader(text: &str, delimiter: u8) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new()
        .delimiter(delimiter)
        .has_headers(false)
        .flexible(true)
        .trim(csv::Trim::All)
        .from_reader(text.as_bytes())
}

fn is_remark(line: &str) -> bool {
    line.trim_start().starts_with(['#', '%'])
}

/// The remarks in front, and the rest.
fn head(text: &str) -> (Vec<&str>, &str) {
    let (mut head, mut rest) = (Vec::new(), text);
    while let Some((line, behind)) = rest.split_once('\n') {
        if !is_remark(line) && !line.trim().is_empty() {
            break;
        }
        head.extend(is_remark(line).then(|| line.trim()));
        rest = behind;
    }
    (head, rest)
}

/// Names in a remark, where it has as many as there are columns.
fn names(remark: &str, delimiter: u8, width: usize) -> Option<Vec<String>> {
    let line = remark.trim_start_matches(['#', '%']).trim();
    let line = if delimiter == b' ' { Cow::Owned(words(line)) } else { Cow::Borrowed(line) };
    let mut record = csv::StringRecord::new();
    let there = reader(&line, delimiter).read_record(&mut record).ok()?;
    let mut names: Vec<String> = record.iter().map(str::to_owned).collect();
    if names.len() == width + 1 && names.last().is_some_and(String::is_empty) {
        names.pop();
    }
    (there && names.len() == width && names.iter().any(|name| form(name) == Form::Word)).then_some(names)
}

/// A text up to its last whole line: what is behind that was cut.
fn whole_lines<'a>(text: &'a str, warnings: &mut Vec<String>) -> Result<&'a str, Refused> {
    let end = text.rfind('\n').map_or(0, |at| at + 1);
    let (whole, rest) = text.split_at(end);
    if rest.trim().is_empty() {
        return Ok(whole);
    }
    if whole.lines().count() < 2 {
        return Err("ends within a line, as a log that was cut; if it is whole, end it with `echo >> FILE`".into());
    }
    let line = text.lines().count();
    warnings.push(format!(
        "its last line ({line} from the beginning of the table) has no end, as in a log that was cut: it is left out; if it is \
         whole, end it with `echo >> FILE`"
    ));
    Ok(whole)
}

/// The columns that most of the first rows have; those without a name above and without a cell are none.
fn width(text: &str, delimiter: u8) -> usize {
    let mut reader = reader(text, delimiter);
    let records: Vec<csv::StringRecord> = reader.records().take(SAMPLE).map_while(Result::ok).collect();
    let mut counts: HashMap<usize, usize> = HashMap::new();
    records
        .iter()
        .skip(usize::from(records.len() > 1))
        .for_each(|record| *counts.entry(record.len()).or_default() += 1);
    let most = counts.into_iter().max_by_key(|(width, count)| (*count, *width)).map_or(0, |(width, _)| width);
    let first = records.first().map_or(0, csv::StringRecord::len);
    let is_empty = |record: &csv::StringRecord| record.get(most.saturating_sub(1)).is_none_or(str::is_empty);
    if first + 1 == most && records.iter().all(is_empty) { first } else { most }
}

/// The sign that parts columns: the first of a tab, `;` and `,` that stands in the lines equally often; else the one that is
/// most frequent in the first of them, and blanks where there is none.
fn delimiter(lines: &[&str]) -> u8 {
    const SIGNS: [u8; 3] = [b'\t', b';', b','];
    let counts: Vec<[usize; 3]> = lines.iter().map(|line| SIGNS.map(|sign| count(line, sign))).collect();
    let regular = |at: &usize| {
        let usual = counts.get(counts.len() / 2).map_or(0, |counts| counts[*at]);
        let equal = counts.iter().filter(|counts| counts[*at] == usual).count();
        usual > 0 && 10 * equal >= 9 * counts.len()
    };
    let first = counts.first().copied().unwrap_or_default();
    let frequent = || (0..3).filter(|at| first[*at] > 0).max_by_key(|at| (first[*at], std::cmp::Reverse(*at)));
    let best = (0..3).find(regular).or_else(frequent).map_or(b' ', |at| SIGNS[at]);
    // `0,5 0,25`: commas within numbers that blanks part.
    let is_blank = |line: &&str| {
        let mut words = line.split_whitespace().peekable();
        line.split_whitespace().count() > 1
            && words.peek().is_some_and(|word| word.contains(','))
            && words.all(|word| Decimal::Comma.number(word).is_some())
    };
    if best == b',' && lines.len() > 1 && lines.iter().skip(1).all(is_blank) { b' ' } else { best }
}

/// How often a sign stands in a line, outside of brackets and quotation marks.
fn count(line: &str, sign: u8) -> usize {
    let (mut depth, mut quoted, mut count) = (0_i32, false, 0);
    for byte in line.bytes() {
        match byte {
            b'"' => quoted = !quoted,
            b'[' | b'(' if !quoted => depth += 1,
            b']' | b')' if !quoted => depth -= 1,
            byte if byte == sign && depth == 0 && !quoted => count += 1,
            _ => {}
        }
    }
    count
}

/// The text without remarks, and with one blank between words where blanks part columns.
fn plain<'a>(text: &'a str, delimiter: u8, budget: &Budget) -> Result<Cow<'a, str>, Refused> {
    // `#N/A` and the like are cells.
    let is_remark = |line: &str| {
        let line = line.trim_start();
        line.starts_with('%') || line.strip_prefix('#').is_some_and(|rest| !rest.starts_with(char::is_alphabetic))
    };
    if delimiter != b' ' && !text.lines().any(is_remark) {
        return Ok(Cow::Borrowed(text));
    }
    budget.take(text.len())?;
    let line = |line: &'a str| if delimiter == b' ' { words(line) } else { line.to_owned() };
    let lines = text.lines().filter(|line| !is_remark(line)).map(line).filter(|line| !line.is_empty());
    Ok(Cow::Owned(lines.fold(String::new(), |all, line| all + &line + "\n")))
}

/// One blank between the words of a line.
fn words(line: &str) -> String {
    line.split_whitespace().collect::<Vec<_>>().join(" ")
}
