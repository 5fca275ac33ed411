//! Remarks on clips, for people: what many clips share is told once.

/// One line for each kind of remark on a file, in the order in which they first appear. Remarks that differ by numbers
/// alone are of one kind: `clip_00.mcap and 6 more: no commands for 0.201 s from 1.999 s on`.
pub(crate) fn grouped<'a>(remarks: impl IntoIterator<Item = (&'a str, &'a str)>) -> Vec<String> {
    let mut kinds: Vec<(String, &str, &str, usize)> = Vec::new();
    for (file, remark) in remarks {
        let kind: String = remark.chars().filter(|c| !c.is_ascii_digit()).collect();
        match kinds.iter_mut().find(|(known, ..)| *known == kind) {
            Some((.., more)) => *more += 1,
            None => kinds.push((kind, file, remark, 0)),
        }
    }
    let line = |(_, file, remark, more): (String, &str, &str, usize)| match more {
        0 => format!("{file}: {remark}"),
        more => format!("{file} and {more} more: {remark}"),
    };
    kinds.into_iter().map(line).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_many_clips_share_is_told_once() {
        let remarks = [("a.mcap", "logged at 15 Hz"), ("b.mcap", "not hit"), ("c.mcap", "logged at 16 Hz")];
        assert_eq!(grouped(remarks), ["a.mcap and 1 more: logged at 15 Hz", "b.mcap: not hit"]);
    }
}
