//! From a vector of numbers to the parameters of a cell: what a search may turn, how far, and where it begins.
//!
//! A parameter whose neutral value is infinite (the stiffness of a gear) is turned as its inverse, so that every effect has
//! a finite neutral point at which its slope can be taken. Units SI.

mod search;

pub use search::{arm_numbers, effect_settings, object_parameters};

use shared_mem::cell::Cell;
use shared_mem::theta::{ArmTheta, EffectTheta, ObjectTheta, Theta};
use std::collections::BTreeMap;
use toml::Value;
use twin::arm::{ArmModel, ControlLaw, GainError, ModelError};
use twin::effects::{Parameter, Search, Shape, find};
use twin::scene::{MeshFileError, ObjectModel};

/// One number of a [`Theta`].
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Setting {
    /// Stiffness of a joint [N m/rad].
    Stiffness(usize),
    /// Damping of a joint [N m s/rad].
    Damping(usize),
    /// Friction between object and table.
    Friction,
    /// Mass of the object [kg].
    Mass,
    /// An element of the object's centre of mass from the geometric centre [m].
    CentreOfMass(usize),
    /// Friction between tool and object.
    TipFriction,
    /// A parameter of an effect of the registry, in its unit.
    Effect {
        name: &'static str,
        parameter: &'static str,
        /// Joint, or element of a vector; none for a single number, which stands for all joints.
        index: Option<usize>,
        /// Whether the number is 1 / parameter.
        inverse: bool,
    },
}

/// The cell cannot be completed to a full set of parameters.
#[derive(Debug, thiserror::Error)]
pub enum BaseError {
    #[error(transparent)]
    Arm(#[from] ModelError),
    #[error(transparent)]
    Gains(#[from] GainError),
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
}

impl Setting {
    /// The parameter of an effect behind it.
    pub fn of_effect(&self) -> Option<&'static Parameter> {
        let Self::Effect { name, parameter, .. } = self else { return None };
        parameter_of(name, parameter)
    }

    /// The joint that it is about.
    pub fn joint(&self) -> Option<usize> {
        match self {
            Self::Stiffness(joint) | Self::Damping(joint) => Some(*joint),
            Self::Effect { index, .. } => *index,
            _ => None,
        }
    }

    /// How a search comes by a number of an effect.
    pub fn search(&self) -> Option<Search> {
        self.of_effect().map(|parameter| parameter.search)
    }

    /// Name in reports: `stiffness[2]`, `command_delay.delay`, `1/joint_elasticity.stiffness[0]`.
    pub fn name(&self) -> String {
        match self {
            Self::Stiffness(joint) => format!("stiffness[{joint}]"),
            Self::Damping(joint) => format!("damping[{joint}]"),
            Self::Friction => "friction".into(),
            Self::Mass => "mass".into(),
            Self::CentreOfMass(axis) => format!("centre_of_mass[{axis}]"),
            Self::TipFriction => "tip_friction".into(),
            Self::Effect { name, parameter, index, inverse } => {
                let index = index.map_or_else(String::new, |index| format!("[{index}]"));
                format!("{}{name}.{parameter}{index}", if *inverse { "1/" } else { "" })
            }
        }
    }

    /// Name of the parameter that the number is one of: `stiffness`, `command_delay.delay`.
    pub fn parameter(&self) -> String {
        match self {
            Self::Effect { name, parameter, .. } => format!("{name}.{parameter}"),
            other => other.name().split('[').next().unwrap_or_default().to_owned(),
        }
    }

    /// The parameter's value for a value of the number.
    pub fn physical(&self, number: f64) -> f64 {
        // An inverse below 0 has no meaning: as stiff as can be.
        if matches!(self, Self::Effect { inverse: true, .. }) { number.max(0.0).recip() } else { number }
    }

    /// The parameter's SI unit; `1` without.
    pub fn physical_unit(&self) -> String {
        match self {
            Self::Stiffness(_) => "N m/rad".into(),
            Self::Damping(_) => "N m s/rad".into(),
            Self::Friction | Self::TipFriction => "1".into(),
            Self::Mass => "kg".into(),
            Self::CentreOfMass(_) => "m".into(),
            Self::Effect { .. } => self.of_effect().map_or("1", |p| p.unit).into(),
        }
    }

    fn read(&self, theta: &Theta) -> Option<f64> {
        let (arm, object) = (theta.arm.as_ref(), theta.object.as_ref());
        match *self {
            Self::Stiffness(joint) => arm?.stiffness.get(joint).copied(),
            Self::Damping(joint) => arm?.damping.get(joint).copied(),
            Self::Friction => object?.friction,
            Self::Mass => object?.mass,
            Self::CentreOfMass(axis) => object?.centre_of_mass.map(|centre| centre[axis]),
            Self::TipFriction => object?.tip_friction,
            Self::Effect { name, parameter, index, inverse } => {
                let value = read_effect(&theta.effects, (name, parameter, index))?;
                Some(if inverse { value.recip() } else { value })
            }
        }
    }

    fn write(&self, theta: &mut Theta, value: f64, dof: usize) {
        match *self {
            Self::Stiffness(joint) => write_gain(theta.arm.as_mut().map(|arm| &mut arm.stiffness), joint, value),
            Self::Damping(joint) => write_gain(theta.arm.as_mut().map(|arm| &mut arm.damping), joint, value),
            Self::Friction => theta.object.get_or_insert_default().friction = Some(value),
            Self::Mass => theta.object.get_or_insert_default().mass = Some(value),
            Self::CentreOfMass(axis) => {
                theta.object.get_or_insert_default().centre_of_mass.get_or_insert_default()[axis] = value;
            }
            Self::TipFriction => theta.object.get_or_insert_default().tip_friction = Some(value),
            Self::Effect { name, parameter, index, inverse } => {
                let value = if inverse { value.recip() } else { value };
                write_effect(&mut theta.effects, (name, parameter, index), value, dof);
            }
        }
    }
}

fn read_effect(effects: &[EffectTheta], (name, parameter, index): (&str, &str, Option<usize>)) -> Option<f64> {
    let value = effects.iter().find(|effect| effect.name == name)?.parameters.get(parameter)?;
    let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(|value| value as f64));
    match (value, index) {
        // A single number stands for all joints.
        (Value::Array(values), Some(index)) => values.get(index).and_then(number),
        _ => number(value),
    }
}

fn write_gain(gains: Option<&mut Vec<f64>>, joint: usize, value: f64) {
    if let Some(gain) = gains.and_then(|gains| gains.get_mut(joint)) {
        *gain = value;
    }
}

/// Which numbers of a theta are turned; all others stay as they are in the base.
#[derive(Debug, Clone, PartialEq)]
pub struct Settings {
    base: Theta,
    settings: Vec<Setting>,
    dof: usize,
}

impl Settings {
    /// `base`: a complete theta, as [`complete`] makes it.
    pub fn new(base: Theta, settings: Vec<Setting>) -> Self {
        let dof = base.arm.as_ref().map_or(0, |arm| arm.stiffness.len());
        Self { base, settings, dof }
    }

    /// What is turned, in the order of the numbers.
    pub fn settings(&self) -> &[Setting] {
        &self.settings
    }

    /// The parameters that are not turned, and where the others begin.
    pub fn base(&self) -> &Theta {
        &self.base
    }

    /// The parameters that go with these numbers.
    pub fn theta(&self, shared: &[f64]) -> Theta {
        let mut theta = self.base.clone();
        for (setting, value) in self.settings.iter().zip(shared) {
            setting.write(&mut theta, *value, self.dof);
        }
        theta
    }

    /// The numbers that go with parameters; `None` for those that `theta` does not hold.
    pub fn numbers(&self, theta: &Theta) -> Vec<Option<f64>> {
        self.settings.iter().map(|setting| setting.read(theta)).collect()
    }
}

/// All parameters of a cell: what is given, completed by the nominal values of cell.toml.
///
/// # Errors
/// [`BaseError`] naming the key that is missing and the remedy.
pub fn complete(cell: &Cell, given: Option<&Theta>) -> Result<Theta, BaseError> {
    let mut theta = given.cloned().unwrap_or_default();
    if cell.robot.is_some() && cell.controller.is_some() {
        let arm = ArmModel::from_cell(cell)?;
        let law = ControlLaw::new(cell.controller.as_ref(), theta.arm.as_ref(), &arm)?;
        let of = |gains: &[f64]| gains[..arm.dof()].to_vec();
        theta.arm = Some(ArmTheta { stiffness: of(&law.stiffness), damping: of(&law.damping) });
    }
    if let Some(object) = ObjectModel::new(cell, Some(&theta))? {
        theta.object = Some(ObjectTheta {
            name: cell.object_name().map(str::to_owned),
            friction: Some(object.friction),
            mass: Some(object.mass),
            centre_of_mass: Some(object.centre_of_mass.into()),
            tip_friction: Some(object.tip_friction),
        });
    }
    Ok(theta)
}

fn parameter_of(effect: &str, parameter: &str) -> Option<&'static Parameter> {
    find(effect)?.parameters.iter().find(|p| p.name == parameter)
}

fn write_effect(
    blocks: &mut Vec<EffectTheta>,
    (name, parameter, index): (&'static str, &'static str, Option<usize>),
    value: f64,
    dof: usize,
) {
    let at = blocks.iter().position(|block| block.name == name).unwrap_or_else(|| {
        blocks.push(EffectTheta { name: name.into(), parameters: resting(name, dof) });
        blocks.len() - 1
    });
    let held = blocks[at].parameters.entry(parameter.to_owned()).or_insert(Value::Float(0.0));
    let Some(index) = index else {
        *held = Value::Float(value);
        return;
    };
    // A single number stands for all joints until one of them is turned alone.
    if let Value::Float(_) | Value::Integer(_) = held {
        *held = Value::Array(vec![held.clone(); dof]);
    }
    if let Value::Array(elements) = held
        && let Some(element) = elements.get_mut(index)
    {
        *element = Value::Float(value);
    }
}

/// The block of an effect that changes nothing.
fn resting(name: &str, dof: usize) -> BTreeMap<String, Value> {
    let parameters = find(name).map_or(&[][..], |effect| effect.parameters);
    let at_rest = |parameter: &Parameter| {
        let number = Value::Float(parameter.resting_value());
        match parameter.shape {
            Shape::Number => number,
            Shape::PerJoint => Value::Array(vec![number; dof]),
            Shape::Vector(n) => Value::Array(vec![number; n]),
        }
    };
    parameters.iter().map(|parameter| (parameter.name.to_owned(), at_rest(parameter))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::estimate::Unknown;
    use shared_mem::cell::{Controller, Robot};
    use std::path::Path;
    use twin::effects::{Effects, registry};

    fn cell() -> Cell {
        let text = include_str!("../../../../config/fr3_cell.toml");
        Cell::parse(text, Path::new("cell.toml")).expect("the shipped cell")
    }

    #[test]
    fn every_effect_can_be_turned_from_neutral_and_is_accepted_at_both_ends() {
        let base = complete(&cell(), None).expect("a complete cell");
        for info in registry() {
            let (settings, unknowns): (Vec<_>, Vec<_>) =
                effect_settings(info, &twin::effects::Robot::unknown(), 7).into_iter().unzip();
            let settings = Settings::new(base.clone(), settings);
            let at = |of: fn(&Unknown) -> f64| {
                let theta = settings.theta(&unknowns.iter().map(of).collect::<Vec<_>>());
                Effects::from_theta(&theta.effects, 7).unwrap_or_else(|error| panic!("{}: {error}", info.name))
            };
            assert!(at(|u| u.start).is_none(), "{} at rest", info.name);
            let changed = [at(|u| u.lower), at(|u| u.upper)].iter().any(|effects| !effects.is_none());
            assert!(changed, "{} at its bounds", info.name);
            assert!(unknowns.iter().all(|u| u.lower <= u.start && u.start <= u.upper && u.step > 0.0), "{unknowns:?}");
        }
    }

    #[test]
    fn numbers_land_where_their_settings_say() {
        let base = complete(&cell(), None).expect("a complete cell");
        let elasticity =
            Setting::Effect { name: "joint_elasticity", parameter: "stiffness", index: Some(2), inverse: true };
        let settings = [Setting::Stiffness(1), Setting::Damping(6), Setting::CentreOfMass(2), elasticity];
        let (settings, numbers) = (Settings::new(base, settings.to_vec()), [500.0, 12.0, 0.01, 1e-4]);
        let theta = settings.theta(&numbers);
        assert_eq!(settings.numbers(&theta), numbers.map(Some));
        let arm = theta.arm.expect("gains");
        assert_eq!((arm.stiffness[1], arm.damping[6], arm.stiffness[0]), (500.0, 12.0, 600.0));
        assert_eq!(theta.object.expect("an object").centre_of_mass, Some([0.0, 0.0, 0.01]));
        let Value::Array(stiffness) = &theta.effects[0].parameters["stiffness"] else { panic!("no array") };
        let of = |joint: usize| stiffness[joint].as_float().expect("a number");
        assert!((of(2) - 1e4).abs() < 1e-6 && of(0).is_infinite());
    }

    #[test]
    fn a_mass_that_was_weighed_is_not_searched() {
        let searched = |mass, mass_range| {
            let mut cell = cell();
            (cell.objects[0].mass, cell.objects[0].mass_range) = (mass, mass_range);
            let base = complete(&cell, None).expect("a complete cell");
            object_parameters(&cell, &base).iter().any(|(setting, _)| *setting == Setting::Mass)
        };
        let range = Some([0.1, 1.0]);
        assert!(searched(None, None) && searched(None, range) && searched(Some(0.3), range));
        assert!(!searched(Some(0.3), None));
    }

    #[test]
    fn gains_known_by_their_range_are_searched_in_it_and_gains_known_by_value_around_it() {
        let nominal = cell();
        let base = complete(&nominal, None).expect("a complete cell");
        let (_, first) = &arm_numbers(&nominal, &base)[0];
        assert_eq!((first.lower, first.start, first.upper), (300.0, 600.0, 1200.0));
        let ranged = Cell {
            robot: Some(Robot { joints: vec!["a".into()], ..Robot::default() }),
            controller: Some(Controller {
                stiffness_range: Some([1.0, 100.0].into()),
                damping_range: Some([0.0, 5.0].into()),
                ..Controller::default()
            }),
            ..Cell::default()
        };
        let base = complete(&ranged, None).expect("a complete cell");
        let all = arm_numbers(&ranged, &base);
        assert_eq!(all[..2].iter().map(|(_, u)| [u.lower, u.upper]).collect::<Vec<_>>(), [[1.0, 100.0], [0.0, 5.0]]);
    }

    #[test]
    fn the_weight_of_unknown_masses_is_searched_from_what_is_known_of_it() {
        let servo = Cell {
            robot: Some(Robot { joints: vec!["a".into(), "b".into()], ..Robot::default() }),
            controller: Some(Controller {
                stiffness: vec![20.0; 2],
                damping: vec![1.0; 2],
                torque_limit: vec![3.0, 1.0],
                ..Controller::default()
            }),
            ..Cell::default()
        };
        let given = "[[effect]]\nname = \"joint_weight\"\nconstant = [0.2, 0.1]\nsine = [1.5, -0.3]\ncosine = 0.0";
        let given: Theta = shared_mem::toml_file::parse(given, Path::new("theta.toml")).expect("a theta.toml");
        let base = complete(&servo, Some(&given)).expect("a complete cell");
        let all = arm_numbers(&servo, &base);
        let of_weight: Vec<(f64, f64)> = all[4..].iter().map(|(_, u)| (u.start, u.upper)).collect();
        let (large, small) = (3.0 * 0.8 * 2.0, 0.8 * 2.0);
        assert_eq!(of_weight.iter().map(|(start, _)| *start).collect::<Vec<_>>(), [0.2, 0.1, 1.5, -0.3, 0.0, 0.0]);
        assert!(
            of_weight.iter().zip([large, small].iter().cycle()).all(|((_, upper), most)| (upper - most).abs() < 1e-9)
        );
        assert_eq!(
            arm_numbers(&cell(), &complete(&cell(), None).expect("a complete cell")).len(),
            14,
            "its masses are known"
        );
    }
}
