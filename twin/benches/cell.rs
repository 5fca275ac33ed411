//! What one control period of 1 ms costs: the simulated cell with the tool far from the object and in contact, and a
//! whole cycle of the shadow. Real-time factor = 1 ms over the time shown.

use criterion::{Criterion, criterion_group, criterion_main};
use shared_mem::cell::{Cell, Table};
use shared_mem::msg::arm::ArmState;
use std::hint::black_box;
use std::path::Path;
use twin::arm::ArmModel;
use twin::shadow::Shadow;
use twin::sim::{Drive, PERIOD_NS, SimCell};

fn shipped() -> Cell {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    Cell::read(&path).expect("the shipped cell")
}

/// The table lifted to 30 mm under the tip, and the tip 1 mm inside the box.
fn touching() -> Cell {
    let mut cell = shipped();
    let arm = ArmModel::from_cell(&cell).expect("an FR3");
    let tip = arm.tip(arm.ready()).position();
    cell.table = Some(Table { height: tip[2] - 0.03 });
    cell.simulation.object_position = [tip[0], tip[1] + 0.030 + 0.012 - 0.001];
    cell
}

fn periods(criterion: &mut Criterion) {
    let mut cell = SimCell::new(&shipped(), None).expect("a cell");
    let drive = Drive::JointImpedance { q_d: cell.q(), dq_d: [0.0; 8] };
    criterion.bench_function("a period, nothing touches", |bencher| bencher.iter(|| cell.step(black_box(&drive))));
    let mut cell = SimCell::new(&touching(), None).expect("a cell");
    let (q, object) = (cell.q(), cell.object().expect("a box"));
    let drive = Drive::JointImpedance { q_d: q, dq_d: [0.0; 8] };
    criterion.bench_function("a period in contact", |bencher| {
        bencher.iter(|| {
            cell.set_arm(&q[..7], &[0.0; 7]);
            cell.set_object(&object, Default::default(), Default::default());
            cell.step(black_box(&drive));
            assert!(cell.contact_force() > 0.0);
        });
    });
}

fn shadow(criterion: &mut Criterion) {
    let description = shipped();
    let mut robot = SimCell::new(&description, None).expect("a cell");
    let mut state = ArmState::default();
    robot.read(&mut state);
    let mut shadow = Shadow::new(&description, None).expect("a shadow");
    criterion.bench_function("a cycle of the shadow", |bencher| {
        bencher.iter(|| {
            state.device_ns += PERIOD_NS;
            state.stamp_ns += PERIOD_NS;
            state.cycle += 1;
            black_box(shadow.on_state(&state, 0)).expect("the same arm");
        });
    });
}

criterion_group!(benches, periods, shadow);
criterion_main!(benches);
