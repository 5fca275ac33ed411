//! The list of all effects, which is the single place that knows them all: theta.toml is read by it, the diagnosis takes
//! its candidates from it, the documentation its table.

use super::info::EffectInfo;
use super::parameter::Search;
use super::values::EffectError;
use super::{arm, camera, hit, slide};
use std::sync::LazyLock;

/// Every effect, stage by stage.
pub fn registry() -> &'static [EffectInfo] {
    static EFFECTS: LazyLock<Vec<EffectInfo>> = LazyLock::new(|| [arm::EFFECTS, BEYOND_THE_ARM].concat());
    &EFFECTS
}

/// The effect with this name.
///
/// ```
/// use twin::effects::{find, registry};
///
/// let delay = find("command_delay").expect("an effect on the arm");
/// let parameter = &delay.parameters[0];
/// assert_eq!((parameter.name, parameter.unit), ("delay", "s"));
/// assert_eq!(parameter.resting_value(), 0.0);
/// assert!(registry().len() > 30);
/// ```
pub fn find(name: &str) -> Option<&'static EffectInfo> {
    registry().iter().find(|effect| effect.name == name)
}

/// The effect that somebody names.
///
/// # Errors
/// [`EffectError::Name`] with the most similar one.
pub(super) fn named(name: &str) -> Result<&'static EffectInfo, EffectError> {
    find(name).ok_or_else(|| EffectError::Name { name: name.to_owned(), nearest: nearest(name) })
}

fn nearest(name: &str) -> &'static str {
    let similarity = |effect: &EffectInfo| strsim::jaro_winkler(name, effect.name);
    registry()
        .iter()
        .max_by(|a, b| similarity(a).total_cmp(&similarity(b)))
        .map_or("command_delay", |effect| effect.name)
}

impl EffectInfo {
    /// Whether a diagnosis may name it as what a cell has and its model lacks; else its numbers are identified on request alone.
    pub fn is_cause(&self) -> bool {
        self.parameters.iter().all(|parameter| parameter.search != Search::OnRequest)
    }
}

/// The weight of links whose masses are not known: no cause, since every arm has weight, but numbers to identify where a cell
/// gives no masses.
pub fn unknown_weight() -> &'static EffectInfo {
    static WEIGHT: EffectInfo = arm::joint_weight::EFFECT;
    &WEIGHT
}

/// Those that do not act on the arm.
const BEYOND_THE_ARM: &[EffectInfo] = &[
    hit::restitution::EFFECT,
    hit::contact_compliance::EFFECT,
    hit::tip_friction::EFFECT,
    hit::tool_offset::EFFECT,
    hit::object_inertia::EFFECT,
    slide::anisotropic_friction::EFFECT,
    slide::stribeck_sliding_friction::EFFECT,
    slide::velocity_dependent_friction::EFFECT,
    slide::viscous_sliding_drag::EFFECT,
    slide::table_tilt::EFFECT,
    slide::friction_patch::EFFECT,
    slide::pressure_distribution::EFFECT,
    camera::camera_latency::EFFECT,
    camera::camera_extrinsic_rotation::EFFECT,
    camera::camera_extrinsic_translation::EFFECT,
    camera::camera_scale::EFFECT,
    camera::tracker_smoothing::EFFECT,
];
