//! What an effect says about itself.

use super::Effects;
use super::change::Change;
use super::parameter::{Parameter, Search};
use super::remedy::{Found, Remedy};
use super::separation::Separation;
use super::values::Values;
use shared_mem::cell::Cell;

/// Part of a clip in which an effect shows first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Stage {
    /// The arm follows its command.
    Control,
    /// The tool hits the object.
    Hit,
    /// The object slides.
    Slide,
    /// The camera reports.
    Camera,
}

/// Where in the simulation an effect acts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Place {
    /// Between the log of the command and the controller.
    CommandPath,
    /// Between the controller and the motors.
    TorquePath,
    /// Between the motors and the links.
    Joint,
    /// Bodies of the arm, and gravity.
    ArmModel,
    /// What the arm reports about itself.
    JointSensing,
    /// Contact of tool and object.
    ToolContact,
    /// The object's body.
    Object,
    /// Friction between object and table, and what else acts on the object there.
    Table,
    /// What is reported about the object's pose.
    ObjectObservation,
}

impl Stage {
    /// Name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Control => "control",
            Self::Hit => "hit",
            Self::Slide => "slide",
            Self::Camera => "camera",
        }
    }
}

/// One effect: what the nominal cell lacks.
#[derive(Debug, Clone, Copy)]
pub struct EffectInfo {
    /// Name in files and reports.
    pub name: &'static str,
    /// Where it shows first.
    pub stage: Stage,
    /// Where it acts.
    pub acts_on: Place,
    pub parameters: &'static [Parameter],
    /// Names of effects that look alike in some recordings.
    pub confusable_with: &'static [&'static str],
    /// What separates it from some of them.
    pub separated: &'static [Separation],
    /// Adds the effect with these parameters.
    pub(super) install: fn(&Values, &mut Effects),
    /// What to do about it; asked for by [`EffectInfo::remedy`].
    pub(super) remedy: fn(&Found<'_>) -> Remedy,
    /// What it changes in a model; asked for by [`EffectInfo::changes`].
    pub(super) model: fn(&Found<'_>) -> Vec<Change>,
}

impl EffectInfo {
    /// What to do about this effect in `cell`, where `numbers` are its parameters by name; one that is not known takes its
    /// resting value.
    ///
    /// ```
    /// use shared_mem::cell::Cell;
    /// use twin::effects::find;
    ///
    /// let gain = find("torque_gain").expect("an effect on the arm");
    /// let remedy = gain.remedy(&Cell::default(), &|parameter| (parameter == "gain").then(|| vec![0.8]));
    /// assert!(remedy.in_cell.contains("1.25") && remedy.in_model.contains("0.8"));
    /// ```
    pub fn remedy(&'static self, cell: &Cell, numbers: &dyn Fn(&str) -> Option<Vec<f64>>) -> Remedy {
        (self.remedy)(&Found::new(self.parameters, numbers, cell))
    }

    /// Whether a mass, a length or a friction is behind it. A torque that a sensor adds and a periodic law of free order and phase need
    /// none, so that over a short travel they imitate what has one.
    pub fn is_of_bodies(&self) -> bool {
        let any = |of: fn(&Parameter) -> bool| self.parameters.iter().any(of);
        let read_torque = self.acts_on == Place::JointSensing && any(|parameter| parameter.unit == "N m");
        !read_torque && !any(|parameter| parameter.search == Search::Periodic)
    }

    /// What this effect changes in a model of `cell`, where `numbers` are its parameters by name; one that is not known takes
    /// its resting value.
    pub fn changes(&'static self, cell: &Cell, numbers: &dyn Fn(&str) -> Option<Vec<f64>>) -> Vec<Change> {
        (self.model)(&Found::new(self.parameters, numbers, cell))
    }
}
