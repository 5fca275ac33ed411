//! Sealed worlds in which intervals were once too narrow.

use shared_mem::cell::Cell;
use shared_mem::interrupt::Interrupt;
use std::path::Path;
use tools::coverage::Subject;
use worlds::world::{Fault, Kind, World};

/// In this world the deviance hardly rises along friction, mass and height together, and the hits are rough: slopes, and a look
/// at a few of their sigmas, left friction three half widths away from the truth.
#[test]
fn intervals_reach_as_far_as_rough_hits_leave_a_number_open() {
    let text = include_str!("../../../config/fr3_cell.toml");
    let cell = Cell::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file");
    let world = World::draw(24, Kind::Strokes, Fault::Nothing, &cell);
    let session = Subject::Object.examine(&world, 8, &Interrupt::default());
    let found =
        |name: &str| session.printed.iter().find(|printed| printed.name == name).expect("a number with an interval");
    assert!(found("friction").holds(), "{:?}", found("friction"));
    let height = found("centre_of_mass[2]");
    let [low, high] = height.interval;
    // It is told less since what a vertical force does to the joints is left out, and one interval in twenty may miss.
    assert!((height.truth - height.value).abs() <= 1.5 * 0.5 * (high - low), "{height:?}");
}
