//! Objects that move in themselves, out of URDF files: a body for each link that moves, on the joints of the file.

use super::file::{ArticulatedEntry, HoldEntry, PieceEntry, ShapeEntry};
use super::surface::pose;
use crate::arm::{UrdfBody, UrdfForm};
use crate::world::{BodyPlan, Hold, JointKind, JointPlan};
use shared_mem::input;
use std::path::Path;

type Fault = (&'static str, String);

impl ArticulatedEntry {
    /// Its bodies, of which the first is the root and has its name, the others `NAME_LINK`; `before` bodies come before them.
    pub(super) fn bodies(&self, before: usize, folder: &Path) -> Result<Vec<BodyPlan>, Fault> {
        let file = folder.join(&self.urdf);
        let fault = |what: String| ("urdf", what);
        let text = input::text(&file, input::Kind::Robot).map_err(|error| fault(error.to_string()))?;
        let links = UrdfBody::of(&text, &file).map_err(|error| fault(error.to_string()))?;
        if let Some(unknown) = self.joints.keys().find(|name| !links.iter().any(|link| link.is_on(name))) {
            let known: Vec<&str> = links.iter().filter_map(|link| Some(link.joint.as_ref()?.name.as_str())).collect();
            return Err(("joints", format!("no joint is called `{unknown}`; there are: {}", known.join(", "))));
        }
        links.iter().map(|link| self.body(link, before, file.parent().unwrap_or(Path::new("")))).collect()
    }

    fn body(&self, link: &UrdfBody, before: usize, folder: &Path) -> Result<BodyPlan, Fault> {
        let entries = link.shapes.iter().map(|shape| {
            let [position, rotation] = [shape.at.translation.vector.into(), angles(&shape.at)];
            let entry = PieceEntry { position, rotation, ..PieceEntry::default() };
            match &shape.form {
                UrdfForm::Box(size) => PieceEntry { shape: Some(ShapeEntry::Box), size: Some(*size), ..entry },
                UrdfForm::Cylinder { radius, length } => PieceEntry {
                    shape: Some(ShapeEntry::Cylinder),
                    radius: Some(*radius),
                    length: Some(*length),
                    ..entry
                },
                UrdfForm::Mesh(file) => PieceEntry { mesh: Some(file.into()), ..entry },
            }
        });
        let of_link = |(_, what): Fault| ("urdf", format!("link `{}`: {what}", link.link));
        let pieces = entries.map(|entry| entry.piece(folder)).collect::<Result<Vec<_>, _>>().map_err(of_link)?;
        let hold = match &link.joint {
            Some(joint) => Hold::Joint(JointPlan {
                parent: Some(before + joint.parent),
                at: joint.at,
                kind: if joint.slides { JointKind::Prismatic } else { JointKind::Revolute },
                axis: joint.axis,
                limits: joint.limits,
                start: self.joints.get(&joint.name).copied().unwrap_or(0.0_f64.clamp(joint.limits[0], joint.limits[1])),
                friction: joint.friction,
                damping: joint.damping,
                drive: None,
                follows: None,
            }),
            None => match self.hold {
                HoldEntry::Fixed => Hold::Fixed(pose(self.position, self.rotation)),
                HoldEntry::Free => Hold::Free(pose(self.position, self.rotation)),
                HoldEntry::Moved => {
                    return Err(("hold", "it is \"free\" or \"fixed\"; what is moved is a [[body]]".into()));
                }
            },
        };
        let moves = !matches!(hold, Hold::Fixed(_));
        if moves && !(link.mass.mass > 0.0 && link.mass.inertia.cholesky().is_some()) {
            return Err((
                "urdf",
                format!("link `{}` moves and has no mass or inertia; give it an <inertial>", link.link),
            ));
        }
        let name = if link.joint.is_some() { format!("{}_{}", self.name, link.link) } else { self.name.clone() };
        Ok(BodyPlan {
            name,
            pieces,
            mass: link.mass.mass,
            centre_of_mass: link.mass.centre,
            inertia: link.mass.inertia,
            friction: self.friction,
            pad_radius: 0.0,
            hold,
        })
    }
}

impl UrdfBody {
    fn is_on(&self, joint: &str) -> bool {
        self.joint.as_ref().is_some_and(|own| own.name == joint)
    }
}

fn angles(at: &nalgebra::Isometry3<f64>) -> [f64; 3] {
    let (roll, pitch, yaw) = at.rotation.euler_angles();
    [roll, pitch, yaw]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::Task;

    /// The laptop of the task that ships.
    const LAPTOP: &str = "<robot name='laptop'>
  <link name='base'>
    <inertial><mass value='1.1'/><inertia ixx='0.00883887' iyy='0.00446637' izz='0.01324583' ixy='0' ixz='0' iyz='0'/></inertial>
    <collision><geometry><box size='0.22 0.31 0.018'/></geometry></collision>
  </link>
  <link name='foot'/>
  <link name='lid'>
    <inertial><origin xyz='0 0 0.105'/><mass value='0.5'/><inertia ixx='0.00584167' iyy='0.001839' izz='0.00400567' ixy='0' ixz='0' iyz='0'/></inertial>
    <collision><origin xyz='0 0 0.105'/><geometry><box size='0.006 0.31 0.21'/></geometry></collision>
  </link>
  <joint name='glue' type='fixed'><parent link='base'/><child link='foot'/></joint>
  <joint name='hinge' type='revolute'>
    <parent link='foot'/><child link='lid'/><origin xyz='0.11 0 0.012'/><axis xyz='0 -1 0'/>
    <limit lower='-0.5' upper='1.5708' effort='9' velocity='9'/><dynamics friction='0.7' damping='0.02'/>
  </joint>
</robot>";

    fn with(urdf: &str, block: &str) -> Result<Task, String> {
        let folder = tempfile::tempdir().expect("a folder");
        std::fs::write(folder.path().join("laptop.urdf"), urdf).expect("room");
        let task = folder.path().join("task.toml");
        let rest = "horizon = 2.0\n[[body]]\nname = \"table\"\nhold = \"fixed\"\nfriction = 0.5\n\
            piece = [{ shape = \"box\", size = [1.2, 1.2, 0.1], position = [0.5, 0.0, -0.05] }]\n\
            [[success]]\njoint = \"laptop_lid\"\nbetween = [1.53, 1.60]\n";
        std::fs::write(&task, format!("{rest}[[articulated]]\nname = \"laptop\"\nurdf = \"laptop.urdf\"\n{block}"))
            .expect("room");
        Task::read(&task).map_err(|error| error.to_string())
    }

    #[test]
    fn a_laptop_out_of_a_urdf_is_the_one_of_the_task_file() {
        let task =
            with(LAPTOP, "friction = 0.5\nposition = [0.5, 0.0, 0.009]\njoints = { hinge = -0.3 }\n").expect("a task");
        let shipped = Path::new(env!("CARGO_MANIFEST_DIR")).join("tasks/close_laptop.toml");
        let shipped = Task::read(&shipped).expect("a task");
        assert_eq!(
            task.bodies().iter().map(|body| body.name.as_str()).collect::<Vec<_>>(),
            ["table", "laptop", "laptop_lid"]
        );
        for i in [1, 2] {
            let (found, asked) = (&task.bodies()[i], &shipped.bodies()[i]);
            assert!(
                (found.mass - asked.mass).abs() < 1e-12 && (found.centre_of_mass - asked.centre_of_mass).norm() < 1e-9
            );
            assert!(
                (found.inertia - asked.inertia).norm() < 1e-5 * asked.inertia.norm(),
                "{} {}",
                found.inertia,
                asked.inertia
            );
            assert_eq!(found.pieces[0].hull.corners, asked.pieces[0].hull.corners);
        }
        let (Hold::Joint(found), Hold::Joint(asked)) = (&task.bodies()[2].hold, &shipped.bodies()[2].hold) else {
            panic!("the lid is on no joint")
        };
        let numbers = |joint: &JointPlan| {
            (joint.parent, joint.at, joint.axis, joint.limits, joint.start, joint.friction, joint.damping)
        };
        assert_eq!(numbers(found), numbers(asked));
    }

    #[test]
    fn what_a_urdf_lacks_is_said_in_one_line() {
        let fine = "friction = 0.5\n";
        let without = |what: &str, instead: &str| {
            assert!(LAPTOP.contains(what), "{what}");
            LAPTOP.replace(what, instead)
        };
        for (urdf, block, expected) in [
            (without("type='revolute'", "type='continuous'"), fine, "joint `hinge` has no limits"),
            (without(" upper='1.5708'", " upper='-0.5'"), fine, "joint `hinge` has no limits"),
            (without("<box size='0.006 0.31 0.21'/>", "<sphere radius='1'/>"), fine, "is no box, cylinder or mesh"),
            (without("<mass value='0.5'/>", "<mass value='0'/>"), fine, "link `lid` moves and has no mass"),
            (without("friction='0.7'", "friction='-1'"), fine, "negative or infinite friction"),
            (
                LAPTOP.to_owned(),
                "friction = 0.5\njoints = { hing = 0.1 }\n",
                "no joint is called `hing`; there are: hinge",
            ),
            (LAPTOP.to_owned(), "friction = 0.5\njoints = { hinge = 2.0 }\n", "outside of its limits"),
            (LAPTOP.to_owned(), "friction = 0.5\nhold = \"moved\"\n", "it is \"free\" or \"fixed\""),
        ] {
            let error = with(&urdf, block).err().unwrap_or_else(|| panic!("{expected}"));
            assert!(error.contains(expected) && !error.contains('\n'), "{error}");
        }
    }
}
