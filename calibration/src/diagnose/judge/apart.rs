//! Whether a time that all joints share is each joint's own: drives of one arm may lag differently, and one number then fits none of them.
//! A joint's own time is what its own rows say, one Newton step from the fit, with the joint's gains at their best.

use crate::diagnose::fit::bench::{Bench, Hypothesis};
use crate::diagnose::fit::sweep::{Column, Precision, Swept, SweptClip};
use crate::words::quantity::Unit;
use crate::words::words;
use inference::estimate::interval::{LEVEL, half_width};
use inference::estimate::quadratic::minimum;
use inference::likelihood::Group;
use nalgebra::DMatrix;
use shared_mem::time::TICK;
use twin::effects::Place;

/// What a joint's own rows say of a number, with half of its 95 % interval from the scatter between clips (a jackknife).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Own {
    joint: usize,
    value: f64,
    half: f64,
}

/// A sentence for every time of an effect of a hypothesis that the joints do not share.
pub(crate) fn of_joints(bench: &Bench<'_>, hypothesis: &Hypothesis) -> Vec<String> {
    let library = bench.library;
    let shared = |effect: &usize| {
        let info = &library.candidates[*effect];
        let on_all = matches!(info.effect.acts_on, Place::CommandPath | Place::TorquePath);
        let time = info.turned.iter().copied().find(|k| {
            let setting = &library.settings.settings()[*k];
            library.joints[*k].is_none() && setting.physical_unit() == "s"
        });
        time.filter(|_| on_all).map(|number| (info.effect.name, number))
    };
    let all = hypothesis.effects.iter().filter_map(shared);
    all.filter_map(|(name, number)| sentence(name, hypothesis.full[number], &own(bench, hypothesis, number)?)).collect()
}

/// The number as each joint has it.
fn own(bench: &Bench<'_>, hypothesis: &Hypothesis, number: usize) -> Option<Vec<Own>> {
    let (library, free) = (bench.library, &hypothesis.free[..]);
    let clips = bench.with_own(&hypothesis.clips(), Some(hypothesis));
    let swept = bench.linearise(&hypothesis.full, free, &clips, Precision::Joints)?;
    let joints = library.joints.iter().flatten().max()? + 1;
    let of_joint = |joint: usize| {
        let counts = |k: &usize| *k == number || library.joints[*k] == Some(joint);
        let numbers: Vec<usize> = free.iter().copied().filter(counts).collect();
        let forms = forms(bench, &swept, &numbers, joint);
        let all = forms.iter().fold(DMatrix::zeros(numbers.len() + 1, numbers.len() + 1), |sum, form| sum + form);
        let place = numbers.iter().position(|k| *k == number)?;
        let at = |form: &DMatrix<f64>| minimum(form, &(1..=numbers.len()).collect::<Vec<_>>()).at[place];
        let (step, count) = (at(&all), forms.len() as f64);
        let squares: f64 = forms.iter().map(|form| (at(&(&all - form)) - step).powi(2)).sum();
        let scatter = (squares * (count - 1.0) / count.max(1.0)).sqrt();
        let half = half_width(LEVEL, 0.0, scatter, forms.len());
        let value = hypothesis.full[number] + step;
        half.is_finite().then_some(Own { joint, value, half })
    };
    Some((0..joints).filter_map(of_joint).collect())
}

/// For every clip the quadratic form over the residuals of a joint's own rows and some of the columns.
fn forms(bench: &Bench<'_>, swept: &Swept, numbers: &[usize], joint: usize) -> Vec<DMatrix<f64>> {
    let place = |k: &usize| swept.columns.iter().position(|column| *column == Column::Number(*k)).map(|at| at + 1);
    let places: Vec<usize> = std::iter::once(0).chain(numbers.iter().filter_map(place)).collect();
    let channels = bench.evidence.channels();
    let one = |clip: &SweptClip| {
        let own = |channel: usize| channels[channel].joint == Some(joint) && channels[channel].group == Group::Arm;
        let rows = bench.evidence.rows(clip.clip).iter().enumerate().filter(|(_, row)| own(row.channel));
        let rows: Vec<usize> = rows.map(|(at, _)| at).collect();
        let matrix = clip.matrix.select_rows(&rows).select_columns(&places);
        matrix.tr_mul(&matrix)
    };
    swept.clips.iter().map(one).collect()
}

/// `None` where all joints may have the same.
fn sentence(effect: &str, common: f64, own: &[Own]) -> Option<String> {
    let least = own.iter().min_by(|a, b| (a.value + a.half).total_cmp(&(b.value + b.half)))?;
    let most = own.iter().max_by(|a, b| (a.value - a.half).total_cmp(&(b.value - b.half)))?;
    let apart = most.value - most.half > least.value + least.half;
    // Less than a cycle of the control loop is nobody's lag.
    if !apart || most.value - least.value < TICK {
        return None;
    }
    let unit = Unit::suited("s", most.value);
    let one = |own: &Own| {
        format!("{} in joint {}", unit.interval(own.value, [own.value - own.half, own.value + own.half]), own.joint + 1)
    };
    let each: Vec<String> = own.iter().map(one).collect();
    Some(format!(
        "{} of {} for all joints does not fit each of them: {}; their drives or filters differ, and one number cannot follow that",
        words(effect),
        unit.with_unit(common),
        each.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{ONCE, on_bench, shipped, truth, with_effect};
    use inference::likelihood::setting;
    use shared_mem::msg::MAX_JOINTS;
    use worlds::world::Kind;

    #[test]
    fn joints_that_lag_differently_are_said_to_and_such_that_may_lag_alike_are_not() {
        let own = |values: [f64; 2], half| {
            values.iter().enumerate().map(|(joint, value)| Own { joint, value: *value, half }).collect::<Vec<_>>()
        };
        let text = sentence("command_lag", 0.015, &own([0.011, 0.019], 0.001)).expect("a sentence");
        assert!(text.contains("11.0 [10.0, 12.0] ms in joint 1, 19.0 [18.0, 20.0] ms in joint 2"), "{text}");
        assert_eq!(sentence("command_lag", 0.015, &own([0.011, 0.019], 0.005)), None);
        assert_eq!(sentence("command_lag", 0.015, &own([0.0150, 0.0152], 1e-5)), None, "hardly another");
    }

    #[test]
    fn a_delay_that_all_joints_share_is_found_in_each_of_them() {
        let (cell, base) = (shipped(), setting::complete(&shipped(), None).expect("a cell"));
        let world = with_effect("command_delay", 3, Kind::Excitation, &cell);
        let library = Library::new(&cell, &base, None, &[87.0; MAX_JOINTS]);
        on_bench((&cell, &world), &library, |bench, even| {
            let effect = library.find("command_delay").expect("a candidate");
            let number = library.candidates[effect].sizes[0];
            let fit = bench.fit(&[effect], truth(&library, &world), &[0, 1], even, None, ONCE).expect("a fit");
            let own = own(bench, &fit, number).expect("joints");
            assert_eq!(own.len(), 7);
            for joint in &own {
                let off = (joint.value - fit.full[number]).abs();
                assert!(off < TICK, "joint {}: {off}", joint.joint);
            }
            assert!(of_joints(bench, &fit).is_empty());
        });
    }
}
