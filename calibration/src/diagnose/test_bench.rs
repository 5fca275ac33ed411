//! Two recorded clips of a world on a bench, to try the steps of the search on.

use super::library::Library;

use crate::diagnose::fit::bench::Bench;
use crate::diagnose::fit::effort::Effort;
use crate::diagnose::fit::floor;
use crate::diagnose::fit::shortlist::Scored;
use crate::diagnose::fit::sweep::Precision;
use crate::diagnose::ground::Ground;
use inference::interrupt::Interrupt;
use inference::kept::Kept;
use inference::likelihood::arm::ArmClips;
use inference::likelihood::cell::CellClips;
use inference::likelihood::object::ObjectClips;
use inference::likelihood::{Evidence, setting};
use shared_mem::cell::Cell;
use shared_mem::msg::MAX_JOINTS;
use shared_mem::theta::Theta;
use std::path::Path;
use worlds::draw;
use worlds::session::record;
use worlds::world::{Fault, Kind, World};

pub(super) const ONCE: Effort = Effort::of(1, Precision::Joints);

/// The parameters of the library's numbers.
type Parameters<'a> = &'a (dyn Fn(&[f64]) -> Theta + Sync);

/// The cell as it is shipped.
pub(super) fn shipped() -> Cell {
    Cell::parse(include_str!("../../../config/fr3_cell.toml"), Path::new("fr3_cell.toml")).expect("the shipped cell")
}

/// A world in which one effect acts.
pub(super) fn with_effect(name: &str, number: u64, kind: Kind, cell: &Cell) -> World {
    let place = draw::candidates(kind == Kind::Strokes).iter().position(|effect| effect.name == name);
    World::draw(number, kind, Fault::Single(place.expect("an effect")), cell)
}

/// The library's numbers as they are hidden in a world.
pub(super) fn truth(library: &Library, world: &World) -> Vec<f64> {
    let hidden = library.settings.numbers(&world.hidden);
    library.start().into_iter().zip(hidden).map(|(start, hidden)| hidden.unwrap_or(start)).collect()
}

/// A bench of any evidence; nothing of its work is kept.
pub(super) fn bench<'a>(evidence: &'a Evidence<'a>, library: &'a Library, interrupt: &'a Interrupt) -> Bench<'a> {
    Bench::new(evidence, library, interrupt, (Kept::nothing(), ""))
}

/// Asks the bench on which the world's clips lie; residuals weigh what the sensors' noise alone makes of them.
pub(super) fn on_bench<R>(
    (cell, world): (&Cell, &World),
    library: &Library,
    ask: impl FnOnce(&Bench<'_>, &[f64]) -> R,
) -> R {
    let theta = |numbers: &[f64]| library.theta(numbers);
    let clips = record(world, 2).expect("a session");
    let evidence = ArmClips::moments(cell, &clips, &theta as Parameters<'_>).expect("an arm");
    let interrupt = Interrupt::default();
    ask(&bench(&evidence, library, &interrupt), &floor::sensors_alone(&evidence))
}

/// Asks the bench on which the world's strokes lie, with the library of all effects that they could show.
pub(super) fn on_strokes<R>((cell, world): (&Cell, &World), ask: impl FnOnce(&Bench<'_>, &[f64]) -> R) -> R {
    let clips = record(world, 2).expect("a session");
    let base = setting::complete(cell, None).expect("a cell");
    let library = Library::new(cell, &base, Ground::of(&clips).as_ref(), &[87.0; MAX_JOINTS]);
    let theta = |numbers: &[f64]| library.theta(numbers);
    let arm = ArmClips::moments(cell, &clips, &theta as Parameters<'_>).expect("an arm");
    let object = ObjectClips::new(cell, clips, library.settings.clone()).expect("an object");
    let evidence = CellClips::new(Some(arm), object, |numbers: &[f64]| library.felt_by_arm(numbers));
    let interrupt = Interrupt::default();
    ask(&bench(&evidence, &library, &interrupt), &floor::sensors_alone(&evidence))
}

/// A candidate of which the score test says nothing.
pub(super) fn nothing_said_of(library: &Library, candidate: usize) -> Scored {
    let probes = library.candidates[candidate].alternatives[0].probes.len();
    Scored {
        candidate,
        alternative: 0,
        units: vec![0.0; probes],
        next: Vec::new(),
        gain: 0.0,
        cost: probes,
        cosine: 0.0,
        signal: 0.0,
        imitated: 0.0,
        p: 1.0,
    }
}
