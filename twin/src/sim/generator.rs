//! Random numbers of a simulated cell.

use rand_pcg::Pcg64;
use shared_mem::cell::Cell;

/// The generator behind one instrument: the cell's seed, and a stream of its own for each instrument, so that adding
/// one instrument does not change what another reports.
pub(crate) fn generator(cell: &Cell, stream: u64) -> Pcg64 {
    Pcg64::new(u128::from(cell.simulation.seed), u128::from(stream))
}
