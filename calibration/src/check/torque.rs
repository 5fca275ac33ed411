//! Measured and commanded torques against the arm's model: whether they carry its weight, their unit, and whether another order
//! or sign of the joints explains them better. A fault that both joint topics share shows here alone.
//!
//! Inverse dynamics of the links: `tau_J = M(q) ddq + c(q, dq) + g(q)`, M without the rotors, which lie before the sensor.

use super::columns::{Columns, Signals, between};
use super::conversion;
use super::limits::{
    ACCELERATION, BLOCK, CARRIES_GRAVITY, LEAST_GRAVITY, NOT_ITS_SLOPE, TORQUE_BETTER, TORQUE_LEFT, TORQUE_ROWS,
};
use super::remark::{Fault, Remark, Size};
use super::statistics::{deviation, mean};
use crate::estimate::interval::student_95;
use shared_mem::msg::{Joints, MAX_JOINTS};
use twin::arm::{ArmModel, JointState};

/// Correlation with the model at which torques are the model's but for a factor [1].
const OF_THE_MODEL: f64 = 0.97;

/// An acceleration from positions is too noisy beyond this, and is taken from velocities [rad/s²].
const COARSE: f64 = 0.5;

/// Motion and torque of one moment.
#[derive(Debug, Clone, Copy)]
struct Moment {
    t: f64,
    q: Joints,
    dq: Joints,
    ddq: Joints,
    tau: Joints,
}

/// What the model says at one moment [N m].
#[derive(Debug, Clone, Copy)]
struct Model {
    /// The whole torque behind the gears.
    tau: Joints,
    /// The part that carries the arm.
    gravity: Joints,
}

/// The torques of a clip and those of the model, for a picture.
#[derive(Debug, Clone, Default)]
pub(super) struct Beside {
    pub(super) t: Vec<f64>,
    /// By joint: measured and model [N m].
    pub(super) joints: Vec<[Vec<f64>; 2]>,
}

/// Measured torques and the model's.
pub(super) fn beside(clip: &Columns, arm: &ArmModel) -> Option<Beside> {
    let moments = moments(&clip.measured, &clip.measured.t, &clip.measured.tau, arm.dof())?;
    let models: Vec<Model> = moments.iter().map(|moment| model(arm, moment)).collect();
    let column = |j: usize| [moments.iter().map(|m| m.tau[j]).collect(), models.iter().map(|m| m.tau[j]).collect()];
    Some(Beside { t: moments.iter().map(|m| m.t).collect(), joints: (0..arm.dof()).map(column).collect() })
}

/// Remarks on a clip.
pub(super) fn remarks(clip: &Columns, arm: &ArmModel) -> Vec<Remark> {
    let mut found = Vec::new();
    if let Some(moments) = moments(&clip.measured, &clip.measured.t, &clip.measured.tau, arm.dof()) {
        let models: Vec<Model> = moments.iter().map(|moment| model(arm, moment)).collect();
        let other = otherwise(clip, arm, &moments, &models);
        let share = shares(&moments, &models, arm.dof()).filter(|share| share.value + share.half < CARRIES_GRAVITY);
        let weightless = || share.map(|share| without(clip, share));
        found.extend(unit(clip, &moments, &models, arm.dof()).or(other).or_else(weightless));
    }
    if let Some(moments) = moments(&clip.measured, &clip.desired.t, &clip.desired.tau, arm.dof()) {
        let models: Vec<Model> = moments.iter().map(|moment| model(arm, moment)).collect();
        let share = shares(&moments, &models, arm.dof());
        found.extend(share.filter(|share| share.value - share.half > CARRIES_GRAVITY).map(|share| with(clip, share)));
    }
    found
}

/// Moments of a clip: motion of the arm, and torques of a topic; `None` where too little is logged.
fn moments(motion: &Signals, tau_t: &[f64], tau: &[Vec<f64>], dof: usize) -> Option<Vec<Moment>> {
    // Of an arm at rest nobody can tell a placeholder from a torque, but one that holds zeros was never filled in.
    let filled_in = tau.iter().flatten().any(|tau| *tau != 0.0);
    if tau.len() != dof || motion.dof() != dof || motion.len() < 20 || !filled_in {
        return None;
    }
    let half = ACCELERATION.max(2.0 * motion.step());
    let stride = (motion.len() / TORQUE_ROWS).max(1);
    let at = |row: usize| -> Option<Moment> {
        let t = motion.t[row];
        let (mut q, mut dq, mut ddq, mut out) =
            ([0.0; MAX_JOINTS], [0.0; MAX_JOINTS], [0.0; MAX_JOINTS], [0.0; MAX_JOINTS]);
        for j in 0..dof {
            let [before, now, after] = [t - half, t, t + half].map(|at| motion.q_at(j, at));
            let (before, now, after) = (before?, now?, after?);
            let slope = |at: f64| motion.dq.get(j).and_then(|dq| between(&motion.t, dq, at));
            q[j] = now;
            dq[j] = (after - before) / (2.0 * half);
            let bend = (after - 2.0 * now + before) / (half * half);
            let coarse = 2.5 * motion.noise[j] / (half * half) > COARSE;
            ddq[j] = match slope(t - half).zip(slope(t + half)) {
                Some((from, to)) if coarse => (to - from) / (2.0 * half),
                _ => bend,
            };
            // The mean over the same time, so that noise and ripple do not count.
            let around: Vec<f64> =
                (-3..=3).filter_map(|k| between(tau_t, &tau[j], t + f64::from(k) * half / 3.0)).collect();
            out[j] = if around.is_empty() { return None } else { mean(&around) };
        }
        Some(Moment { t, q, dq, ddq, tau: out })
    };
    let moments: Vec<Moment> = (0..motion.len()).step_by(stride).filter_map(at).collect();
    (moments.len() >= 20).then_some(moments)
}

fn model(arm: &ArmModel, moment: &Moment) -> Model {
    let state = JointState { q: moment.q, dq: moment.dq };
    let (mass, bias, rotor) = (arm.mass_matrix(&moment.q), arm.bias(&state), arm.rotor_inertia());
    let tau = std::array::from_fn(|j| {
        let inertial: f64 = mass[j].iter().zip(&moment.ddq).map(|(m, a)| m * a).sum();
        inertial - rotor[j] * moment.ddq[j] + bias[j]
    });
    Model { tau, gravity: arm.gravity(&moment.q) }
}

/// A share with half its 95 % interval [1].
#[derive(Debug, Clone, Copy)]
struct Share {
    value: f64,
    half: f64,
}

/// The share of the model's gravity that torques carry; `None` where gravity is small.
fn shares(moments: &[Moment], models: &[Model], dof: usize) -> Option<Share> {
    let sums = |from: usize, to: usize| {
        let rows = moments[from..to].iter().zip(&models[from..to]);
        rows.fold([0.0, 0.0], |[gt, gg], (moment, model)| {
            let each = (0..dof).map(|j| {
                let g = model.gravity[j];
                [g * (moment.tau[j] - model.tau[j] + g), g * g]
            });
            each.fold([gt, gg], |[gt, gg], [a, b]| [gt + a, gg + b])
        })
    };
    let [gt, gg] = sums(0, moments.len());
    if (gg / (moments.len() * dof) as f64).sqrt() < LEAST_GRAVITY {
        return None;
    }
    let span = moments.last()?.t - moments.first()?.t;
    let blocks = ((span / BLOCK) as usize).clamp(2, moments.len() / 4);
    let length = moments.len().div_ceil(blocks);
    let parts: Vec<f64> = (0..moments.len())
        .step_by(length)
        .map(|from| sums(from, (from + length).min(moments.len())))
        .filter(|[_, gg]| *gg > 0.0)
        .map(|[gt, gg]| gt / gg)
        .collect();
    let half = student_95(parts.len().saturating_sub(1)) * deviation(&parts) / (parts.len() as f64).sqrt();
    Some(Share { value: gt / gg, half })
}

fn sized(remark: Remark, share: Share) -> Remark {
    remark.sized(Size {
        value: share.value,
        interval: [share.value - share.half, share.value + share.half],
        unit: "share of gravity",
    })
}

fn without(clip: &Columns, share: Share) -> Remark {
    let what = format!(
        "measured torques carry {:.0} % of the arm's weight by the model: gravity was taken off before they were logged, so that \
         stiction hides in an offset",
        100.0 * share.value
    );
    sized(Remark::new(Fault::TorqueGravity, &clip.file, "measured effort", what), share).mended_by(
        "log tau_J with gravity (libfranka `tau_J`, not `tau_ext_hat_filtered`), or leave effort out of the topic",
    )
}

fn with(clip: &Columns, share: Share) -> Remark {
    let what = format!(
        "commanded torques carry {:.0} % of the arm's weight by the model: tau_J_d is without gravity",
        100.0 * share.value
    );
    sized(Remark::new(Fault::TorqueGravity, &clip.file, "desired effort", what), share).mended_by(
        "log what the controller asks for without the gravity that the robot adds, or leave effort out of the topic",
    )
}

/// Torques that are the model's but for a factor.
fn unit(clip: &Columns, moments: &[Moment], models: &[Model], dof: usize) -> Option<Remark> {
    let pairs =
        || moments.iter().zip(models).flat_map(|(moment, model)| (0..dof).map(|j| (moment.tau[j], model.tau[j])));
    let (tt, tm, mm) = pairs().fold((0.0, 0.0, 0.0), |(a, b, c), (t, m)| (a + t * t, b + t * m, c + m * m));
    let (factor, correlation) = (tm / mm, tm / (tt * mm).sqrt());
    let off = factor < NOT_ITS_SLOPE || factor > NOT_ITS_SLOPE.recip();
    if !correlation.is_finite()
        || correlation.abs() < OF_THE_MODEL
        || !off
        || (mm / (moments.len() * dof) as f64).sqrt() < LEAST_GRAVITY
    {
        return None;
    }
    let meaning = match conversion::known(factor) {
        Some((_, what)) if what.contains("unit") => format!(": {what}"),
        _ if (factor + 1.0).abs() < 0.5 => ": counted the other way round".into(),
        _ => String::new(),
    };
    let half = 1.96 * (factor * factor * (1.0 / (correlation * correlation) - 1.0) / pairs().count() as f64).sqrt();
    Some(
        Remark::new(
            Fault::TorqueUnit,
            &clip.file,
            "measured effort",
            format!("measured torques are {factor:.4} times those of the model{meaning}"),
        )
        .sized(Size { value: factor, interval: [factor - half, factor + half], unit: "1" })
        .mended_by("publish the torque behind the gear in N m, positive in the direction of q"),
    )
}

/// Another meaning of the joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Other {
    /// The joint counts the other way round, torque included.
    Turned(usize),
    /// The joint's position and velocity alone do.
    PositionTurned(usize),
    /// The two are exchanged.
    Swapped(usize, usize),
}

impl Other {
    fn all(dof: usize) -> Vec<Self> {
        let turned = (0..dof).flat_map(|j| [Self::Turned(j), Self::PositionTurned(j)]);
        turned.chain((0..dof).flat_map(|a| (a + 1..dof).map(move |b| Self::Swapped(a, b)))).collect()
    }

    fn of(self, moment: &Moment) -> Moment {
        let mut other = *moment;
        match self {
            Self::Turned(j) | Self::PositionTurned(j) => {
                for joints in [&mut other.q, &mut other.dq, &mut other.ddq] {
                    joints[j] = -joints[j];
                }
                if matches!(self, Self::Turned(_)) {
                    other.tau[j] = -other.tau[j];
                }
            }
            Self::Swapped(a, b) => {
                for joints in [&mut other.q, &mut other.dq, &mut other.ddq, &mut other.tau] {
                    joints.swap(a, b);
                }
            }
        }
        other
    }
}

/// Share of the torques' squares that the model leaves.
fn left(moments: &[Moment], models: &[Model], dof: usize) -> f64 {
    let sums = moments.iter().zip(models).flat_map(|(moment, model)| {
        (0..dof).map(move |j| [(moment.tau[j] - model.tau[j]).powi(2), moment.tau[j].powi(2)])
    });
    let [off, all] = sums.fold([0.0, 0.0], |[a, b], [c, d]| [a + c, b + d]);
    off / all.max(1e-12)
}

/// A moment whose torques carry the arm after all.
fn carrying(moment: &Moment, model: &Model) -> Moment {
    let tau = std::array::from_fn(|j| moment.tau[j] + model.gravity[j]);
    Moment { tau, ..*moment }
}

/// The order or sign of the joints that explains torques which the model does not.
fn otherwise(clip: &Columns, arm: &ArmModel, moments: &[Moment], models: &[Model]) -> Option<Remark> {
    let dof = arm.dof();
    let as_is = left(moments, models, dof);
    let weight = models.iter().map(|m| m.gravity.iter().map(|g| g * g).sum::<f64>()).sum::<f64>();
    if as_is < TORQUE_LEFT || (weight / (models.len() * dof) as f64).sqrt() < LEAST_GRAVITY {
        return None;
    }
    let under = |other: Other| {
        let moments: Vec<Moment> = moments.iter().map(|moment| other.of(moment)).collect();
        let models: Vec<Model> = moments.iter().map(|moment| model(arm, moment)).collect();
        (other, left(&moments, &models, dof))
    };
    let (other, better) = Other::all(dof).into_iter().map(under).min_by(|a, b| a.1.total_cmp(&b.1))?;
    let weightless: Vec<Moment> = moments.iter().zip(models).map(|(moment, model)| carrying(moment, model)).collect();
    if better > TORQUE_BETTER * as_is.min(left(&weightless, models, dof)) {
        return None;
    }
    let [before, after] = [as_is, better].map(|share| 100.0 * share);
    let leaves = format!("the model leaves {before:.1} % of the torques' squares, and {after:.1} %");
    let (fault, channel, what, remedy) = match other {
        Other::Turned(j) | Other::PositionTurned(j) => {
            let what = if other == Other::Turned(j) { "is counted" } else { "has its position counted" };
            let who = clip.joint(j);
            let said = format!("{leaves} if {who} {what} the other way round");
            (Fault::JointSign, who, said, "turn the joint's sign in the driver, or its axis in the URDF")
        }
        Other::Swapped(a, b) => (
            Fault::JointOrder,
            "joint order".to_owned(),
            format!("{leaves} if {} and {} are exchanged", clip.joint(a), clip.joint(b)),
            "put the names of `[robot] joints` or of the topics into the order of their columns",
        ),
    };
    Some(
        Remark::new(fault, &clip.file, channel, what)
            .sized(Size { value: as_is, interval: [better, as_is], unit: "share of tau^2" })
            .mended_by(remedy),
    )
}
