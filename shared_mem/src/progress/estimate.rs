//! How much of a piece of work is done, and how long the rest takes, from what its stages took so far.
//!
//! A stage goes on at the pace at which its steps were done until now. A stage that is still to come takes as long as the last one
//! of its name, in proportion to what the plan gives both; where there was none, its share of the plan at the pace at which the plan was worked off. The share that
//! is done never goes back: where there is more to do than was planned, it stands until the work has caught up, and how long the
//! rest takes is then not known.

use std::collections::VecDeque;
use std::time::Duration;

/// A stage of the plan: its name, and how long it takes beside the others, in any unit.
pub type Planned = (&'static str, f64);

/// Work in stages, some of them still to come. Times are since its beginning.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Estimate {
    ahead: VecDeque<Planned>,
    current: Stage,
    /// The stages that are over as the plan had them, and how long each took [s].
    over: Vec<(Planned, f64)>,
    /// What the plan gave the stages that are over, and what those of them took that were in it [s].
    worked_off: [f64; 2],
    shown: f64,
}

/// The stage at work.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Stage {
    name: &'static str,
    /// What the plan gives it; 0 where it is not in the plan.
    planned: f64,
    /// When it began [s].
    begun: f64,
    /// Steps in all, and done.
    steps: u64,
    done: u64,
    /// When the last step was done [s].
    last: f64,
}

/// A step that takes longer than those before it takes this share of them at least again.
const OVERDUE: f64 = 0.1;
/// The most that is shown before the end.
const NEARLY: f64 = 0.99;

impl Estimate {
    /// Of stages in their order; the first has begun, with so many steps.
    pub(super) fn new(plan: &[Planned], steps: u64) -> Self {
        let mut ahead: VecDeque<Planned> = plan.iter().copied().collect();
        let (name, planned) = ahead.pop_front().unwrap_or(("", 1.0));
        let current = Stage { name, planned, begun: 0.0, steps, done: 0, last: 0.0 };
        Self { ahead, current, over: Vec::new(), worked_off: [0.0; 2], shown: 0.0 }
    }

    /// The stage at work is over, and another one begins: the next of its name in the plan, those before it are left out.
    /// One that the plan does not have comes in between.
    pub(super) fn begin(&mut self, name: &'static str, steps: u64, now: Duration) {
        let now = now.as_secs_f64();
        let took = now - self.current.begun;
        self.over.push(((self.current.name, self.current.planned), took));
        if self.current.planned > 0.0 {
            self.worked_off = [self.worked_off[0] + self.current.planned, self.worked_off[1] + took];
        }
        let planned = match self.ahead.iter().position(|(planned, _)| *planned == name) {
            Some(place) => self.ahead.drain(..=place).next_back().map_or(0.0, |(_, planned)| planned),
            None => 0.0,
        };
        self.current = Stage { name, planned, begun: now, steps, done: 0, last: now };
    }

    /// So many steps of the stage at work are done.
    pub(super) fn done(&mut self, done: u64, now: Duration) {
        if done != self.current.done {
            (self.current.done, self.current.last) = (done.min(self.current.steps), now.as_secs_f64());
        }
    }

    /// The share that is done, never less than before, and how long the rest takes; `None` while nothing is known of that.
    pub(super) fn at(&mut self, now: Duration) -> (f64, Option<Duration>) {
        let now = now.as_secs_f64();
        let left = self.left(now);
        let share = left.map_or(0.0, |left| if now > 0.0 { now / (now + left) } else { 0.0 });
        self.shown = self.shown.max(share.min(NEARLY));
        (self.shown, left.map(Duration::from_secs_f64))
    }

    /// Seconds left.
    fn left(&self, now: f64) -> Option<f64> {
        let Stage { steps, done, last, .. } = self.current;
        if done > 0 && done == steps && self.ahead.is_empty() && now > last {
            return None;
        }
        let current = self.left_of_current(now)?;
        let took = now - self.current.begun + current;
        let now_and_planned = (self.current.planned, took);
        let ahead = self.ahead.iter().map(|(name, planned)| {
            let same = if *name == self.current.name { Some(now_and_planned) } else { self.last_of(name) };
            same.map(|same| in_proportion(same, *planned)).or_else(|| Some(planned * self.pace(took)?))
        });
        Some(current + ahead.sum::<Option<f64>>()?)
    }

    /// Seconds left of the stage at work.
    fn left_of_current(&self, now: f64) -> Option<f64> {
        let Stage { name, planned, begun, steps, done, last } = self.current;
        if done > 0 {
            let step = (last - begun) / done as f64;
            let whole = step * steps.saturating_sub(done) as f64;
            let after_this = step * steps.saturating_sub(done + 1) as f64;
            return Some((whole - (now - last)).max(after_this).max(0.0));
        }
        let [worked_off, took] = self.worked_off;
        let by_plan = (worked_off > 0.0 && planned > 0.0).then(|| planned * took / worked_off);
        let expected = self.last_of(name).map(|last| in_proportion(last, planned)).or(by_plan)?;
        Some((expected - (now - begun)).max(OVERDUE * expected))
    }

    /// Seconds that a unit of the plan takes, where the stage at work takes so long in all.
    fn pace(&self, current: f64) -> Option<f64> {
        let [mut planned, mut took] = self.worked_off;
        if self.current.planned > 0.0 {
            (planned, took) = (planned + self.current.planned, took + current);
        }
        (planned > 0.0).then(|| took / planned)
    }

    /// What the plan gave the last stage of a name, and what it took [s].
    fn last_of(&self, name: &str) -> Option<(f64, f64)> {
        self.over.iter().rev().find(|((over, _), _)| *over == name).map(|((_, planned), took)| (*planned, *took))
    }
}

/// How long a stage takes that the plan gives so much, after one of its name that was given and took so much; one that the plan did not
/// have tells by what it took alone.
fn in_proportion((before, took): (f64, f64), planned: f64) -> f64 {
    if before > 0.0 && planned > 0.0 { took * planned / before } else { took }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(s: f64) -> Duration {
        Duration::from_secs_f64(s)
    }

    fn left(estimate: &mut Estimate, now: f64) -> f64 {
        estimate.at(seconds(now)).1.expect("an estimate").as_secs_f64()
    }

    #[test]
    fn even_steps_leave_what_they_leave() {
        let mut work = Estimate::new(&[("replay", 1.0)], 4);
        assert_eq!(work.at(seconds(3.0)), (0.0, None), "nothing is known before the first step");
        work.done(1, seconds(10.0));
        assert!((left(&mut work, 10.0) - 30.0).abs() < 1e-9);
        assert!((left(&mut work, 15.0) - 25.0).abs() < 1e-9, "it goes down between the steps");
        assert!((left(&mut work, 35.0) - 20.0).abs() < 1e-9, "a long step counts no others as done");
        work.done(4, seconds(40.0));
        assert_eq!(work.at(seconds(40.0)), (NEARLY, Some(Duration::ZERO)));
        assert_eq!(work.at(seconds(41.0)), (NEARLY, None), "it takes longer than planned, nobody knows how long");
    }

    /// Plays a diagnosis of two steps of the search against a clock of its own and compares every estimate with what came.
    #[test]
    fn stages_that_take_other_shares_than_planned_are_estimated_from_what_was_measured() {
        let plan = [("baseline", 1.0), ("signatures", 1.0), ("fits", 1.0), ("signatures", 1.0), ("fits", 1.0)];
        let course = [
            ("baseline", 2, 10.0),
            ("signatures", 8, 2.5),
            ("fits", 10, 16.0),
            ("signatures", 8, 2.5),
            ("fits", 10, 16.0),
        ];
        let all: f64 = course.iter().map(|(_, steps, each)| *steps as f64 * each).sum();
        let (mut now, mut shown) = (0.0, 0.0);
        let mut work = Estimate::new(&plan, course[0].1);
        for (place, (name, steps, each)) in course.into_iter().enumerate() {
            if place > 0 {
                work.begin(name, steps, seconds(now));
            }
            for step in 1..=steps {
                now += each;
                work.done(step, seconds(now));
                let (share, left) = work.at(seconds(now));
                assert!(share >= shown, "from {shown} back to {share}");
                shown = share;
                let (left, truly) = (left.expect("an estimate").as_secs_f64(), all - now);
                // Once a stage of each kind was seen at work nothing has to be guessed.
                if place > 2 || (place == 2 && step > 1) {
                    assert!((left - truly).abs() < 0.05 * all, "{name} {step}: {left} s instead of {truly} s");
                }
            }
        }
    }

    #[test]
    fn a_stage_without_a_finished_step_is_expected_to_take_its_planned_share() {
        let mut work = Estimate::new(&[("baseline", 1.0), ("fits", 3.0)], 1);
        work.begin("fits", 5, seconds(20.0));
        assert!((left(&mut work, 20.0) - 60.0).abs() < 1e-9);
        assert!((left(&mut work, 50.0) - 30.0).abs() < 1e-9);
        assert!((left(&mut work, 500.0) - 6.0).abs() < 1e-9, "overdue");
    }

    #[test]
    fn a_stage_that_is_planned_half_as_long_as_one_before_is_expected_to_take_half_as_long() {
        let mut work = Estimate::new(&[("fits", 4.0), ("conclusion", 1.0), ("fits", 2.0)], 1);
        work.begin("conclusion", 2, seconds(40.0));
        work.done(1, seconds(50.0));
        assert!((left(&mut work, 50.0) - 30.0).abs() < 1e-9, "10 s of the conclusion, and 20 s of fits");
        work.begin("fits", 5, seconds(60.0));
        assert!((left(&mut work, 60.0) - 20.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_not_planned_comes_in_between() {
        let mut work = Estimate::new(&[("fits", 1.0), ("conclusion", 1.0)], 1);
        work.begin("intervals", 2, seconds(10.0));
        assert_eq!(work.at(seconds(11.0)).1, None, "nothing is known of it");
        work.done(1, seconds(15.0));
        assert!((left(&mut work, 15.0) - 15.0).abs() < 1e-9, "5 s of it, and the conclusion as long as the fits");
    }
}
