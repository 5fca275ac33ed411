//! The user's MJCF with what is known of the cell.

use super::controls::{self, Controls};
use super::keyframes::{self, Shifts};
use super::names;
use super::places::{Angles, PlacedJoint, Places, beside_frames};
use super::{Base, LeftOut, Merging, alike, arms, classes::numbers, source};
use anyhow::{bail, ensure};
use nalgebra::{Isometry3, Vector3};
use std::collections::HashSet;
use twin::xml::{Element, Node};

/// What the cell knows of a joint.
const OF_JOINT: [&str; 7] =
    ["armature", "frictionloss", "damping", "solreffriction", "solimpfriction", "actuatorfrcrange", "actuatorgravcomp"];
/// A base that leans by more against cell.toml's is mounted otherwise [rad]: what a calibration finds is below.
const LEANS: f64 = 0.2;
/// The frame in which the cell's sensors measure.
const BASE_SITE: &str = "cell_base";

/// The text, and what is not in it.
///
/// # Errors
/// What of the user's model cannot be used.
pub(super) fn merge(cell: &Element, base: &Base<'_>) -> anyhow::Result<(String, Vec<LeftOut>)> {
    let mut merging = Merging { root: source::read(base)?, left_out: Vec::new() };
    let (there, here) = (Places::of(cell), Places::of(&merging.root));
    let of_cell = joints_of(cell, &there);
    let own_joints = joints_of(&merging.root, &here);
    ensure!(!of_cell.is_empty(), "the cell has no arm; --base brings the arm of a model up to date");
    if own_joints.is_empty() && merging.root.all().iter().any(|element| element.name == "attach") {
        bail!(
            "{} has its arm from another file by <attach>, which is not read: write it as one file first, in Python \
             `mujoco.mj_saveLastXML(\"one.xml\", mujoco.MjModel.from_xml_path(\"{0}\"))`, and give that",
            base.file.display()
        );
    }
    let own = arms::chosen(&of_cell, &own_joints, base.joints)?;
    let mut cell = cell.clone();
    let last = own.last().and_then(|joint| merging.root.all().into_iter().find(|body| moves_with(body, joint)));
    let renamed = names::tell_apart(&mut cell, &merging.root, last);
    merging.left_out.extend(renamed);
    let cell = &cell;
    if own != of_cell {
        merging.lacks(
            format!("the cell's names of the joints ({})", of_cell.join(", ")),
            format!("the model's own stand for them: {}", own.join(", ")),
        );
    }
    let placed = |places: &'_ Places, names: &[String]| {
        names.iter().filter_map(|name| places.joints.get(name).cloned()).collect::<Vec<_>>()
    };
    let (in_cell, in_own) = (placed(&there, &of_cell), placed(&here, &own));
    let flange = there.bodies.get("flange").copied();
    let frame = match flange {
        Some(_) => alike::base(&in_cell.iter().collect::<Vec<_>>(), &in_own.iter().collect::<Vec<_>>(), &own)?,
        None => Isometry3::identity(),
    };
    let more = joints(&mut merging.root, cell, &of_cell, &own, &in_own);
    weights(&mut merging.root, cell, &own);
    if let (Some(flange), Some(last)) = (flange, in_own.last()) {
        loads(&mut merging, cell, &(last.body.inverse() * frame * flange), own.last().map_or("", String::as_str));
    }
    let done = controls::replace(&mut merging.root, cell, &of_cell, &own);
    for name in &done.beside {
        merging.lacks(
            format!("actuator {name}"),
            "it stays, and pulls at the arm beside the cell's law; take it out where it is the arm's own",
        );
    }
    let added = surroundings(&mut merging, cell, &frame)?;
    contacts_and_sensors(&mut merging, cell, &frame, &own[0], &done);
    let addresses: Vec<(Option<usize>, f64)> =
        in_own.iter().zip(&more).map(|(joint, more)| (joint.address, *more)).collect();
    let speeds = if added.is_empty() { 0 } else { 6 };
    keyframes::rewrite(&mut merging, &done, &Shifts { joints: &addresses, added: (&added, speeds) });
    gravity(&mut merging, cell, &frame);
    remarks(&mut merging);
    let Merging { mut root, left_out } = merging;
    for LeftOut { what, why } in &left_out {
        root.nodes.push(Node::Comment(format!("not as in the cell: {what}: {why}")));
    }
    Ok((root.document(), left_out))
}

/// Joints that turn or slide, in the document's order.
fn joints_of(root: &Element, places: &Places) -> Vec<String> {
    let moves =
        |name: &&str| places.joints.get(*name).is_some_and(|joint| ["hinge", "slide"].contains(&joint.kind.as_str()));
    let bodies = root.elements().filter(|section| section.name == "worldbody").flat_map(Element::all);
    let joints = bodies.filter(|element| element.name == "joint").filter_map(|joint| joint.get("name"));
    joints.filter(moves).map(str::to_owned).collect()
}

fn is_called(element: &Element, kind: &str, name: &str) -> bool {
    element.name == kind && element.get("name") == Some(name)
}

/// Whether this is the body that a joint moves.
fn moves_with(body: &Element, joint: &str) -> bool {
    body.name == "body" && beside_frames(body).iter().any(|element| is_called(element, "joint", joint))
}

/// The body of the user's that this joint moves.
fn body_of<'a>(root: &'a mut Element, joint: &str) -> Option<&'a mut Element> {
    root.find_mut(&|element| moves_with(element, joint))
}

/// Gives the joints what the cell knows; how much more each one's position reads than before [rad or m].
fn joints(root: &mut Element, cell: &Element, of_cell: &[String], own: &[String], placed: &[PlacedJoint]) -> Vec<f64> {
    let angles = Angles::of(root);
    let mut more = Vec::new();
    for ((theirs, name), placed) in of_cell.iter().zip(own).zip(placed) {
        let new = cell.all().into_iter().find(|element| is_called(element, "joint", theirs));
        let old = root.find_mut(&|element| is_called(element, "joint", name) && element.get("joint1").is_none());
        let (Some(new), Some(old)) = (new, old) else { continue };
        for key in OF_JOINT {
            if let Some(value) = new.get(key) {
                old.set(key, value);
            }
        }
        if new.get("actuatorfrcrange").is_some() {
            old.set("actuatorfrclimited", "true");
        }
        let unit = if angles.degrees && placed.kind != "slide" { 1.0_f64.to_degrees() } else { 1.0 };
        let reads = new.get("ref").and_then(|text| numbers(text).first().copied());
        let shift = reads.map_or(0.0, |reads| reads - placed.reads / unit);
        if shift != 0.0 {
            old.set("ref", (placed.reads + shift * unit).to_string());
            // A range is in what the encoder reads, its class's too.
            if let [lower, upper] = placed.range[..] {
                old.set("range", format!("{} {}", lower + shift * unit, upper + shift * unit));
            }
        }
        more.push(shift);
    }
    more
}

/// How much of its weight the controller holds, on every body of the arm.
fn weights(root: &mut Element, cell: &Element, own: &[String]) {
    let held = cell.all().into_iter().find(|element| element.name == "body").and_then(|body| body.get("gravcomp"));
    if let (Some(held), Some(first)) = (held, body_of(root, &own[0])) {
        first.each_mut(&mut |element| {
            if element.name == "body" {
                element.set("gravcomp", held);
            }
        });
    }
}

/// Loads on the flange, which lies at `flange` in the last link.
fn loads(merging: &mut Merging, cell: &Element, flange: &Isometry3<f64>, joint: &str) {
    let on_flange = cell.all().into_iter().find(|element| is_called(element, "body", "flange"));
    let bodies: Vec<Element> =
        on_flange.into_iter().flat_map(Element::elements).filter(|e| e.name == "body").cloned().collect();
    for mut body in bodies {
        let name = body.get("name").unwrap_or("").to_owned();
        if name == "tool" {
            merging.lacks(
                "the tool",
                "the model's own stays; the contact of tip and object is there where a geom of it is called `tool`",
            );
            continue;
        }
        put(&mut body, flange);
        if let Some(link) = body_of(&mut merging.root, joint) {
            link.nodes.retain(
                |node| !matches!(node, Node::Element(old) if is_called(old, "body", &name) && names::is_load(old)),
            );
            link.nodes.push(Node::Element(body));
        }
    }
}

/// Gives an element this place in what it is in, in front of the place that it has there.
fn put(element: &mut Element, at: &Isometry3<f64>) {
    // What is written for a cell has quaternions alone.
    let own = Angles::of(&Element::default()).frame(element);
    let place = at * own;
    let (p, q) = (place.translation.vector, place.rotation);
    element.set("pos", format!("{} {} {}", p.x, p.y, p.z));
    element.set("quat", format!("{} {} {} {}", q.w, q.i, q.j, q.k));
}

fn world(element: &Element) -> impl Iterator<Item = &Element> {
    element.elements().filter(|section| section.name == "worldbody").flat_map(Element::elements)
}

/// The object, the camera and, where the model has none, the table; positions of what is new at the end.
fn surroundings(merging: &mut Merging, cell: &Element, frame: &Isometry3<f64>) -> anyhow::Result<Vec<f64>> {
    let mut added = Vec::new();
    let named = |element: &Element| Some((element.name.clone(), element.get("name")?.to_owned()));
    let own: HashSet<(String, String)> = merging.root.all().into_iter().filter_map(named).collect();
    let has = |kind: &str, name: &str| own.contains(&(kind.to_owned(), name.to_owned()));
    for mut new in world(cell).cloned().collect::<Vec<_>>() {
        let name = new.get("name").unwrap_or("").to_owned();
        let is_object = new.name == "body" && new.elements().any(|element| element.name == "freejoint");
        if !is_object && !["camera", "geom"].contains(&new.name.as_str()) || new.name == "geom" && has("geom", &name) {
            continue;
        }
        // Only the contact pairs touch, in the cell; the user's defaults say otherwise.
        new.each_mut(&mut |element| {
            if element.name == "geom" {
                element.set("contype", "0");
                element.set("conaffinity", "0");
            }
        });
        put(&mut new, frame);
        let places = Angles::of(&Element::default()).frame(&new);
        let there = has(&new.name, &name);
        // What is new stands behind all that is there: keyframes have its position at their end.
        let section = match there {
            false => Some(merging.root.last_or_new("worldbody")),
            true => merging.root.elements_mut().find(|section| {
                section.name == "worldbody" && section.elements().any(|old| is_called(old, &new.name, &name))
            }),
        };
        let Some(section) = section else {
            merging.lacks(
                format!("{} {name}", new.name),
                "the model has one of this name that does not hang on the world; rename it",
            );
            continue;
        };
        let old = section.elements_mut().find(|old| is_called(old, &new.name, &name));
        match old {
            Some(old) if is_object => {
                let free = |joint: &Element| joint.name == "freejoint" || joint.get("type") == Some("free");
                ensure!(
                    old.elements().filter(|element| element.name.ends_with("joint")).count() == 1
                        && old.elements().any(free),
                    "body `{name}` of the model does not move freely, as the cell's object of this name does; rename one of them"
                );
                let carries = old.elements().any(|inner| inner.name == "body");
                names::into_object(old, new);
                if carries {
                    merging.lacks(
                        format!("the mass of what body `{name}` of the model carries"),
                        "it comes on top of the cell's, which is all of the object's: take it out there",
                    );
                }
            }
            Some(old) => *old = new,
            None => {
                if is_object {
                    let (p, q) = (places.translation.vector, places.rotation);
                    added.extend([p.x, p.y, p.z, q.w, q.i, q.j, q.k]);
                }
                section.nodes.push(Node::Element(new));
            }
        }
    }
    Ok(added)
}

/// Assets, contact pairs whose geoms are there, and sensors, each in place of one of its name.
fn contacts_and_sensors(merging: &mut Merging, cell: &Element, frame: &Isometry3<f64>, first: &str, done: &Controls) {
    let gone = |element: &Element| {
        let of = element
            .get("actuator")
            .or_else(|| element.get("objname").filter(|_| element.get("objtype") == Some("actuator")));
        of.is_some_and(|name| done.removed.iter().any(|removed| removed == name))
    };
    let mut lost = Vec::new();
    merging.root.each_mut(&mut |section| {
        section.nodes.retain(|node| match node {
            Node::Element(element) if gone(element) => {
                lost.push(element.get("name").unwrap_or(&element.name).to_owned());
                false
            }
            _ => true,
        });
    });
    for name in &done.removed {
        merging.lacks(format!("actuator {name}"), "the cell's law has none for it");
    }
    for name in lost {
        merging.lacks(format!("sensor {name}"), "its actuator is gone");
    }
    let geoms: Vec<String> = merging
        .root
        .all()
        .into_iter()
        .filter(|e| e.name == "geom")
        .filter_map(|e| e.get("name").map(str::to_owned))
        .collect();
    for kind in ["asset", "contact", "sensor"] {
        for mut new in cell
            .elements()
            .filter(|section| section.name == kind)
            .flat_map(Element::elements)
            .cloned()
            .collect::<Vec<_>>()
        {
            let touch: Vec<&str> = [new.get("geom1"), new.get("geom2")].into_iter().flatten().collect();
            if let Some(missing) = touch.iter().find(|geom| !geoms.iter().any(|own| own == **geom)) {
                merging.lacks(
                    format!("contact {}", new.get("name").unwrap_or("")),
                    format!("no geom of the model is called `{missing}`"),
                );
                continue;
            }
            if kind == "sensor" && ["framepos", "framequat"].contains(&new.name.as_str()) {
                new.set("reftype", "site");
                new.set("refname", BASE_SITE);
            }
            into_section(&mut merging.root, kind, new);
        }
    }
    let measures = merging.root.all().into_iter().any(|element| element.get("refname") == Some(BASE_SITE));
    if measures {
        base_site(merging, frame, first);
    }
}

fn into_section(root: &mut Element, kind: &str, new: Element) {
    let name = new.get("name").unwrap_or("").to_owned();
    let same = |old: &Element| !name.is_empty() && is_called(old, &new.name, &name);
    if let Some(old) =
        root.elements_mut().filter(|section| section.name == kind).find_map(|s| s.elements_mut().find(|old| same(old)))
    {
        *old = new;
        return;
    }
    root.last_or_new(kind).nodes.push(Node::Element(new));
}

/// The cell's base frame as a site of the body that the arm stands on, where that has a name, else of the world.
fn base_site(merging: &mut Merging, frame: &Isometry3<f64>, first: &str) {
    let root = &mut merging.root;
    let here = Places::of(root);
    let is_stand = |body: &Element| {
        ["body", "worldbody"].contains(&body.name.as_str())
            && beside_frames(body).iter().any(|link| beside_frames(link).iter().any(|e| is_called(e, "joint", first)))
    };
    let stand = root.all().into_iter().find(|body| is_stand(body)).and_then(|body| body.get("name")).map(str::to_owned);
    let at = stand.as_ref().and_then(|name| here.bodies.get(name)).copied().unwrap_or_else(Isometry3::identity);
    let mut site = Element::new("site", &[("name", BASE_SITE.into()), ("group", "4".into())]);
    put(&mut site, &(at.inverse() * frame));
    let mut is_other = false;
    root.each_mut(&mut |body| {
        is_other |= body.elements().any(|old| is_called(old, "site", BASE_SITE) && old.get("group") != Some("4"));
        body.nodes.retain(|node| !matches!(node, Node::Element(old) if is_called(old, "site", BASE_SITE)));
    });
    let holder = match &stand {
        Some(name) => root.find_mut(&|body| is_called(body, "body", name)),
        None => root.find_mut(&|body| body.name == "worldbody"),
    };
    if let Some(holder) = holder {
        holder.nodes.push(Node::Element(site));
    }
    if is_other {
        merging.lacks(
            format!("site {BASE_SITE} of the model"),
            "the cell's base frame stands in its place, for the cell's sensors; give yours another name",
        );
    }
}

/// Free fall, where the base stands in the model as it does in the cell.
fn gravity(merging: &mut Merging, cell: &Element, frame: &Isometry3<f64>) {
    let of = |root: &Element| {
        let said = root.elements().filter(|e| e.name == "option").filter_map(|e| e.get("gravity")).next_back();
        said.map(numbers).filter(|list| list.len() == 3).map(|list| Vector3::from_column_slice(&list))
    };
    let Some(falls) = of(cell).map(|falls| frame.rotation * falls) else { return };
    let own = of(&merging.root).unwrap_or_else(|| Vector3::new(0.0, 0.0, -shared_mem::cell::GRAVITY));
    let angle = falls.angle(&own);
    if angle > LEANS {
        merging.lacks(
            "gravity",
            format!(
                "in the model the arm's base leans by {:.0} degrees against the cell's, and the model's gravity stays",
                angle.to_degrees()
            ),
        );
        return;
    }
    let text = falls.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    merging.root.last_or_new("option").set("gravity", text);
}

/// What of the user's settings changes what the cell's numbers mean.
fn remarks(merging: &mut Merging) {
    let said = |kind: &str, key: &str| {
        let elements = merging.root.elements().filter(|element| element.name == kind);
        elements.filter_map(|element| element.get(key)).next_back().map(str::to_owned)
    };
    let step = said("option", "timestep").and_then(|text| text.parse::<f64>().ok()).unwrap_or(0.002);
    let from_geoms = said("compiler", "inertiafromgeom").is_some_and(|value| value == "true");
    if step > super::super::mjcf::STEP {
        merging.lacks(
            "the step of a tenth of a millisecond",
            format!("the model's {step} s stays, at which contacts harder than two steps are made softer"),
        );
    }
    if from_geoms {
        merging.lacks(
            "the inertia of the object and of loads",
            "the model's compiler has inertiafromgeom=\"true\", which overrules it; take it out",
        );
    }
}
