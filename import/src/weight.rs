//! The arm's weight in its torques: along which axis of the base it pulls and how strongly, fitted before anything is said about
//! what torques hold. Torques are linear in the acceleration of free fall, so this is a least-squares fit of three numbers over
//! all joints, with bias, friction and a joint's own inertia as numbers of each joint that nobody asks for.

use std::f64::consts::FRAC_PI_6;

/// One moment of an arm.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Moment {
    /// Torque of each joint [N m].
    pub tau: Vec<f64>,
    /// Torques that hold the model for 1 m/s² of free fall along the base's x, y and z, joint by joint [kg m].
    pub holds: [Vec<f64>; 3],
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
    joints: Vec<Witness>,
}

/// What that means, held against the model's own free fall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Finding {
    /// The torques hold the weight of the model; the share of it.
    Whole(f64),
    /// Nothing that looks like weight is left in them, along no axis; the share of the model's.
    Absent(f64),
    /// The weight pulls another way than the model's.
    Elsewhere,
    /// This joint's torque is so many times the model's, its sign turned, and that of the others is not.
    Turned(usize, f64),
    /// The torque of this joint, or of all, is so many times the model's.
    Scaled(Option<usize>, f64),
    /// Neither all of it nor none; the share of the model's.
    Partly(f64),
    /// The motion does not tell it.
    NotTold,
}

/// Fewer moments say nothing.
const FEWEST: usize = 20;
/// Size of weight that is expected before anything is seen, one sigma [m/s²]: what no motion tells stays near 0.
const EXPECTED: f64 = 10.0;
/// The same of one joint alone, whose torque may be of any unit.
const ANY: f64 = 1e4;
/// A sensor's bias is within this share of a joint's torques, one sigma [1]; a choice.
const BIAS: f64 = 0.2;
/// Friction is within their size, one sigma [1].
const FRICTION: f64 = 1.0;
/// Velocity around which dry friction turns its sign [rad/s].
const TURNS: f64 = 0.02;
/// Rounds of weights by residuals: these are the same to a percent from the third on.
const ROUNDS: usize = 3;
/// Two-sided 95 % of a normal distribution, in sigmas.
const NORMAL_95: f64 = 1.959_964;
/// Numbers of a joint that nobody asks for: bias, dry and viscous friction, its own inertia.
const OWN: usize = 4;

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

/// What one joint adds: its information on the pull, and what it wants, with its own numbers eliminated.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
struct Witness {
    information: [[f64; 3]; 3],
    wants: [f64; 3],
    /// Moments that count, as many as independent ones.
    moments: f64,
    /// What each moment weighs: 1 over the variance of its torque [1/(N m)^2].
    weight: f64,
}

impl Weight {
    /// Fits the pull; `None` of fewer moments than tell anything, of torques that are all 0, or where a number is none.
    #[must_use]
    pub fn of(moments: &[Moment]) -> Option<Self> {
        let dof = moments.first()?.tau.len();
        let whole = |m: &Moment| {
            [&m.tau, &m.dq, &m.ddq]
                .into_iter()
                .chain(&m.holds)
                .all(|v| v.len() == dof && v.iter().all(|v| v.is_finite()))
        };
        if moments.len() < FEWEST || dof == 0 || !moments.iter().all(whole) {
            return None;
        }
        let columns: Vec<Columns> = (0..dof).map(|joint| Columns::of(moments, joint)).collect();
        fit(&columns)
    }

    /// Size of the pull [m/s²].
    #[must_use]
    pub fn size(&self) -> f64 {
        dot(self.pull, self.pull).sqrt()
    }

    /// Share of the model's weight, with half its 95 % interval; `falls`: free fall in the model's base frame [m/s²].
    #[must_use]
    pub fn share(&self, falls: [f64; 3]) -> [f64; 2] {
        let square = dot(falls, falls);
        let sigma = dot(falls, product(&self.covariance, falls)).max(0.0).sqrt();
        [dot(self.pull, falls) / square, NORMAL_95 * sigma / square]
    }

    /// What it means; `falls`: free fall in the model's base frame [m/s²].
    #[must_use]
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
        // The other way round of the model's own size: a base that hangs.
        let another = ALL.contains(&size) && cosine < ANOTHER_WAY.cos();
        if sure && cosine.abs() > ANOTHER_WAY.cos() && !ALL.contains(&size) && self.explained > OF_THE_MODEL {
            return Finding::Scaled(None, share);
        }
        if sure && another && NORMAL_95 * sigma < NONE {
            return Finding::Elsewhere;
        }
        match share {
            _ if half >= NONE => Finding::NotTold,
            share if ALL.contains(&share) => Finding::Whole(share),
            share if size < NONE && self.explained < MOSTLY => Finding::Absent(share),
            share => Finding::Partly(share),
        }
    }

    /// The one joint whose torque is not what holds the model, where that of every other joint that tells is.
    fn odd_joint(&self, falls: [f64; 3]) -> Option<Finding> {
        let factors = (0..self.joints.len()).filter_map(|joint| Some((joint, self.factor(joint, falls)?)));
        let (as_modelled, odd): (Vec<_>, Vec<_>) = factors.partition(|(_, [factor, _])| ALL.contains(factor));
        let &[(joint, [factor, half])] = &odd[..] else { return None };
        if as_modelled.is_empty() {
            return None;
        }
        let [least, most] = [factor - half, factor + half];
        let turned = most < 0.0 && (-ALL.end..-ALL.start).contains(&factor);
        let scaled = (least > 0.0 && most < SCALED.recip()) || least > SCALED;
        match (turned, scaled) {
            (true, _) => Some(Finding::Turned(joint, factor)),
            (_, true) => Some(Finding::Scaled(Some(joint), factor)),
            _ => None,
        }
    }

    /// How many times the torque of a pull one joint's is, with half its 95 % interval; `None` where its weight does not tell.
    fn factor(&self, joint: usize, pull: [f64; 3]) -> Option<[f64; 2]> {
        let Witness { information, wants, moments, .. } = self.joints.get(joint)?;
        let known = dot(pull, product(information, pull));
        let factor = dot(pull, *wants) / known;
        let half = NORMAL_95 / known.sqrt();
        (factor.is_finite() && *moments > INDEPENDENT && half < SURE * factor.abs()).then_some([factor, half])
    }

    /// The pull in words: its axis of the base where it is near one, and its size.
    #[must_use]
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

/// A direction is called an axis within this [rad].
const NEAR_AXIS: f64 = 0.14;

/// One joint: what is not asked for, what holds the model along each axis, and its torque.
struct Columns {
    own: Vec<[f64; OWN]>,
    holds: Vec<[f64; 3]>,
    tau: Vec<f64>,
    /// Their root mean square [N m].
    size: f64,
}

impl Columns {
    fn of(moments: &[Moment], joint: usize) -> Self {
        let own = |m: &Moment| [1.0, (m.dq[joint] / TURNS).tanh(), m.dq[joint], m.ddq[joint]];
        let tau: Vec<f64> = moments.iter().map(|m| m.tau[joint]).collect();
        Self {
            own: moments.iter().map(own).collect(),
            holds: moments.iter().map(|m| std::array::from_fn(|k| m.holds[k][joint])).collect(),
            size: (tau.iter().map(|v| v * v).sum::<f64>() / tau.len() as f64).sqrt(),
            tau,
        }
    }

    /// What the joint says where each of its moments weighs so much, and its own numbers: by the torque, and by each axis.
    fn witness(&self, weight: f64) -> Option<(Witness, [[f64; OWN]; 4])> {
        let mut normal = [[0.0; OWN]; OWN];
        let mut cross = [[0.0; OWN]; 4];
        let mut squares = [[0.0; 4]; 4];
        for ((own, holds), tau) in self.own.iter().zip(&self.holds).zip(&self.tau) {
            let seen = [holds[0], holds[1], holds[2], *tau];
            for (i, own_i) in own.iter().enumerate() {
                own.iter().enumerate().for_each(|(k, own_k)| normal[i][k] += weight * own_i * own_k);
                seen.iter().enumerate().for_each(|(k, seen)| cross[k][i] += weight * own_i * seen);
            }
            for (i, seen_i) in seen.iter().enumerate() {
                seen.iter().enumerate().for_each(|(k, seen_k)| squares[i][k] += weight * seen_i * seen_k);
            }
        }
        let [bias, dry] = [BIAS, FRICTION].map(|share| (share * self.size).max(1e-9).powi(-2));
        normal[0][0] += bias;
        normal[1][1] += dry;
        // A joint that stands still has no friction to tell.
        (2..OWN).for_each(|k| normal[k][k] += (FRICTION * self.size).max(1e-9).powi(-2) * 1e-2);
        let mut own = [[0.0; OWN]; 4];
        for (own, cross) in own.iter_mut().zip(&cross) {
            *own = solve(normal, *cross)?;
        }
        let left = |i: usize, k: usize| squares[i][k] - (0..OWN).map(|n| cross[i][n] * own[k][n]).sum::<f64>();
        let witness = Witness {
            information: std::array::from_fn(|i| std::array::from_fn(|k| left(i, k))),
            wants: std::array::from_fn(|i| left(i, 3)),
            moments: self.tau.len() as f64,
            weight,
        };
        Some((witness, own))
    }

    /// What is left of each moment's torque, with and without the pull.
    fn left(&self, own: &[[f64; OWN]; 4], pull: [f64; 3]) -> Vec<f64> {
        let numbers: [f64; OWN] = std::array::from_fn(|n| own[3][n] - (0..3).map(|k| pull[k] * own[k][n]).sum::<f64>());
        let one = |((own, holds), tau): ((&[f64; OWN], &[f64; 3]), &f64)| {
            tau - dot(*holds, pull) - own.iter().zip(&numbers).map(|(a, b)| a * b).sum::<f64>()
        };
        self.own.iter().zip(&self.holds).zip(&self.tau).map(one).collect()
    }
}

/// The fit. Joints weigh by what a pull of their own leaves of them; how far they contradict each other widens the interval.
fn fit(columns: &[Columns]) -> Option<Weight> {
    let mut joints = Vec::new();
    let (mut own_left, mut numbers) = (0.0, Vec::new());
    for columns in columns {
        let mut weight = columns.size.max(1e-9).powi(-2);
        let mut seen = None;
        for _ in 0..ROUNDS {
            let (mut witness, own) = columns.witness(weight)?;
            let left = columns.left(&own, solved([&witness].into_iter(), ANY)?.0);
            let repeats = repeats(&left);
            let square = left.iter().map(|v| v * v).sum::<f64>();
            witness.moments /= repeats;
            let least = (1e-6 * columns.size).max(1e-9);
            let next = ((square / left.len() as f64).max(least * least) * repeats).recip();
            seen = Some((witness, own, weight * square.max(least * least * left.len() as f64)));
            weight = next;
        }
        let (witness, own, square) = seen?;
        joints.push(witness);
        numbers.push(own);
        own_left += square;
    }
    let (pull, mut covariance) = solved(joints.iter(), EXPECTED)?;
    let (mut before, mut after, mut common_left) = (0.0, 0.0, 0.0);
    for ((columns, own), witness) in columns.iter().zip(&numbers).zip(&joints) {
        let square = |pull| columns.left(own, pull).iter().map(|v| v * v).sum::<f64>();
        after += square(pull);
        before += square([0.0; 3]);
        common_left += witness.weight * square(pull);
    }
    let contradiction = (common_left / own_left).max(1.0);
    covariance.iter_mut().flatten().for_each(|value| *value *= contradiction);
    let half = std::array::from_fn(|k| NORMAL_95 * covariance[k][k].max(0.0).sqrt());
    let explained = if before > 0.0 { 1.0 - after / before } else { 0.0 };
    Some(Weight { pull, half, explained, covariance, joints })
}

/// The pull of some joints, and its covariance; `expected`: its size before anything is seen, one sigma [m/s²].
fn solved<'a>(witnesses: impl Iterator<Item = &'a Witness>, expected: f64) -> Option<([f64; 3], [[f64; 3]; 3])> {
    let mut information = [[0.0; 3]; 3];
    let mut wants = [0.0; 3];
    for witness in witnesses {
        for i in 0..3 {
            (0..3).for_each(|k| information[i][k] += witness.information[i][k]);
            wants[i] += witness.wants[i];
        }
    }
    (0..3).for_each(|k| information[k][k] += expected.powi(-2));
    let mut covariance = [[0.0; 3]; 3];
    for (k, row) in covariance.iter_mut().enumerate() {
        let mut unit = [0.0; 3];
        unit[k] = 1.0;
        *row = solve(information, unit)?;
    }
    Some((product(&covariance, wants), covariance))
}

/// How many residuals one after the other say the same: 1 where they are independent of each other (Geyer 1992).
fn repeats(left: &[f64]) -> f64 {
    let square = left.iter().map(|v| v * v).sum::<f64>();
    if square <= 0.0 {
        return 1.0;
    }
    let alike = |apart: usize| left.iter().zip(&left[apart..]).map(|(a, b)| a * b).sum::<f64>() / square;
    let sum: f64 = (1..left.len() / 4).map(alike).take_while(|alike| *alike > 0.05).sum();
    1.0 + 2.0 * sum
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn product(matrix: &[[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|i| dot(matrix[i], v))
}

/// Solves a small set of linear equations by elimination with the largest pivot; `None` where they leave something open.
fn solve<const N: usize>(mut matrix: [[f64; N]; N], mut right: [f64; N]) -> Option<[f64; N]> {
    for column in 0..N {
        let pivot = (column..N).max_by(|a, b| matrix[*a][column].abs().total_cmp(&matrix[*b][column].abs()))?;
        matrix.swap(column, pivot);
        right.swap(column, pivot);
        let of_pivot = matrix[column];
        if !(of_pivot[column].abs() > 0.0 && of_pivot[column].is_finite()) {
            return None;
        }
        for row in column + 1..N {
            let factor = matrix[row][column] / of_pivot[column];
            matrix[row].iter_mut().zip(of_pivot).for_each(|(value, pivot)| *value -= factor * pivot);
            right[row] -= factor * right[column];
        }
    }
    for row in (0..N).rev() {
        let known: f64 = (row + 1..N).map(|k| matrix[row][k] * right[k]).sum();
        right[row] = (right[row] - known) / matrix[row][row];
    }
    right.iter().all(|v| v.is_finite()).then_some(right)
}
