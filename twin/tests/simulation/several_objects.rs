//! Several objects on one table: each by itself, and what happens where they meet.

use nalgebra::Vector3;
use shared_mem::cell::Cell;
use shared_mem::msg::object::ObjectName;
use shared_mem::theta::Theta;
use shared_mem::time::TICK;
use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use twin::arm::ArmModel;
use twin::control::Drive;
use twin::sim::{SimCell, SimScene};

/// The shipped cell, measured without noise.
fn shipped_exact() -> Cell {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
    let mut cell = Cell::read(&path).expect("the shipped cell");
    (cell.simulation.q_noise, cell.simulation.dq_noise) = (0.0, 0.0);
    cell
}

/// The shipped cell with the table lifted to 30 mm under the tip and boxes of these names at so much from the tip, so that turning
/// joint 1 strikes one 62 mm beside it.
fn striking(boxes: &[(&str, [f64; 2])]) -> Cell {
    let mut cell = shipped_exact();
    let arm = ArmModel::from_cell(&cell).expect("an FR3");
    let [x, y, z] = arm.tip(arm.ready()).position();
    cell.table = Some(shared_mem::cell::Table { height: z - 0.03 });
    let shipped = cell.objects.pop().expect("a box");
    let named = |(name, [ahead, aside]): &(&str, [f64; 2])| shared_mem::cell::Object {
        name: Some((*name).to_owned()),
        start: Some([x + ahead, y + aside]),
        ..shipped.clone()
    };
    cell.objects = boxes.iter().map(named).collect();
    cell
}

const BEFORE_THE_TOOL: [f64; 2] = [0.0, 0.062];

/// Turns joint 1 to 0.6 rad within a second; `each` sees the scene after every period.
fn strike(scene: &mut SimScene, periods: u64, mut each: impl FnMut(&SimScene)) {
    let start = scene.cell().q();
    for k in 0..periods {
        let t = (k as f64 * TICK).min(1.0);
        let (mut q_d, mut dq_d) = (start, [0.0; 8]);
        q_d[0] += 0.6 * t * t * t * (10.0 - 15.0 * t + 6.0 * t * t);
        dq_d[0] = 0.6 * 30.0 * t * t * (1.0 - t) * (1.0 - t);
        scene.step(&Drive::JointImpedance { q_d, dq_d });
        each(scene);
    }
}

fn place(scene: &SimScene, number: usize) -> Vector3<f64> {
    Vector3::from(scene.object(number).expect("a box").position())
}

fn scene(cell: &Cell) -> SimScene {
    SimScene::new(cell, None).expect("a scene")
}

#[test]
fn an_object_that_is_struck_moves_as_it_would_alone_and_another_far_away_stays_where_it_is() {
    let far = [0.0, -0.3];
    let end = |boxes: &[(&str, [f64; 2])]| {
        let mut scene = scene(&striking(boxes));
        let before: Vec<_> = (0..boxes.len()).map(|number| place(&scene, number)).collect();
        strike(&mut scene, 2000, |_| {});
        (before, (0..boxes.len()).map(|number| place(&scene, number)).collect::<Vec<_>>(), scene.cell().q())
    };
    let (_, alone, q) = end(&[("cup", BEFORE_THE_TOOL)]);
    let (before, first, of_first) = end(&[("cup", BEFORE_THE_TOOL), ("plate", far)]);
    let (_, second, of_second) = end(&[("plate", far), ("cup", BEFORE_THE_TOOL)]);
    assert!((first[0] - before[0]).norm() > 0.05, "{}", first[0] - before[0]);
    assert_eq!((first[0], of_first), (alone[0], q));
    assert_eq!((second[1], of_second), (alone[0], q));
    assert_eq!(first[1], before[1], "nobody touches it");
    assert_eq!(second[0], before[1]);
}

#[test]
fn an_object_pushes_the_next_one_and_goes_not_through_it() {
    let mut scene = scene(&striking(&[("cup", BEFORE_THE_TOOL), ("plate", [0.0, 0.062 + 0.08])]));
    let before = [place(&scene, 0), place(&scene, 1)];
    let mut nearest = f64::INFINITY;
    strike(&mut scene, 2500, |scene| nearest = nearest.min((place(scene, 1) - place(scene, 0)).norm()));
    let moved = [0, 1].map(|number| place(&scene, number) - before[number]);
    assert!(moved[0].y > 0.05 && moved[1].y > 0.03, "{moved:?}");
    assert!(nearest > 0.0595, "centres of two boxes of 60 mm came as near as {nearest} m");
    assert!([0, 1].iter().all(|number| (place(&scene, *number).z - before[*number].z).abs() < 1e-4), "{moved:?}");
    // Whatever the two do, both have come to rest, and the arm is where it was sent.
    let still = [place(&scene, 0), place(&scene, 1)];
    strike_on(&mut scene);
    assert!([0, 1].iter().all(|number| (place(&scene, *number) - still[*number]).norm() < 1e-5));
}

/// Holds where the arm is commanded to be for a while.
fn strike_on(scene: &mut SimScene) {
    let hold = scene.cell().command();
    (0..300).for_each(|_| scene.step(&hold));
}

#[test]
fn among_many_bodies_a_push_goes_about_as_far_as_under_the_law_of_one() {
    // The neighbour is so near from the start on that the two are many bodies, and not in the way.
    let mut apart = scene(&striking(&[("cup", BEFORE_THE_TOOL)]));
    let mut together = scene(&striking(&[("cup", BEFORE_THE_TOOL), ("plate", [0.0805, 0.062])]));
    strike(&mut apart, 2000, |_| {});
    strike(&mut together, 2000, |_| {});
    let (one, many) = (place(&apart, 0), place(&together, 0));
    assert!(one != many && (one - many).norm() < 0.015, "{one} and {many}");
    let [of_one, of_many] = [&apart, &together].map(|scene| scene.cell().q());
    assert!((0..7).all(|joint| (of_one[joint] - of_many[joint]).abs() < 1e-3), "{of_one:?} {of_many:?}");
}

#[test]
fn poses_stand_in_the_snapshot_by_their_names() {
    let mut cell = striking(&[("cup", BEFORE_THE_TOOL), ("plate", [0.0, -0.3])]);
    let seen = scene(&cell).snapshot();
    let named = |name: &str| seen.of(&ObjectName::new(name).expect("a name"));
    assert_eq!((named("cup"), named("plate").is_some(), named("bowl")), (seen.object, true, None));
    assert_ne!(named("plate"), seen.object);
    // One without a name is where it was before there were names.
    cell.objects.truncate(1);
    cell.objects[0].name = None;
    let alone = scene(&cell).snapshot();
    assert_eq!((alone.object, alone.named.all().len()), (seen.object, 0));
    assert_eq!(alone, SimCell::new(&cell, None).expect("a cell").snapshot());
}

#[test]
fn objects_without_a_start_stand_beside_each_other_and_overlapping_ones_are_refused() {
    let mut cell = striking(&[("cup", [0.0, 0.062]), ("plate", [0.0, 0.07]), ("bowl", [0.0, 0.3])]);
    let error = SimScene::new(&cell, None).err().expect("one place").to_string();
    assert!(error.contains("`cup` and `plate` overlap") && error.contains("start = [x, y]"), "{error}");
    cell.objects.iter_mut().for_each(|object| object.start = None);
    let scene = scene(&cell);
    for (a, b) in [(0, 1), (1, 2)] {
        assert!((place(&scene, b) - place(&scene, a)).norm() > 0.1, "{a} and {b}");
    }
    cell.objects[2].mesh = Some("nowhere.obj".into());
    cell.objects[2].shape = None;
    let error = SimScene::new(&cell, None).err().expect("no mesh").to_string();
    assert!(error.contains("nowhere.obj") && !error.contains('\n'), "{error}");
    cell.objects.truncate(2);
    cell.objects[1].mass = Some(f64::NAN);
    let error = SimScene::new(&cell, None).err().expect("no mass").to_string();
    assert!(error.starts_with("object `plate`: ") && !error.contains('\n'), "{error}");
}

const LAPTOP: &str = "<robot name='laptop'>
  <link name='base'>
    <inertial><mass value='1.1'/><inertia ixx='0.0088' iyy='0.0045' izz='0.0132' ixy='0' ixz='0' iyz='0'/></inertial>
    <collision><geometry><box size='0.22 0.31 0.018'/></geometry></collision>
  </link>
  <link name='lid'>
    <inertial><origin xyz='0 0 0.105'/><mass value='0.5'/><inertia ixx='0.0058' iyy='0.0018' izz='0.0040' ixy='0' ixz='0' iyz='0'/></inertial>
    <collision><origin xyz='0 0 0.105'/><geometry><box size='0.006 0.31 0.21'/></geometry></collision>
  </link>
  <joint name='hinge' type='revolute'>
    <parent link='base'/><child link='lid'/><origin xyz='0.11 0 0.012'/><axis xyz='0 -1 0'/>
    <limit lower='-0.5' upper='1.5708' effort='9' velocity='9'/><dynamics friction='FRICTION' damping='0.02'/>
  </joint>
</robot>";

/// A cup before the tool and a laptop far away, whose lid starts open at this angle.
fn with_laptop(urdf: &str, hinge: f64) -> (tempfile::TempDir, Cell) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("laptop.urdf"), urdf).expect("room");
    let mut cell = striking(&[("cup", BEFORE_THE_TOOL)]);
    cell.folder = folder.path().to_owned();
    let [x, y] = cell.objects[0].start.expect("a start");
    cell.objects.push(shared_mem::cell::Object {
        name: Some("laptop".into()),
        urdf: Some("laptop.urdf".into()),
        joints: [("hinge".to_owned(), hinge)].into(),
        start: Some([x, y - 0.6]),
        ..shared_mem::cell::Object::default()
    });
    (folder, cell)
}

/// How far the lid is turned against the base [rad].
fn opened(scene: &SimScene) -> f64 {
    let [base, lid] = ["laptop", "laptop_lid"].map(|name| {
        let name = ObjectName::new(name).expect("a name");
        scene.snapshot().of(&name).expect("a body").isometry().rotation
    });
    (base.inverse() * lid).scaled_axis().dot(&-Vector3::y())
}

#[test]
fn a_lid_falls_shut_or_is_held_by_its_friction_while_something_else_is_pushed() {
    for (friction, falls) in [("0.0", true), ("2.0", false)] {
        let (_folder, cell) = with_laptop(&LAPTOP.replace("FRICTION", friction), 0.4);
        let mut scene = scene(&cell);
        assert_eq!(scene.names().iter().map(ObjectName::text).collect::<Vec<_>>(), ["cup", "laptop", "laptop_lid"]);
        assert!((opened(&scene) - 0.4).abs() < 1e-9);
        let before = [place(&scene, 0), place(&scene, 1)];
        strike(&mut scene, 2500, |_| {});
        assert!((place(&scene, 0) - before[0]).norm() > 0.05, "the cup stays at {}", place(&scene, 0));
        assert!((place(&scene, 1) - before[1]).norm() < 2e-3, "the laptop slides to {}", place(&scene, 1));
        let angle = opened(&scene);
        assert!(
            if falls { (angle - FRAC_PI_2).abs() < 0.02 } else { (angle - 0.4).abs() < 1e-3 },
            "{friction}: {angle}"
        );
    }
}

#[test]
fn a_joint_is_put_where_a_tracker_sees_its_link_and_what_cannot_be_simulated_is_refused() {
    let urdf = LAPTOP.replace("FRICTION", "2.0");
    let (_folder, cell) = with_laptop(&urdf, 0.4);
    let mut scene = scene(&cell);
    let seen = {
        let (_other, elsewhere) = with_laptop(&urdf, 1.0);
        SimScene::new(&elsewhere, None).expect("a scene").object(2).expect("a lid")
    };
    scene.set_object(2, &seen, Vector3::zeros(), Vector3::zeros());
    assert!((opened(&scene) - 1.0).abs() < 1e-9, "{}", opened(&scene));
    for (urdf, hinge, told) in [
        (urdf.replace("type='revolute'", "type='continuous'"), 0.4, "joint `hinge` has no limits"),
        (urdf.replace("name='lid'", "name='li d'").replace("child link='lid'", "child link='li d'"), 0.4, "is no name"),
        (urdf.replace("<mass value='0.5'/>", "<mass value='0'/>"), 0.4, "no mass or inertia"),
        (urdf.clone(), 2.0, "outside of its limits"),
    ] {
        let (_folder, cell) = with_laptop(&urdf, hinge);
        let error = SimScene::new(&cell, None).err().unwrap_or_else(|| panic!("{told}")).to_string();
        assert!(error.contains(told) && !error.contains('\n'), "{error}");
    }
    let blocks = "[[effect]]\nname = \"restitution\"\nrestitution = 0.3\n";
    let theta: Theta = shared_mem::toml_file::parse(blocks, Path::new("theta.toml")).expect("a theta.toml");
    let error = SimScene::new(&cell, Some(&theta)).err().expect("an effect on a hit").to_string();
    assert!(error.contains("`restitution`") && error.contains("moves in itself"), "{error}");
}
