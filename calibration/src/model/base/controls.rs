//! Actuators of the arm, replaced where they stand: each control stays where it was, and keeps its name.

use super::classes::{ACTUATORS, Classes, MAIN, numbers};
use super::places::beside_frames;
use twin::xml::{Element, Node};

/// What a control of the new model is.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Control {
    /// The one that stood there, of an actuator that stays.
    Kept(usize),
    /// A position of the user's joint at the second place among the arm's, which the old control was as well, by this law.
    PositionKept(usize, usize, Law),
    /// A position of the user's joint at this place among the arm's, in place of something else.
    Position(usize),
    /// A speed, or what counts for nothing.
    Nothing,
}

/// What position of its joint a control asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Law {
    /// Position for each unit of the control [rad or m].
    slope: f64,
    /// Position at a control of 0 [rad or m].
    offset: f64,
}

/// What became of the controls.
#[derive(Debug, Default)]
pub(super) struct Controls {
    /// Of the new model, in its order.
    pub(super) controls: Vec<Control>,
    /// How many the old model had.
    pub(super) before: usize,
    /// Actuators that are gone, by name.
    pub(super) removed: Vec<String>,
    /// Whether states of actuators are others than before.
    pub(super) states_changed: bool,
    /// Whether any was replaced.
    pub(super) replaced: bool,
    /// Actuators that stay and pull at the arm in another way than at one joint, by name.
    pub(super) beside: Vec<String>,
}

/// Puts the cell's actuators in place of those of the arm's joints: `cell` names the joints in the cell, `own` in the user's model.
pub(super) fn replace(root: &mut Element, cell_root: &Element, cell: &[String], own: &[String]) -> Controls {
    let new: Vec<Element> = section(cell_root).cloned().collect();
    let classes = Classes::of(root);
    let old: Vec<Element> = section(root).cloned().collect();
    let mut done = Controls { before: old.len(), ..Controls::default() };
    if new.is_empty() {
        done.controls = (0..old.len()).map(Control::Kept).collect();
        return done;
    }
    done.replaced = true;
    let mut waiting: Vec<Vec<Element>> = cell.iter().map(|joint| of_joint(&new, joint)).collect();
    let taken: Vec<&str> = old.iter().filter_map(|actuator| actuator.get("name")).collect();
    let mut actuators = Vec::new();
    for (place, actuator) in old.iter().enumerate() {
        let Some((joint, coef)) = driven(actuator, root, own) else {
            if pulls_otherwise(actuator, root, own) {
                done.beside.push(actuator.get("name").unwrap_or("without a name").to_owned());
            }
            done.controls.push(Control::Kept(place));
            actuators.push(actuator.clone());
            continue;
        };
        let law = Law::of(actuator, &classes, coef);
        done.states_changed |= has_state(actuator, &classes);
        if waiting[joint].is_empty() {
            done.removed.extend(actuator.get("name").map(str::to_owned));
            continue;
        }
        let with = waiting[joint].remove(0);
        let is_position = is_position(&with);
        done.controls.push(match (is_position, law) {
            (true, Some(law)) => Control::PositionKept(place, joint, law),
            (true, None) => Control::Position(joint),
            (false, _) => Control::Nothing,
        });
        done.states_changed |= with.get("timeconst").is_some() || with.get("dyntype").is_some();
        let mut made = whole(&with, &own[joint]);
        if let Some(class) = actuator.get("class") {
            made.set("class", class);
        }
        let name =
            actuator.get("name").map_or_else(|| free_name(&with, &cell[joint], &own[joint], &taken), str::to_owned);
        made.attributes.insert(0, ("name".into(), name));
        for key in ["group", "user"] {
            if let Some(value) = actuator.get(key) {
                made.set(key, value);
            }
        }
        if let (Some(law), true) = (law, is_position) {
            law.limit(&mut made, actuator, &classes);
        }
        actuators.push(made);
    }
    for (joint, rest) in waiting.into_iter().enumerate() {
        for with in rest {
            done.controls.push(if is_position(&with) { Control::Position(joint) } else { Control::Nothing });
            done.states_changed |= with.get("timeconst").is_some() || with.get("dyntype").is_some();
            let mut made = whole(&with, &own[joint]);
            made.attributes.insert(0, ("name".into(), free_name(&with, &cell[joint], &own[joint], &taken)));
            actuators.push(made);
        }
    }
    write(root, actuators);
    done
}

impl Law {
    /// Of an actuator whose transmission moves by `coef` for each [rad or m] of its joint; `None` where its control is no position.
    fn of(actuator: &Element, classes: &Classes, coef: f64) -> Option<Self> {
        let get = |key: &str| classes.get(actuator, MAIN, &ACTUATORS, key);
        let list = |key: &str| get(key).map(|text| numbers(&text)).unwrap_or_default();
        let is = |key: &str, kinds: &[&str]| get(key).is_none_or(|kind| kinds.contains(&kind.as_str()));
        let at = |list: &[f64], place: usize, or: f64| list.get(place).copied().unwrap_or(or);
        let (gain, bias) = (list("gainprm"), list("biasprm"));
        let [gain, constant, stiff] = match actuator.name.as_str() {
            "position" => [1.0, 0.0, 1.0],
            "general" if get("biastype").is_some_and(|kind| kind == "affine") && is("gaintype", &["fixed"]) => {
                [at(&gain, 0, 1.0), at(&bias, 0, 0.0), -at(&bias, 1, 0.0)]
            }
            _ => return None,
        };
        let moved = stiff * at(&list("gear"), 0, 1.0) * coef;
        let is_law = stiff > 0.0 && moved != 0.0 && gain != 0.0 && is("dyntype", &["none", "filter", "filterexact"]);
        is_law.then(|| Self { slope: gain / moved, offset: constant / moved })
    }

    /// The position that a control asks for [rad or m].
    pub(super) fn at(&self, control: f64) -> f64 {
        self.slope * control + self.offset
    }

    /// Limits of the old control on the new one, which is a position.
    fn limit(&self, made: &mut Element, old: &Element, classes: &Classes) {
        if *self == (Self { slope: 1.0, offset: 0.0 }) {
            for key in ["ctrllimited", "ctrlrange"] {
                made.remove(key);
                if let Some(value) = old.get(key) {
                    made.set(key, value);
                }
            }
            return;
        }
        let get = |key: &str| classes.get(old, MAIN, &ACTUATORS, key);
        if let Some([one, other]) = get("ctrlrange").map(|text| numbers(&text)).as_deref() {
            let (one, other) = (self.at(*one), self.at(*other));
            made.set("ctrlrange", format!("{} {}", one.min(other), one.max(other)));
            made.set("ctrllimited", get("ctrllimited").unwrap_or_else(|| "auto".into()));
        }
    }
}

/// The joint of the arm's that an actuator drives, itself or by a tendon of this joint alone, and how far its transmission moves with it.
fn driven(actuator: &Element, root: &Element, own: &[String]) -> Option<(usize, f64)> {
    let place = |joint: &str| own.iter().position(|name| name == joint);
    if let Some(joint) = actuator.get("joint").or_else(|| actuator.get("jointinparent")) {
        return place(joint).map(|place| (place, 1.0));
    }
    let tendon = tendon(root, actuator.get("tendon")?)?;
    let joints: Vec<&Element> = tendon.elements().filter(|inner| inner.name == "joint").collect();
    let [one] = joints[..] else { return None };
    let coef = one.get("coef").map(numbers).and_then(|list| list.first().copied());
    place(one.get("joint")?).map(|place| (place, coef.unwrap_or(1.0)))
}

/// Whether an actuator that drives no joint of the arm alone pulls at the arm: by a tendon over its joints or sites, or at a site.
fn pulls_otherwise(actuator: &Element, root: &Element, own: &[String]) -> bool {
    let has_joint = |body: &Element| {
        beside_frames(body)
            .iter()
            .any(|e| e.name == "joint" && e.get("name").is_some_and(|name| own.iter().any(|own| own == name)))
    };
    let on_arm = |site: &str| {
        let links = root.all().into_iter().filter(|body| body.name == "body" && has_joint(body));
        links.flat_map(beside_frames).any(|e| e.name == "site" && e.get("name") == Some(site))
    };
    let pulled = actuator.get("tendon").and_then(|name| tendon(root, name)).is_some_and(|tendon| {
        tendon.elements().any(|inner| {
            inner.get("joint").is_some_and(|joint| own.iter().any(|own| own == joint))
                || inner.get("site").is_some_and(on_arm)
        })
    });
    pulled || actuator.get("site").is_some_and(on_arm)
}

fn tendon<'a>(root: &'a Element, name: &str) -> Option<&'a Element> {
    let tendons = root.elements().filter(|section| section.name == "tendon").flat_map(Element::elements);
    tendons.into_iter().find(|tendon| tendon.get("name") == Some(name))
}

/// Whether an actuator has a state of its own.
fn has_state(actuator: &Element, classes: &Classes) -> bool {
    let get = |key: &str| classes.get(actuator, MAIN, &ACTUATORS, key);
    let dynamic = get("dyntype").is_some_and(|kind| kind != "none");
    dynamic || ["intvelocity", "cylinder", "muscle"].contains(&actuator.name.as_str()) || get("timeconst").is_some()
}

fn section(root: &Element) -> impl Iterator<Item = &Element> {
    root.elements().filter(|element| element.name == "actuator").flat_map(Element::elements)
}

/// The cell's actuators of a joint: its position first, then its speed and what else there is.
fn of_joint(new: &[Element], joint: &str) -> Vec<Element> {
    new.iter().filter(|actuator| actuator.get("joint") == Some(joint)).cloned().collect()
}

fn is_position(actuator: &Element) -> bool {
    actuator.name == "position"
}

/// The cell's actuator with everything that a class of the user's could give it otherwise.
fn whole(with: &Element, joint: &str) -> Element {
    let number = |key: &str| with.get(key).unwrap_or("0").to_owned();
    let mut made = Element::new("general", &[("joint", joint.to_owned()), ("gear", "1 0 0 0 0 0".into())]);
    let (mut dynamics, mut time) = ("none".to_owned(), None);
    match with.name.as_str() {
        "position" => {
            made.set("gainprm", format!("{} 0 0", number("kp")));
            made.set("biasprm", format!("0 {} {}", against(&number("kp")), against(&number("kv"))));
            if let Some(constant) = with.get("timeconst") {
                (dynamics, time) = ("filterexact".into(), Some(constant.to_owned()));
            }
        }
        "velocity" => {
            made.set("gainprm", format!("{} 0 0", number("kv")));
            made.set("biasprm", format!("0 0 {}", against(&number("kv"))));
        }
        _ => {
            let padded = |key: &str| {
                let mut list = with.get(key).map(numbers).unwrap_or_default();
                list.resize(3, 0.0);
                list.iter().map(f64::to_string).collect::<Vec<_>>().join(" ")
            };
            made.set("gainprm", padded("gainprm"));
            made.set("biasprm", padded("biasprm"));
            if let Some(kind) = with.get("dyntype") {
                (dynamics, time) = (kind.to_owned(), with.get("dynprm").map(str::to_owned));
            }
        }
    }
    made.set("gaintype", "fixed");
    made.set("biastype", "affine");
    made.set("dyntype", dynamics);
    time.into_iter().for_each(|time| made.set("dynprm", time));
    for key in ["delay", "nsample", "interp"] {
        if let Some(value) = with.get(key) {
            made.set(key, value);
        }
    }
    made.set("ctrllimited", "false");
    made.set("forcelimited", "false");
    made
}

fn against(number: &str) -> String {
    number.strip_prefix('-').map_or_else(|| format!("-{number}"), str::to_owned)
}

/// The cell's name of an actuator with the user's name of the joint, where no other has it.
fn free_name(with: &Element, cell: &str, own: &str, taken: &[&str]) -> String {
    let mut name = with.get("name").unwrap_or("actuator").replace(cell, own);
    while taken.contains(&name.as_str()) {
        name.push('_');
    }
    name
}

/// All actuators into the first section of them.
fn write(root: &mut Element, actuators: Vec<Element>) {
    let nodes: Vec<Node> = actuators.into_iter().map(Node::Element).collect();
    let mut first = true;
    root.nodes.retain(|node| match node {
        Node::Element(element) if element.name == "actuator" => std::mem::replace(&mut first, false),
        _ => true,
    });
    root.last_or_new("actuator").nodes = nodes;
}
