//! All that is known of the cell, put together from what a person says and what was recorded, and where each came from.

use super::clips::{self, About};
use super::description::Description;
use super::facts::{Facts, Named};
use super::{Order, Taken};
use anyhow::bail;
use import::{UsualController, is_franka, usual_controller};
use shared_mem::cell::{Cell, Controller, ControllerKind, Object, Robot, Table, Tool, Topics};
use shared_mem::place;
use std::path::{Path, PathBuf};
use twin::arm::{ArmModel, HeldJoint};

/// What stands in the new file.
#[derive(Debug, Clone, Default)]
pub(super) struct Known {
    pub(super) cell: Cell,
    pub(super) taken: Vec<Taken>,
    /// A sentence above a block, by its name.
    pub(super) remarks: Vec<(&'static str, String)>,
    /// A line on each clip, in their order.
    pub(super) recorded: Vec<String>,
    /// A URDF that goes beside the file.
    pub(super) urdf: Option<(PathBuf, String)>,
    pub(super) warnings: Vec<String>,
    pub(super) arm: Option<ArmModel>,
}

/// What was recorded, and by which flag it came.
struct Recorded {
    flag: &'static str,
    about: About,
    clips: Vec<PathBuf>,
}

impl Known {
    pub(super) fn gather(order: Order<'_>) -> anyhow::Result<Self> {
        let Order { facts, out, .. } = order;
        let recorded = recorded(order)?;
        let mut known = Self::default();
        if let Some(recorded) = &recorded
            && let Some(cell) = &recorded.about.cell
        {
            known.cell = cell.clone();
            known.take("the cell.toml in the first clip", recorded.flag);
        }
        known.robot(facts, recorded.as_ref(), out)?;
        known.controller(facts)?;
        known.rest(facts);
        if let Some(recorded) = &recorded {
            known.topics(recorded);
            known.clips(recorded, out)?;
        }
        Ok(known)
    }

    fn take(&mut self, key: &str, from: &str) {
        self.taken.push(Taken { key: key.to_owned(), from: from.to_owned() });
    }

    fn robot(&mut self, facts: &Facts, recorded: Option<&Recorded>, out: &Path) -> anyhow::Result<()> {
        match (facts.robot.as_ref(), recorded) {
            (Some(Named::Model(model)), _) => {
                self.set_robot(Robot { model: Some(model.clone()), ..Robot::default() }, "--model")
            }
            (Some(Named::Joints(joints)), _) => {
                self.set_robot(Robot { joints: joints.clone(), ..Robot::default() }, "--joints");
            }
            (Some(Named::Urdf(file)), recorded) => {
                self.set_description(Description::of_file(file, out, &facts.joints)?, "--urdf", out);
                if facts.joints.is_empty() {
                    self.recorded_names(recorded)?;
                } else if let Some(robot) = &mut self.cell.robot {
                    robot.joints.clone_from(&facts.joints);
                    self.take("robot.joints", "--joints");
                }
            }
            (None, Some(_)) if self.cell.robot.is_some() => {}
            (None, Some(recorded)) => self.recorded_robot(recorded, out),
            (None, None) => {
                bail!(
                    "nothing says which robot it is; give --urdf FILE, --model fr3, --joints NAMES, --bag FILE or --clips FOLDER"
                )
            }
        }
        // A model that cannot be made is not written.
        if self.arm.is_none() && self.cell.robot.is_some() {
            self.arm = Some(ArmModel::from_cell(&self.cell)?);
        }
        Ok(())
    }

    /// The FR3 where the joints are its own, else the URDF that was recorded, else the joints' names.
    fn recorded_robot(&mut self, Recorded { flag, about, .. }: &Recorded, out: &Path) {
        let joints = &about.contents.joints;
        let is_fr3 = joints.iter().all(|joint| joint.contains("fr3"));
        let description = about.contents.description.clone().filter(|_| !(is_fr3 && is_franka(joints)));
        let described = description.map(|text| Description::of_text(text, out));
        match described {
            Some(Ok(description)) => {
                return self.set_description(description, &format!("{flag}: its robot_description"), out);
            }
            Some(Err(error)) => {
                self.warnings.push(format!("the recorded robot_description is not used: {error}"));
            }
            None => {}
        }
        if is_franka(joints) {
            self.set_robot(
                Robot { model: Some("fr3".into()), ..Robot::default() },
                &format!("{flag}: its joint names"),
            );
            if !is_fr3 {
                let remark =
                    "A Panda is built like the FR3, of other masses: for one, give its URDF in place of the model.";
                self.remarks.push(("robot", remark.into()));
            }
        } else if !joints.is_empty() {
            self.set_robot(Robot { joints: joints.clone(), ..Robot::default() }, &format!("{flag}: its joint names"));
        }
    }

    /// What the recordings call the URDF's joints, where they have as many and other names.
    fn recorded_names(&mut self, recorded: Option<&Recorded>) -> anyhow::Result<()> {
        let (Some(Recorded { flag, about, .. }), Some(arm), Some(robot)) =
            (recorded, self.arm.as_mut(), self.cell.robot.as_mut())
        else {
            return Ok(());
        };
        let joints = &about.contents.joints;
        if joints.len() == arm.dof() && arm.joint_names().iter().all(|name| !joints.contains(name)) {
            let described = arm.joint_names().join(", ");
            self.remarks.push((
                "robot",
                format!("`joints` in the recordings are {described} in the URDF, by place; check it."),
            ));
            arm.call_joints(joints)?;
            robot.joints.clone_from(joints);
            self.take("robot.joints", &format!("{flag}: its joint names"));
        }
        Ok(())
    }

    fn set_robot(&mut self, robot: Robot, from: &str) {
        let key = match &robot {
            Robot { model: Some(_), .. } => "robot.model",
            Robot { urdf: Some(_), .. } => "robot.urdf",
            _ => "robot.joints",
        };
        self.cell.robot = Some(robot);
        self.take(key, from);
    }

    fn set_description(&mut self, Description { path, text, arm }: Description, from: &str, out: &Path) {
        let urdf = match &text {
            // Beside cell.toml.
            Some(_) => path.file_name().map_or_else(|| path.clone(), PathBuf::from),
            None => place::beside(out, &path),
        };
        self.urdf = text.map(|text| (path, text));
        if let held @ [_, ..] = arm.held_joints() {
            self.remarks.push(("robot", format!("Held where they are: {}.", HeldJoint::in_words(held))));
        }
        self.warnings.extend(arm.doubts().iter().cloned());
        self.warnings.extend(without_limits(&arm));
        self.arm = Some(arm);
        self.set_robot(Robot { urdf: Some(urdf), ..Robot::default() }, from);
    }

    fn controller(&mut self, facts: &Facts) -> anyhow::Result<()> {
        let Some(arm) = &self.arm else { return Ok(()) };
        let UsualController { remark, toml } = usual_controller(arm.joint_names());
        let dof = arm.dof();
        let recorded = self.cell.controller.is_some();
        let fits = |controller: &Controller| facts.controller.is_none_or(|kind| kind == controller.kind);
        let usual = Cell::parse(toml, Path::new("cell.toml"))?.controller.filter(fits);
        let begun = self.cell.controller.take().map(|recorded| match facts.controller {
            Some(kind) => under(recorded, kind, &mut self.warnings),
            None => recorded,
        });
        let mut controller = begun
            .or(usual)
            .unwrap_or_else(|| Controller { kind: facts.controller.unwrap_or_default(), ..Controller::default() });
        for (flag, given, nominal, range) in [
            ("stiffness", &facts.stiffness, &mut controller.stiffness, &mut controller.stiffness_range),
            ("damping", &facts.damping, &mut controller.damping, &mut controller.damping_range),
        ] {
            if !given.is_empty() {
                anyhow::ensure!(
                    given.len() == dof,
                    "--{flag} holds {} numbers; this arm has {dof} joints: give one for each",
                    given.len()
                );
                nominal.clone_from(given);
                *range = None;
            }
        }
        if let without @ [_, ..] = &arm.joints_without_inertia()[..]
            && controller.rotor_inertia.is_empty()
        {
            controller.rotor_inertia = arm.rotor_inertia()[..dof].to_vec();
            let what = format!(
                "{} moves no inertia in the URDF: what it carries has no <inertial>, or is a point mass on the joint's axis. A servo's rotor \
                 stands in for it: write the motor's own as `rotor_inertia` in [controller].",
                without.join(", ")
            );
            self.remarks.push(("controller", what.clone()));
            self.warnings.push(what);
        }
        self.cell.controller = Some(controller);
        let whole = !facts.stiffness.is_empty() && !facts.damping.is_empty();
        if !recorded && facts.controller.is_none() && !whole {
            self.remarks.push(("controller", remark.to_owned()));
            self.take("controller", "usual");
        }
        for (key, given) in [
            ("kind", facts.controller.is_some()),
            ("stiffness", !facts.stiffness.is_empty()),
            ("damping", !facts.damping.is_empty()),
        ] {
            if given {
                self.take(
                    &format!("controller.{key}"),
                    &format!("--{}", if key == "kind" { "controller" } else { key }),
                );
            }
        }
        Ok(())
    }

    fn rest(&mut self, facts: &Facts) {
        if let Some([mass, length, radius]) = facts.tool {
            self.cell.tool = Some(Tool { mass, length, radius });
            self.take("tool", "--tool");
        }
        if let Some(height) = facts.table {
            self.cell.table = Some(Table { height });
            self.take("table.height", "--table");
        }
        if let Some(size) = facts.object {
            self.cell.objects = vec![Object { shape: Some("box".into()), size: Some(size), ..Object::default() }];
            self.take("object.size", "--object");
        }
    }

    fn topics(&mut self, Recorded { flag, about, .. }: &Recorded) {
        let usual = Topics::default();
        let contents = &about.contents;
        let topics = &mut self.cell.topics;
        for (place, found) in [
            (&mut topics.measured, &contents.measured),
            (&mut topics.desired, &contents.desired),
            (&mut topics.object_pose, &contents.object_pose),
        ] {
            if let Some(found) = found.as_ref().filter(|topic| topic.starts_with('/')) {
                place.clone_from(found);
            }
        }
        if *topics != usual {
            self.take("topics", flag);
        }
    }

    fn clips(&mut self, recorded: &Recorded, out: &Path) -> anyhow::Result<()> {
        let arm = self.arm.as_ref();
        for clip in &recorded.clips {
            let (entry, remark) = clips::listed(clip, &self.cell, arm, out)?;
            self.cell.clips.push(entry);
            self.recorded.push(remark);
        }
        if !self.cell.clips.is_empty() {
            self.take("clip", recorded.flag);
        }
        Ok(())
    }
}

/// A recorded controller under a law that a person names: what its motors are like stays; gains of another law mean something else, and are
/// left out with a word.
fn under(recorded: Controller, kind: ControllerKind, warnings: &mut Vec<String>) -> Controller {
    let Some(name) = recorded.kind.name().filter(|_| recorded.kind != kind) else {
        return Controller { kind, ..recorded };
    };
    warnings.push(format!(
        "the first clip says controller `{name}`, and --controller `{}`: its gains are left out, what its motors are like stays",
        kind.name().unwrap_or("of no name")
    ));
    let Controller {
        rotor_inertia,
        torque_limit,
        voltage_limit,
        torque_constant,
        torque_sensing,
        between_commands,
        ..
    } = recorded;
    Controller {
        kind,
        rotor_inertia,
        torque_limit,
        voltage_limit,
        torque_constant,
        torque_sensing,
        between_commands,
        ..Controller::default()
    }
}

/// What is taken where a description gives no limits: exporters write 0 for those they do not know.
fn without_limits(arm: &ArmModel) -> Option<String> {
    let named = |key: &str, limits: &[f64]| {
        let joints = arm.described_joint_names().iter().zip(limits).filter(|(_, limit)| limit.is_infinite());
        let joints: Vec<&str> = joints.map(|(name, _)| name.as_str()).collect();
        (!joints.is_empty()).then(|| format!("no finite `{key}` above 0 for {}", joints.join(", ")))
    };
    let known = [named("effort", arm.torque_limit()), named("velocity", arm.velocity_limit())];
    let missing: Vec<String> = known.into_iter().flatten().collect();
    (!missing.is_empty()).then(|| {
        format!(
            "<limit> of the URDF has {}: no limit is taken in its place, neither by the simulated arm nor by a capture's plan; write \
             the arm's own into the URDF, or its torques as `torque_limit` of [controller]",
            missing.join("; ")
        )
    })
}

fn recorded(order: Order<'_>) -> anyhow::Result<Option<Recorded>> {
    let found = match (order.bag, order.clips) {
        (Some(bag), _) => {
            let clips = clips::of_bag(bag)?;
            // Looked at as a whole: a bag may be split into files.
            let about = match clips.as_slice() {
                [one] => clips::about(one)?,
                _ => About { contents: import::look(bag)?, cell: None },
            };
            Recorded { flag: "--bag", about, clips }
        }
        (None, Some(folder)) => {
            let clips = clips::list(folder)?;
            let first = clips.first().map_or(folder, PathBuf::as_path);
            Recorded { flag: "--clips", about: clips::about(first)?, clips }
        }
        (None, None) => return Ok(None),
    };
    Ok(Some(found))
}
