//! Whose the object's gap is: the object is simulated once more under the arm that was recorded, moved along its measured motion. What
//! is gone then was the arm's; only what stays belongs to the hit, the slide and the camera.

use crate::answer::diagnosis::StageTest;
use crate::diagnose::work::DiagnoseError;
use crate::words::in_unit;
use inference::admit::{Admitted, torques};
use shared_mem::cell::Cell;
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;
use twin::effects::{Stage, find};
use twin::replay::{Gap, Replayer};

/// Of clips under these parameters; `None` where no arm hits an object, or its motion cannot be followed.
///
/// # Errors
/// [`DiagnoseError`] when a clip cannot be replayed.
pub(in crate::diagnose) fn stage_test(
    cell: &Cell,
    theta: &Theta,
    admitted: &Admitted,
    clips: &[usize],
) -> Result<Option<StageTest>, DiagnoseError> {
    let Some(following) = torques::tracking_cell(cell).filter(|_| admitted.with_object && cell.robot.is_some()) else {
        return Ok(None);
    };
    let recorded: Option<Vec<Clip>> =
        clips.iter().map(|clip| torques::followed(admitted.clips[*clip].clone())).collect();
    let Some(recorded) = recorded else { return Ok(None) };
    let simulated: Vec<Clip> = clips.iter().map(|clip| admitted.clips[*clip].clone()).collect();
    let simulated = gaps(&Replayer::new(cell, Some(theta))?, simulated)?;
    let recorded = gaps(&Replayer::new(&following, Some(&without_arm(theta)))?, recorded)?;
    Ok(judged(&simulated, &recorded))
}

/// What acts beyond the arm.
fn without_arm(theta: &Theta) -> Theta {
    let mut theta = Theta { arm: None, ..theta.clone() };
    theta.effects.retain(|given| find(&given.name).is_some_and(|effect| effect.stage != Stage::Control));
    theta
}

fn gaps(replayer: &Replayer, clips: Vec<Clip>) -> Result<Vec<Gap>, DiagnoseError> {
    clips.into_iter().map(|clip| Ok(replayer.replay(clip)?.2.gap)).collect()
}

fn judged(simulated: &[Gap], recorded: &[Gap]) -> Option<StageTest> {
    let mean = |gaps: &[Gap]| {
        let all: Vec<f64> = gaps.iter().filter_map(|gap| gap.object_add_m).collect();
        (!all.is_empty()).then(|| all.iter().sum::<f64>() / all.len() as f64)
    };
    let (simulated_arm_add_m, recorded_arm_add_m) = (mean(simulated)?, mean(recorded)?);
    let untouched = recorded.iter().filter(|gap| gap.contact_time_s.is_none()).count();
    let mut test = StageTest {
        simulated_arm_add_m,
        recorded_arm_add_m,
        of_the_arm: (1.0 - recorded_arm_add_m / simulated_arm_add_m.max(f64::MIN_POSITIVE)).max(0.0),
        clips: recorded.len(),
        untouched,
        text: String::new(),
    };
    test.text = sentence(&test);
    Some(test)
}

fn sentence(test: &StageTest) -> String {
    let [simulated, recorded] = [test.simulated_arm_add_m, test.recorded_arm_add_m].map(|add| in_unit("m", add));
    let of_the_arm = test.of_the_arm.min(1.0);
    let [arm, rest] = [of_the_arm, 1.0 - of_the_arm].map(|share| format!("{:.0} %", 100.0 * share));
    let whose = if test.untouched < test.clips {
        "hit, slide, camera, or where tool and table are"
    } else {
        "where poses, tool or table are"
    };
    let mut text = format!(
        "Under the recorded motion of the arm the object is {recorded} off (ADD), under the simulated one {simulated}: {arm} of its gap is \
         the arm's, and {rest} stay under the recorded arm and belong to {whose}."
    );
    if test.untouched > 0 {
        text += &format!(
            " In {} of {} clips not even the recorded arm touches the object: poses, tool or table are elsewhere there, and such \
             clips say nothing about hit and slide.",
            test.untouched, test.clips
        );
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_bench::{shipped, with_effect};
    use inference::likelihood::setting;
    use worlds::session::record;
    use worlds::world::{Kind, World};

    /// The test of strokes in a world under what the laboratory knows, with the true gains and object.
    fn of(world: &World) -> StageTest {
        let clips = record(world, 2).expect("a session");
        let admitted = Admitted::of(clips, vec![String::new(); 2], true);
        let mut theta = setting::complete(&world.cell, None).expect("a cell");
        (theta.arm, theta.object) = (world.hidden.arm.clone(), world.hidden.object.clone());
        stage_test(&world.cell, &theta, &admitted, &[0, 1]).expect("an answer").expect("an object")
    }

    #[test]
    fn a_gap_that_the_arm_makes_is_gone_under_the_recorded_arm_and_one_of_the_table_stays() {
        let cell = shipped();
        let late = of(&with_effect("command_delay", 3, Kind::Strokes, &cell));
        assert!(late.recorded_arm_add_m < late.simulated_arm_add_m, "{late:?}");
        let tilted = of(&with_effect("table_tilt", 3, Kind::Strokes, &cell));
        assert!(tilted.of_the_arm < 0.5 && tilted.text.contains("stay under the recorded arm"), "{tilted:?}");
        assert_eq!((late.untouched, tilted.untouched), (0, 0));
    }

    #[test]
    fn clips_that_the_recorded_arm_does_not_touch_are_reported() {
        let gap = |add: f64, touched: bool| Gap {
            object_add_m: Some(add),
            contact_time_s: touched.then_some(0.5),
            ..Gap::default()
        };
        let test = judged(&[gap(0.05, false), gap(0.03, true)], &[gap(0.05, false), gap(0.001, true)]).expect("a test");
        assert!(test.text.contains("In 1 of 2 clips not even the recorded arm"), "{}", test.text);
        let arm = judged(&[gap(0.01, true)], &[gap(0.001, true)]).expect("a test");
        assert!(
            arm.text.contains("90 % of its gap is the arm's, and 10 % stay under the recorded arm"),
            "{}",
            arm.text
        );
        let little = judged(&[gap(0.05, true)], &[gap(0.043, true)]).expect("a test");
        assert!(
            little.text.contains("43.0 mm off") && little.text.contains("14 % of its gap is the arm's, and 86 % stay"),
            "{}",
            little.text
        );
    }
}
