//! The gap in numbers: before, after, and what noise alone leaves.

use super::has_effects;
use super::robot::robot;
use crate::answer::diagnosis::{Diagnosis, JointGap, TorqueRms};
use crate::page::figure::bars::{Row, bars};
use crate::page::frame::legend;
use maud::{Markup, html};

/// Whether there were clips to measure the gap on.
pub(in crate::report) fn is_known(diagnosis: &Diagnosis) -> bool {
    diagnosis.gap.before > 0.0
}

/// How to read the bars.
pub(super) fn reading(diagnosis: &Diagnosis) -> &'static str {
    if has_effects(diagnosis) {
        "On held-out clips. Shrink: 1 \u{2212} after / before of the mean squared residual in \u{3c3}, the first pair of bars; an \
         effect can at best bring it down to the dashed line."
    } else {
        "On held-out clips. What lies beyond the dashed line is more than noise."
    }
}

/// Bars: the gap in sigma with the floor, then in units of the hand.
pub(super) fn picture(diagnosis: &Diagnosis) -> Markup {
    let gap = &diagnosis.gap;
    let both = has_effects(diagnosis);
    let values = |before: f64, after: f64| if both { vec![before, after] } else { vec![before] };
    let mut rows = vec![Row {
        name: "mean squared residual",
        unit: "\u{3c3}\u{b2}",
        values: values(gap.before, gap.after),
        floor: Some(gap.floor),
    }];
    let torques = gap.torque_rms.as_ref().map(TorqueRms::over_joints).unwrap_or_default();
    let human = [
        ("joints, RMS", "rad", gap.joint_rms_rad),
        ("torques, RMS", "N m", torques),
        ("object, ADD", "m", gap.object_add_m),
        ("object, median ADD", "m", gap.median.object_add_m),
        ("object, ADD-S", "m", gap.object_add_s_m),
    ];
    for (name, unit, change) in human {
        if let (Some(before), Some(after)) = (change.before, change.after) {
            rows.push(Row { name, unit, values: values(before, after), floor: None });
        }
    }
    let along_measured = gap.torque_rms.is_some();
    let baseline =
        if along_measured { "baseline: the model of cell.toml" } else { "baseline: gains and object identified" };
    let entries = [("before", baseline), ("after", "with the effect"), ("floor", "what noise alone leaves")];
    html! {
        @if both { (legend(&entries)) } @else { (legend(&[entries[0], entries[2]])) }
        (bars(&["before", "after"], &rows))
    }
}

/// The arm's gap joint by joint: whether what was added leaves more where it acts than elsewhere.
pub(super) fn joints(diagnosis: &Diagnosis) -> Markup {
    let both = has_effects(diagnosis) || diagnosis.nearest.is_some();
    let times_noise = |mean_square: f64, floor: f64| format!("{:.1}", (mean_square / floor).sqrt());
    html! {
        section {
            h2 { "Joint by joint" }
            @if let Some(pictures) = robot(diagnosis, both) { (pictures) }
            p { "Root mean square of the residuals in a clip like most, in multiples of what noise alone leaves." }
            table {
                tr { th { "joint" } th { "before" } @if both { th { "with what was found" } } }
                @for JointGap { joint, before, after, floor } in &diagnosis.gap.joints {
                    tr {
                        td { (joint) }
                        td { (times_noise(*before, *floor)) }
                        @if both { td { (times_noise(*after, *floor)) } }
                    }
                }
            }
        }
    }
}
