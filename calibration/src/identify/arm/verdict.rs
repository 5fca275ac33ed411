//! What the clips cannot tell, and why, number by number; and what to record next.

use super::Model;
use crate::answer::identification::{Advice, NotIdentifiable};
use crate::identify::finding::{Finding, OPEN_FROM_SHARE_OF_VALUE};
use crate::identify::options::Optimizer;
use crate::identify::used::Used;
use inference::likelihood::Setting;
use inference::statistics::extent;
use twin::effects::{Robot, find};

/// A parameter of an effect whose interval is wider than this share of the plausible range is not identifiable (a choice).
const EFFECT_OPEN_FROM: f64 = 0.5;
/// An interval is judged by its share of a number, or of this share of its search where the number is nearly 0 (a choice).
const LEAST_SIZE: f64 = 0.05;
/// Estimates whose correlation is closer than this are one number (a choice).
const ONE_NUMBER: f64 = 0.99;
/// Of a number that is nowhere near a bound, when the search did not arrive.
const DID_NOT_ARRIVE: &str = "not converged: something other than the gains acts in these clips";
/// An effect this near to neutral is absent, as a share of its search: rounding.
const ABSENT_BELOW: f64 = 1e-9;

/// Numbers that are not identifiable.
pub(super) fn not_identifiable(
    finding: &Finding<'_>,
    model: &Model<'_>,
    clips: &Used,
    optimizer: Optimizer,
) -> Vec<NotIdentifiable> {
    // A swarm ends with its budget; least squares that do not arrive have lost their way.
    let lost = !finding.arrived && optimizer == Optimizer::LeastSquares;
    finding.not_identifiable(|k| why(finding, k, model, clips).or_else(|| lost.then(|| DID_NOT_ARRIVE.to_owned())))
}

fn why(finding: &Finding<'_>, k: usize, model: &Model<'_>, clips: &Used) -> Option<String> {
    let (unknown, setting) = (&finding.unknowns[k], &finding.settings[k]);
    if unknown.lower >= unknown.upper {
        let joint = setting.joint().map_or(0, |joint| joint + 1);
        return Some(format!("joint {joint} follows its command in no clip: look at the joint, then record again"));
    }
    let moves = match setting.joint() {
        Some(joint) => format!("commands move joint {} by {:.3} rad", joint + 1, commanded(joint, model, clips)),
        None => "the clips move the arm too little or too slowly".into(),
    };
    if finding.fit.information()[(k, k)] <= 0.0 {
        return Some(format!("nothing in these clips depends on it: {moves}"));
    }
    if finding.held[k] {
        return at_bound(finding, k);
    }
    let half = finding.intervals.half_width[k];
    if half.is_infinite() {
        return Some("not identifiable apart from other numbers: only a combination of them shows".into());
    }
    let (size, share) = match setting {
        Setting::Stiffness(_) | Setting::Damping(_) => (finding.fit.shared[k].abs(), OPEN_FROM_SHARE_OF_VALUE),
        _ => (met_width(model, setting).unwrap_or(unknown.upper - unknown.lower), EFFECT_OPEN_FROM),
    };
    if half <= share * size {
        return None;
    }
    let percent = 100.0 * half / size;
    if let Some((name, r)) = finding.partner(k).filter(|(_, r)| r.abs() > ONE_NUMBER) {
        return Some(format!(
            "its 95 % interval is ±{percent:.0} %: only its combination with {name} shows (correlation {r:.3}); record \
             faster motions, and log them faster"
        ));
    }
    let together = finding.together(k, " and");
    Some(format!("its 95 % interval is ±{percent:.0} %:{together} {moves}; record larger and faster motions"))
}

/// A bound where an effect is absent is an answer; any other is the end of the search.
fn at_bound(finding: &Finding<'_>, k: usize) -> Option<String> {
    let (unknown, value) = (&finding.unknowns[k], finding.fit.shared[k]);
    let setting = &finding.settings[k];
    if matches!(setting, Setting::Effect { .. }) && value.abs() <= ABSENT_BELOW * (unknown.upper - unknown.lower) {
        return None;
    }
    let end = finding.nearer_bound(k);
    let remedy = match setting {
        Setting::Stiffness(_) => "widen `stiffness_range` in cell.toml, or ask `calibration diagnose` what else acts",
        Setting::Damping(_) => "widen `damping_range` in cell.toml, or ask `calibration diagnose` what else acts",
        _ => "that is beyond what is plausible, so something else acts",
    };
    Some(format!("the best value lies at or beyond {value:.4}, the {end} bound of the search: {remedy}"))
}

/// Farthest travel of a joint's command in a clip that was fitted [rad].
fn commanded(joint: usize, model: &Model<'_>, clips: &Used) -> f64 {
    let travel = |clip: &usize| {
        let desired = &model.clip(*clip).recorded.desired;
        let values = desired.q.iter().skip(joint).step_by(desired.dof.max(1));
        let [low, high] = extent(values.copied());
        high - low
    };
    clips.split.train.iter().map(travel).fold(0.0, f64::max)
}

/// Width of what is plausible on this arm.
fn met_width(model: &Model<'_>, setting: &Setting) -> Option<f64> {
    let Setting::Effect { name, parameter, index, inverse } = setting else { return None };
    let parameter = find(name)?.parameters.iter().find(|p| p.name == *parameter)?;
    let [lo, hi] = Robot::of(model.arm()).range(parameter, *index);
    Some(if *inverse { lo.recip() } else { hi - lo })
}

/// What to record next: one more clip like those there are, or the same motion twice as large. A joint's answer is nearly linear, so
/// twice the motion is four times the information.
pub(super) fn next(finding: &Finding<'_>, clips: &Used) -> Vec<Advice> {
    let width = |k: usize| {
        let unknown = &finding.unknowns[k];
        finding.intervals.half_width[k] / finding.fit.shared[k].abs().max(LEAST_SIZE * (unknown.upper - unknown.lower))
    };
    let more = finding.fit.clips.iter().zip(&clips.clips.train).flat_map(|(clip, file)| {
        [(1.0, format!("one more clip like {file}")), (4.0, format!("{file} twice as large"))]
            .map(|(times, record)| (record, &clip.information * times))
    });
    finding.advice(width, more)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::test_finding::{Seen, found};

    #[test]
    fn on_a_bound_an_effect_that_is_absent_is_an_answer_and_a_gain_is_open() {
        // The first number is driven to its upper bound, the second to nothing.
        let seen = [Seen { of: [0.1, 0.0], sigma: 0.01 }, Seen { of: [5.0, 5.0], sigma: 0.01 }];
        let effect = twin::effects::registry().iter().find(|effect| effect.stage == twin::effects::Stage::Control);
        let effect = effect.expect("an effect on the arm");
        let parameter = effect.parameters[0].name;
        let effect = Setting::Effect { name: effect.name, parameter, index: None, inverse: false };
        found(&[Setting::Stiffness(0), effect], &seen, |finding| {
            assert!(finding.held == [true; 2] && finding.fit.shared[1] == 0.0, "{:?}", finding.fit.shared);
            assert!(
                at_bound(finding, 0).is_some_and(|why| why.contains("upper bound") && why.contains("stiffness_range"))
            );
            assert_eq!(at_bound(finding, 1), None);
        });
    }
}
