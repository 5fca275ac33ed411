//! Measured and commanded torques against the arm's model: whether they carry its weight and along which axis of the base
//! ([`import::weight`] owns the fit), their unit, and whether another order or sign of the joints explains them better. A fault that both joint topics share shows here alone.
//!
//! Inverse dynamics of the links: `tau_J = M(q) ddq + c(q, dq) + g(q)`, M without the rotors, which lie before the sensor.

use super::columns::{Columns, between};
use super::limits::{
    ACCELERATION, CARRIES_GRAVITY, LEAST_GRAVITY, NOT_ITS_SLOPE, TORQUE_BETTER, TORQUE_EXPLAINED, TORQUE_LEFT,
    TORQUE_ROWS,
};
use super::remark::{Fault, Remark, Severity, Size};
use super::statistics::mean;
use import::weight::{self, Finding, Weight};
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
    let moments = moments(clip, &clip.measured.t, &clip.measured.tau, arm.dof())?;
    let models: Vec<Model> = moments.iter().map(|moment| model(arm, moment)).collect();
    let column = |j: usize| [moments.iter().map(|m| m.tau[j]).collect(), models.iter().map(|m| m.tau[j]).collect()];
    Some(Beside { t: moments.iter().map(|m| m.t).collect(), joints: (0..arm.dof()).map(column).collect() })
}

/// Remarks on a clip.
pub(super) fn remarks(clip: &Columns, arm: &ArmModel) -> Vec<Remark> {
    let mut found = Vec::new();
    if let Some(moments) = moments(clip, &clip.measured.t, &clip.measured.tau, arm.dof()) {
        found.extend(of_measured(clip, arm, &moments));
    }
    if let Some(moments) = moments(clip, &clip.desired.t, &clip.desired.tau, arm.dof()) {
        let models: Vec<Model> = moments.iter().map(|moment| model(arm, moment)).collect();
        let share = weight(arm, &moments, &models).map(|weight| weight.share(arm.free_fall()));
        found.extend(share.filter(|[share, half]| share - half > CARRIES_GRAVITY).map(|share| with(clip, share)));
    }
    found
}

/// What explains the measured torques where the model does not: joints or the base, whichever leaves less; then units, and weight
/// that is missing.
fn of_measured(clip: &Columns, arm: &ArmModel, moments: &[Moment]) -> Option<Remark> {
    let models: Vec<Model> = moments.iter().map(|moment| model(arm, moment)).collect();
    let falls = arm.free_fall();
    let weight = weight(arm, moments, &models)?;
    let finding = weight.finding(falls);
    let by_weight = by_weight(arm, moments, &models, (&weight, finding));
    if let Some((remark, by_joints)) = otherwise(clip, arm, moments, &models)
        && by_weight.is_none_or(|by_weight| by_joints <= by_weight)
    {
        return Some(remark);
    }
    match finding {
        Finding::Elsewhere => Some(elsewhere(clip, &weight, falls)),
        Finding::Turned(..) => Some(turned(clip, &weight.turned(falls))),
        Finding::Scaled(Some(joint), factor) => Some(of_joint(clip, joint, factor, &weight::meaning(factor))),
        Finding::Scaled(None, factor) => unit(clip, moments, &models, arm.dof())
            .or_else(|| Some(scaled(clip, factor, [factor; 2], &format!(": {}", weight::meaning(factor))))),
        Finding::Absent(_) => Some(without(clip, weight.share(falls))),
        Finding::Noise => Some(noise(clip)),
        Finding::Whole(_) | Finding::Partly(_) | Finding::NotTold => unit(clip, moments, &models, arm.dof()),
    }
}

/// What is left of the torques' squares where they are what their weight says [1]; `None` where it names nothing.
fn by_weight(arm: &ArmModel, moments: &[Moment], models: &[Model], of: (&Weight, Finding)) -> Option<f64> {
    let (weight, finding) = of;
    let scaled = |factor: &dyn Fn(usize) -> f64| {
        let tau = |m: &Moment| std::array::from_fn(|joint| m.tau[joint] / factor(joint));
        let moments: Vec<Moment> = moments.iter().map(|m| Moment { tau: tau(m), ..*m }).collect();
        Some(left(&moments, models, arm.dof()))
    };
    match finding {
        Finding::Elsewhere => {
            let falling = |(moment, model): (&Moment, &Model)| model.falling(arm, moment, weight.pull);
            let leaning: Vec<Model> = moments.iter().zip(models).map(falling).collect();
            Some(left(moments, &leaning, arm.dof()))
        }
        Finding::Turned(..) => {
            let turned = weight.turned(arm.free_fall());
            scaled(&|joint| if turned.iter().any(|(other, _)| *other == joint) { -1.0 } else { 1.0 })
        }
        Finding::Scaled(Some(odd), factor) => scaled(&|joint| if joint == odd { factor } else { 1.0 }),
        Finding::Scaled(None, factor) => scaled(&|_| factor),
        _ => None,
    }
}

/// The weight in torques, beside what the motion needs.
fn weight(arm: &ArmModel, moments: &[Moment], models: &[Model]) -> Option<Weight> {
    let dof = arm.dof();
    let unit = |axis: usize| std::array::from_fn(|k| if k == axis { 1.0 } else { 0.0 });
    let of = |(moment, model): (&Moment, &Model)| weight::Moment {
        tau: moment.tau[..dof].to_vec(),
        motion: (0..dof).map(|j| model.tau[j] - model.gravity[j]).collect(),
        holds: [0, 1, 2].map(|axis| arm.holding(&moment.q, unit(axis))[..dof].to_vec()),
        dq: moment.dq[..dof].to_vec(),
        ddq: moment.ddq[..dof].to_vec(),
    };
    Weight::of(&moments.iter().zip(models).map(of).collect::<Vec<_>>())
}

/// Moments of a clip before anything is pushed: motion of the arm, and torques of a topic; `None` where too little is logged.
fn moments(clip: &Columns, tau_t: &[f64], tau: &[Vec<f64>], dof: usize) -> Option<Vec<Moment>> {
    // Of an arm at rest nobody can tell a placeholder from a torque, but one that holds zeros was never filled in.
    let (motion, untouched) = (&clip.measured, clip.before_contact());
    let filled_in = tau.iter().flatten().any(|tau| *tau != 0.0);
    if tau.len() != dof || motion.dof() != dof || motion.len() < 20 || !filled_in {
        return None;
    }
    let half = ACCELERATION.max(2.0 * motion.step());
    let rows = motion.t.partition_point(|t| *t < untouched);
    let stride = (rows / TORQUE_ROWS).max(1);
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
            // A second difference holds sqrt(6) times the noise of a position. Where that is too much, logged velocities are differenced.
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
    let moments: Vec<Moment> = (0..rows).step_by(stride).filter_map(at).collect();
    (moments.len() >= 20).then_some(moments)
}

fn model(arm: &ArmModel, moment: &Moment) -> Model {
    let gravity = arm.gravity(&moment.q);
    let motion = motion(arm, &JointState { q: moment.q, dq: moment.dq }, &moment.ddq);
    Model { tau: std::array::from_fn(|j| motion[j] + gravity[j]), gravity }
}

/// Torques of the model's motion behind the gears, gravity apart [N m].
pub fn motion(arm: &ArmModel, state: &JointState, ddq: &Joints) -> Joints {
    let (mass, bias, rotor) = (arm.mass_matrix(&state.q), arm.bias(state), arm.rotor_inertia());
    let gravity = arm.gravity(&state.q);
    std::array::from_fn(|j| {
        let inertial: f64 = mass[j].iter().zip(ddq).map(|(m, a)| m * a).sum();
        // The mass matrix holds the rotors, which turn before the gear: a torque behind it does not feel them.
        inertial - rotor[j] * ddq[j] + bias[j] - gravity[j]
    })
}

impl Model {
    /// The same where the base falls another way [m/s^2].
    fn falling(&self, arm: &ArmModel, moment: &Moment, falls: [f64; 3]) -> Self {
        let gravity = arm.holding(&moment.q, falls);
        Self { tau: std::array::from_fn(|j| self.tau[j] - self.gravity[j] + gravity[j]), gravity }
    }
}

/// `share`: of the model's weight, with half its interval.
fn sized(remark: Remark, [share, half]: [f64; 2]) -> Remark {
    remark.sized(Size { value: share, interval: [share - half, share + half], unit: "share of gravity" })
}

/// The base is mounted another way than the model stands.
fn elsewhere(clip: &Columns, weight: &Weight, falls: [f64; 3]) -> Remark {
    let what = format!(
        "measured torques hold a weight that pulls {}, and not as in the model: the base is mounted another way than the model \
         stands{}",
        weight.in_words(),
        weight.doubt(falls)
    );
    let half = weight.half.iter().copied().fold(0.0, f64::max);
    let size = weight.size();
    Remark::new(Fault::GravityDirection, &clip.file, "measured effort", what)
        .sized(Size { value: size, interval: [size - half, size + half], unit: "m/s^2" })
        .mended_by(
            "turn the base in the URDF: a fixed joint between its root link and the base, with the `rpy` at which it is mounted",
        )
}

/// Torques of joints that are counted the other way round, beside others that are not: at least one.
fn turned(clip: &Columns, joints: &[(usize, f64)]) -> Remark {
    let who: Vec<String> = joints.iter().map(|(joint, _)| clip.joint(*joint)).collect();
    let (joint, factor) = joints.first().copied().unwrap_or_default();
    if who.len() == 1 {
        return of_joint(clip, joint, factor, "counted the other way round");
    }
    let what = format!(
        "the measured torques of {} are {factor:.2} times what holds them by the weight that the other joints show: counted the other \
         way round",
        who.join(", ")
    );
    torque_unit(clip, format!("measured effort, {}", who.join(", ")), what, Size::count(factor, "1"))
}

/// The torque of one joint beside the weight that the others show.
fn of_joint(clip: &Columns, joint: usize, factor: f64, meaning: &str) -> Remark {
    let who = clip.joint(joint);
    let what = format!(
        "the measured torque of {who} is {factor:.2} times what holds it by the weight that the other joints show: {meaning}"
    );
    // A load that the model lacks, or a push, makes much of the little weight that a wrist's joint feels.
    torque_unit(clip, format!("measured effort, {who}"), what, Size::count(factor, "1")).weighed(Severity::Warning)
}

fn torque_unit(clip: &Columns, channel: String, what: String, size: Size) -> Remark {
    Remark::new(Fault::TorqueUnit, &clip.file, channel, what)
        .sized(size)
        .mended_by("publish the torque behind the gear in N m, positive in the direction of q")
}

fn noise(clip: &Columns) -> Remark {
    let what = "nothing in the measured torques goes with the motion, neither weight nor friction nor inertia: they are not what moves \
                this arm";
    Remark::new(Fault::TorqueGravity, &clip.file, "measured effort", what)
        .mended_by("log tau_J, or leave effort out of the topic")
}

fn without(clip: &Columns, share: [f64; 2]) -> Remark {
    let what = format!(
        "measured torques carry {:.0} % of the arm's weight by the model, and no weight along any other axis of the base: gravity \
         was taken off before they were logged, so that stiction hides in an offset",
        100.0 * share[0]
    );
    sized(Remark::new(Fault::TorqueGravity, &clip.file, "measured effort", what), share).mended_by(
        "log tau_J with gravity (libfranka `tau_J`, not `tau_ext_hat_filtered`), or leave effort out of the topic",
    )
}

fn with(clip: &Columns, share: [f64; 2]) -> Remark {
    let what = format!(
        "commanded torques carry {:.0} % of the arm's weight by the model: tau_J_d is without gravity",
        100.0 * share[0]
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
    let meaning = format!(": {}", weight::meaning(factor));
    // The standard error of a slope through the origin, by the correlation of its pairs.
    let half = 1.96 * (factor * factor * (1.0 / (correlation * correlation) - 1.0) / pairs().count() as f64).sqrt();
    Some(scaled(clip, factor, [factor - half, factor + half], &meaning))
}

fn scaled(clip: &Columns, factor: f64, interval: [f64; 2], meaning: &str) -> Remark {
    let what = format!("measured torques are {factor:.4} times those of the model{meaning}");
    torque_unit(clip, "measured effort".into(), what, Size { value: factor, interval, unit: "1" })
}

/// Another meaning of the joints.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Other {
    /// The joint counts the other way round, torque included.
    Turned(usize),
    /// The joint's position and velocity alone do.
    PositionTurned(usize),
    /// The joint's torque alone does.
    TorqueTurned(usize),
    /// The two are exchanged.
    Swapped(usize, usize),
    /// The torques of the two are.
    TorquesSwapped(usize, usize),
}

impl Other {
    fn all(dof: usize) -> Vec<Self> {
        let turned = (0..dof).flat_map(|j| [Self::Turned(j), Self::PositionTurned(j), Self::TorqueTurned(j)]);
        let pairs = (0..dof).flat_map(|a| (a + 1..dof).map(move |b| (a, b)));
        turned.chain(pairs.flat_map(|(a, b)| [Self::Swapped(a, b), Self::TorquesSwapped(a, b)])).collect()
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
            Self::TorqueTurned(j) => other.tau[j] = -other.tau[j],
            Self::TorquesSwapped(a, b) => other.tau.swap(a, b),
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

/// The order or sign of the joints that explains torques which the model does not, and what it leaves of them [1].
fn otherwise(clip: &Columns, arm: &ArmModel, moments: &[Moment], models: &[Model]) -> Option<(Remark, f64)> {
    let dof = arm.dof();
    let as_is = left(moments, models, dof);
    let weight = models.iter().map(|m| m.gravity.iter().map(|g| g * g).sum::<f64>()).sum::<f64>();
    if as_is < TORQUE_LEFT || (weight / (models.len() * dof) as f64).sqrt() < LEAST_GRAVITY {
        return None;
    }
    let under = |other: Other| {
        let moments: Vec<Moment> = moments.iter().map(|moment| other.of(moment)).collect();
        if matches!(other, Other::TorqueTurned(_) | Other::TorquesSwapped(..)) {
            return (other, left(&moments, models, dof));
        }
        let models: Vec<Model> = moments.iter().map(|moment| model(arm, moment)).collect();
        (other, left(&moments, &models, dof))
    };
    let (other, better) = Other::all(dof).into_iter().map(under).min_by(|a, b| a.1.total_cmp(&b.1))?;
    let weightless: Vec<Moment> = moments.iter().zip(models).map(|(moment, model)| carrying(moment, model)).collect();
    if better > TORQUE_EXPLAINED.min(TORQUE_BETTER * as_is.min(left(&weightless, models, dof))) {
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
        Other::TorqueTurned(j) => {
            let who = clip.joint(j);
            let said = format!("{leaves} if the torque of {who} is counted the other way round");
            let channel = format!("measured effort, {who}");
            (Fault::TorqueUnit, channel, said, "publish its torque in N m, positive in the direction of q")
        }
        Other::Swapped(a, b) => (
            Fault::JointOrder,
            "joint order".to_owned(),
            format!("{leaves} if {} and {} are exchanged", clip.joint(a), clip.joint(b)),
            "put the names of `[robot] joints` or of the topics into the order of their columns",
        ),
        Other::TorquesSwapped(a, b) => (
            Fault::JointOrder,
            "measured effort".to_owned(),
            format!("{leaves} if the torques of {} and {} are exchanged", clip.joint(a), clip.joint(b)),
            "put the torques into the order of the positions",
        ),
    };
    let remark = Remark::new(fault, &clip.file, channel, what)
        .sized(Size { value: as_is, interval: [better, as_is], unit: "share of tau^2" })
        .mended_by(remedy);
    Some((remark, better))
}
