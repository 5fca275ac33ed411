//! One joint between motor and link during one stage of a step: which of its laws hold, and what the link feels of them.

use super::super::dry_friction::Yields;
use super::Spring;

/// What a joint resists that dry friction holds, as an inertia [kg m²].
const HELD: f64 = 1e6;

/// Whether the motor moves against its dry friction.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Dry {
    /// It moves, or would, with this sign; 0 without friction.
    Slips(f64),
    /// It rests, or yields within the friction.
    Sticks,
}

/// What the gear passes on.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Gear {
    Rigid,
    /// The spring is loaded, on this flank where there is play (0: there is none).
    Loaded(f64),
    /// Inside the play.
    Free,
}

/// One joint during one stage.
#[derive(Clone, Copy)]
pub(super) struct Side {
    pub(super) link_speed: f64,
    pub(super) motor_speed: f64,
    pub(super) twist: f64,
    pub(super) rotor: f64,
    pub(super) drive: f64,
    pub(super) dry: f64,
    pub(super) yields: Yields,
    /// Friction of a joint that yields, were it at rest at the end of the stage [N m].
    pub(super) held: f64,
    /// The secant of its friction from rest to some speed at the end of the stage [N m s/rad].
    pub(super) viscosity: f64,
    pub(super) spring: Option<Spring>,
}

impl Side {
    /// What will hold unless the step turns it around.
    pub(super) fn likely(self) -> (Dry, Gear) {
        let dry = match self.dry > 0.0 {
            true if self.motor_speed == 0.0 || self.yields != Yields::Nowhere => Dry::Sticks,
            true => Dry::Slips(self.motor_speed.signum()),
            false => Dry::Slips(0.0),
        };
        let gear = match self.spring {
            None => Gear::Rigid,
            Some(spring) if spring.play <= 0.0 => Gear::Loaded(0.0),
            Some(spring) if self.twist.abs() > 0.5 * spring.play => Gear::Loaded(self.twist.signum()),
            Some(_) => Gear::Free,
        };
        (dry, gear)
    }

    /// The same with the friction of a joint that yields as it is where the stage of `dt` ends at `speed`.
    pub(super) fn yielding_at(self, speed: f64, dt: f64) -> Self {
        let (held, viscosity) = self.yields.secant(self.dry, (self.motor_speed, speed), dt);
        Self { held, viscosity, ..self }
    }

    /// Spring torque `s = s0 + g (motor acceleration - link acceleration)`: at the middle of the stage, or at its end
    /// where there is play, so that a flank is loaded exactly when it is reached.
    fn spring_law(&self, gear: Gear, dt: f64) -> (f64, f64) {
        let (Some(spring), Gear::Loaded(flank)) = (self.spring, gear) else { return (0.0, 0.0) };
        let rate = self.motor_speed - self.link_speed;
        let share = if flank == 0.0 { 0.5 } else { 1.0 };
        let twist = self.twist - 0.5 * flank * spring.play + share * dt * rate;
        let g = 0.5 * share * spring.stiffness * dt * dt + 0.5 * spring.damping * dt;
        (spring.stiffness * twist + spring.damping * rate, g)
    }

    /// The motor by itself: its inertia and torque, with the friction in them; `None` where it is held at rest.
    fn motor(&self, dry: Dry, dt: f64) -> Option<(f64, f64)> {
        match dry {
            Dry::Slips(sign) => Some((self.rotor, self.drive - sign * self.dry)),
            Dry::Sticks if self.yields == Yields::Nowhere => None,
            Dry::Sticks => {
                let drive = self.drive - self.held - self.viscosity * self.motor_speed;
                Some((self.rotor + self.viscosity * dt, drive))
            }
        }
    }

    /// [`super::Passed::grip`] at the end of a step with this acceleration of the motor.
    pub(super) fn grip(&self, (dry, gear): (Dry, Gear), motor: f64, dt: f64) -> f64 {
        let speed = self.motor_speed + dt * motor;
        let tangent =
            if dry == Dry::Sticks { self.yields.tangent(self.dry, (self.motor_speed, speed), dt) } else { 0.0 };
        match (dry, gear) {
            (Dry::Sticks, Gear::Rigid) if self.yields == Yields::Nowhere => HELD,
            _ => Self { viscosity: tangent, ..*self }.seen_by_link((dry, gear), dt).0,
        }
    }

    /// Inertia (beyond the rotor, where the gear is rigid) and torque that the link feels from motor and gear.
    pub(super) fn seen_by_link(&self, (dry, gear): (Dry, Gear), dt: f64) -> (f64, f64) {
        let (s0, g) = self.spring_law(gear, dt);
        match (self.motor(dry, dt), gear) {
            (Some((inertia, torque)), Gear::Rigid) => (inertia - self.rotor, torque),
            (None, Gear::Rigid) => (0.0, 0.0),
            (Some((inertia, torque)), _) => {
                let share = inertia / (inertia + g);
                (g * share, s0 * share + torque * (1.0 - share))
            }
            (None, _) => (g, s0 - g * self.motor_speed / dt),
        }
    }

    /// Motor acceleration and spring torque that go with a link acceleration.
    pub(super) fn motor_and_gear(&self, (dry, gear): (Dry, Gear), link: f64, dt: f64) -> (f64, f64) {
        let (s0, g) = self.spring_law(gear, dt);
        match self.motor(dry, dt) {
            Some((inertia, drive)) => {
                let torque = (inertia * s0 + g * (drive - inertia * link)) / (inertia + g);
                ((drive - torque) / inertia, torque)
            }
            None => {
                let motor = -self.motor_speed / dt;
                (motor, s0 + g * (motor - link))
            }
        }
    }

    /// The mode that the answer demands; the same one where it contradicts nothing.
    pub(super) fn corrected(
        &self,
        (dry, gear): (Dry, Gear),
        link: f64,
        motor: f64,
        torque: f64,
        dt: f64,
    ) -> (Dry, Gear) {
        let dry = match dry {
            Dry::Slips(sign) if sign * (self.motor_speed + dt * motor) < 0.0 => Dry::Sticks,
            Dry::Sticks if self.yields == Yields::Nowhere => {
                let needed = self.drive - torque - self.rotor * motor;
                if needed.abs() > self.dry { Dry::Slips(needed.signum()) } else { dry }
            }
            Dry::Slips(_) | Dry::Sticks => dry,
        };
        (dry, self.corrected_gear(gear, link, motor, torque, dt))
    }

    fn corrected_gear(&self, gear: Gear, link: f64, motor: f64, torque: f64, dt: f64) -> Gear {
        let Some(spring) = self.spring.filter(|s| s.play > 0.0) else { return gear };
        match gear {
            Gear::Loaded(flank) if flank * torque < 0.0 => Gear::Free,
            Gear::Free => {
                let rate = self.motor_speed - self.link_speed + 0.5 * dt * (motor - link);
                let end = self.twist + dt * rate;
                if end.abs() > 0.5 * spring.play { Gear::Loaded(end.signum()) } else { gear }
            }
            _ => gear,
        }
    }
}
