//! Questions to the other hosts and answers to theirs: round trips for the clocks, versions, topics, whether anybody is there.

use super::session::CLOCK;
use super::shared::{Shared, lock, network};
use crate::LinkError;
use crate::clock::RoundTrip;
use crate::crossing::{Crossing, Kind, Plan};
use crate::envelope::VERSION;
use shared_mem::msg::event::EventLevel;
use shared_mem::time::now_ns;
use std::time::Duration;
use zenoh::Wait;
use zenoh::bytes::ZBytes;
use zenoh::qos::Priority;
use zenoh::query::{ConsolidationMode, Query, QueryTarget, Queryable, Reply};

/// Between two questions.
const PERIOD: Duration = Duration::from_millis(200);
/// The first ones follow each other faster: one of them is short, and bounds the clock well.
const FIRST: u64 = 16;
const FIRST_PERIOD: Duration = Duration::from_millis(10);
/// How long an answer is waited for.
const PATIENCE: Duration = Duration::from_millis(700);

/// What a host answers.
#[derive(Debug, PartialEq, Eq)]
struct Answer {
    id: u64,
    reached_ns: u64,
    answered_ns: u64,
    /// Names of the topics that it sends, and of those that it takes.
    topics: [Vec<String>; 2],
}

impl Answer {
    fn to_bytes(id: u64, reached_ns: u64, topics: &str) -> Vec<u8> {
        let mut bytes = vec![VERSION];
        for number in [id, reached_ns, now_ns()] {
            bytes.extend(number.to_le_bytes());
        }
        bytes.extend(topics.as_bytes());
        bytes
    }

    /// The answer, or the version of a link that is not ours.
    fn from_bytes(bytes: &[u8]) -> Result<Self, Option<u8>> {
        let version = *bytes.first().ok_or(None)?;
        if version != VERSION {
            return Err(Some(version));
        }
        let number = |at: usize| {
            let eight = bytes.get(1 + 8 * at..9 + 8 * at).and_then(|eight| eight.try_into().ok());
            eight.map(u64::from_le_bytes).ok_or(None)
        };
        let text = bytes.get(25..).map(String::from_utf8_lossy).ok_or(None)?;
        let (sends, takes) = text.split_once('|').unwrap_or((&text, ""));
        let names = |list: &str| list.split(',').filter(|name| !name.is_empty()).map(str::to_owned).collect();
        Ok(Self {
            id: number(0)?,
            reached_ns: number(1)?,
            answered_ns: number(2)?,
            topics: [names(sends), names(takes)],
        })
    }
}

fn names(crossings: &[Crossing]) -> String {
    crossings.iter().map(|crossing| crossing.topic).collect::<Vec<_>>().join(",")
}

/// Answers the questions of other hosts for as long as the answer is kept.
pub(super) fn answer(shared: &Shared, plan: &Plan) -> Result<Queryable<()>, LinkError> {
    let (id, topics) = (shared.id, format!("{}|{}", names(&plan.send), names(&plan.take)));
    let reply = move |query: Query| {
        let reached_ns = now_ns();
        // Whoever asked is gone, or asks again.
        let _unanswered = query.reply(CLOCK, Answer::to_bytes(id, reached_ns, &topics)).express(true).wait();
    };
    shared.session.declare_queryable(CLOCK).callback(reply).wait().map_err(network)
}

/// Asks the other hosts five times a second, until the end.
pub(super) fn ask(shared: &Shared, plan: &Plan) -> Result<(), LinkError> {
    while !shared.is_over() {
        let asked_ns = now_ns();
        let question = shared.session.get(CLOCK).payload(ZBytes::from(vec![VERSION])).timeout(PATIENCE);
        // Each host's answer as it comes: this one's own is among them.
        let question = question.target(QueryTarget::All).consolidation(ConsolidationMode::None);
        let replies = question.priority(Priority::RealTime).express(true).wait().map_err(network)?;
        // Ends when all have answered or the patience is over.
        while let Ok(Some(reply)) = replies.recv_timeout(PATIENCE) {
            take(shared, plan, asked_ns, &reply);
        }
        if lock(&shared.hosts).has_gone(now_ns()) {
            shared.remark(EventLevel::Warning, "the other host is gone; it is looked for until Ctrl-C");
        }
        let is_first = lock(&shared.hosts).clock().is_some_and(|clock| clock.round_trips < FIRST);
        std::thread::sleep(if is_first { FIRST_PERIOD } else { PERIOD });
    }
    Ok(())
}

fn take(shared: &Shared, plan: &Plan, asked_ns: u64, reply: &Reply) {
    let back_ns = now_ns();
    let Ok(sample) = reply.result() else { return };
    let answer = match Answer::from_bytes(&sample.payload().to_bytes()) {
        Ok(answer) if answer.id != shared.id => answer,
        Ok(_) | Err(None) => return,
        Err(Some(version)) => {
            return shared.warn_once(&format!(
                "the other host has version {version} of the link, this one {VERSION}; install the same twinalign on both"
            ));
        }
    };
    let trip = RoundTrip { asked_ns, reached_ns: answer.reached_ns, answered_ns: answer.answered_ns, back_ns };
    let mut hosts = lock(&shared.hosts);
    let away = hosts.answered(answer.id, &trip);
    let clock = hosts.clock().map_or_else(String::new, |clock| clock.in_words());
    drop(hosts);
    match away {
        Some(0) => shared.remark(EventLevel::Info, &format!("the other host is there; {clock}")),
        Some(away) => {
            let text = format!("the other host is there again after {:.1} s; {clock}", away as f64 * 1e-9);
            shared.remark(EventLevel::Info, &text);
        }
        None => return,
    }
    compare(shared, plan, &answer);
}

/// Says what one host wants and the other does not offer.
fn compare(shared: &Shared, plan: &Plan, answer: &Answer) {
    let [sends, takes] = &answer.topics;
    let missing = |wanted: &[Crossing], offered: &[String], kinds: fn(Kind) -> bool| -> Vec<&'static str> {
        let absent = wanted.iter().filter(|c| kinds(c.kind) && !offered.iter().any(|name| name == c.topic));
        absent.map(|crossing| crossing.topic).collect()
    };
    let states = missing(&plan.take, sends, |kind| kind != Kind::Command);
    if !states.is_empty() {
        shared.warn_once(&format!("the other host does not send {}; name it there in --send", states.join(", ")));
    }
    let commands = missing(&plan.send, takes, |kind| kind == Kind::Command);
    if !commands.is_empty() {
        shared.warn_once(&format!(
            "the other host does not let {} in; allow it there with --take-commands",
            commands.join(", ")
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_answer_comes_out_as_it_went_in_and_another_version_is_named() {
        let mut bytes = Answer::to_bytes(7, 8, "/arm/state,/events|/arm/target");
        let answer = Answer::from_bytes(&bytes).expect("an answer");
        assert_eq!((answer.id, answer.reached_ns), (7, 8));
        assert_eq!(answer.topics, [vec!["/arm/state".to_owned(), "/events".into()], vec!["/arm/target".into()]]);
        assert_eq!(Answer::from_bytes(&bytes[..20]), Err(None));
        bytes[0] = 9;
        assert_eq!(Answer::from_bytes(&bytes), Err(Some(9)));
    }
}
