//! The arm of a cell with its controller and with what the controller does not know about it.

use super::ArmRollout;
use crate::arm::{ArmModel, ControlLaw, GainError, Joints, MassProperties, Transmission, Yielding};
use crate::effects::ArmEffects;
use shared_mem::cell::{Cell, Controller};
use shared_mem::theta::Theta;
use shared_mem::time::TICK;

/// Arm, controller and hidden effects. Constant over time.
#[derive(Debug, Clone)]
pub struct Plant {
    /// The model inside the controller.
    nominal: ArmModel,
    law: ControlLaw,
    /// The gains that its user asked for instead.
    asked: Option<ControlLaw>,
    /// The model inside a controller that knows of a load: `nominal` with it.
    laden: Option<ArmModel>,
    /// Effects and the arm that they make; `None` for an arm that is as cell.toml says.
    hidden: Option<(ArmEffects, ArmModel)>,
}

impl Plant {
    /// The arm `nominal` of a cell under its controller, with the identified gains of `theta` and with `effects`.
    ///
    /// # Errors
    /// [`GainError`] naming the key and the remedy.
    pub fn new(cell: &Cell, nominal: ArmModel, theta: Option<&Theta>, effects: &ArmEffects) -> Result<Self, GainError> {
        let law = law(cell.controller.as_ref(), theta, &nominal)?;
        let mut plant = Self { nominal, law, asked: None, laden: None, hidden: None };
        plant.hide(effects);
        Ok(plant)
    }

    /// The same arm with other gains and effects.
    ///
    /// # Errors
    /// [`GainError`] naming the key and the remedy; the plant is as before then.
    pub fn set(
        &mut self,
        controller: Option<&Controller>,
        theta: Option<&Theta>,
        effects: &ArmEffects,
    ) -> Result<(), GainError> {
        self.law = law(controller, theta, &self.nominal)?;
        self.asked = None;
        self.hide(effects);
        Ok(())
    }

    fn hide(&mut self, effects: &ArmEffects) {
        let known = match &self.hidden {
            Some((now, _)) => now == effects,
            None => effects.is_none(),
        };
        if !known {
            self.hidden = (!effects.is_none()).then(|| (effects.clone(), effects.real_arm(&self.nominal)));
        }
    }

    /// What a rollout of the arm alone takes.
    pub fn rollout(&self) -> ArmRollout<'_> {
        let (arm, effects) = match &self.hidden {
            Some((effects, arm)) => (arm, Some(effects)),
            None => (&self.nominal, None),
        };
        let law = self.asked.as_ref().unwrap_or(&self.law);
        ArmRollout { arm, nominal: self.nominal(), law, effects, parts: 1 }
    }

    /// The arm that moves.
    pub fn arm(&self) -> &ArmModel {
        self.rollout().arm
    }

    /// Whether motor and link of a joint may part.
    pub(crate) fn yields_in_joints(&self) -> bool {
        self.hidden.as_ref().is_some_and(|(effects, _)| effects.yields())
    }

    /// How the arm gives way to a push at `q`; `grip`: what its joints resist besides ([`crate::arm::Passed::grip`]).
    pub(crate) fn yielding(&self, q: &Joints, grip: &Joints) -> Yielding {
        let effects = self.hidden.as_ref().map(|(effects, _)| effects);
        self.arm().yielding(q, |joint| effects.is_some_and(|effects| effects.spring(joint).is_some()), grip)
    }

    /// The model inside the controller.
    pub fn nominal(&self) -> &ArmModel {
        self.laden.as_ref().unwrap_or(&self.nominal)
    }

    /// Tells the controller that the flange carries `load` (flange frame) beside the tool. What it really carries stays.
    pub(crate) fn declare_load(&mut self, load: &MassProperties) {
        self.laden = (load.mass > 0.0).then(|| {
            let mut laden = self.nominal.clone();
            laden.add_at_flange(load);
            laden
        });
    }

    /// Asks the controller for another stiffness than that of cell.toml's `controller`. What parts the gains that really
    /// act from cell.toml's stays in proportion. So does the damping ratio, as far as a torque that holds for a period
    /// allows: at most half the rotor's inertia over the period, where a bare rotor comes to rest without ringing.
    pub(crate) fn ask_stiffness(
        &mut self,
        stiffness: &Joints,
        controller: Option<&Controller>,
    ) -> Result<(), GainError> {
        let described = law(controller, None, &self.nominal)?;
        let rotor = self.arm().rotor_inertia();
        let mut asked = self.law;
        for i in 0..self.nominal.dof() {
            if described.stiffness[i] > 0.0 {
                let ratio = stiffness[i] / described.stiffness[i];
                let steady = (0.5 * rotor[i] / TICK).max(self.law.damping[i]);
                asked.stiffness[i] = self.law.stiffness[i] * ratio;
                asked.damping[i] = (self.law.damping[i] * ratio.sqrt()).min(steady);
            } else {
                asked.stiffness[i] = stiffness[i];
            }
        }
        self.asked = Some(asked);
        Ok(())
    }
}

fn law(controller: Option<&Controller>, theta: Option<&Theta>, nominal: &ArmModel) -> Result<ControlLaw, GainError> {
    ControlLaw::new(controller, theta.and_then(|t| t.arm.as_ref()), nominal)
}
