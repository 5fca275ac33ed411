//! One clip looked at: every detector in its turn, what one found taken as mended for the next.

use super::columns::Columns;
use super::lag::{self, Lag};
use super::remark::{Fault, Remark, Severity};
use super::{
    constant, copied, elsewhere, fall, order, publishers, range, rates, reader, stamps, standing, torque, units,
    velocity,
};
use nalgebra::Point3;
use shared_mem::cell::Cell;
use shared_mem::recording::Clip;
use twin::arm::ArmModel;
use twin::replay::in_model_order;

/// A clip that was looked at.
pub(super) struct Looked {
    pub(super) columns: Columns,
    pub(super) lag: Option<Lag>,
    pub(super) fall: Option<fall::Fall>,
    pub(super) remarks: Vec<Remark>,
}

/// What the detectors need of a cell.
pub(super) struct Known<'a> {
    pub(super) cell: &'a Cell,
    pub(super) arm: Option<ArmModel>,
    pub(super) corners: Vec<Point3<f64>>,
}

impl<'a> Known<'a> {
    pub(super) fn of(cell: &'a Cell) -> Self {
        Self { cell, arm: ArmModel::from_cell(cell).ok(), corners: standing::corners(cell).unwrap_or_default() }
    }
}

/// Looks at a clip, alignment first.
pub(super) fn look(file: &str, clip: &Clip, known: &Known<'_>) -> Looked {
    let arm = known.arm.as_ref();
    let ordered = arm.and_then(|arm| in_model_order(clip.clone(), arm).ok());
    // Without the model's joints nothing is held against the model.
    let arm = arm.filter(|_| ordered.is_some());
    let mut columns = Columns::of(file, ordered.as_ref().unwrap_or(clip));
    let mut remarks = reader::remarks(&columns);
    if let Some(clock) = stamps::clock(&columns) {
        // Gaps by stamps of another unit are those of its rounding.
        remarks.retain(|remark| !matches!(remark.fault, Fault::LostSamples | Fault::StampOrder));
        remarks.push(clock.remark);
        columns = columns.with_clock(clock.factor);
    } else {
        remarks.extend(stamps::uneven(&columns));
    }
    let is_known = |fault: Fault, remarks: &[Remark]| remarks.iter().any(|remark| remark.fault == fault);
    if !is_known(Fault::TwoPublishers, &remarks) {
        remarks.extend(publishers::remarks(&columns));
    }
    remarks.extend(constant::remarks(&columns));
    remarks.extend(copied::remark(&columns));
    let mut lag = None;
    if !is_known(Fault::TwoPublishers, &remarks) {
        remarks.extend(rates::remarks(&columns));
        remarks.extend(velocities(&mut columns));
        lag = joints(&mut columns, arm, &mut remarks);
    }
    if !columns.object.is_empty() && !is_known(Fault::Quaternion, &remarks) && !is_known(Fault::LengthUnit, &remarks) {
        remarks.extend(standing::remarks(&columns, known.cell, &known.corners));
        // What is wrong with joints or poses puts them elsewhere, too.
        let odd = |r: &Remark| {
            r.severity == Severity::Wrong || matches!(r.fault, Fault::LengthUnit | Fault::PlaceholderConstant)
        };
        if !remarks.iter().any(odd) {
            remarks.extend(elsewhere::remark(file, clip, known.cell));
        }
    }
    let fall = fall::of(&columns, known.cell, &known.corners);
    Looked { columns, lag, fall, remarks }
}

/// Velocities against slopes; those of another unit are taken as mended from here on.
fn velocities(columns: &mut Columns) -> Vec<Remark> {
    let found = velocity::remarks(columns);
    if found.iter().any(|remark| remark.fault == Fault::VelocityUnit) {
        columns.measured.dq.clear();
    }
    found
}

/// Commands against measurements, and both against the model.
fn joints(columns: &mut Columns, arm: Option<&ArmModel>, remarks: &mut Vec<Remark>) -> Option<Lag> {
    if let Some(units::Converted { factor, remark }) = units::converted(columns, arm) {
        // The reader may have noticed the ratio, but not which topic is wrong.
        remarks.retain(|other| other.fault != Fault::CommandUnit);
        remarks.push(remark);
        columns.desired.q.iter_mut().flatten().for_each(|q| *q *= factor);
        columns.desired.noise.iter_mut().for_each(|noise| *noise *= factor);
    }
    let lag = lag::of(columns);
    let silent = |channel: &str| remarks.iter().any(|r| r.fault == Fault::PlaceholderConstant && r.channel == channel);
    let held = remarks.iter().any(|r| r.fault == Fault::HeldRows && r.channel == "measured");
    // Rows that repeat older ones have no accelerations.
    let (no_position, no_torque) = (silent("measured q"), held || silent("measured effort"));
    if no_position {
        return lag;
    }
    let paired = order::remarks(columns, lag.as_ref());
    // What the commands contradict already, the model need not contradict again.
    if paired.is_empty()
        && let Some(arm) = arm
    {
        let wraps = remarks.iter().any(|remark| remark.fault == Fault::AngleWraps);
        remarks.extend(against_model(columns, arm, wraps, no_torque));
    }
    remarks.extend(paired);
    lag
}

/// Ranges and torques against the model. Torques tell exchanged joints from turned ones, which ranges may not.
fn against_model(columns: &Columns, arm: &ArmModel, wraps: bool, no_torque: bool) -> Vec<Remark> {
    // An angle that wraps leaves its range.
    let beyond = if wraps { Vec::new() } else { range::remarks(columns, arm) };
    let degrees = beyond.iter().any(|remark| remark.fault == Fault::Degrees);
    let torques = if degrees || no_torque { Vec::new() } else { torque::remarks(columns, arm) };
    let explained = torques.iter().any(|remark| matches!(remark.fault, Fault::JointOrder | Fault::JointSign));
    let sure = beyond.iter().any(|remark| remark.fault != Fault::BeyondLimits);
    match (explained, sure) {
        (true, _) => torques,
        (_, true) => beyond,
        _ => beyond.into_iter().chain(torques).collect(),
    }
}
