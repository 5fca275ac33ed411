//! Joints of the two topics in another order, or counted the other way round. Positions with their levels are compared at the
//! clip's lag: joints that move alike differ in where they stand.

use super::columns::Columns;
use super::lag::Lag;
use super::limits::{BETTER_FIT, LEAST_MISMATCH, MOTION_OVER_NOISE};
use super::remark::{Fault, Remark, Size};

/// Times at which positions are compared.
const SAMPLES: usize = 400;

/// How far measured joint `i` is from the commands of joint `j` [rad]: root mean square, by `[i][j]`.
struct Distances {
    plain: Vec<Vec<f64>>,
    /// With the commands turned round.
    turned: Vec<Vec<f64>>,
}

fn distances(clip: &Columns, lag: f64) -> Option<Distances> {
    let (measured, desired) = (&clip.measured, &clip.desired);
    let dof = measured.dof();
    let (from, to) = (desired.t.first()?, desired.t.last()?);
    let at = |k: usize| from + (to - from) * k as f64 / (SAMPLES - 1) as f64;
    let row = |k: usize| -> Option<[Vec<f64>; 2]> {
        let t = at(k);
        let did = (0..dof).map(|j| measured.q_at(j, t + lag)).collect::<Option<Vec<f64>>>()?;
        let was_asked = (0..dof).map(|j| desired.q_at(j, t)).collect::<Option<Vec<f64>>>()?;
        Some([did, was_asked])
    };
    let rows: Vec<[Vec<f64>; 2]> = (0..SAMPLES).filter_map(row).collect();
    if rows.len() < SAMPLES / 4 {
        return None;
    }
    let distance = |i: usize, j: usize, sign: f64| {
        let squares = rows.iter().map(|[did, asked]| (did[i] - sign * asked[j]).powi(2));
        (squares.sum::<f64>() / rows.len() as f64).sqrt()
    };
    let all = |sign: f64| (0..dof).map(|i| (0..dof).map(|j| distance(i, j, sign)).collect()).collect();
    Some(Distances { plain: all(1.0), turned: all(-1.0) })
}

/// Joints of the clip that follow another one's commands, or their own turned round.
pub(super) fn remarks(clip: &Columns, lag: Option<&Lag>) -> Vec<Remark> {
    // Without a motion that tells the lag nothing can be laid beside each other.
    let Some(lag) = lag.filter(|_| clip.measured.dof() == clip.desired.dof()) else { return Vec::new() };
    let Some(Distances { plain, turned }) = distances(clip, lag.seconds) else {
        return Vec::new();
    };
    let dof = plain.len();
    let suspect = |i: &usize| plain[*i][*i] > LEAST_MISMATCH.max(MOTION_OVER_NOISE * clip.measured.noise[*i]);
    let mut out = Vec::new();
    let mut others = Vec::new();
    for i in (0..dof).filter(suspect) {
        let nearest = (0..dof).filter(|j| *j != i).min_by(|a, b| plain[i][*a].total_cmp(&plain[i][*b]));
        let other = nearest.filter(|j| plain[i][*j] < BETTER_FIT * plain[i][i]);
        let own = turned[i][i];
        match other {
            Some(other) if plain[i][other] < own => others.push((i, other)),
            _ if own < BETTER_FIT * plain[i][i] => out.push(sign(clip, i, [plain[i][i], own])),
            _ => {}
        }
    }
    out.extend(order(clip, &others, &plain));
    out
}

fn sign(clip: &Columns, joint: usize, [as_is, turned]: [f64; 2]) -> Remark {
    let who = clip.joint(joint);
    let what = format!(
        "{who} is {} mrad from its commands and {} mrad from their negative: one of the topics counts it the other way round",
        milli(as_is),
        milli(turned)
    );
    Remark::new(Fault::JointSign, &clip.file, who, what)
        .sized(Size { value: as_is, interval: [as_is - turned, as_is + turned], unit: "rad" })
        .mended_by("turn the sign of its q, dq and effort where that topic is published")
}

/// Joints that follow each other's commands.
fn order(clip: &Columns, others: &[(usize, usize)], plain: &[Vec<f64>]) -> Option<Remark> {
    let (first, follows) = *others.first()?;
    let pairs: Vec<String> = others
        .iter()
        .map(|(i, j)| format!("measured joint {} follows the commands of joint {}", i + 1, j + 1))
        .collect();
    let (own, other) = (plain[first][first], plain[first][follows]);
    Some(
        Remark::new(
            Fault::JointOrder,
            &clip.file,
            "joint order",
            format!("{} ({} mrad from its own, {} mrad from the other's)", pairs.join(", "), milli(own), milli(other)),
        )
        .sized(Size { value: own, interval: [own - other, own + other], unit: "rad" })
        .mended_by(
            "publish joint names with both topics, or put the columns of one topic into the order of `[robot] joints`",
        ),
    )
}

fn milli(value: f64) -> String {
    format!("{:.1}", value * 1e3)
}
