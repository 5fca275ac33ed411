//! Everything the nominal cell lacks: effects that a real cell has and that a simulated cell can be given.
//!
//! One effect is one file: its equation, source, plausible range, signature, what it is confused with, how a search comes
//! by it, what separates it from others, what to do about it, what it changes in a model for another simulator, its code and its test: what it says about itself in the words of `info` and `parameter`. [`registry()`] lists them all. A new effect on the arm is a new file and its line in `arm`; of another stage, a new file, its line in the registry and a field in
//! the struct of its stage. Effects combine freely; one whose sizes are all neutral is not installed, so it changes no bit.
//!
//! | folder | acts on | read by |
//! |---|---|---|
//! | `arm` | commands, torques, joints, joint sensing, the arm's bodies | [`crate::rollout`], [`crate::sim`] |
//! | `hit` | the contact of tool and object, the object's inertia | [`crate::sim`] |
//! | `slide` | friction and pressure under the object, the table's lean | [`crate::sim`], for [`crate::physics`] |
//! | `camera` | what the tracker reports | [`crate::sensors`], replay |
//!
//! The list with all parameters: `docs/effects.md`, which a test keeps to the registry. C1 to V10 in the signatures are the
//! numbers of a survey of sim-to-real gaps: C arm, H hit, S slide, V camera.

mod arm;
mod camera;
mod change;
mod hit;
mod info;
mod parameter;
mod registry;
mod remedy;
mod robot;
mod separation;
mod slide;
mod stated;
mod values;

pub(crate) use arm::JointMemory;
pub use arm::{ArmEffects, ArmMemory};
pub use camera::{CameraEffects, CameraMemory};
pub use change::Change;
pub use hit::HitEffects;
pub use info::{EffectInfo, Place, Stage};
pub use parameter::{Elsewhere, OnTable, Parameter, Role, Search, Shape};
pub use registry::{find, registry, unknown_weight};
pub use remedy::{Found, Remedy};
pub use robot::Robot;
pub use separation::{Experiment, Separation};
pub use slide::{SlideEffects, TableFriction};
pub use stated::stated;
pub use values::EffectError;

use crate::physics::Material;
use crate::scene::ObjectParameters;
use registry::named;
use shared_mem::theta::EffectTheta;
use values::Values;

/// The effects of one cell, sorted by where they act.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Effects {
    /// On the arm.
    pub arm: ArmEffects,
    /// On the hit.
    pub hit: HitEffects,
    /// On the slide.
    pub slide: SlideEffects,
    /// On the report of the object's pose.
    pub camera: CameraEffects,
}

impl Effects {
    /// The effects of a theta.toml, for an arm of `dof` joints.
    ///
    /// # Errors
    /// [`EffectError`] naming the effect, the parameter and the remedy.
    ///
    /// # Example
    /// ```
    /// use shared_mem::theta::EffectTheta;
    /// use twin::effects::Effects;
    ///
    /// let block = |text: &str| toml::from_str::<EffectTheta>(text).expect("TOML");
    /// let friction = block("name = \"joint_coulomb_friction\"\ncoulomb = [0.4, 0.4, 0.4, 0.4, 0.2, 0.2, 0.1]"); // N m
    /// let effects = Effects::from_theta(&[friction], 7)?;
    /// assert!(!effects.is_none());
    ///
    /// // A name that nothing has is refused with the most similar one.
    /// let error = Effects::from_theta(&[block("name = \"comand_delay\"\ndelay = 0.004")], 7).unwrap_err();
    /// assert!(error.to_string().contains("command_delay"), "{error}");
    /// # Ok::<(), twin::effects::EffectError>(())
    /// ```
    pub fn from_theta(blocks: &[EffectTheta], dof: usize) -> Result<Self, EffectError> {
        let mut effects = Self::default();
        for (i, block) in blocks.iter().enumerate() {
            if blocks[..i].iter().any(|earlier| earlier.name == block.name) {
                return Err(EffectError::Twice(block.name.clone()));
            }
            let effect = named(&block.name)?;
            let values = Values::read(effect.name, effect.parameters, block, dof)?;
            if !values.are_neutral() {
                (effect.install)(&values, &mut effects);
            }
        }
        Ok(effects)
    }

    /// An object and its table as they are, in the numbers of [`crate::physics`].
    pub fn material(&self, parameters: ObjectParameters) -> Material<TableFriction> {
        let nominal = Material::nominal(parameters);
        let yaw_inertia_factor = self.hit.object_inertia.map_or(nominal.yaw_inertia_factor, |effect| effect.factor);
        self.slide.material(Material { yaw_inertia_factor, ..nominal })
    }

    /// Whether there is none at all.
    pub fn is_none(&self) -> bool {
        *self == Self::default()
    }
}
