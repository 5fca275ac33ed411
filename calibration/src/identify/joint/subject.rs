//! Which joint is asked for: its object in cell.toml, its file, and the part that it carries.

use shared_mem::cell::{Cell, Object};
use shared_mem::input;
use std::fmt::Display;
use std::path::PathBuf;
use twin::arm::{MassProperties, UrdfBody, UrdfJoint};
use twin::scene::start_of;

/// A joint of an object that moves in itself.
#[derive(Debug)]
pub(super) struct Subject {
    pub(super) object: String,
    pub(super) joint: UrdfJoint,
    /// What moves on it, in its link's frame: the link, and what hangs on it where the simulated cell starts.
    pub(super) part: MassProperties,
    /// Names under which poses are recorded: of the body that carries the part, and of the part.
    pub(super) bodies: [String; 2],
    /// The URDF, as cell.toml names it, and its text.
    pub(super) file: PathBuf,
    pub(super) text: String,
}

impl Subject {
    /// The joint of this name on the object of this name, where none is named the only one; or what is missing, and what to do about it.
    pub(super) fn of(cell: &Cell, object: Option<&str>, joint: Option<&str>) -> Result<Self, String> {
        let articulated = || cell.objects.iter().filter(|object| object.urdf.is_some());
        let found = choose(articulated(), object, |one: &&Object| one.name.clone().unwrap_or_default(), "--object")
            .map_err(|names| match names {
                None => "cell.toml has no articulated object; give it an [[object]] with a `name` and a `urdf` \
                         (docs/cell.md)"
                    .to_owned(),
                Some(what) => format!("{what} among the objects with a `urdf` in cell.toml"),
            })?;
        let name = found.name.clone().unwrap_or_default();
        let file = cell.folder.join(found.urdf.as_deref().unwrap_or(std::path::Path::new("")));
        let text = input::text(&file, input::Kind::Robot).map_err(|error| format!("{error} (`urdf` of `{name}`)"))?;
        let bodies = UrdfBody::of(&text, &file).map_err(|error| error.to_string())?;
        let moving = (0..bodies.len()).filter_map(|k| Some((k, bodies[k].joint.as_ref()?)));
        let shown = file.display();
        let (k, joint) =
            choose(moving, joint, |(_, joint)| joint.name.clone(), "--joint").map_err(|what| match what {
                None => format!("{shown} has no joint that moves"),
                Some(what) => format!("{what} in {shown}"),
            })?;
        let joint = joint.clone();
        let part = carried(found, &bodies, k);
        let has_inertia = part.inertia.cholesky().is_some();
        if !(part.mass > 0.0 && has_inertia) {
            return Err(format!(
                "link `{}` of {shown} has no mass or inertia; weigh the part and give it an <inertial>: friction is found in \
                 proportion to it",
                bodies[k].link
            ));
        }
        let recorded = |k: usize| match bodies[k].joint {
            Some(_) => format!("{name}_{}", bodies[k].link),
            None => name.clone(),
        };
        let bodies = [recorded(joint.parent), recorded(k)];
        Ok(Self { object: name, joint, part, bodies, file, text })
    }

    /// Units of a position, of a torque or force, and of damping.
    pub(super) fn units(&self) -> [&'static str; 3] {
        if self.joint.slides { ["m", "N", "N s/m"] } else { ["rad", "N m", "N m s/rad"] }
    }
}

/// The one of this name, or the only one; else what to say: nothing where there is none at all.
fn choose<T>(
    all: impl Iterator<Item = T>,
    asked: Option<&str>,
    name: impl Fn(&T) -> String,
    option: impl Display,
) -> Result<T, Option<String>> {
    let mut all: Vec<T> = all.collect();
    let names: Vec<String> = all.iter().map(name).collect();
    let at = match asked {
        Some(asked) => names.iter().position(|name| name == asked),
        None => (all.len() == 1).then_some(0),
    };
    match (at, asked) {
        (Some(at), _) => Ok(all.swap_remove(at)),
        (None, _) if names.is_empty() => Err(None),
        (None, Some(asked)) => {
            Err(Some(format!("none is called `{asked}`; there are {}: say which with {option}", names.join(", "))))
        }
        (None, None) => {
            Err(Some(format!("there are {}: say which with {option} {}", names.join(" and "), names.join("|"))))
        }
    }
}

/// A link and all that hangs on it, in the link's frame.
fn carried(object: &Object, bodies: &[UrdfBody], k: usize) -> MassProperties {
    let hanging = bodies.iter().enumerate().filter_map(|(child, body)| Some((child, body, body.joint.as_ref()?)));
    hanging.filter(|(_, _, joint)| joint.parent == k).fold(bodies[k].mass, |sum, (child, body, joint)| {
        let at = joint.pose_at(start_of(object, body));
        sum.joined_with(&carried(object, bodies, child).seen_from(&at))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::toml_file;
    use std::path::Path;

    const DESK: &str = "<robot name='desk'>
  <link name='case'/>
  <link name='drawer'><inertial><mass value='2'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial></link>
  <link name='lid'><inertial><origin xyz='0 0 .1'/><mass value='1'/><inertia ixx='.1' iyy='.1' izz='.1' ixy='0' ixz='0' iyz='0'/></inertial></link>
  <joint name='rail' type='prismatic'><parent link='case'/><child link='drawer'/><axis xyz='1 0 0'/>
    <limit lower='0' upper='.4' effort='9' velocity='9'/></joint>
  <joint name='hinge' type='revolute'><parent link='drawer'/><child link='lid'/><origin xyz='0 .3 0'/><axis xyz='0 1 0'/>
    <limit lower='0' upper='2' effort='9' velocity='9'/></joint>
</robot>";

    fn cell(urdf: &str) -> (tempfile::TempDir, Cell) {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("desk.urdf"), urdf).expect("room");
        let text = "[[object]]\nname = \"desk\"\nurdf = \"desk.urdf\"\n";
        let mut cell: Cell = toml_file::parse(text, Path::new("cell.toml")).expect("a cell.toml");
        cell.folder = folder.path().to_owned();
        (folder, cell)
    }

    #[test]
    fn a_drawer_carries_what_hangs_on_it() {
        let (_folder, cell) = cell(DESK);
        let drawer = Subject::of(&cell, None, Some("rail")).expect("a drawer");
        assert_eq!(drawer.bodies, ["desk", "desk_drawer"]);
        assert!((drawer.part.mass - 3.0).abs() < 1e-12 && (drawer.part.centre.y - 0.1).abs() < 1e-12);
        let lid = Subject::of(&cell, Some("desk"), Some("hinge")).expect("a lid");
        assert_eq!(lid.bodies, ["desk_drawer", "desk_lid"]);
        assert_eq!((lid.part.mass, lid.units()[1]), (1.0, "N m"));
    }

    #[test]
    fn what_is_not_clear_or_missing_is_said_with_a_remedy() {
        let (_folder, desk) = cell(DESK);
        let why = |cell: &Cell, object, joint| Subject::of(cell, object, joint).expect_err("no joint");
        assert!(why(&desk, None, None).contains("--joint rail|hinge"), "{}", why(&desk, None, None));
        assert!(why(&desk, Some("table"), None).contains("none is called `table`; there are desk"));
        assert!(why(&desk, None, Some("knob")).contains("none is called `knob`; there are rail, hinge"));
        assert!(why(&Cell::default(), None, None).contains("give it an [[object]]"));
        let (_folder, light) = cell(&DESK.replace("<mass value='1'/>", "<mass value='0'/>"));
        assert!(
            why(&light, None, Some("hinge")).contains("link `lid`")
                && why(&light, None, Some("hinge")).contains("<inertial>")
        );
        assert!(Subject::of(&light, None, Some("rail")).is_ok());
    }
}
