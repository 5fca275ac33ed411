//! Two recorded excitations of a world on a bench, to try the steps of the search on.

use super::arm_clips::ArmClips;
use super::evidence::Evidence as _;
use super::fit::{Bench, Effort};
use super::library::Library;
use super::sweep::Precision;
use crate::benchmark::session::record;
use crate::benchmark::world::World;
use crate::interrupt::Interrupt;
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use std::path::Path;

/// One linearisation.
pub(super) const ONCE: Effort = Effort::of(1, Precision::Joints);

/// The parameters of the library's numbers.
type Parameters<'a> = &'a (dyn Fn(&[f64]) -> Theta + Sync);

/// The cell as it is shipped.
pub(super) fn shipped() -> Cell {
    Cell::parse(include_str!("../../../config/fr3_cell.toml"), Path::new("fr3_cell.toml")).expect("the shipped cell")
}

/// Asks the bench on which the world's clips lie; every channel weighs the same.
pub(super) fn on_bench<R>(
    (cell, world): (&Cell, &World),
    library: &Library,
    ask: impl FnOnce(&Bench<'_, ArmClips<Parameters<'_>>>, &[f64]) -> R,
) -> R {
    let theta = |numbers: &[f64]| library.theta(numbers);
    let clips = record(world, 2).expect("a session");
    let evidence = ArmClips::new(cell, &clips, &theta as Parameters<'_>).expect("an arm");
    let interrupt = Interrupt::default();
    let bench = Bench { evidence: &evidence, library, scatter: evidence.scatter(), interrupt: &interrupt };
    ask(&bench, &vec![1.0; evidence.channels().len()])
}
