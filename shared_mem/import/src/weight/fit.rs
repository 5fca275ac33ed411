//! The fit of a weight to torques: what each joint says of it, and all of them together.

use super::{Moment, Weight};

/// Size of weight that is expected before anything is seen, one sigma [m/s²]: what no motion tells stays near 0.
const EXPECTED: f64 = 10.0;
/// A pull that is so many times larger than expected is of another unit, and is expected to be so many times what was found [1].
const LARGER: f64 = 2.0;
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
/// What is common to all joints: the pull along three axes, and the motion.
const COMMON: usize = 4;
/// What is compared of a joint: these, and its torque.
const SEEN: usize = COMMON + 1;
/// Numbers of a joint that nobody asks for: bias, dry and viscous friction, its own inertia.
const OWN: usize = 4;
/// Torques go with the motion where what explains them is so many times what as many numbers explain of noise [1]: one of 10^5
/// tables of noise shows more (F test).
const LIVELY: f64 = 6.0;
/// Two-sided 95 % of a normal distribution, in sigmas.
pub(super) const NORMAL_95: f64 = 1.959_964;

/// What one joint adds: its information on what is common, and what it wants, with its own numbers eliminated.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Witness {
    information: [[f64; COMMON]; COMMON],
    wants: [f64; COMMON],
    /// Moments that count, as many as independent ones.
    pub(super) moments: f64,
    /// What each weighs: 1 over the variance of its torque [1/(N m)^2].
    pub(super) weight: f64,
}

impl Witness {
    /// The same on the pull alone: the motion, as one more number of the joint's own, eliminated.
    pub(super) fn of_pull(&self) -> ([[f64; 3]; 3], [f64; 3]) {
        let Self { information, wants, .. } = self;
        let last = information[3][3] + ANY.powi(-2);
        let left = |i: usize, k: usize| information[i][k] - information[i][3] * information[3][k] / last;
        let wants = std::array::from_fn(|i| wants[i] - information[i][3] * wants[3] / last);
        (std::array::from_fn(|i| std::array::from_fn(|k| left(i, k))), wants)
    }
}

/// The pull of one joint alone.
pub(super) fn own_pull(information: &[[f64; 3]; 3], wants: [f64; 3]) -> Option<[f64; 3]> {
    let mut information = *information;
    (0..3).for_each(|k| information[k][k] += ANY.powi(-2));
    solve(information, wants)
}

/// Square of the distance of two pulls in sigmas.
pub(super) fn distance(information: &[[f64; 3]; 3], a: [f64; 3], b: [f64; 3]) -> f64 {
    let apart = std::array::from_fn(|k| a[k] - b[k]);
    dot(apart, product(information, apart)).max(0.0)
}

/// One joint: what is not asked for, what holds the model along each axis and moves it, and its torque.
pub(super) struct Columns {
    own: Vec<[f64; OWN]>,
    model: Vec<[f64; COMMON]>,
    tau: Vec<f64>,
    /// Their root mean square [N m].
    size: f64,
}

impl Columns {
    pub(super) fn of(moments: &[Moment], joint: usize) -> Self {
        let own = |m: &Moment| [1.0, (m.dq[joint] / TURNS).tanh(), m.dq[joint], m.ddq[joint]];
        let model = |m: &Moment| {
            let [x, y, z] = [0, 1, 2].map(|axis| m.holds[axis][joint]);
            [x, y, z, m.motion.get(joint).copied().unwrap_or(0.0)]
        };
        let tau: Vec<f64> = moments.iter().map(|m| m.tau[joint]).collect();
        Self {
            own: moments.iter().map(own).collect(),
            model: moments.iter().map(model).collect(),
            size: (tau.iter().map(|v| v * v).sum::<f64>() / tau.len() as f64).sqrt(),
            tau,
        }
    }

    /// What the joint says where each of its moments weighs so much, and its own numbers: by each common number, and by the torque.
    fn witness(&self, weight: f64) -> Option<(Witness, [[f64; OWN]; SEEN])> {
        let mut normal = [[0.0; OWN]; OWN];
        let mut cross = [[0.0; OWN]; SEEN];
        let mut squares = [[0.0; SEEN]; SEEN];
        for ((own, model), tau) in self.own.iter().zip(&self.model).zip(&self.tau) {
            let seen: [f64; SEEN] = std::array::from_fn(|k| *model.get(k).unwrap_or(tau));
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
        let mut own = [[0.0; OWN]; SEEN];
        for (own, cross) in own.iter_mut().zip(&cross) {
            *own = solve(normal, *cross)?;
        }
        let left = |i: usize, k: usize| squares[i][k] - (0..OWN).map(|n| cross[i][n] * own[k][n]).sum::<f64>();
        let witness = Witness {
            information: std::array::from_fn(|i| std::array::from_fn(|k| left(i, k))),
            wants: std::array::from_fn(|i| left(i, COMMON)),
            moments: self.tau.len() as f64,
            weight,
        };
        Some((witness, own))
    }

    /// What is left of each moment's torque beside what is common.
    fn left(&self, own: &[[f64; OWN]; SEEN], common: [f64; COMMON]) -> Vec<f64> {
        let numbers: [f64; OWN] =
            std::array::from_fn(|n| own[COMMON][n] - (0..COMMON).map(|k| common[k] * own[k][n]).sum::<f64>());
        let one = |((own, model), tau): ((&[f64; OWN], &[f64; COMMON]), &f64)| {
            tau - dot(*model, common) - own.iter().zip(&numbers).map(|(a, b)| a * b).sum::<f64>()
        };
        self.own.iter().zip(&self.model).zip(&self.tau).map(one).collect()
    }

    /// How many times more of the torque goes with motion and weight than of noise, by what they leave of it.
    fn liveliness(&self, left: &[f64], repeats: f64) -> f64 {
        let count = self.tau.len() as f64;
        let mean = self.tau.iter().sum::<f64>() / count;
        let all = self.tau.iter().map(|tau| (tau - mean).powi(2)).sum::<f64>();
        let rest = left.iter().map(|v| v * v).sum::<f64>();
        let numbers = (OWN - 1 + COMMON) as f64;
        (all - rest) / numbers * (count / repeats) / rest.max(f64::MIN_POSITIVE)
    }
}

/// The fit. Joints weigh by what common numbers of their own leave of them; how far they contradict each other widens the interval.
pub(super) fn fit(columns: &[Columns]) -> Option<Weight> {
    let mut joints = Vec::new();
    let (mut lively, mut numbers) = (false, Vec::new());
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
            weight = ((square / left.len() as f64).max(least * least) * repeats).recip();
            seen = Some((witness, own, columns.liveliness(&left, repeats)));
        }
        let (witness, own, liveliness) = seen?;
        joints.push(witness);
        numbers.push(own);
        lively |= liveliness > LIVELY;
    }
    let (mut common, mut covariance) = solved(joints.iter(), EXPECTED)?;
    for _ in 0..ROUNDS {
        // Torques of a smaller unit hold a larger pull.
        let size = common[..3].iter().map(|v| v * v).sum::<f64>().sqrt();
        if size > LARGER * EXPECTED {
            (common, covariance) = solved(joints.iter(), LARGER * size)?;
        }
    }
    let without = [0.0, 0.0, 0.0, common[3]];
    let (mut before, mut after) = (0.0, 0.0);
    for (columns, own) in columns.iter().zip(&numbers) {
        let square = |common| columns.left(own, common).iter().map(|v| v * v).sum::<f64>();
        after += square(common);
        before += square(without);
    }
    let [x, y, z, motion] = common;
    let wider = contradiction(&joints, [x, y, z]);
    covariance.iter_mut().flatten().for_each(|value| *value *= wider);
    let half = std::array::from_fn(|k| NORMAL_95 * covariance[k][k].max(0.0).sqrt());
    let explained = if before > 0.0 { 1.0 - after / before } else { 0.0 };
    let pace = [motion, covariance[3][3].max(0.0).sqrt()];
    let covariance = std::array::from_fn(|i| std::array::from_fn(|k| covariance[i][k]));
    Some(Weight { pull: [x, y, z], half, explained, covariance, pace, lively, joints })
}

/// How many times farther the pulls of single joints lie from the common one than their own intervals say, squared (Birge 1932);
/// 1 where they agree.
fn contradiction(joints: &[Witness], pull: [f64; 3]) -> f64 {
    let (mut square, mut count) = (0.0, -3.0);
    for witness in joints {
        let (information, wants) = witness.of_pull();
        let Some(own) = own_pull(&information, wants) else { continue };
        square += distance(&information, own, pull);
        // Directions that the joint tells at all.
        count += (0..3).map(|k| information[k][k] / (information[k][k] + EXPECTED.powi(-2))).sum::<f64>();
    }
    if count > 0.0 { (square / count).max(1.0) } else { 1.0 }
}

/// The common numbers of some joints, and their covariance; `expected`: the pull's size before anything is seen, one sigma [m/s²].
fn solved<'a>(
    witnesses: impl Iterator<Item = &'a Witness>,
    expected: f64,
) -> Option<([f64; COMMON], [[f64; COMMON]; COMMON])> {
    let mut information = [[0.0; COMMON]; COMMON];
    let mut wants = [0.0; COMMON];
    for witness in witnesses {
        for i in 0..COMMON {
            (0..COMMON).for_each(|k| information[i][k] += witness.information[i][k]);
            wants[i] += witness.wants[i];
        }
    }
    (0..3).for_each(|k| information[k][k] += expected.powi(-2));
    information[3][3] += ANY.powi(-2);
    let mut covariance = [[0.0; COMMON]; COMMON];
    for (k, row) in covariance.iter_mut().enumerate() {
        let mut unit = [0.0; COMMON];
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

pub(super) fn dot<const N: usize>(a: [f64; N], b: [f64; N]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

pub(super) fn product<const N: usize>(matrix: &[[f64; N]; N], v: [f64; N]) -> [f64; N] {
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
