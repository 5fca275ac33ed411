//! What the threads of a link have in common.

use super::hosts::Hosts;
use crate::LinkError;
use crate::ages::Ages;
use crate::report::{Sent, Taken};
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use std::collections::HashSet;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use zenoh::Session;

/// The session and what is known of the other hosts.
#[derive(Clone)]
pub(super) struct Shared {
    pub(super) session: Session,
    /// Drawn at the start: what other hosts know this link by.
    pub(super) id: u64,
    pub(super) stop: Arc<AtomicBool>,
    pub(super) hosts: Arc<Mutex<Hosts>>,
    remarks: Sender<Event>,
    said: Arc<Mutex<HashSet<String>>>,
}

impl Shared {
    pub(super) fn new(session: Session, id: u64, stop: Arc<AtomicBool>, remarks: Sender<Event>) -> Self {
        Self { session, id, stop, hosts: Arc::default(), remarks, said: Arc::default() }
    }

    pub(super) fn is_over(&self) -> bool {
        self.stop.load(Ordering::Relaxed)
    }

    /// Says something to the person at the terminal and on `/events`.
    pub(super) fn remark(&self, level: EventLevel, text: &str) {
        match level {
            EventLevel::Info => tracing::info!("{text}"),
            EventLevel::Warning | EventLevel::Error => tracing::warn!("{text}"),
        }
        let _at_the_end = self.remarks.send(Event::new(level, EventSource::Bridge, &format!("link: {text}")));
    }

    /// The same as a warning, once however often it happens.
    pub(super) fn warn_once(&self, text: &str) {
        if lock(&self.said).insert(text.to_owned()) {
            self.remark(EventLevel::Warning, text);
        }
    }
}

/// What a thread counts of a topic that is sent.
pub(super) type SentCount = Arc<Mutex<Sent>>;
/// What a thread counts of a topic that is taken.
pub(super) type TakenCount = Arc<Mutex<Arrivals>>;

/// Counts and ages of a topic that is taken.
#[derive(Debug, Default)]
pub(super) struct Arrivals {
    pub(super) taken: Taken,
    pub(super) ages: Ages,
    /// Since the last status line.
    pub(super) recent: Ages,
}

/// Locks, whatever another thread did with it.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// The network's errors as ours.
pub(super) fn network(error: impl std::fmt::Display) -> LinkError {
    LinkError::Network { what: error.to_string() }
}
