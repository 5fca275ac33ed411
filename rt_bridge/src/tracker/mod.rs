//! The object's pose from pictures: follows a box or mesh of known size through the frames of an RGB-D camera.
//!
//! ```text
//! colour, depth, joint positions -> table's plane -> pose of the last frames, moved on  -> fit -> judged -> pose, covariance
//!                                               \-> or: heaps on the table, robot left out /           \-> or: lost
//! ```
//!
//! | file | owns |
//! |---|---|
//! | `view` | the camera, and one moment of it |
//! | `model` | the object's surface and symmetries |
//! | `table` | the table's plane and the noise of the depth, from the picture |
//! | `arm` | which pixels the robot covers |
//! | `patch` | the part of a picture around the object |
//! | `colors` | what the object looks like beside its surroundings |
//! | `contour` | where the object's outline is |
//! | `align` | the pose that fits best |
//! | `judge` | whether the object is there at all |
//! | `find` | the object in a picture of which nothing is known |
//! | `service` | the thread: pictures in, poses and remarks out |
//!
//! Nothing here but `service` reads or writes anything. Units SI; the camera frame is optical (z forward, y down).
//!
//! What looks the same cannot be distinguished: of all poses that do, the one nearest to the last is reported, and at the
//! beginning the one turned least from the base frame. [`Tracker::equivalent_yaws`] says which others there are.

mod align;
mod arm;
mod colors;
mod contour;
mod find;
mod judge;
mod model;
mod patch;
mod service;
mod table;
mod view;

pub use model::Model;
pub use service::{Service, TrackerChoice, serve};
pub use view::{Frame, View};

use align::{FINE, Fit, Scene};
use arm::ArmBody;
use colors::Colors;
use find::{Occupied, PlaceSearch};
use judge::Verdict;
use nalgebra::{Isometry3, Matrix6, UnitQuaternion, Vector3};
use patch::Patch;
use shared_mem::cell::Cell;
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::Joints;
use table::Table;
use twin::arm::ModelError;
use twin::scene::{MeshFileError, ObjectModel};

/// Frames after which speeds of long ago are forgotten [s].
const LONG_AGO: f64 = 0.2;
/// Other turns to try where a fit is poor [rad].
const OTHER_TURNS: [f64; 4] = [0.35, -0.35, 0.8, -0.8];

/// Follows one object. Of several each has a tracker of its own, which learns its colours.
#[derive(Debug, Clone)]
pub struct Tracker {
    model: Model,
    arm: Option<ArmBody>,
    table_height: f64,
    view: Option<View>,
    table: Option<Table>,
    colors: Colors,
    last: Option<Seen>,
    lost_for: u32,
    /// A search under way.
    hunt: Option<PlaceSearch>,
}

/// The last pose.
#[derive(Debug, Clone, Copy)]
struct Seen {
    base_from_object: Isometry3<f64>,
    velocity: Vector3<f64>,
    angular_velocity: Vector3<f64>,
    at: f64,
}

/// What a frame showed.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "made once a frame and read in place")]
pub enum Sight {
    Tracked(Estimate),
    /// Not the object, and why.
    Lost(Reason),
}

/// Where the object is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Its geometric centre in the base frame.
    pub pose: Pose<Base, Object>,
    /// Of position [m²] and small turn about the base axes [rad²], row-major: x, y, z, rx, ry, rz.
    pub covariance: [f64; 36],
}

/// Why there is no pose.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Reason {
    /// The camera does not say how it projects, or sees the table from below.
    #[error("the camera's pose in cell.toml does not look down at the table; correct [camera] pose")]
    NoView,
    /// Nothing of the object's size and shape stands on the table.
    #[error("nothing of the object's shape is to be seen on the table")]
    NotFound,
    /// It was followed and is no longer there, or something covers it.
    #[error("it was taken away, covered, or moved too fast")]
    Gone,
}

/// The tracker cannot be set up.
#[derive(Debug, thiserror::Error)]
pub enum TrackerError {
    /// The object's mesh.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    #[error(transparent)]
    Arm(#[from] ModelError),
    /// Nothing to track.
    #[error("a tracker needs an object and a table; add [object] and [table] to cell.toml")]
    NoObject,
    /// An object that moves in itself.
    #[error(
        "object `{0}` moves in itself (`urdf` in cell.toml), and --tracker rgbd follows rigid objects; use --tracker sim, or --tracker off with \
         a tracker of your own on /object/poses"
    )]
    Articulated(String),
    #[error(transparent)]
    Transport(#[from] shared_mem::transport::TransportError),
    #[error(transparent)]
    Thread(#[from] crate::starting::ThreadError),
}

impl Tracker {
    /// Of the object of a cell.
    ///
    /// # Errors
    /// [`TrackerError`] when the cell has no object or table, or describes one that cannot be read.
    pub fn new(cell: &Cell) -> Result<Self, TrackerError> {
        let (Some(object), Some(table)) = (ObjectModel::new(cell, None)?, cell.table) else {
            return Err(TrackerError::NoObject);
        };
        Ok(Self {
            model: Model::new(&object.shape),
            arm: ArmBody::new(cell)?,
            table_height: table.height,
            view: None,
            table: None,
            colors: Colors::new(),
            last: None,
            lost_for: 0,
            hunt: None,
        })
    }

    /// Sets how the camera projects and where it stands; to be called again when that changes.
    pub fn set_view(&mut self, view: View) {
        self.table = Table::new(&view, self.table_height);
        self.view = Some(view);
        self.hunt = None;
    }

    /// How the camera projects, once that is known.
    pub fn view(&self) -> Option<&View> {
        self.view.as_ref()
    }

    /// The object, as the tracker knows it.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// Turns about the vertical after which the object, standing as it does in `pose`, looks the same; the first 0 [rad].
    pub fn equivalent_yaws(&self, pose: &Pose<Base, Object>) -> Vec<f64> {
        self.model.equivalent_yaws(&pose.isometry())
    }

    /// How far off the camera measures distances, as a share of them; positive: too long. 0 while no table was seen.
    pub fn too_long(&self) -> f32 {
        self.table.map_or(0.0, |table| table.too_long())
    }

    /// Looks at a frame taken at `at` [s] of the camera's clock, with the joints at `q` [rad] where that is known.
    pub fn look(&mut self, frame: &Frame, at: f64, q: Option<&Joints>) -> Sight {
        self.look_beside(frame, at, q, &[])
    }

    /// The same beside others of its kind: where they follow their objects, this one looks for none.
    pub fn look_beside(&mut self, frame: &Frame, at: f64, q: Option<&Joints>, others: &[&Self]) -> Sight {
        let others: Vec<Occupied> = others.iter().filter_map(|other| other.occupied()).collect();
        let (Some(view), Some(mut table)) = (self.view.take(), self.table.take()) else {
            return Sight::Lost(Reason::NoView);
        };
        table.look(&view, frame);
        let arm = self.arm.take();
        let robot = arm.as_ref().zip(q);
        let followed = self.follow(&view, &table, frame, at, robot);
        let found = followed.or_else(|| self.search(&view, &table, frame, robot, &others));
        let sight = match found {
            Some(fit) => Sight::Tracked(self.accept(&view, &table, frame, at, robot, &fit)),
            None => {
                let reason = if self.last.is_some() { Reason::Gone } else { Reason::NotFound };
                self.lost_for += 1;
                Sight::Lost(reason)
            }
        };
        (self.view, self.table, self.arm) = (Some(view), Some(table), arm);
        sight
    }

    /// From the last pose, moved on.
    fn follow(&self, view: &View, table: &Table, frame: &Frame, at: f64, robot: find::Arm) -> Option<Fit> {
        let last = self.last?;
        let scene = Scene { model: &self.model, table, colors: &self.colors };
        let predicted = last.moved_on(at);
        let camera_from_base = view.base_from_camera.inverse();
        let centre = camera_from_base * nalgebra::Point3::from(predicted.translation.vector);
        let mut patch = Patch::around(view, table, frame, robot, &centre.coords, self.model.radius)?;
        let mut best: Option<(Fit, Verdict)> = None;
        // While the whole picture is searched there is no time to look that closely at one place.
        let turns = if self.hunt.is_none() { &OTHER_TURNS[..] } else { &[] };
        let turned = turns.iter().map(|turn| {
            let turn = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), *turn);
            Isometry3::from_parts(predicted.translation, turn * predicted.rotation)
        });
        for start in [predicted, last.base_from_object].into_iter().chain(turned) {
            let Some(fit) = scene.align(&mut patch, &(camera_from_base * start), FINE) else { continue };
            let verdict = scene.judge(&mut patch, &fit.camera_from_object);
            if best.is_none_or(|(_, other)| verdict.score() > other.score()) {
                best = Some((fit, verdict));
            }
            if verdict.fits() {
                break;
            }
        }
        best.filter(|(_, verdict)| verdict.holds()).map(|(fit, _)| fit)
    }

    /// In the whole picture, one step a frame, without regard to what was learnt: another light, other neighbours may have
    /// made it wrong. What is found decides what holds from then on.
    fn search(
        &mut self,
        view: &View,
        table: &Table,
        frame: &Frame,
        robot: find::Arm,
        others: &[Occupied],
    ) -> Option<Fit> {
        let unknown = Colors::new();
        let scene = Scene { model: &self.model, table, colors: &unknown };
        let Some(mut hunt) = self.hunt.take() else {
            self.hunt = Some(scene.begin_hunt(view, frame, robot, others));
            return None;
        };
        if !hunt.is_over() {
            scene.go_on(&mut hunt, view, frame, robot);
            self.hunt = Some(hunt);
            return None;
        }
        let poses = hunt.found();
        let first = poses.first()?.camera_from_object;
        let mut patch = Patch::around(view, table, frame, robot, &first.translation.vector, self.model.radius)?;
        // It may have moved since the last picture.
        let first = scene.align(&mut patch, &first, FINE)?.camera_from_object;
        let before = std::mem::replace(&mut self.colors, Colors::new());
        self.learn(&mut patch, table, &first);
        let found = Scene { model: &self.model, table, colors: &self.colors }.decide(&mut patch, &poses);
        let found = found.filter(|fit| {
            let centre = (view.base_from_camera * fit.camera_from_object).translation.vector;
            !others.iter().any(|other| other.holds(&centre))
        });
        if found.is_none() {
            self.colors = before;
        }
        found
    }

    /// Where it follows its object; `None` while it does not.
    fn occupied(&self) -> Option<Occupied> {
        let last = self.last.filter(|_| self.lost_for == 0)?;
        Some(Occupied { centre: last.base_from_object.translation.vector, radius: self.model.own_radius })
    }

    /// Takes a fit as the object's pose.
    fn accept(&mut self, view: &View, table: &Table, frame: &Frame, at: f64, robot: find::Arm, fit: &Fit) -> Estimate {
        let centre = fit.camera_from_object.translation.vector;
        if let Some(mut patch) = Patch::around(view, table, frame, robot, &centre, self.model.radius) {
            self.learn(&mut patch, table, &fit.camera_from_object);
        }
        let seen = view.base_from_camera * fit.camera_from_object;
        let reference = self.last.map_or_else(UnitQuaternion::identity, |last| last.moved_on(at).rotation);
        let pose = self.model.nearest(&seen, &reference);
        self.last = Some(Seen::after(self.last.filter(|_| self.lost_for == 0), pose, at));
        (self.lost_for, self.hunt) = (0, None);
        let unseen = self.model.spins_about.map(|axis| pose.rotation * axis);
        Estimate { pose: Pose::from_isometry(pose), covariance: covariance(view, &fit.information, unseen) }
    }

    fn learn(&mut self, patch: &mut Patch, table: &Table, camera_from_object: &Isometry3<f64>) {
        patch.draw(&self.model, camera_from_object);
        // Two pixels on either side of the outline belong to neither.
        let near = patch::widened(patch.drawn(), patch.width, 2);
        let empty: Vec<f32> = patch.drawn().iter().map(|d| f32::from(u8::from(*d == 0.0))).collect();
        let empty_near = patch::widened(&empty, patch.width, 2);
        let pixels = (0..near.len()).filter_map(|i| {
            let drawn = patch.drawn()[i];
            let is_object = drawn > 0.0;
            let clear = if is_object {
                let fits = (patch.seen[i] - drawn).abs() < 3.0 * table.noise + 0.01 * drawn * drawn;
                empty_near[i] == 0.0 && fits
            } else {
                near[i] == 0.0
            };
            (clear && patch.arm[i] == 0.0).then_some((patch.bins[i], is_object))
        });
        self.colors.learn(pixels);
    }
}

impl Seen {
    fn after(before: Option<Self>, base_from_object: Isometry3<f64>, at: f64) -> Self {
        let still = Self { base_from_object, velocity: Vector3::zeros(), angular_velocity: Vector3::zeros(), at };
        let Some(before) = before.filter(|before| (1e-4..LONG_AGO).contains(&(at - before.at))) else { return still };
        let (from, seconds) = (before.base_from_object, at - before.at);
        let shift = base_from_object.translation.vector - from.translation.vector;
        let turn = (base_from_object.rotation * from.rotation.inverse()).scaled_axis();
        Self { velocity: shift / seconds, angular_velocity: turn / seconds, ..still }
    }

    fn moved_on(&self, at: f64) -> Isometry3<f64> {
        let seconds = at - self.at;
        if !(0.0..LONG_AGO).contains(&seconds) {
            return self.base_from_object;
        }
        let place = self.base_from_object.translation.vector + self.velocity * seconds;
        let turn = UnitQuaternion::from_scaled_axis(self.angular_velocity * seconds);
        Isometry3::from_parts(place.into(), turn * self.base_from_object.rotation)
    }
}

/// Covariance about the base axes, from the information about the camera's. The turn about the axis `unseen` (base frame)
/// cannot be known.
fn covariance(view: &View, information: &Matrix6<f64>, unseen: Option<Vector3<f64>>) -> [f64; 36] {
    let turn = view.base_from_camera.rotation.to_rotation_matrix();
    let mut axes = Matrix6::zeros();
    // Of the information the turn comes first, of the covariance the centre.
    axes.fixed_view_mut::<3, 3>(0, 3).copy_from(turn.matrix());
    axes.fixed_view_mut::<3, 3>(3, 0).copy_from(turn.matrix());
    // Never singular: what the picture leaves open is bounded by what is expected beside it.
    let inverse = information.try_inverse().unwrap_or_else(Matrix6::identity);
    let mut covariance = axes * inverse * axes.transpose();
    if let Some(axis) = unseen {
        let [_, turn] = align::EXPECTED;
        let mut block = covariance.fixed_view_mut::<3, 3>(3, 3);
        block += axis * axis.transpose() * (turn * turn);
    }
    std::array::from_fn(|i| covariance[(i / 6, i % 6)])
}
