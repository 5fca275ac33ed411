//! The house in numbers, as a table: `measures [FOLDER ...]`, a column for each tree of sources; this one without folders.

use std::io::Write as _;
use std::path::PathBuf;
use tests::measures::measures;
use tests::texts::root;

fn main() -> std::io::Result<()> {
    let mut trees: Vec<PathBuf> = std::env::args_os().skip(1).map(PathBuf::from).collect();
    if trees.is_empty() {
        trees.push(root());
    }
    let columns: Vec<_> = trees.iter().map(|tree| measures(tree)).collect();
    let heads: Vec<String> = trees.iter().map(|tree| tree.display().to_string()).collect();
    let mut out = std::io::stdout().lock();
    writeln!(out, "| measure | {} |\n|---|{}", heads.join(" | "), "---|".repeat(trees.len()))?;
    for (row, first) in columns[0].iter().enumerate() {
        let cells: Vec<&str> = columns.iter().map(|column| column[row].value.as_str()).collect();
        writeln!(out, "| {} | {} |", first.name, cells.join(" | "))?;
    }
    Ok(())
}
