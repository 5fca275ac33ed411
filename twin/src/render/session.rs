//! A recorded session beside its twin: the camera's picture, what the twin shows at the same joints, and where they differ.

use super::looks::CellSplatsError;
use super::{Drawer, Hand, Model, PaintError, Painter, RobotSurface, ScannedLink, Shown, looks, misplaced};
use crate::arm::{Joints, MAX_JOINTS, ModelError};
use crate::scene::MeshFileError;
use nalgebra::Isometry3;
use shared_mem::cell::Cell;
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::image::ImageHeader;
use shared_mem::msg::object::ObjectName;
use shared_mem::recording::Picture;
use splat::{Lens, SplatError, read_links};
use std::path::Path;

/// The cell's twin as a camera sees it.
#[derive(Debug)]
pub struct TwinView {
    size: [usize; 2],
    camera_from_base: Isometry3<f64>,
    robot: RobotSurface,
    shown: Shown,
    /// Of the objects, the one in question first.
    names: Vec<ObjectName>,
    remarks: Vec<String>,
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
    /// A splat file of cell.toml cannot be used.
    #[error(transparent)]
    OfCell(#[from] CellSplatsError),
    /// Who shall draw cannot.
    #[error(transparent)]
    Paint(#[from] PaintError),
    /// The cell says nothing of a camera.
    #[error(
        "cell.toml has no `[camera]`: without intrinsics and pose there is no view; `calibration viewpoint` finds the pose"
    )]
    NoCamera,
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
    /// From a cell, with the splats that it names for its background and its object; `splats`: a folder with a PLY file for each
    /// link, its name with `link0` to `link7` or `hand`. They replace the meshes. Each is in its link's frame, or all are in the base frame of an arm `scanned_at` these joint
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
        let table = cell.table.map(|table| Model::Mesh(looks::table_top(table.height as f32)));
        let bodies = looks::objects(cell)?;
        let (background, objects) = (looks::background(cell)?, looks::models(cell, &bodies)?);
        let names = bodies.iter().map(|body| body.name).collect();
        let scans = splats.map(read_links).transpose()?.unwrap_or_default().into_iter();
        let scans: Vec<_> = scans
            .map(|(link, splats)| {
                let link_from_scan =
                    scanned_at.map_or_else(Isometry3::identity, |q| robot.base_from_link(&joints(q), link).inverse());
                ScannedLink { link, link_from_scan, splats }
            })
            .collect();
        let remarks = misplaced(&robot, &scans, scanned_at.is_some());
        let size = [camera.width as usize, camera.height as usize];
        let shown =
            Shown::new(&robot, background.or(table).into_iter().collect(), objects, scans, drawer, (lens, size))?;
        Ok(Self { size, camera_from_base: base_from_camera.inverse().isometry(), robot, shown, names, remarks })
    }

    /// Columns and rows.
    pub fn size(&self) -> [usize; 2] {
        self.size
    }

    /// What is odd about the splats, one sentence each.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }

    pub fn painter(&self) -> &Painter {
        self.shown.painter()
    }

    /// The twin at these joint positions [rad], the object where it was seen: red, green, blue, row by row.
    ///
    /// # Errors
    /// [`ViewError::Paint`] when the device that draws fails.
    pub fn draw(&mut self, q: &[f64], object: Option<Pose<Base, Object>>) -> Result<Vec<u8>, ViewError> {
        self.draw_all(q, &[object])
    }

    /// The same with each object of [`Self::names`] where it was seen; those that are missing were not.
    ///
    /// # Errors
    /// As [`Self::draw`].
    pub fn draw_all(&mut self, q: &[f64], objects: &[Option<Pose<Base, Object>>]) -> Result<Vec<u8>, ViewError> {
        let objects: Vec<_> = objects.iter().map(|pose| pose.map(|pose| pose.isometry())).collect();
        let seen = self.shown.paint(&self.robot, &joints(q), &objects, &self.camera_from_base)?;
        Ok(seen.rgb8().flatten().collect())
    }

    /// Names of the objects in the order in which they are drawn: the one in question first; empty for one without a name.
    pub fn names(&self) -> &[ObjectName] {
        &self.names
    }
}

fn joints(q: &[f64]) -> Joints {
    let mut joints = [0.0; MAX_JOINTS];
    joints.iter_mut().zip(q).for_each(|(to, from)| *to = *from);
    joints
}

/// Real, twin and their difference side by side: columns, rows and pixels.
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
    use crate::shipped::shipped;

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
    fn background_and_object_are_drawn_of_the_splats_that_the_cell_names() {
        let folder = tempfile::tempdir().expect("a folder");
        let ball = |centre: [f32; 3], sigma, colour: [f32; 3]| {
            let (rotation, sigma) = (nalgebra::UnitQuaternion::identity(), nalgebra::Vector3::repeat(sigma));
            let splats = vec![splat::Splat { centre: centre.into(), rotation, sigma, opacity: 0.99 }];
            splat::SplatCloud { splats, degree: 0, harmonics: vec![colour] }
        };
        let [far, near] = ["far.ply", "near.ply"].map(|name| folder.path().join(name));
        ball([0.5, -0.3, 0.1], 0.05, [-2.0, 2.0, -2.0]).write(&far).expect("room");
        ball([0.0, 0.0, 0.05], 0.03, [-2.0, -2.0, 2.0]).write(&near).expect("room");
        let mut cell = shipped();
        cell.folder = folder.path().to_owned();
        cell.background = Some(shared_mem::cell::Background { splats: "far.ply".into() });
        cell.object_mut().expect("a box").splats = Some("near.ply".into());
        let mut view = TwinView::new(&cell, None, None, Drawer::Processor).expect("a view");
        let q = *view.robot.model().ready();
        let box_at = Pose::from_parts([0.5, 0.2, 0.05], [1.0, 0.0, 0.0, 0.0]).expect("a pose");
        let camera = cell.camera.as_ref().expect("a camera");
        let pinhole = camera.pinhole();
        let mut at = |object: Option<_>, place: [f64; 3]| {
            let picture = view.draw(&q, object).expect("a picture");
            let seen = view.camera_from_base * nalgebra::Point3::from(place);
            let [u, v] = [pinhole.fx * seen.x / seen.z + pinhole.cx, pinhole.fy * seen.y / seen.z + pinhole.cy];
            let start = 3 * (v.round() as usize * camera.width as usize + u.round() as usize);
            [picture[start], picture[start + 1], picture[start + 2]]
        };
        let [red, green, blue] = at(None, [0.5, -0.3, 0.1]);
        assert!(green > 150 && red < 60 && blue < 60, "{red} {green} {blue}");
        // Above the box, so that its mesh would not be seen there.
        let [red, green, blue] = at(Some(box_at), [0.5, 0.2, 0.12]);
        assert!(blue > 100 && red < 80 && green < 100, "{red} {green} {blue}");
        // The table top is not drawn.
        assert_eq!(at(None, [0.5, 0.2, 0.0]), looks::BACKGROUND);
        std::fs::remove_file(&far).expect("a file");
        let error = TwinView::new(&cell, None, None, Drawer::Processor).expect_err("no file").to_string();
        assert!(error.contains("far.ply") && error.ends_with("(`background.splats` in cell.toml)"), "{error}");
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
