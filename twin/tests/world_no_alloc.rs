//! A step of a world asks nothing of the allocator, whatever touches in it.

mod counting;

use counting::allocations;
use nalgebra::{Isometry3, Vector3};
use twin::world::{BodyPlan, Hold, Piece, World, box_hull, cylinder_hull};

#[test]
fn a_step_allocates_nothing_while_bodies_fall_tumble_and_rest() {
    let body = |hull, hold| {
        let piece = Piece::new(hull, Isometry3::identity());
        BodyPlan::homogeneous("body", vec![piece], 0.2, hold).with_friction(0.5)
    };
    let free = |x, z| Hold::Free(Isometry3::new(Vector3::new(x, 0.0, z), Vector3::new(0.3, 0.2, 0.1)));
    let bodies = [
        body(box_hull([1.0, 1.0, 0.1]).expect("a box"), Hold::Fixed(Isometry3::translation(0.0, 0.0, -0.05))),
        body(box_hull([0.06, 0.05, 0.04]).expect("a box"), free(0.0, 0.1)),
        body(cylinder_hull(0.03, 0.08).expect("a can"), free(0.01, 0.25)),
        body(box_hull([0.06, 0.05, 0.04]).expect("a box"), free(-0.01, 0.4)),
    ];
    let mut world = World::new(&bodies).expect("a world");
    let (before, mut touched) = (allocations(), false);
    for _ in 0..2000 {
        world.step();
        touched |= world.touch(0, 1) && world.touch(1, 2);
    }
    assert_eq!(allocations() - before, 0);
    assert!(touched, "nothing fell on anything");
}
