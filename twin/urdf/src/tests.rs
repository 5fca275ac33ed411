//! What is read of a URDF, what is refused and in which words, and that no text makes the reader fall over.

use crate::{Axis, Inertia, JointLimit, JointType, Robot, Shape, UrdfError, Vec3, read_from_string};
use proptest::prelude::*;

const ARM: &str = r#"<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE robot>
<!-- a comment with <robot> in it -->
<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <material name="grey"><color rgba="1 1 1 1"/></material>
  <link name="base"/>
  <link name="tip &amp; tool">
    <visual><origin xyz="9 9 9"/><geometry><box size="1 1 1"/></geometry></visual>
    <inertial>
      <mass value=" 1.5 "/>
      <origin xyz="0 0 -0.4" rpy="0.1 -0.2 0.3"/>
      <inertia ixx="1" ixy="2" ixz="3" iyy="4" iyz="5" izz="6e-1"/>
    </inertial>
  </link>
  <gazebo reference="base"><link name="base"/><inertial/></gazebo>
  <joint name="turn" type="revolute">
    <origin xyz="1
                 2 3"/>
    <parent link="base"/>
    <child link="tip &amp; tool"/>
    <limit lower="-3" upper="3" effort="5" velocity="4"/>
    <axis xyz="0 0 2"/>
  </joint>
</robot>
"#;

fn read(text: &str) -> Result<Robot, UrdfError> {
    read_from_string(text)
}

#[test]
fn links_and_joints_are_read_and_everything_else_is_passed_over() {
    let robot = read(ARM).expect("a whole file");
    assert_eq!((robot.name.as_str(), robot.links.len(), robot.joints.len()), ("arm", 2, 1));
    let [base, tip] = &robot.links[..] else { panic!("{robot:?}") };
    assert_eq!((base.name.as_str(), base.inertial.mass.value), ("base", 0.0));
    assert_eq!((tip.name.as_str(), tip.inertial.mass.value), ("tip & tool", 1.5));
    assert_eq!((tip.inertial.origin.xyz, tip.inertial.origin.rpy), (Vec3([0.0, 0.0, -0.4]), Vec3([0.1, -0.2, 0.3])));
    assert_eq!(tip.inertial.inertia, Inertia { ixx: 1.0, ixy: 2.0, ixz: 3.0, iyy: 4.0, iyz: 5.0, izz: 0.6 });
    let joint = &robot.joints[0];
    assert_eq!((joint.parent.link.as_str(), joint.child.link.as_str()), ("base", "tip & tool"));
    assert_eq!((joint.joint_type, joint.axis), (JointType::Revolute, Axis { xyz: Vec3([0.0, 0.0, 2.0]) }));
    assert_eq!((joint.origin.xyz, joint.origin.rpy), (Vec3([1.0, 2.0, 3.0]), Vec3([0.0; 3])));
    assert_eq!(joint.limit, JointLimit { lower: -3.0, upper: 3.0, effort: 5.0, velocity: 4.0 });
    assert_eq!(read(&format!("\u{feff}{ARM}")).expect("with a byte order mark"), robot);
}

#[test]
fn of_two_of_a_kind_the_first_counts_as_in_urdfdom() {
    let robot = read(ARM).expect("a whole file");
    for (from, to) in [
        ("rpy=\"0.1 -0.2 0.3\"/>", "rpy=\"0.1 -0.2 0.3\"/><origin xyz=\"7 7 7\"/>"),
        ("<mass value=\" 1.5 \"/>", "<mass value=\" 1.5 \"/><mass value=\"no number\"/>"),
        ("</inertial>", "</inertial><inertial><mass value=\"3\"/></inertial>"),
        (
            "<axis xyz=\"0 0 2\"/>",
            "<axis xyz=\"0 0 2\"/><axis xyz=\"1 0 0\"/><origin xyz=\"7 7 7\"/><parent link=\"moon\"/>",
        ),
    ] {
        assert!(ARM.contains(from), "{from}");
        assert_eq!(read(&ARM.replacen(from, to, 1)).expect("ROS reads it"), robot, "{to}");
    }
}

#[test]
fn links_and_joints_know_their_lines_and_whom_they_follow() {
    let robot = read(ARM).expect("a whole file");
    assert_eq!(robot.links.iter().map(|link| link.line).collect::<Vec<_>>(), [6, 7]);
    assert_eq!((robot.joints[0].line, robot.joints[0].mimicked.as_deref()), (16, None));
    let follows = joint("", "<mimic joint=\"finger_1\" multiplier=\"1\"/>").expect("a joint that follows");
    assert_eq!(follows.mimicked.as_deref(), Some("finger_1"));
}

/// A joint between two links, with this version of the format and these tags.
fn joint(version: &str, tags: &str) -> Result<crate::Joint, UrdfError> {
    let robot = read(&format!(
        r#"<robot{version}><link name="a"/><link name="b"/><joint name="j" type="continuous"><parent link="a"/><child link="b"/>{tags}</joint></robot>"#
    ))?;
    Ok(robot.joints[0].clone())
}

#[test]
fn defaults_and_the_meaning_of_limits_follow_the_version_of_the_format() {
    let bare = joint("", "").expect("only what must be there");
    assert_eq!((bare.axis.xyz, bare.limit), (Vec3([1.0, 0.0, 0.0]), JointLimit::default()));
    let old = joint(" version=\"1.1\"", "<limit velocity=\"2\"/>").expect("a speed alone");
    assert_eq!(old.limit, JointLimit { velocity: 2.0, ..JointLimit::default() });
    let none = joint("", "<limit lower=\"-1\" upper=\"1\"/>").expect("stops alone").limit;
    assert_eq!((none.effort, none.velocity), (0.0, 0.0), "as exporters write that they know none");
    let all = JointLimit { lower: f64::NEG_INFINITY, upper: f64::INFINITY, effort: f64::INFINITY, velocity: 2.0 };
    assert_eq!(joint(" version=\"1.2\"", "<limit velocity=\"2\"/>").expect("a speed alone").limit, all);
    assert_eq!(
        joint(" version=\"rubbish\"", "<limit lower=\"1\" upper=\"0\" velocity=\"2\"/>").expect("1.0").limit.upper,
        0.0
    );

    // A quarter turn about z, and one down about y, where roll and yaw are one.
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for (quaternion, turned) in [([0.0, 0.0, half, half], [0.0, 0.0, 1.0]), ([0.0, half, 0.0, half], [0.0, 1.0, 0.0])] {
        let [x, y, z, w] = quaternion;
        let tag = format!("<origin quat_xyzw=\"{x} {y} {z} {w}\"/>");
        let rpy = joint(" version=\"1.1\"", &tag).expect("a quaternion").origin.rpy.0;
        for (angle, quarters) in rpy.iter().zip(turned) {
            assert!((angle - quarters * std::f64::consts::FRAC_PI_2).abs() < 1e-7, "{quaternion:?}: {rpy:?}");
        }
        assert_eq!(joint("", &tag).expect("passed over, as in urdfdom").origin.rpy.0, [0.0; 3]);
    }
}

#[test]
fn what_is_wrong_is_named_with_line_and_element() {
    let cases = [
        ("<mass value=\" 1.5 \"/>", "", "line 13: <inertial> of link `tip & tool` has no <mass>"),
        ("<mass value=\" 1.5 \"/>", "<mass/>", "line 10: <mass> has no `value`"),
        (" 1.5 ", "1.5 kg", "line 10: `value` of <mass> is no number: `1.5 kg`"),
        (" 1.5 ", "NaN", "line 10: `value` of <mass> is no number"),
        (" 1.5 ", "inf", "line 10: `value` of <mass> is infinite"),
        ("izz=\"6e-1\"", "", "line 12: <inertia> has no `izz`"),
        ("0 0 -0.4", "0 0", "line 11: `xyz` of <origin> must be 3 numbers: `0 0`"),
        ("0 0 -0.4", "0 0 0 0", "line 11: `xyz` of <origin> must be 3 numbers"),
        ("0 0 -0.4", "0 0 inf", "line 11: `xyz` of <origin> must be 3 numbers"),
        ("<axis xyz=\"0 0 2\"/>", "<axis/>", "line 22: joint `turn`: <axis> has no `xyz`"),
        ("<parent link=\"base\"/>", "", "line 23: joint `turn` has no <parent>"),
        ("revolute", "helical", "line 16: joint `turn` is of type `helical`; known are revolute"),
        ("type=\"revolute\"", "", "line 16: joint `turn`: <joint> has no `type`"),
        (
            "<link name=\"base\"/>",
            "<link name=\"base\"/><link name=\"base\"/>",
            "line 6: a second link is called `base`",
        ),
        ("<link name=\"base\"/>", "<link/>", "line 6: <link> has no `name`"),
        ("<link name=\"base\"/>", "<link name=\"b&#10;\u{1b}[2J\"/>", "line 6: `name` of <link> is longer"),
        ("<link name=\"base\"/>", "<xacro:arm/>", "line 6: <xacro:arm> is xacro; expand it first"),
        ("<link name=\"base\"/>", "<link name=\"base\" name=\"b\"/>", "line 6: <link>: "),
        ("<link name=\"base\"/>", "<link name=\"&base;\"/>", "line 6: `name` of <link>: "),
        ("<link name=\"base\"/>", "<link name=\"& a\n\u{7f} b;\"/>", "line 6: `name` of <link>: "),
        ("</joint>", "", "line 24: "),
        ("</robot>", "", "line 25: the file ends within 1 open elements"),
        ("</robot>", "</robot>\n<robot/>", "line 25: a second <robot>"),
        ("</robot>", "</robot>more", "line 24: text outside of <robot>: `more`"),
    ];
    for (from, to, expected) in cases {
        assert!(ARM.contains(from), "{from}");
        let error = read(&ARM.replacen(from, to, 1)).expect_err(expected).to_string();
        assert!(error.starts_with(expected) && !error.contains(char::is_control), "{error:?}\n{expected:?}");
    }
    for (text, expected) in [
        ("", "line 1: there is no <robot>"),
        ("\n\n<sdf version='1.7'/>", "line 3: <sdf> stands where <robot> must"),
        ("<robot name='x'><link", "line 1: "),
        ("<robot><link name='a'>", "line 1: the file ends within link `a`"),
    ] {
        let error = read(text).expect_err(expected).to_string();
        assert!(error.starts_with(expected), "{error:?}\n{expected:?}");
    }
    for (tags, expected) in [
        ("<limit lower=\"1\" upper=\"0\"/>", "joint `j`: `upper` of <limit> is 0, below `lower`, 1"),
        ("<limit effort=\"-1\"/>", "joint `j`: `effort` of <limit> is negative"),
        ("<origin rpy=\"0 0 0\" quat_xyzw=\"0 0 0 1\"/>", "joint `j`: <origin> has both `rpy` and `quat_xyzw`"),
        ("<origin quat_xyzw=\"0 0 0 0\"/>", "joint `j`: `quat_xyzw` of <origin> has length 0"),
    ] {
        let error = joint(" version=\"1.2\"", tags).expect_err(expected);
        assert!(error.what.starts_with(expected), "{error}\n{expected}");
    }
}

#[test]
fn deep_wide_and_many_elements_are_refused_or_read_without_a_deep_stack() {
    let deep = format!("<robot>{}", "<a>".repeat(1 << 20));
    assert_eq!(read(&deep).expect_err("deep").what, "elements stand more than 64 deep in each other");
    let links: String = (0..5000).map(|i| format!("<link name=\"{i}\"/>")).collect();
    assert_eq!(read(&format!("<robot>{links}</robot>")).expect_err("many").what, "more than 4096 links");
    let wide: String = (0..100_000).map(|i| format!(" a{i}=\"1\" xmlns:n{i}=\"n\"")).collect();
    let robot = read(&format!("<robot><link name=\"a\"{wide}/></robot>")).expect("attributes are passed over");
    assert_eq!(robot.links.len(), 1);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 512, ..ProptestConfig::default() })]
    #[test]
    fn a_changed_file_is_read_as_numbers_or_refused_in_one_line(
        changes in proptest::collection::vec((0..ARM.len(), 0_usize..40, "[<>/\"'&;:!?\\[\\]=a-z0-9 .\\-]{0,6}"), 1..4),
    ) {
        let mut text = ARM.to_owned();
        for (at, length, new) in changes {
            let at = at.min(text.len());
            let end = (at + length).min(text.len());
            text.replace_range(at..end, &new);
        }
        match read(&text) {
            Ok(robot) => {
                let links = robot.links.iter().flat_map(|l| l.inertial.origin.xyz.0.into_iter().chain([l.inertial.mass.value]));
                let joints = robot.joints.iter().flat_map(|j| j.origin.xyz.0.into_iter().chain(j.axis.xyz.0));
                prop_assert!(links.chain(joints).all(f64::is_finite));
            }
            Err(error) => {
                prop_assert!(!error.what.contains(char::is_control), "{:?}", error);
                prop_assert!(error.line >= 1 && error.line <= text.lines().count().max(1) + 1, "{}", error);
            }
        }
    }
}

#[test]
fn what_a_link_touches_with_and_how_a_joint_rubs_are_read() {
    let robot = read(
        "<robot name='a'><link name='b'>\
         <visual><geometry><sphere radius='9'/></geometry></visual>\
         <collision><origin xyz='0 0 1'/><geometry><box size='1 2 3'/></geometry></collision>\
         <collision><geometry><cylinder radius='0.1' length='0.4'/></geometry></collision>\
         <collision><geometry><mesh filename='m.stl'/></geometry></collision>\
         <collision><geometry><capsule radius='1'/></geometry></collision></link><link name='c'/>\
         <joint name='j' type='revolute'><parent link='b'/><child link='c'/><limit lower='0' upper='1' velocity='1'/>\
         <dynamics damping='0.2' friction='0.7'/></joint></robot>",
    )
    .expect("a robot");
    let shapes: Vec<Option<Shape>> = robot.links[0].collisions.iter().map(|c| c.shape.clone()).collect();
    let mesh = Shape::Mesh { file: "m.stl".into(), scale: [1.0; 3] };
    let cylinder = Shape::Cylinder { radius: 0.1, length: 0.4 };
    assert_eq!(shapes, [Some(Shape::Box([1.0, 2.0, 3.0])), Some(cylinder), Some(mesh), None]);
    assert_eq!(robot.links[0].collisions[0].origin.xyz.0, [0.0, 0.0, 1.0]);
    assert_eq!((robot.joints[0].friction, robot.joints[0].damping), (0.7, 0.2));
    assert!(robot.links[1].collisions.is_empty());
}
