//! The robot and what stands around it, ready to be drawn again and again: which model moves with what.

use super::{Drawer, Model, PaintError, Painter, RobotSurface, looks};
use crate::arm::Joints;
use nalgebra::{Isometry3, Vector3};
use splat::{Lens, Picture, SplatCloud, Surroundings};

/// Numbers in the picture: what never moves, the objects, and the robot's links from here on.
const UNMOVED: u32 = 1;
const OBJECT: u32 = 2;
const ROBOT: u32 = 3;

/// A link that was scanned.
#[derive(Debug, Clone)]
pub(crate) struct ScannedLink {
    /// Its number, as [`RobotSurface::links`] counts.
    pub(crate) link: usize,
    /// The scan's frame in the link's.
    pub(crate) link_from_scan: Isometry3<f64>,
    pub(crate) splats: SplatCloud,
}

/// Models, and what each of them moves with.
#[derive(Debug)]
pub(crate) struct Shown {
    painter: Painter,
    places: Vec<Place>,
}

/// What a model moves with.
#[derive(Debug, Clone, Copy)]
enum Place {
    /// Nothing: it stands in the base frame.
    Still,
    /// An object by its number.
    Object(usize),
    /// A part of the robot's surface.
    Part(usize),
    /// A link, and the scan's frame in the link's.
    Link(usize, Isometry3<f64>),
}

impl Shown {
    /// What stands `still` (base frame), the objects, and the robot: from its meshes, or from scans of its links and the
    /// mesh of its tool, which no scan of links shows. `view`: lens, columns and rows of the pictures.
    ///
    /// # Errors
    /// [`PaintError`] when who shall draw cannot.
    pub(crate) fn new(
        robot: &RobotSurface,
        still: Vec<Model>,
        objects: Vec<Model>,
        scans: Vec<ScannedLink>,
        drawer: Drawer,
        (lens, size): (Lens, [usize; 2]),
    ) -> Result<Self, PaintError> {
        let tool = robot.model().dof() + 1;
        let meshes = scans.is_empty();
        let parts =
            robot.parts().iter().zip(robot.links()).enumerate().filter(|(_, (_, link))| meshes || *link == tool);
        let number = |link: usize| ROBOT + link as u32;
        let (places, models) = (still.into_iter().map(|model| (Place::Still, (model, UNMOVED))))
            .chain(objects.into_iter().enumerate().map(|(i, model)| (Place::Object(i), (model, OBJECT))))
            .chain(parts.map(|(part, (mesh, link))| (Place::Part(part), (Model::Mesh(mesh.clone()), number(link)))))
            .chain(scans.into_iter().map(|ScannedLink { link, link_from_scan, splats }| {
                (Place::Link(link, link_from_scan), (Model::Splats(splats), number(link)))
            }))
            .unzip();
        Ok(Self { painter: Painter::new(drawer, models, lens, size)?, places })
    }

    pub(crate) fn painter(&self) -> &Painter {
        &self.painter
    }

    /// The robot that [`Self::new`] was given, at joint positions `q` [rad], and each object where it is, if it is there.
    ///
    /// # Errors
    /// [`PaintError`] when the device that draws fails.
    pub(crate) fn paint(
        &mut self,
        robot: &RobotSurface,
        q: &Joints,
        objects: &[Option<Isometry3<f64>>],
        camera_from_base: &Isometry3<f64>,
    ) -> Result<Picture, PaintError> {
        let mut parts = vec![Isometry3::identity(); robot.parts().len()];
        robot.for_each(q, |part, pose| parts[part] = pose);
        let base_from = |place: &Place| match place {
            Place::Still => Some(Isometry3::identity()),
            Place::Object(number) => objects.get(*number).copied().flatten(),
            Place::Part(part) => Some(parts[*part]),
            Place::Link(link, link_from_scan) => Some(robot.base_from_link(q, *link) * link_from_scan),
        };
        let poses: Vec<_> = self.places.iter().map(|place| Some(camera_from_base * base_from(place)?)).collect();
        let background = looks::BACKGROUND.map(|value| f64::from(value) / 255.0);
        let light = camera_from_base * Vector3::from(looks::LIGHT);
        self.painter.paint(&poses, &Surroundings { background, light })
    }
}
