//! Messages that failed their check: counted where they are received, reported by the program that receives them.

use crate::msg::Wrong;
use std::cell::{Cell, RefCell};
use std::fmt;
use std::rc::Rc;

/// Messages of one topic that were not handed on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ignored {
    /// The topic.
    pub topic: &'static str,
    /// How many so far.
    pub count: u64,
    /// What was wrong with the latest.
    pub why: Wrong,
}

impl fmt::Display for Ignored {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { topic, count, why } = self;
        let messages = if *count == 1 { "message" } else { "messages" };
        write!(f, "ignored {count} {messages} on {topic}: {why}; stop the program that sends them")
    }
}

/// The count of one receiver.
#[derive(Debug)]
pub(super) struct Tally {
    topic: &'static str,
    count: Cell<u64>,
    why: Cell<Option<Wrong>>,
    /// The count when it was last reported.
    reported: Cell<u64>,
}

impl Tally {
    pub(super) fn add(&self, why: Wrong) {
        self.count.set(self.count.get() + 1);
        self.why.set(Some(why));
    }

    pub(super) fn count(&self) -> u64 {
        self.count.get()
    }

    fn ignored(&self) -> Option<Ignored> {
        Some(Ignored { topic: self.topic, count: self.count.get(), why: self.why.get()? })
    }
}

/// The counts of all receivers of a node.
#[derive(Debug, Default)]
pub(super) struct Tallies {
    all: RefCell<Vec<Rc<Tally>>>,
}

impl Tallies {
    pub(super) fn open(&self, topic: &'static str) -> Rc<Tally> {
        let tally = Rc::new(Tally { topic, count: Cell::new(0), why: Cell::new(None), reported: Cell::new(0) });
        self.all.borrow_mut().push(tally.clone());
        tally
    }

    /// Those worth a remark: at the first message, and each time there are ten times as many.
    pub(super) fn news(&self) -> Vec<Ignored> {
        let is_news = |tally: &&Rc<Tally>| tally.count.get() >= (10 * tally.reported.get()).max(1);
        let all = self.all.borrow();
        let news = all.iter().filter(is_news).inspect(|tally| tally.reported.set(tally.count.get()));
        news.filter_map(|tally| tally.ignored()).collect()
    }
}
