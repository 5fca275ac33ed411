//! The Franka FR3: numbers only.
//!
//! Kinematics and limits: the vendor's specification page for system images from 5.9 on. Inertials: `franka_description`
//! 1.0.1, model `fr3` (identified by the vendor). The rotor inertia is what a torque-controlled joint feels; the hardware
//! value is about three times that, and cell.toml may say so.

use super::MassProperties;
use super::chain::{Chain, Joint};
use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

/// Joint frames after Craig: `a`, `d` [m] and `alpha` [rad] between one joint and the next.
const GEOMETRY: [(f64, f64, f64); 7] = [
    (0.0, 0.333, 0.0),
    (0.0, 0.0, -FRAC_PI_2),
    (0.0, 0.316, FRAC_PI_2),
    (0.0825, 0.0, FRAC_PI_2),
    (-0.0825, 0.384, -FRAC_PI_2),
    (0.0, 0.0, FRAC_PI_2),
    (0.088, 0.0, FRAC_PI_2),
];
/// The flange lies this far along the last joint's axis [m].
const FLANGE: f64 = 0.107;

/// Mass [kg], centre of mass in the link frame [m], inertia about it: xx, yy, zz, xy, xz, yz [kg m²].
const BODIES: [(f64, [f64; 3], [f64; 6]); 7] = [
    (
        2.9274653454,
        [4.128e-07, -0.0181251324, -0.038603597],
        [0.0239273, 0.0224821, 0.0063501, 1.33e-05, -0.000114, -0.001995],
    ),
    (
        2.9355370338,
        [0.0031828864, -0.0743221644, 0.0088146084],
        [0.0419389, 0.0251451, 0.0617021, 0.0002026, 0.0040778, -0.0042252],
    ),
    (
        2.2449013699,
        [0.0407015686, -0.0048200565, -0.0289730823],
        [0.0241014, 0.0197405, 0.0190445, 0.0024047, -0.0028563, -0.0021042],
    ),
    (
        2.6155955791,
        [-0.0459100965, 0.063049296, -0.0085187868],
        [0.03453, 0.0288816, 0.0412547, 0.0132255, 0.0101514, -0.0009763],
    ),
    (
        2.3271207594,
        [-0.0016039605, 0.0292536262, -0.097296599],
        [0.0516103, 0.0478773, 0.0164236, -0.0057152, -0.0035673, 0.010674],
    ),
    (
        1.8170376524,
        [0.0597131221, -0.0410294666, -0.0101692726],
        [0.0054123, 0.0140583, 0.0160808, 0.0061935, 0.0014219, -0.0013141],
    ),
    (
        0.6271432862,
        [0.0045225817, 0.0086261921, -0.0161633251],
        [0.00021092389, 0.00017718568, 5.99319e-05, -2.433299e-05, 4.56448e-05, 8.74407e-05],
    ),
];

/// Lowest and highest position [rad], highest speed [rad/s], largest torque [N m], rotor inertia [kg m²].
const LIMITS: [(f64, f64, f64, f64, f64); 7] = [
    (-2.9007, 2.9007, 2.62, 87.0, 0.195),
    (-1.8361, 1.8361, 2.62, 87.0, 0.195),
    (-2.9007, 2.9007, 2.62, 87.0, 0.195),
    (-3.0770, -0.1169, 2.62, 87.0, 0.195),
    (-2.8763, 2.8763, 5.26, 12.0, 0.074),
    (0.4398, 4.6216, 4.18, 12.0, 0.074),
    (-3.0508, 3.0508, 5.26, 12.0, 0.074),
];

/// Deceleration [rad/s²] and speed offset [rad/s] by which the speed limit falls towards a joint's stops.
pub(super) const BRAKING: [[f64; 2]; 7] =
    [[6.0, 0.6599], [2.585, 0.2517], [3.5, 0.2000], [4.0, 0.3533], [17.0, 0.5757], [5.5, 0.4878], [17.0, 0.4628]];

/// The vendor's ready pose [rad].
const READY: [f64; 7] = [0.0, -FRAC_PI_4, 0.0, -3.0 * FRAC_PI_4, 0.0, FRAC_PI_2, FRAC_PI_4];

/// The arm without a hand or tool.
pub(super) fn chain() -> Chain {
    let joints = (0..7)
        .map(|i| {
            let (a, d, alpha) = GEOMETRY[i];
            let roll = UnitQuaternion::from_axis_angle(&Vector3::x_axis(), alpha);
            let (mass, centre, inertia) = BODIES[i];
            let (q_min, q_max, velocity, torque, rotor_inertia) = LIMITS[i];
            Joint {
                name: format!("fr3_joint{}", i + 1),
                link: format!("fr3_link{}", i + 1),
                slides: false,
                origin: Isometry3::from_parts(
                    Translation3::from(Vector3::new(a, 0.0, 0.0) + roll * Vector3::z() * d),
                    roll,
                ),
                axis: Vector3::z_axis(),
                body: MassProperties::new(mass, centre, inertia),
                position: [q_min, q_max],
                velocity,
                torque,
                rotor_inertia,
                ready: READY[i],
            }
        })
        .collect();
    Chain { joints, flange: Isometry3::translation(0.0, 0.0, FLANGE), held: Vec::new(), doubts: Vec::new() }
}
