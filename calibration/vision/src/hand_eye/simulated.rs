//! Pictures of a board by an arm that is known to the last digit, for tests and for measuring how often intervals hold the truth.

use super::chain::{Chain, link};
use super::view::View;
use crate::viewpoint::lens::Lens;
use crate::viewpoint::planar::Seen;
use nalgebra::{Isometry3, Point3, Translation3, UnitQuaternion, Vector3, Vector6};
use rand::{Rng, RngExt as _};
use rand_distr::StandardNormal;
use shared_mem::hand_eye::Mount;

/// How pictures are drawn.
#[derive(Debug, Clone, Copy)]
pub struct World {
    /// Who holds the camera.
    pub mount: Mount,
    pub views: usize,
    /// One sigma of a corner along a row [pixel].
    pub pixel: f64,
    /// One sigma of the arm's error along each axis [rad, m].
    pub arm: [f64; 2],
    /// How far the camera is turned about its axes x, y, z [rad]: uniform between minus and plus that.
    pub turns: [f64; 3],
}

/// A camera of 1280 x 720 pixels.
const LENS: Lens = Lens { focal: [634.0, 633.0], centre: [642.0, 359.0] };

/// A pose off by an error along each axis.
fn noisy(pose: &Isometry3<f64>, [turn, shift]: [f64; 2], random: &mut impl Rng) -> Isometry3<f64> {
    let mut normal = |sigma: f64| Vector3::from_fn(|_, _| sigma * random.sample::<f64, _>(StandardNormal));
    pose * Isometry3::from_parts(normal(shift).into(), UnitQuaternion::from_scaled_axis(normal(turn)))
}

impl World {
    /// The truth and the pictures of it.
    pub fn draw(&self, random: &mut impl Rng) -> (Chain, Vec<View>) {
        let mut around = |mean: Vector6<f64>, size: [f64; 2]| {
            let by = Vector6::from_fn(|k, _| size[usize::from(k > 2)] * random.random_range(-1.0..1.0));
            let six = mean + by;
            Isometry3::new(six.fixed_rows::<3>(3).into_owned(), six.fixed_rows::<3>(0).into_owned())
        };
        let (camera, board) = match self.mount {
            Mount::EyeInHand => {
                let camera = around(Vector6::new(0.0, 0.0, 1.57, 0.05, 0.0, 0.04), [0.2, 0.03]);
                (camera, around(Vector6::new(0.0, 0.0, 0.0, 0.5, 0.0, 0.0), [0.3, 0.1]))
            }
            Mount::FixedCamera => {
                let camera = around(Vector6::new(-1.9, 0.0, 0.0, 0.5, -1.0, 0.6), [0.2, 0.1]);
                (camera, around(Vector6::new(0.0, 0.0, 0.0, -0.06, -0.08, 0.05), [0.2, 0.03]))
            }
        };
        let truth = Chain { mount: self.mount, camera, board };
        let views = (0..self.views).map(|number| self.view(&truth, number, random)).collect();
        (truth, views)
    }

    fn view(&self, truth: &Chain, number: usize, random: &mut impl Rng) -> View {
        // The camera looks at the board's middle from above it, turned and at a distance of its own.
        let middle = Translation3::new(0.085, 0.119, 0.0);
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from_fn(|k, _| {
            if self.turns[k] > 0.0 { random.random_range(-self.turns[k]..self.turns[k]) } else { 0.0 }
        }));
        let place = Vector3::new(
            random.random_range(-0.06..0.06),
            random.random_range(-0.04..0.04),
            random.random_range(0.3..0.55),
        );
        let camera_from_board = Translation3::from(place) * turn * middle.inverse();
        let link_true = truth.camera * camera_from_board * truth.board.inverse();
        let base_from_end_effector = match self.mount {
            Mount::EyeInHand => link_true.inverse(),
            Mount::FixedCamera => link_true,
        };
        let corners = (0..24).map(|k| [0.034 * f64::from(k % 4 + 1), 0.034 * f64::from(k / 4 + 1)]);
        let seen = corners.map(|place| {
            let [u, v] = LENS.project(&(camera_from_board * Point3::new(place[0], place[1], 0.0)));
            let mut noise = || self.pixel * random.sample::<f64, _>(StandardNormal);
            Seen { place, pixel: [u + noise(), v + noise()] }
        });
        let seen = seen.collect();
        let base_from_end_effector = noisy(&base_from_end_effector, self.arm, random);
        debug_assert!(link(self.mount, &base_from_end_effector).translation.vector.norm() < 10.0);
        View { name: format!("{number:03}.png"), base_from_end_effector, seen, lens: LENS }
    }
}

/// The six numbers by which a mount is off the truth, as intervals count them: turn [rad], shift [m].
pub fn off(found: &Isometry3<f64>, truth: &Isometry3<f64>) -> [f64; 6] {
    let turn = (found.rotation * truth.rotation.inverse()).scaled_axis();
    let shift = found.translation.vector - truth.translation.vector;
    [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]
}
