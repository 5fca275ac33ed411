//! Which of a URDF's joints are the arm's, of robots with all that hangs on arms: hands, wheels, a second arm.

use std::path::Path;
use twin::arm::{ArmModel, HeldJoint};

/// A URDF as it grows: a chain of links from `base` on, and what is hung on it.
struct Robot(String);

impl Robot {
    /// An arm of `joints` that turn by half a turn and more with 30 N m.
    fn arm(joints: usize) -> Self {
        let mut robot = Self("<link name='base'/>".into());
        for k in 1..=joints {
            let before = if k == 1 { "base".to_owned() } else { format!("link_{}", k - 1) };
            robot = robot.joint(&format!("joint_{k}"), "continuous", [&before, &format!("link_{k}")], "");
        }
        robot
    }

    /// A joint with the link that it carries; `more` stands in the joint's element.
    fn joint(self, name: &str, kind: &str, [parent, child]: [&str; 2], more: &str) -> Self {
        let limit = if more.contains("<limit") { "" } else { "<limit effort='30' velocity='1'/>" };
        let axis = if name.ends_with(['1', '3', '5', '7']) { "0 0 1" } else { "0 1 0" };
        Self(format!(
            "{}\n<link name='{child}'><inertial><origin xyz='0.01 0 0.1'/><mass value='0.8'/><inertia ixx='.004' iyy='.004' izz='.002' ixy='0' \
             ixz='0' iyz='0'/></inertial></link>\n<joint name='{name}' type='{kind}'><origin xyz='0 0 .15'/><parent link='{parent}'/><child \
             link='{child}'/><axis xyz='{axis}'/>{more}{limit}</joint>",
            self.0
        ))
    }

    /// A joint of a finger: to one side, and weak.
    fn finger(self, name: &str, ends: [&str; 2]) -> Self {
        self.joint(name, "revolute", ends, "<limit lower='0' upper='1.51' effort='2' velocity='1'/>")
    }

    fn slide(self, name: &str, ends: [&str; 2], upper: f64) -> Self {
        let limit = format!("<limit lower='0' upper='{upper}' effort='20' velocity='0.2'/>");
        self.joint(name, "prismatic", ends, &limit)
    }

    /// A link without mass that is fixed to another one.
    fn fixed(self, link: &str, parent: &str) -> Self {
        Self(format!(
            "{}\n<link name='{link}'/><joint name='to_{link}' type='fixed'><parent link='{parent}'/><child link='{link}'/></joint>",
            self.0
        ))
    }

    fn read(&self, joints: &[&str]) -> Result<ArmModel, String> {
        let joints: Vec<String> = joints.iter().map(|&name| name.to_owned()).collect();
        let text = format!("<robot name='robot'>{}</robot>", self.0);
        ArmModel::from_urdf(&text, Path::new("robot.urdf"), &joints).map_err(|error| error.to_string())
    }

    fn refused(&self, joints: &[&str]) -> String {
        self.read(joints).err().unwrap_or_else(|| panic!("read: {}", self.0))
    }
}

/// The arm has the first `joints` of `Robot::arm`, and holds others, each for a reason with these words.
fn assert_arm(robot: &Robot, joints: usize, held: &[(&str, &str)]) {
    let arm = robot.read(&[]).unwrap_or_else(|error| panic!("{error}\n{}", robot.0));
    let wanted: Vec<String> = (1..=joints).map(|k| format!("joint_{k}")).collect();
    assert_eq!(arm.joint_names(), wanted);
    let found: Vec<&str> = arm.held_joints().iter().map(|held| held.name.as_str()).collect();
    assert_eq!(found, held.iter().map(|(name, _)| *name).collect::<Vec<_>>(), "{:?}", arm.held_joints());
    for (found, (name, why)) in arm.held_joints().iter().zip(held) {
        assert!(found.why.contains(why), "{name}: {}", found.why);
    }
}

#[test]
fn fingers_that_turn_are_none_of_the_arms_joints() {
    let hand = Robot::arm(6).fixed("end_effector", "link_6");
    let one = hand.finger("finger_joint_1", ["link_6", "finger_1"]);
    assert_arm(&one, 6, &[("finger_joint_1", "named as a finger is")]);
    let two = one.finger("finger_joint_2", ["link_6", "finger_2"]);
    assert_arm(&two, 6, &[("finger_joint_1", "finger"), ("finger_joint_2", "finger")]);
    let mut three = Robot::arm(6).fixed("end_effector", "link_6");
    for k in ["1", "2", "3"] {
        let (finger, tip) = (format!("finger_{k}"), format!("tip_{k}"));
        three = three.finger(&format!("finger_joint_{k}"), ["link_6", &finger]);
        three = three.finger(&format!("tip_joint_{k}"), [&finger, &tip]);
    }
    let held: Vec<(String, &str)> = ["1", "2", "3"]
        .iter()
        .flat_map(|k| [(format!("finger_joint_{k}"), "finger"), (format!("tip_joint_{k}"), "finger")])
        .collect();
    let held: Vec<(&str, &str)> = held.iter().map(|(name, why)| (name.as_str(), *why)).collect();
    assert_arm(&three, 6, &held);
    let words = HeldJoint::in_words(three.read(&[]).expect("an arm").held_joints());
    assert!(words.starts_with("finger_joint_1, tip_joint_1, ") && words.ends_with("(named as a finger is)"), "{words}");
}

#[test]
fn fingers_without_a_name_are_known_by_the_tools_frame_by_limits_and_by_how_far_they_slide() {
    let jaw = Robot::arm(6).fixed("tool0", "link_6").finger("joint_7", ["link_6", "link_7"]);
    assert_arm(&jaw, 6, &[("joint_7", "`tool0` does not move with it")]);
    // Where the tool's frame moves with it, it is the arm's.
    let wrist = Robot::arm(6).joint("joint_7", "continuous", ["link_6", "link_7"], "").fixed("tool0", "link_7");
    assert_arm(&wrist, 7, &[]);
    let two = Robot::arm(6).finger("j7", ["link_6", "a"]).finger("j8", ["link_6", "b"]);
    assert_arm(&two, 6, &[("j7", "2 short branches"), ("j8", "2 short branches")]);
    let mut allegro = Robot::arm(7);
    for finger in 0..4 {
        let mut before = "link_7".to_owned();
        for k in 0..4 {
            let (joint, link) = (format!("j_{}", 4 * finger + k), format!("l_{}", 4 * finger + k));
            allegro = allegro.finger(&joint, [&before, &link]);
            before = link;
        }
    }
    assert_eq!(allegro.read(&[]).map(|arm| (arm.dof(), arm.held_joints().len())), Ok((7, 16)));
    assert_arm(&Robot::arm(6).slide("j7", ["link_6", "a"], 0.04), 6, &[("j7", "slides by 40 mm")]);
    // A quill may be as short as a finger is long: it is taken, and said.
    let quill = Robot::arm(6).slide("j7", ["link_6", "a"], 0.1).read(&[]).expect("an arm");
    assert_eq!((quill.dof(), quill.doubts().len()), (7, 1));
    assert!(
        quill.doubts()[0].contains("--joints joint_1,joint_2,joint_3,joint_4,joint_5,joint_6 "),
        "{:?}",
        quill.doubts()
    );
}

#[test]
fn where_a_last_joint_may_be_either_the_user_says_which() {
    let jaw = Robot::arm(6).finger("joint_7", ["link_6", "link_7"]);
    let error = jaw.refused(&[]);
    let (six, seven) = ("joint_1,joint_2,joint_3,joint_4,joint_5,joint_6", "joint_6,joint_7`");
    assert!(error.contains("`joint_7` may be the arm's last one, or a gripper's jaw"), "{error}");
    assert!(error.contains(&format!("--joints {six}` or `--joints")) && error.contains(seven), "{error}");
    let names: Vec<&str> = six.split(',').collect();
    let arm = jaw.read(&names).expect("the joints that are named");
    assert_eq!((arm.dof(), arm.held_joints()[0].why.as_str()), (6, "not among the joints that were named"));
    assert_eq!(jaw.read(&[&names[..], &["joint_7"]].concat()).map(|arm| arm.dof()), Ok(7));
    // A wrist with the same limits, as strong as the others.
    let strong = "<limit lower='0' upper='1.51' effort='30' velocity='1'/>";
    assert_arm(&Robot::arm(6).joint("joint_7", "revolute", ["link_6", "link_7"], strong), 7, &[]);
}

#[test]
fn a_base_on_wheels_or_that_floats_is_held() {
    let mut wheels = Robot::arm(6);
    for corner in ["front_left", "front_right", "rear"] {
        let (swivel, wheel) = (format!("{corner}_swivel"), format!("{corner}_roll"));
        wheels = wheels.joint(&format!("{corner}_caster"), "continuous", ["base", &swivel], "");
        wheels = wheels.joint(&format!("{corner}_wheel"), "continuous", [&swivel, &wheel], "");
    }
    let arm = wheels.read(&[]).expect("an arm on wheels");
    assert_eq!((arm.dof(), arm.held_joints().len()), (6, 6));
    let floating = Robot("<link name='world'/>".into()).joint("floor", "floating", ["world", "root"], "");
    let planar = Robot("<link name='world'/><link name='x'/><link name='y'/>".into());
    let slide = |name: &str, ends: [&str; 2], axis: &str| {
        let [parent, child] = ends;
        format!(
            "<joint name='{name}' type='prismatic'><parent link='{parent}'/><child link='{child}'/><axis xyz='{axis}'/><limit lower='-9' \
             upper='9' effort='1' velocity='1'/></joint>"
        )
    };
    let planar = planar.0 + &slide("px", ["world", "x"], "1 0 0") + &slide("py", ["x", "y"], "0 1 0");
    let planar = Robot(planar).joint("p1", "continuous", ["y", "root"], "");
    for (base, held) in [(floating, vec!["floor"]), (planar, vec!["px", "py", "p1"])] {
        let arm = Robot::arm(6).0.replace("'base'", "'root'").replace("<link name='root'/>", "");
        let held: Vec<(&str, &str)> = held.into_iter().map(|name| (name, "lets the base move")).collect();
        assert_arm(&Robot(base.0 + &arm), 6, &held);
    }
}

#[test]
fn of_two_arms_the_user_names_the_joints_of_one() {
    let mut robot = Robot("<link name='base'/>".into()).joint("torso_1", "continuous", ["base", "torso"], "");
    for side in ["left", "right"] {
        let mut before = "torso".to_owned();
        for k in 1..=6 {
            let link = format!("{side}_link_{k}");
            robot = robot.joint(&format!("{side}_{k}"), "continuous", [&before, &link], "");
            before = link;
        }
        robot = robot.slide(&format!("{side}_finger"), [&before, &format!("{side}_tip")], 0.04);
    }
    let error = robot.refused(&[]);
    assert!(error.contains("--joints torso_1,left_1,left_2,left_3,left_4,left_5,left_6`"), "{error}");
    let right = ["right_1", "right_2", "right_3", "right_4", "right_5", "right_6"];
    let arm = robot.read(&right).expect("one arm");
    assert_eq!(arm.joint_names(), right);
    assert_eq!(arm.held_joints().len(), 9);
    for (wrong, said) in [
        (&["right_2", "right_1"][..], "from base to flange"),
        (&["left_1", "right_2"][..], "of one arm"),
        (&["right_1", "right_9"][..], "`right_9`, which is none of its joints"),
        (&["to_tool0"][..], "branch off"),
    ] {
        let error = robot.refused(wrong);
        assert!(error.contains(said) && !error.contains('\n'), "{error}");
    }
}
