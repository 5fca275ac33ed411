//! The arm's equations of motion against known numbers, against each other and against closed forms.

use proptest::prelude::*;
use shared_mem::cell::{Cell, Controller, ControllerKind, Robot, Tool};
use shared_mem::msg::joints_from;
use twin::arm::{ArmModel, JointState, Joints, MAX_JOINTS, MassProperties, PointForce};
use twin::description::shown_robot;

fn state() -> impl Strategy<Value = JointState> {
    (prop::array::uniform7(-2.5..2.5f64), prop::array::uniform7(-2.0..2.0f64))
        .prop_map(|(q, dq)| JointState { q: joints_from(&q), dq: joints_from(&dq) })
}

fn times(mass: &[Joints; MAX_JOINTS], v: &Joints) -> Joints {
    mass.map(|row| row.iter().zip(v).map(|(m, v)| m * v).sum())
}

fn largest_difference(a: &Joints, b: &Joints) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

#[test]
fn gravity_torque_of_the_fr3_in_its_ready_pose_is_the_vendor_models() {
    let arm = ArmModel::fr3();
    let vendor = joints_from(&[0.0, -1.709, -0.639, 18.958, 0.792, 1.588, 0.0]);
    let gravity = arm.gravity(arm.ready());
    assert!(largest_difference(&gravity, &vendor) < 5e-3, "{gravity:?}");
}

#[test]
fn flange_of_the_fr3_lies_where_the_data_sheet_puts_it() {
    // All joints at 0: the arm points straight up and the flange down, 88 mm in front of the base axis.
    let flange = ArmModel::fr3().flange(&[0.0; MAX_JOINTS]);
    let [x, y, z] = flange.position();
    assert!((x - 0.088).abs() < 1e-12 && y.abs() < 1e-12, "{x} {y}");
    assert!((z - (0.333 + 0.316 + 0.384 - 0.107)).abs() < 1e-12, "{z}");
    let pose = ArmModel::fr3().O_T_EE(&[0.0; MAX_JOINTS]);
    assert!((pose[12] - x).abs() < 1e-12 && (pose[10] + 1.0).abs() < 1e-12, "{pose:?}");
}

proptest! {
    #[test]
    fn the_mass_matrix_is_symmetric_positive_definite_and_agrees_with_accelerations(
        state in state(), tau in prop::array::uniform7(-20.0..20.0f64),
    ) {
        let arm = ArmModel::fr3();
        let mass = arm.mass_matrix(&state.q);
        let transposed: [Joints; MAX_JOINTS] = std::array::from_fn(|i| std::array::from_fn(|j| mass[j][i]));
        prop_assert_eq!(mass, transposed);
        let energy: f64 = times(&mass, &state.dq).iter().zip(&state.dq).map(|(p, v)| p * v).sum();
        prop_assert!(energy >= 0.074 * state.dq.iter().map(|v| v * v).sum::<f64>());
        let tau = joints_from(&tau);
        let ddq = arm.accelerations(&state, &tau);
        let mut back = times(&mass, &ddq);
        for (b, bias) in back.iter_mut().zip(arm.bias(&state)) {
            *b += bias;
        }
        prop_assert!(largest_difference(&back, &tau) < 1e-9);
    }

    #[test]
    fn bias_is_gravity_plus_coriolis_and_quadratic_in_speed(state in state()) {
        let arm = ArmModel::fr3();
        let (gravity, coriolis) = (arm.gravity(&state.q), arm.coriolis(&state));
        let sum = std::array::from_fn(|i| gravity[i] + coriolis[i]);
        prop_assert!(largest_difference(&arm.bias(&state), &sum) < 1e-10);
        let fast = JointState { q: state.q, dq: state.dq.map(|v| 2.0 * v) };
        prop_assert!(largest_difference(&arm.coriolis(&fast), &coriolis.map(|c| 4.0 * c)) < 1e-9);
    }

    #[test]
    fn gravity_is_the_slope_of_the_potential_energy(state in state(), joint in 0..7usize) {
        let arm = ArmModel::fr3();
        let energy = |shift: f64| {
            let mut q = state.q;
            q[joint] += shift;
            arm.energy(&JointState::at_rest(q))
        };
        let slope = (energy(1e-5) - energy(-1e-5)) / 2e-5;
        prop_assert!((slope - arm.gravity(&state.q)[joint]).abs() < 1e-6);
    }

    #[test]
    fn the_jacobian_is_the_slope_of_the_tip_position_and_carries_forces(state in state(), joint in 0..7usize) {
        let mut cell = fr3_cell();
        cell.tool = Some(Tool { mass: 0.25, length: 0.16, radius: 0.012 });
        let arm = ArmModel::from_cell(&cell).expect("the built-in arm");
        let tip = |shift: f64| {
            let mut q = state.q;
            q[joint] += shift;
            arm.tip(&q).position()
        };
        let point = tip(0.0);
        let column = arm.jacobian(&state.q, point)[joint];
        let force = [3.0, -2.0, 5.0];
        let torque = arm.torque_of(&state.q, &PointForce { point, force });
        let mut power = 0.0;
        for axis in 0..3 {
            let slope = (tip(1e-6)[axis] - tip(-1e-6)[axis]) / 2e-6;
            prop_assert!((slope - column[axis]).abs() < 1e-8);
            power += column[axis] * force[axis];
        }
        prop_assert!((power - torque[joint]).abs() < 1e-10);
    }
}

#[test]
fn an_undamped_arm_keeps_its_energy() {
    let arm = ArmModel::fr3();
    let mut state = JointState::at_rest(*arm.ready());
    let (start, lowest) = (arm.energy(&state), arm.energy(&JointState::at_rest(joints_from(&[0.0, 3.0]))));
    for _ in 0..10_000 {
        arm.step(&mut state, &[0.0; MAX_JOINTS], 1e-3);
    }
    let drift = (arm.energy(&state) - start).abs() / (start - lowest).abs();
    assert!(drift < 5e-3, "{drift}");
}

#[test]
fn a_payload_weighs_what_it_weighs() {
    let mut arm = ArmModel::fr3();
    let q = *arm.ready();
    let (before, reach) = (arm.gravity(&q), arm.flange(&q).position());
    arm.add_at_flange(&MassProperties::new(2.0, [0.0; 3], [0.0; 6]));
    let added = arm.gravity(&q)[1] - before[1];
    assert!((added + 2.0 * 9.81 * reach[0]).abs() < 1e-9, "{added}");
}

fn fr3_cell() -> Cell {
    Cell { robot: Some(Robot { model: Some("fr3".into()), ..Robot::default() }), ..Cell::default() }
}

fn urdf_cell(text: &str, controller: Controller) -> (tempfile::TempDir, Cell) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("arm.urdf"), text).expect("a file");
    let cell = Cell {
        robot: Some(Robot { urdf: Some("arm.urdf".into()), ..Robot::default() }),
        controller: Some(controller),
        folder: folder.path().to_owned(),
        ..Cell::default()
    };
    (folder, cell)
}

/// Two rods without inertia of their own, with point masses at their ends, hanging down; the second mass hangs on a
/// fixed joint, and the first axis points the other way than the second.
const DOUBLE_PENDULUM: &str = r#"<robot name="double">
<link name="base"/>
<link name="upper"><inertial><origin xyz="0 0 -0.4"/><mass value="1.5"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
<link name="lower"/>
<link name="weight"><inertial><origin xyz="0 0 -0.1"/><mass value="0.7"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
<joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 -1 0"/></joint>
<joint name="elbow" type="revolute"><parent link="upper"/><child link="lower"/><origin xyz="0 0 -0.4"/><axis xyz="0 1 0"/><limit lower="-3" upper="3" effort="5" velocity="4"/></joint>
<joint name="mount" type="fixed"><parent link="lower"/><child link="weight"/><origin xyz="0 0 -0.2"/></joint>
</robot>"#;

#[test]
fn a_urdf_double_pendulum_moves_as_the_closed_form_says() {
    let (_folder, cell) = urdf_cell(DOUBLE_PENDULUM, Controller::default());
    let arm = ArmModel::from_cell(&cell).expect("a serial chain");
    assert_eq!(arm.joint_names(), ["shoulder", "elbow"]);
    assert_eq!((arm.torque_limit()[0], arm.torque_limit()[1]), (f64::INFINITY, 5.0));
    let (m1, m2, l1, l2, g) = (1.5, 0.7, 0.4, 0.3, 9.81);
    let (q, dq) = ([0.4_f64, 0.9], [1.1, -0.6]);
    // Absolute angles a, b from hanging, both about -y: a = q0, b = q0 - q1.
    let (a, b, da, db) = (q[0], q[0] - q[1], dq[0], dq[0] - dq[1]);
    let (c, s): (f64, f64) = ((a - b).cos(), (a - b).sin());
    let (m11, m12, m22) = ((m1 + m2) * l1 * l1, m2 * l1 * l2 * c, m2 * l2 * l2);
    let ra = -m2 * l1 * l2 * s * db * db - (m1 + m2) * g * l1 * a.sin();
    let rb = m2 * l1 * l2 * s * da * da - m2 * g * l2 * b.sin();
    let det = m11 * m22 - m12 * m12;
    let (dda, ddb) = ((m22 * ra - m12 * rb) / det, (m11 * rb - m12 * ra) / det);
    let ddq = arm.accelerations(&JointState { q: joints_from(&q), dq: joints_from(&dq) }, &[0.0; MAX_JOINTS]);
    assert!((ddq[0] - dda).abs() < 1e-9 && (ddq[1] - (dda - ddb)).abs() < 1e-9, "{ddq:?} {dda} {ddb}");
}

#[test]
fn a_urdf_that_is_no_serial_arm_is_refused_with_joint_and_remedy() {
    let arm = |name: &str, parent: &str| {
        format!(
            r#"<link name="{name}_a"/><link name="{name}_b"/>
<joint name="{name}_1" type="continuous"><parent link="{parent}"/><child link="{name}_a"/></joint>
<joint name="{name}_2" type="continuous"><parent link="{name}_a"/><child link="{name}_b"/></joint>
"#
        )
    };
    let fork =
        DOUBLE_PENDULUM.replace("</robot>", &format!("{}{}</robot>", arm("left", "lower"), arm("right", "weight")));
    let (_folder, cell) = urdf_cell(&fork, Controller::default());
    let error = ArmModel::from_cell(&cell).unwrap_err().to_string();
    assert!(error.contains("line 10: joints `left_1` (line 10) and `right_1` (line 13) branch off"), "{error}");
    let remedy = "--joints shoulder,elbow,left_1,left_2` or `--joints shoulder,elbow,right_1,right_2`";
    assert!(error.contains(remedy) && error.contains("`joints` beside `urdf`"), "{error}");

    // Two that turn at the arm's end: either may be its last joint.
    let turn = |name: &str| {
        format!(
            r#"<link name="{name}"/><joint name="{name}_joint" type="continuous"><parent link="weight"/><child link="{name}"/></joint>"#
        )
    };
    let (_folder, cell) = urdf_cell(
        &DOUBLE_PENDULUM.replace("</robot>", &format!("{}\n{}</robot>", turn("a"), turn("b"))),
        Controller::default(),
    );
    let error = ArmModel::from_cell(&cell).expect_err("no serial arm").to_string();
    assert!(error.contains("joints `a_joint` (line 9) and `b_joint` (line 10) branch off"), "{error}");

    for (from, to, told) in [
        ("type=\"revolute\"", "type=\"floating\"", "line 7: joint `elbow` is neither revolute"),
        ("<link name=\"lower\"/>", "", "line 7: link `lower` is used by joint `elbow`"),
        ("<parent link=\"upper\"/>", "<parent link=\"weight\"/>", "line 4: link `lower` hangs in a loop"),
        ("<axis xyz=\"0 1 0\"/>", "<axis xyz=\"0 0 0\"/>", "line 7: joint `elbow` has an axis of length 0"),
        (
            "<child link=\"lower\"/>",
            "<child link=\"upper\"/>",
            "line 7: link `upper` hangs on joints `shoulder` (line 6)",
        ),
        (
            "<link name=\"upper\">",
            "<link name=\"moon\"/><link name=\"upper\">",
            "line 3: links `base` (line 2) and `moon`",
        ),
    ] {
        assert!(DOUBLE_PENDULUM.contains(from), "{from}");
        let (_folder, cell) = urdf_cell(&DOUBLE_PENDULUM.replacen(from, to, 1), Controller::default());
        let error = ArmModel::from_cell(&cell).expect_err(told).to_string();
        assert!(error.contains(told) && !error.contains('\n'), "{error}\n{told}");
    }

    let massless = DOUBLE_PENDULUM.replace("<mass value=\"0.7\"/>", "<mass value=\"0\"/>");
    let (_folder, cell) = urdf_cell(&massless, Controller::default());
    let error = ArmModel::from_cell(&cell).unwrap_err().to_string();
    assert!(error.contains("`elbow`") && error.contains("rotor_inertia"), "{error}");

    let (_folder, cell) = urdf_cell("<robot name=\"x\"><link", Controller::default());
    let error = ArmModel::from_cell(&cell).unwrap_err().to_string();
    assert!(error.contains("arm.urdf") && !error.contains('\n'), "{error}");
}

/// A hand as ROS describes one: two fingers that slide apart, the second following the first, on a body that is fixed to the
/// arm's last link.
#[test]
fn fingers_are_no_joints_of_the_arm_and_their_mass_hangs_on_its_last_link() {
    let finger = |name: &str, y: f64, mimic: &str| {
        format!(
            r#"<link name="{name}"><inertial><origin xyz="0 0 -0.1"/><mass value="0.05"/><inertia ixx="0" ixy="0" ixz="0" iyy="0" iyz="0" izz="0"/></inertial></link>
<joint name="{name}_joint" type="prismatic"><parent link="weight"/><child link="{name}"/><axis xyz="0 {y} 0"/><limit lower="0" upper="0.04" effort="20" velocity="0.2"/>{mimic}</joint>"#
        )
    };
    let hand = [finger("finger_1", 1.0, ""), finger("finger_2", -1.0, "<mimic joint=\"finger_1_joint\"/>")].concat();
    let (_folder, cell) =
        urdf_cell(&DOUBLE_PENDULUM.replace("</robot>", &format!("{hand}</robot>")), Controller::default());
    let arm = ArmModel::from_cell(&cell).expect("ROS shows this robot");
    assert_eq!(
        (arm.joint_names(), arm.held_joints().iter().map(|held| held.name.as_str()).collect::<Vec<_>>()),
        (&["shoulder".to_owned(), "elbow".to_owned()][..], vec!["finger_1_joint", "finger_2_joint"])
    );
    // The same arm with the fingers' mass in the weight.
    let heavier = DOUBLE_PENDULUM.replace("<mass value=\"0.7\"/>", "<mass value=\"0.8\"/>");
    let (_folder, cell) = urdf_cell(&heavier, Controller::default());
    let other = ArmModel::from_cell(&cell).expect("a serial chain");
    let state = JointState { q: joints_from(&[0.4, 0.9]), dq: joints_from(&[1.1, -0.6]) };
    let [a, b] = [&arm, &other].map(|arm| arm.accelerations(&state, &[0.0; MAX_JOINTS]));
    assert!((a[0] - b[0]).abs() < 1e-9 && (a[1] - b[1]).abs() < 1e-9, "{a:?} {b:?}");
    assert_eq!(arm.flange(&state.q).position(), other.flange(&state.q).position());
    // A wheel or a camera that turns beside the arm does not hide it.
    let beside = r#"<link name="wheel"/><joint name="wheel_joint" type="continuous"><parent link="base"/><child link="wheel"/></joint>"#;
    let (_folder, cell) =
        urdf_cell(&DOUBLE_PENDULUM.replace("</robot>", &format!("{beside}</robot>")), Controller::default());
    assert_eq!(ArmModel::from_cell(&cell).expect("an arm and a wheel").joint_names(), ["shoulder", "elbow"]);
}

#[test]
fn joints_of_a_urdf_have_the_names_that_recordings_give_them() {
    let (_folder, mut cell) = urdf_cell(DOUBLE_PENDULUM, Controller::default());
    let own = ArmModel::from_cell(&cell).expect("a serial chain");
    let at = |cell: &Cell, names: [&str; 2]| {
        let shown = shown_robot(cell).expect("an arm").expect("a shape");
        (shown.frames_at)(&names.map(str::to_owned), &[0.3, -0.2]).map(|moving| (shown.fixed.len(), moving))
    };
    let as_described = at(&cell, ["shoulder", "elbow"]);
    let robot = cell.robot.as_mut().expect("an arm");
    robot.joints = vec!["m1".into(), "m2".into()];
    let arm = ArmModel::from_cell(&cell).expect("the same chain");
    assert_eq!((arm.joint_names(), arm.described_joint_names()), (&["m1".into(), "m2".into()][..], own.joint_names()));
    let state = JointState { q: joints_from(&[0.4, 0.9]), dq: joints_from(&[1.1, -0.6]) };
    assert_eq!(arm.bias(&state), own.bias(&state));
    assert!(as_described.is_some() && at(&cell, ["m1", "m2"]) == as_described);
    cell.robot.as_mut().expect("an arm").joints.pop();
    let error = ArmModel::from_cell(&cell).unwrap_err().to_string();
    assert!(error.contains("`robot.joints` in cell.toml holds 1 values; this arm has 2 joints"), "{error}");
}

#[test]
fn rotor_inertia_of_the_cell_stands_in_for_a_missing_model() {
    let robot = Robot { joints: vec!["pan".into(), "tilt".into()], ..Robot::default() };
    let controller =
        Controller { kind: ControllerKind::JointPd, rotor_inertia: vec![0.5, 0.25], ..Controller::default() };
    let mut cell = Cell { robot: Some(robot), controller: Some(controller), ..Cell::default() };
    let arm = ArmModel::from_cell(&cell).expect("joints alone");
    let ddq = arm.accelerations(&JointState::default(), &joints_from(&[1.0, 1.0]));
    assert_eq!((ddq[0], ddq[1], arm.has_geometry()), (2.0, 4.0, false));
    cell.controller = Some(Controller { rotor_inertia: vec![0.5], ..Controller::default() });
    assert!(ArmModel::from_cell(&cell).unwrap_err().to_string().contains("2 joints"));
}
