//! Microseconds per step of the FR3 under its joint-impedance controller: torque, accelerations, integration.
//!
//! `cargo bench -p twin --bench arm`. The controller runs in every step, at both step sizes.

use criterion::{Criterion, criterion_group, criterion_main};
use shared_mem::cell::ControllerKind;
use shared_mem::msg::joints_from;
use std::hint::black_box;
use twin::arm::{ArmModel, ControlLaw, JointState};

fn law(arm: &ArmModel) -> ControlLaw {
    ControlLaw {
        kind: ControllerKind::JointImpedance,
        stiffness: joints_from(&[600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0]),
        damping: joints_from(&[50.0, 50.0, 50.0, 50.0, 30.0, 25.0, 15.0]),
        torque_limit: *arm.torque_limit(),
    }
}

/// Chases a pose 0.1 rad away from where the arm starts, so that nothing is at rest; starts over every 2000 steps.
fn arm_step(criterion: &mut Criterion) {
    let arm = ArmModel::fr3();
    let law = law(&arm);
    let start = JointState { q: *arm.ready(), dq: [0.2; 8] };
    let q_d = arm.ready().map(|q| q + 0.1);
    let mut group = criterion.benchmark_group("arm");
    for dt in [1e-3, 2.5e-4] {
        let (mut state, mut steps) = (start, 0);
        group.bench_function(format!("controlled step {} ms", dt * 1e3), |bench| {
            bench.iter(|| {
                steps += 1;
                if steps % 2000 == 0 {
                    state = start;
                }
                black_box(arm.controlled_step(&mut state, &law, black_box(&q_d), &[0.0; 8], dt));
            });
        });
    }
    group.bench_function("accelerations", |bench| {
        bench.iter(|| arm.accelerations(black_box(&start), black_box(&[0.0; 8])));
    });
    group.bench_function("bias", |bench| bench.iter(|| arm.bias(black_box(&start))));
    group.finish();
}

criterion_group!(benches, arm_step);
criterion_main!(benches);
