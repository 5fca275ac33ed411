//! A task's cameras: pictures of an episode, drawn after it was simulated, by the processor.

use super::file::CameraEntry;
use super::{BodyPlan, Task};
use crate::arm::Joints;
use crate::physics::Hull;
use crate::render::{Hand, Mesh, Pinhole, Raster, RobotSurface, looks};
use crate::world::Hold;
use nalgebra::{Isometry3, Matrix3, Point3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use shared_mem::cell::{Cell, Robot};
use shared_mem::recording::RigidPose;

/// Where the task file gives none: what is held fast, and all other bodies in turn.
const FIXED: [u8; 3] = [196, 190, 180];
const COLOURS: [[u8; 3]; 8] = [
    [214, 96, 77],
    [67, 147, 195],
    [90, 174, 97],
    [230, 160, 50],
    [153, 112, 171],
    [80, 80, 90],
    [200, 200, 80],
    [240, 240, 240],
];

/// Share of a picture within which lies what it is widened for.
#[cfg(feature = "teleop")]
const WITHIN: f64 = 0.9;

/// A camera of a task, in the world: z forward, x right, y down; a pinhole with square pixels around the picture's middle.
#[derive(Debug, Clone, PartialEq)]
pub struct TaskCamera {
    pub name: String,
    /// Columns and rows.
    pub size: [u32; 2],
    /// Focal length [pixel].
    pub focal: f64,
    /// Where it stands.
    pub world_from_camera: Isometry3<f64>,
}

impl TaskCamera {
    /// Out of a task file; else the key that is at fault, and what is wrong.
    pub(super) fn of(entry: &CameraEntry) -> Result<Self, (&'static str, String)> {
        let is_plain = |c: char| c.is_ascii_alphanumeric() || c == '_';
        if entry.name.is_empty() || !entry.name.chars().all(is_plain) {
            return Err(("name", format!("`{}` is no name for a camera; use letters, digits and _", entry.name)));
        }
        for (key, pixels) in [("width", entry.width), ("height", entry.height)] {
            if !(16..=2048).contains(&pixels) {
                return Err((key, format!("it is {pixels}; give 16 to 2048 pixels")));
            }
        }
        if !(0.05..=2.8).contains(&entry.field_of_view) {
            return Err(("field_of_view", format!("it is {}; give 0.05 to 2.8 rad", entry.field_of_view)));
        }
        let place = Vector3::from(entry.position);
        let Some(forward) = (Vector3::from(entry.look_at) - place).try_normalize(1e-6) else {
            return Err(("look_at", "it is where the camera stands; give another place".into()));
        };
        // Seen straight from above, the picture's upper edge lies along x.
        let right = forward.cross(&Vector3::z()).try_normalize(1e-6).unwrap_or(-Vector3::y());
        let turn = Rotation3::from_matrix_unchecked(Matrix3::from_columns(&[right, forward.cross(&right), forward]));
        Ok(Self {
            name: entry.name.clone(),
            size: [entry.width, entry.height],
            focal: 0.5 * f64::from(entry.height) / (0.5 * entry.field_of_view).tan(),
            world_from_camera: Isometry3::from_parts(place.into(), UnitQuaternion::from_rotation_matrix(&turn)),
        })
    }

    /// The same view in whole times as many pixels, the fewest that make at least so many columns.
    #[cfg(feature = "teleop")]
    pub(crate) fn finer_to(&self, columns: u32) -> Self {
        let times = columns.div_ceil(self.size[0]);
        Self { size: self.size.map(|pixels| pixels * times), focal: self.focal * f64::from(times), ..self.clone() }
    }

    /// The same view, wide enough that all these points in front of it are in the picture; world frame.
    #[cfg(feature = "teleop")]
    pub(crate) fn seeing(&self, points: impl IntoIterator<Item = Point3<f64>>) -> Self {
        let camera_from_world = self.world_from_camera.inverse();
        let half = self.size.map(|pixels| 0.5 * WITHIN * f64::from(pixels));
        let widest = points.into_iter().map(|point| camera_from_world * point).filter(|p| p.z > 0.0);
        let focal =
            widest.fold(self.focal, |focal, p| focal.min(half[0] * p.z / p.x.abs()).min(half[1] * p.z / p.y.abs()));
        Self { focal, ..self.clone() }
    }
}

/// A picture of a task.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TaskPicture {
    /// Red, green, blue of every pixel, row by row.
    pub colour: Vec<u8>,
    /// Depth along the camera's axis of every pixel [mm], row by row; 0 where there is nothing, or nothing within 65 m.
    pub depth: Vec<u16>,
}

/// A task through one of its cameras.
#[derive(Debug)]
pub struct TaskView {
    camera_from_world: Isometry3<f64>,
    raster: Raster,
    /// A piece, its body, and where it is in it.
    pieces: Vec<(Mesh, usize, Isometry3<f64>)>,
    /// The arm, and where its base is in the world.
    arm: Option<(RobotSurface, Isometry3<f64>)>,
}

impl Task {
    pub fn cameras(&self) -> &[TaskCamera] {
        &self.cameras
    }

    /// All bodies and the arm as a camera of the task sees them.
    pub fn view(&self, camera: &TaskCamera) -> TaskView {
        let [width, height] = camera.size;
        let middle = |pixels: u32| (pixels as f32 - 1.0) / 2.0;
        let focal = camera.focal as f32;
        let pinhole = Pinhole { fx: focal, fy: focal, cx: middle(width), cy: middle(height) };
        let camera_from_world = camera.world_from_camera.inverse();
        let light = (camera_from_world.rotation * Vector3::from(looks::LIGHT)).cast::<f32>();
        let mut pieces = Vec::new();
        for (i, body) in self.bodies.iter().enumerate() {
            let colour = self.colours.get(i).copied().flatten().unwrap_or_else(|| usual(i, body));
            pieces.extend(body.pieces.iter().map(|piece| (mesh(&piece.hull, colour), i, piece.at)));
        }
        let raster = Raster::new(width as usize, height as usize, pinhole, light);
        let arm = self.carrier.as_ref().and_then(|carrier| {
            let surface = RobotSurface::new(&Cell { robot: Some(fr3()), ..Cell::default() }, Hand::None).ok()?;
            Some((surface, carrier.world_from_base()))
        });
        TaskView { camera_from_world, raster, pieces, arm }
    }
}

impl TaskView {
    /// Draws the bodies where they are, in the task's order, and the arm at its joints [rad], where both are there.
    pub fn draw(&mut self, poses: &[RigidPose], joints: Option<&Joints>) -> TaskPicture {
        self.raster.clear(looks::BACKGROUND);
        for (mesh, body, in_body) in &self.pieces {
            if let Some(pose) = poses.get(*body) {
                self.raster.draw(mesh, &(self.camera_from_world * isometry(pose) * in_body).cast());
            }
        }
        if let (Some((surface, world_from_base)), Some(q)) = (&self.arm, joints) {
            let camera_from_base = self.camera_from_world * world_from_base;
            let raster = &mut self.raster;
            surface.for_each(q, |part, base_from_part| {
                raster.draw(&surface.parts()[part], &(camera_from_base * base_from_part).cast());
            });
        }
        let colour = self.raster.color().iter().flat_map(|packed| {
            let [red, green, blue, _] = packed.to_le_bytes();
            [red, green, blue]
        });
        let millimetres = |inverse: &f32| {
            let depth = if *inverse > 0.0 { (1000.0 / inverse).round() } else { 0.0 };
            if depth <= f32::from(u16::MAX) { depth as u16 } else { 0 }
        };
        TaskPicture { colour: colour.collect(), depth: self.raster.inverse_depth().iter().map(millimetres).collect() }
    }
}

/// The robot that carries a body of a task.
fn fr3() -> Robot {
    Robot { model: Some("fr3".into()), ..Robot::default() }
}

/// The colour of a body that the file gives none.
fn usual(place: usize, body: &BodyPlan) -> [u8; 3] {
    if matches!(body.hold, Hold::Fixed(_)) { FIXED } else { COLOURS[place % COLOURS.len()] }
}

fn mesh(hull: &Hull, colour: [u8; 3]) -> Mesh {
    let fan =
        |rim: &[u32]| -> Vec<[u32; 3]> { rim.windows(2).skip(1).map(|pair| [rim[0], pair[0], pair[1]]).collect() };
    Mesh::new((hull.corners.clone(), hull.faces.iter().flat_map(|face| fan(&face.rim)).collect()), colour)
}

pub(super) fn isometry(pose: &RigidPose) -> Isometry3<f64> {
    let [w, i, j, k] = pose.wxyz;
    Isometry3::from_parts(
        Point3::from(pose.position).into(),
        UnitQuaternion::from_quaternion(Quaternion::new(w, i, j, k)),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::task::read::parse;
    use std::path::Path;

    const TASK: &str = r#"horizon = 1.0
[[body]]
name = "table"
hold = "fixed"
friction = 0.5
piece = [{ shape = "box", size = [1.0, 1.0, 0.1], position = [0.0, 0.0, -0.05] }]
[[body]]
name = "box"
mass = 0.2
friction = 0.5
position = [0.1, 0.0, 0.05]
piece = [{ shape = "box", size = [0.1, 0.1, 0.1] }]
[[success]]
body = "box"
low = [0.9, -1.0, 0.0]
high = [1.1, 1.0, 0.1]
[[camera]]
name = "above"
position = [0.0, 0.0, 1.1]
look_at = [0.0, 0.0, 0.0]
width = 401
height = 101
field_of_view = 0.9
"#;

    #[test]
    fn a_camera_above_sees_each_body_at_its_distance_where_it_is() {
        let task = parse(TASK, Path::new("task.toml")).expect("a task");
        let poses: Vec<RigidPose> = [[0.0, 0.0, 0.0], [0.1, 0.0, 0.05]]
            .map(|position| RigidPose { position, wxyz: [1.0, 0.0, 0.0, 0.0] })
            .into();
        let camera = &task.cameras()[0];
        let picture = task.view(camera).draw(&poses, None);
        let at = |x: f64, y: f64, z: f64| {
            let seen = camera.world_from_camera.inverse() * Point3::new(x, y, z);
            let pixel =
                |along: f64, pixels: u32| (along / seen.z * camera.focal + (f64::from(pixels) - 1.0) / 2.0).round();
            (pixel(seen.y, camera.size[1]) * 401.0 + pixel(seen.x, camera.size[0])) as usize
        };
        let colour = |place: usize| &picture.colour[3 * place..3 * place + 3];
        assert_eq!(picture.depth[at(-0.2, 0.1, 0.0)], 1100);
        assert_eq!(picture.depth[at(0.1, 0.0, 0.1)], 1000);
        assert_ne!(colour(at(0.1, 0.0, 0.1)), colour(at(-0.2, 0.1, 0.0)));
        // Up in the picture is along x, right is against y.
        assert!(at(0.1, 0.0, 0.0) < at(0.0, 0.0, 0.0) && at(0.0, -0.1, 0.0) > at(0.0, 0.0, 0.0));
        // Beyond the table there is nothing.
        assert_eq!((picture.depth[50 * 401], colour(50 * 401)), (0, &looks::BACKGROUND[..]));
    }
    #[test]
    fn a_body_has_the_colour_that_its_file_gives_it() {
        let text = TASK.replace("name = \"box\"", "name = \"box\"\ncolour = [255, 0, 0]");
        let task = parse(&text, Path::new("task.toml")).expect("a task");
        let poses: Vec<RigidPose> = [[0.0, 0.0, 0.0], [0.0, 0.0, 0.05]]
            .map(|position| RigidPose { position, wxyz: [1.0, 0.0, 0.0, 0.0] })
            .into();
        let picture = task.view(&task.cameras()[0]).draw(&poses, None);
        let middle = 3 * (50 * 401 + 200);
        assert!(picture.colour[middle] > 0 && picture.colour[middle + 1..middle + 3] == [0, 0]);
        for bad in ["[256, 0, 0]", "[1, 2]", "\"red\""] {
            assert!(parse(&text.replace("[255, 0, 0]", bad), Path::new("task.toml")).is_err(), "{bad}");
        }
    }

    #[cfg(feature = "teleop")]
    #[test]
    fn a_view_that_is_widened_has_every_point_in_it_and_one_that_is_finer_the_same() {
        let task = parse(TASK, Path::new("task.toml")).expect("a task");
        let camera = &task.cameras()[0];
        let finer = camera.finer_to(640);
        assert_eq!((finer.size, finer.focal), ([802, 202], 2.0 * camera.focal));
        let inside = [Point3::new(0.05, 0.1, 0.0)];
        assert_eq!(camera.seeing(inside), *camera);
        let far = Point3::new(0.9, -0.1, 0.3);
        let wide = camera.seeing([inside[0], far]);
        let seen = wide.world_from_camera.inverse() * far;
        let [x, y] = [seen.x, seen.y].map(|along| (along / seen.z * wide.focal).abs());
        assert!(x <= 200.5 + 1e-9 && y <= 50.5 + 1e-9 && wide.focal < camera.focal);
    }

    #[test]
    fn the_arm_is_seen_where_its_joints_have_it() {
        let (head, camera) = TASK.split_once("[[camera]]").expect("a camera");
        let moved = "[[body]]\nname = \"tool\"\nhold = \"moved\"\nfriction = 0.5\nposition = [-0.1, 0.2, 0.3]\n\
            piece = [{ shape = \"box\", size = [0.02, 0.02, 0.02] }]\n\
            [arm]\nbody = \"tool\"\nbase = [-0.5, 0.0, 0.0]\nrotation = [3.141592654, 0.0, 0.0]\n[[camera]]";
        let text = format!("{head}{moved}{}", camera.replace("1.1]", "2.2]"));
        let task = parse(&text, Path::new("task.toml")).expect("a task");
        let place = |position| RigidPose { position, wxyz: [1.0, 0.0, 0.0, 0.0] };
        let poses = [place([0.0; 3]), place([0.1, 0.0, 0.05]), place([5.0, 0.0, 0.0])];
        let carrier = task.carrier.as_ref().expect("an arm");
        let at = Isometry3::from_parts(Vector3::new(-0.1, 0.2, 0.3).into(), nalgebra::one());
        let q = carrier.joints_at(&at).expect("within reach");
        let mut view = task.view(&task.cameras()[0]);
        let [without, with] = [None, Some(&q)].map(|q| view.draw(&poses, q).depth);
        let nearer: Vec<u16> =
            without.iter().zip(&with).filter(|(a, b)| **b > 0 && (**a == 0 || b < a)).map(|(_, b)| *b).collect();
        // Seen from 2.2 m above: the arm's upper side lies between its elbow and its flange.
        assert!(nearer.len() > 200, "{} pixels", nearer.len());
        let highest = nearer.iter().min().expect("some");
        assert!((1100..1800).contains(highest), "{highest} mm below the camera");
        // Where there is no arm all is as it was.
        let changed = without.iter().zip(&with).filter(|(a, b)| a != b).count();
        assert_eq!(changed, nearer.len());
    }
}
