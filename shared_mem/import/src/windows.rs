//! Arrays of many motions at once, a motion in each row (`files x 50`): a log of each.

use crate::log::{Column, LeftOut, Log, Table};
use crate::naming::{self, Group};
use shared_mem::msg::MAX_JOINTS;
use shared_mem::statistics::median;

/// More columns than any arm has joints; only those may be a motion in each row.
const WIDE: usize = 16;
/// So few rows are the joints of one arm.
const JOINTS: std::ops::RangeInclusive<usize> = 3..=MAX_JOINTS;
/// A motion goes on within a row when its steps there are so many times shorter than from row to row.
const SMOOTHER: f64 = 0.5;

/// A log of each row, where rows go on like a motion over time; else the log as it is.
pub(crate) fn apart(mut log: Log) -> Vec<Log> {
    let Some(at) = log.tables.iter().position(|table| length(table).is_some()) else { return vec![log] };
    let table = log.tables.swap_remove(at);
    let Some(length) = length(&table) else { return vec![log] };
    if JOINTS.contains(&table.rows()) {
        return vec![turned(log, &table, length)];
    }
    let (motions, others): (Vec<Group>, Vec<Group>) =
        naming::groups(&table).into_iter().partition(|group| group.names.len() == length);
    let count = table.rows();
    log.facts.runs = Some(format!(
        "each row of `{}` goes on like a motion over time: the file holds {count} motions of {length} rows, a clip of each",
        motions.iter().map(|group| group.base.as_str()).collect::<Vec<_>>().join("`, `")
    ));
    let why = "it is no row of numbers a stamp, as the motions beside it are";
    log.left_out.extend(others.into_iter().map(|group| LeftOut { what: group.base, why, count: 1 }));
    let along = |row: usize, group: &Group| {
        let values = group.at.iter().filter_map(|at| table.columns.get(*at)?.values.get(row));
        Column { name: group.base.clone(), values: values.copied().collect() }
    };
    let mut logs: Vec<Log> = (0..count)
        .map(|row| {
            let columns = motions.iter().map(|group| along(row, group)).collect();
            let only = Table { name: table.name.clone(), stamps_ns: None, columns };
            let name = format!("{}_{:03}", log.name, row + 1);
            Log { name, tables: vec![only], ..log.without_numbers() }
        })
        .collect();
    if let Some(first) = logs.first_mut() {
        (first.left_out, first.warnings) = (log.left_out, log.warnings);
    }
    logs
}

/// The log with a row of each joint turned into a column of each; what has as many rows as those have columns stands beside it.
fn turned(mut log: Log, table: &Table, length: usize) -> Log {
    let (joints, others): (Vec<Group>, Vec<Group>) =
        naming::groups(table).into_iter().partition(|group| group.names.len() == length);
    let of = |group: &Group| -> Vec<Column> {
        let along =
            |row: usize| group.at.iter().filter_map(|at| table.columns.get(*at)?.values.get(row)).copied().collect();
        (0..table.rows()).map(|row| Column { name: format!("{}[{row}]", group.base), values: along(row) }).collect()
    };
    let mut columns: Vec<Column> = joints.iter().flat_map(of).collect();
    let beside = log.tables.extract_if(.., |other| other.stamps_ns.is_none() && other.rows() == length);
    columns.extend(beside.flat_map(|other| other.columns));
    let why = "it is no row of numbers a joint, as the motions beside it are";
    log.left_out.extend(others.into_iter().map(|group| LeftOut { what: group.base, why, count: 1 }));
    log.warnings.push(format!(
        "its arrays have a row of each of {} joints, and a column of each of {length} stamps",
        table.rows()
    ));
    log.tables.insert(0, Table { name: table.name.clone(), stamps_ns: None, columns });
    log
}

/// How many rows the motions in a table's rows have; `None` where they hold none.
fn length(table: &Table) -> Option<usize> {
    let values = |group: &Group| -> Vec<&[f64]> {
        group.at.iter().filter_map(|at| table.columns.get(*at)).map(|column| column.values.as_slice()).collect()
    };
    let groups = naming::groups(table);
    groups.iter().find(|group| is_motion(&values(group))).map(|group| group.names.len())
}

/// Whether rows go on like a motion over time: many columns, each near the one beside it and far from itself one row on.
fn is_motion(columns: &[&[f64]]) -> bool {
    let middle = |pairs: &mut dyn Iterator<Item = (f64, f64)>| {
        median(pairs.map(|(a, b)| (a - b).abs()).filter(|difference| difference.is_finite()))
    };
    if columns.len() < WIDE {
        return false;
    }
    let across = |row: usize| columns.windows(2).filter_map(move |w| Some((*w[0].get(row)?, *w[1].get(row)?)));
    let rows = columns.first().map_or(0, |column| column.len());
    // A few rows tell as much as all.
    let some = || (0..rows).step_by((rows / 50).max(1));
    let within = middle(&mut some().flat_map(across));
    let between =
        middle(&mut columns.iter().flat_map(|c| some().filter_map(|row| Some((*c.get(row)?, *c.get(row + 1)?)))));
    within.zip(between).is_some_and(|(within, between)| within < SMOOTHER * between)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twenty files of 30 rows: angles that begin anywhere and go on smoothly.
    fn angle(file: usize, row: usize) -> f64 {
        (file * 37 % 20) as f64 + 0.1 * (row as f64 * 0.1).sin()
    }

    fn array(name: &str, width: usize, of: impl Fn(usize, usize) -> f64) -> Vec<Column> {
        let column = |i| Column { name: format!("{name}[{i}]"), values: (0..20).map(|row| of(row, i)).collect() };
        (0..width).map(column).collect()
    }

    #[test]
    fn a_motion_in_each_row_is_a_log_of_its_own() {
        let columns =
            [array("q1", 30, angle), array("time", 30, |_, i| 0.02 * i as f64), array("label", 2, |_, _| 0.0)];
        let table = Table { name: "rows".into(), columns: columns.concat(), ..Table::default() };
        let logs = apart(Log { name: "all".into(), tables: vec![table], ..Log::default() });
        assert_eq!((logs.len(), logs[4].name.as_str(), logs[0].left_out[0].what.as_str()), (20, "all_005", "label"));
        let [q1, time] = &logs[4].tables[0].columns[..] else { panic!("two columns") };
        assert_eq!((q1.name.as_str(), q1.values[7], q1.values.len()), ("q1", angle(4, 7), 30));
        assert_eq!((time.name.as_str(), time.values[7]), ("time", 0.14));
    }

    #[test]
    fn a_row_of_each_joint_is_turned() {
        let joint = |i: usize| Column { name: format!("q[{i}]"), values: (0..6).map(|row| angle(row, i)).collect() };
        let wide = Table { name: "rows".into(), columns: (0..40).map(joint).collect(), ..Table::default() };
        let stamps = Column { name: "t".into(), values: (0..40).map(f64::from).collect() };
        let clock = Table { name: "rows of t".into(), columns: vec![stamps], ..Table::default() };
        let logs = apart(Log { tables: vec![wide, clock], ..Log::default() });
        let [only] = &logs[..] else { panic!("one log") };
        let names: Vec<&str> = only.tables[0].columns.iter().map(|column| column.name.as_str()).collect();
        assert_eq!((only.tables.len(), names), (1, vec!["q[0]", "q[1]", "q[2]", "q[3]", "q[4]", "q[5]", "t"]));
        assert_eq!(only.tables[0].columns[4].values[30], angle(4, 30));
    }

    #[test]
    fn joints_in_each_row_stay_one_log() {
        let table = Table { name: "rows".into(), columns: array("q", 20, |row, i| angle(i, row)), ..Table::default() };
        assert_eq!(apart(Log { tables: vec![table], ..Log::default() }).len(), 1);
    }
}
