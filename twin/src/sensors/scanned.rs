//! The robot of a simulated camera as it was scanned: splats of its links, everything else as meshes.

use crate::arm::Joints;
use crate::render::session::{ViewError, base_from_link, link_splats};
use crate::render::splat::{Lens, Picture, Surroundings};
use crate::render::{Drawer, Mesh, Model, PaintError, Painter, RobotSurface};
use nalgebra::Isometry3;
use std::path::Path;

/// What moves with what, beside who draws it.
#[derive(Debug)]
pub(super) struct Scanned {
    painter: Painter,
    places: Vec<Place>,
}

#[derive(Debug, Clone, Copy)]
enum Place {
    Still,
    Object,
    /// A part of the robot's surface that no scan replaces.
    Part(usize),
    Link(usize),
}

impl Scanned {
    /// From a folder of link splats and what else the camera sees.
    pub(super) fn new(
        folder: &Path,
        robot: &RobotSurface,
        still: &[Mesh],
        object: Option<&Mesh>,
        drawer: Drawer,
        (lens, size): (Lens, [usize; 2]),
    ) -> Result<Self, ViewError> {
        let flange = robot.model().dof() + 1;
        let mesh = |place: Place, mesh: &Mesh| (place, Model::Mesh(mesh.clone()));
        let tool = robot.parts().iter().zip(robot.links()).enumerate().filter(|(_, (_, link))| *link == flange);
        let shown: Vec<(Place, Model)> = (still.iter().map(|plate| mesh(Place::Still, plate)))
            .chain(object.map(|object| mesh(Place::Object, object)))
            .chain(tool.map(|(part, (shape, _))| mesh(Place::Part(part), shape)))
            .chain(link_splats(folder)?.into_iter().map(|(link, cloud)| (Place::Link(link), Model::Splats(cloud))))
            .collect();
        let places = shown.iter().map(|(place, _)| *place).collect();
        let models = shown.into_iter().map(|(_, model)| model).zip(1..).collect();
        Ok(Self { painter: Painter::new(drawer, models, lens, size)?, places })
    }

    /// The robot at joint positions `q` [rad], the object where it is, if it is there.
    pub(super) fn paint(
        &mut self,
        robot: &RobotSurface,
        q: &Joints,
        object: Option<Isometry3<f64>>,
        camera_from_base: &Isometry3<f64>,
        around: &Surroundings,
    ) -> Result<Picture, PaintError> {
        let mut parts = vec![Isometry3::identity(); robot.parts().len()];
        robot.for_each(q, |part, pose| parts[part] = pose);
        let pose = |place: &Place| match place {
            Place::Still => Some(Isometry3::identity()),
            Place::Object => object,
            Place::Part(part) => Some(parts[*part]),
            Place::Link(link) => Some(base_from_link(robot.model(), q, *link)),
        };
        let poses: Vec<_> = self.places.iter().map(|place| Some(camera_from_base * pose(place)?)).collect();
        self.painter.paint(&poses, around)
    }
}
