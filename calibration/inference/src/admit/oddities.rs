//! What is odd about a clip's poses that can be used all the same, one sentence each with the remedy. Base frame, SI.

use crate::statistics::median;
use shared_mem::recording::ObjectSeries;
use shared_mem::time::seconds_between;

/// Fewest poses a second that show a slide [Hz] (a choice).
const SLOWEST_TRACKER: f64 = 20.0;
/// Poses over which the last speed is taken [1], and a speed at which an object has not come to rest [m/s] (choices).
const LAST_POSES: usize = 4;
const STILL_MOVING: f64 = 0.05;

/// Remarks on a clip's poses.
pub(super) fn oddities(series: &ObjectSeries) -> Vec<String> {
    [slow(series), cut_short(series)].into_iter().flatten().collect()
}

/// Usual number of poses a second.
pub(super) fn rate(series: &ObjectSeries) -> Option<f64> {
    median(series.stamps_ns.windows(2).map(|pair| (pair[1] - pair[0]) as f64)).map(|step_ns| 1e9 / step_ns)
}

fn slow(series: &ObjectSeries) -> Option<String> {
    let rate = rate(series).filter(|rate| *rate < SLOWEST_TRACKER)?;
    Some(format!(
        "the object was tracked at {rate:.0} Hz: a slide shows in a few poses, and intervals are wide; track at 30 Hz or more"
    ))
}

/// The poses end while the object moves.
fn cut_short(series: &ObjectSeries) -> Option<String> {
    let last = series.len().checked_sub(1)?;
    let before = last.checked_sub(LAST_POSES)?;
    let seconds = |row: usize| seconds_between(series.stamps_ns[0], series.stamps_ns[row]);
    let place = |row: usize| series.poses[row].isometry().translation.vector;
    let speed = (place(last) - place(before)).norm() / (seconds(last) - seconds(before));
    (speed > STILL_MOVING).then(|| {
        format!(
            "the object is seen until {:.2} s only, when it still moves at {speed:.2} m/s: where it comes to rest is not \
             known; keep it in the camera's view",
            seconds(last)
        )
    })
}

#[cfg(test)]
mod tests {
    use super::super::test_object::clip;
    use super::*;

    fn said(rows: usize) -> Vec<String> {
        oddities(&clip(|_, _| {}).object.select_rows(&(0..rows).collect::<Vec<_>>()))
    }

    #[test]
    fn poses_that_end_while_the_object_moves_or_come_slowly_are_told_with_what_to_do() {
        assert_eq!(said(90), [""; 0]);
        let cut = said(45);
        assert!(cut.len() == 1 && cut[0].contains("still moves at") && cut[0].contains("camera"), "{cut:?}");
        let slow = oddities(&clip(|_, _| {}).object.select_rows(&(0..90).step_by(4).collect::<Vec<_>>()));
        assert!(slow.len() == 1 && slow[0].contains("15 Hz"), "{slow:?}");
    }
}
