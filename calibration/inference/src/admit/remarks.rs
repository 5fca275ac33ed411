//! Remarks on clips and reasons why some are left out, for people: what many clips share is said once.

use serde::Serialize;
use std::path::Path;

/// A clip that is not used.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct LeftOut {
    pub file: String,
    pub why: String,
}

/// Why clips were left out, in one line.
pub fn reasons(left_out: &[LeftOut]) -> String {
    grouped(left_out.iter().map(|clip| (clip.file.as_str(), clip.why.as_str()))).join("; ")
}

/// How many clips were left out beside those used, and why; `None` where none was.
pub fn left_out_in_words(left_out: &[LeftOut], used: usize) -> Option<String> {
    let (out, all) = (left_out.len(), left_out.len() + used);
    (out > 0).then(|| format!("{out} of {all} clips were left out: {}", reasons(left_out)))
}

/// One line for each kind of remark on a file, in the order in which they first appear. Remarks that differ by numbers
/// alone are of one kind: `clip_00.mcap and 6 more: no commands for 0.201 s from 1.999 s on`. The path that an error of reading
/// begins with is left out: the line begins with the file.
pub fn grouped<'a>(remarks: impl IntoIterator<Item = (&'a str, &'a str)>) -> Vec<String> {
    let mut kinds: Vec<(String, &str, &str, usize)> = Vec::new();
    for (file, remark) in remarks {
        let remark =
            remark.split_once(": ").filter(|(path, _)| Path::new(path).ends_with(file)).map_or(remark, |(_, r)| r);
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
    fn what_many_clips_share_is_said_once() {
        let remarks = [("a.mcap", "logged at 15 Hz"), ("b.mcap", "not hit"), ("c.mcap", "logged at 16 Hz")];
        assert_eq!(grouped(remarks), ["a.mcap and 1 more: logged at 15 Hz", "b.mcap: not hit"]);
        let errors = [("a.mcap", "log/a.mcap: `q`: no joint"), ("b.mcap", "log/b.mcap: `q`: no joint")];
        assert_eq!(grouped(errors), ["a.mcap and 1 more: `q`: no joint"]);
    }
}
