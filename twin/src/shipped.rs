//! The cell that the repository ships, for tests.

use shared_mem::cell::Cell;
use std::path::Path;

/// As it is.
pub(crate) fn shipped() -> Cell {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    Cell::read(&path).expect("the shipped cell")
}

/// With exact encoders.
pub(crate) fn shipped_exact() -> Cell {
    let mut cell = shipped();
    (cell.simulation.q_noise, cell.simulation.dq_noise) = (0.0, 0.0);
    cell
}
