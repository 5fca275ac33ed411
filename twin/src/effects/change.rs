//! What an effect is to a model of the cell, whichever simulator it is for: the numbers that a model file may have a key for.
//!
//! Each effect says it in its own file, from the numbers that were identified. Which keys a format has, only the writer of
//! that format knows; a law for which none has one is [`Change::Beyond`]. Units SI; a vector of joints holds one number for each,
//! or a single one for all.

/// One change of a model, on top of what cell.toml states.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// Added to the rotor inertia seen at each joint [kg m²].
    Armature(Vec<f64>),
    /// Dry friction of each joint [N m], which builds up over the speed `creep` [rad/s].
    DryFriction {
        /// Torque that it takes to move [N m].
        level: Vec<f64>,
        /// Speed over which it builds up [rad/s].
        creep: Vec<f64>,
    },
    /// Added to the viscous friction of each joint [N m s/rad].
    Damping(Vec<f64>),
    /// A torque that acts on each joint whatever it does [N m].
    ConstantTorque(Vec<f64>),
    /// What each joint's torque is, over what the controller asks for, gravity compensation included.
    TorqueGain(Vec<f64>),
    /// Largest torque of each joint [N m].
    TorqueLimit(Vec<f64>),
    /// What each joint's encoder reads beyond the joint's position [rad].
    EncoderOffset(Vec<f64>),
    /// By how much commands reach the controller later [s].
    CommandDelay(f64),
    /// Time constant of a first-order low-pass in the way of the command [s].
    CommandLag(f64),
    /// A point mass on the flange that the controller does not compensate.
    FlangeLoad {
        /// Its mass [kg].
        mass: f64,
        /// Where, in the flange frame [m].
        centre: [f64; 3],
    },
    /// The tool sits beside its place.
    ToolShift {
        /// In the flange frame [m].
        offset: [f64; 3],
        /// The share of its mass that sits there too.
        carried: f64,
    },
    /// Gravity on the arm in the base frame, where the controller compensates an upright one [m/s²].
    ArmGravity([f64; 3]),
    /// Gravity on the object in the base frame [m/s²].
    ObjectGravity([f64; 3]),
    /// Added to the inverse of the stiffness of tip and object [m/N].
    Compliance(f64),
    /// Restitution of tip and object.
    Restitution(f64),
    /// Added to the friction of tip and object.
    TipFriction(f64),
    /// The object's inertia about its z axis, over that of a homogeneous body.
    YawInertia(f64),
    /// Friction on the table: `1 + size` times the mean along `axis` [rad from the base's x axis], `1 - size` across.
    FrictionAlong {
        size: f64,
        /// Where to [rad].
        axis: f64,
    },
    /// Where the object presses on the table: distance from the middle of its base, over the nominal one.
    PressureReach(f64),
    /// How much older a pose is than its stamp says, on top of what cell.toml knows [s].
    PoseLatency(f64),
    /// Everything the camera shows is turned about a place, because it looks elsewhere than its calibration says.
    CameraTurn {
        /// Rotation vector in the base frame [rad].
        rotation: [f64; 3],
        /// In the base frame [m].
        centre: [f64; 3],
    },
    /// Everything the camera shows is shifted, because it stands elsewhere than its calibration says [m, base frame].
    CameraShift([f64; 3]),
    /// A law that no model file has a key for, in a few words.
    Beyond(&'static str),
}

#[cfg(test)]
mod tests {
    use super::super::registry::{find, registry};
    use super::*;
    use shared_mem::cell::Cell;

    #[test]
    fn every_effect_says_what_it_changes_in_a_model_with_the_numbers_that_were_found() {
        for effect in registry() {
            let found = |name: &str| {
                let parameter = effect.parameters.iter().find(|p| p.name == name)?;
                Some(vec![parameter.plausible[1]; 7])
            };
            let changes = effect.changes(&Cell::default(), &found);
            assert!(!changes.is_empty(), "{} changes nothing in a model", effect.name);
            assert!(!format!("{changes:?}").contains("NaN"), "{}: {changes:?}", effect.name);
        }
    }

    #[test]
    fn friction_that_differs_between_directions_is_a_constant_torque_against_it() {
        let effect = find("joint_friction_asymmetry").expect("an effect");
        let known = |name: &str| (name == "offset").then(|| vec![0.3, -0.1]);
        assert_eq!(effect.changes(&Cell::default(), &known), [Change::ConstantTorque(vec![-0.3, 0.1])]);
        let fading = |name: &str| Some(vec![if name == "offset" { 0.3 } else { 0.01 }]);
        assert!(matches!(effect.changes(&Cell::default(), &fading)[..], [Change::Beyond(_)]));
    }
}
