//! URDFs whose numbers are odd, or with a base that moves in another order: what is taken, and what is said of it.

use std::fmt::Write as _;
use std::path::Path;
use twin::arm::ArmModel;

const LIMIT: &str = "<limit lower='-2.8' upper='2.8' effort='80' velocity='2'/>";
const SOLID: &str = "<inertia ixx='.02' iyy='.02' izz='.01' ixy='0' ixz='0' iyz='0'/>";

/// A joint with what it carries.
fn joint(
    name: &str,
    kind: &str,
    [parent, child]: [&str; 2],
    axis: &str,
    limit: &str,
    (mass, inertia): (f64, &str),
) -> String {
    format!(
        "<link name='{child}'><inertial><origin xyz='0 0 .1'/><mass value='{mass}'/>{inertia}</inertial></link><joint name='{name}' type='{kind}'><origin \
         xyz='0 0 .2'/><parent link='{parent}'/><child link='{child}'/><axis xyz='{axis}'/>{limit}</joint>"
    )
}

/// An arm of five joints on `base`; of its third the limit and the inertia are given.
fn arm(base: &str, limit: &str, inertia: &str) -> String {
    let mut text = String::new();
    for k in 1..=5 {
        let before = if k == 1 { base.to_owned() } else { format!("l{}", k - 1) };
        let (limit, inertia) = if k == 3 { (limit, inertia) } else { (LIMIT, SOLID) };
        let axis = if k % 2 == 1 { "0 0 1" } else { "0 1 0" };
        text += &joint(&format!("j{k}"), "revolute", [&before, &format!("l{k}")], axis, limit, (1.0, inertia));
    }
    text
}

fn read(inner: &str) -> Result<ArmModel, String> {
    let text = format!("<robot name='r'><link name='root'/>{inner}</robot>");
    ArmModel::from_urdf(&text, Path::new("r.urdf"), &[]).map_err(|error| error.to_string())
}

#[test]
fn a_base_that_slides_and_turns_in_any_order_is_held_and_one_of_parts_is_doubted() {
    let wide = "<limit lower='-5' upper='5' effort='100' velocity='1'/>";
    for order in ["xyt", "txy", "xty"] {
        for light in [0.001, 5.0] {
            let (mut text, mut before) = (String::new(), "root".to_owned());
            for (place, kind) in order.chars().enumerate() {
                let (of, axis) = match kind {
                    'x' => ("prismatic", "1 0 0"),
                    'y' => ("prismatic", "0 1 0"),
                    _ => ("continuous", "0 0 1"),
                };
                let (link, mass) = (format!("b{place}"), if place == 2 { 60.0 } else { light });
                text += &joint(&format!("base_{kind}"), of, [&before, &link], axis, wide, (mass, SOLID));
                before = link;
            }
            let found = read(&(text + &arm(&before, LIMIT, SOLID))).expect("an arm");
            if light < 1.0 {
                assert_eq!((found.dof(), found.held_joints().len()), (5, 3), "{order}");
            } else {
                assert_eq!((found.dof(), found.doubts().len()), (8, 1), "{order}");
                assert!(found.doubts()[0].contains("--joints j1,j2,j3,j4,j5 "), "{:?}", found.doubts());
            }
        }
    }
}

#[test]
fn limits_that_are_none_are_swapped_or_in_degrees_are_said_and_bodies_that_cannot_be() {
    let inertia = |numbers: &str| {
        let [xx, yy, zz, xy] = [0, 1, 2, 3].map(|k| numbers.split(' ').nth(k).expect("four"));
        format!("<inertia ixx='{xx}' iyy='{yy}' izz='{zz}' ixy='{xy}' ixz='0' iyz='0'/>")
    };
    for (limit, moments, range, said) in [
        (LIMIT, "0.02 0.02 0.01 0", 2.8, ""),
        (
            "<limit lower='0' upper='0' effort='80' velocity='2'/>",
            "0.02 0.02 0.01 0",
            f64::INFINITY,
            "gives j3 no range",
        ),
        ("", "0.02 0.02 0.01 0", f64::INFINITY, "gives j3 no range"),
        ("<limit effort='80' velocity='2'/>", "0.02 0.02 0.01 0", f64::INFINITY, "gives j3 no range"),
        (
            "<limit lower='2.8' upper='-2.8' effort='80' velocity='2'/>",
            "0.02 0.02 0.01 0",
            2.8,
            "above `upper` in <limit> of j3",
        ),
        ("<limit lower='-170' upper='170' effort='80' velocity='2'/>", "0.02 0.02 0.01 0", 170.0, "limits in degrees"),
        ("<limit lower='-12.566' upper='12.566' effort='80' velocity='2'/>", "0.02 0.02 0.01 0", 12.566, ""),
        (LIMIT, "0.001 0.001 0.001 0.05", 2.8, "<inertia> of l3"),
        (LIMIT, "0.001 0.001 0.5 0", 2.8, "<inertia> of l3"),
    ] {
        let found = read(&arm("root", limit, &inertia(moments))).expect("an arm");
        assert_eq!(found.q_max()[2], range, "{limit} {moments}");
        let doubts = found.doubts().join("\n");
        assert!(if said.is_empty() { doubts.is_empty() } else { doubts.contains(said) }, "{limit} {moments}: {doubts}");
    }
}

#[test]
fn what_is_mounted_at_the_end_is_doubted_by_its_name_or_by_the_side_to_which_it_opens() {
    let small = "<limit lower='-1.5' upper='1.5' effort='80' velocity='2'/>";
    let to_one_side = "<limit lower='-0.1' upper='1.7' effort='80' velocity='2'/>";
    for (name, link, limit, said) in [
        ("j6", "l6", LIMIT, ""),
        ("j6", "l6", to_one_side, "`j6` opens to one side by 1.80 rad"),
        ("camera_tilt", "l6", small, "(camera)"),
        ("j6", "clamp", LIMIT, "(clamp)"),
        ("spindle", "l6", LIMIT, "(spindle)"),
    ] {
        let last = joint(name, "revolute", ["l5", link], "0 1 0", limit, (0.1, SOLID));
        let found = read(&(arm("root", LIMIT, SOLID) + &last)).expect("an arm");
        assert_eq!(found.dof(), 6);
        let doubts = found.doubts().join("\n");
        assert!(doubts.contains(said) && doubts.is_empty() == said.is_empty(), "{name}: {doubts}");
        assert!(said.is_empty() || doubts.contains("--joints j1,j2,j3,j4,j5 "), "{doubts}");
    }
}

#[test]
fn the_joints_that_a_refusal_names_are_as_many_as_an_arm_has() {
    let mut text = joint("torso_1", "revolute", ["root", "t1"], "0 0 1", LIMIT, (5.0, SOLID));
    text += &joint("torso_2", "revolute", ["t1", "t2"], "0 1 0", LIMIT, (5.0, SOLID));
    for side in ["left", "right", "leg"] {
        let mut before = if side == "leg" { "root".to_owned() } else { "t2".to_owned() };
        for k in 1..=7 {
            let link = format!("{side}_l{k}");
            text += &joint(&format!("{side}_{k}"), "revolute", [&before, &link], "0 1 0", LIMIT, (1.0, SOLID));
            before = link;
        }
    }
    let refused = read(&text).expect_err("three limbs");
    let mut lists = 0;
    for list in refused.split("--joints ").skip(1) {
        let names: Vec<String> = list.split(['`', ' ']).next().expect("names").split(',').map(str::to_owned).collect();
        let urdf = format!("<robot name='r'><link name='root'/>{text}</robot>");
        let found = ArmModel::from_urdf(&urdf, Path::new("r.urdf"), &names).expect("what is named can be typed");
        assert_eq!(found.dof(), 7, "{names:?}");
        lists += 1;
    }
    assert_eq!(lists, 2, "{refused}");
    assert!(read("<link name='a'/>").expect_err("two roots").contains("both hang on nothing"));
    let mut fixed = String::new();
    let _written =
        write!(fixed, "<link name='a'/><joint name='f' type='fixed'><parent link='root'/><child link='a'/></joint>");
    let none = read(&fixed).expect_err("nothing moves");
    assert!(none.contains("no joint of it turns or slides") && !none.contains("`joints`"), "{none}");
}

#[test]
fn an_arm_begins_inside_of_its_ranges() {
    for (limit, ready) in [
        (LIMIT, 0.0),
        ("<limit lower='0' upper='2' effort='80' velocity='2'/>", 0.2),
        ("<limit lower='-0.15' upper='0' effort='80' velocity='2'/>", -0.075),
        ("<limit lower='-3' upper='-1' effort='80' velocity='2'/>", -2.0),
        ("", 0.0),
    ] {
        let found = read(&arm("root", limit, SOLID)).expect("an arm");
        assert!((found.ready()[2] - ready).abs() < 1e-12, "{limit}: {}", found.ready()[2]);
    }
}

#[test]
fn a_file_that_is_not_there_is_named_with_the_folder_that_was_looked_in() {
    let robot = shared_mem::cell::Robot { urdf: Some("nowhere.urdf".into()), ..Default::default() };
    let cell = shared_mem::cell::Cell { robot: Some(robot), ..Default::default() };
    let error = ArmModel::from_cell(&cell).expect_err("there is none").to_string();
    let here = std::env::current_dir().expect("a folder").join("nowhere.urdf");
    assert!(error.contains(here.to_str().expect("UTF-8")), "{error}");
}
