//! A cell.toml in another folder: its text, comments included, with the files that it names by paths that lead there from anywhere, and
//! without clips.

use super::Cell;
use crate::toml_file::updated;
use std::path::Path;
use toml::{Table, Value};

/// The keys that name files, one block's.
fn files<'a>(keys: impl IntoIterator<Item = (&'static str, Option<&'a Path>)>) -> Option<Table> {
    let named = |(key, path): (&'static str, Option<&'a Path>)| Some((key.to_owned(), path?.to_str()?.into()));
    let table: Table = keys.into_iter().filter_map(named).collect();
    (!table.is_empty()).then_some(table)
}

impl Cell {
    /// The text of this cell's file as it stands in another folder. `None` where the text is not that of a cell.toml, or a block without
    /// a name names files among several.
    pub fn text_elsewhere(&self, text: &str) -> Option<String> {
        let moved = self.at_home_anywhere();
        let mut update = Table::new();
        let robot = moved.robot.as_ref().and_then(|robot| files([("urdf", robot.urdf.as_deref())]));
        update.extend(robot.map(|robot| ("robot".to_owned(), Value::Table(robot))));
        let background = moved.background.as_ref().and_then(|there| files([("splats", Some(there.splats.as_path()))]));
        update.extend(background.map(|there| ("background".to_owned(), Value::Table(there))));
        let mut objects = moved.objects.iter().filter_map(|object| {
            let [mesh, splats, urdf] = [&object.mesh, &object.splats, &object.urdf].map(|path| path.as_deref());
            let mut named = files([("mesh", mesh), ("splats", splats), ("urdf", urdf)])?;
            named.extend(object.name.clone().map(|name| ("name".to_owned(), name.into())));
            Some(Value::Table(named))
        });
        let given: Table = text.parse().ok()?;
        let object = match given.get("object") {
            // Blocks are told apart by their names.
            Some(Value::Array(_)) if moved.objects.iter().all(|object| object.name.is_some()) => {
                let all: Vec<Value> = objects.collect();
                (!all.is_empty()).then_some(Value::Array(all))
            }
            Some(Value::Array(_)) if objects.next().is_some() => return None,
            Some(Value::Array(_)) => None,
            _ => objects.next(),
        };
        update.extend(object.map(|object| ("object".to_owned(), object)));
        updated(text, &toml::to_string(&update).ok()?, &["clip"])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_moved_file_keeps_its_comments_and_finds_its_files() {
        let text = "# our best cell\n[robot]\nurdf = \"arm.urdf\" # measured\njoints = [\"a\", \"b\"]\n\n[table]\nheight = 0\n\n\
                    [[object]]\nname = \"mug\" # blue\nmesh = \"mug.obj\"\nmass = 0.3\n\n[[object]]\nname = \"box\"\nshape = \"box\"\nsize = [0.1, 0.1, 0.1]\n\n\
                    [[clip]]\nfile = \"clip_00.mcap\"\nkind = \"excitation\"\n";
        let cell = Cell::parse(text, Path::new("/lab/cell.toml")).expect("a cell");
        let moved = cell.text_elsewhere(text).expect("a cell.toml");
        for kept in ["# our best cell", "# measured", "# blue", "height = 0\n", "size = [0.1, 0.1, 0.1]"] {
            assert!(moved.contains(kept), "{kept}:\n{moved}");
        }
        assert!(!moved.contains("[[clip]]"), "{moved}");
        let read = Cell::parse(&moved, Path::new("/elsewhere/cell.toml")).expect("a cell");
        assert_eq!(read.at_home_anywhere().to_toml(), Cell { clips: Vec::new(), ..cell.at_home_anywhere() }.to_toml());
    }

    #[test]
    fn a_file_that_names_no_other_stays_as_it_is() {
        let text = include_str!("../../../config/fr3_cell.toml");
        let cell = Cell::parse(text, Path::new("/lab/cell.toml")).expect("a cell");
        assert_eq!(cell.text_elsewhere(text).as_deref(), Some(text));
    }
}
