//! Rows whose stamps lie far from those of all the others: a header that nobody filled in, a day that was read wrongly, a
//! clock that was set while it stamped. Left in, they would make a clip of seconds one of days, all of which would have to
//! be simulated.

use crate::statistics::usual_step_ns;
use crate::time::seconds_between;

/// A few rows that are so far away from the others [ns], and by so many usual steps as are a hole in commands, were stamped
/// wrongly.
const APART_NS: u64 = 1_000_000_000;
const APART_STEPS: u64 = 20;
/// One clip has no pause of this length [ns]: what lies before and behind it is two recordings.
const LONGEST_PAUSE_NS: u64 = 60_000_000_000;
/// How many rows are a few: this share of all, and one of a short series.
const FEW: f64 = 0.01;
/// With a smaller share of its rows left, a clip is not what was recorded.
const LEAST_KEPT: f64 = 0.25;

/// The rows of one recording among others.
#[derive(Debug, Clone, PartialEq)]
pub(in super::super) struct Outlying {
    /// Rows that are kept, ascending.
    pub(in super::super) kept: Vec<usize>,
    /// Whether those that are not are few.
    pub(in super::super) few: bool,
    /// What there is to say about them.
    pub(in super::super) warning: String,
}

/// Looks for outlying rows in stamps [ns] of any order; `None` where all lie together.
///
/// # Errors
/// A sentence where the rows lie in so many places that none of them is the clip.
pub(in super::super) fn find(stamps_ns: &[u64], topic: &str) -> Result<Option<Outlying>, String> {
    let mut sorted = stamps_ns.to_vec();
    sorted.sort_unstable();
    let Some(usual) = usual_step_ns(&sorted) else { return Ok(None) };
    let apart = usual.saturating_mul(APART_STEPS).max(APART_NS);
    let longest = sorted.iter().zip(sorted.iter().skip(1)).map(|(a, b)| b - a).max();
    if longest.is_none_or(|longest| longest <= apart.min(LONGEST_PAUSE_NS)) {
        return Ok(None);
    }
    let total = stamps_ns.len();
    let few = ((total as f64 * FEW) as usize).max(1);
    let recordings = parts(&sorted, LONGEST_PAUSE_NS);
    let Some(recording) = most(&recordings) else { return Ok(None) };
    if (recording.len() as f64) < LEAST_KEPT * total as f64 {
        return Err(format!(
            "the {total} rows lie in {} places more than {:.0} s apart, so none of them is the clip: let one clock stamp \
             them and record again, or cut the clip",
            recordings.len(),
            seconds_between(0, LONGEST_PAUSE_NS)
        ));
    }
    let bursts = parts(recording, apart);
    let largest = most(&bursts).map_or(0, <[u64]>::len);
    let kept_bursts: Vec<_> = bursts.into_iter().filter(|burst| burst.len() > few || burst.len() == largest).collect();
    let inside =
        |stamp: &u64| kept_bursts.iter().any(|burst| burst.first() <= Some(stamp) && Some(stamp) <= burst.last());
    let (kept, out): (Vec<usize>, Vec<usize>) = (0..total).partition(|row| stamps_ns.get(*row).is_some_and(&inside));
    let Some(first) = out.first() else { return Ok(None) };
    let far = far_from(recording, stamps_ns.get(*first).copied().unwrap_or(0));
    let few = out.len() <= few;
    let remedy =
        if few { "look at what stamps them" } else { "keep the clock as it is while recording, or cut the clip there" };
    let warning = format!(
        "`{topic}`: {} of {total} rows left out, whose stamps lie far from all others (row {first}: {far}); {remedy}",
        out.len()
    );
    Ok(Some(Outlying { kept, few, warning }))
}

/// Ascending stamps, parted where two lie more than `pause_ns` apart.
fn parts(sorted: &[u64], pause_ns: u64) -> Vec<&[u64]> {
    sorted.chunk_by(|a, b| b - a <= pause_ns).collect()
}

/// The part with most stamps, the first of several.
fn most<'a>(parts: &[&'a [u64]]) -> Option<&'a [u64]> {
    parts.iter().rev().max_by_key(|part| part.len()).copied()
}

/// Where a stamp lies beside those of a recording.
fn far_from(recording: &[u64], stamp: u64) -> String {
    let (first, last) = (recording.first().copied().unwrap_or(0), recording.last().copied().unwrap_or(0));
    match stamp {
        0 => "stamped 0".into(),
        stamp if stamp < first => format!("{:.1} s before them", seconds_between(stamp, first)),
        stamp if stamp > last => format!("{:.1} s behind them", seconds_between(last, stamp)),
        _ => "alone between them".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const DAY: u64 = 86_400_000_000_000;
    const BEGIN: u64 = 1_700_000_000_000_000_000;

    fn stamps(rows: u64) -> Vec<u64> {
        (0..rows).map(|i| BEGIN + i * 1_000_000).collect()
    }

    #[test]
    fn one_stamp_of_zero_or_a_day_off_is_left_out_wherever_it_stands() {
        for row in [0, 1, 250, 499] {
            for (wrong, said) in [
                (0, "stamped 0"),
                (BEGIN + DAY, "86399.5 s behind them"),
                (BEGIN - DAY, "86400.0 s before them"),
                (u64::MAX, "16746744073.2 s behind them"),
            ] {
                let mut stamps = stamps(500);
                stamps[row] = wrong;
                let found = find(&stamps, "/q").expect("a clip").expect("an outlying row");
                assert_eq!(found.kept, (0..500).filter(|i| *i != row).collect::<Vec<_>>());
                assert!(found.few && found.warning.contains("1 of 500 rows"), "{}", found.warning);
                let at_an_end = row == 0 || row == 499;
                assert!(at_an_end || found.warning.contains(&format!("row {row}: {said}")), "{}", found.warning);
            }
        }
    }

    #[test]
    fn lost_rows_slow_logs_and_pauses_are_no_fault() {
        assert_eq!(find(&[], "/q"), Ok(None));
        assert_eq!(find(&[5], "/q"), Ok(None));
        assert_eq!(find(&[0; 9], "/q"), Ok(None));
        let mut paused = stamps(500);
        paused[250..].iter_mut().for_each(|stamp| *stamp += 50_000_000_000);
        assert_eq!(find(&paused, "/q"), Ok(None));
        let slow: Vec<u64> = (0..40).map(|i| BEGIN + i * 2_000_000_000).collect();
        assert_eq!(find(&slow, "/q"), Ok(None));
        let mut unsorted = stamps(500);
        unsorted.swap(100, 140);
        assert_eq!(find(&unsorted, "/q"), Ok(None));
    }

    #[test]
    fn of_two_recordings_the_longer_is_kept_and_of_many_none() {
        let mut two = stamps(500);
        two[..200].iter_mut().for_each(|stamp| *stamp -= BEGIN);
        let found = find(&two, "/q").expect("a clip").expect("two recordings");
        assert_eq!(found.kept, (200..500).collect::<Vec<_>>());
        assert!(!found.few && found.warning.contains("200 of 500 rows"), "{}", found.warning);
        let many: Vec<u64> = (0..500).map(|i| BEGIN + i * DAY).collect();
        let error = find(&many, "/q").expect_err("no clip");
        assert!(error.contains("500 places"), "{error}");
    }

    #[test]
    fn a_row_alone_within_a_pause_is_left_out() {
        let mut stamps = stamps(500);
        stamps[250..].iter_mut().for_each(|stamp| *stamp += 20_000_000_000);
        stamps[30] = BEGIN + 9_000_000_000;
        let found = find(&stamps, "/q").expect("a clip").expect("an outlying row");
        assert!(found.kept.len() == 499 && !found.kept.contains(&30), "{}", found.warning);
        assert!(found.warning.contains("alone between them"), "{}", found.warning);
    }
}
