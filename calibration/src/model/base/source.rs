//! The user's MJCF as one document: included files in their place, and files of meshes and textures named so that the new file finds them.

use super::Base;
use anyhow::{anyhow, ensure};
use shared_mem::input;
use shared_mem::place::from_anywhere;
use std::path::Path;
use twin::xml::{Element, Node};

/// Files that include each other, one within the other.
const DEEPEST: usize = 16;

/// Reads the model.
///
/// # Errors
/// The file that cannot be read or is no MJCF.
pub(super) fn read(base: &Base<'_>) -> anyhow::Result<Element> {
    let folder = base.file.parent().unwrap_or(Path::new(""));
    let mut root = root(base.file)?;
    ensure!(
        root.name == "mujoco",
        "{} begins with <{}>; --to mjcf takes an MJCF, whose root is <mujoco>",
        base.file.display(),
        root.name
    );
    include(&mut root, folder, 0)?;
    let out = base.out.unwrap_or(Path::new("model.xml"));
    if from_anywhere(out).parent() != from_anywhere(base.file).parent() {
        find_files_from_anywhere(&mut root, folder);
    }
    Ok(root)
}

fn root(file: &Path) -> anyhow::Result<Element> {
    let text = input::text(file, input::Kind::Robot)?;
    Element::read(&text).map_err(|what| anyhow!("{}: {what}", file.display()))
}

/// Puts what is included in its place; paths start in the folder of the first file, as MuJoCo has it.
fn include(element: &mut Element, folder: &Path, depth: usize) -> anyhow::Result<()> {
    ensure!(depth < DEEPEST, "files include each other more than {DEEPEST} deep; a file may not include itself");
    let mut nodes = Vec::with_capacity(element.nodes.len());
    for node in std::mem::take(&mut element.nodes) {
        match node {
            Node::Element(one) if one.name == "include" => {
                let file = folder.join(one.get("file").unwrap_or(""));
                let mut included = root(&file)?;
                include(&mut included, folder, depth + 1)?;
                nodes.extend(included.nodes);
            }
            Node::Element(mut one) => {
                include(&mut one, folder, depth)?;
                nodes.push(Node::Element(one));
            }
            other => nodes.push(other),
        }
    }
    element.nodes = nodes;
    Ok(())
}

/// Has meshes, textures and models of the old file's folder be found from every folder.
fn find_files_from_anywhere(root: &mut Element, folder: &Path) {
    let compilers: Vec<&Element> = root.elements().filter(|element| element.name == "compiler").collect();
    let said = |key: &str| compilers.iter().rev().find_map(|compiler| compiler.get(key)).map(str::to_owned);
    let assets = said("assetdir");
    let place = |key: &str| {
        let said = said(key).or_else(|| assets.clone()).unwrap_or_default();
        from_anywhere(&folder.join(said)).display().to_string()
    };
    let [meshes, textures] = ["meshdir", "texturedir"].map(place);
    let models = |model: &mut Element| {
        if let Some(file) = model.get("file").map(|file| from_anywhere(&folder.join(file))) {
            model.set("file", file.display().to_string());
        }
    };
    root.each_mut(&mut |element| {
        if element.name == "model" {
            models(element);
        }
        if element.name == "compiler" {
            ["assetdir", "meshdir", "texturedir"].iter().for_each(|key| element.remove(key));
        }
    });
    let compiler = Element::new("compiler", &[("meshdir", meshes), ("texturedir", textures)]);
    root.nodes.insert(0, Node::Element(compiler));
}
