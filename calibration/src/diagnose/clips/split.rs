//! Which clips are for what: fitting, choosing among hypotheses, and confirming, which is looked at once.
//!
//! Clips of the same command stay together: what was fitted on one would be known on the other. Of few commands none can be
//! spared: a draw of two for fitting would decide the answer. There every command is left out in turn.

use capture::recorded;
use shared_mem::msg::motion::SetPoint;
use shared_mem::recording::Clip;

/// The three sets, as indices of clips in ascending order.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Split {
    /// Parameters are fitted here.
    pub train: Vec<usize>,
    /// Hypotheses are chosen here.
    pub choose: Vec<usize>,
    /// The shrink is measured here.
    pub confirm: Vec<usize>,
    /// Clips that are left out of fits together, one command after the other, where there are too few commands to keep some of
    /// them for choosing and confirming: `train` and `confirm` hold all clips then, and `choose` none.
    pub in_turn: Vec<Vec<usize>>,
}

/// Of fewer commands a quarter is one command, by which nothing can be judged.
pub(in crate::diagnose) const FEW: usize = 8;

impl Split {
    /// Half of the command groups for training, a quarter each for choosing and confirming, interleaved so that all three
    /// see the whole session. `seed` turns the order. Fewer than eight are left out in turn.
    pub fn new(groups: &[Vec<usize>], seed: u64) -> Self {
        if groups.len() < FEW {
            return Self::in_turn(groups);
        }
        let mut split = Self::default();
        let offset = usize::try_from(seed % 4).unwrap_or(0);
        for (place, group) in groups.iter().enumerate() {
            let set = match (place + offset) % 4 {
                1 => &mut split.choose,
                3 => &mut split.confirm,
                _ => &mut split.train,
            };
            set.extend(group);
        }
        for set in [&mut split.train, &mut split.choose, &mut split.confirm] {
            set.sort_unstable();
        }
        split
    }

    /// All clips for training and for confirming, each group left out in turn.
    pub fn in_turn(groups: &[Vec<usize>]) -> Self {
        let mut all = groups.concat();
        all.sort_unstable();
        Self { train: all.clone(), choose: Vec::new(), confirm: all, in_turn: groups.to_vec() }
    }

    /// Clips that tell whether a fit does harm elsewhere: those for choosing, or all where none can be spared.
    pub fn elsewhere(&self) -> &[usize] {
        if self.in_turn.is_empty() { &self.choose } else { &self.train }
    }

    /// Clips on which hypotheses may be judged: all but those for confirming, or all where none can be spared.
    pub fn open(&self) -> Vec<usize> {
        let mut open = [self.train.clone(), self.choose.clone()].concat();
        open.sort_unstable();
        open
    }
}

/// Commands that differ by less than this everywhere are the same [rad].
const SAME: f64 = 1e-4;

/// A clip's commanded motion, from rest to rest; `None` where it is no such motion.
type Moving = Option<Vec<SetPoint>>;

/// Clips grouped by their commands, groups in the order of their first clips.
pub fn by_command(clips: &[Clip]) -> Vec<Vec<usize>> {
    let moving: Vec<Moving> = clips.iter().map(|clip| recorded::motion(&clip.desired).ok()).collect();
    let same = |a: usize, b: usize| same_rows(&clips[a], &clips[b]) || same_motion(&moving[a], &moving[b]);
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for index in 0..clips.len() {
        match groups.iter_mut().find(|group| same(group[0], index)) {
            Some(group) => group.push(index),
            None => groups.push(vec![index]),
        }
    }
    groups
}

fn same_rows(a: &Clip, b: &Clip) -> bool {
    let (a, b) = (&a.desired, &b.desired);
    !a.q.is_empty() && a.q.len() == b.q.len() && a.q.iter().zip(&b.q).all(|(a, b)| (a - b).abs() < SAME)
}

/// Whether one repeats the other: how long the arm rested before and after in each clip does not count.
fn same_motion(a: &Moving, b: &Moving) -> bool {
    let (Some(a), Some(b)) = (a, b) else { return false };
    let near = |a: &SetPoint, b: &SetPoint| a.q_d.iter().zip(&b.q_d).all(|(a, b)| (a - b).abs() < SAME);
    a.len().abs_diff(b.len()) <= 1 && a.iter().zip(b).all(|(a, b)| near(a, b))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_clip_is_in_one_set_and_clips_of_one_command_are_in_the_same() {
        let groups = vec![vec![0, 4], vec![1], vec![2, 7], vec![3], vec![5], vec![6], vec![8], vec![9]];
        for seed in 0..4 {
            let split = Split::new(&groups, seed);
            let mut all = [split.train.clone(), split.choose.clone(), split.confirm.clone()].concat();
            all.sort_unstable();
            assert_eq!(all, (0..10).collect::<Vec<_>>());
            for set in [&split.train, &split.choose, &split.confirm] {
                for group in &groups {
                    assert!(
                        group.iter().all(|clip| set.contains(clip)) || group.iter().all(|clip| !set.contains(clip))
                    );
                }
            }
        }
    }

    #[test]
    fn few_commands_are_all_fitted_and_each_is_left_out_in_turn_whatever_the_seed() {
        let groups = vec![vec![0, 4], vec![1], vec![2], vec![3]];
        let split = Split::new(&groups, 0);
        assert_eq!((split.train.len(), split.choose.len(), split.open().len()), (5, 0, 5));
        assert_eq!(split.in_turn, groups);
        assert!((1..4).all(|seed| Split::new(&groups, seed) == split));
    }
}
