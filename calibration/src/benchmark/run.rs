//! A whole benchmark: draws the worlds, records their sessions, has them diagnosed.

use super::score::Method;
use super::{rules, trial};
use inference::interrupt::Interrupt;
use shared_mem::cell::Cell;
use shared_mem::console;
use shared_mem::progress::Progress;
use worlds::world::{Fault, Kind, Outside, World};
use worlds::{draw, session};

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Extent {
    /// A dozen of all sorts.
    Short,
    /// Every effect so many times in each kind of session, half as many worlds without any, and a quarter as many with two.
    Full(u64),
    /// So many without anything wrong.
    Null(u64),
}

/// What is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    pub extent: Extent,
    /// Clips in each session.
    pub clips: usize,
    /// Number of the first world.
    pub seed: u64,
}

/// The golden section: its multiples fall evenly into one turn, however many are taken.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// What came of it.
#[derive(Debug)]
pub struct Outcome {
    /// What each method said; the diagnosis first.
    pub methods: Vec<Method>,
    /// Worlds that gave no session or could not be diagnosed, with the reason.
    pub left_out: Vec<String>,
}

/// Runs the benchmark. Ctrl-C ends it, without the world in hand.
pub fn run(plan: &Plan, cell: &Cell, interrupt: &Interrupt) -> Outcome {
    let worlds = plan.worlds();
    let bar = Progress::new("benchmark", worlds.len() as u64);
    let names = std::iter::once("this diagnosis").chain(rules::NAMES);
    let mut methods: Vec<Method> = names.map(|name| Method { name: name.into(), cases: Vec::new() }).collect();
    let mut left_out = Vec::new();
    for (done, (number, kind, fault)) in worlds.into_iter().enumerate() {
        if interrupt.asked() {
            break;
        }
        let world = World::draw(number, kind, fault, cell);
        bar.show(done as u64, &format!("world {number}"));
        let judged = judged(&world, plan.clips, interrupt);
        if interrupt.asked() {
            // What was cut short is no answer.
            break;
        }
        match judged {
            Ok(cases) => {
                console::line(cases[0].line());
                methods.iter_mut().zip(cases).for_each(|(method, case)| method.cases.push(case));
            }
            Err(error) => left_out.push(format!("world {number}: {error}")),
        }
    }
    Outcome { methods, left_out }
}

fn judged(world: &World, clips: usize, interrupt: &Interrupt) -> anyhow::Result<Vec<super::score::Case>> {
    Ok(trial::examine(world, session::record(world, clips)?, interrupt)?)
}

impl Plan {
    /// Number, kind and fault of every world.
    fn worlds(&self) -> Vec<(u64, Kind, Fault)> {
        let mut faults = Vec::new();
        for kind in [Kind::Excitation, Kind::Strokes] {
            let (all, outside) = (draw::candidates(kind == Kind::Strokes).len(), Outside::of(kind));
            let (singles, outside, pairs, nothing): (Vec<usize>, &[Outside], _, _) = match self.extent {
                Extent::Short => ((1..all).step_by(all / 2).collect(), &outside[..1], 1, 2),
                Extent::Full(rounds) => {
                    let rounds = usize::try_from(rounds).unwrap_or(1);
                    ((0..all * rounds).collect(), outside, all * rounds / 4, all * rounds / 2)
                }
                Extent::Null(worlds) => {
                    let of_kind = if kind == Kind::Strokes { worlds / 2 } else { worlds.div_ceil(2) };
                    (Vec::new(), &[], 0, usize::try_from(of_kind).unwrap_or(usize::MAX))
                }
            };
            faults.extend(singles.into_iter().map(|which| (kind, Fault::Single(which))));
            faults.extend(outside.iter().map(|outside| (kind, Fault::Outside(*outside))));
            faults.extend((0..pairs).map(|_| (kind, Fault::Pair)));
            faults.extend((0..nothing).map(|_| (kind, Fault::Nothing)));
        }
        let mut worlds: Vec<_> =
            (self.seed..).zip(faults).map(|(number, (kind, fault))| (number, kind, fault)).collect();
        // Whoever ends early has met all sorts alike.
        let place = |number: u64| ((number - self.seed) as f64 * GOLDEN).fract();
        worlds.sort_by(|a, b| place(a.0).total_cmp(&place(b.0)));
        worlds
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_short_form_meets_every_sort_of_world_in_both_kinds_of_session() {
        let worlds = Plan { extent: Extent::Short, clips: 8, seed: 1 }.worlds();
        assert!((8..=16).contains(&worlds.len()), "{}", worlds.len());
        for kind in [Kind::Excitation, Kind::Strokes] {
            let has = |sort: fn(&Fault) -> bool| worlds.iter().any(|(_, k, fault)| *k == kind && sort(fault));
            assert!(has(|fault| matches!(fault, Fault::Single(_))) && has(|fault| *fault == Fault::Pair));
            assert!(has(|fault| matches!(fault, Fault::Outside(_))) && has(|fault| *fault == Fault::Nothing));
        }
    }

    #[test]
    fn the_first_half_meets_all_sorts_about_alike() {
        let worlds = Plan { extent: Extent::Full(1), clips: 8, seed: 5 }.worlds();
        let (half, _) = worlds.split_at(worlds.len() / 2);
        for kind in [Kind::Excitation, Kind::Strokes] {
            for sort in [|fault: &Fault| matches!(fault, Fault::Single(_)), |fault: &Fault| *fault == Fault::Nothing] {
                let count =
                    |worlds: &[(u64, Kind, Fault)]| worlds.iter().filter(|(_, k, f)| *k == kind && sort(f)).count();
                assert!(count(half).abs_diff(count(&worlds) - count(half)) <= 4, "{kind:?}");
            }
        }
    }

    #[test]
    fn so_many_worlds_without_anything_wrong_are_met_as_were_asked_for() {
        for asked in [0, 1, 8, 301] {
            let worlds = Plan { extent: Extent::Null(asked), clips: 8, seed: 1 }.worlds();
            assert!(worlds.len() as u64 == asked && worlds.iter().all(|(_, _, fault)| *fault == Fault::Nothing));
        }
    }

    #[test]
    fn the_full_form_meets_every_effect() {
        let worlds = Plan { extent: Extent::Full(1), clips: 8, seed: 1 }.worlds();
        let singles = worlds.iter().filter(|(_, _, fault)| matches!(fault, Fault::Single(_))).count();
        assert_eq!(singles, draw::candidates(false).len() + draw::candidates(true).len());
    }
}
