//! Which clips of a session are fitted, which are held out and which are left out, for every identification alike.

use crate::answer::identification::{Clips, Identification};
use inference::admit::remarks::{grouped, left_out_in_words};
use inference::admit::{LeftOut, Split, by_command};
use shared_mem::recording::Clip;

/// Clips by their use.
pub(super) struct Used {
    /// What is fitted, and what is held out ([`Split::confirm`]).
    pub(super) split: Split,
    /// Their files.
    pub(super) clips: Clips,
}

impl Used {
    /// A quarter of the commands of `all`, each with its file, is held out; `seed` draws which.
    pub(super) fn of(all: &[(&str, &Clip)], left_out: Vec<LeftOut>, seed: u64) -> Self {
        let split = Split::held_out(&by_command(all.iter().map(|(_, clip)| *clip)), seed);
        let files = |clips: &[usize]| clips.iter().map(|clip| all[*clip].0.to_owned()).collect();
        let clips = Clips { train: files(&split.train), holdout: files(&split.confirm), left_out };
        Self { split, clips }
    }

    /// What a reader has to know about them; `another`: what to record where nothing could be held out.
    pub(super) fn warnings(&self, another: &str) -> Vec<String> {
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
