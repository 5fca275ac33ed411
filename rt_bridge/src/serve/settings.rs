//! What the client has set: impedance, thresholds, load, frames. Each setter is checked as the robot does it
//! (status 2, invalid argument); when it may be called at all is [`super::robot`]'s business.
#![allow(non_snake_case)] // the field's own symbols

use super::wire::{Load, Thresholds};
use nalgebra::{Isometry3, Matrix3, Matrix4, Rotation3, Translation3, UnitQuaternion, Vector3};
use shared_mem::cell::{GRAVITY, Tool};
use twin::arm::MassProperties;

/// Largest joint stiffness the robot takes [N m/rad].
const JOINT_STIFFNESS: f64 = 14_250.0;
/// Cartesian stiffness the robot takes, along and about the axes [N/m, N m/rad].
const CARTESIAN_STIFFNESS: [[f64; 2]; 2] = [[10.0, 3000.0], [1.0, 300.0]];
/// How far from 1 the length of a rotation matrix's column may be.
const UNIT: f64 = 1e-5;
/// Heaviest load that can be set [kg]: the FR3's payload, from its data sheet.
const HEAVIEST: f64 = 3.0;
/// Largest moment of its weight about the flange's origin [N m]: what the three joints of the wrist can hold, from the data
/// sheet.
const WRIST: f64 = 12.0;
/// Farthest from the flange that a load or a frame may be [m], and the largest radius of gyration: more than the arm's own
/// reach of 0.855 m.
const FARTHEST: f64 = 1.0;
/// What rounding may take from an inertia, as a share of its largest moment.
const ROUNDING: f64 = 1e-6;
/// Highest threshold of contact and collision [N m; N, N m]. No joint and no pose of the arm comes near it, so it never
/// speaks; a higher one is a slip.
const DEAF: f64 = 1e4;

/// Collision thresholds before anybody sets others [N m; N, N m]: what libfranka's examples set first. The robot's own
/// values at power-on are not published.
const ACCELERATING: f64 = 20.0;
const NOMINAL: f64 = 10.0;

/// Cartesian stiffness before anybody sets another [N/m, N m/rad]: libfranka's examples.
const CARTESIAN: [f64; 6] = [3000.0, 3000.0, 3000.0, 300.0, 300.0, 300.0];

/// An argument that no robot takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Invalid;

/// Everything that setters change.
#[derive(Debug, Clone)]
pub(super) struct Settings {
    /// Stiffness of the joint impedance that the client asked for [N m/rad]; none: the cell's own.
    pub(super) joint_stiffness: Option<[f64; 7]>,
    /// Stiffness of the Cartesian impedance in the stiffness frame [N/m, N m/rad].
    pub(super) cartesian_stiffness: [f64; 6],
    /// While something is commanded to accelerate.
    pub(super) accelerating: Thresholds,
    pub(super) nominal: Thresholds,
    /// What is mounted, as the laboratory has set it on the robot's web page.
    pub(super) end_effector: MassProperties,
    /// What the client says is carried beside.
    pub(super) load: MassProperties,
    /// From the flange to the end effector's nominal frame: the flange itself.
    pub(super) F_T_NE: Isometry3<f64>,
    /// From there to the frame that the client commands.
    pub(super) NE_T_EE: Isometry3<f64>,
    /// From there to the stiffness frame.
    pub(super) EE_T_K: Isometry3<f64>,
}

impl Settings {
    /// As after power-on, with the cell's tool declared as end effector.
    pub(super) fn at_power_on(tool: Option<&Tool>) -> Self {
        Self {
            joint_stiffness: None,
            cartesian_stiffness: CARTESIAN,
            accelerating: Thresholds::everywhere(ACCELERATING),
            nominal: Thresholds::everywhere(NOMINAL),
            end_effector: tool.map(MassProperties::of_tool).unwrap_or_default(),
            load: MassProperties::default(),
            F_T_NE: Isometry3::identity(),
            NE_T_EE: Isometry3::identity(),
            EE_T_K: Isometry3::identity(),
        }
    }

    /// From the flange to the frame that the client commands.
    pub(super) fn F_T_EE(&self) -> Isometry3<f64> {
        self.F_T_NE * self.NE_T_EE
    }

    /// From the flange to the stiffness frame.
    pub(super) fn F_T_K(&self) -> Isometry3<f64> {
        self.F_T_EE() * self.EE_T_K
    }

    pub(super) fn set_joint_stiffness(&mut self, stiffness: [f64; 7]) -> Result<(), Invalid> {
        let fits = stiffness.iter().all(|k| (0.0..=JOINT_STIFFNESS).contains(k));
        fits.then(|| self.joint_stiffness = Some(stiffness)).ok_or(Invalid)
    }

    pub(super) fn set_cartesian_stiffness(&mut self, stiffness: [f64; 6]) -> Result<(), Invalid> {
        let within = |(i, k): (usize, &f64)| {
            let [least, most] = CARTESIAN_STIFFNESS[i / 3];
            (least..=most).contains(k)
        };
        let fits = stiffness.iter().enumerate().all(within);
        fits.then(|| self.cartesian_stiffness = stiffness).ok_or(Invalid)
    }

    /// Thresholds of accelerating, then all others.
    pub(super) fn set_thresholds(&mut self, thresholds: &[Thresholds; 2]) -> Result<(), Invalid> {
        let fits = thresholds.iter().all(Thresholds::are_ordered);
        fits.then(|| [self.accelerating, self.nominal] = *thresholds).ok_or(Invalid)
    }

    pub(super) fn set_load(&mut self, load: &Load) -> Result<(), Invalid> {
        let (centre, inertia) = (Vector3::from(load.centre), Matrix3::from_column_slice(&load.inertia));
        let mass = (0.0..=HEAVIEST).contains(&load.mass);
        let near = centre.norm() <= FARTHEST && load.mass * GRAVITY * centre.norm() <= WRIST;
        if !(mass && near && is_possible(load.mass, &inertia)) {
            return Err(Invalid);
        }
        self.load = MassProperties { mass: load.mass, centre, inertia };
        Ok(())
    }

    pub(super) fn set_NE_T_EE(&mut self, matrix: &[f64; 16]) -> Result<(), Invalid> {
        self.NE_T_EE = isometry(matrix).ok_or(Invalid)?;
        Ok(())
    }

    pub(super) fn set_EE_T_K(&mut self, matrix: &[f64; 16]) -> Result<(), Invalid> {
        self.EE_T_K = isometry(matrix).ok_or(Invalid)?;
        Ok(())
    }
}

impl Thresholds {
    /// The same for contact and collision, in every joint and direction [N m; N, N m].
    fn everywhere(at: f64) -> Self {
        Self { contact_torque: [at; 7], collision_torque: [at; 7], contact_force: [at; 6], collision_force: [at; 6] }
    }

    /// A contact is to be noticed no later than a collision, and both above nothing.
    fn are_ordered(&self) -> bool {
        let ordered = |contact: &[f64], collision: &[f64]| {
            contact.iter().zip(collision).all(|(low, high)| 0.0 <= *low && low <= high && *high <= DEAF)
        };
        ordered(&self.contact_torque, &self.collision_torque) && ordered(&self.contact_force, &self.collision_force)
    }
}

/// Whether a body of `mass` can have `inertia` about its centre of mass: symmetric, no principal moment below zero or above
/// the sum of the other two, none larger than that of the mass at the farthest place.
fn is_possible(mass: f64, inertia: &Matrix3<f64>) -> bool {
    if !inertia.iter().all(|x| x.is_finite()) {
        return false;
    }
    let slack = ROUNDING * inertia.abs().max() + 1e-9;
    let moments = inertia.symmetric_eigenvalues();
    let (largest, sum) = (moments.max(), moments.sum());
    (inertia - inertia.transpose()).abs().max() <= slack
        && moments.min() >= -slack
        && largest <= sum - largest + slack
        && largest <= mass * FARTHEST * FARTHEST + slack
}

/// The rigid transform of a homogeneous matrix, column-major; `None` where it is none: last row 0, 0, 0, 1 exactly, axes
/// of unit length and orthogonal to 1e-5, right-handed, no farther than any end effector.
pub(super) fn isometry(matrix: &[f64; 16]) -> Option<Isometry3<f64>> {
    let m = Matrix4::from_column_slice(matrix);
    let rotation: Matrix3<f64> = m.fixed_view::<3, 3>(0, 0).into_owned();
    let place: Vector3<f64> = m.fixed_view::<3, 1>(0, 3).into_owned();
    let last_row = [matrix[3], matrix[7], matrix[11], matrix[15]] == [0.0, 0.0, 0.0, 1.0];
    let rigid = (rotation.transpose() * rotation - Matrix3::identity()).abs().max() < UNIT;
    let sane = last_row && rigid && rotation.determinant() > 0.0 && place.norm() <= FARTHEST;
    sane.then(|| {
        // Rounded to single precision on the way, the matrix is a rotation only nearly.
        let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(rotation));
        Isometry3::from_parts(Translation3::from(place), rotation)
    })
}

/// The homogeneous matrix of a rigid transform, column-major.
pub(super) fn matrix(isometry: &Isometry3<f64>) -> [f64; 16] {
    let mut out = [0.0; 16];
    out.copy_from_slice(isometry.to_homogeneous().as_slice());
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_is_a_frame_only_if_it_is_rigid() {
        let turned = Isometry3::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(0.4, 0.5, -0.6));
        let good = matrix(&turned);
        let back = isometry(&good).expect("a rigid transform");
        assert!((back.to_homogeneous() - turned.to_homogeneous()).norm() < 1e-12);
        for (place, value) in [(0, good[0] + 1e-3), (3, 1e-9), (15, 1.0 + 1e-9), (12, f64::NAN), (5, f64::INFINITY)] {
            let mut bad = good;
            bad[place] = value;
            assert_eq!(isometry(&bad), None, "entry {place} = {value}");
        }
        let mut mirrored = matrix(&Isometry3::identity());
        mirrored[0] = -1.0;
        assert_eq!(isometry(&mirrored), None);
    }

    #[test]
    fn arguments_that_no_robot_takes_change_nothing() {
        let mut settings = Settings::at_power_on(None);
        assert!(settings.set_joint_stiffness([14_251.0; 7]).is_err());
        assert!(settings.set_joint_stiffness([f64::NAN; 7]).is_err() && settings.joint_stiffness.is_none());
        assert!(settings.set_cartesian_stiffness([3000.0, 3000.0, 9.0, 300.0, 300.0, 300.0]).is_err());
        assert!(settings.set_cartesian_stiffness([3000.0, 3000.0, 3000.0, 300.0, 301.0, 300.0]).is_err());
        assert_eq!(settings.cartesian_stiffness, CARTESIAN);
        let upside_down = Thresholds { contact_torque: [30.0; 7], ..Thresholds::everywhere(20.0) };
        assert!(settings.set_thresholds(&[upside_down, Thresholds::everywhere(10.0)]).is_err());
        assert!(
            settings.set_thresholds(&[Thresholds::everywhere(f64::INFINITY), Thresholds::everywhere(10.0)]).is_err()
        );
        let mut far = matrix(&Isometry3::identity());
        far[12] = 900.0;
        assert!(settings.set_NE_T_EE(&far).is_err() && settings.set_EE_T_K(&far).is_err());
    }

    #[test]
    fn a_load_is_a_body_that_exists_and_that_the_arm_can_hold() {
        let diagonal = |[x, y, z]: [f64; 3]| [x, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, z];
        let load = |mass, x, moments| Load { mass, centre: [x, 0.0, 0.0], inertia: diagonal(moments) };
        let mut skew = load(1.0, 0.0, [0.01; 3]);
        skew.inertia[1] = 1e-3;
        let mut turned = load(1.0, 0.0, [0.01; 3]);
        // Principal moments 0.02, 0 and 0.01 along axes that are not the frame's.
        (turned.inertia[1], turned.inertia[3]) = (0.01, 0.01);
        let refused = [
            ("no mass below zero", load(-1.0, 0.0, [0.0; 3])),
            ("no number", load(f64::NAN, 0.0, [0.0; 3])),
            ("20 kg at 900 m", load(20.0, 900.0, [0.0; 3])),
            ("over the payload", load(3.1, 0.0, [0.0; 3])),
            ("too heavy for the wrist", load(3.0, 0.5, [0.0; 3])),
            ("farther than the arm reaches", load(0.1, 1.1, [0.0; 3])),
            ("a centre that is no number", load(1.0, f64::NAN, [0.0; 3])),
            ("not symmetric", skew),
            ("a moment over the sum of the others", load(1.0, 0.0, [0.01, 0.01, 0.03])),
            ("a moment over the sum of the others, in other axes", turned),
            ("a moment below zero", load(1.0, 0.0, [0.01, 0.01, -0.01])),
            ("wider than the cell", load(1.0, 0.0, [2.0; 3])),
            ("nothing that turns heavily", load(0.0, 0.0, [0.01; 3])),
            ("no end", load(1.0, 0.0, [f64::INFINITY; 3])),
        ];
        let mut settings = Settings::at_power_on(None);
        for (what, load) in refused {
            assert_eq!(settings.set_load(&load), Err(Invalid), "{what}");
        }
        assert_eq!(settings.load, MassProperties::default());
        // A point, a rod, what the hand's maker declares for it, and the heaviest.
        for load in [
            load(1.0, 0.0, [0.0; 3]),
            load(1.0, 0.2, [0.01, 0.01, 0.0]),
            load(0.73, -0.01, [0.001, 0.0025, 0.0017]),
            load(3.0, 0.4, [0.01; 3]),
        ] {
            assert_eq!(settings.set_load(&load), Ok(()), "{load:?}");
            assert_eq!(settings.load.mass, load.mass);
        }
    }
}
