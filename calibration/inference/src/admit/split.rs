//! Which clips are for what: fitting, choosing among hypotheses, and confirming, which is looked at once.
//!
//! Clips of the same command stay together: what was fitted on one would be known on the other. Of few commands none can be
//! spared: a draw of two for fitting would decide the answer. There every command is left out in turn.

/// The sets, as indices of clips in ascending order.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Split {
    /// Parameters are fitted here.
    pub train: Vec<usize>,
    /// Hypotheses are chosen here; empty for a fit that chooses nothing.
    pub choose: Vec<usize>,
    /// Held out: errors and shrinks are measured here.
    pub confirm: Vec<usize>,
    /// Clips that are left out of fits together, one command after the other, where there are too few commands to keep some of
    /// them for choosing and confirming: `train` and `confirm` hold all clips then, and `choose` none.
    pub in_turn: Vec<Vec<usize>>,
}

/// Of fewer commands a quarter is one command, by which no hypothesis can be judged: two for every set of [`Split::new`].
pub const COMMANDS_TO_CHOOSE_BY: usize = 8;
/// One in so many commands is held out (a choice): the fit keeps three quarters of what was recorded.
const ONE_IN: usize = 4;

impl Split {
    /// Half of the command groups for training, a quarter each for choosing and confirming, interleaved so that all three
    /// see the whole session. `seed` turns the order. Fewer than eight are left out in turn.
    pub fn new(groups: &[Vec<usize>], seed: u64) -> Self {
        if groups.len() < COMMANDS_TO_CHOOSE_BY {
            return Self::in_turn(groups);
        }
        Self::interleaved(groups, seed, |split, quarter| match quarter {
            1 => &mut split.choose,
            3 => &mut split.confirm,
            _ => &mut split.train,
        })
    }

    /// For a fit that chooses nothing: a quarter of the command groups, the one that [`Self::new`] confirms by, is held out, at
    /// least one of two; of a single one nothing.
    pub fn held_out(groups: &[Vec<usize>], seed: u64) -> Self {
        let last = groups.len().min(ONE_IN) - usize::from(!groups.is_empty());
        Self::interleaved(
            groups,
            seed,
            |split, quarter| {
                if quarter == last && last > 0 { &mut split.confirm } else { &mut split.train }
            },
        )
    }

    /// Groups dealt out to as many sets as there are quarters, one after the other.
    fn interleaved(groups: &[Vec<usize>], seed: u64, set_of: impl Fn(&mut Self, usize) -> &mut Vec<usize>) -> Self {
        let mut split = Self::default();
        let sets = groups.len().clamp(1, ONE_IN);
        for (place, group) in (seed % sets as u64..).zip(groups) {
            set_of(&mut split, (place % sets as u64) as usize).extend(group);
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

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn no_command_is_on_two_sides_and_no_clip_is_lost(
            commands in proptest::collection::vec(0_usize..12, 1..40),
            seed in 0_u64..1000,
        ) {
            let mut groups: Vec<Vec<usize>> = vec![Vec::new(); 12];
            commands.iter().enumerate().for_each(|(clip, command)| groups[*command].push(clip));
            groups.retain(|group| !group.is_empty());
            for split in [Split::new(&groups, seed), Split::held_out(&groups, seed)] {
                if !split.in_turn.is_empty() {
                    prop_assert!(groups.len() < COMMANDS_TO_CHOOSE_BY && split.in_turn == groups);
                    continue;
                }
                let sets = [&split.train, &split.choose, &split.confirm];
                let mut all = sets.map(Clone::clone).concat();
                all.sort_unstable();
                prop_assert_eq!(all, (0..commands.len()).collect::<Vec<_>>());
                for set in sets {
                    prop_assert!(set.is_sorted());
                    for group in &groups {
                        let inside = group.iter().filter(|clip| set.contains(clip)).count();
                        prop_assert!(inside == 0 || inside == group.len());
                    }
                }
            }
        }

        #[test]
        fn a_quarter_of_the_commands_is_held_out_and_it_is_the_one_that_a_diagnosis_confirms_by(
            commands in 0_usize..40,
            seed in 0_u64..1000,
        ) {
            let groups: Vec<Vec<usize>> = (0..commands).map(|clip| vec![clip]).collect();
            let split = Split::held_out(&groups, seed);
            prop_assert_eq!(split.train.len() + split.confirm.len(), commands);
            match commands {
                0 | 1 => prop_assert!(split.confirm.is_empty()),
                2 | 3 => prop_assert_eq!(split.confirm.len(), 1),
                _ => prop_assert!((commands / 4..=commands.div_ceil(4)).contains(&split.confirm.len())),
            }
            if commands >= COMMANDS_TO_CHOOSE_BY {
                prop_assert_eq!(split.confirm, Split::new(&groups, seed).confirm);
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
