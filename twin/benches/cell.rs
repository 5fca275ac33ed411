//! What one control period of 1 ms costs: the simulated cell with the tool far from the object and in contact, a whole
//! stroke (the arm comes, hits the box, the box slides to rest), and a cycle of the shadow. Real-time factor = 1 ms over
//! the time shown.
//!
//! A stroke's time is that of all its 2500 periods: microseconds a step are its milliseconds over 2.5.

#[path = "../tests/stroke/mod.rs"]
mod stroke;

use criterion::{Criterion, criterion_group, criterion_main};
use shared_mem::cell::{Cell, Table};
use shared_mem::msg::arm::ArmState;
use shared_mem::time::TICK_NS;
use std::hint::black_box;
use std::path::Path;
use stroke::{Stroke, theta};
use twin::arm::ArmModel;
use twin::control::Drive;
use twin::shadow::Shadow;
use twin::sim::SimCell;

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

/// 2500 steps of 1 ms each: the arm alone, and arm, tool and box in hit and slide.
fn strokes(criterion: &mut Criterion) {
    let stroke = Stroke::new();
    let mut worker = stroke.worker(None);
    let mut trace = stroke.run(&mut worker);
    assert!(trace.contact.is_some());
    criterion.bench_function("2500 periods of the arm alone", |bencher| {
        bencher.iter(|| {
            worker.start(stroke.joints_ns[0], Some(&stroke.arm), None, Some(&stroke.commands));
            trace.clear();
            worker.run(&stroke.course(), &mut trace);
        });
    });
    criterion.bench_function("2500 periods of arm, tool and box in hit and slide", |bencher| {
        bencher.iter(|| {
            stroke.start(&mut worker);
            trace.clear();
            worker.run(&stroke.course(), &mut trace);
        });
    });
    let mut worker = stroke.worker(Some(&theta(
        "[[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = 0.8\n[[effect]]\nname = \"command_delay\"\ndelay = 0.004",
    )));
    criterion.bench_function("the same with dry friction in the joints and a late command", |bencher| {
        bencher.iter(|| {
            stroke.start(&mut worker);
            trace.clear();
            worker.run(&stroke.course(), &mut trace);
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
            state.device_ns += TICK_NS;
            state.stamp_ns += TICK_NS;
            state.cycle += 1;
            black_box(shadow.on_state(&state, 0)).expect("the same arm");
        });
    });
}

criterion_group!(benches, periods, strokes, shadow);
criterion_main!(benches);
