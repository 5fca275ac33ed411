//! Logs as their readers give them, and what is one log among them: each of several runs that one file holds is a log of its own, and
//! seconds and nanoseconds in two columns are one stamp.

use crate::log::{Column, LeftOut, Log, Table};
use crate::naming;
use crate::windows;
use shared_mem::statistics::median;
use std::collections::{BTreeMap, BTreeSet};

/// What runs are called, where they are numbered.
const RUNS: [&str; 15] = [
    "demo",
    "demonstration",
    "episode",
    "ep",
    "run",
    "trial",
    "traj",
    "trajectory",
    "rollout",
    "sequence",
    "seq",
    "take",
    "clip",
    "motion",
    "recording",
];
/// Numbered parts of a robot, or of a log, that are none.
const PARTS: [&str; 16] = [
    "robot", "arm", "joint", "joints", "jnt", "axis", "motor", "link", "leg", "finger", "camera", "cam", "sensor",
    "device", "port", "body",
];
/// Names of the two columns of a stamp.
const SECONDS: [&str; 4] = ["s", "sec", "secs", "seconds"];
const NANOSECONDS: [&str; 5] = ["ns", "nsec", "nsecs", "nanosec", "nanoseconds"];
const MICROSECONDS: [&str; 4] = ["us", "usec", "usecs", "microseconds"];
const BILLION: f64 = 1e9;
const MILLION: f64 = 1e6;
/// Runs that are listed in a sentence.
const LISTED: usize = 12;
/// Stamps that begin anew do so within so many steps of the first one, and go on for so many rows.
const NEAR_STEPS: f64 = 3.0;
const FEWEST_ROWS: usize = 10;
/// Seconds since 1970 are more than this from 2001 on, as no other column of whole numbers beside one of nanoseconds is.
const RECENT: f64 = 1e9;

/// Takes each log apart into its runs, and puts stamps of two columns together.
pub(crate) fn apart(logs: Vec<Log>) -> Vec<Log> {
    let mut all: Vec<Log> = logs.into_iter().flat_map(windows::apart).flat_map(by_run).flat_map(by_stamps).collect();
    for log in &mut all {
        for table in log.tables.iter_mut().filter(|table| table.stamps_ns.is_none()) {
            if let Some(Parts { seconds, rest, unit, stamps_ns }) = stamps(table) {
                log.facts.two_columns = Some(format!(
                    "`{seconds}` and `{rest}` are the seconds and {unit} of one stamp: they rise together"
                ));
                table.stamps_ns = Some(stamps_ns);
            }
        }
    }
    all
}

/// A log of each run, where one holds several; else the log as it is.
fn by_run(mut log: Log) -> Vec<Log> {
    let runs = names_of_runs(&log);
    if runs.is_empty() {
        return vec![log];
    }
    let called: Vec<String> = runs.iter().map(|(stem, number)| format!("`{stem}{number}`")).collect();
    let some = called.iter().take(LISTED).cloned().collect::<Vec<_>>().join(", ");
    log.facts.runs = Some(format!("the file holds {} runs, a clip of each: {some}", called.len()));
    let mut parts: BTreeMap<(String, u64), Log> = BTreeMap::new();
    for Table { name, stamps_ns, columns } in std::mem::take(&mut log.tables) {
        let mut own: BTreeMap<(String, u64), Table> = BTreeMap::new();
        for column in columns {
            let Some((run, rest)) = split(&column.name).filter(|(run, _)| runs.contains(run)) else {
                let why = "it belongs to none of the file's runs";
                log.left_out.push(LeftOut { what: column.name, why, count: 1 });
                continue;
            };
            let begun = || Table { name: name.clone(), stamps_ns: stamps_ns.clone(), columns: Vec::new() };
            own.entry(run).or_insert_with(begun).columns.push(Column { name: rest, values: column.values });
        }
        for (run, table) in own {
            let called = format!("{}_{}{}", log.name, run.0.replace(['.', '/'], "_"), run.1);
            parts.entry(run).or_insert_with(|| Log { name: called, ..log.without_numbers() }).tables.push(table);
        }
    }
    let mut parts: Vec<Log> = parts.into_values().collect();
    for part in &mut parts {
        // The rows that most columns have are those of the run, and called alike in all runs.
        part.tables.sort_by_key(|table| std::cmp::Reverse(table.columns.len()));
        for (number, table) in part.tables.iter_mut().enumerate() {
            let first = table.columns.first().map_or("", |column| column.name.as_str());
            table.name = if number == 0 { "rows".to_owned() } else { format!("rows of {first}") };
        }
    }
    if let Some(first) = parts.first_mut() {
        (first.left_out, first.warnings) = (log.left_out, log.warnings);
    }
    parts
}

/// A log of each part of a table whose stamps begin anew, as files do that runs were appended to; else the log as it is.
fn by_stamps(mut log: Log) -> Vec<Log> {
    let [table] = log.tables.as_slice() else { return vec![log] };
    let begins = table.columns.iter().filter(|column| naming::is_time(&column.name)).find_map(|c| begins(&c.values));
    let Some(begins) = begins.filter(|_| table.stamps_ns.is_none()) else { return vec![log] };
    let Some(table) = log.tables.pop() else { return vec![log] };
    let count = begins.len();
    log.facts.runs = Some(format!("its stamps begin anew: the file holds {count} runs, a clip of each"));
    let ends = begins.iter().skip(1).copied().chain([table.rows()]);
    let mut parts: Vec<Log> = begins
        .iter()
        .zip(ends)
        .enumerate()
        .map(|(number, (begin, end))| {
            let cut =
                |c: &Column| Column { name: c.name.clone(), values: c.values.get(*begin..end).unwrap_or(&[]).to_vec() };
            let own =
                Table { columns: table.columns.iter().map(cut).collect(), name: table.name.clone(), stamps_ns: None };
            Log { name: format!("{}_{:03}", log.name, number + 1), tables: vec![own], ..log.without_numbers() }
        })
        .collect();
    if let Some(first) = parts.first_mut() {
        (first.left_out, first.warnings) = (log.left_out, log.warnings);
    }
    parts
}

/// The rows at which stamps begin, where they fall back to the first of them once or more and rise in between.
fn begins(stamps: &[f64]) -> Option<Vec<usize>> {
    let first = *stamps.first()?;
    let falls: Vec<usize> = (1..stamps.len()).filter(|row| stamps[*row] < stamps[row - 1]).collect();
    let near = NEAR_STEPS * median(stamps.windows(2).map(|w| w[1] - w[0]).filter(|step| *step > 0.0))?;
    let begins: Vec<usize> = std::iter::once(0).chain(falls).collect();
    let ends = begins.iter().skip(1).copied().chain([stamps.len()]);
    let is_long = begins.iter().zip(ends).all(|(begin, end)| end - begin >= FEWEST_ROWS);
    let is_anew = begins.iter().all(|row| (stamps[*row] - first).abs() <= near);
    (begins.len() > 1 && is_long && is_anew).then_some(begins)
}

/// The runs of a log, by what stands before the names of their columns. None, where what is numbered are parts of a robot.
fn names_of_runs(log: &Log) -> BTreeSet<(String, u64)> {
    let mut columns: BTreeMap<(String, u64), usize> = BTreeMap::new();
    let mut rows = BTreeSet::new();
    for table in &log.tables {
        for column in &table.columns {
            if let Some((run, _)) = split(&column.name) {
                *columns.entry(run).or_default() += 1;
                rows.insert(table.rows());
            }
        }
    }
    let words: BTreeSet<String> = columns.keys().filter_map(|(stem, _)| naming::words(stem).pop()).collect();
    let are = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    // A joint has a column each of some quantities, a run has many; runs differ in length, parts of a robot do not.
    let wide = columns.values().all(|count| *count > 1);
    let is_file_of_runs = columns.len() > 1 && wide && !are(&PARTS) && (are(&RUNS) || rows.len() > 1);
    if is_file_of_runs { columns.into_keys().collect() } else { BTreeSet::new() }
}

/// A name as its run and the rest: `data.demo_3.obs.q[0]` is `q[0]` of `obs` in the run `data.demo_`, 3.
fn split(name: &str) -> Option<((String, u64), String)> {
    let whole = name.split_once('[').map_or(name, |(whole, _)| whole);
    let mut begin = 0;
    for (end, _) in whole.match_indices(['.', '/']) {
        let part = &whole[begin..end];
        let digits = part
            .rfind(|c: char| !c.is_ascii_digit())
            .map_or(0, |at| at + part[at..].chars().next().map_or(1, char::len_utf8));
        if let Ok(number) = part[digits..].parse() {
            return Some(((name[..begin + digits].to_owned(), number), name[end + 1..].to_owned()));
        }
        begin = end + 1;
    }
    None
}

/// A stamp of two columns.
struct Parts {
    /// Name of the column of seconds.
    seconds: String,
    /// Name of the other.
    rest: String,
    /// What that counts.
    unit: &'static str,
    stamps_ns: Vec<u64>,
}

/// Two columns that are the seconds of one stamp and what is behind them, nanoseconds or microseconds.
fn stamps(table: &Table) -> Option<Parts> {
    table.columns.windows(2).find_map(|pair| {
        let [seconds, nanoseconds] = pair else { return None };
        let last = |column: &Column| naming::words(&column.name).pop().unwrap_or_default();
        let in_micro = MICROSECONDS.contains(&last(nanoseconds).as_str());
        let in_nano = NANOSECONDS.contains(&last(nanoseconds).as_str());
        let named = SECONDS.contains(&last(seconds).as_str()) && (in_nano || in_micro);
        let whole = |v: &f64| v.fract() == 0.0 && *v >= 0.0;
        let is_time = seconds.values.iter().all(|v| whole(v) && *v < 1e10 && (named || *v > RECENT))
            && nanoseconds.values.iter().all(|v| whole(v) && *v < BILLION);
        if !is_time || seconds.values.is_empty() {
            return None;
        }
        // Behind seconds without names, no nanoseconds are all below a millisecond.
        let is_micro = nanoseconds.values.iter().all(|v| *v < MILLION) && !in_nano;
        let (unit, factor) = if is_micro { ("microseconds", 1000) } else { ("nanoseconds", 1) };
        let both = seconds.values.iter().zip(&nanoseconds.values);
        let stamps: Vec<u64> = both.map(|(s, rest)| *s as u64 * 1_000_000_000 + *rest as u64 * factor).collect();
        let rising = stamps.windows(2).filter(|w| w[1] > w[0]).count();
        (stamps.len() > 1 && rising * 10 >= 9 * (stamps.len() - 1)).then(|| Parts {
            seconds: seconds.name.clone(),
            rest: nanoseconds.name.clone(),
            unit,
            stamps_ns: stamps,
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(columns: &[(&str, usize)]) -> Log {
        let mut by_rows: BTreeMap<usize, Vec<Column>> = BTreeMap::new();
        for (name, rows) in columns {
            let column = Column { name: (*name).into(), values: vec![0.0; *rows] };
            by_rows.entry(*rows).or_default().push(column);
        }
        let table =
            |(rows, columns): (usize, Vec<Column>)| Table { name: rows.to_string(), columns, ..Table::default() };
        Log { name: "file".into(), tables: by_rows.into_iter().map(table).collect(), ..Log::default() }
    }

    fn names(log: Log) -> Vec<String> {
        apart(vec![log]).into_iter().map(|log| log.name).collect()
    }

    #[test]
    fn runs_of_one_file_are_logs_and_numbered_parts_of_a_robot_are_none() {
        let demos = [
            ("data.demo_0.q[0]", 5),
            ("data.demo_0.a", 5),
            ("data.demo_10.q[0]", 5),
            ("data.demo_10.a", 5),
            ("mask", 5),
        ];
        assert_eq!(names(log(&demos)), ["file_data_demo_0", "file_data_demo_10"]);
        // Numbers alone, of runs of other lengths.
        assert_eq!(names(log(&[("0.q[0]", 5), ("0.q[1]", 5), ("1.q[0]", 7), ("1.q[1]", 7)])), ["file_0", "file_1"]);
        for plain in [
            &[("joint_0.pos", 5), ("joint_0.vel", 5), ("joint_1.pos", 5), ("joint_1.vel", 5)][..],
            &[("robot_0.q[0]", 5), ("robot_0.q[1]", 5), ("robot_1.q[0]", 6), ("robot_1.q[1]", 6)],
            &[("q[0]", 5), ("q[1]", 5), ("obs.robot0_joint_pos[0]", 5)],
            &[("demo_0.q[0]", 5), ("demo_0.q[1]", 5)],
        ] {
            assert_eq!(names(log(plain)), ["file"], "{plain:?}");
        }
        let parts = apart(vec![log(&demos)]);
        let columns: Vec<&str> = parts[1].tables[0].columns.iter().map(|column| column.name.as_str()).collect();
        assert_eq!((columns, parts[0].left_out[0].what.as_str()), (vec!["q[0]", "a"], "mask"));
    }

    #[test]
    fn runs_that_were_appended_begin_with_their_stamps() {
        let of = |of: fn(u32) -> f64| Column { name: "time".into(), values: (0..60).map(of).collect() };
        assert_eq!(begins(&of(|k| 0.01 * f64::from(k % 20)).values), Some(vec![0, 20, 40]));
        assert_eq!(begins(&of(f64::from).values), None);
        assert_eq!(begins(&of(|k| f64::from(k / 2 * 2) - f64::from(k % 2)).values), None, "rows out of order");
        let q = Column { name: "q".into(), values: (0..60).map(f64::from).collect() };
        let table = Table { name: "rows".into(), columns: vec![of(|k| f64::from(k % 30)), q], ..Table::default() };
        let logs = apart(vec![Log { name: "all".into(), tables: vec![table], ..Log::default() }]);
        assert_eq!((logs.len(), logs[1].name.as_str(), logs[1].tables[0].columns[1].values[0]), (2, "all_002", 30.0));
    }

    #[test]
    fn seconds_and_nanoseconds_are_one_stamp() {
        let table = |names: [&str; 2], first: f64| {
            let values = |of: fn(u32) -> f64, first: f64| (0..30).map(|i| first + of(i)).collect();
            let seconds = Column { name: names[0].into(), values: values(|i| f64::from(i / 10), first) };
            let rest = Column { name: names[1].into(), values: values(|i| f64::from(i % 10) * 1e8, 0.0) };
            Table { columns: vec![seconds, rest], ..Table::default() }
        };
        for (names, first, found) in [
            (["column[1]", "column[2]"], 1.76e9, true),
            (["header.stamp.sec", "header.stamp.nanosec"], 0.0, true),
            (["column[1]", "column[2]"], 0.0, false),
        ] {
            let stamps = stamps(&table(names, first)).map(|parts| parts.stamps_ns);
            let expected = found.then(|| (0..30).map(|i| first as u64 * 1_000_000_000 + i * 100_000_000).collect());
            assert_eq!(stamps, expected, "{names:?}");
        }
        let mut micro = table(["time_sec", "time_usec"], 0.0);
        micro.columns[1].values.iter_mut().for_each(|v| *v *= 1e-3);
        assert!(
            stamps(&micro).is_some_and(|parts| parts.unit == "microseconds" && parts.stamps_ns[11] == 1_100_000_000)
        );
    }
}
