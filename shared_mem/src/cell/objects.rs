//! The objects of a cell: one `[object]` without a name, or `[[object]]` blocks with one each. A command is about one of
//! them at a time; the others are in its recordings, and in nobody's way.

use super::{Cell, Object};
use crate::blocks::{self, Named};
use schemars::JsonSchema;

/// What the file may hold, for its schema.
#[derive(JsonSchema)]
#[schemars(inline)]
#[serde(untagged)]
#[allow(dead_code)]
pub(super) enum Blocks {
    /// One without a name.
    One(Box<Object>),
    /// Several.
    Many(Vec<Object>),
}

/// Most objects of a cell.
const MOST: usize = 32;

impl Named for Object {
    const KEY: &'static str = "object";

    fn name(&self) -> Option<&str> {
        self.name.as_deref()
    }
}

impl Cell {
    /// The object that a command is about: the first, unless [`Self::about`] said another; `None` without any.
    pub fn object(&self) -> Option<&Object> {
        self.objects.get(self.in_question)
    }

    /// The same to be changed.
    pub fn object_mut(&mut self) -> Option<&mut Object> {
        self.objects.get_mut(self.in_question)
    }

    /// Its name; `None` without one.
    pub fn object_name(&self) -> Option<&str> {
        self.object()?.name.as_deref()
    }

    /// Its name where there are several, so that an answer has to say which one it is about.
    pub fn one_of_several(&self) -> Option<&str> {
        self.object_name().filter(|_| self.objects.len() > 1)
    }

    /// The objects beside it, in the order of the file.
    pub fn other_objects(&self) -> impl Iterator<Item = &Object> {
        self.objects.iter().enumerate().filter(|(i, _)| *i != self.in_question).map(|(_, object)| object)
    }

    /// Where it starts in the simulated cell: x, y of its geometric centre in the base frame [m], and its rotation about z [rad]. What its
    /// own block leaves out stands under `[simulation]`.
    pub fn object_start(&self) -> ([f64; 2], f64) {
        let (own, simulation) = (self.object(), &self.simulation);
        let place = own.and_then(|object| object.start).unwrap_or(simulation.object_position);
        (place, own.and_then(|object| object.start_yaw).unwrap_or(simulation.object_yaw))
    }

    /// Has it start elsewhere; nothing happens without an object.
    pub fn start_object_at(&mut self, place: [f64; 2], yaw: f64) {
        if let Some(object) = self.object_mut() {
            (object.start, object.start_yaw) = (Some(place), Some(yaw));
        }
    }

    /// Makes the object of this name the one in question.
    ///
    /// # Errors
    /// The sentence to print where there is none of that name, or it moves in itself.
    pub fn about(&mut self, name: &str) -> Result<(), String> {
        let place = self.place_of(name)?;
        if self.objects[place].urdf.is_some() {
            return Err(format!(
                "object `{name}` moves in itself (`urdf`), and only rigid ones are identified: name another"
            ));
        }
        self.in_question = place;
        Ok(())
    }

    /// Place of the object of this name among [`Cell::objects`].
    ///
    /// # Errors
    /// The sentence to print where there is none of that name.
    pub fn place_of(&self, name: &str) -> Result<usize, String> {
        let named = |object: &Object| object.name.as_deref() == Some(name);
        self.objects.iter().position(named).ok_or_else(|| {
            let names: Vec<&str> = self.objects.iter().filter_map(|object| object.name.as_deref()).collect();
            match names.is_empty() {
                true => format!("cell.toml names no object, so `--object {name}` fits none; leave it out"),
                false => format!("cell.toml has no object `{name}`; it has {}", names.join(", ")),
            }
        })
    }

    pub(super) fn check_objects(&self) -> Result<(), String> {
        if self.objects.len() > MOST {
            return Err(format!("holds {} objects; at most {MOST} are followed", self.objects.len()));
        }
        blocks::check_names(&self.objects)?;
        let told = |object: &Object, what: String| match &object.name {
            Some(name) if self.objects.len() > 1 => format!("object `{name}`: {what}"),
            _ => what,
        };
        self.objects.iter().try_for_each(|object| object.check().map_err(|what| told(object, what)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn parse(text: &str) -> Result<Cell, String> {
        Cell::parse(text, Path::new("cell.toml")).map_err(|error| error.to_string())
    }

    const CUP: &str = "[[object]]\nname = \"cup\"\nshape = \"box\"\nsize = [0.1, 0.1, 0.1]\n";
    const LAPTOP: &str = "[[object]]\nname = \"laptop\"\nurdf = \"laptop.urdf\"\n";
    const BOX: &str = "[[object]]\nname = \"milk_box\"\nshape = \"box\"\nsize = [0.1, 0.2, 0.1]\nmass = 0.4\n";

    #[test]
    fn several_objects_are_told_apart_by_name_and_one_without_a_name_stays_a_block() {
        let mut cell = parse(&format!("{CUP}{BOX}")).expect("two objects");
        assert_eq!(cell.object_name(), Some("cup"));
        cell.about("milk_box").expect("the second");
        assert_eq!(cell.object().and_then(|object| object.mass), Some(0.4));
        assert_eq!(cell.other_objects().map(|object| object.name.as_deref()).collect::<Vec<_>>(), [Some("cup")]);
        assert_eq!(parse(&cell.to_toml()).expect("own text").objects, cell.objects);
        let error = cell.about("plate").expect_err("no plate");
        assert!(error.contains("no object `plate`; it has cup, milk_box"), "{error}");
        let one = parse("[object]\nshape = \"box\"\nsize = [0.1, 0.1, 0.1]\n").expect("one object");
        assert!(one.to_toml().contains("\n[object]\n") || one.to_toml().starts_with("[object]\n"), "{}", one.to_toml());
        assert_eq!(parse(&one.to_toml()).expect("own text"), one);
    }

    #[test]
    fn an_object_starts_where_its_block_says_and_where_it_is_put_after_that() {
        let simulation = "[simulation]\nobject_position = [0.5, 0.1]\nobject_yaw = 0.2\n";
        let mut cell = parse(&format!("{CUP}{simulation}")).expect("an object");
        assert_eq!(cell.object_start(), ([0.5, 0.1], 0.2));
        cell = parse(&format!("{CUP}start = [0.4, -0.1]\n{simulation}")).expect("an object");
        assert_eq!(cell.object_start(), ([0.4, -0.1], 0.2));
        cell.start_object_at([0.6, 0.0], -1.0);
        assert_eq!(parse(&cell.to_toml()).expect("own text").object_start(), ([0.6, 0.0], -1.0));
    }

    #[test]
    fn an_object_that_moves_in_itself_is_read_and_no_command_is_about_it() {
        let block = "hold = \"fixed\"\njoints = { hinge = -0.3 }\nstart = [0.4, 0.2]\nstart_yaw = 0.5\n";
        let mut cell = parse(&format!("{CUP}{LAPTOP}{block}")).expect("two objects");
        assert_eq!(parse(&cell.to_toml()).expect("own text").objects, cell.objects);
        assert_eq!(cell.objects[1].joints["hinge"], -0.3);
        assert!(cell.about("laptop").expect_err("it is not rigid").contains("moves in itself"));
        assert!(cell.about("cup").is_ok());
        cell.folder = "/lab".into();
        assert_eq!(cell.at_home_anywhere().objects[1].urdf.as_deref(), Some(Path::new("/lab/laptop.urdf")));
    }

    #[test]
    fn what_cannot_be_told_apart_is_refused_in_one_line() {
        let unnamed = "[[object]]\nshape = \"box\"\nsize = [0.1, 0.1, 0.1]\n";
        for (text, told) in [
            (format!("{CUP}{unnamed}"), "number 2 has no `name`"),
            (format!("{CUP}{CUP}"), "two [[object]] blocks are named `cup`"),
            (format!("[object]\nshape = \"box\"\nsize = [0.1, 0.1, 0.1]\n{CUP}"), "both [object] and [[object]]"),
            (format!("{BOX}[object]\n"), "both [object] and [[object]]"),
            (CUP.replace("cup", "a/b"), "letters, digits and _"),
            (CUP.replace("cup", "pose"), "another name"),
            (format!("{CUP}{}", BOX.replace("0.2", "0.0")), "object `milk_box`: `object.size`"),
            ("object = 3\n".into(), "[[object]] blocks"),
            (CUP.replace("cup", "a b"), "letters, digits and _"),
            (CUP.replace("shape = \"box\"\n", ""), "exactly one of"),
            ("[object]\nurdf = \"laptop.urdf\"\n".into(), "needs a `name`"),
            (format!("{CUP}urdf = \"laptop.urdf\"\n"), "is of a rigid object"),
            (format!("{CUP}hold = \"fixed\"\n"), "of an object with `urdf`"),
            (format!("{LAPTOP}mesh = \"cup.obj\"\n"), "in place of `shape` and `mesh`"),
            (format!("{LAPTOP}mass = 1.0\n"), "is of a rigid object"),
            (format!("{LAPTOP}hold = \"moved\"\n"), "expected `free` or `fixed`"),
            (format!("{LAPTOP}joints = {{ hinge = nan }}\n"), "`object.joints` puts `hinge`"),
            (format!("{CUP}start = [500.0, 0.0]\n"), "object.start"),
            (format!("{CUP}start_yaw = 90.0\n"), "object.start_yaw"),
        ] {
            let error = parse(&text).expect_err(told);
            assert!(error.contains(told) && !error.contains('\n'), "{error}");
        }
    }
}
