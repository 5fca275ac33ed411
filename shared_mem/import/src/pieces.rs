//! One long log of many motions as clips: cut where the arm rests, or, where it never does, into parts of equal length.

use crate::mapping::Pieces;
use shared_mem::cell::ClipKind;
use shared_mem::recording::{Clip, JointSeries};
use shared_mem::time::seconds_between;

/// A log that lasts longer holds more than one motion [s]. A choice: clips that `calibration capture` plans last 5 to 10 s.
const LONG: f64 = 24.0;
/// No piece is shorter [s]: enough for a motion from rest to rest, and twice what a part of a diagnosis lasts at least.
const SHORTEST: f64 = 3.0;
/// Parts of a log without rests last at least this long [s].
const PART: f64 = 6.0;
/// Parts of a log without rests, where it is long enough for them: a diagnosis splits eight commands, and confirms on some.
const PARTS: usize = 10;
/// Joints rest for at least this long between two motions [s].
const REST: f64 = 0.25;
/// A joint that moves slower than this share of the fastest of all rests.
const STILL: f64 = 0.01;
/// Commands from before a piece are kept for so long: some are still on their way when it begins [ns].
const BEFORE_NS: u64 = 500_000_000;

/// How a clip is cut if nobody says otherwise, and why; `None` where it is short, or no arm moves in it alone.
pub(crate) fn propose(clip: &Clip) -> Option<(Pieces, String)> {
    let seconds = clip.measured.duration();
    if clip.kind != ClipKind::Excitation || seconds < LONG {
        return None;
    }
    let count = cuts(clip, Pieces::AtRests).len() + 1;
    let (pieces, why) = if count > 1 {
        (Pieces::AtRests, format!("it rests between motions: {count} clips"))
    } else {
        let count = cuts(clip, Pieces::Equal).len() + 1;
        (Pieces::Equal, format!("it never rests for {REST} s, so it is cut into {count} parts of equal length"))
    };
    let what = "; clips of different commands are what a diagnosis fits, chooses and confirms with. `whole` leaves the log one clip";
    Some((pieces, format!("the log lasts {seconds:.0} s: {why}{what}")))
}

/// The clip in pieces, in their order; whole where there is one.
pub(crate) fn cut(clip: Clip, pieces: Pieces) -> Vec<Clip> {
    let cuts = cuts(&clip, pieces);
    if cuts.is_empty() {
        return vec![clip];
    }
    let ends = cuts.iter().copied().chain([u64::MAX]);
    let begins = [0].into_iter().chain(cuts.iter().copied());
    let mut parts: Vec<Clip> = begins.zip(ends).map(|(from_ns, to_ns)| part(&clip, from_ns, to_ns)).collect();
    // What is odd about the log is said once.
    parts.iter_mut().skip(1).for_each(|part| part.warnings.clear());
    parts
}

fn part(clip: &Clip, from_ns: u64, to_ns: u64) -> Clip {
    let measured = clip.measured.between(from_ns..=to_ns.saturating_sub(1));
    let commands = &clip.desired.stamps_ns;
    let holds = commands.partition_point(|stamp| *stamp <= from_ns.saturating_sub(BEFORE_NS)).saturating_sub(1);
    let commanded_ns = commands.get(holds).copied().unwrap_or(from_ns).min(from_ns);
    let desired = clip.desired.between(commanded_ns..=to_ns.saturating_sub(1));
    Clip { measured, desired, ..clip.clone() }
}

/// Stamps at which pieces begin, but for the first [ns].
fn cuts(clip: &Clip, pieces: Pieces) -> Vec<u64> {
    let (Some(first), Some(last)) = (clip.measured.stamps_ns.first(), clip.measured.stamps_ns.last()) else {
        return Vec::new();
    };
    let seconds = seconds_between(*first, *last);
    match pieces {
        Pieces::Whole => Vec::new(),
        Pieces::Equal => {
            let count = PARTS.min((seconds / PART) as usize).max(1) as u64;
            (1..count).map(|part| first + (last - first) / count * part).collect()
        }
        Pieces::AtRests => {
            let moves = if clip.desired.is_empty() { &clip.measured } else { &clip.desired };
            let mut found: Vec<u64> = Vec::new();
            for middle in rests(moves) {
                let before = found.last().unwrap_or(first);
                if seconds_between(*before, middle) >= SHORTEST && seconds_between(middle, *last) >= SHORTEST {
                    found.push(middle);
                }
            }
            found
        }
    }
}

/// The middle of each rest [ns].
fn rests(series: &JointSeries) -> Vec<u64> {
    let fastest_of = |row: usize, other: usize| {
        let dt = seconds_between(series.stamps_ns[row], series.stamps_ns[other]);
        let steps = series.q_row(row).iter().zip(series.q_row(other)).map(|(a, b)| (a - b).abs());
        if dt > 0.0 { steps.fold(0.0, f64::max) / dt } else { 0.0 }
    };
    // Over the time of half a rest, so that the noise of encoders is no motion.
    let stride = stride(series);
    let speeds: Vec<f64> = (stride..series.len()).map(|row| fastest_of(row - stride, row)).collect();
    let fastest = speeds.iter().fold(0.0, |m: f64, v| m.max(*v));
    let mut middles = Vec::new();
    let mut begin = None;
    for row in 0..=speeds.len() {
        let is_still = speeds.get(row).is_some_and(|speed| *speed < STILL * fastest);
        match (is_still, begin) {
            (true, None) => begin = Some(row),
            (false, Some(from)) => {
                // A speed belongs to the rows from its own to `stride` behind it.
                let (from_ns, to_ns) =
                    (series.stamps_ns[from], series.stamps_ns[(row - 1 + stride).min(series.len() - 1)]);
                if seconds_between(from_ns, to_ns) >= REST {
                    middles.push(from_ns + (to_ns - from_ns) / 2);
                }
                begin = None;
            }
            _ => {}
        }
    }
    middles
}

/// Rows within half a rest.
fn stride(series: &JointSeries) -> usize {
    let rows = series.len().saturating_sub(1).max(1) as f64;
    ((0.5 * REST * rows / series.duration().max(1e-9)) as usize).clamp(1, series.len().saturating_sub(1).max(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::origin::Origins;
    use shared_mem::recording::ObjectSeries;

    /// At 100 Hz; `commanded`: whether commands were logged.
    fn clip(seconds: u32, commanded: bool, of: impl Fn(f64) -> f64) -> Clip {
        let rows = seconds * 100;
        let stamps_ns: Vec<u64> = (0..=u64::from(rows)).map(|i| 1_000_000_000 + i * 10_000_000).collect();
        let q = (0..=rows).map(|i| of(f64::from(i) * 0.01)).collect();
        let measured = JointSeries { stamps_ns, dof: 1, q, ..JointSeries::default() };
        let desired = if commanded { measured.clone() } else { JointSeries::default() };
        Clip {
            file: "long.csv".into(),
            kind: ClipKind::Excitation,
            joint_names: vec!["joint1".into()],
            desired,
            measured,
            torques_end_at_rows: false,
            object: ObjectSeries::default(),
            others: Vec::new(),
            origins: Origins::default(),
            warnings: Vec::new(),
            damage: None,
        }
    }

    /// Six seconds of motion, then two of rest.
    fn strokes(t: f64) -> f64 {
        let (number, within) = ((t / 8.0).floor(), t % 8.0);
        number + if within < 6.0 { 0.5 - 0.5 * (std::f64::consts::PI * within / 6.0).cos() } else { 1.0 }
    }

    #[test]
    fn a_long_log_is_cut_where_it_rests() {
        for commanded in [true, false] {
            let long = clip(64, commanded, strokes);
            let (pieces, why) = propose(&long).expect("many motions");
            assert!(pieces == Pieces::AtRests && why.contains("8 clips") && why.contains("`whole`"), "{why}");
            let parts = cut(long.clone(), pieces);
            assert_eq!(parts.len(), 8);
            assert_eq!(parts.iter().map(|part| part.measured.len()).sum::<usize>(), long.measured.len());
            for part in &parts[1..7] {
                assert!((7.0..9.0).contains(&part.measured.duration()), "{}", part.measured.duration());
                let [begins, ends] =
                    [0, part.measured.len() - 3].map(|row| part.measured.q[row + 1] - part.measured.q[row]);
                assert!(begins.abs() < 1e-4 && ends.abs() < 1e-4, "{begins} {ends}");
                let led = part.desired.stamps_ns.first().is_none_or(|first| *first <= part.measured.stamps_ns[0]);
                assert!(led && part.desired.is_empty() != commanded);
            }
            assert_eq!(cut(long, Pieces::Whole).len(), 1);
        }
    }

    #[test]
    fn a_long_log_without_rests_is_cut_into_equal_parts_and_a_short_one_stays_whole() {
        let wave = |t: f64| (2.0 * t).sin() + (3.1 * t).cos();
        let (pieces, why) = propose(&clip(60, true, wave)).expect("long");
        assert!(pieces == Pieces::Equal && why.contains("10 parts"), "{why}");
        assert_eq!(cut(clip(60, true, wave), pieces).len(), 10);
        assert_eq!(propose(&clip(10, true, wave)), None);
        let strokes = Clip { kind: ClipKind::ControlHitSlide, ..clip(64, true, strokes) };
        assert_eq!(propose(&strokes), None);
    }
}
