//! Which clips of a session are fitted, which are held out and which are left out, for every identification alike.

use crate::answer::identification::{Clips, Identification};
use inference::admit::remarks::{grouped, left_out_in_words};
use inference::admit::{LeftOut, Split, by_command};
use shared_mem::recording::Clip;

/// Clips by their use.
pub(super) struct Used {
    /// What is fitted, and what is held out ([`Split::confirm`]).
    pub(super) split: Split,
    pub(super) clips: Clips,
}

impl Used {
    /// A quarter of the commands of `all`, each with its file, is held out; `seed` draws which.
    pub(super) fn of<'a>(all: impl IntoIterator<Item = (String, &'a Clip)>, left_out: Vec<LeftOut>, seed: u64) -> Self {
        let (names, clips): (Vec<String>, Vec<&Clip>) = all.into_iter().unzip();
        let split = Split::held_out(&by_command(clips), seed);
        let files = |clips: &[usize]| clips.iter().map(|clip| names[*clip].clone()).collect();
        let clips = Clips { train: files(&split.train), holdout: files(&split.confirm), left_out };
        Self { split, clips }
    }

    /// What a reader has to know about them; `another`: what to record where nothing could be held out.
    pub(super) fn warnings(&self, another: &str) -> Vec<String> {
        // A split holds nothing out of a single command.
        let alone = self.split.confirm.is_empty().then(|| {
            format!(
                "there is a single motion, so nothing could be held out: how far off the twin is elsewhere is not known; record {another}"
            )
        });
        let Clips { train, holdout, left_out } = &self.clips;
        alone.into_iter().chain(left_out_in_words(left_out, train.len() + holdout.len())).collect()
    }

    /// Takes what is odd about single clips into the warnings of an answer, what many share once.
    pub(super) fn add_remarks(answer: &mut Identification) {
        let remarks =
            answer.by_clip.iter().flat_map(|clip| clip.warnings.iter().map(|why| (clip.file.as_str(), why.as_str())));
        let remarks = grouped(remarks);
        answer.warnings.extend(remarks);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::cell::ClipKind;
    use shared_mem::recording::{JointSeries, ObjectSeries};

    /// A joint that swings so fast.
    fn clip(speed: u32) -> Clip {
        let stamps_ns: Vec<u64> = (0..200).map(|row| row * 10_000_000).collect();
        let q = (0..200).map(|row| (f64::from(speed) * f64::from(row) * 0.01).sin()).collect();
        let desired = JointSeries { stamps_ns, dof: 1, q, ..JointSeries::default() };
        Clip {
            file: "clip.mcap".into(),
            kind: ClipKind::Excitation,
            torques_end_at_rows: false,
            origins: shared_mem::origin::Origins::default(),
            joint_names: vec!["a".into()],
            measured: desired.clone(),
            desired,
            object: ObjectSeries::default(),
            others: Vec::new(),
            warnings: Vec::new(),
            damage: None,
        }
    }

    #[test]
    fn repeats_stay_on_one_side_and_a_single_motion_leaves_nothing_to_hold_out() {
        let clips = [1, 2, 1, 3, 4].map(clip);
        let files = ["a", "b", "c", "d", "e"];
        let all: Vec<(String, &Clip)> = files.into_iter().map(str::to_owned).zip(&clips).collect();
        for seed in 0..8 {
            let used = Used::of(all.clone(), Vec::new(), seed);
            let Clips { train, holdout, .. } = &used.clips;
            assert_eq!(train.len() + holdout.len(), 5);
            assert_eq!(train.contains(&"a".to_owned()), train.contains(&"c".to_owned()), "seed {seed}");
            assert!((1..=2).contains(&holdout.len()) && used.warnings("another").is_empty(), "{holdout:?}");
        }
        let alone =
            Used::of([all[0].clone(), all[2].clone()], vec![LeftOut { file: "f".into(), why: "not hit".into() }], 0);
        assert!(alone.clips.holdout.is_empty() && alone.split.train == [0, 1]);
        let said = alone.warnings("another motion");
        assert!(said[0].contains("a single motion") && said[0].ends_with("record another motion"), "{said:?}");
        assert_eq!(said[1], "1 of 3 clips were left out: f: not hit");
    }
}
