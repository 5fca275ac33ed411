//! How much of long clips counts: a session of hours says no more about its gap than its liveliest minutes, and every
//! candidate simulates all that counts a hundred times.

use crate::likelihood::smoothing;
use shared_mem::cell::ClipKind;
use shared_mem::recording::{Clip, JointSeries};

/// So much motion counts in all [s]. Residuals of a model that is not exact are alike over tenths of a second, so this holds some
/// hundred that say something of their own in every channel, more than the numbers of any hypothesis; it is three times what the
/// simulated sessions have in which effects are separated (34 s).
const ENOUGH_MOTION: f64 = 96.0;
/// Commands from before the part that counts are kept for so long [ns] (a choice): some are still on their way.
const COMMANDS_BEFORE_NS: u64 = 500_000_000;
/// Parts of a clip that are compared begin this share of their length apart (a choice).
const PARTS_APART: f64 = 0.05;

/// Cuts the longest clips of arms alone to one length, so that 96 s are left: of each the part in which its commands move
/// the joints most. What was done, for the reader.
pub fn liveliest(clips: &mut [Clip]) -> Option<String> {
    let seconds: Vec<f64> = clips.iter().map(|clip| clip.measured.duration()).collect();
    let most = equal_share(&seconds)?;
    let long = |clip: &Clip| clip.kind != ClipKind::ControlHitSlide && clip.measured.duration() > most;
    let mut cut = 0;
    for clip in clips.iter_mut().filter(|clip| long(clip)) {
        *clip = part(clip, liveliest_part(&clip.desired, &clip.measured, most));
        cut += 1;
    }
    (cut > 0).then(|| {
        let all = seconds.iter().sum::<f64>();
        let counts = seconds.iter().map(|seconds| seconds.min(most)).sum::<f64>();
        format!(
            "of {cut} long clips the {most:.1} s count in which their commands move the joints most, {counts:.0} s of {all:.0} s in \
             all: the others would take far longer and say little more; `twin replay` takes them whole"
        )
    })
}

/// A clip between two stamps [ns], with the commands that are still on their way when it begins, and the one that holds then. It begins
/// as fast as the rows on both sides of its first one say: what a servo reports as its velocity comes in steps of a few
/// hundredths of a rad/s, and late.
pub(super) fn part(clip: &Clip, [from_ns, to_ns]: [u64; 2]) -> Clip {
    let commands = &clip.desired.stamps_ns;
    let holds =
        commands.partition_point(|stamp| *stamp <= from_ns.saturating_sub(COMMANDS_BEFORE_NS)).saturating_sub(1);
    let commanded_from_ns = commands.get(holds).copied().unwrap_or_default();
    let (mut measured, desired) =
        (clip.measured.between(from_ns..=to_ns), clip.desired.between(commanded_from_ns..=to_ns));
    if let (Some(first), Some(half)) = (measured.stamps_ns.first(), smoothing::half_width(&clip.measured.stamps_ns)) {
        // At an edge of the clip rows lie on one side alone, and a slope through them is late.
        let inside = clip.measured.stamps_ns[0] + half <= *first;
        let speeds = smoothing::motion(&clip.measured, &[*first], half).dq;
        measured.dq.iter_mut().zip(speeds).filter(|_| inside).for_each(|(dq, smoothed)| *dq = smoothed);
    }
    Clip { measured, desired, ..clip.clone() }
}

/// The length beyond which clips are cut so that all of them together last [`ENOUGH_MOTION`]; `None` where they are no longer.
fn equal_share(seconds: &[f64]) -> Option<f64> {
    let mut ascending = seconds.to_vec();
    ascending.sort_unstable_by(f64::total_cmp);
    let mut left = ENOUGH_MOTION;
    for (place, length) in ascending.iter().enumerate() {
        let share = left / (ascending.len() - place) as f64;
        if *length > share {
            return Some(share);
        }
        left -= length;
    }
    None
}

/// First and last stamp of the part of `most` seconds in which commands go the longest way [ns].
fn liveliest_part(commands: &JointSeries, measured: &JointSeries, most: f64) -> [u64; 2] {
    let (Some(first), Some(last)) = (measured.stamps_ns.first(), measured.stamps_ns.last()) else {
        return [0, u64::MAX];
    };
    let length_ns = (most * 1e9) as u64;
    let step_ns = ((most * PARTS_APART * 1e9) as usize).max(1);
    let starts = (*first..=last.saturating_sub(length_ns).max(*first)).step_by(step_ns);
    let way = ways(commands);
    // Behind the last command nothing is sent any farther.
    let at = |ns: u64| way[commands.stamps_ns.partition_point(|stamp| *stamp < ns).min(way.len() - 1)];
    let gone = |from: u64| at(from + length_ns) - at(from);
    // Of several that are alike the first.
    let from = starts.reduce(|best, next| if gone(next) > gone(best) { next } else { best }).unwrap_or(*first);
    [from, from + length_ns]
}

/// How far the joints were sent before each row, together [rad].
fn ways(commands: &JointSeries) -> Vec<f64> {
    let mut gone = vec![0.0];
    for row in 1..commands.len() {
        let step = commands.q_row(row).iter().zip(commands.q_row(row - 1)).map(|(to, from)| (to - from).abs());
        gone.push(gone[row - 1] + step.sum::<f64>());
    }
    gone
}

#[cfg(test)]
mod tests {
    use super::super::test_clip::of_one_joint;
    use super::*;
    use shared_mem::time::seconds_between;

    /// A joint that rests but for eight seconds of swinging from `lively` s on.
    fn clip(seconds: usize, lively: f64) -> Clip {
        let stamps_ns = (0..seconds as u64 * 100).map(|i| i * 10_000_000).collect();
        of_one_joint(
            stamps_ns,
            |t| if (0.0..8.0).contains(&(t - lively)) { 0.3 * (3.0 * (t - lively)).sin() } else { 0.0 },
        )
    }

    #[test]
    fn what_is_short_stays_and_the_long_share_the_rest() {
        assert_eq!(equal_share(&[6.0; 16]), None);
        assert_eq!(equal_share(&[60.0; 16]), Some(6.0));
        // 6 s and 12 s of the 96 are taken; two share the 78 that are left.
        assert_eq!(equal_share(&[500.0, 6.0, 12.0, 300.0]), Some(39.0));
    }

    #[test]
    fn of_a_long_clip_the_part_is_kept_in_which_the_joints_move() {
        let mut clips = vec![clip(300, 100.0), clip(6, 0.0), clip(300, 250.0), clip(300, 0.0)];
        let short = clips[1].clone();
        let said = liveliest(&mut clips).expect("they are long");
        assert!(said.contains("3 long clips the 30.0 s") && said.contains("96 s of 906 s"), "{said}");
        assert_eq!(clips[1], short);
        for (clip, lively) in [(&clips[0], 100.0), (&clips[2], 250.0), (&clips[3], 0.0)] {
            let (from, to) = (clip.measured.stamps_ns[0] as f64 * 1e-9, clip.measured.duration());
            assert!(from <= lively + 1e-9 && from + to >= lively + 7.9, "{from} s, {to} s long");
            assert!((29.9..30.1).contains(&to), "{to}");
            let before = seconds_between(clip.desired.stamps_ns[0], clip.measured.stamps_ns[0]);
            // The command that holds half a second before is at most a row and a half older.
            let least = 0.5_f64.min(from);
            assert!((least - 1e-9..least + 0.0201).contains(&before), "{before}");
        }
        assert_eq!(liveliest(&mut clips), None, "once is enough");
    }

    #[test]
    fn a_part_begins_as_fast_as_the_joint_moved_there_and_a_clip_as_it_was_logged() {
        let stamps_ns = (0..200).map(|i| i * 20_000_000).collect();
        let mut whole = of_one_joint(stamps_ns, |t| 0.3 * (3.0 * t).sin());
        // As a servo reports it: a step behind the motion, in steps of 0.1 rad/s.
        let speed = |row: usize| 0.9 * (3.0 * 0.02 * row as f64).cos();
        whole.measured.dq = (0..200).map(|row: usize| (10.0 * speed(row.saturating_sub(1))).round() / 10.0).collect();
        let cut = part(&whole, [800_000_000, 3_000_000_000]).measured;
        assert!((cut.dq[0] - speed(40)).abs() < 2e-3 && (whole.measured.dq[40] - speed(40)).abs() > 0.02);
        assert_eq!(cut.dq[1..], whole.measured.dq[41..151]);
        assert_eq!(part(&whole, [0, 3_000_000_000]).measured.dq[0], whole.measured.dq[0]);
    }
}
