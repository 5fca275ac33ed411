//! Groups of columns with what their numbers say of them, and which of them is the best for something.

use super::Notes;
use super::candidates::Candidate;
use super::clock;
use super::follow;
use super::shape;
use super::track::Track;
use crate::log::{HEADER, Log};
use crate::mapping::JointColumns;
use crate::naming::{self, Quantity};
use shared_mem::msg::MAX_JOINTS;

/// Groups whose numbers are looked at; a log of more says by its names what they are.
const MOST: usize = 64;
/// Fewer joints are those of a hand or of a mount, where a log has more.
const FEWEST_OF_ARM: usize = 3;

/// Positions by their name, and what speaks for them.
#[derive(Debug, Clone)]
pub(super) struct Judged<'a> {
    pub(super) candidate: Candidate<'a>,
    /// Its numbers over time; rows count where there is no clock.
    pub(super) track: Option<Track>,
    /// Velocities that go with them, the best first.
    pub(super) velocities: Vec<Candidate<'a>>,
    /// Torques that go with them, the best first.
    pub(super) torques: Vec<Candidate<'a>>,
    /// Whether the velocities are the slope of the positions.
    pub(super) has_slope: bool,
    pub(super) is_constant: bool,
}

/// What speaks for a group, the strongest first; of two that are equal in it neither has a reason.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Rank {
    is_arm: bool,
    has_slope: bool,
    score: u32,
    has_torques: bool,
    size: usize,
}

impl<'a> Judged<'a> {
    /// Every group of positions in a log.
    pub(super) fn all(log: &Log, candidates: &[Candidate<'a>]) -> Vec<Self> {
        let positions = candidates.iter().filter(|c| c.role.quantity == Quantity::Position);
        positions.enumerate().map(|(number, q)| Self::of(log, candidates, q, number < MOST)).collect()
    }

    /// Groups whose names say nothing of positions, by their numbers alone.
    pub(super) fn unnamed(log: &Log, unnamed: &[Candidate<'a>], size: usize) -> Vec<Self> {
        let fitting = unnamed.iter().filter(|c| c.size() == size).take(MOST);
        fitting.map(|c| Self { velocities: Vec::new(), torques: Vec::new(), ..Self::of(log, &[], c, true) }).collect()
    }

    /// The same without the velocities and torques that another has taken.
    pub(super) fn without_those_of(mut self, other: &Self) -> Self {
        let is_taken = |own: &Candidate<'_>| other.velocities.iter().chain(&other.torques).any(|c| c.is_same(own));
        self.velocities.retain(|own| !is_taken(own));
        self.torques.retain(|own| !is_taken(own));
        self
    }

    fn of(log: &Log, candidates: &[Candidate<'a>], q: &Candidate<'a>, closely: bool) -> Self {
        let closely = closely && q.size() <= 2 * MAX_JOINTS;
        let with = |velocities: Option<&Candidate<'_>>| closely.then(|| track(log, q, velocities)).flatten();
        let is_constant = shape::is_constant(&q.values());
        let mut velocities = beside(candidates, q, Quantity::Velocity);
        // A driver that fills in none reports zeros.
        velocities.retain(|velocities| is_constant || !shape::is_constant(&velocities.values()));
        let is_slope = |c: &Candidate<'_>| with(Some(c)).is_some_and(|track| follow::is_slope(&track));
        velocities.sort_by_cached_key(|velocities| !is_slope(velocities));
        Self {
            candidate: q.clone(),
            track: with(None),
            has_slope: velocities.first().is_some_and(is_slope),
            velocities,
            torques: beside(candidates, q, Quantity::Torque),
            is_constant,
        }
    }

    pub(super) fn rank(&self) -> Rank {
        Rank {
            is_arm: self.candidate.size() >= FEWEST_OF_ARM,
            has_slope: self.has_slope,
            score: self.candidate.role.score,
            has_torques: !self.torques.is_empty(),
            size: self.candidate.size().min(7),
        }
    }

    /// Whether the other holds other numbers, as far as they were looked at.
    pub(super) fn differs(&self, other: &Self) -> bool {
        !self.track.as_ref().zip(other.track.as_ref()).is_some_and(|(own, other)| follow::are_same(own, other))
    }

    /// Whether it comes clearly before the other, which goes where it says.
    pub(super) fn leads(&self, other: &Self) -> bool {
        let same_size = self.candidate.size() == other.candidate.size();
        same_size && self.track.as_ref().zip(other.track.as_ref()).is_some_and(|(own, other)| follow::leads(own, other))
    }

    /// Why it was taken, and not one of the others.
    pub(super) fn why(&self, others: &[&Self]) -> &'static str {
        let (own, best) = (self.rank(), others.iter().map(|other| other.rank()).max());
        match best {
            _ if own.has_slope => "its velocities are its slope",
            Some(best) if own.has_torques && !best.has_torques => "torques stand beside it",
            Some(best) if own.size > best.size => "it has the most joints",
            _ => "positions by its name",
        }
    }
}

/// What goes with positions: of the same table, as many, named alike; the best by its name first.
fn beside<'a>(candidates: &[Candidate<'a>], q: &Candidate<'_>, quantity: Quantity) -> Vec<Candidate<'a>> {
    let words = naming::words(&q.group.base);
    let alike = |c: &Candidate<'_>| naming::words(&c.group.base).iter().filter(|word| words.contains(word)).count();
    let mut found: Vec<Candidate<'a>> = candidates
        .iter()
        .filter(|c| {
            std::ptr::eq(c.table, q.table) && c.is(quantity, q.role.desired) && c.group.labels == q.group.labels
        })
        .cloned()
        .collect();
    found.sort_by_key(|c| std::cmp::Reverse((c.parent() == q.parent(), alike(c), c.role.score)));
    found
}

/// Positions over time, and velocities where they are given.
fn track(log: &Log, q: &Candidate<'_>, velocities: Option<&Candidate<'_>>) -> Option<Track> {
    let clock = clock::choose(log, q.table, "", &mut Notes::default());
    let unclocked = clock.stamps.is_none() && clock.rate.is_none();
    let columns = JointColumns {
        table: q.table.name.clone(),
        rate: if unclocked { Some(1.0) } else { clock.rate.filter(|_| clock.stamps.as_deref() != Some(HEADER)) },
        stamps: clock.stamps,
        stamp_unit: clock.unit,
        q: q.group.names.clone(),
        dq: velocities.map_or_else(Vec::new, |velocities| velocities.group.names.clone()),
        ..JointColumns::default()
    };
    Track::of(q.table, &columns)
}
