//! NumPy's archives: each array is a column, or the columns of one quantity.

use super::{go_on, stem};
use crate::error::ImportError;
use crate::log::{Column, LeftOut, Log, Table};
use shared_mem::budget::Budget;
use shared_mem::input::{self, Kind};
use shared_mem::recording::{Array, ArrayError, parse_npy};
use std::collections::BTreeMap;
use std::io::{Cursor, Read as _};
use std::path::Path;

/// A wider array is neither a quantity of joints nor, a motion in each row, one of theirs over time.
const WIDEST: usize = 4096;
/// So many joints have several arms together.
const MOST_JOINTS: usize = 64;

pub(super) fn read(path: &Path, budget: &Budget) -> Result<Log, ImportError> {
    let bytes = input::bytes(path, Kind::Array)?;
    let broken = |what: &dyn std::fmt::Display| {
        ImportError::log(
            path,
            format!("is no whole .npz ({what}); copy it from its source again, or save it with numpy.savez"),
        )
    };
    let spent = ImportError::budget(path);
    let mut archive = zip::ZipArchive::new(Cursor::new(bytes)).map_err(|e| broken(&e))?;
    if archive.has_overlapping_files().map_err(|e| broken(&e))? {
        return Err(broken(&"two arrays share their bytes"));
    }
    let mut by_rows: BTreeMap<usize, Vec<(String, Array)>> = BTreeMap::new();
    let mut runs: BTreeMap<[usize; 2], Vec<(String, Array)>> = BTreeMap::new();
    let mut log = Log { file: path.to_owned(), name: stem(path), format: "npz", ..Log::default() };
    for number in 0..archive.len() {
        go_on(path)?;
        let file = archive.by_index(number).map_err(|e| broken(&e))?;
        let entry = file.name().map_err(|e| broken(&e))?.into_owned();
        let Some(name) = entry.strip_suffix(".npy").map(str::to_owned) else { continue };
        // What it says of its size is checked once it is there: one byte more than there is room for is enough to know.
        let room = budget.left().min(Kind::Array.limit());
        let mut npy = Vec::new();
        file.take(room + 1).read_to_end(&mut npy).map_err(|e| broken(&e))?;
        budget.take(npy.len()).map_err(&spent)?;
        let read = parse_npy(&npy, budget);
        budget.give_back(npy.len());
        match read {
            Ok(array) => match *array.shape.as_slice() {
                [rows] => by_rows.entry(rows).or_default().push((name, array)),
                [rows, width] if width <= WIDEST => by_rows.entry(rows).or_default().push((name, array)),
                [count, rows, width] if rows > 1 && count <= WIDEST && width <= MOST_JOINTS => {
                    runs.entry([count, rows]).or_default().push((name, array));
                }
                _ => {
                    budget.give_back(size_of_val(array.values.as_slice()));
                    log.left_out.push(LeftOut { what: name, why: "it has no row of numbers a stamp", count: 1 });
                }
            },
            Err(ArrayError::Budget(over)) => return Err(spent(over)),
            Err(what @ ArrayError::Cut(_)) => return Err(broken(&format!("`{name}` {what}"))),
            Err(ArrayError::Kind(_)) => {
                log.left_out.push(LeftOut { what: name, why: "it is no array of numbers", count: 1 });
            }
        }
    }
    for ([count, rows], arrays) in runs {
        // What those runs have one number of a row: `runs x rows`, as their stamps.
        let beside = by_rows.get_mut(&count).map(|all| all.extract_if(.., |(_, array)| array.shape == [count, rows]));
        let arrays: Vec<(String, Array)> = beside.into_iter().flatten().chain(arrays).collect();
        // There twice until the arrays are gone.
        let doubled = arrays.iter().map(|(_, array)| array.values.len()).sum();
        budget.elements(doubled, size_of::<f64>()).map_err(&spent)?;
        by_rows.entry(rows).or_default().extend(arrays.into_iter().flat_map(|(name, array)| by_run(&name, &array)));
        budget.give_back(doubled * size_of::<f64>());
    }
    // The rows that most arrays have are those of the clip.
    let mut tables: Vec<(usize, Vec<(String, Array)>)> = by_rows.into_iter().filter(|(rows, _)| *rows > 1).collect();
    tables.sort_by_key(|(_, arrays)| std::cmp::Reverse(arrays.len()));
    for (number, (_, arrays)) in tables.into_iter().enumerate() {
        let first = arrays.first().map_or("", |(name, _)| name);
        let name = if number == 0 { super::table::ROWS.to_owned() } else { format!("rows of {first}") };
        let mut table = Table { name, ..Table::default() };
        for (name, array) in arrays {
            // There twice until the array is gone.
            let doubled = size_of_val(array.values.as_slice());
            budget.elements(array.values.len(), size_of::<f64>()).map_err(&spent)?;
            table.columns.extend(columns(&name, array));
            budget.give_back(doubled);
        }
        log.tables.push(table);
    }
    Ok(log)
}

/// An array of `runs x rows x joints`, or of `runs x rows`, as one of each run, called so.
fn by_run(name: &str, array: &Array) -> Vec<(String, Array)> {
    let (count, shape) = array.shape.split_first().map_or((0, &[][..]), |(count, shape)| (*count, shape));
    let size: usize = shape.iter().product();
    let run = |k: usize| {
        let values = array.values.get(k * size..(k + 1) * size).unwrap_or(&[]).to_vec();
        (format!("run_{k}.{name}"), Array { shape: shape.to_vec(), values })
    };
    (0..count).map(run).collect()
}

fn columns(name: &str, array: Array) -> Vec<Column> {
    match array.shape.as_slice() {
        [_, width] => {
            let column = |i: usize| array.values.iter().skip(i).step_by((*width).max(1)).copied().collect();
            (0..*width).map(|i| Column { name: format!("{name}[{i}]"), values: column(i) }).collect()
        }
        _ => vec![Column { name: name.to_owned(), values: array.values }],
    }
}
