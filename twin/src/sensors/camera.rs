//! A simulated D455: colour and depth of one moment, depth aligned to colour, from the scene's geometry. Table, boxes or
//! meshes, the robot's surface, tool as the capsule it is. The picture has no lens distortion.
//!
//! Called by the camera thread of the bridge: allocates nothing after its first picture, unless the robot is drawn from
//! splats.

use super::camera_clock_ns;
use super::depth::{self, DepthSensor};
use crate::effects::CameraEffects;
use crate::render::looks::DrawnBody;
use crate::render::session::ViewError;
use crate::render::{Drawer, Hand, Mesh, Model, Pinhole, Raster, RobotSurface, ScannedLink, Shown, looks, misplaced};
use crate::scene::SceneSnapshot;
use crate::sim::SimError;
use crate::sim::generator;
use nalgebra::{Isometry3, Vector3};
use shared_mem::cell::{Camera, CameraPose, Cell};
use shared_mem::lens::Distortion;
use shared_mem::msg::image::{CameraInfo, ImageHeader, PixelEncoding, StampDomain};
use splat::{Lens, Picture, read_links};
use std::path::Path;

pub struct SimCamera {
    /// With the pose that it is said to have, of a camera that the arm holds in its last picture.
    settings: Camera,
    camera_from_base: Isometry3<f32>,
    misplaced: Isometry3<f32>,
    /// Where the arm holds it.
    flange_from_camera: Option<Isometry3<f64>>,
    raster: Raster,
    depth: DepthSensor,
    still: Vec<Mesh>,
    robot: Option<RobotSurface>,
    objects: Vec<DrawnBody>,
    /// The same with the robot of splats, and what is odd about them.
    scanned: Option<Shown>,
    remarks: Vec<String>,
    /// How much older a picture is than its stamp says.
    older_ns: u64,
    sequence: u64,
    next_picture_ns: u64,
}

/// The floor below the table top [m], and half its edge.
const FLOOR_BELOW: f32 = 0.75;
const FLOOR_HALF: f32 = 5.0;

const FLOOR: [u8; 3] = [128, 130, 134];

impl SimCamera {
    /// The camera of a cell, a D455 where `[camera]` is absent. Where no object has `pose_noise` depth is exact.
    ///
    /// # Errors
    /// [`SimError`] when the arm or the object's mesh cannot be read.
    pub fn new(cell: &Cell) -> Result<Self, SimError> {
        let settings = cell.camera.clone().unwrap_or_default();
        let pinhole = settings.pinhole();
        let [fx, fy, cx, cy] = [pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy].map(|v| v as f32);
        let base_from_camera = settings.base_from_camera().map_or_else(Isometry3::identity, |pose| pose.isometry());
        let camera_from_base: Isometry3<f32> = base_from_camera.inverse().cast();
        let light = camera_from_base * Vector3::from(looks::LIGHT).cast::<f32>();
        let pinhole = Pinhole { fx, fy, cx, cy };
        let raster = Raster::new(settings.width as usize, settings.height as usize, pinhole, light);
        let height = cell.table.map_or(0.0, |t| t.height as f32);
        let still =
            vec![Mesh::plate([0.0, 0.0, height - FLOOR_BELOW], [FLOOR_HALF; 2], FLOOR), looks::table_top(height)];
        Ok(Self {
            camera_from_base,
            misplaced: Isometry3::identity(),
            flange_from_camera: None,
            raster,
            depth: DepthSensor::new(settings.width, settings.height, is_noisy(cell), generator(cell, 2)),
            still,
            robot: cell.robot.as_ref().map(|_| RobotSurface::new(cell, Hand::None)).transpose()?,
            objects: looks::objects(cell)?,
            scanned: None,
            remarks: Vec::new(),
            older_ns: 0,
            sequence: 0,
            next_picture_ns: 0,
            settings,
        })
    }

    /// The same camera held by the arm; `flange_from_camera`: its optical frame in the flange's. A camera whose cell has no robot
    /// stays where it is.
    pub fn held(self, flange_from_camera: Isometry3<f64>) -> Self {
        Self { flange_from_camera: Some(flange_from_camera), ..self }
    }

    /// The same camera under hidden effects: it stands elsewhere than [`Self::info`] says, and its pictures
    /// are older than their stamps. What is a tracker's own ([`CameraEffects::of_the_tracker`]) is in no picture.
    pub fn with_effects(self, effects: &CameraEffects) -> Self {
        let misplaced = effects.misplaced().cast::<f32>();
        let camera_from_base = self.camera_from_base * misplaced;
        Self { camera_from_base, misplaced, older_ns: effects.latency_ns(), ..self }
    }

    /// The same camera before a robot of splats: a folder with a file for each link, in the links' frames; background and object
    /// are of splats, too, where `cell` names some. A picture then takes as long as whoever draws it needs.
    ///
    /// # Errors
    /// [`ViewError`] when the splats cannot be used, or who shall draw cannot.
    pub fn with_splats(mut self, cell: &Cell, folder: &Path, drawer: Drawer) -> Result<Self, ViewError> {
        let pinhole = self.settings.pinhole();
        let lens =
            Lens { focal: [pinhole.fx, pinhole.fy], centre: [pinhole.cx, pinhole.cy], distortion: Distortion::NONE };
        let view = (lens, [self.settings.width as usize, self.settings.height as usize]);
        if let Some(robot) = &self.robot {
            let scans = read_links(folder)?.into_iter();
            let scans = scans.map(|(link, splats)| ScannedLink { link, link_from_scan: Isometry3::identity(), splats });
            let scans: Vec<_> = scans.collect();
            self.remarks = misplaced(robot, &scans, false);
            let (background, objects) = (looks::background(cell)?, looks::models(cell, &self.objects)?);
            let meshes = || self.still.iter().cloned().map(Model::Mesh).collect();
            let still = background.map_or_else(meshes, |splats| vec![splats]);
            self.scanned = Some(Shown::new(robot, still, objects, scans, drawer, view)?);
        }
        Ok(self)
    }

    /// Starts the noise and the count of pictures anew: the same scenes give the same pictures again. `cell`: that of [`Self::new`].
    pub fn restart(&mut self, cell: &Cell) {
        let Camera { width, height, .. } = self.settings;
        self.depth = DepthSensor::new(width, height, is_noisy(cell), generator(cell, 2));
        (self.sequence, self.next_picture_ns) = (0, 0);
    }

    /// Columns and rows of its pictures.
    pub fn size(&self) -> [usize; 2] {
        [self.settings.width, self.settings.height].map(|pixels| pixels as usize)
    }

    /// What is odd about the splats, one sentence each.
    pub fn remarks(&self) -> &[String] {
        &self.remarks
    }

    /// Bytes of a colour picture.
    pub fn color_bytes(&self) -> usize {
        self.raster.color().len() * 3
    }

    /// Bytes of a depth picture.
    pub fn depth_bytes(&self) -> usize {
        self.raster.color().len() * 2
    }

    /// Whether the camera takes a picture at this moment of the simulated clock; asked every control period.
    pub fn is_due(&mut self, time_ns: u64) -> bool {
        let period_ns = (1e9 / self.settings.rate) as u64;
        let due = time_ns >= self.next_picture_ns;
        if due {
            self.next_picture_ns = (time_ns / period_ns + 1) * period_ns;
        }
        due
    }

    /// Takes a picture: RGB8 into `color`, little-endian millimetres into `depth` (0: nothing measured), row by row
    /// without padding, [`Self::color_bytes`] and [`Self::depth_bytes`] long. Answers with the headers of both, whose
    /// `stamp_ns` the host sets.
    pub fn render(&mut self, scene: &SceneSnapshot, color: &mut [u8], depth: &mut [u8]) -> [ImageHeader; 2] {
        let width = self.settings.width as usize;
        self.stand(scene);
        if let Some(picture) = self.paint(scene) {
            for (rgb, seen) in color.chunks_exact_mut(3).zip(picture.rgb8()) {
                rgb.copy_from_slice(&seen);
            }
            // Half seen through is not measured.
            let solid =
                picture.depth.iter().zip(&picture.cover).map(|(d, cover)| if *cover < 0.5 { 0.0 } else { 1.0 / d });
            let inverse: Vec<f32> = solid.collect();
            for (row, inverse_depth) in depth.chunks_exact_mut(2 * width).zip(inverse.chunks_exact(width)) {
                self.depth.row(inverse_depth, row);
            }
        } else {
            self.draw(scene);
            for (rgb, packed) in color.chunks_exact_mut(3).zip(self.raster.color()) {
                rgb.copy_from_slice(&packed.to_le_bytes()[..3]);
            }
            let inverse = self.raster.inverse_depth().chunks_exact(width);
            for (row, inverse_depth) in depth.chunks_exact_mut(2 * width).zip(inverse) {
                self.depth.row(inverse_depth, row);
            }
        }
        self.sequence += 1;
        [(PixelEncoding::Rgb8, 3, 0.0), (PixelEncoding::Depth16, 2, depth::SCALE)].map(
            |(encoding, bytes, depth_scale)| ImageHeader {
                stamp_ns: 0,
                device_ns: camera_clock_ns(scene.time_ns + self.older_ns),
                sequence: self.sequence - 1,
                exposure_ns: 0,
                width: self.settings.width,
                height: self.settings.height,
                stride: self.settings.width * bytes,
                encoding,
                depth_scale,
                stamp_domain: StampDomain::HardwareClock,
                reserved: 0,
            },
        )
    }

    /// How this camera projects and where it stands, or stood in its last picture where the arm holds it. `stamp_ns` is the host's to set.
    pub fn info(&self) -> CameraInfo {
        let pinhole = self.settings.pinhole();
        CameraInfo {
            stamp_ns: 0,
            width: self.settings.width,
            height: self.settings.height,
            intrinsics: [pinhole.fx, pinhole.fy, pinhole.cx, pinhole.cy],
            distortion: [0.0; 5],
            position: self.settings.pose.position,
            wxyz: self.settings.pose.orientation,
        }
    }

    /// Goes where the arm holds it.
    fn stand(&mut self, scene: &SceneSnapshot) {
        let (Some(flange_from_camera), Some(robot)) = (self.flange_from_camera, &self.robot) else { return };
        let base_from_camera = robot.model().flange(&scene.q).isometry() * flange_from_camera;
        let rotation = base_from_camera.rotation;
        let orientation = [rotation.w, rotation.i, rotation.j, rotation.k];
        self.settings.pose = CameraPose { position: base_from_camera.translation.vector.into(), orientation };
        self.camera_from_base = base_from_camera.inverse().cast::<f32>() * self.misplaced;
        self.raster.light_from(self.camera_from_base * Vector3::from(looks::LIGHT).cast::<f32>());
    }

    /// The picture with the scanned robot; `None` where there is none, and from then on where its device has failed.
    fn paint(&mut self, scene: &SceneSnapshot) -> Option<Picture> {
        let (scanned, robot) = (self.scanned.as_mut()?, self.robot.as_ref()?);
        let camera_from_base: Isometry3<f64> = self.camera_from_base.cast();
        let objects: Vec<_> = places(&self.objects, scene).map(|(_, pose)| pose).collect();
        match scanned.paint(robot, &scene.q, &objects, &camera_from_base) {
            Ok(picture) => Some(picture),
            Err(error) => {
                tracing::warn!("the simulated camera draws the robot's meshes from here on: {error}");
                self.scanned = None;
                None
            }
        }
    }

    fn draw(&mut self, scene: &SceneSnapshot) {
        self.raster.clear(looks::BACKGROUND);
        for mesh in &self.still {
            self.raster.draw(mesh, &self.camera_from_base);
        }
        if let Some(robot) = &self.robot {
            robot.for_each(&scene.q, |part, base_from_part| {
                self.raster.draw(&robot.parts()[part], &(self.camera_from_base * base_from_part.cast::<f32>()));
            });
        }
        for (body, pose) in places(&self.objects, scene) {
            if let Some(pose) = pose {
                self.raster.draw(&body.mesh, &(self.camera_from_base * pose.cast::<f32>()));
            }
        }
    }
}

/// Whether depth is measured with noise.
fn is_noisy(cell: &Cell) -> bool {
    cell.objects.is_empty() || cell.objects.iter().any(|object| object.pose_noise.is_some())
}

/// Where the bodies are: the first is the scene's object, whatever its name.
fn places<'a>(
    bodies: &'a [DrawnBody],
    scene: &'a SceneSnapshot,
) -> impl Iterator<Item = (&'a DrawnBody, Option<Isometry3<f64>>)> {
    bodies.iter().enumerate().map(|(number, body)| {
        let pose = if number == 0 { scene.object } else { scene.named.of(&body.name) };
        (body, pose.map(|pose| pose.isometry()))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reconstruct::SurfacePoints;
    use crate::shipped::shipped;
    use crate::sim::SimCell;
    use splat::{Splat, SplatCloud, link_file};
    use std::path::Path;

    fn picture(cell: &Cell, scene: &SceneSnapshot) -> (SimCamera, Vec<u8>, Vec<u16>, [ImageHeader; 2]) {
        let mut camera = SimCamera::new(cell).expect("a camera");
        let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
        let headers = camera.render(scene, &mut color, &mut depth);
        let depth = depth.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
        (camera, color, depth, headers)
    }

    #[test]
    fn the_depth_of_the_box_s_top_is_what_geometry_says() {
        let mut cell = shipped();
        cell.object_mut().expect("a box").pose_noise = None;
        // Straight above the box, looking down, 1.1 m over the table: x of the picture along the base's x.
        let [x, y] = cell.simulation.object_position;
        cell.camera.as_mut().expect("a camera").pose =
            CameraPose { position: [x, y, 1.1], orientation: [0.0, 1.0, 0.0, 0.0] };
        let scene = SimCell::new(&cell, None).expect("a cell").snapshot();
        let (camera, _, depth, [_, header]) = picture(&cell, &scene);
        let pinhole = camera.settings.pinhole();
        let at = |u: f64, v: f64| depth[v.round() as usize * 640 + u.round() as usize];
        // The top is 1.0 m away and 80 mm by 60 mm wide.
        for (dx, dy) in [(0.0, 0.0), (0.037, 0.0), (-0.037, 0.027), (0.0, -0.027)] {
            let seen = at(pinhole.cx + pinhole.fx * dx, pinhole.cy - pinhole.fy * dy);
            assert!(seen.abs_diff(1000) <= 1, "{seen} mm at {dx} {dy}");
        }
        let beside = at(pinhole.cx + pinhole.fx * 0.05, pinhole.cy);
        assert!(beside.abs_diff(1100) <= 1, "the table beside it: {beside} mm");
        assert_eq!((header.width, header.stride, header.depth_scale), (640, 1280, 0.001));
    }

    #[test]
    fn a_camera_that_the_arm_holds_sees_what_one_that_stands_there_would() {
        let mut cell = shipped();
        cell.object_mut().expect("a box").pose_noise = None;
        let scene = SimCell::new(&cell, None).expect("a cell").snapshot();
        let mount =
            Isometry3::translation(0.06, 0.0, 0.03) * nalgebra::UnitQuaternion::from_euler_angles(0.0, 0.1, 1.5);
        let mut held = SimCamera::new(&cell).expect("a camera").held(mount);
        let (mut color, mut depth) = (vec![0; held.color_bytes()], vec![0; held.depth_bytes()]);
        held.render(&scene, &mut color, &mut depth);
        let info = held.info();
        let flange = held.robot.as_ref().expect("a robot").model().flange(&scene.q).isometry();
        assert!((nalgebra::Vector3::from(info.position) - (flange * mount).translation.vector).norm() < 1e-12);
        cell.camera.as_mut().expect("a camera").pose = CameraPose { position: info.position, orientation: info.wxyz };
        let (standing, expected, ..) = picture(&cell, &scene);
        assert_eq!(standing.info(), info);
        let other = color.iter().zip(&expected).filter(|(a, b)| a.abs_diff(**b) > 2).count();
        assert!(other * 1000 < color.len(), "{other} of {} values", color.len());
        assert!(color.chunks_exact(3).any(|rgb| rgb != &color[..3]), "something is seen");
    }

    #[test]
    fn a_robot_of_splats_stands_where_the_meshes_stood() {
        let mut cell = shipped();
        cell.object_mut().expect("a box").pose_noise = None;
        let folder = tempfile::tempdir().expect("a folder");
        let bare = Cell { tool: None, ..cell.clone() };
        let robot = RobotSurface::new(&bare, Hand::None).expect("a robot");
        // A white ball of 5 mm on every point of the links' surfaces, in the links' frames.
        let zero = [0.0; crate::arm::MAX_JOINTS];
        let surface = SurfacePoints::new(&robot, &zero, |_| true);
        for link in 0..8 {
            let link_from_base = robot.base_from_link(&zero, link).inverse();
            let own = surface.points.iter().zip(&surface.links).filter(|(_, of)| **of == link);
            let ball = |(at, _): (&nalgebra::Point3<f64>, _)| Splat {
                centre: (link_from_base * at).cast(),
                rotation: nalgebra::UnitQuaternion::identity(),
                sigma: Vector3::repeat(0.005),
                opacity: 0.95,
            };
            let splats: Vec<Splat> = own.map(ball).collect();
            let harmonics = vec![[1.6; 3]; splats.len()];
            let file = folder.path().join(link_file(link));
            SplatCloud { splats, degree: 0, harmonics }.write(&file).expect("written");
        }
        let scene = SimCell::new(&cell, None).expect("a cell").snapshot();
        let (_, meshes, deep, _) = picture(&cell, &scene);
        let camera = SimCamera::new(&cell).expect("a camera");
        let mut camera = camera.with_splats(&cell, folder.path(), Drawer::Processor).expect("splats");
        let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
        camera.render(&scene, &mut color, &mut depth);
        let depth: Vec<u16> = depth.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
        let white = |rgb: &[u8]| rgb.iter().all(|c| *c > 200);
        let arm: Vec<usize> = (0..depth.len()).filter(|i| white(&meshes[3 * i..3 * i + 3])).collect();
        let same = arm.iter().filter(|i| white(&color[3 * **i..3 * **i + 3])).count();
        let near = arm.iter().filter(|i| depth[**i].abs_diff(deep[**i]) < 30).count();
        assert!(same * 100 > 95 * arm.len() && near * 100 > 90 * arm.len(), "{same} and {near} of {}", arm.len());
        let beside = (0..depth.len()).filter(|i| depth[*i].abs_diff(deep[*i]) > 30).count();
        assert!(beside * 20 < depth.len(), "{beside} pixels elsewhere");
        assert!(
            SimCamera::new(&cell).expect("a camera").with_splats(&cell, Path::new("nowhere"), Drawer::Auto).is_err()
        );
    }

    #[test]
    fn the_box_and_the_arm_are_in_the_picture() {
        let cell = shipped();
        let scene = SimCell::new(&cell, None).expect("a cell").snapshot();
        let (_, color, _, _) = picture(&cell, &scene);
        let orange = color.chunks_exact(3).filter(|p| p[0] > 2 * p[2] && p[0] > 80 && p[0] > p[1] + 40).count();
        let white = color.chunks_exact(3).filter(|p| p.iter().all(|c| *c > 200)).count();
        assert!((400..8000).contains(&orange), "{orange} pixels of the box");
        assert!(white > 1500, "{white} pixels of the arm");
    }

    #[test]
    fn an_unknown_latency_and_a_wrong_place_are_in_the_picture_and_not_in_what_the_camera_says() {
        let mut cell = shipped();
        cell.object_mut().expect("a box").pose_noise = None;
        let blocks = "[[effect]]\nname = \"camera_latency\"\nlatency = 0.04\n\
                      [[effect]]\nname = \"camera_extrinsic_translation\"\ntranslation = [0.02, -0.01, 0.0]\n";
        let theta: shared_mem::theta::Theta =
            shared_mem::toml_file::parse(blocks, Path::new("theta.toml")).expect("a theta.toml");
        let effects = crate::effects::Effects::from_theta(&theta.effects, 7).expect("known effects").camera;
        let scene = SimCell::new(&cell, None).expect("a cell").snapshot();
        let mut camera = SimCamera::new(&cell).expect("a camera").with_effects(&effects);
        let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
        let headers = camera.render(&scene, &mut color, &mut depth);
        assert_eq!(headers.map(|header| header.device_ns), [camera_clock_ns(scene.time_ns + 40_000_000); 2]);
        // To the nominal camera the box seems to be where it is not. Its pixels are those that change when it goes away.
        let moved = nalgebra::Translation3::new(0.02, -0.01, 0.0) * scene.object.expect("a box").isometry();
        let (mut elsewhere, mut gone) = (scene, scene);
        elsewhere.object = Some(shared_mem::frames::Pose::from_isometry(moved));
        gone.object = None;
        let (nominal, expected, ..) = picture(&cell, &elsewhere);
        assert_eq!(camera.info(), nominal.info());
        let (_, without, ..) = picture(&cell, &gone);
        let mut empty = vec![0; camera.color_bytes()];
        camera.render(&gone, &mut empty, &mut depth);
        let changed = |a: &[u8], b: &[u8]| -> Vec<bool> {
            a.chunks_exact(3).zip(b.chunks_exact(3)).map(|(a, b)| a != b).collect()
        };
        let (shown, expected) = (changed(&color, &empty), changed(&expected, &without));
        let both = shown.iter().zip(&expected).filter(|(a, b)| **a && **b).count();
        let either = shown.iter().zip(&expected).filter(|(a, b)| **a || **b).count();
        assert!(either > 400 && both as f64 > 0.97 * either as f64, "{both} of {either} pixels of the box");
    }

    #[test]
    fn colour_and_depth_share_number_and_stamp_and_the_clock_is_the_cameras_own() {
        let cell = shipped();
        let scene = SceneSnapshot { time_ns: 5_000_000, dof: 7, ..SceneSnapshot::default() };
        let (mut camera, _, _, [color, depth]) = picture(&cell, &scene);
        assert_eq!((color.sequence, color.device_ns), (depth.sequence, depth.device_ns));
        assert_eq!(color.device_ns, camera_clock_ns(5_000_000));
        assert_eq!(color.stamp_domain, StampDomain::HardwareClock);
        let due = (0..1000).filter(|t| camera.is_due(t * 1_000_000)).count();
        assert_eq!(due, 30);
    }
}
