//! What is odd about a clip's poses that can be used all the same, one sentence each with the remedy. Base frame, SI.

use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::{Clip, ObjectSeries};
use twin::scene::ObjectModel;

/// Fewest poses a second that show a slide.
const SLOWEST_TRACKER: f64 = 20.0;
/// Poses over which the last speed is taken [1], and a speed at which an object has not come to rest [m/s].
const LAST_POSES: usize = 4;
const STILL_MOVING: f64 = 0.05;
/// An object that stands this far above its table or in it does so by more than a tracker's error [m].
const OFF_TABLE: f64 = 8e-3;

/// Remarks on a clip.
pub(super) fn oddities(clip: &Clip, cell: &Cell) -> Vec<String> {
    [slow(&clip.object), cut_short(&clip.object), off_table(clip, cell)].into_iter().flatten().collect()
}

/// Usual number of poses a second.
pub(super) fn rate(series: &ObjectSeries) -> Option<f64> {
    let mut steps: Vec<u64> = series.stamps_ns.windows(2).map(|w| w[1] - w[0]).collect();
    steps.sort_unstable();
    steps.get(steps.len() / 2).map(|step| 1e9 / *step as f64)
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
    let seconds = |row: usize| (series.stamps_ns[row] - series.stamps_ns[0]) as f64 * 1e-9;
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

/// Before it is hit the object's lowest point is on the table.
fn off_table(clip: &Clip, cell: &Cell) -> Option<String> {
    let (table, pose) = (cell.table?, clip.object.poses.first()?.isometry());
    let model = ObjectModel::new(cell, None).ok()??;
    let lowest = model.shape.triangles().0.iter().map(|corner| (pose * corner).z).fold(f64::INFINITY, f64::min);
    let above = lowest - table.height;
    (clip.kind == ClipKind::ControlHitSlide && above.abs() > OFF_TABLE).then(|| {
        format!(
            "the object stands {:.0} mm {} the table, and was set onto it: `table.height` or the object's size in cell.toml is \
             wrong, or the poses are in another frame or not of its middle",
            above.abs() * 1e3,
            if above > 0.0 { "above" } else { "inside" }
        )
    })
}

#[cfg(test)]
mod tests {
    use super::super::test_clip::{cell, clip};
    use super::*;

    fn told(change: impl Fn(usize, &mut nalgebra::Isometry3<f64>), rows: usize) -> Vec<String> {
        let mut clip = clip(change);
        clip.object.stamps_ns.truncate(rows);
        clip.object.poses.truncate(rows);
        oddities(&clip, &cell())
    }

    #[test]
    fn what_is_odd_is_told_with_what_to_do() {
        assert_eq!(told(|_, _| {}, 90), [""; 0]);
        let cut = told(|_, _| {}, 45);
        assert!(cut.len() == 1 && cut[0].contains("still moves at") && cut[0].contains("camera"), "{cut:?}");
        let high = told(|_, pose| pose.translation.vector.z += 0.02, 90);
        assert!(high.len() == 1 && high[0].contains("20 mm above the table"), "{high:?}");
        let deep = told(|_, pose| pose.translation.vector.z -= 0.02, 90);
        assert!(deep[0].contains("20 mm inside the table"), "{deep:?}");
    }
}
