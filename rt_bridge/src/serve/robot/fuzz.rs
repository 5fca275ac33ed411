//! Whatever a client commands, the robot stays a robot: it stops itself, but never loses its numbers.

use super::tests::{motion, robot};
use super::*;
use crate::serve::wire::Request;
use proptest::prelude::*;

/// Numbers that clients send by mistake, and any others.
fn number() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), Just(f64::NAN), Just(f64::INFINITY), -1e-3..1e-3, -10.0..10.0, any::<f64>()]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]
    #[test]
    fn no_command_makes_the_state_anything_but_numbers(
        kind in 0_usize..5,
        controller in 0_usize..3,
        values in proptest::collection::vec(number(), 7 * 6),
        holds in 0_usize..3,
        flags in any::<[bool; 3]>(),
    ) {
        use GeneratorKind::{CartesianPose, CartesianVelocity, JointPosition, JointVelocity};
        let mut robot = robot();
        let kinds = [JointPosition, JointVelocity, CartesianPose, CartesianVelocity, GeneratorKind::None];
        let controllers = [Controller::JointImpedance, Controller::CartesianImpedance, Controller::External];
        robot.request(MOVE, 7, &Request::Move(motion(kinds[kind], controllers[controller])));
        for k in 0..60 {
            let at = |i: usize| values[(k / 10 * 7 + i) % values.len()];
            let held = robot.hold.trace().q;
            let mut set_point = SetPoint { answers: robot.now(), motion_finished: flags[0] && k > 50, ..SetPoint::default() };
            set_point.q_c = std::array::from_fn(|i| held[i] + if k < 10 * holds { 0.0 } else { at(i) });
            set_point.dq_c = std::array::from_fn(|i| if k < 10 * holds { 0.0 } else { at(i) });
            set_point.tau_J_d = set_point.dq_c;
            set_point.O_dP_EE_c = std::array::from_fn(|i| set_point.dq_c[i]);
            set_point.O_T_EE_c = std::array::from_fn(|i| at(i % 7));
            set_point.elbow_c = flags[1].then(|| [at(0), at(1)]);
            robot.tick((k % 4 != 3 || flags[2]).then_some(&set_point));
            let state = robot.state();
            let all = state.q.iter().chain(&state.tau_J).chain(&state.O_T_EE).chain(&state.q_d).chain(&state.O_F_ext_hat_K);
            for number in all {
                prop_assert!(number.get().is_finite(), "cycle {}", k);
            }
        }
        prop_assert!(robot.body.measured.dq.iter().all(|dq| dq.abs() < 10.0));
    }
}
