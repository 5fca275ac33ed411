//! What a model looks like: the arm's visible parts as files of meshes, each on the link that carries it, and a pose to show it in.

use anyhow::Context as _;
use nalgebra::Isometry3;
use shared_mem::cell::Cell;
use shared_mem::output::Destination;
use std::path::{Path, PathBuf};
use twin::arm::MAX_JOINTS;
use twin::render::{Hand, Mesh, RobotSurface};

/// The arm's visible parts.
#[derive(Debug, Clone)]
pub struct Look {
    folder: PathBuf,
    parts: Vec<VisiblePart>,
    /// Positions of the joints in which the arm is shown [rad or m].
    pub(super) ready: Vec<f64>,
}

/// A part of one colour.
#[derive(Debug, Clone)]
pub(super) struct VisiblePart {
    pub(super) name: String,
    /// As a model file names it.
    pub(super) file: String,
    /// 0 the base, 1 behind the first joint, one more than there are joints the tool.
    pub(super) link: usize,
    pub(super) in_link: Isometry3<f64>,
    mesh: Mesh,
}

impl VisiblePart {
    /// Red, green, blue and opacity, 0 to 1.
    pub(super) fn rgba(&self) -> [f64; 4] {
        let [r, g, b] = self.mesh.color.map(|value| f64::from(value) / 255.0);
        [r, g, b, 1.0]
    }
}

impl Look {
    /// The arm of a cell, its meshes to lie in `folder`, which a model `beside` which it is names as seen from there. The shapes are
    /// the maker's where there are some, else capsules along the links.
    ///
    /// # Errors
    /// An arm of which only the joints' names are known, or none.
    pub fn of(cell: &Cell, folder: &Path, beside: &Path) -> anyhow::Result<Self> {
        let surface = RobotSurface::new(cell, Hand::None).context("cell.toml describes no arm to be seen")?;
        let model = surface.model();
        anyhow::ensure!(
            model.has_geometry(),
            "of this arm only the joints' names are known, and nothing to be seen; leave --meshes out"
        );
        let (zero, dof) = ([0.0; MAX_JOINTS], model.dof());
        let (frames, flange) = (model.link_frames(&zero), model.flange(&zero).isometry());
        let links = surface.links();
        let (beside, named) = (std::path::absolute(beside)?, std::path::absolute(folder)?);
        let named = beside.parent().and_then(|folder| named.strip_prefix(folder).ok()).unwrap_or(&named);
        let mut parts = Vec::new();
        surface.for_each(&zero, |number, base_from_part| {
            let base_from_link = match links[number] {
                0 => Isometry3::identity(),
                link if link > dof => flange,
                link => frames[link - 1],
            };
            let name = format!("part_{number:02}");
            parts.push(VisiblePart {
                file: named.join(format!("{name}.stl")).to_string_lossy().into_owned(),
                name,
                link: links[number],
                in_link: base_from_link.inverse() * base_from_part,
                mesh: surface.parts()[number].clone(),
            });
        });
        Ok(Self { folder: folder.to_owned(), parts, ready: model.ready()[..dof].to_vec() })
    }

    pub(super) fn all(&self) -> impl Iterator<Item = &VisiblePart> {
        self.parts.iter()
    }

    pub(super) fn on(&self, link: usize) -> impl Iterator<Item = &VisiblePart> {
        self.parts.iter().filter(move |part| part.link == link)
    }

    /// Writes the meshes; those that are there already only with `force`.
    ///
    /// # Errors
    /// A folder or file that cannot be written, or a file that would be lost: nothing is written then.
    pub fn write(&self, force: bool) -> anyhow::Result<()> {
        let place =
            |part: &VisiblePart| Destination::in_new_folder(&self.folder.join(format!("{}.stl", part.name)), force);
        let places = self.parts.iter().map(place).collect::<Result<Vec<_>, _>>()?;
        for (place, part) in places.iter().zip(&self.parts) {
            place.write(stl(&part.mesh))?;
        }
        Ok(())
    }
}

/// A binary STL [m]: 80 bytes of anything, the number of triangles, then of each its normal (which readers compute), three corners
/// and two bytes of 0.
fn stl(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = vec![0; 80];
    bytes.extend((mesh.triangles.len() as u32).to_le_bytes());
    for triangle in &mesh.triangles {
        bytes.extend([0; 12]);
        let corners = triangle.iter().flat_map(|corner| mesh.points[*corner as usize].iter().copied());
        bytes.extend(corners.flat_map(f32::to_le_bytes));
        bytes.extend([0; 2]);
    }
    bytes
}

#[cfg(test)]
mod tests {
    use super::super::{Format, write};
    use super::*;
    use shared_mem::theta::Theta;

    #[test]
    fn parts_are_where_the_robot_has_them_in_any_pose() {
        let cell = Cell::read(Path::new("fr3")).expect("the cell that is built in");
        let look = Look::of(&cell, Path::new("meshes"), Path::new("cell.xml")).expect("a shape");
        let surface = RobotSurface::new(&cell, Hand::None).expect("a robot");
        let (model, mut q) = (surface.model(), *surface.model().ready());
        q.iter_mut().zip([0.3, -0.2, 0.5, 0.1, -0.4, 0.2, 0.6]).for_each(|(q, more)| *q += more);
        let (frames, flange) = (model.link_frames(&q), model.flange(&q).isometry());
        surface.for_each(&q, |number, base_from_part| {
            let part = &look.parts[number];
            let base_from_link = match part.link {
                0 => Isometry3::identity(),
                8 => flange,
                link => frames[link - 1],
            };
            let apart = (base_from_link * part.in_link).inverse() * base_from_part;
            assert!(apart.translation.vector.norm() < 1e-12 && apart.rotation.angle() < 1e-7, "{}", part.name);
        });
    }

    #[test]
    fn a_model_names_the_meshes_that_are_written_and_can_be_held_at_home() {
        let folder = tempfile::tempdir().expect("a folder");
        let cell = Cell::read(Path::new("fr3")).expect("the cell that is built in");
        let (meshes, out) = (folder.path().join("meshes"), folder.path().join("cell.xml"));
        let look = Look::of(&cell, &meshes, &out).expect("a shape");
        look.write(false).expect("room");
        assert!(look.write(false).is_err(), "what is there stays");
        look.write(true).expect("room");
        for (format, key) in [(Format::Mjcf, "file=\""), (Format::Urdf, "filename=\"")] {
            let text = write(&cell, &Theta::default(), format, Some(look.clone())).expect("a model").text;
            let files: Vec<&str> = text.split(key).skip(1).filter_map(|rest| rest.split('"').next()).collect();
            assert!(files.len() > 8, "{files:?}");
            for file in files {
                let bytes = std::fs::read(folder.path().join(file)).expect(file);
                let triangles = u32::from_le_bytes(bytes[80..84].try_into().expect("four bytes"));
                assert!(triangles > 0 && bytes.len() == 84 + 50 * triangles as usize, "{file}");
            }
        }
        let text = write(&cell, &Theta::default(), Format::Mjcf, Some(look)).expect("a model").text;
        let numbers = |key: &str| {
            let home = text.split("name=\"home\"").nth(1).and_then(|rest| rest.split(key).nth(1));
            home.and_then(|rest| rest.split('"').next()).map_or(0, |list| list.split(' ').count())
        };
        let actuators = ["<position ", "<velocity ", "<general "].map(|kind| text.matches(kind).count());
        assert_eq!((numbers("qpos=\""), numbers("ctrl=\"")), (14, actuators.iter().sum()), "{text}");
    }
}
