//! A clock that was set back while it stamped: rows behind the step repeat a time that has been, and sorting would mix them.

use crate::time::seconds_between;
use std::ops::Range;

/// Rows that repeat a time that has been; fewer are packets that overtook each other.
const REPEATED: usize = 5;

/// The longer part of a series whose clock was set back once, and a sentence about the other; `None` where it was not.
pub(super) fn one_time(stamps_ns: &[u64], topic: &str) -> Option<(Range<usize>, String)> {
    let mut back = stamps_ns.windows(2).enumerate().filter(|(_, w)| matches!(w, [a, b] if b < a)).map(|(row, _)| row);
    let (row, None) = (back.next()?, back.next()) else { return None };
    let (last, next) = (*stamps_ns.get(row)?, *stamps_ns.get(row + 1)?);
    let repeated = stamps_ns.iter().skip(row + 1).take_while(|stamp| **stamp <= last).count();
    // A single stamp that ran ahead is no clock.
    let alone = row.checked_sub(1).and_then(|before| stamps_ns.get(before)).is_some_and(|before| *before < next);
    if repeated < REPEATED || alone {
        return None;
    }
    let (before, behind) = (row + 1, stamps_ns.len() - row - 1);
    let (kept, out, where_) =
        if before >= behind { (0..before, behind, "behind") } else { (before..stamps_ns.len(), before, "before") };
    let told = format!(
        "`{topic}`: the clock was set back by {:.3} s behind row {row}: the {out} rows {where_} it were left out; keep the \
         clock as it is while recording",
        seconds_between(next, last)
    );
    Some((kept, told))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_set_back_is_told_from_packets_that_overtook_each_other() {
        let mut stamps: Vec<u64> = (0..100).map(|i| i * 1_000_000).collect();
        assert_eq!(one_time(&stamps, "/q"), None);
        stamps.swap(40, 42);
        assert_eq!(one_time(&stamps, "/q"), None);
        let stamps: Vec<u64> = (0..100).map(|i| if i < 60 { i } else { i - 20 } * 1_000_000).collect();
        let (kept, told) = one_time(&stamps, "/q").expect("a step");
        assert_eq!(kept, 0..60);
        assert!(told.contains("by 0.019 s behind row 59: the 40 rows behind it"), "{told}");
        let ahead: Vec<u64> = (0..100).map(|i| if i == 30 { 70 } else { i } * 1_000_000).collect();
        assert_eq!(one_time(&ahead, "/q"), None);
    }
}
