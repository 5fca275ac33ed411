//! Logged torques tell a stiffness that cell.toml knows by a wide range alone, whatever acts besides.

use inference::controller::controlled;
use inference::interrupt::Interrupt;
use shared_mem::cell::{Cell, Ranges};
use shared_mem::recording::Clip;
use std::path::Path;
use worlds::draw;
use worlds::session::record;
use worlds::world::{Fault, Kind, World};

const CLIPS: usize = 4;

fn world(number: u64, effect: &str) -> World {
    let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    let cell = Cell::read(&shipped).expect("the shipped cell");
    let which = draw::candidates(false).iter().position(|info| info.name == effect).expect("an effect");
    World::draw(number, Kind::Excitation, Fault::Single(which), &cell)
}

/// A cell that knows nothing of its gains but their order of magnitude.
fn unknown(world: &World) -> Cell {
    let mut cell = world.cell.clone();
    let controller = cell.controller.as_mut().expect("a controller");
    (controller.stiffness, controller.damping) = (Vec::new(), Vec::new());
    controller.stiffness_range = Some(Ranges::All([5.0, 20_000.0]));
    controller.damping_range = Some(Ranges::All([1.0, 1000.0]));
    cell
}

fn asked(cell: &Cell, clips: &[Clip]) -> (Cell, Vec<String>) {
    let mut remarks = Vec::new();
    let cell = controlled(cell.clone(), clips, None, &mut remarks, &Interrupt::default()).expect("an arm");
    (cell, remarks)
}

#[test]
fn torques_tell_the_stiffness_under_loads_friction_and_delays_that_nobody_knows() {
    for (number, effect) in
        [(1, "payload"), (2, "joint_coulomb_friction"), (3, "command_delay"), (4, "joint_viscous_friction")]
    {
        let world = world(number, effect);
        let clips = record(&world, CLIPS).expect("clips");
        let (cell, remarks) = asked(&unknown(&world), &clips);
        let controller = cell.controller.expect("a controller");
        let ranges = controller.stiffness_range.expect("ranges");
        let truth = &world.hidden.arm.as_ref().expect("gains").stiffness;
        for (joint, truth) in truth.iter().enumerate() {
            let [low, high] = ranges.of(joint).expect("a range");
            let found = controller.stiffness[joint];
            assert!((low..=high).contains(truth), "{effect}, joint {joint}: {truth} is not within {low} to {high}");
            assert!(high < 20.0 * low, "{effect}, joint {joint}: {low} to {high} says little");
            assert!((found / truth).ln().abs() < 0.7, "{effect}, joint {joint}: {found} is not {truth}");
        }
        assert!(remarks.len() == 1 && remarks[0].contains("joint 1"), "{remarks:?}");
    }
}

#[test]
fn a_stated_stiffness_stays_and_without_torques_nothing_is_said() {
    let world = world(1, "payload");
    let mut clips = record(&world, CLIPS).expect("clips");
    assert_eq!(asked(&world.cell, &clips), (world.cell.clone(), Vec::new()));
    clips.iter_mut().for_each(|clip| clip.measured.tau.clear());
    let cell = unknown(&world);
    assert_eq!(asked(&cell, &clips), (cell, Vec::new()));
}
