//! What reading one input may cost: memory for what is built out of it, and steps on the way.
//!
//! The size of a file says little about what is in it: a kilobyte can name a million million elements, a packed page become
//! gigabytes, a query never end. Each reader therefore draws what it builds and each element it goes through from the budget
//! of its input, before it builds it, and ends in a sentence when that is spent. A step also looks whether the process was
//! asked to end, so that nothing is read that Ctrl-C does not end.
//!
//! The rule goes by what is there, so that a recording of any size reads: an input may become [`ROOM`] bytes, or
//! [`BYTES_OF_ONE`] for each byte that it has, whichever is more, in [`STEPS`] steps, or [`STEPS_OF_ONE`] for each byte that it
//! has. A text of one digit a number becomes 17 bytes for each of its own; bags and data sets of moving robots that are packed as tightly as
//! they go become 5 to 20.

use crate::ending;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// What an input may become, however small it is [bytes]: an hour of an arm at 1 kHz. Clips and reports are made of it, so that
/// a program has up to four times as much at once.
pub const ROOM: u64 = 512 << 20;
/// What it may become for each of its bytes [bytes].
pub const BYTES_OF_ONE: u64 = 32;
/// Steps that reading an input may take, however small it is: a few seconds.
pub const STEPS: u64 = 200_000_000;
/// Steps that it may take for each of its bytes.
pub const STEPS_OF_ONE: u64 = 64;

/// What one packed piece may become however small it is, for each of its bytes, and at most [bytes]: what a good compressor
/// reaches, and never more than recorders write at once.
const PIECE: u64 = 64 << 20;
const PIECE_OF_ONE: u64 = 300;
const LARGEST_PIECE: u64 = 1 << 29;

/// What is left for reading one input. Clones draw from the same.
///
/// ```
/// use shared_mem::budget::Budget;
///
/// let budget = Budget::with(1000, 1000); // bytes of memory, steps
/// budget.take(600)?;
/// assert!(budget.take(600).is_err(), "a length that a file claims is believed up to here");
/// budget.give_back(600);
/// assert_eq!(budget.left(), 1000);
/// # Ok::<(), shared_mem::budget::BudgetError>(())
/// ```
#[derive(Debug, Clone)]
pub struct Budget(Arc<Account>);

#[derive(Debug)]
struct Account {
    memory: u64,
    steps: u64,
    taken: AtomicU64,
    done: AtomicU64,
}

/// A budget is spent, or the process was asked to end: a sentence to be put behind the input's name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum BudgetError {
    /// What is built is too large.
    #[error(
        "becomes more than {} MiB once it is unpacked, far more than a log of its size; copy it from its source again, or cut it into shorter ones",
        .0 >> 20
    )]
    Memory(u64),
    /// There is no end to it.
    #[error(
        "is not read after {} million steps, far more than a log of its size takes; copy it from its source again, or leave it out",
        .0 / 1_000_000
    )]
    Steps(u64),
    /// Ctrl-C.
    #[error("interrupted while it was read; start again")]
    Ended,
}

impl Budget {
    /// Of an input of so many bytes, by the rule above.
    pub fn of(bytes: u64) -> Self {
        Self::with(ROOM.max(bytes.saturating_mul(BYTES_OF_ONE)), STEPS.max(bytes.saturating_mul(STEPS_OF_ONE)))
    }

    /// Of so much memory [bytes] and so many steps, for what is no file.
    pub fn with(memory: u64, steps: u64) -> Self {
        Self(Arc::new(Account { memory, steps, taken: AtomicU64::new(0), done: AtomicU64::new(0) }))
    }

    /// Takes so many bytes, before they are set aside.
    ///
    /// # Errors
    /// [`BudgetError`] when there are fewer, or the process was asked to end.
    pub fn take(&self, bytes: usize) -> Result<(), BudgetError> {
        self.step(1)?;
        let taken = self.0.taken.load(Ordering::Relaxed).saturating_add(bytes as u64);
        if taken > self.0.memory {
            return Err(BudgetError::Memory(self.0.memory));
        }
        // One thread alone reads an input: nobody draws between the two lines.
        self.0.taken.store(taken, Ordering::Relaxed);
        Ok(())
    }

    /// Takes `count` elements of so many bytes each, and a step for each.
    ///
    /// # Errors
    /// As [`Budget::take`].
    pub fn elements(&self, count: usize, bytes_each: usize) -> Result<(), BudgetError> {
        self.step(count)?;
        self.take(count.saturating_mul(bytes_each))
    }

    /// Gives back what is not kept.
    pub fn give_back(&self, bytes: usize) {
        let taken = self.0.taken.load(Ordering::Relaxed);
        self.0.taken.store(taken.saturating_sub(bytes as u64), Ordering::Relaxed);
    }

    /// Goes so many steps on: elements, fields, rows, instructions of a query, each some nanoseconds of work.
    ///
    /// # Errors
    /// [`BudgetError`] when there are fewer, or the process was asked to end.
    pub fn step(&self, count: usize) -> Result<(), BudgetError> {
        if ending::asked() {
            return Err(BudgetError::Ended);
        }
        let done = self.0.done.load(Ordering::Relaxed).saturating_add(count as u64);
        if done > self.0.steps {
            return Err(BudgetError::Steps(self.0.steps));
        }
        self.0.done.store(done, Ordering::Relaxed);
        Ok(())
    }

    /// Bytes that may still be taken.
    pub fn left(&self) -> u64 {
        self.0.memory - self.0.taken.load(Ordering::Relaxed)
    }
}

/// What a packed piece of so many bytes is believed to become at most [bytes]: a chunk of a bag.
pub fn unpacked(packed: usize) -> u64 {
    PIECE.max((packed as u64).saturating_mul(PIECE_OF_ONE)).min(LARGEST_PIECE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_built_goes_by_what_is_there() {
        let small = Budget::of(1000);
        assert_eq!(small.left(), ROOM);
        small.elements(1 << 20, 512).expect("all there is");
        assert_eq!(small.take(1), Err(BudgetError::Memory(ROOM)));
        small.give_back(8);
        small.clone().take(8).expect("what was given back");
        assert_eq!(small.left(), 0);
        // A recording of any size reads.
        let large = Budget::of(1 << 40);
        large.elements(1 << 32, 64).expect("a terabyte is there");
        assert_eq!(large.elements(usize::MAX, usize::MAX), Err(BudgetError::Steps(STEPS_OF_ONE << 40)));
    }

    #[test]
    fn what_takes_no_memory_takes_steps() {
        // A step for each, and one in which they are taken.
        let budget = Budget::with(0, 11);
        budget.elements(10, 0).expect("ten elements of no size");
        let line = budget.step(1).expect_err("an eleventh").to_string();
        assert!(line.contains("steps") && !line.contains('\n'), "{line}");
    }

    #[test]
    fn a_packed_piece_becomes_no_more_than_recorders_write() {
        assert_eq!(unpacked(1000), 64 << 20);
        assert_eq!(unpacked(1 << 20), 300 << 20);
        assert_eq!(unpacked(usize::MAX), 512 << 20);
    }
}
