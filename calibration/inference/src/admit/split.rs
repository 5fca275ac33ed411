//! Which clips are for what: fitting, choosing among hypotheses, and confirming what was found.
//!
//! Clips of the same command stay together: what was fitted on one would be known on the other. A diagnosis searches with the fits of
//! one half of the commands and chooses by how they predict the other; what was found is then confirmed on every command in turn, by
//! numbers that are fitted to all others (cross-fitting: Chernozhukov et al. 2018, "Double/debiased machine learning", section 3). Of
//! few commands none can be spared: a draw of two for fitting would decide the answer. There all are fitted in the search, too.

/// The sets, as indices of clips in ascending order.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Split {
    /// Parameters are fitted here.
    pub train: Vec<usize>,
    /// Hypotheses are chosen here; empty for a fit that chooses nothing, and where there are too few commands to keep some of them for
    /// that: there `train` holds all clips.
    pub choose: Vec<usize>,
    /// Held out: errors and shrinks are measured here.
    pub confirm: Vec<usize>,
    /// All clips of `confirm` in sets that are left out together of the fits that they are measured by; empty where `train` has none of
    /// them.
    pub in_turn: Vec<Vec<usize>>,
}

/// Of fewer commands less than four are left to choose by, too few to judge any hypothesis.
pub const COMMANDS_TO_CHOOSE_BY: usize = 8;
/// One in so many commands is held out (a choice): the fit keeps three quarters of what was recorded.
const ONE_IN: usize = 4;

impl Split {
    /// Half of the command groups for training, half for choosing, interleaved so that both see the whole session; `seed` turns the
    /// order. Fewer than eight are all for training. Confirmed is on all, each group left out in turn.
    pub fn new(groups: &[Vec<usize>], seed: u64) -> Self {
        let all = Self::in_turn(groups);
        if groups.len() < COMMANDS_TO_CHOOSE_BY {
            return all;
        }
        let Self { train, choose, .. } =
            Self::interleaved(
                groups,
                seed,
                |split, quarter| {
                    if quarter % 2 == 1 { &mut split.choose } else { &mut split.train }
                },
            );
        Self { train, choose, ..all }
    }

    /// For a fit that chooses nothing: a quarter of the command groups is held out, at least one of two; of a single one nothing.
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
        if self.is_of_few() { &self.train } else { &self.choose }
    }

    /// Whether there are too few commands to keep some of them for choosing.
    pub fn is_of_few(&self) -> bool {
        self.choose.is_empty()
    }

    /// Clips that the search sees.
    pub fn searched(&self) -> Vec<usize> {
        let mut searched = [self.train.clone(), self.choose.clone()].concat();
        searched.sort_unstable();
        searched
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
            let (searched, fitted) = (Split::new(&groups, seed), Split::held_out(&groups, seed));
            prop_assert_eq!(searched.is_of_few(), groups.len() < COMMANDS_TO_CHOOSE_BY);
            prop_assert!(searched.in_turn == groups && fitted.in_turn.is_empty());
            for sets in [[&searched.train, &searched.choose], [&fitted.train, &fitted.confirm]] {
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
        fn a_quarter_of_the_commands_is_held_out_of_a_fit_and_half_of_the_fits_of_a_search(
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
                let searched = Split::new(&groups, seed);
                prop_assert!((commands / 2..=commands.div_ceil(2)).contains(&searched.choose.len()));
                prop_assert_eq!(searched.confirm.len(), commands);
            }
        }
    }

    #[test]
    fn few_commands_are_all_fitted_and_each_is_left_out_in_turn_whatever_the_seed() {
        let groups = vec![vec![0, 4], vec![1], vec![2], vec![3]];
        let split = Split::new(&groups, 0);
        assert_eq!((split.train.len(), split.choose.len(), split.searched().len()), (5, 0, 5));
        assert_eq!(split.in_turn, groups);
        assert!((1..4).all(|seed| Split::new(&groups, seed) == split));
    }
}
