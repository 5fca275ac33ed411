//! A recorded session beside its twin: the camera's picture, what the twin shows at the same joints, and where they differ.

use super::robot::{Hand, RobotSurface};
use super::splat::{Lens, SplatCloud, SplatError, Surroundings};
use super::{Drawer, Mesh, Model, PaintError, Painter};
use crate::arm::{ArmModel, Joints, MAX_JOINTS, ModelError};
use crate::scene::{MeshFileError, ObjectModel};
use nalgebra::{Isometry3, UnitQuaternion, Vector3};
use shared_mem::cell::Cell;
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::image::ImageHeader;
use shared_mem::recording::Picture;
use std::path::Path;

/// Instances: the table, the object, and the robot's links from here on.
const TABLE: u32 = 1;
const OBJECT: u32 = 2;
const ROBOT: u32 = 3;
/// What lies behind everything, and the table top around the robot's front [m].
const BACKGROUND: [f64; 3] = [0.66, 0.73, 0.8];
/// Towards the light, base frame.
const LIGHT: [f64; 3] = [0.55, 0.25, 0.8];
const TABLE_COLOR: [u8; 3] = [196, 172, 140];
const TABLE_HALF: [f32; 2] = [0.7, 0.8];
const OBJECT_COLOR: [u8; 3] = [222, 112, 40];

/// The cell's twin as a camera sees it.
#[derive(Debug)]
pub struct TwinView {
    size: [usize; 2],
    camera_from_base: Isometry3<f64>,
    robot: RobotSurface,
    painter: Painter,
    /// What each of the painter's models moves with.
    places: Vec<Place>,
}

/// What a model moves with.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Place {
    Base,
    Object,
    /// A part of the robot's surface.
    Part(usize),
    /// A link that was scanned, and the scan's frame in the link's.
    Link(usize, Isometry3<f64>),
}

/// The twin cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum ViewError {
    /// The arm is not known.
    #[error(transparent)]
    Arm(#[from] ModelError),
    /// The object's mesh cannot be used.
    #[error(transparent)]
    Object(#[from] MeshFileError),
    /// A splat file cannot be used.
    #[error(transparent)]
    Splats(#[from] SplatError),
    /// Who shall draw cannot.
    #[error(transparent)]
    Paint(#[from] PaintError),
    /// The cell says nothing of a camera.
    #[error(
        "cell.toml has no `[camera]`: without intrinsics and pose there is no view; `calibration viewpoint` finds the pose"
    )]
    NoCamera,
    /// A folder of splats without any.
    #[error("{0} holds no splats of links: name them like `link3.ply`")]
    NoSplats(String),
    /// Pictures of another size than the camera's intrinsics are for.
    #[error(
        "the pictures have {} x {} pixels, the `[camera]` of cell.toml {} x {}: give it the intrinsics of this resolution",
        of_pictures[0], of_pictures[1], of_camera[0], of_camera[1]
    )]
    Size {
        /// Columns and rows of the pictures.
        of_pictures: [usize; 2],
        /// Those of the cell's camera.
        of_camera: [usize; 2],
    },
}

impl TwinView {
    /// From a cell; `splats`: a folder with a PLY file for each link, its name with `link0` to `link7` or `hand`. They
    /// replace the meshes. Each is in its link's frame, or all are in the base frame of an arm `scanned_at` these joint
    /// positions [rad].
    ///
    /// # Errors
    /// [`ViewError`].
    pub fn new(
        cell: &Cell,
        splats: Option<&Path>,
        scanned_at: Option<&[f64]>,
        drawer: Drawer,
    ) -> Result<Self, ViewError> {
        let camera = cell.camera.as_ref().ok_or(ViewError::NoCamera)?;
        let base_from_camera = camera.base_from_camera().ok_or(ViewError::NoCamera)?;
        let pinhole = camera.pinhole();
        let lens =
            Lens { focal: [pinhole.fx, pinhole.fy], centre: [pinhole.cx, pinhole.cy], distortion: camera.distortion };
        let robot = RobotSurface::new(cell, Hand::None)?;
        let clouds = splats.map(link_splats).transpose()?.unwrap_or_default();
        let mut shown: Vec<(Place, Model, u32)> = Vec::new();
        if let Some(height) = cell.table.map(|table| table.height as f32) {
            let table = Mesh::plate([0.3, 0.0, height], TABLE_HALF, TABLE_COLOR);
            shown.push((Place::Base, Model::Mesh(table), TABLE));
        }
        if let Some(model) = ObjectModel::new(cell, None)? {
            let mesh = Mesh::new(model.shape.triangles(), OBJECT_COLOR);
            shown.push((Place::Object, Model::Mesh(mesh), OBJECT));
        }
        let flange = robot.model().dof() + 1;
        for (part, (mesh, link)) in robot.parts().iter().zip(robot.links()).enumerate() {
            // The tool is no link that was scanned.
            if clouds.is_empty() || link == flange {
                shown.push((Place::Part(part), Model::Mesh(mesh.clone()), ROBOT + link as u32));
            }
        }
        for (link, cloud) in clouds {
            let link_from_scan = match scanned_at {
                Some(q) => base_from_link(robot.model(), &joints(q), link).inverse(),
                None => Isometry3::identity(),
            };
            shown.push((Place::Link(link, link_from_scan), Model::Splats(cloud), ROBOT + link as u32));
        }
        let places = shown.iter().map(|(place, ..)| *place).collect();
        let models = shown.into_iter().map(|(_, model, number)| (model, number)).collect();
        let size = [camera.width as usize, camera.height as usize];
        Ok(Self {
            size,
            camera_from_base: base_from_camera.inverse().isometry(),
            robot,
            painter: Painter::new(drawer, models, lens, size)?,
            places,
        })
    }

    /// Columns and rows.
    #[must_use]
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// Who draws.
    #[must_use]
    pub fn painter(&self) -> &Painter {
        &self.painter
    }

    /// The twin at these joint positions [rad], the object where it was seen: red, green, blue, row by row.
    ///
    /// # Errors
    /// [`ViewError::Paint`] when the device that draws fails.
    pub fn draw(&mut self, q: &[f64], object: Option<Pose<Base, Object>>) -> Result<Vec<u8>, ViewError> {
        let q = joints(q);
        let mut parts = vec![Isometry3::identity(); self.robot.parts().len()];
        self.robot.for_each(&q, |part, pose| parts[part] = pose);
        let base_from = |place: &Place| match place {
            Place::Base => Some(Isometry3::identity()),
            Place::Object => object.map(|pose| pose.isometry()),
            Place::Part(part) => Some(parts[*part]),
            Place::Link(link, link_from_scan) => Some(base_from_link(self.robot.model(), &q, *link) * link_from_scan),
        };
        let poses: Vec<Option<Isometry3<f64>>> =
            self.places.iter().map(|place| Some(self.camera_from_base * base_from(place)?)).collect();
        let around = Surroundings { background: BACKGROUND, light: self.camera_from_base * Vector3::from(LIGHT) };
        let seen = self.painter.paint(&poses, &around)?;
        Ok(seen.color.iter().flatten().map(|value| (value.clamp(0.0, 1.0) * 255.0).round() as u8).collect())
    }
}

/// Frame of a link in the base, 0 the base itself; behind the last joint the Franka Hand's, an eighth of a turn from the
/// flange's.
#[must_use]
pub fn base_from_link(model: &ArmModel, q: &Joints, link: usize) -> Isometry3<f64> {
    let hand = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -std::f64::consts::FRAC_PI_4);
    match link {
        0 => Isometry3::identity(),
        link if link > model.dof() => model.flange(q).isometry() * hand,
        link => model.link_frames(q)[link - 1],
    }
}

fn joints(q: &[f64]) -> Joints {
    let mut joints = [0.0; MAX_JOINTS];
    joints.iter_mut().zip(q).for_each(|(to, from)| *to = *from);
    joints
}

/// The splats of every link that the folder has, and of the hand, which moves with the flange.
pub(crate) fn link_splats(folder: &Path) -> Result<Vec<(usize, SplatCloud)>, ViewError> {
    let read = |source| SplatError::Read { path: folder.to_owned(), source };
    let mut files: Vec<_> = std::fs::read_dir(folder).map_err(read)?.filter_map(|e| Some(e.ok()?.path())).collect();
    files.sort();
    let mut out = Vec::new();
    for path in files.iter().filter(|path| path.extension().is_some_and(|e| e == "ply")) {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("");
        let link = (0..8).find(|link| name.contains(&format!("link{link}"))).or(name.contains("hand").then_some(8));
        if let Some(link) = link {
            out.push((link, SplatCloud::read(path)?));
        }
    }
    if out.is_empty() { Err(ViewError::NoSplats(folder.display().to_string())) } else { Ok(out) }
}

/// Real, twin and their difference side by side: columns, rows and pixels.
#[must_use]
pub fn beside(size: [usize; 2], real: &[u8], twin: &[u8]) -> (u32, u32, Vec<u8>) {
    let row = size[0] * 3;
    let mut out = Vec::with_capacity(3 * row * size[1]);
    for (real, twin) in real.chunks_exact(row).zip(twin.chunks_exact(row)) {
        out.extend_from_slice(real);
        out.extend_from_slice(twin);
        out.extend(difference(real, twin));
    }
    (3 * size[0] as u32, size[1] as u32, out)
}

/// Columns, rows and pixels without what fills up rows.
pub(super) fn tight_pixels(header: &ImageHeader, pixels: &[u8]) -> ([usize; 2], Vec<u8>) {
    let row = header.width as usize * 3;
    let rows = pixels.chunks(header.stride.max(1) as usize).take(header.height as usize);
    let out: Vec<u8> = rows.flat_map(|bytes| bytes.iter().take(row).copied()).collect();
    ([header.width as usize, header.height as usize], out)
}

/// How far two pictures are apart, value by value.
pub(super) fn difference(real: &[u8], twin: &[u8]) -> Vec<u8> {
    real.iter().zip(twin).map(|(a, b)| a.abs_diff(*b)).collect()
}

/// The pixels of a recorded colour picture, without padding: red, green, blue.
///
/// # Errors
/// A sentence when it is compressed in a way that is not known.
pub fn pixels_of(picture: &Picture) -> Result<([usize; 2], Vec<u8>), String> {
    match picture {
        Picture::Pixels { header, pixels } => Ok(tight_pixels(header, pixels)),
        Picture::Compressed { stamp_ns, bytes, .. } => match shared_mem::recording::unpack_picture(bytes, *stamp_ns)? {
            Picture::Pixels { header, pixels } => Ok(tight_pixels(&header, &pixels)),
            Picture::Compressed { format, .. } => Err(format!("a picture is compressed as {format}")),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::SceneSnapshot;
    use crate::sensors::camera::SimCamera;

    fn shipped() -> Cell {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../config/fr3_cell.toml");
        Cell::read(&path).expect("the shipped cell")
    }

    #[test]
    fn the_twin_of_the_simulated_camera_s_picture_is_that_picture_where_the_robot_is() {
        let cell = shipped();
        let mut view = TwinView::new(&cell, None, None, Drawer::Processor).expect("a view");
        let mut camera = SimCamera::new(&cell).expect("a camera");
        let q = *view.robot.model().ready();
        let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
        camera.render(&SceneSnapshot { q, dof: 7, ..SceneSnapshot::default() }, &mut color, &mut depth);
        let twin = view.draw(&q, None).expect("a picture");
        let white = |rgb: &[u8]| rgb.iter().all(|c| *c > 200);
        let pairs = || color.chunks_exact(3).zip(twin.chunks_exact(3));
        let both = pairs().filter(|(a, b)| white(a) && white(b)).count();
        let either = pairs().filter(|(a, b)| white(a) || white(b)).count();
        assert!(both > 2000 && both * 1000 > either * 995, "{both} of {either} pixels of the white arm");
        let (width, height, sheet) = beside(view.size(), &color, &twin);
        assert_eq!((width, height, sheet.len()), (1920, 480, 3 * color.len()));
    }

    #[test]
    fn a_cell_without_a_camera_and_a_folder_without_splats_are_refused() {
        let (cell, folder) = (shipped(), tempfile::tempdir().expect("a folder"));
        let error = TwinView::new(&Cell { camera: None, ..cell.clone() }, None, None, Drawer::Processor)
            .expect_err("no camera");
        assert!(error.to_string().contains("[camera]"));
        let error = TwinView::new(&cell, Some(folder.path()), None, Drawer::Processor).expect_err("no splats");
        assert!(error.to_string().contains("no splats of links"));
    }
}
