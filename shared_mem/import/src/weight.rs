//! The arm's weight in its torques: along which axis of the base it pulls and how strongly, fitted before anything is said about
//! what torques hold. Torques are linear in the acceleration of free fall, so this is a least-squares fit over all joints of three
//! numbers and of how many times the torque of the model's motion is in them, with bias, friction and a joint's own inertia as
//! numbers of each joint that nobody asks for. Motion tells a base that hangs from torques that are counted the other way round.

mod fit;

use fit::{Columns, NORMAL_95, Witness, distance, dot, fit, own_pull, product};
use std::f64::consts::FRAC_PI_6;

/// One moment of an arm.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Moment {
    /// Torque of each joint [N m].
    pub tau: Vec<f64>,
    /// Torques that hold the model for 1 m/s² of free fall along the base's x, y and z, joint by joint [kg m].
    pub holds: [Vec<f64>; 3],
    /// Torques of the model's motion without gravity [N m]; empty where nobody knows them.
    pub motion: Vec<f64>,
    /// Velocity of each joint [rad/s].
    pub dq: Vec<f64>,
    /// Acceleration of each joint [rad/s²].
    pub ddq: Vec<f64>,
}

/// What the torques say about the weight.
#[derive(Debug, Clone, PartialEq)]
pub struct Weight {
    /// Acceleration of free fall in the base frame that explains the torques best [m/s²].
    pub pull: [f64; 3],
    /// Half its 95 % interval [m/s²].
    pub half: [f64; 3],
    /// Share of the torques' squares, bias and friction taken off, that it explains [1].
    pub explained: f64,
    covariance: [[f64; 3]; 3],
    /// How many times the torque of the model's motion is in them, with one sigma [1].
    pace: [f64; 2],
    /// Whether friction, inertia or weight shows in any joint: torques that nobody measured have none.
    lively: bool,
    joints: Vec<Witness>,
}

/// What that means, held against the model's own free fall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Finding {
    /// The torques hold the weight of the model; the share of it.
    Whole(f64),
    /// Nothing that looks like weight is left in them, along no axis; the share of the model's.
    Absent(f64),
    /// Neither weight nor anything that goes with the motion: the arm's torques were not measured.
    Noise,
    /// The weight pulls another way than the model's.
    Elsewhere,
    /// The torque of this joint, the first of [`Weight::turned`], is so many times the model's, its sign turned; that of others is
    /// not.
    Turned(usize, f64),
    /// The torque of this joint, or of all, is so many times the model's; fewer than none where all are turned.
    Scaled(Option<usize>, f64),
    /// Neither all of it nor none; the share of the model's.
    Partly(f64),
    /// The motion does not tell it.
    NotTold,
}

/// Fewer moments say nothing.
const FEWEST: usize = 20;

/// Shares of the model's weight that are all of it, and none: a load of a kilogram that is not in the model, or a link of other
/// mass, moves them by less.
const ALL: std::ops::Range<f64> = 0.6..1.5;
const NONE: f64 = 0.35;
/// The weight pulls another way when it is this far from the model's [rad]: a base that leans by less is an effect of the twin.
const ANOTHER_WAY: f64 = FRAC_PI_6;
/// Torques that the weight explains to this share are those of the model, whatever their size [1].
const OF_THE_MODEL: f64 = 0.9;
/// A joint tells its own factor where half its interval is below this share of it [1], and where so many of its moments are
/// independent.
const SURE: f64 = 0.3;
const INDEPENDENT: f64 = 6.0;
/// The torque of one joint has another unit when it is so many times the model's, or as many times smaller [1]: masses in
/// descriptions are wrong by less.
const SCALED: f64 = 2.0;
/// Torques of which the weight explains more than this share [1] are not without it.
const MOSTLY: f64 = 0.5;
/// What is significant, in sigmas.
const SIGNIFICANT: f64 = 4.0;
/// A joint tells its own factor where it feels so much of what the joint does that feels most [1]; a choice: of less, the load in a
/// hand and a push make several times as much.
const FELT: f64 = 0.05;
/// Shares of a joint's information that are below this are of the arithmetic [1].
const ROUNDING: f64 = 1e-9;
/// Weight and motion of one unit agree to this factor [1]; a choice, since rotors count as motion.
const AGREE: f64 = 2.0;

impl Weight {
    /// Fits the pull; `None` of fewer moments than tell anything, of torques that are all 0, or where a number is none.
    pub fn of(moments: &[Moment]) -> Option<Self> {
        let dof = moments.first()?.tau.len();
        let whole = |m: &Moment| {
            [&m.tau, &m.dq, &m.ddq]
                .into_iter()
                .chain(&m.holds)
                .chain([&m.motion].into_iter().filter(|motion| !motion.is_empty()))
                .all(|v| v.len() == dof && v.iter().all(|v| v.is_finite()))
        };
        if moments.len() < FEWEST || dof == 0 || !moments.iter().all(whole) {
            return None;
        }
        let columns: Vec<Columns> = (0..dof).map(|joint| Columns::of(moments, joint)).collect();
        fit(&columns)
    }

    /// Size of the pull [m/s²].
    pub fn size(&self) -> f64 {
        dot(self.pull, self.pull).sqrt()
    }

    /// Share of the model's weight, with half its 95 % interval; `falls`: free fall in the model's base frame [m/s²].
    pub fn share(&self, falls: [f64; 3]) -> [f64; 2] {
        let square = dot(falls, falls);
        let sigma = dot(falls, product(&self.covariance, falls)).max(0.0).sqrt();
        [dot(self.pull, falls) / square, NORMAL_95 * sigma / square]
    }

    /// What it means; `falls`: free fall in the model's base frame [m/s²].
    pub fn finding(&self, falls: [f64; 3]) -> Finding {
        let g = dot(falls, falls).sqrt();
        let [share, half] = self.share(falls);
        let size = self.size() / g;
        let cosine = share / size.max(1e-12);
        // One sigma of the pull in its own direction.
        let sigma = dot(self.pull, product(&self.covariance, self.pull)).max(0.0).sqrt() / (size * g * g).max(1e-12);
        let sure = size > SIGNIFICANT * sigma;
        if let Some(odd) = self.odd_joint(falls) {
            return odd;
        }
        let aligned = cosine.abs() > ANOTHER_WAY.cos();
        let is_scaled = !(SCALED.recip()..SCALED).contains(&size);
        if sure && aligned && (self.is_turned(cosine) || is_scaled && self.is_the_models(share)) {
            return Finding::Scaled(None, share);
        }
        // The other way round of the model's own size: a base that hangs.
        let another = ALL.contains(&size) && self.angle(falls) > ANOTHER_WAY;
        if sure && another && NORMAL_95 * sigma < NONE {
            return Finding::Elsewhere;
        }
        let none = size < NONE && share.abs() + half < MOSTLY && self.explained < MOSTLY;
        match share {
            _ if half >= NONE * share.abs().max(1.0) => Finding::NotTold,
            share if ALL.contains(&share) && self.explained > MOSTLY => Finding::Whole(share),
            _ if none && !self.lively => Finding::Noise,
            share if none && !self.holds_some(falls) => Finding::Absent(share),
            share => Finding::Partly(share),
        }
    }

    /// The least angle between the pull and the model's that its 95 % interval leaves [rad]: what few moments make of a direction
    /// across is as wide as the strength along it is narrow.
    fn angle(&self, falls: [f64; 3]) -> f64 {
        let share = dot(self.pull, falls) / dot(falls, falls);
        let along = falls.map(|falls| share * falls);
        let across: [f64; 3] = std::array::from_fn(|axis| self.pull[axis] - along[axis]);
        let size = dot(across, across).sqrt();
        let sigma = dot(across, product(&self.covariance, across)).max(0.0).sqrt() / size.max(1e-12);
        (size - NORMAL_95 * sigma).max(0.0).atan2(share * dot(falls, falls).sqrt())
    }

    /// Whether torques that hold a weight the other way round have their motion the other way round, too.
    fn is_turned(&self, cosine: f64) -> bool {
        let [pace, sigma] = self.pace;
        cosine < 0.0 && pace < -SIGNIFICANT * sigma
    }

    /// Whether torques with this share of the model's weight are the model's in another unit.
    fn is_the_models(&self, share: f64) -> bool {
        let [pace, sigma] = self.pace;
        let agree = (AGREE.recip()..AGREE).contains(&(pace / share)) && pace.abs() > SIGNIFICANT * sigma;
        self.explained > OF_THE_MODEL || agree
    }

    /// Whether any joint surely holds weight.
    fn holds_some(&self, falls: [f64; 3]) -> bool {
        (0..self.joints.len()).filter_map(|joint| self.factor(joint, falls)).any(|[factor, _]| factor.abs() > NONE)
    }

    /// Joints, from 0, whose torque is the other way round beside others that hold the model, each with how many times the model's
    /// it is.
    pub fn turned(&self, falls: [f64; 3]) -> Vec<(usize, f64)> {
        let factors = (0..self.joints.len()).filter_map(|joint| Some((joint, self.factor(joint, falls)?)));
        let (as_modelled, odd): (Vec<_>, Vec<_>) = factors.partition(|(_, [factor, _])| ALL.contains(factor));
        let is_turned = |[factor, half]: [f64; 2]| factor + half < 0.0 && (-ALL.end..-ALL.start).contains(&factor);
        let turned = odd.into_iter().filter(|(_, factor)| is_turned(*factor));
        turned.filter(|_| !as_modelled.is_empty()).map(|(joint, [factor, _])| (joint, factor)).collect()
    }

    /// The joint whose torque is not what holds the model, where that of another one is.
    fn odd_joint(&self, falls: [f64; 3]) -> Option<Finding> {
        if !self.joints_differ(falls) {
            return None;
        }
        if let Some((joint, factor)) = self.turned(falls).first() {
            return Some(Finding::Turned(*joint, *factor));
        }
        let factors = (0..self.joints.len()).filter_map(|joint| Some((joint, self.factor(joint, falls)?)));
        let (as_modelled, odd): (Vec<_>, Vec<_>) = factors.partition(|(_, [factor, _])| ALL.contains(factor));
        let &[(joint, [factor, half])] = &odd[..] else { return None };
        let [least, most] = [factor - half, factor + half];
        let scaled = (least > 0.0 && most < SCALED.recip()) || least > SCALED;
        (scaled && !as_modelled.is_empty()).then_some(Finding::Scaled(Some(joint), factor))
    }

    /// Whether a factor of each joint explains the torques better than one weight of all that pulls another way.
    fn joints_differ(&self, falls: [f64; 3]) -> bool {
        let [mut by_pull, mut by_factor] = [0.0; 2];
        for witness in &self.joints {
            let (information, wants) = witness.of_pull();
            let Some(own) = own_pull(&information, wants) else { continue };
            let factor = dot(falls, wants) / dot(falls, product(&information, falls)).max(f64::MIN_POSITIVE);
            by_pull += distance(&information, own, self.pull);
            by_factor += distance(&information, own, falls.map(|fall| factor * fall));
        }
        by_factor < by_pull
    }

    /// How much of the weight a joint feels as the arm moves, beside its own friction and motion [N m, but for one factor of all
    /// joints].
    fn felt(&self, joint: usize, pull: [f64; 3]) -> f64 {
        let of = |witness: &Witness| dot(pull, product(&witness.of_pull().0, pull)).max(0.0) / witness.weight;
        self.joints.get(joint).map_or(0.0, of).sqrt()
    }

    /// How many times the torque of a pull one joint's is, with half its 95 % interval; `None` where its weight does not tell.
    fn factor(&self, joint: usize, pull: [f64; 3]) -> Option<[f64; 2]> {
        let witness = self.joints.get(joint)?;
        let (information, wants) = witness.of_pull();
        let known = dot(pull, product(&information, pull));
        let factor = dot(pull, wants) / known;
        let half = NORMAL_95 / known.sqrt();
        // An axis along the pull holds none of it, but for rounding.
        let all: f64 = (0..3).map(|k| information[k][k]).sum();
        let most = (0..self.joints.len()).map(|joint| self.felt(joint, pull)).fold(0.0, f64::max);
        let holds = known > ROUNDING * all * dot(pull, pull) && self.felt(joint, pull) > FELT * most;
        (holds && factor.is_finite() && witness.moments > INDEPENDENT && half < SURE * factor.abs())
            .then_some([factor, half])
    }

    /// What else it may be where the weight pulls against the model's and the motion does not tell; empty where it does.
    pub fn doubt(&self, falls: [f64; 3]) -> &'static str {
        let [pace, sigma] = self.pace;
        let against = dot(self.pull, falls) < -ANOTHER_WAY.cos() * self.size() * dot(falls, falls).sqrt();
        if against && pace < SIGNIFICANT * sigma {
            ", or every torque is counted the other way round, which this motion does not tell apart"
        } else {
            ""
        }
    }

    /// The pull in words: its axis of the base where it is near one, and its size.
    pub fn in_words(&self) -> String {
        let size = self.size();
        let axis = (0..3).max_by(|a, b| self.pull[*a].abs().total_cmp(&self.pull[*b].abs())).unwrap_or(2);
        let sign = if self.pull[axis] < 0.0 { '-' } else { '+' };
        let half = self.half.iter().copied().fold(0.0, f64::max);
        if self.pull[axis].abs() > NEAR_AXIS.cos() * size {
            return format!(
                "along {sign}{} of the base by {size:.2} m/s^2 (95 % within {half:.2})",
                ["x", "y", "z"][axis]
            );
        }
        let [x, y, z] = self.pull;
        format!("along ({x:.2}, {y:.2}, {z:.2}) m/s^2 in the base (95 % within {half:.2} each)")
    }
}

/// Units that torques are logged in: how many are a N m, and their names.
const UNITS: [(f64, &str); 6] =
    [(100.0, "N cm"), (1e3, "mN m"), (10.197, "kgf cm"), (0.101_97, "kgf m"), (8.851, "lbf in"), (141.61, "ozf in")];
/// A factor is that of a unit when it is this near to it [1]: masses of descriptions are a few percent off.
const NEAR_UNIT: f64 = 0.05;

/// What torques that are so many times the model's may be.
pub fn meaning(factor: f64) -> String {
    let near = |unit: &&(f64, &str)| (factor.abs() / unit.0 - 1.0).abs() < NEAR_UNIT;
    let turned = if factor < 0.0 { "counted the other way round" } else { "" };
    match (UNITS.iter().find(near), turned) {
        (Some((_, name)), "") => format!("the unit seems to be {name}"),
        (Some((_, name)), turned) => format!("{turned}, and the unit seems to be {name}"),
        (None, turned) if !turned.is_empty() && ALL.contains(&factor.abs()) => turned.to_owned(),
        _ => "another unit than N m, or a torque constant or gear ratio is missing".to_owned(),
    }
}

/// A direction is called an axis within this [rad].
const NEAR_AXIS: f64 = 0.14;
