//! A task out of its file, and what is wrong with it: file, line, key.

use super::Task;
use super::arm::Carrier;
use super::built_in;
use super::camera::TaskCamera;
use super::condition::Condition;
use super::file::{
    ArmEntry, ArticulatedEntry, BodyEntry, CameraEntry, HoldEntry, JointEntry, KindEntry, MotionEntry, StartEntry,
    SuccessEntry, TaskFile,
};
use super::gripper::Gripper;
use super::motion::{Motions, Order, Waypoint};
use super::start::{StartError, StartRange};
use super::surface::pose;
use crate::world::{BodyPlan, Drive, Hold, JointKind, JointPlan, PlanError, World};
use nalgebra::{Unit, Vector3};
use shared_mem::cell::Cell;
use shared_mem::input;
use shared_mem::toml_file::{self, TomlFileError};
use std::path::Path;

/// Most bodies: contacts are looked for between any two.
const MOST_BODIES: usize = 32;

const ASKED: &str = "a task is asked for: give the file of one, or the name of a built-in one, as push_milk";

/// What is wrong with a block: the key at fault, and what would do.
type Fault = (&'static str, String);

/// The text, to say where something stands in it.
struct Source<'a> {
    path: &'a Path,
    text: &'a str,
}

pub(super) fn read(path: &Path) -> Result<Task, TomlFileError> {
    if let Some(text) = built_in::text(path) {
        return parse(text, path);
    }
    let text = input::text(path, input::Kind::Configuration)?;
    parse(&text, path)
}

pub(super) fn parse(text: &str, path: &Path) -> Result<Task, TomlFileError> {
    let file: TaskFile = toml_file::parse(text, path).map_err(|error| Cell::in_place_of(ASKED, text, path, error))?;
    let source = Source { path, text };
    for (key, value) in [("horizon", file.horizon), ("hold", file.hold)] {
        if !(1e-3..=3600.0).contains(&value) {
            return Err(source.error(0, (key, format!("it is {value}; give seconds from 0.001 to 3600"))));
        }
    }
    let Bodies { plans: bodies, places, starts } = Bodies::of(&file, &source)?;
    let names: Vec<&str> = bodies.iter().map(|body| body.name.as_str()).collect();
    let carrier = file.arm.as_ref().map(|entry| {
        let found = carrier(entry.as_ref(), &names, &bodies, &starts);
        found.map_err(|fault| source.error(entry.span().start, fault))
    });
    let carrier = carrier.transpose()?;
    let world = World::new(&held(&bodies, carrier.as_ref())).map_err(|PlanError { body, key, what }| {
        let at = names.iter().position(|name| *name == body).map_or(0, |i| places[i]);
        source.error(at, (key, what))
    })?;
    let mut conditions = Vec::new();
    for entry in &file.success {
        let found = condition(entry.as_ref(), &names, &bodies);
        conditions.push(found.map_err(|fault| source.error(entry.span().start, fault))?);
    }
    if conditions.is_empty() {
        return Err(source.error(0, ("success", "there is no [[success]] block; say what counts as success".into())));
    }
    let mut motions = Motions::default();
    for entry in &file.motion {
        motion(entry.as_ref(), &names, &bodies, &mut motions)
            .map_err(|fault| source.error(entry.span().start, fault))?;
    }
    let mut cameras: Vec<TaskCamera> = Vec::new();
    for entry in &file.camera {
        let camera = camera(entry.as_ref(), &cameras);
        cameras.push(camera.map_err(|fault| source.error(entry.span().start, fault))?);
    }
    motions.waypoints.sort_by(|a, b| a.time.total_cmp(&b.time));
    let name = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
    let instruction = file.instruction.unwrap_or_else(|| name.replace('_', " "));
    let (gripper, hold, horizon) = (Gripper::of(&bodies), file.hold, file.horizon);
    let text = text.to_owned();
    let names: Vec<String> = names.into_iter().map(str::to_owned).collect();
    let task = Task {
        name,
        instruction,
        text,
        colours: file.body.iter().map(|entry| entry.as_ref().colour).collect(),
        bodies,
        world,
        starts,
        conditions,
        motions,
        gripper,
        cameras,
        carrier,
        cell: None,
        hold,
        horizon,
    };
    task.placed(0).map_err(|error| match &error {
        StartError::Crowded { second, .. } => {
            let at = names.iter().position(|name| name == second).map_or(0, |i| places[i]);
            source.error(at, ("position", error.to_string()))
        }
        StartError::AlreadyDone => source.error(file.success[0].span().start, ("success", error.to_string())),
    })?;
    Ok(task)
}

/// The bodies of a task, and where in the file each of them stands.
struct Bodies {
    plans: Vec<BodyPlan>,
    places: Vec<usize>,
    starts: Vec<StartRange>,
}

impl Bodies {
    fn of(file: &TaskFile, source: &Source<'_>) -> Result<Self, TomlFileError> {
        let folder = source.path.parent().unwrap_or(Path::new(""));
        let mut all = Self { plans: Vec::new(), places: Vec::new(), starts: Vec::new() };
        for entry in &file.body {
            let at = entry.span().start;
            let names: Vec<&str> = all.plans.iter().map(|body| body.name.as_str()).collect();
            let plan = body(entry.as_ref(), &names, folder).map_err(|fault| source.error(at, fault))?;
            all.add(vec![plan], (at, entry.as_ref().start), source)?;
        }
        for entry in &file.articulated {
            let at = entry.span().start;
            let ArticulatedEntry { position, rotation, friction, .. } = entry.as_ref();
            let numbers = finite("position", position).and(finite("rotation", rotation));
            let plans = numbers
                .and(not_negative("friction", *friction))
                .and_then(|()| entry.as_ref().bodies(all.plans.len(), folder))
                .map_err(|fault| source.error(at, fault))?;
            all.add(plans, (at, entry.as_ref().start), source)?;
        }
        match all.plans.len() {
            1..=MOST_BODIES => Ok(all),
            count => Err(source.error(0, ("body", format!("there are {count} bodies; give 1 to {MOST_BODIES}")))),
        }
    }

    /// Bodies of one block, of which the first may start elsewhere.
    fn add(
        &mut self,
        plans: Vec<BodyPlan>,
        (at, start): (usize, Option<StartEntry>),
        source: &Source<'_>,
    ) -> Result<(), TomlFileError> {
        if let (Some(start), Some(plan)) = (start, plans.first()) {
            let range = start_range(start, self.plans.len(), plan).map_err(|fault| source.error(at, fault))?;
            self.starts.push(range);
        }
        for plan in plans {
            if self.plans.iter().any(|other| other.name == plan.name) {
                let what = format!("two bodies are called `{}`; give each a name of its own", plan.name);
                return Err(source.error(at, ("name", what)));
            }
            self.places.push(at);
            self.plans.push(plan);
        }
        Ok(())
    }
}

impl Source<'_> {
    /// An error at a key of the block that begins at `at`, or at the block where the key does not stand there.
    fn error(&self, at: usize, (key, what): Fault) -> TomlFileError {
        let after = &self.text[at.min(self.text.len())..];
        let block = after.find("\n[[").map_or(after, |end| &after[..end]);
        let place = block.match_indices(key).map(|(place, _)| place).find(|place| {
            let before = block[..*place].chars().next_back();
            let behind = block[place + key.len()..].trim_start().chars().next();
            before.is_none_or(|c| c.is_whitespace() || c == '{' || c == ',') && behind == Some('=')
        });
        let line = self.text[..at.min(self.text.len()) + place.unwrap_or(0)].matches('\n').count() + 1;
        TomlFileError::Content { path: self.path.to_owned(), line: Some(line), what: format!("`{key}`: {what}") }
    }
}

/// Index of the body of that name among those given.
fn named(name: &str, names: &[&str], key: &'static str) -> Result<usize, Fault> {
    names
        .iter()
        .position(|known| *known == name)
        .ok_or_else(|| (key, format!("no body is called `{name}` up to here; there are: {}", names.join(", "))))
}

fn finite(key: &'static str, values: &[f64]) -> Result<(), Fault> {
    match values.iter().find(|value| value.is_nan() || value.abs() > 1e3) {
        Some(bad) => Err((key, format!("it holds {bad}; give a number from -1000 to 1000 (SI units)"))),
        None => Ok(()),
    }
}

fn not_negative(key: &'static str, value: f64) -> Result<(), Fault> {
    if (0.0..=1e6).contains(&value) { Ok(()) } else { Err((key, format!("it is {value}; give 0 or more (SI units)"))) }
}

fn body(entry: &BodyEntry, names: &[&str], folder: &Path) -> Result<BodyPlan, Fault> {
    finite("position", &entry.position)?;
    finite("rotation", &entry.rotation)?;
    not_negative("friction", entry.friction)?;
    not_negative("pad_radius", entry.pad_radius)?;
    for piece in &entry.piece {
        finite("position", &piece.position)?;
        finite("rotation", &piece.rotation)?;
    }
    let pieces = entry.piece.iter().map(|piece| piece.piece(folder)).collect::<Result<Vec<_>, _>>()?;
    if pieces.is_empty() {
        return Err(("piece", format!("`{}` is made of nothing; give it a piece", entry.name)));
    }
    let at = pose(entry.position, entry.rotation);
    let hold = match (&entry.joint, entry.hold) {
        (Some(joint), HoldEntry::Free) => Hold::Joint(joint_plan(joint, at, names)?),
        (Some(_), _) => return Err(("hold", "a body on a joint cannot be held as well; leave `hold` out".into())),
        (None, HoldEntry::Free) => Hold::Free(at),
        (None, HoldEntry::Fixed) => Hold::Fixed(at),
        (None, HoldEntry::Moved) => Hold::Moved(at),
    };
    let movable = matches!(hold, Hold::Free(_) | Hold::Joint(_));
    let mass = match entry.mass {
        Some(mass) if mass > 0.0 && mass <= 1e4 => mass,
        Some(mass) => return Err(("mass", format!("it is {mass}; give kilograms above 0 and up to 10000"))),
        None if movable => return Err(("mass", format!("`{}` moves by itself and needs a mass [kg]", entry.name))),
        None => 0.0,
    };
    let plan = BodyPlan::homogeneous(&entry.name, pieces, mass, hold).with_friction(entry.friction);
    let centre_of_mass = entry.centre_of_mass.map_or(plan.centre_of_mass, Vector3::from);
    finite("centre_of_mass", centre_of_mass.as_slice())?;
    Ok(BodyPlan { centre_of_mass, pad_radius: entry.pad_radius, ..plan })
}

fn joint_plan(joint: &JointEntry, at: nalgebra::Isometry3<f64>, names: &[&str]) -> Result<JointPlan, Fault> {
    let parent = joint.parent.as_deref().map(|name| named(name, names, "parent")).transpose()?;
    let Some(axis) = Unit::try_new(Vector3::from(joint.axis), 1e-6) else {
        return Err(("axis", "it has no length; give a direction such as [0, 1, 0]".into()));
    };
    not_negative("friction", joint.friction)?;
    not_negative("damping", joint.damping)?;
    if let Some(drive) = &joint.drive {
        finite("drive", &[drive.target])?;
        not_negative("drive", drive.speed)?;
        not_negative("drive", drive.force)?;
    }
    if let Some(led) = joint.follows.as_ref() {
        finite("follows", &[led.ratio])?;
    }
    let follows = joint.follows.as_ref().map(|led| Ok((named(&led.body, names, "follows")?, led.ratio))).transpose()?;
    let limits = match (joint.limits, &follows) {
        (Some(limits), _) => limits,
        (None, Some(_)) => [0.0, 0.0],
        (None, None) => {
            let what = "it has no limits; give the least and the largest position, `limits = [low, high]`";
            return Err(("joint", what.into()));
        }
    };
    Ok(JointPlan {
        parent,
        at,
        kind: match joint.kind {
            KindEntry::Revolute => JointKind::Revolute,
            KindEntry::Prismatic => JointKind::Prismatic,
        },
        axis,
        limits,
        start: joint.start,
        friction: joint.friction,
        damping: joint.damping,
        drive: joint.drive.map(|drive| Drive { target: drive.target, speed: drive.speed, force: drive.force }),
        follows,
    })
}

fn start_range(start: StartEntry, body: usize, plan: &BodyPlan) -> Result<StartRange, Fault> {
    let (Hold::Free(nominal) | Hold::Fixed(nominal) | Hold::Moved(nominal)) = plan.hold else {
        return Err(("start", "a body on a joint starts where its joint does; give `start` to what carries it".into()));
    };
    for range in [start.x, start.y, start.yaw] {
        finite("start", &range)?;
        if range[0] > range[1] {
            return Err(("start", format!("{range:?} is no range; give [low, high]")));
        }
    }
    Ok(StartRange { body, nominal, x: start.x, y: start.y, yaw: start.yaw })
}

fn condition(entry: &SuccessEntry, names: &[&str], bodies: &[BodyPlan]) -> Result<Condition, Fault> {
    let pair = |key, [first, second]: &[String; 2]| Ok([named(first, names, key)?, named(second, names, key)?]);
    match entry {
        SuccessEntry {
            body: Some(name),
            low: Some(low),
            high: Some(high),
            of,
            tilt,
            touching: None,
            apart: None,
            joint: None,
            between: None,
        } => {
            let body = named(name, names, "body")?;
            let of = of.as_deref().map(|name| named(name, names, "of")).transpose()?;
            if (0..3).any(|k| low[k] > high[k] || low[k].is_nan() || high[k].is_nan()) {
                return Err(("low", "it lies above `high`; give the least x, y, z first".into()));
            }
            let tilt = tilt.unwrap_or(std::f64::consts::PI);
            Ok(Condition::Inside { body, of, low: (*low).into(), high: (*high).into(), tilt })
        }
        SuccessEntry { touching: Some(names), apart: None, body: None, joint: None, .. } => {
            Ok(Condition::Touching { bodies: pair("touching", names)?, wanted: true })
        }
        SuccessEntry { apart: Some(names), touching: None, body: None, joint: None, .. } => {
            Ok(Condition::Touching { bodies: pair("apart", names)?, wanted: false })
        }
        SuccessEntry {
            joint: Some(name), between: Some([low, high]), body: None, touching: None, apart: None, ..
        } => {
            let body = named(name, names, "joint")?;
            if !matches!(bodies[body].hold, Hold::Joint(_)) {
                return Err(("joint", format!("`{name}` is on no joint; name a body with a `joint`")));
            }
            Ok(Condition::Joint { body, low: *low, high: *high })
        }
        _ => Err((
            "success",
            "give one of `body` with `low` and `high`, `touching`, `apart`, or `joint` with `between`".into(),
        )),
    }
}

fn motion(entry: &MotionEntry, names: &[&str], bodies: &[BodyPlan], motions: &mut Motions) -> Result<(), Fault> {
    let body = named(&entry.body, names, "body")?;
    if !(entry.time >= 0.0 && entry.time <= 3600.0) {
        return Err(("time", format!("it is {}; give seconds from 0 to 3600", entry.time)));
    }
    match (&bodies[body].hold, entry.position, entry.target) {
        (Hold::Moved(_), Some(position), None) => {
            finite("position", &position)?;
            finite("rotation", &entry.rotation)?;
            let relative_to = entry.relative_to.as_deref().map(|name| named(name, names, "relative_to")).transpose()?;
            let pose = pose(position, entry.rotation);
            motions.waypoints.push(Waypoint { body, time: entry.time, pose, relative_to });
        }
        (Hold::Joint(joint), None, Some(target)) => {
            let Some(drive) = joint.drive else {
                return Err(("target", format!("the joint of `{}` has no `drive`", entry.body)));
            };
            finite("target", &[target])?;
            let force = entry.force.unwrap_or(drive.force);
            not_negative("force", force)?;
            motions.orders.push(Order { body, time: entry.time, target, force });
        }
        _ => {
            let what =
                "give a `position` for a body with `hold = \"moved\"`, or a `target` for one on a joint with a `drive`";
            return Err(("body", what.into()));
        }
    }
    Ok(())
}

fn camera(entry: &CameraEntry, cameras: &[TaskCamera]) -> Result<TaskCamera, Fault> {
    finite("position", &entry.position)?;
    finite("look_at", &entry.look_at)?;
    if cameras.iter().any(|other| other.name == entry.name) {
        return Err(("name", format!("two cameras are called `{}`; give each a name of its own", entry.name)));
    }
    TaskCamera::of(entry)
}

/// The bodies as the world has them: what an arm that gives way carries is held by the arm.
pub(super) fn held(bodies: &[BodyPlan], carrier: Option<&Carrier>) -> Vec<BodyPlan> {
    let mut bodies = bodies.to_vec();
    if let Some(carrier) = carrier {
        let body = &mut bodies[carrier.body];
        if let Hold::Moved(pose) = &body.hold
            && let Some(plan) = carrier.plan(pose)
        {
            body.hold = Hold::Arm(Box::new(plan));
        }
    }
    bodies
}

fn carrier(entry: &ArmEntry, names: &[&str], bodies: &[BodyPlan], starts: &[StartRange]) -> Result<Carrier, Fault> {
    let body = named(&entry.body, names, "body")?;
    let Hold::Moved(pose) = &bodies[body].hold else {
        return Err(("body", format!("`{}` is not moved; name a body with `hold = \"moved\"`", entry.body)));
    };
    for (key, values) in [("base", &entry.base), ("position", &entry.position), ("rotation", &entry.rotation)] {
        finite(key, values)?;
    }
    for (key, gains) in [("stiffness", &entry.stiffness), ("damping", &entry.damping)] {
        if let Some(bad) = gains.iter().flatten().find(|gain| !(0.0..=1e5).contains(*gain)) {
            return Err((key, format!("it holds {bad}; give seven numbers from 0 to 100000 (SI units)")));
        }
    }
    match (&entry.stiffness, &entry.damping) {
        (Some(_), None) => return Err(("stiffness", "it needs `damping` beside it, seven numbers [N m s/rad]".into())),
        (None, Some(_)) => return Err(("damping", "it needs `stiffness` beside it, seven numbers [N m/rad]".into())),
        _ => {}
    }
    let carrier = Carrier::new(entry, body);
    if entry.stiffness.is_some() && starts.iter().any(|start| start.body == body) {
        let what = format!("an arm with gains starts where it is; take `start` out of the block of `{}`", entry.body);
        return Err(("stiffness", what));
    }
    if entry.stiffness.is_some() && carrier.plan(pose).is_none() {
        let what = format!("the arm does not reach the start of `{}`; move the body, or `base`", entry.body);
        return Err(("body", what));
    }
    Ok(carrier)
}
