//! Which modules of a package need which, by the paths in their text.

use std::collections::{BTreeMap, BTreeSet};

/// Modules that stand beside each other, each with those that it needs.
pub type Needs = BTreeMap<String, BTreeSet<String>>;

/// The paths that begin a text: one, or those of a group in braces.
fn begun(text: &str) -> Vec<Vec<String>> {
    let text = text.trim_start();
    if let Some(group) = text.strip_prefix('{') {
        return members(group).into_iter().flat_map(begun).collect();
    }
    let length = text.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(text.len());
    let (name, after) = text.split_at(length);
    if name.is_empty() {
        return Vec::new();
    }
    let mut behind = after.strip_prefix("::").map(begun).unwrap_or_default();
    behind.iter_mut().for_each(|path| path.insert(0, name.to_owned()));
    if behind.is_empty() { vec![vec![name.to_owned()]] } else { behind }
}

/// What stands between the commas of a group, up to the brace that ends it.
fn members(group: &str) -> Vec<&str> {
    let (mut found, mut depth, mut from) = (Vec::new(), 0, 0);
    for (at, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            ',' | '}' if depth == 0 => {
                found.push(&group[from..at]);
                from = at + 1;
                if c == '}' {
                    break;
                }
            }
            '}' => depth -= 1,
            _ => {}
        }
    }
    found
}

/// The paths in `text` that begin with `name::`, each with its names.
pub fn paths(text: &str, name: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    for (at, _) in text.match_indices(&format!("{name}::")) {
        let before = &text[..at];
        let is_begin = !before.ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == ':');
        // Who may see an item is not what it needs.
        if is_begin && !before.ends_with("(in ") {
            found.extend(begun(&text[at..]));
        }
    }
    found
}

/// Where the paths of `text` lead that begin with `crate::` or `super::`, from the package's root on; `own` is the module
/// that the text belongs to.
pub fn needed(own: &[String], text: &str) -> Vec<Vec<String>> {
    let from_root = |path: Vec<String>| {
        let up = path.iter().take_while(|name| *name == "super").count();
        let base = if up > 0 { &own[..own.len().saturating_sub(up)] } else { &[] };
        let names = path.into_iter().skip(up.max(1)).filter(|name| name != "self");
        base.iter().cloned().chain(names).collect()
    };
    paths(text, "crate").into_iter().chain(paths(text, "super")).map(from_root).collect()
}

/// The module that a file of a package is, from the package's root on; `None` for a program of its own.
pub fn module(file: &str) -> Option<Vec<String>> {
    let mut names: Vec<String> = file.strip_suffix(".rs")?.split('/').map(str::to_owned).collect();
    if names[0] == "bin" {
        return None;
    }
    if names.last().is_some_and(|name| ["mod", "lib", "main"].contains(&name.as_str())) {
        names.pop();
    }
    Some(names)
}

/// Who needs whom of the modules that stand beside each other, by the module that they stand in. A module's own ones belong
/// to it: what they need it needs, and that they need it is no matter.
pub fn needs(files: &[(Vec<String>, String)]) -> BTreeMap<Vec<String>, Needs> {
    let modules: BTreeSet<&[String]> =
        files.iter().flat_map(|(own, _)| (1..=own.len()).map(|length| &own[..length])).collect();
    let mut needs: BTreeMap<Vec<String>, Needs> = BTreeMap::new();
    for (own, text) in files {
        for path in needed(own, text) {
            let shared = own.iter().zip(&path).take_while(|(a, b)| a == b).count();
            if let (Some(from), Some(to)) = (own.get(shared), path.get(shared))
                && modules.contains(&path[..=shared])
            {
                needs.entry(own[..shared].to_vec()).or_default().entry(from.clone()).or_default().insert(to.clone());
            }
        }
    }
    needs
}

/// What is left when whoever needs nothing that is left goes, and whom nobody needs: the circles.
pub fn circles(mut needs: Needs) -> Needs {
    loop {
        let before = needs.len();
        let all: BTreeSet<String> = needs.keys().cloned().collect();
        needs.values_mut().for_each(|needed| needed.retain(|name| all.contains(name)));
        let wanted: BTreeSet<String> = needs.values().flatten().cloned().collect();
        needs.retain(|name, needed| !needed.is_empty() && wanted.contains(name));
        if needs.len() == before {
            return needs;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_told_from_each_other() {
        let own = ["a", "b"].map(str::to_owned);
        let found = |text: &str| needed(&own, text).iter().map(|path| path.join("/")).collect::<Vec<_>>().join(" ");
        assert_eq!(found("use crate::{c::{self, D}, e};"), "c c/D e");
        assert_eq!(found("use super::f::g;\nlet x = super::super::H::<u8>::new();"), "a/f/g H");
        assert_eq!(found("pub(in crate::a) use own::b; let mysuper::x = i::crate::k;"), "");
    }

    #[test]
    fn a_circle_is_what_is_left_of_all_that_modules_need() {
        let file = |own: &str, text: &str| (own.split('/').map(str::to_owned).collect(), text.to_owned());
        let found = needs(&[
            file("a", "use crate::c::X;"),
            file("c/d", "use super::e::f; use crate::g;"),
            file("c/e", "use super::{Y, d};"),
            file("g", ""),
        ]);
        let [whole, within] = [&[][..], &["c".to_owned()]].map(|folder| circles(found[folder].clone()));
        assert!(whole.is_empty(), "{whole:?}");
        assert_eq!(within.keys().collect::<Vec<_>>(), ["d", "e"]);
    }
}
