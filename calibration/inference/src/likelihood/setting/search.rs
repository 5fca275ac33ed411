//! What is searched, from where and how far: gains, the object's parameters, the parameters of an effect. SI units.

use super::Setting;
use crate::estimate::Unknown;
use nalgebra::Vector3;
use shared_mem::cell::{Cell, Controller, ControllerKind, Range, Robot as CellRobot};
use shared_mem::theta::Theta;
use twin::arm::{ArmModel, damping_range, stiffness_range};
use twin::effects::{EffectInfo, Parameter, Place, Robot, Role, Search, Shape, Stage, unknown_weight};
use twin::scene::ObjectModel;

/// Gains stated by value are searched this many times up and down [1]: the values are right to 20 %, and a bound must not be mistaken for them.
const GAIN_FACTOR: f64 = 2.0;
/// Difference step of a gain over the gain [1]: large against rounding, small against what bends.
const GAIN_STEP: f64 = 1e-4;

/// Stiffness and damping of every joint, beginning at the base's, and where the masses of the links are not known what their weight
/// asks of each joint; none where no law leads the arm.
pub fn arm_numbers(cell: &Cell, base: &Theta) -> Vec<(Setting, Unknown)> {
    let (Some(controller), Some(arm)) = (&cell.controller, &base.arm) else { return Vec::new() };
    if controller.kind == ControllerKind::Tracking {
        return Vec::new();
    }
    let model = ArmModel::from_cell(cell).ok();
    let ranges = |of: fn(&Controller, &ArmModel, usize) -> Option<Range>, count: usize| -> Vec<Option<Range>> {
        (0..count).map(|joint| of(controller, model.as_ref()?, joint)).collect()
    };
    let ranged = ranges(stiffness_range, arm.stiffness.len());
    let stiffness = Gain { starts: &arm.stiffness, nominal: &controller.stiffness, ranges: ranged };
    let ranged = ranges(damping_range, arm.damping.len());
    let damping = Gain { starts: &arm.damping, nominal: &controller.damping, ranges: ranged };
    let mut all = stiffness.unknowns(Setting::Stiffness);
    all.extend(damping.unknowns(Setting::Damping));
    if cell.robot.as_ref().is_some_and(CellRobot::joints_only) {
        all.extend(model.iter().flat_map(|model| weight(model, base)));
    }
    all
}

/// What the weight of links of unknown masses asks of each joint, beginning at the base's.
fn weight(model: &ArmModel, base: &Theta) -> Vec<(Setting, Unknown)> {
    let mut all = effect_settings(unknown_weight(), &Robot::of(model), model.dof());
    for (setting, unknown) in &mut all {
        unknown.start = setting.read(base).unwrap_or(unknown.start).clamp(unknown.lower, unknown.upper);
    }
    all
}

/// One kind of gain, joint by joint.
struct Gain<'a> {
    starts: &'a [f64],
    nominal: &'a [f64],
    ranges: Vec<Option<Range>>,
}

impl Gain<'_> {
    fn unknowns(&self, setting: fn(usize) -> Setting) -> Vec<(Setting, Unknown)> {
        let of = |(joint, start): (usize, &f64)| {
            let around = self.nominal.get(joint).copied().unwrap_or(*start).max(f64::MIN_POSITIVE);
            let [lower, upper] = self.ranges[joint].unwrap_or([around / GAIN_FACTOR, around * GAIN_FACTOR]);
            unknown(setting(joint), *start, [lower, upper], GAIN_STEP * start.max(0.05 * around).max(1e-3))
        };
        self.starts.iter().enumerate().map(of).collect()
    }
}

/// Ranges of the object's parameters where cell.toml states none: friction, mass over the nominal one, friction of the tip [1]: choices.
const FRICTION_RANGE: Range = [0.02, 1.5];
const MASS_FACTOR: f64 = 5.0;
const TIP_FRICTION_RANGE: Range = [0.0, 1.0];
/// The centre of mass lies within this share of the half extents from the centroid [1]: a choice.
const CENTRE_SHARE: f64 = 0.5;

/// Friction, mass where it was not weighed, centre of mass and, where an arm may touch it, tip friction of the object, beginning at the
/// base's. Difference steps are wide: where tool and object just part, a little more of any number moves the resting place, and
/// over such a step that roughness averages out.
pub fn object_parameters(cell: &Cell, base: &Theta) -> Vec<(Setting, Unknown)> {
    let (Some(object), Some(start)) = (cell.object(), &base.object) else { return Vec::new() };
    let mass = start.mass.unwrap_or_else(|| object.nominal_mass());
    let (half, centroid) = match ObjectModel::new(cell, Some(base)) {
        Ok(Some(model)) => (model.shape.half_extents(), model.shape.centroid()),
        _ => (Vector3::repeat(0.05), Vector3::zeros()),
    };
    let centres = object.centre_of_mass_range.unwrap_or_else(|| {
        let around = |(half, centre): (f64, f64)| {
            [-1.0, 1.0].map(|side| (centre + side * CENTRE_SHARE * half).clamp(-half, half))
        };
        [0, 1, 2].map(|axis| around((half[axis], centroid[axis])))
    });
    let masses = object.mass_range.unwrap_or([mass / MASS_FACTOR, mass * MASS_FACTOR]);
    let friction = start.friction.unwrap_or_else(|| object.nominal_friction());
    let tip = start.tip_friction.unwrap_or_else(|| object.nominal_tip_friction());
    let wide = |setting, start, range: Range, step: f64| {
        let room = range[1] - range[0];
        unknown(setting, start, range, step.min(0.2 * room).max(1e-3 * room))
    };
    let frictions = object.friction_range.unwrap_or(FRICTION_RANGE);
    let mut all = vec![wide(Setting::Friction, friction, frictions, 0.05 * friction.max(0.05))];
    if object.mass.is_none() || object.mass_range.is_some() {
        all.push(wide(Setting::Mass, mass, masses, 0.08 * mass));
    }
    for (axis, range) in centres.into_iter().enumerate() {
        let value = start.centre_of_mass.unwrap_or_default()[axis];
        all.push(wide(Setting::CentreOfMass(axis), value, range, 1.5e-3));
    }
    if cell.robot.is_some() {
        all.push(wide(Setting::TipFriction, tip, object.tip_friction_range.unwrap_or(TIP_FRICTION_RANGE), 0.06));
    }
    all
}

/// How far beyond what is plausible an effect is searched, over the width of that range [1]: a choice.
const SEARCHED_BEYOND_PLAUSIBLE: f64 = 0.5;
/// A factor on what a motor gives is off by any ratio where its constant or its gear is another: followed so many times up and down [1], as
/// far as firmware gains are switched (a choice).
const FACTOR_FOLLOWED: f64 = 10.0;
/// Difference step over the width of what is plausible [1].
const EFFECT_STEP: f64 = 2e-3;
/// The same where hits lie between the number and what is seen, of a tool or of a gear's flanks: over this step their
/// roughness averages out.
const ROUGH_STEP: f64 = 2e-2;

/// The same of an order: far from the zero of a joint a little of it is a large angle (400 of them, 1e-5 of that range and 2.5 rad
/// are 0.01 rad).
const ORDER_STEP: f64 = 1e-5;

/// Every number of an effect, for an arm of `dof` joints on such a robot, beginning where the effect changes nothing.
pub fn effect_settings(info: &'static EffectInfo, robot: &Robot, dof: usize) -> Vec<(Setting, Unknown)> {
    let mut all = Vec::new();
    for parameter in info.parameters {
        let indices: Vec<Option<usize>> = match parameter.shape {
            Shape::Number => vec![None],
            Shape::PerJoint => (0..dof).map(Some).collect(),
            Shape::Vector(n) => (0..n).map(Some).collect(),
        };
        let inverse = parameter.resting_value().is_infinite();
        let flanks = info.parameters.iter().any(|parameter| parameter.search == Search::Threshold);
        let hits = info.stage != Stage::Control || flanks;
        let share = match parameter.search {
            Search::Periodic => ORDER_STEP,
            _ if hits => ROUGH_STEP,
            _ => EFFECT_STEP,
        };
        let start = if inverse { 0.0 } else { parameter.resting_value() };
        for index in indices {
            let met = robot.range(parameter, index);
            let setting = Setting::Effect { name: info.name, parameter: parameter.name, index, inverse };
            let is_factor = info.acts_on == Place::TorquePath && matches!(parameter.role, Role::Size { neutral: 1.0 });
            let range = if is_factor {
                [start / FACTOR_FOLLOWED, start * FACTOR_FOLLOWED]
            } else {
                searched(parameter, met, inverse)
            };
            all.push(unknown(setting, start, range, share * width(met, inverse)));
        }
    }
    all
}

/// The range of the number that is turned; `met`: plausible values of the parameter.
fn searched(parameter: &Parameter, met: Range, inverse: bool) -> Range {
    let [lo, hi] = met;
    if inverse {
        return [0.0, (1.0 + SEARCHED_BEYOND_PLAUSIBLE) / lo];
    }
    let more = SEARCHED_BEYOND_PLAUSIBLE * (hi - lo);
    let rest = parameter.resting_value();
    let [least, most] = parameter.possible;
    // A form like an angle wraps around: no more of it makes sense.
    let more = if matches!(parameter.role, Role::Form { .. }) { 0.0 } else { more };
    [(lo - more).max(least).min(rest), (hi + more).min(most).max(rest)]
}

fn width([lo, hi]: Range, inverse: bool) -> f64 {
    if inverse { lo.recip() } else { hi - lo }
}

fn unknown(setting: Setting, start: f64, [lower, upper]: Range, step: f64) -> (Setting, Unknown) {
    (setting, Unknown { name: setting.name(), start: start.clamp(lower, upper), lower, upper, step })
}

#[cfg(test)]
mod tests {
    use super::*;
    use twin::effects::find;

    #[test]
    fn a_drive_of_twice_the_torque_lies_inside_of_what_is_searched() {
        let gain = find("torque_gain").expect("an effect");
        for (_, unknown) in effect_settings(gain, &Robot::unknown(), 7) {
            assert!(unknown.start == 1.0 && unknown.lower < 0.25 && unknown.upper > 4.0, "{unknown:?}");
        }
    }
}
