//! Commands in another unit than what was measured. Spreads over all joints are compared, which neither their order nor their
//! signs change.

use super::columns::{Columns, Signals};
use super::conversion;
use super::limits::{MOTION_OVER_NOISE, NEAR_CONVERSION};
use super::range;
use super::remark::{Fault, Remark, Size};
use super::statistics::{deviation, mean, range, root_mean_square};
use super::velocity;
use twin::arm::ArmModel;

/// Which topic is in the wrong unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Side {
    Desired,
    Measured,
    Unknown,
}

/// A command in another unit.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Converted {
    /// By what the commands have to be multiplied to be of the unit of what was measured.
    pub(super) factor: f64,
    pub(super) remark: Remark,
}

/// Looks whether what was measured is so many times what was asked for.
pub(super) fn converted(clip: &Columns, arm: Option<&ArmModel>) -> Option<Converted> {
    let (measured, desired) = (&clip.measured, &clip.desired);
    if measured.dof() != desired.dof() || !moves(desired) || !moves(measured) {
        return None;
    }
    let (factor, what) = conversion::known(spread(measured) / spread(desired))?;
    // The posture says the same as the motion, or the arm moves about zero.
    let posed = level(measured) > spread(measured);
    if posed && (level(measured) / level(desired) / factor - 1.0).abs() > 3.0 * NEAR_CONVERSION {
        return None;
    }
    let ratios: Vec<f64> = (0..measured.dof())
        .filter(|j| deviation(&desired.q[*j]) > MOTION_OVER_NOISE * desired.noise[*j].max(1e-9))
        .map(|j| deviation(&measured.q[j]) / deviation(&desired.q[j]))
        .collect();
    let (side, why) = side(clip, factor, arm);
    let (channel, which) = match side {
        Side::Desired => ("desired q", "the commands"),
        Side::Measured => ("measured q", "the measured positions"),
        Side::Unknown => ("q", "one of the two"),
    };
    let larger = factor > 1.0;
    let meaning = match (side, larger) {
        (Side::Desired, true) => format!("were divided by {factor:.4} once too often"),
        (Side::Desired, false) => format!("are in another unit ({what})"),
        (Side::Measured, true) => format!("are in another unit ({what})"),
        (Side::Measured, false) => format!("were divided by {:.4} once too often", factor.recip()),
        (Side::Unknown, _) => format!("is in another unit ({what})"),
    };
    let remedy = match side {
        Side::Desired => format!("multiply the commands by {factor:.4} where they are published: {why}"),
        Side::Measured => format!("multiply the measured positions by {:.4} where they are published: {why}", factor.recip()),
        Side::Unknown => "publish both in rad; give the arm's model in cell.toml (`[robot] urdf`), so that its joints' ranges say which it is".into(),
    };
    let said = format!("what was measured moves {factor:.4} times as far as what was commanded: {which} {meaning}");
    let remark = Remark::new(Fault::CommandUnit, &clip.file, channel, said)
        .sized(Size {
            value: spread(measured) / spread(desired),
            interval: range(&ratios).unwrap_or([factor; 2]),
            unit: "1",
        })
        .mended_by(remedy);
    Some(Converted { factor, remark })
}

fn moves(signals: &Signals) -> bool {
    signals.q.iter().zip(&signals.noise).any(|(q, noise)| deviation(q) > MOTION_OVER_NOISE * noise.max(1e-9))
}

/// How far all joints together move about their means.
fn spread(signals: &Signals) -> f64 {
    signals.q.iter().map(|q| deviation(q).powi(2)).sum::<f64>().sqrt()
}

/// How far from zero they are.
fn level(signals: &Signals) -> f64 {
    signals.q.iter().map(|q| mean(q).powi(2)).sum::<f64>().sqrt()
}

/// The topic that the joints' ranges or the velocities speak against, and why.
fn side(clip: &Columns, factor: f64, arm: Option<&ArmModel>) -> (Side, &'static str) {
    if let Some(arm) = arm {
        let inside = |signals: &Signals| range::share_inside(signals, arm);
        let (desired, measured) = (inside(&clip.desired), inside(&clip.measured));
        let why = "they lie outside of the joints' ranges";
        if measured > desired {
            return (Side::Desired, why);
        }
        if desired > measured {
            return (Side::Measured, why);
        }
    }
    let off = |signals: &Signals| {
        let joints = velocity::compared(signals);
        let ratio = joints.iter().map(|c| c.factor.value).collect::<Vec<_>>();
        !ratio.is_empty() && (root_mean_square(&ratio).ln() + factor.ln().abs()).abs() < 2.0 * NEAR_CONVERSION
    };
    let why = "they are no integral of their velocities";
    match (off(&clip.desired), off(&clip.measured)) {
        (true, false) => (Side::Desired, why),
        (false, true) => (Side::Measured, why),
        _ => (Side::Unknown, ""),
    }
}
