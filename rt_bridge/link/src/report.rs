//! The answer of `rt_bridge link`: what crossed, how old it was, how far the clocks are apart.

use crate::ages::Percentiles;
use serde::Serialize;

/// What a link did.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// How long it ran [s].
    pub seconds: f64,
    /// Topics of this host.
    pub sent: Vec<Sent>,
    /// Topics of the other host.
    pub taken: Vec<Taken>,
    /// The other host's clock; `None` where nothing is taken or nobody answered.
    pub clock: Option<Clock>,
    /// How often the other host was gone after it had been there.
    pub outages: u64,
    /// The longest of these [s].
    pub longest_outage: f64,
}

/// A topic that was sent.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Sent {
    /// Its name.
    pub topic: &'static str,
    /// Messages that came out of shared memory.
    pub messages: u64,
    /// Bytes that were sent, repeats among them.
    pub bytes: u64,
    /// Messages that were sent again.
    pub repeated: u64,
    /// Pictures and commands that were left out because a newer one was there.
    pub dropped: u64,
}

/// A topic that was taken.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Taken {
    /// Its name.
    pub topic: &'static str,
    /// Messages that were published here.
    pub messages: u64,
    /// Bytes of them.
    pub bytes: u64,
    /// Messages that the other host sent and that were not published here.
    pub lost: u64,
    /// Messages that were not published because they are none, or of another version.
    pub refused: u64,
    /// From shared memory there to shared memory here [us]; `None` where nothing came.
    pub age_us: Option<Percentiles>,
}

/// The clock of the other host against this one's.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Clock {
    /// Other minus own [s].
    pub offset: f64,
    /// Bound of the offset's error, and so of every age [s].
    pub uncertainty: f64,
    /// Round trips by which it was measured.
    pub round_trips: u64,
    /// Their time on the way [us].
    pub round_trip_us: Option<Percentiles>,
}

impl Report {
    /// Lines for people.
    pub fn in_words(&self) -> String {
        let mut lines = Vec::new();
        let sent = self.sent.iter().filter(|sent| sent.messages > 0);
        let taken = self.taken.iter().filter(|taken| taken.messages + taken.lost + taken.refused > 0);
        for Sent { topic, messages, bytes, repeated, dropped } in sent {
            let megabytes = *bytes as f64 * 1e-6;
            lines.push(format!(
                "sent {topic}: {messages} messages, {megabytes:.1} MB, {repeated} again, {dropped} dropped"
            ));
        }
        for Taken { topic, messages, lost, refused, age_us, .. } in taken {
            let age = age_us.map_or_else(String::new, |age| format!(", age {}", in_words(&age)));
            lines.push(format!("taken {topic}: {messages} messages, {lost} lost, {refused} refused{age}"));
        }
        if lines.is_empty() {
            lines.push("nothing crossed".into());
        }
        lines.extend(self.clock.map(|clock| clock.in_words()));
        lines.push(format!("outages: {}, the longest {:.1} s", self.outages, self.longest_outage));
        lines.join("\n")
    }
}

impl Clock {
    /// One line for people.
    pub fn in_words(&self) -> String {
        format!(
            "the other host's clock is {:+.6} s from this one's, to within {:.0} us",
            self.offset,
            self.uncertainty * 1e6
        )
    }
}

/// `p50 0.21 ms, p99 0.80 ms`
pub fn in_words(age: &Percentiles) -> String {
    format!("p50 {:.2} ms, p99 {:.2} ms", age.p50 * 1e-3, age.p99 * 1e-3)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn people_read_counts_ages_and_the_clock() {
        let age_us = Some(Percentiles { p50: 210.0, p99: 800.0, p999: 900.0, max: 1000.0 });
        let report = Report {
            seconds: 2.0,
            sent: vec![Sent { topic: "/camera/depth", messages: 60, bytes: 36_864_000, repeated: 0, dropped: 2 }],
            taken: vec![Taken { topic: "/arm/state", messages: 2000, age_us, ..Taken::default() }, Taken::default()],
            clock: Some(Clock { offset: -12.5, uncertainty: 45e-6, round_trips: 10, round_trip_us: age_us }),
            outages: 1,
            longest_outage: 5.25,
        };
        assert_eq!(
            report.in_words(),
            "sent /camera/depth: 60 messages, 36.9 MB, 0 again, 2 dropped\n\
             taken /arm/state: 2000 messages, 0 lost, 0 refused, age p50 0.21 ms, p99 0.80 ms\n\
             the other host's clock is -12.500000 s from this one's, to within 45 us\n\
             outages: 1, the longest 5.2 s"
        );
    }
}
