//! Which pixels the robot covers, from its joint positions: they say nothing about the object behind.

use nalgebra::{Isometry3, Point3};
use shared_mem::cell::Cell;
use shared_mem::msg::Joints;
use twin::arm::ModelError;
use twin::render::{Hand, Mesh, Raster, RobotSurface};
use twin::scene::ArmOutline;

/// A real link is thicker in places than the capsule that stands for it [m]; the tool is one.
const MARGIN: [f64; 2] = [0.01, 0.003];

/// The robot, to be drawn.
#[derive(Debug, Clone)]
pub(super) struct ArmBody {
    /// As exactly as its shape is known.
    surface: RobotSurface,
    outline: ArmOutline,
    meshes: Vec<Mesh>,
}

impl ArmBody {
    /// Of a cell; `None` where it has no robot.
    ///
    /// # Errors
    /// [`ModelError`] when cell.toml describes no usable arm.
    pub(super) fn new(cell: &Cell) -> Result<Option<Self>, ModelError> {
        if cell.robot.is_none() {
            return Ok(None);
        }
        let outline = ArmOutline::new(cell)?;
        let meshes = outline.parts().iter().map(|part| {
            let end = Point3::new(0.0, 0.0, part.length);
            Mesh::capsule(&Point3::origin(), &end, part.radius + MARGIN[usize::from(part.is_tool)], [255; 3])
        });
        let surface = RobotSurface::new(cell, Hand::None)?;
        Ok(Some(Self { surface, meshes: meshes.collect(), outline }))
    }

    /// Draws it at joint positions `q` [rad].
    pub(super) fn draw(&self, raster: &mut Raster, camera_from_base: &Isometry3<f64>, q: &Joints) {
        self.surface.for_each(q, |part, base_from_part| {
            raster.draw(&self.surface.parts()[part], &(camera_from_base * base_from_part).cast::<f32>());
        });
        self.outline.for_each(q, |number, base_from_part| {
            raster.draw(&self.meshes[number], &(camera_from_base * base_from_part).cast::<f32>());
        });
    }
}
