//! A rollout asks nothing of the allocator once its worker and its trace stand, with effects and without.

mod counting;
mod stroke;

use counting::allocations;
use stroke::{Stroke, theta};
use twin::rollout::CellTrace;

#[test]
fn starting_running_stopping_and_resuming_allocate_nothing() {
    let stroke = Stroke::new();
    let every_kind = r#"
        [[effect]]
        name = "command_delay"
        delay = 0.0035
        [[effect]]
        name = "torque_delay"
        delay = 0.0012
        [[effect]]
        name = "joint_elasticity"
        stiffness = 8000.0
        [[effect]]
        name = "joint_coulomb_friction"
        coulomb = 0.5
        [[effect]]
        name = "pressure_distribution"
        reach = 0.8
        [[effect]]
        name = "tracker_smoothing"
        time_constant = 0.03
    "#;
    for effects in ["", every_kind] {
        let mut worker = stroke.worker(Some(&theta(effects)));
        let mut trace = stroke.run(&mut worker);
        assert!(trace.contact.is_some());
        let (mut checkpoint, mut control) = (worker.checkpoint(), trace.clone());
        let before = allocations();
        for _ in 0..2 {
            stroke.start(&mut worker);
            trace.clear();
            assert!(worker.run_until_contact(&stroke.course(), &mut trace).is_some());
            worker.checkpoint_into(&mut checkpoint);
            control.clone_from(&trace);
            worker.run(&stroke.course(), &mut trace);
            trace.clone_from(&control);
            worker.resume(&checkpoint);
            worker.run(&stroke.course(), &mut trace);
        }
        assert_eq!(allocations() - before, 0, "with effects: {}", !effects.is_empty());
        let _: &CellTrace = &trace;
    }
}
