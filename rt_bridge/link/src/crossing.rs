//! Which topics cross between two hosts, and in which direction.
//!
//! A topic crosses when one host sends it and the other takes it. Commands move the robot: they do neither unless they are
//! named, on both hosts, as commands. A topic that is sent is not taken as well, so that nothing goes round in a circle.

use shared_mem::recording::{Encoded, EncodedVisitor, visit_encoded};
use shared_mem::topics::{self, ImageTopic, Topic};
use std::fmt;

/// How a topic crosses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// All messages count: what is missed is sent again.
    State,
    /// The newest counts: what is too much is dropped, the oldest first.
    Picture,
    /// Moves the robot: the newest counts, nothing is sent again, and stamps become those of the robot's host.
    Command,
}

/// A topic that can cross.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Crossing {
    /// Its name.
    pub topic: &'static str,
    /// How it crosses.
    pub kind: Kind,
}

/// Topics that move the robot or its gripper, as far as they can cross.
const COMMANDS: [&str; 2] = [topics::ARM_TARGET.name, topics::GRIPPER_TARGET.name];
/// What the twin says: it runs where it runs, on either side.
const OF_THE_TWIN: [&str; 3] = [topics::TWIN_STATE.name, topics::TWIN_GAP.name, topics::TWIN_OBJECTS.name];
/// Commands that never cross, and what stands in for them.
const NEVER: [(&str, &str); 2] =
    [(topics::ARM_MOTION.name, topics::ARM_TARGET.name), (topics::GRIPPER_COMMAND.name, topics::GRIPPER_TARGET.name)];

struct All(Vec<Crossing>);

impl All {
    fn put(&mut self, topic: &'static str, kind: Kind) {
        let kind = if COMMANDS.contains(&topic) { Kind::Command } else { kind };
        self.0.push(Crossing { topic, kind });
    }
}

impl EncodedVisitor for All {
    fn messages<M: Encoded>(&mut self, topic: Topic<M>) {
        self.put(topic.name, Kind::State);
    }

    fn pictures(&mut self, topic: ImageTopic) {
        self.put(topic.name, Kind::Picture);
    }
}

/// Every topic that can cross.
pub fn all() -> Vec<Crossing> {
    let mut all = All(Vec::new());
    visit_encoded(&mut all);
    all.0
}

/// What a bridge and its devices say: what crosses unless other topics are named.
pub fn of_the_cell() -> Vec<Crossing> {
    let is_cells = |crossing: &Crossing| crossing.kind != Kind::Command && !OF_THE_TWIN.contains(&crossing.topic);
    all().into_iter().filter(is_cells).collect()
}

/// States and pictures by name, with commas between them; `none` for no topic.
///
/// # Errors
/// A sentence that says which name is wrong, and what may stand there.
pub fn states(list: &str) -> Result<Topics, String> {
    named(list, |crossing| match crossing.kind {
        Kind::Command => Err(format!(
            "{} moves the robot and does not cross as a state; allow it by name with --take-commands on the robot's host and --send-commands on the other",
            crossing.topic
        )),
        _ => Ok(()),
    })
}

/// Commands by name, with commas between them.
///
/// # Errors
/// As [`states`].
pub fn commands(list: &str) -> Result<Topics, String> {
    named(list, |crossing| match crossing.kind {
        Kind::Command => Ok(()),
        _ => Err(format!("{} is no command; name it in --topics or --send", crossing.topic)),
    })
}

/// Topics as they were named, each once.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Topics(pub Vec<Crossing>);

fn named(list: &str, check: impl Fn(&Crossing) -> Result<(), String>) -> Result<Topics, String> {
    let all = all();
    let mut found: Vec<Crossing> = Vec::new();
    for name in list.split(',').map(str::trim).filter(|name| *name != "none") {
        if let Some((_, instead)) = NEVER.iter().find(|(never, _)| *never == name) {
            return Err(format!("{name} never crosses between hosts; steer with {instead}"));
        }
        let Some(crossing) = all.iter().find(|crossing| crossing.topic == name) else {
            let known: Vec<&str> = all.iter().filter(|c| check(c).is_ok()).map(|c| c.topic).collect();
            return Err(format!("there is no topic `{name}`; known are {}", known.join(", ")));
        };
        check(crossing)?;
        if !found.contains(crossing) {
            found.push(*crossing);
        }
    }
    Ok(Topics(found))
}

/// What one host sends and takes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Plan {
    /// Topics of this host that the other may have.
    pub send: Vec<Crossing>,
    /// Topics of the other host that are published here.
    pub take: Vec<Crossing>,
}

/// A topic would go round in a circle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct BothWays(pub &'static str);

impl fmt::Display for BothWays {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} cannot be sent and taken by one host: it would go round in a circle; leave it out of one", self.0)
    }
}

impl std::error::Error for BothWays {}

impl Plan {
    /// Of what was named. The host that listens is taken for the robot's, and sends what its cell says; the one that
    /// connects takes it.
    ///
    /// # Errors
    /// [`BothWays`] names a topic that is sent and taken.
    pub fn new(
        listens: bool,
        [send, take]: [Option<Topics>; 2],
        [send_commands, take_commands]: [Option<Topics>; 2],
    ) -> Result<Self, BothWays> {
        let commands = |named: Option<Topics>| named.map_or_else(Vec::new, |Topics(topics)| topics);
        let mut send_named = send.map(|Topics(topics)| topics);
        let mut take_named = take.map(|Topics(topics)| topics);
        // What is named one way is not the default of the other.
        let without = |other: &Option<Vec<Crossing>>| {
            let other = other.clone().unwrap_or_default();
            of_the_cell().into_iter().filter(|crossing| !other.contains(crossing)).collect::<Vec<_>>()
        };
        if listens && send_named.is_none() {
            send_named = Some(without(&take_named));
        } else if !listens && take_named.is_none() {
            take_named = Some(without(&send_named));
        }
        let mut plan = Self { send: send_named.unwrap_or_default(), take: take_named.unwrap_or_default() };
        plan.send.extend(commands(send_commands));
        plan.take.extend(commands(take_commands));
        match plan.send.iter().find(|crossing| plan.take.contains(crossing)) {
            Some(crossing) => Err(BothWays(crossing.topic)),
            None => Ok(plan),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(crossings: &[Crossing]) -> Vec<&str> {
        crossings.iter().map(|crossing| crossing.topic).collect()
    }

    #[test]
    fn no_command_crosses_unless_it_is_named_as_one() {
        for listens in [true, false] {
            let plan = Plan::new(listens, [None, None], [None, None]).expect("a plan");
            let crossing: Vec<Crossing> = [plan.send, plan.take].concat();
            assert_eq!(names(&crossing), names(&of_the_cell()));
            for crossing in crossing {
                assert_ne!(crossing.kind, Kind::Command, "{}", crossing.topic);
                assert!(!crossing.topic.ends_with("target") && !crossing.topic.ends_with("motion"));
            }
        }
        let named = commands("/arm/target").expect("a command");
        let plan = Plan::new(true, [None, None], [None, Some(named)]).expect("a plan");
        assert_eq!(names(&plan.take), ["/arm/target"]);
        assert!(states("/arm/state,/arm/target").is_err_and(|what| what.contains("--take-commands")));
        assert!(commands("/arm/state").is_err_and(|what| what.contains("no command")));
    }

    #[test]
    fn orders_that_no_clip_holds_never_cross_and_say_what_does() {
        for (name, instead) in NEVER {
            for list in [states(name), commands(name)] {
                assert!(list.is_err_and(|what| what.contains(instead)), "{name}");
            }
        }
        // Together with what can cross, that is every topic there is.
        let mut all: Vec<&str> =
            all().iter().map(|crossing| crossing.topic).chain(NEVER.map(|(name, _)| name)).collect();
        let mut there = topics::ALL.to_vec();
        all.sort_unstable();
        there.sort_unstable();
        assert_eq!(all, there);
    }

    #[test]
    fn what_is_sent_is_not_taken() {
        let events = || states("/events").ok();
        let refused = Plan::new(false, [events(), events()], [None, None]);
        assert_eq!(refused, Err(BothWays("/events")));
        let plan = Plan::new(false, [events(), None], [None, None]).expect("a plan");
        assert_eq!(names(&plan.send), ["/events"]);
        assert!(plan.take.len() > 5 && !names(&plan.take).contains(&"/events"));
    }

    #[test]
    fn names_are_taken_once_and_wrong_ones_are_answered_with_the_right_ones() {
        let Topics(topics) = states("/arm/state, /camera/depth,/arm/state").expect("topics");
        assert_eq!(names(&topics), ["/arm/state", "/camera/depth"]);
        assert_eq!(topics[1].kind, Kind::Picture);
        assert_eq!(states("none"), Ok(Topics(Vec::new())));
        let what = states("/arm/stat").expect_err("unknown");
        assert!(what.contains("`/arm/stat`") && what.contains("/arm/state, ") && !what.contains("target"), "{what}");
    }
}
