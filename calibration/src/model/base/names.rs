//! Names: what the cell brings along is called otherwise where the user's model has its name for something else.

use super::LeftOut;
use twin::xml::{Element, Node};

/// Names for something that the cell brings along, its own first.
pub(super) fn names_for(wanted: &str) -> impl Iterator<Item = String> + '_ {
    let more = (2..).map(move |number| format!("cell_{wanted}_{number}"));
    [wanted.to_owned(), format!("cell_{wanted}")].into_iter().chain(more)
}

/// Renames in the cell's model what the user's has for something else; `last` is the link on which loads hang. What was renamed.
pub(super) fn tell_apart(cell: &mut Element, own: &Element, last: Option<&Element>) -> Vec<LeftOut> {
    let theirs: Vec<&Element> = own.all();
    let object = worlds(own).find(|body| body.name == "body" && body.get("name") == Some("object"));
    let in_object: Vec<&Element> = object.into_iter().flat_map(Element::all).collect();
    let on_last: Vec<&Element> = last.into_iter().flat_map(Element::elements).collect();
    let is_there = |kinds: &[&str], name: &str, is_replaced: &dyn Fn(&Element) -> bool| {
        theirs.iter().any(|e| kinds.contains(&e.name.as_str()) && called(e) == Some(name) && !is_replaced(e))
    };
    let is_in = |list: &[&Element], element: &Element| list.iter().any(|one| std::ptr::eq(*one, element));
    let mut renamed = Vec::new();
    let mut rename = |kind: &str, old: &str, is_taken: &dyn Fn(&str) -> bool| {
        let new = names_for(old).find(|name| !is_taken(name)).unwrap_or_default();
        if new != old {
            renamed.push((kind.to_owned(), old.to_owned(), new));
        }
    };
    for new in cell.all() {
        let Some(name) = new.get("name") else { continue };
        match new.name.as_str() {
            "body" if is_load(new) => {
                rename("body", name, &|name| is_there(&["body"], name, &|old| is_in(&on_last, old) && is_load(old)));
            }
            "geom" if name.starts_with("object") => {
                rename("geom", name, &|name| is_there(&["geom"], name, &|old| is_in(&in_object, old)));
            }
            "freejoint" if object.is_none() => {
                rename("freejoint", name, &|name| is_there(&["joint", "freejoint"], name, &|_| false));
            }
            "mesh" => rename("mesh", name, &|name| is_there(&["mesh"], name, &|old| old.get("vertex").is_some())),
            kind if ["framepos", "framequat"].contains(&kind) => {
                let sensors = own.elements().filter(|section| section.name == "sensor").flat_map(Element::elements);
                let others: Vec<&str> =
                    sensors.filter(|old| old.name != kind).filter_map(|old| old.get("name")).collect();
                rename(kind, name, &|name| others.contains(&name));
            }
            _ => {}
        }
    }
    for (kind, old, new) in &renamed {
        cell.each_mut(&mut |element| {
            if element.name == *kind && element.get("name") == Some(old) {
                element.set("name", new.as_str());
            }
            let refers: &[&str] = match kind.as_str() {
                "geom" => &["geom1", "geom2"],
                "mesh" => &["mesh"],
                _ => &[],
            };
            for key in refers {
                if element.get(key) == Some(old) {
                    element.set(key, new.as_str());
                }
            }
        });
    }
    let said = |(kind, old, new): (String, String, String)| LeftOut {
        what: format!("the name `{old}` of the cell's {kind}"),
        why: format!("the model has something else of this name; the cell's is `{new}`"),
    };
    renamed.into_iter().map(said).collect()
}

/// Whether a body is a load as a merge writes one: a point.
pub(super) fn is_load(body: &Element) -> bool {
    let mut inner = body.elements();
    inner.next().is_some_and(|one| one.name == "inertial" && one.get("diaginertia") == Some("1e-9 1e-9 1e-9"))
        && inner.next().is_none()
}

/// The user's object with what the cell knows of its own of this name: where it is, its joint, sites and shapes stay.
pub(super) fn into_object(old: &mut Element, new: Element) {
    let of_new: Vec<Node> = new.nodes.into_iter().filter(|node| !is_joint(node)).collect();
    old.nodes.retain(|node| match node {
        Node::Element(element) if element.name == "inertial" => false,
        Node::Element(element) if element.name == "geom" && element.get("name").is_some() => {
            let name = element.get("name");
            !of_new
                .iter()
                .any(|new| matches!(new, Node::Element(geom) if geom.name == "geom" && geom.get("name") == name))
        }
        Node::Comment(_) => !of_new.contains(node),
        _ => true,
    });
    // Only the contact pairs touch, in the cell.
    old.each_mut(&mut |element| {
        if element.name == "geom" {
            element.set("contype", "0");
            element.set("conaffinity", "0");
        }
    });
    old.nodes.extend(of_new);
}

fn is_joint(node: &Node) -> bool {
    matches!(node, Node::Element(element) if element.name.ends_with("joint"))
}

fn worlds(root: &Element) -> impl Iterator<Item = &Element> {
    root.elements().filter(|section| section.name == "worldbody").flat_map(Element::elements)
}

/// A name, as MuJoCo takes a mesh's from its file where it has none.
fn called(element: &Element) -> Option<&str> {
    let file = || std::path::Path::new(element.get("file").filter(|_| element.name == "mesh")?).file_stem()?.to_str();
    element.get("name").or_else(file)
}
