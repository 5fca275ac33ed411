//! Which of a URDF's joints are an arm's: the way from its base to its tool. What else moves hangs on it: fingers, wheels, a base that
//! drives, a camera that turns. A URDF does not say so, and each of these tells:
//!
//! | what is seen | what it means |
//! |---|---|
//! | joints that the user names | these are the arm's, and no others |
//! | a joint follows another one (`<mimic>`) | neither is the arm's, unless further joints hang on the one that leads |
//! | a name: finger, thumb, jaw, knuckle, claw, gripper; wheel, caster | a finger, where arm joints come before it; a wheel |
//! | the tool's frame (`tool0`, `tcp`, `ee_link`, ...) stays where it is while the joint moves | the arm ends before |
//! | a floating or planar joint, or two slides and a turn next to without mass, at the root | a base that moves |
//! | several branches, each short against the arm before them and with limits | a hand |
//! | one slide by a few centimetres at the end of joints that turn | a finger |
//! | one branch at least twice as long as all others | the arm goes on there |
//!
//! Where nothing of this tells, the user is asked.

use super::{Tree, range};
use crate::arm::chain::HeldJoint;
use crate::arm::{MAX_JOINTS, ModelError};
use std::collections::HashMap;
use std::fmt::Write as _;
use urdf_rs::{Joint, JointType};

/// Words in the name of a finger's joint or of what it carries.
const FINGER: [&str; 5] = ["finger", "thumb", "jaw", "knuckle", "claw"];
/// The same, of a joint alone: links of this name are bodies that fingers hang on.
const GRIPPER: &str = "gripper";
/// Words of a joint that turns a whole hand.
const TURNS: [&str; 8] = ["roll", "pitch", "yaw", "rotat", "wrist", "twist", "swivel", "turn"];
/// Words of what is mounted at the end of an arm and moves by itself; all but the first in the link's name too.
const MOUNTED: [&str; 8] = [GRIPPER, "camera", "lidar", "laser", "clamp", "spindle", "screw", "drill"];
/// Words of what a vehicle stands on.
const WHEEL: [&str; 4] = ["wheel", "caster", "castor", "sprocket"];
/// Names, or parts of them, of the frame that a tool is mounted in, or that it works with.
const TOOL: [&str; 10] =
    ["tool", "tool0", "tcp", "ee", "eef", "effector", "endeffector", "flange", "faceplate", "grasp"];
/// A finger slides no farther [m]: a choice between the 40 mm of a Franka Hand and the 100 mm and more of a SCARA's quill.
const FINGER_TRAVEL: f64 = 0.06;
/// A slide by less at the end of an arm may be either [m].
const DOUBTFUL_TRAVEL: f64 = 0.15;
/// A jaw turns by less [rad]; wrists turn by half a turn and more.
const JAW_TURN: f64 = 2.2;
/// A jaw whose limits say that it opens to one side stays this near to 0 on the other [rad].
const ONE_SIDE: f64 = 0.2;
/// Share of the least torque of the arm's own joints below which a joint may be a jaw's.
const JAW_TORQUE: f64 = 1.0 / 3.0;

/// The arm's joints, and what else moves.
#[derive(Default)]
pub(super) struct Choice<'a> {
    /// From base to flange.
    pub(super) joints: Vec<&'a Joint>,
    /// First joints of branches that are none of the arm's, and why.
    left: Vec<(&'a Joint, String)>,
    /// Whether the user named the joints.
    is_named: bool,
    /// What may be meant otherwise, one sentence each.
    pub(super) doubts: Vec<String>,
}

/// What a branch is by its names.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Part {
    Finger,
    Wheel,
}

/// All that is rigid with a link.
struct Group<'a> {
    links: Vec<&'a str>,
    /// Joints that move what hangs on it, in file order.
    moving: Vec<&'a Joint>,
}

impl<'a> Tree<'a> {
    /// The arm's joints: those of these names where all of them are the URDF's, else the ones that it tells by itself.
    pub(super) fn choose(&self, named: &[String]) -> Result<Choice<'a>, ModelError> {
        let unknown: Vec<&str> =
            named.iter().map(String::as_str).filter(|name| self.joint_called(name).is_none()).collect();
        if !named.is_empty() && unknown.is_empty() {
            return self.named(named);
        }
        let choice = self.stated();
        // Other names for all of its joints are what recordings call them; a few among its own are slips of the pen.
        match &choice {
            Ok(choice) if choice.joints.len() == named.len() => {}
            _ if unknown.is_empty() || unknown.len() == named.len() => {}
            _ => {
                let own: Vec<&str> = self.robot.joints.iter().filter(|j| moves(j)).map(|j| j.name.as_str()).collect();
                let what = format!(
                    "`joints` names {}, which is none of its joints; those that move are {}",
                    quoted(&unknown),
                    own.join(", ")
                );
                return Err(self.error(1, &what));
            }
        }
        choice
    }

    /// Joints that move and are none of the choice's, in file order. Each is held for the reason of the nearest joint before it that has one.
    pub(super) fn held_beside(&self, choice: &Choice<'a>) -> Vec<HeldJoint> {
        let carrying: HashMap<&str, &Joint> = self.robot.joints.iter().map(|j| (j.child.link.as_str(), j)).collect();
        let reasons: HashMap<&str, &str> = choice.left.iter().map(|(j, why)| (j.name.as_str(), why.as_str())).collect();
        let otherwise = if choice.is_named { "not among the joints that were named" } else { "hangs beside the arm" };
        let why = |joint: &Joint| {
            if let Some(leader) = &joint.mimicked {
                return format!("follows `{leader}`");
            }
            let way = std::iter::successors(Some(joint), |at| carrying.get(at.parent.link.as_str()).copied());
            way.filter_map(|at| reasons.get(at.name.as_str())).next().map_or(otherwise, |why| why).to_owned()
        };
        let is_held = |joint: &&Joint| moves(joint) && choice.joints.iter().all(|chosen| chosen.name != joint.name);
        let held = self.robot.joints.iter().filter(is_held);
        held.map(|joint| HeldJoint { name: joint.name.clone(), why: why(joint) }).collect()
    }

    fn joint_called(&self, name: &str) -> Option<&'a Joint> {
        self.robot.joints.iter().find(|joint| joint.name == name)
    }

    /// The joints that the user names.
    fn named(&self, names: &[String]) -> Result<Choice<'a>, ModelError> {
        let mut choice = Choice { is_named: true, ..Choice::default() };
        for joint in names.iter().filter_map(|name| self.joint_called(name)) {
            if joint.joint_type == JointType::Fixed {
                let what = format!("joint `{}` of `joints` is fixed; name only joints that move", joint.name);
                return Err(self.error(joint.line, &what));
            }
            if let Some(leader) = &joint.mimicked {
                let what = format!(
                    "joint `{}` of `joints` follows `{leader}` (<mimic>), and nothing drives it by itself; leave it out",
                    joint.name
                );
                return Err(self.error(joint.line, &what));
            }
            if let Some(before) = choice.joints.last()
                && !self.branch(before).iter().skip(1).any(|behind| behind.name == joint.name)
            {
                let is_before = self.branch(joint).iter().any(|behind| behind.name == before.name);
                let what = match is_before {
                    true => {
                        format!("`{}` comes before `{}`; give `joints` from base to flange", joint.name, before.name)
                    }
                    false => {
                        format!(
                            "`{}` does not hang behind `{}`; `joints` are those of one arm",
                            joint.name, before.name
                        )
                    }
                };
                return Err(self.error(joint.line, &what));
            }
            choice.joints.push(joint);
        }
        Ok(choice)
    }

    /// The joints that names, frames, limits and lengths tell.
    fn stated(&self) -> Result<Choice<'a>, ModelError> {
        let mut choice = Choice { left: self.moving_base(), ..Choice::default() };
        let mut link = self.root;
        while let Some(joint) = self.next(link, &mut choice)? {
            link = &joint.child.link;
            choice.joints.push(joint);
        }
        let of_base = self.perhaps_of_base();
        if choice.joints.len() > of_base.len() && !of_base.is_empty() {
            choice.doubts.push(format!(
                "{} move over the floor and are taken as the arm's first joints; if they are a base's: --joints {} with `calibration init --urdf \
                 {}`",
                names(&of_base).join(", "),
                names(&choice.joints[of_base.len()..]).join(","),
                self.file.display()
            ));
        }
        Ok(choice)
    }

    /// The joint with which the arm goes on behind the rigid body of `link`; `None` at its end.
    fn next(&self, link: &str, choice: &mut Choice<'a>) -> Result<Option<&'a Joint>, ModelError> {
        let before = choice.joints.len();
        let group = self.group(link, before == 0);
        let (mut open, mut fingers, mut wheels) = (Vec::new(), Vec::new(), Vec::new());
        for joint in group.moving.iter().copied() {
            match (self.joints_from(joint), part(joint)) {
                (0, _) => choice.left.push((joint, "follows another joint".into())),
                (depth, Some(Part::Finger)) if before > 0 && depth <= before => fingers.push(joint),
                (_, Some(Part::Wheel)) => wheels.push(joint),
                _ => open.push(joint),
            }
        }
        if open.is_empty() && before == 0 {
            open.append(&mut wheels);
        }
        let deepest = fingers.iter().map(|joint| self.joints_from(joint)).max();
        let named = |joint: &'a Joint, what: &str| (joint, format!("named as {what}"));
        choice.left.extend(fingers.into_iter().map(|joint| named(joint, "a finger is")));
        choice.left.extend(wheels.into_iter().map(|joint| named(joint, "a wheel is")));
        if let Some(why) = self.end(&group, &open, (before, deepest)) {
            choice.left.extend(open.into_iter().map(|joint| (joint, why.clone())));
            return Ok(None);
        }
        match open[..] {
            [] => Ok(None),
            [one] => self.last_or_jaw(one, choice),
            _ => {
                let longest = self.longest(&open).ok_or_else(|| self.tie(&open, link, choice))?;
                let others = open.into_iter().filter(|joint| joint.name != longest.name);
                choice.left.extend(others.map(|joint| (joint, "hangs beside the arm".to_owned())));
                Ok(Some(longest))
            }
        }
    }

    /// Why none of the branches that are `open` is the arm's, where that is seen of all of them together; `before` joints of the arm lie
    /// before them, and `fingers` is the depth of those beside them that are named so.
    fn end(&self, group: &Group<'a>, open: &[&'a Joint], (before, fingers): (usize, Option<usize>)) -> Option<String> {
        if before == 0 || open.is_empty() {
            return None;
        }
        let all = |holds: &dyn Fn(&Joint) -> bool| open.iter().all(|joint| holds(joint));
        let deepest = open.iter().map(|joint| self.joints_from(joint)).max().unwrap_or(0);
        let tool = group.links.iter().find(|link| is_tool(link));
        if let Some(tool) = tool.filter(|_| deepest < before && all(&|joint| !self.carries_tool(joint))) {
            return Some(format!("the tool's frame `{tool}` does not move with it"));
        }
        if fingers.is_some_and(|fingers| deepest <= fingers) {
            return Some("hangs beside fingers".into());
        }
        if deepest == 1 && open.len() == 1 && group.moving.len() > 1 {
            return Some("joints beside it follow it".into());
        }
        if deepest == 1 && open.len() > 1 && all(&|joint| joint.joint_type == JointType::Prismatic) {
            return Some("slides beside others at the end of the arm".into());
        }
        let is_short = 2 * deepest <= before || open.len() > 2 && deepest < before;
        let has_limits = |joint: &Joint| self.branch(joint).iter().all(|joint| travel(joint).is_some());
        (open.len() > 1 && is_short && all(&has_limits))
            .then(|| format!("one of {} short branches at the end of the arm, as a hand has", open.len()))
    }

    /// A joint that goes on by itself: the arm's, or where it is the last one perhaps a jaw's.
    fn last_or_jaw(&self, joint: &'a Joint, choice: &mut Choice<'a>) -> Result<Option<&'a Joint>, ModelError> {
        let arm = &choice.joints;
        if self.joints_from(joint) > 1 || arm.len() < 2 {
            return Ok(Some(joint));
        }
        let all_turn = arm.iter().all(|joint| joint.joint_type != JointType::Prismatic);
        let name = &joint.name;
        match travel(joint) {
            Some(travel) if joint.joint_type == JointType::Prismatic && all_turn && travel <= DOUBTFUL_TRAVEL => {
                if travel <= FINGER_TRAVEL {
                    let why = format!("slides by {} mm at the end of joints that turn", (travel * 1e3).round());
                    choice.left.push((joint, why));
                    return Ok(None);
                }
                let slides = format!("`{name}` slides by {} mm", (travel * 1e3).round());
                choice.doubts.push(self.doubt(&slides, arm));
            }
            Some(travel) if joint.joint_type == JointType::Revolute && travel <= JAW_TURN => {
                let [lower, upper] = range(joint).unwrap_or_default();
                let known = arm.iter().map(|joint| joint.limit.effort).filter(|effort| *effort > 0.0);
                let least = known.fold(f64::INFINITY, f64::min);
                let is_weak = joint.limit.effort > 0.0 && joint.limit.effort < JAW_TORQUE * least && least.is_finite();
                let opens = lower >= -ONE_SIDE || upper <= ONE_SIDE;
                if is_weak && opens {
                    let what = format!(
                        "joint `{name}` may be the arm's last one, or a gripper's jaw: it opens to one side by {travel:.2} rad, with {} \
                         N m; {}",
                        joint.limit.effort,
                        self.remedy(&[names(arm), [names(arm), vec![name.as_str()]].concat()])
                    );
                    return Err(self.error(joint.line, &what));
                }
                if opens {
                    choice.doubts.push(self.doubt(&format!("`{name}` opens to one side by {travel:.2} rad"), arm));
                    return Ok(Some(joint));
                }
            }
            _ => {}
        }
        let word = MOUNTED
            .iter()
            .find(|word| contains(name, &[word]) || **word != GRIPPER && contains(&joint.child.link, &[word]));
        if let Some(word) = word {
            choice
                .doubts
                .push(self.doubt(&format!("`{name}` has the name of what is mounted on an arm ({word})"), arm));
        }
        Ok(Some(joint))
    }

    fn doubt(&self, what: &str, arm: &[&Joint]) -> String {
        format!(
            "{what} and is taken as the arm's last joint; if it is none of the arm's: --joints {} with `calibration init --urdf {}`",
            names(arm).join(","),
            self.file.display()
        )
    }

    /// The branch that is at least twice as long as any other.
    fn longest(&self, open: &[&'a Joint]) -> Option<&'a Joint> {
        let mut by_length: Vec<&Joint> = open.to_vec();
        by_length.sort_by_key(|joint| std::cmp::Reverse(self.joints_from(joint)));
        let [first, second, ..] = by_length[..] else { return None };
        (self.joints_from(first) >= 2 * self.joints_from(second)).then_some(first)
    }

    /// Several branches may be the arm.
    fn tie(&self, open: &[&'a Joint], link: &str, choice: &Choice<'a>) -> ModelError {
        let branches: Vec<_> = open.iter().map(|j| format!("`{}` (line {})", j.name, j.line)).collect();
        let line = open.first().map_or(1, |joint| joint.line);
        let before = names(&choice.joints);
        let ways: Vec<Vec<&str>> = open.iter().map(|joint| self.longest_way(&before, joint)).collect();
        let what = format!(
            "joints {} branch off link `{link}`, and either may be the arm's; {}",
            branches.join(" and "),
            self.remedy(&ways)
        );
        self.error(line, &what)
    }

    /// What the user says when a URDF does not tell.
    fn remedy(&self, ways: &[Vec<&str>]) -> String {
        let mut text = "say which joints are the arm's, from base to flange, with `calibration init --urdf".to_owned();
        let ways: Vec<String> = ways.iter().take(4).map(|way| format!("--joints {}", way.join(","))).collect();
        let _written = write!(
            text,
            " {} {}`; in a cell.toml they are `joints` beside `urdf`",
            self.file.display(),
            ways.join("` or `")
        );
        text
    }

    /// Names of the joints on the longest way that begins with `joint`, up to what is named as fingers are, behind the joints `before`
    /// it. A way of more joints than an arm has is cut where it branches: its longest stretch remains, with those before it that fit.
    fn longest_way(&self, before: &[&'a str], joint: &'a Joint) -> Vec<&'a str> {
        let (mut stretches, mut at) = (vec![before.to_vec(), vec![joint.name.as_str()]], joint);
        loop {
            let group = self.group(&at.child.link, false);
            let behind = group.moving.into_iter().filter(|joint| self.joints_from(joint) > 0 && part(joint).is_none());
            let behind: Vec<&Joint> = behind.collect();
            let next = behind.iter().max_by_key(|joint| (self.joints_from(joint), std::cmp::Reverse(joint.line)));
            let Some(next) = next.copied() else { break };
            if behind.len() > 1 {
                stretches.push(Vec::new());
            }
            stretches.last_mut().expect("two at least").push(&next.name);
            at = next;
        }
        if stretches.iter().map(Vec::len).sum::<usize>() <= MAX_JOINTS {
            return stretches.concat();
        }
        let longest = stretches.iter().map(Vec::len).max().unwrap_or(0);
        let place = stretches.iter().position(|stretch| stretch.len() == longest).unwrap_or(0);
        let mut way = stretches[place].clone();
        way.truncate(MAX_JOINTS);
        for stretch in stretches[..place].iter().rev() {
            if stretch.len() + way.len() > MAX_JOINTS {
                break;
            }
            way = [&stretch[..], &way[..]].concat();
        }
        way
    }

    /// All that is rigid with a link; at the `root` a base that moves counts as rigid.
    fn group(&self, link: &str, root: bool) -> Group<'a> {
        let mut group = Group { links: Vec::new(), moving: Vec::new() };
        let first = self.robot.links.iter().find(|known| known.name == link).map(|link| link.name.as_str());
        let mut open: Vec<&'a str> = first.into_iter().collect();
        while let Some(link) = open.pop() {
            group.links.push(link);
            for joint in self.behind(link) {
                if joint.joint_type == JointType::Fixed || root && self.carries_base(joint) {
                    open.push(&joint.child.link);
                } else {
                    group.moving.push(joint);
                }
            }
        }
        group.moving.sort_by_key(|joint| joint.line);
        group
    }

    /// A joint and all that move behind it.
    fn branch(&self, joint: &'a Joint) -> Vec<&'a Joint> {
        let (mut found, mut open) = (vec![joint], vec![joint.child.link.as_str()]);
        while let Some(link) = open.pop() {
            for joint in self.behind(link) {
                if moves(joint) {
                    found.push(joint);
                }
                open.push(&joint.child.link);
            }
        }
        found
    }

    fn carries_tool(&self, joint: &Joint) -> bool {
        let mut open = vec![joint.child.link.as_str()];
        while let Some(link) = open.pop() {
            if is_tool(link) {
                return true;
            }
            open.extend(self.behind(link).map(|joint| joint.child.link.as_str()));
        }
        false
    }
}

fn moves(joint: &Joint) -> bool {
    joint.joint_type != JointType::Fixed
}

fn names<'a>(joints: &[&'a Joint]) -> Vec<&'a str> {
    joints.iter().map(|joint| joint.name.as_str()).collect()
}

fn quoted(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

/// How far a joint with limits moves [rad or m].
fn travel(joint: &Joint) -> Option<f64> {
    range(joint).map(|[lower, upper]| upper - lower).filter(|travel| travel.is_finite())
}

fn contains(name: &str, words: &[&str]) -> bool {
    let name = name.to_ascii_lowercase();
    words.iter().any(|word| name.contains(word))
}

/// What a joint belongs to by its name, or that of the link that it carries.
fn part(joint: &Joint) -> Option<Part> {
    let (name, link) = (joint.name.as_str(), joint.child.link.as_str());
    if contains(name, &WHEEL) || contains(link, &WHEEL) {
        return Some(Part::Wheel);
    }
    let is_of_gripper = contains(name, &[GRIPPER]) && !contains(name, &TURNS);
    (is_of_gripper || contains(name, &FINGER) || contains(link, &FINGER)).then_some(Part::Finger)
}

/// Whether a link is the frame of a tool, by one of the words of its name.
fn is_tool(link: &str) -> bool {
    let name = link.to_ascii_lowercase();
    name.split(|c: char| !c.is_ascii_alphanumeric()).any(|word| TOOL.contains(&word))
}
