//! The arm's step in time where torque is lost or stored between motor and link: dry friction that sticks exactly, gears
//! that yield or have play. Called by the effects; an arm with ideal joints steps in [`super::step`].
//!
//! Motor `B db = drive - f - s`, links `M a = s + external - bias`, with `f` the dry friction at the motor and `s` the
//! torque behind the gear. A rigid gear moves motor and link as one. A gear that yields is a spring over the twist
//! `motor - link`; its force is taken implicitly, so no stiffness is too high for the step. Dry friction is a bound:
//! whatever up to it brings the motor to rest or keeps it there, the bound itself against the motion otherwise. A joint that
//! creeps under it does not rest: its friction is `bound tanh(speed / creep)` at the end of the step, found by secants. So is
//! that of a joint whose bristles bend before it slips ([`Presliding`]). Which of the two holds in which joint is found by
//! least-index pivoting (Murty 1974), which ends because `M` is positive definite. Explicit midpoint rule around it, as in
//! [`super::step`].
#![allow(non_snake_case)] // tau_J is the Franka Control Interface's own symbol

mod side;

use super::dry_friction::{Presliding, Yields};
use super::kernel::{Chain, factor, first, solve, with_dof};
use super::{ArmModel, JointState, Joints};
use side::{Dry, Gear, Side};

/// A gear that yields.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spring {
    /// Torque per twist [N m/rad].
    pub stiffness: f64,
    /// Torque per rate of twist [N m s/rad].
    pub damping: f64,
    /// Twist from one flank to the other without any torque [rad].
    pub play: f64,
}

/// How a motor moves against dry friction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Slip {
    /// Position [rad].
    pub q: f64,
    /// Speed [rad/s], at least 0.
    pub speed: f64,
    /// Torque of the motor [N m].
    pub motor_torque: f64,
}

/// What lies between the motors and the links.
pub trait Transmission {
    /// How the gear of a joint yields; `None` where it is rigid.
    fn spring(&self, joint: usize) -> Option<Spring>;

    /// Largest dry friction of a joint [N m].
    fn dry_friction(&self, joint: usize, slip: Slip) -> f64;

    /// Motor speed at which dry friction is `tanh(1)` of its bound [rad/s]; 0 where a joint sticks exactly.
    fn creep(&self, joint: usize) -> f64;

    /// How a joint's dry friction builds up, in place of creep; `None` where it needs no way for that.
    fn presliding(&self, joint: usize) -> Option<Presliding>;

    /// Torque that a motor loses otherwise [N m], at its position [rad] and velocity [rad/s].
    fn drag(&self, joint: usize, q: f64, dq: f64) -> f64;
}

/// Pivots before the last pattern is kept: seven joints need at most a dozen.
const PIVOTS: usize = 40;
/// Secants to the friction of a joint that yields: each halves what the one before left, or better.
const SECANTS: usize = 5;
/// The speed of a joint that yields is known at the end of the step when it changes the friction by less than this share.
const SETTLED: f64 = 1e-4;
/// Inertia of a link that weighs nothing, as seen by a gear that yields [kg m²].
const LEAST_INERTIA: f64 = 1e-6;

/// The links' equations at one state: lower triangle of the mass matrix, rotors on its diagonal, and the torques that
/// gravity and velocities ask for.
struct Equations<const N: usize> {
    mass: [[f64; N]; N],
    bias: [f64; N],
}

impl<const N: usize> Equations<N> {
    fn stage(&self, sides: [Side; N], external: &Joints, dt: f64) -> Stage<N> {
        let mut mass = self.mass;
        for i in 0..N {
            if sides[i].spring.is_some() {
                mass[i][i] = (mass[i][i] - sides[i].rotor).max(LEAST_INERTIA);
            }
        }
        Stage { dt, mass, force: std::array::from_fn(|i| external[i] - self.bias[i]), sides }
    }
}

/// Equations of one stage of length `dt`: everything but the unknown accelerations.
struct Stage<const N: usize> {
    dt: f64,
    /// Lower triangle, rotors of rigid joints on the diagonal.
    mass: [[f64; N]; N],
    /// External torque less bias.
    force: [f64; N],
    sides: [Side; N],
}

/// What came through the joints in a step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Passed {
    /// Mean torque behind the gears [N m].
    pub tau_J: Joints,
    /// What a joint resists a further torque at its link with over such a step, beyond its inertia without a gear that
    /// yields [kg m²]: friction that grows with the motion, and the rotor behind a spring.
    pub grip: Joints,
}

/// Accelerations of links and motors, and the torque behind the gears.
struct Answer<const N: usize> {
    link: [f64; N],
    motor: [f64; N],
    gear: [f64; N],
}

impl ArmModel {
    /// Moves `link` and `motor` on by `dt` seconds under constant motor torques `tau` and external torques at the links,
    /// and returns the mean torque behind the gears. Where the gear is rigid, `motor` follows `link`. `bent`: by what share of
    /// what they can the bristles of [`Presliding`] are bent, -1 to 1.
    ///
    /// In `parts` > 1 what lies between motor and link is integrated in so many steps, and the links' inertia and bias are those
    /// of the middle of `dt`: what they change by before and after it cancels to the second order.
    pub fn step_through(
        &self,
        transmission: &impl Transmission,
        (link, motor, bent): (&mut JointState, &mut JointState, &mut Joints),
        (tau, external): (&Joints, &Joints),
        (dt, parts): (f64, usize),
    ) -> Passed {
        with_dof!(self, N => {
            let part = dt / parts as f64;
            let beginning = self.equations::<N>(link);
            let middle_of_all = (parts > 1).then(|| {
                let sides = self.sides::<N>(transmission, (link, motor, bent), (motor, tau), 0.5 * part);
                let began = beginning.stage(sides, external, 0.5 * part).answer(&mut None);
                self.equations(&middle(link, &began.link, dt))
            });
            let mut whole = Passed::default();
            for _ in 0..parts {
                let sides = |at: &JointState, dt: f64| self.sides::<N>(transmission, (link, motor, bent), (at, tau), dt);
                let mut modes = None;
                let equations = middle_of_all.as_ref().unwrap_or(&beginning);
                let half = equations.stage(sides(motor, 0.5 * part), external, 0.5 * part).answer(&mut modes);
                let sides = sides(&middle(motor, &half.motor, part), part);
                let mut stage = match &middle_of_all {
                    Some(equations) => equations.stage(sides, external, part),
                    None => self.equations(&middle(link, &half.link, part)).stage(sides, external, part),
                };
                let answer = stage.answer(&mut modes);
                let modes = modes.expect("an answer leaves its pattern");
                let passed = stage.carry_out((&answer, modes), (&mut *link, &mut *motor, &mut *bent));
                whole.grip = passed.grip;
                whole.tau_J.iter_mut().zip(passed.tau_J).for_each(|(mean, torque)| *mean += torque / parts as f64);
            }
            whole
        })
    }

    fn sides<const N: usize>(
        &self,
        transmission: &impl Transmission,
        (link, motor, bent): (&JointState, &JointState, &Joints),
        (at, tau): (&JointState, &Joints),
        dt: f64,
    ) -> [Side; N] {
        let side = |i: usize| Side {
            held: 0.0,
            viscosity: 0.0,
            link_speed: link.dq[i],
            motor_speed: motor.dq[i],
            twist: motor.q[i] - link.q[i],
            rotor: self.links[i].rotor,
            drive: tau[i] - transmission.drag(i, at.q[i], at.dq[i]),
            dry: transmission.dry_friction(i, Slip { q: at.q[i], speed: at.dq[i].abs(), motor_torque: tau[i] }),
            yields: Yields::of(transmission.creep(i), transmission.presliding(i), bent[i]),
            // Without a rotor nothing could turn on the motor's side of a spring.
            spring: transmission.spring(i).filter(|_| self.links[i].rotor > 0.0),
        };
        // At the end of the step, as far as `at` tells: where that is right, the friction is found at once.
        std::array::from_fn(|i| side(i).yielding_at(2.0 * at.dq[i] - motor.dq[i], dt))
    }

    fn equations<const N: usize>(&self, at: &JointState) -> Equations<N> {
        let links = first::<N, _>(&self.links);
        let chain = Chain::at(links, first(&at.q));
        let bodies = chain.bodies(links);
        Equations { mass: chain.mass_matrix(&bodies, links), bias: chain.bias(&bodies, first(&at.dq), self.gravity) }
    }
}

/// Half a step of `dt` further at constant acceleration, positions by the speed of the begin.
fn middle<const N: usize>(state: &JointState, acceleration: &[f64; N], dt: f64) -> JointState {
    let mut out = *state;
    for (i, acceleration) in acceleration.iter().enumerate() {
        out.q[i] += 0.5 * dt * state.dq[i];
        out.dq[i] += 0.5 * dt * acceleration;
    }
    out
}

/// Moves joint `i` with constant acceleration; one that stops, stops exactly.
fn advance(state: &mut JointState, i: usize, acceleration: f64, stops: bool, dt: f64) {
    let before = state.dq[i];
    state.dq[i] = if stops { 0.0 } else { before + dt * acceleration };
    state.q[i] += 0.5 * dt * (before + state.dq[i]);
}

impl<const N: usize> Stage<N> {
    /// Moves links, motors and bristles on by what was answered; what came through the joints meanwhile.
    fn carry_out(
        &self,
        (answer, modes): (&Answer<N>, [(Dry, Gear); N]),
        (link, motor, bent): (&mut JointState, &mut JointState, &mut Joints),
    ) -> Passed {
        let mut passed = Passed::default();
        for (i, (dry, gear)) in modes.into_iter().enumerate() {
            let side = &self.sides[i];
            let sticks = dry == Dry::Sticks && side.yields == Yields::Nowhere;
            bent[i] = side.yields.bent((side.motor_speed, side.motor_speed + self.dt * answer.motor[i]), self.dt);
            advance(link, i, answer.link[i], sticks && gear == Gear::Rigid, self.dt);
            match gear {
                Gear::Rigid => (motor.q[i], motor.dq[i]) = (link.q[i], link.dq[i]),
                _ => advance(motor, i, answer.motor[i], sticks, self.dt),
            }
            passed.tau_J[i] = answer.gear[i];
            passed.grip[i] = side.grip(modes[i], answer.motor[i], self.dt);
        }
        passed
    }

    /// Solves for the pattern and for the speeds of joints that yield.
    fn answer(&mut self, modes: &mut Option<[(Dry, Gear); N]>) -> Answer<N> {
        let mut answer = self.pattern(modes);
        for _ in 0..SECANTS {
            let mut settled = true;
            for (side, motor) in self.sides.iter_mut().zip(&answer.motor) {
                let speed = side.motor_speed + self.dt * motor;
                let before = side.viscosity;
                *side = side.yielding_at(speed, self.dt);
                // What the friction was taken for, in speeds, differs by this much from what it is.
                settled &= ((side.viscosity - before) * speed).abs() <= SETTLED * side.dry;
            }
            if settled {
                break;
            }
            answer = self.pattern(modes);
        }
        answer
    }

    /// Solves for the pattern of sticking and loaded joints that contradicts itself nowhere, starting from `modes`.
    fn pattern(&self, modes: &mut Option<[(Dry, Gear); N]>) -> Answer<N> {
        let modes = modes.get_or_insert_with(|| self.sides.map(|side| side.likely()));
        let mut answer = self.solve(modes);
        for _ in 0..PIVOTS {
            let wrong = (0..N).find_map(|i| {
                let mode = self.sides[i].corrected(modes[i], answer.link[i], answer.motor[i], answer.gear[i], self.dt);
                (mode != modes[i]).then_some((i, mode))
            });
            let Some((i, mode)) = wrong else { break };
            modes[i] = mode;
            answer = self.solve(modes);
        }
        answer
    }

    fn solve(&self, modes: &[(Dry, Gear); N]) -> Answer<N> {
        let mut mass = self.mass;
        let mut force = self.force;
        let locked: [Option<f64>; N] = std::array::from_fn(|i| {
            let side = &self.sides[i];
            (modes[i] == (Dry::Sticks, Gear::Rigid) && side.yields == Yields::Nowhere)
                .then_some(-side.link_speed / self.dt)
        });
        for i in 0..N {
            let (inertia, torque) = self.sides[i].seen_by_link(modes[i], self.dt);
            mass[i][i] += inertia;
            force[i] += torque;
        }
        let symmetric = |i: usize, j: usize| if j <= i { mass[i][j] } else { mass[j][i] };
        let (mut reduced, mut right) = (mass, force);
        for (j, acceleration) in locked.iter().enumerate().filter_map(|(j, a)| a.map(|a| (j, a))) {
            for i in (0..N).filter(|&i| i != j) {
                right[i] -= symmetric(i, j) * acceleration;
                reduced[i.max(j)][i.min(j)] = 0.0;
            }
            reduced[j][j] = 1.0;
        }
        for (right, acceleration) in right.iter_mut().zip(locked) {
            *right = acceleration.unwrap_or(*right);
        }
        factor(&mut reduced);
        let link = solve(&reduced, &right);
        let passed = |i: usize| (0..N).map(|j| symmetric(i, j) * link[j]).sum::<f64>() - self.force[i];
        let mut answer = Answer { link, motor: link, gear: [0.0; N] };
        for i in 0..N {
            let side = &self.sides[i];
            (answer.motor[i], answer.gear[i]) = match modes[i].1 {
                // The diagonal holds the rotor and what friction that yields adds to it, which lie before the gear.
                Gear::Rigid => (link[i], passed(i) - (side.rotor + side.seen_by_link(modes[i], self.dt).0) * link[i]),
                _ => side.motor_and_gear(modes[i], link[i], self.dt),
            };
        }
        answer
    }
}
