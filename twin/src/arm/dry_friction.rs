//! How a joint gives way to a load within its dry friction, and the friction that goes with it over a stage of a step in time.
//! Called by [`super::transmission`], which takes it as a torque at rest and a secant over the speed at the stage's end.

/// Dry friction that builds up over a way instead of at once, as bristles that bend: Dahl's law with the micro-damping of LuGre,
/// `dw/dt = (dq - |dq| w) / displacement`, friction `bound w + damping displacement dw/dt`. `w`, from -1 to 1, is the share
/// of what they can by which the bristles are bent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Presliding {
    /// Way over which all but `exp(-1)` of the bound builds up [rad].
    pub displacement: f64,
    /// Torque per rate at which the bristles bend [N m s/rad].
    pub damping: f64,
}

/// How a joint gives way to a load within its dry friction.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Yields {
    /// It does not: it sticks.
    Nowhere,
    /// At a speed: friction is `bound tanh(speed / creep)` [rad/s].
    Creeping(f64),
    /// By bristles, with the `w` at the begin of the stage.
    Bending(Presliding, f64),
}

/// A slower motion is none, where a secant would be divided by it [rad/s].
const LEAST_SPEED: f64 = 1e-9;

impl Yields {
    /// Of a joint that creeps [rad/s] or whose bristles are bent.
    pub(super) fn of(creep: f64, presliding: Option<Presliding>, bent: f64) -> Self {
        match presliding {
            Some(presliding) if presliding.displacement > 0.0 => Self::Bending(presliding, bent),
            _ if creep > 0.0 => Self::Creeping(creep),
            _ => Self::Nowhere,
        }
    }

    /// Friction at the end of a stage of `dt`, as what it would be at rest [N m] and the secant from there [N m s/rad] to the
    /// second of the `speeds`: those at the begin and at the end of the stage.
    pub(super) fn secant(self, bound: f64, (before, after): (f64, f64), dt: f64) -> (f64, f64) {
        match self {
            Self::Nowhere => (0.0, 0.0),
            Self::Creeping(creep) if after.abs() < 1e-3 * creep => (0.0, bound / creep),
            Self::Creeping(creep) => (0.0, bound * (after / creep).tanh() / after),
            Self::Bending(presliding, bent) => {
                let friction = |speed: f64| presliding.friction(bound, bent, 0.5 * (before + speed), dt);
                let held = friction(0.0);
                let viscosity = if after.abs() < LEAST_SPEED {
                    self.tangent(bound, (before, 0.0), dt)
                } else {
                    (friction(after) - held) / after
                };
                (held, viscosity)
            }
        }
    }

    /// The slope of the friction over the speed at the end of the stage [N m s/rad].
    pub(super) fn tangent(self, bound: f64, (before, after): (f64, f64), dt: f64) -> f64 {
        match self {
            Self::Nowhere => 0.0,
            Self::Creeping(creep) => bound / creep * (1.0 - (after / creep).tanh().powi(2)),
            Self::Bending(presliding, bent) => {
                let slope = 0.5 * presliding.slope(bent, 0.5 * (before + after), dt);
                (bound + presliding.damping * presliding.displacement / dt) * slope
            }
        }
    }

    /// `w` of the bristles at the end of the stage; 0 without any.
    pub(super) fn bent(self, (before, after): (f64, f64), dt: f64) -> f64 {
        match self {
            Self::Bending(presliding, bent) => presliding.bent(bent, 0.5 * (before + after), dt),
            Self::Nowhere | Self::Creeping(_) => 0.0,
        }
    }
}

impl Presliding {
    /// `w` after `dt` at a constant speed, the law's own solution.
    fn bent(self, before: f64, speed: f64, dt: f64) -> f64 {
        let end = if speed == 0.0 { before } else { speed.signum() };
        end + (before - end) * (-speed.abs() * dt / self.displacement).exp()
    }

    /// The derivative of that by the speed [s/rad].
    fn slope(self, before: f64, speed: f64, dt: f64) -> f64 {
        let sign = if speed == 0.0 { 0.0 } else { speed.signum() };
        (1.0 - before * sign) * dt / self.displacement * (-speed.abs() * dt / self.displacement).exp()
    }

    /// Friction after `dt` at a constant speed [N m].
    fn friction(self, bound: f64, before: f64, speed: f64, dt: f64) -> f64 {
        let after = self.bent(before, speed, dt);
        bound * after + self.damping * self.displacement * (after - before) / dt
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BRISTLES: Presliding = Presliding { displacement: 1e-3, damping: 0.5 };

    #[test]
    fn the_secant_meets_the_friction_at_both_its_ends() {
        for bent in [-0.9, 0.0, 0.4, 1.0] {
            for after in [-0.3, -1e-4, 2e-3, 0.5] {
                let (before, dt, bound) = (0.02, 1e-3, 0.8);
                let yields = Yields::of(0.0, Some(BRISTLES), bent);
                let (held, viscosity) = yields.secant(bound, (before, after), dt);
                let friction = BRISTLES.friction(bound, bent, 0.5 * (before + after), dt);
                assert!((held + viscosity * after - friction).abs() < 1e-12, "{bent} {after}");
                let step = 1e-6;
                let at = |speed: f64| BRISTLES.friction(bound, bent, 0.5 * (before + speed), dt);
                let slope = (at(after + step) - at(after - step)) / (2.0 * step);
                let tangent = yields.tangent(bound, (before, after), dt);
                assert!((tangent - slope).abs() < 1e-4 * (1.0 + slope.abs()), "{tangent} {slope}");
            }
        }
    }
}
