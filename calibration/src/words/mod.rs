//! Numbers, units, shares, intervals and names as people read them, for sentences, terminals and pages alike.

pub(crate) mod parameters;
pub(crate) mod quantity;
pub(crate) mod share;

pub use parameters::number_in_words;
pub use quantity::{UNBOUNDED, in_unit};
pub use share::percent;

/// A name of files as words: `command delay` of `command_delay`.
pub fn words(name: &str) -> String {
    name.replace('_', " ")
}

/// A channel as words: `joint2` as `joint 2`, others as they are.
pub fn channel_in_words(channel: &str) -> String {
    match channel.strip_prefix("joint") {
        Some(number) if !number.is_empty() && number.bytes().all(|c| c.is_ascii_digit()) => format!("joint {number}"),
        _ => channel.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_are_counted_from_1_in_words() {
        assert_eq!([channel_in_words("joint5"), channel_in_words("yaw")], ["joint 5", "yaw"]);
    }
}
