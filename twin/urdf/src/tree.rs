//! From the stream of tags to links and joints: which tag counts where, which must be there. Of two of a kind the first counts.
//! There is no tree of elements: a tag is read when it opens, and only the names of the open ones are kept.

use crate::tag::{Tag, one_line, quoted};
use crate::{
    Axis, Collision, Inertia, Inertial, Joint, JointLimit, JointType, Link, LinkName, Mass, Pose, Robot, Shape,
    UrdfError,
};
use quick_xml::Reader;
use quick_xml::events::{BytesStart, Event};
use std::collections::HashSet;

/// Tags within tags. A link's shape stands on the fifth level; simulators' extensions add a few.
const DEEPEST: usize = 64;

/// Links, and joints. An arm with two hands has some 60; who walks the chain compares each with each.
const MAX_PARTS: usize = 4096;

pub(crate) fn read(text: &str) -> Result<Robot, UrdfError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    let mut reader = Reader::from_str(text);
    reader.config_mut().expand_empty_elements = true;
    let mut tree = Tree { line: 1, ..Tree::default() };
    let mut counted = 0;
    loop {
        let mut at = reader.buffer_position();
        let step = match reader.read_event() {
            Ok(Event::Start(start)) => {
                // Counted on from the tag before: a file of 16 MiB may have thousands of them.
                tree.line += newlines(text, counted, at);
                counted = at;
                tree.open(&start)
            }
            Ok(Event::End(_)) => tree.close(),
            Ok(Event::Text(text)) if tree.open.is_empty() && !text.trim().is_empty() => {
                Err(format!("text outside of <robot>: `{}`", quoted(text.trim())))
            }
            Ok(Event::Eof) => tree.end(),
            Ok(_) => Ok(()),
            Err(error) => {
                at = reader.error_position();
                Err(one_line(&error))
            }
        };
        step.map_err(|what| UrdfError { line: line(text, at), what })?;
        if tree.ended {
            return Ok(tree.robot);
        }
    }
}

fn line(text: &str, at: u64) -> usize {
    1 + newlines(text, 0, at)
}

/// Line breaks between two places in the text.
fn newlines(text: &str, from: u64, to: u64) -> usize {
    let [from, to] = [from, to].map(|at| usize::try_from(at).map_or(text.len(), |at| at.min(text.len())));
    text.as_bytes().get(from..to).map_or(0, |bytes| bytes.iter().filter(|byte| **byte == b'\n').count())
}

/// An element that is open, with what was read of it.
enum Open {
    Robot,
    Link { name: String, line: usize, inertial: Option<Inertial>, collisions: Vec<Collision> },
    Collision(Collision),
    Geometry { shape: Option<Shape> },
    Inertial { origin: Option<Pose>, mass: Option<Mass>, inertia: Option<Inertia> },
    Joint(Box<Parts>),
    Other,
}

/// What was read of a joint.
struct Parts {
    name: String,
    line: usize,
    joint_type: JointType,
    origin: Option<Pose>,
    parent: Option<LinkName>,
    child: Option<LinkName>,
    axis: Option<Axis>,
    limit: Option<JointLimit>,
    mimicked: Option<String>,
    /// Dry and viscous friction.
    dynamics: Option<[f64; 2]>,
}

#[derive(Default)]
struct Tree {
    robot: Robot,
    /// Major and minor version of the format.
    version: (u32, u32),
    open: Vec<Open>,
    names: [HashSet<String>; 2],
    /// Of the tag that was read last, from 1.
    line: usize,
    found: bool,
    ended: bool,
}

impl Tree {
    fn open(&mut self, start: &BytesStart<'_>) -> Result<(), String> {
        if self.open.len() >= DEEPEST {
            return Err(format!("elements stand more than {DEEPEST} deep in each other"));
        }
        let name = start.name().0;
        if name.starts_with("xacro:") {
            return Err(format!(
                "<{}> is xacro; expand it first, as in `xacro arm.urdf.xacro > arm.urdf`",
                quoted(name)
            ));
        }
        let (links, joints) = (self.robot.links.len(), self.robot.joints.len());
        let quaternions = self.version >= (1, 1);
        let opened = match (self.open.last_mut(), name) {
            (None, "robot") if !self.found => self.robot(&Tag::new(start, name)?),
            (None, "robot") => return Err("a second <robot>".into()),
            (None, _) => return Err(format!("<{}> stands where <robot> must", quoted(name))),
            (Some(Open::Robot), "link") if links == MAX_PARTS => return Err(format!("more than {MAX_PARTS} links")),
            (Some(Open::Robot), "joint") if joints == MAX_PARTS => return Err(format!("more than {MAX_PARTS} joints")),
            (Some(Open::Robot), "link") => {
                let name = self.unused(0, Tag::new(start, name)?.label("name")?, "link")?;
                Open::Link { name, line: self.line, inertial: None, collisions: Vec::new() }
            }
            (Some(Open::Robot), "joint") => self.joint(&Tag::new(start, name)?)?,
            (Some(Open::Link { inertial: None, .. }), "inertial") => {
                Open::Inertial { origin: None, mass: None, inertia: None }
            }
            (Some(Open::Link { .. }), "collision") => {
                Open::Collision(Collision { line: self.line, ..Collision::default() })
            }
            (Some(Open::Collision(collision)), "origin") => {
                // An arm's shapes are nobody's business here: one that cannot be read is one that is not known.
                let origin = Tag::new(start, name).ok().and_then(|tag| tag.pose(quaternions).ok());
                collision.origin = origin.unwrap_or_default();
                Open::Other
            }
            (Some(Open::Collision(_)), "geometry") => Open::Geometry { shape: None },
            (Some(Open::Geometry { shape }), _) => {
                *shape = shape.take().or(Tag::new(start, name).ok().and_then(|tag| self::shape(&tag)));
                Open::Other
            }
            (Some(Open::Inertial { origin, mass, inertia }), "origin" | "mass" | "inertia") => {
                let tag = Tag::new(start, name)?;
                match name {
                    "origin" => first(origin, || tag.pose(quaternions))?,
                    "mass" => first(mass, || Ok(Mass { value: tag.needed_number("value")? }))?,
                    _ => first(inertia, || moments(&tag))?,
                }
                Open::Other
            }
            (Some(Open::Joint(parts)), "origin" | "parent" | "child" | "axis" | "limit" | "mimic" | "dynamics") => {
                parts
                    .fill(name, &Tag::new(start, name)?, self.version)
                    .map_err(|what| format!("joint `{}`: {what}", parts.name))?;
                Open::Other
            }
            _ => Open::Other,
        };
        self.open.push(opened);
        Ok(())
    }

    fn robot(&mut self, tag: &Tag<'_>) -> Open {
        self.found = true;
        self.robot.name = tag.find("name").unwrap_or_default().to_owned();
        // A version that cannot be read is 1.0, as in urdfdom.
        let version = tag.find("version").and_then(|v| v.trim().split_once('.'));
        self.version = version.and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?))).unwrap_or((1, 0));
        Open::Robot
    }

    fn joint(&mut self, tag: &Tag<'_>) -> Result<Open, String> {
        let name = self.unused(1, tag.label("name")?, "joint")?;
        let kind = tag.needed("type").map_err(|what| format!("joint `{name}`: {what}"))?;
        let joint_type = match kind {
            "revolute" => JointType::Revolute,
            "continuous" => JointType::Continuous,
            "prismatic" => JointType::Prismatic,
            "fixed" => JointType::Fixed,
            "floating" => JointType::Floating,
            "planar" => JointType::Planar,
            "spherical" => JointType::Spherical,
            _ => {
                return Err(format!(
                    "joint `{name}` is of type `{}`; known are revolute, continuous, prismatic, fixed, floating, planar and \
                     spherical",
                    quoted(kind)
                ));
            }
        };
        Ok(Open::Joint(Box::new(Parts {
            name,
            line: self.line,
            joint_type,
            origin: None,
            parent: None,
            child: None,
            axis: None,
            limit: None,
            mimicked: None,
            dynamics: None,
        })))
    }

    /// The name, unless a link (0) or a joint (1) has it already.
    fn unused(&mut self, set: usize, name: String, kind: &str) -> Result<String, String> {
        if self.names[set].insert(name.clone()) { Ok(name) } else { Err(format!("a second {kind} is called `{name}`")) }
    }

    fn close(&mut self) -> Result<(), String> {
        match self.open.pop() {
            Some(Open::Link { name, line, inertial, collisions }) => {
                self.robot.links.push(Link { name, inertial: inertial.unwrap_or_default(), collisions, line });
            }
            Some(Open::Geometry { shape }) => {
                if let Some(Open::Collision(collision)) = self.open.last_mut() {
                    collision.shape = collision.shape.take().or(shape);
                }
            }
            Some(Open::Collision(collision)) => {
                if let Some(Open::Link { collisions, .. }) = self.open.last_mut() {
                    collisions.push(collision);
                }
            }
            Some(Open::Inertial { origin, mass, inertia }) => {
                let Some(Open::Link { name, inertial, .. }) = self.open.last_mut() else { return Ok(()) };
                let lacks = |what: &str| format!("<inertial> of link `{name}` has no <{what}>");
                *inertial = Some(Inertial {
                    origin: origin.unwrap_or_default(),
                    mass: mass.ok_or_else(|| lacks("mass"))?,
                    inertia: inertia.ok_or_else(|| lacks("inertia"))?,
                });
            }
            Some(Open::Joint(parts)) => self.robot.joints.push(parts.joint()?),
            Some(Open::Robot | Open::Other) | None => {}
        }
        Ok(())
    }

    fn end(&mut self) -> Result<(), String> {
        if !self.found {
            return Err("there is no <robot>".into());
        }
        if let Some(open) = self.open.last() {
            let within = match open {
                Open::Link { name, .. } => format!("link `{name}`"),
                Open::Joint(parts) => format!("joint `{}`", parts.name),
                _ => format!("{} open elements", self.open.len()),
            };
            return Err(format!("the file ends within {within}"));
        }
        self.ended = true;
        Ok(())
    }
}

impl Parts {
    fn fill(&mut self, name: &str, tag: &Tag<'_>, version: (u32, u32)) -> Result<(), String> {
        match name {
            "origin" => first(&mut self.origin, || tag.pose(version >= (1, 1))),
            "parent" => first(&mut self.parent, || Ok(LinkName { link: tag.label("link")? })),
            "child" => first(&mut self.child, || Ok(LinkName { link: tag.label("link")? })),
            "axis" => first(&mut self.axis, || Ok(Axis { xyz: tag.needed_vector("xyz")? })),
            "mimic" => first(&mut self.mimicked, || tag.label("joint")),
            "dynamics" => first(&mut self.dynamics, || {
                let of = |key: &str| Ok::<f64, String>(tag.number(key)?.unwrap_or_default());
                Ok([of("friction")?, of("damping")?])
            }),
            _ => first(&mut self.limit, || limits(tag, version)),
        }
    }

    fn joint(self) -> Result<Joint, String> {
        let lacks = |what: &str| format!("joint `{}` has no <{what}>", self.name);
        let parent = self.parent.ok_or_else(|| lacks("parent"))?;
        let child = self.child.ok_or_else(|| lacks("child"))?;
        let [friction, damping] = self.dynamics.unwrap_or_default();
        Ok(Joint {
            joint_type: self.joint_type,
            origin: self.origin.unwrap_or_default(),
            axis: self.axis.unwrap_or_default(),
            limit: self.limit.unwrap_or_default(),
            parent,
            child,
            name: self.name,
            mimicked: self.mimicked,
            friction,
            damping,
            line: self.line,
        })
    }
}

/// Reads into an empty slot; what comes later is passed over, as `urdfdom` does.
fn first<T>(slot: &mut Option<T>, read: impl FnOnce() -> Result<T, String>) -> Result<(), String> {
    if slot.is_none() {
        *slot = Some(read()?);
    }
    Ok(())
}

/// A shape, where the tag is one.
fn shape(tag: &Tag<'_>) -> Option<Shape> {
    let number = |key: &str| tag.needed_number(key).ok();
    match tag.name() {
        "box" => Some(Shape::Box(tag.needed_vector("size").ok()?.0)),
        "cylinder" => Some(Shape::Cylinder { radius: number("radius")?, length: number("length")? }),
        "sphere" => Some(Shape::Sphere(number("radius")?)),
        "mesh" => {
            let file = tag.label("filename").ok()?;
            let scale = if tag.find("scale").is_some() { tag.needed_vector("scale").ok()?.0 } else { [1.0; 3] };
            Some(Shape::Mesh { file, scale })
        }
        _ => None,
    }
}

fn moments(tag: &Tag<'_>) -> Result<Inertia, String> {
    Ok(Inertia {
        ixx: tag.needed_number("ixx")?,
        ixy: tag.needed_number("ixy")?,
        ixz: tag.needed_number("ixz")?,
        iyy: tag.needed_number("iyy")?,
        iyz: tag.needed_number("iyz")?,
        izz: tag.needed_number("izz")?,
    })
}

/// Before version 1.2 what is left out is 0 and nothing is checked; from then on it is unlimited.
fn limits(tag: &Tag<'_>, version: (u32, u32)) -> Result<JointLimit, String> {
    let [lower, upper, effort, velocity] =
        [tag.number("lower")?, tag.number("upper")?, tag.number("effort")?, tag.number("velocity")?];
    if version < (1, 2) {
        let [lower, upper, effort, velocity] = [lower, upper, effort, velocity].map(Option::unwrap_or_default);
        return Ok(JointLimit { lower, upper, effort, velocity });
    }
    if let (Some(lower), Some(upper)) = (lower, upper)
        && upper < lower
    {
        return Err(format!("`upper` of <limit> is {upper}, below `lower`, {lower}"));
    }
    for (key, value) in [("effort", effort), ("velocity", velocity)] {
        if value.is_some_and(|value| value < 0.0) {
            return Err(format!("`{key}` of <limit> is negative"));
        }
    }
    Ok(JointLimit {
        lower: lower.unwrap_or(f64::NEG_INFINITY),
        upper: upper.unwrap_or(f64::INFINITY),
        effort: effort.unwrap_or(f64::INFINITY),
        velocity: velocity.unwrap_or(f64::INFINITY),
    })
}
