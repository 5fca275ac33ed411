//! Which control period a logged torque belongs to: the one that ends with its row, as the twin tells it, or the one that
//! begins there, as a controller logs what it has just asked for. The log itself tells.

use super::clip::{ArmClip, usual_step};

/// Only logs of every control period can tell [ns].
const EVERY_PERIOD_NS: u64 = 1_500_000;

/// Rows by which logged torques are ahead of the twin's: 1 where the torque asked for follows the state of its own row
/// more closely than the state of the row before.
pub(super) fn lead(clips: &[ArmClip]) -> usize {
    let (mut own, mut before) = (0.0, 0.0);
    for clip in clips {
        if usual_step(&clip.recorded.measured.stamps_ns) > EVERY_PERIOD_NS || clip.recorded.desired.tau.is_empty() {
            continue;
        }
        for joint in (0..clip.recorded.measured.dof).filter(|joint| !clip.dead[*joint]) {
            own += unexplained(clip, joint, 0).ln();
            before += unexplained(clip, joint, 1).ln();
        }
    }
    usize::from(own < before)
}

/// Variance of the torque asked for that position and velocity errors `late` rows before leave unexplained [(N m)²].
fn unexplained(clip: &ArmClip, joint: usize, late: usize) -> f64 {
    let (measured, desired) = (&clip.recorded.measured, &clip.recorded.desired);
    let of = |row: &[f64]| row.get(joint).copied().unwrap_or(0.0);
    let row = |row: usize| {
        let (then, told) = (row.checked_sub(late)?, clip.desired_rows[row]?);
        let error = of(desired.q_row(clip.desired_rows[then]?)) - of(measured.q_row(then));
        let rate = match (desired.dq_row(clip.desired_rows[then]?), measured.dq_row(then)) {
            (Some(desired), Some(measured)) => of(desired) - of(measured),
            _ => 0.0,
        };
        Some([error, rate, 1.0, of(desired.tau_row(told)?)])
    };
    let mut sums = [[0.0; 4]; 4];
    for [a, b, c, d] in (0..measured.len()).filter_map(row) {
        let values = [a, b, c, d];
        for (i, sums) in sums.iter_mut().enumerate() {
            sums.iter_mut().zip(values).for_each(|(sum, value)| *sum += values[i] * value);
        }
    }
    // Elimination of the three regressors leaves the residual sum in the last corner.
    for k in 0..3 {
        let pivot = sums[k];
        if pivot[k] > 0.0 {
            for row in &mut sums[k + 1..] {
                let share = row[k] / pivot[k];
                row.iter_mut().zip(pivot).for_each(|(value, pivot)| *value -= share * pivot);
            }
        }
    }
    sums[3][3].max(1e-12)
}
