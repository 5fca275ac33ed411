//! Parts of clips in place of clips, where an arm was recorded with few different commands.
//!
//! Of four clips, one that alone has fast motion is predicted by none of the others, and three that gain against one that loses
//! prove nothing. Parts are simulated from the state that was measured where each begins, and what moves in one of them is for
//! the most part met in others. Parts at the same place of clips with the same command stay together: each such group is left
//! out of fits in turn.

use super::split::{FEW, Split};
use crate::diagnose::clips::admit::Admitted;
use shared_mem::cell::ClipKind;
use shared_mem::recording::Clip;

/// So many parts are made of a session: where eleven of twelve speak for an effect, that is no chance (p = 0.003).
const WANTED: f64 = 12.0;
/// No part is shorter [s]. Residuals of a model that is not exact are alike over tenths of a second, and what a command moves is
/// over within about one.
const SHORTEST: f64 = 1.5;
/// Commands from before a part are kept for so long: some are still on their way [ns].
const BEFORE_NS: u64 = 500_000_000;

impl Admitted {
    /// Clips of arms alone in parts, where there are fewer different commands than a session can be split by. Clips with an
    /// object stay whole: a hit is one event.
    #[must_use]
    pub fn in_parts(self) -> Self {
        let few = self.commands < FEW && self.clips.iter().all(|clip| clip.kind == ClipKind::Excitation);
        let seconds = |group: &Vec<usize>| {
            group.iter().map(|clip| self.clips[*clip].measured.duration()).fold(f64::INFINITY, f64::min)
        };
        let all: f64 = self.groups.iter().map(seconds).sum();
        let length = (all / WANTED).max(SHORTEST);
        let counts: Vec<usize> =
            self.groups.iter().map(|group| (seconds(group) / length).round().max(1.0) as usize).collect();
        let parts: usize = counts.iter().sum();
        if !few || parts <= self.groups.len() {
            return self;
        }
        let mut cut = Self { clips: Vec::new(), files: Vec::new(), groups: Vec::new(), ..self };
        for (group, count) in self.groups.iter().zip(counts) {
            let first = cut.clips.len();
            for clip in group {
                cut.clips.extend(in_equal_parts(&self.clips[*clip], count));
                cut.files.extend(std::iter::repeat_n(&self.files[*clip], count).cloned());
            }
            let members = |part| (0..group.len()).map(|clip| first + clip * count + part).collect();
            cut.groups.extend((0..count).map(members));
        }
        cut
    }

    /// Which clips are for what.
    #[must_use]
    pub fn split(&self, seed: u64) -> Split {
        if self.commands < FEW { Split::in_turn(&self.groups) } else { Split::new(&self.groups, seed) }
    }

    /// What a clip is called among all: its file, and which part of it where it counts in parts.
    #[must_use]
    pub fn label(&self, clip: usize) -> String {
        let file = &self.files[clip];
        let places: Vec<usize> = (0..self.files.len()).filter(|other| self.files[*other] == *file).collect();
        match places.iter().position(|place| *place == clip) {
            Some(part) if places.len() > 1 => format!("{file} (part {} of {})", part + 1, places.len()),
            _ => file.clone(),
        }
    }
}

fn in_equal_parts(clip: &Clip, count: usize) -> impl Iterator<Item = Clip> {
    let stamps_ns = &clip.measured.stamps_ns;
    let [first, last] = [stamps_ns.first(), stamps_ns.last()].map(|stamp| stamp.copied().unwrap_or_default());
    let edge = move |part: usize| first + (u128::from(last - first) * part as u128 / count as u128) as u64;
    (0..count).map(move |part| {
        let (from_ns, to_ns) = (edge(part), edge(part + 1));
        let mut cut = clip.clone();
        cut.measured = clip.measured.between(from_ns..=to_ns);
        cut.desired = clip.desired.between(from_ns.saturating_sub(BEFORE_NS)..=to_ns);
        cut
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::recording::{JointSeries, ObjectSeries};

    /// A joint that follows a sine of its own frequency for so many seconds.
    fn clip(seconds: u64, frequency: f64) -> Clip {
        let stamps_ns: Vec<u64> = (0..=seconds * 100).map(|i| 1_000_000_000 + i * 10_000_000).collect();
        let q = stamps_ns.iter().map(|ns| (frequency * *ns as f64 * 1e-9).sin()).collect();
        let series = JointSeries { stamps_ns, dof: 1, q, dq: Vec::new(), tau: Vec::new() };
        Clip {
            file: "clip.mcap".into(),
            kind: ClipKind::Excitation,
            joint_names: vec!["joint1".into()],
            desired: series.clone(),
            measured: series,
            torques_end_at_rows: false,
            object: ObjectSeries::default(),
            others: Vec::new(),
            warnings: Vec::new(),
            damage: None,
        }
    }

    fn admitted(clips: Vec<Clip>) -> Admitted {
        let files = (0..clips.len()).map(|i| format!("{i}.mcap")).collect();
        Admitted::of(clips, files, false)
    }

    #[test]
    fn of_few_commands_clips_count_in_parts_and_those_of_one_command_stay_together() {
        // The last repeats the first.
        let whole = admitted(vec![clip(6, 1.0), clip(6, 2.0), clip(2, 3.0), clip(6, 4.0), clip(6, 1.0)]);
        let cut = admitted(whole.clips.clone()).in_parts();
        assert_eq!((cut.commands, cut.groups.len(), cut.clips.len()), (4, 13, 17));
        assert_eq!(cut.groups.iter().filter(|group| group.len() == 2).count(), 4);
        assert_eq!((cut.label(1), cut.label(12)), ("0.mcap (part 2 of 4)".to_owned(), "2.mcap".to_owned()));
        for group in &cut.groups {
            let of = |clip: &usize| &cut.clips[*clip];
            assert!(group.iter().all(|clip| of(clip).measured == of(&group[0]).measured));
        }
        // Every row is in a part, and a part has the commands that are still on their way when it begins.
        let rows: usize = cut.clips[..4].iter().map(|clip| clip.measured.len()).sum();
        assert!(rows >= whole.clips[0].measured.len(), "{rows}");
        assert_eq!(cut.clips[0].desired.stamps_ns[0], 1_000_000_000);
        let [begins, led_from] = [&cut.clips[1].measured, &cut.clips[1].desired].map(|series| series.stamps_ns[0]);
        assert_eq!(begins - led_from, BEFORE_NS);
    }

    #[test]
    fn clips_stay_whole_where_they_are_many_or_short_or_hold_an_object() {
        let many = admitted((1..=8).map(|i| clip(6, f64::from(i))).collect());
        assert_eq!(many.in_parts().clips.len(), 8);
        let short = admitted((1..=4).map(|i| clip(1, f64::from(i))).collect());
        assert_eq!(short.in_parts().clips.len(), 4);
        let mut strokes: Vec<Clip> = (1..=4).map(|i| clip(6, f64::from(i))).collect();
        strokes.iter_mut().for_each(|clip| clip.kind = ClipKind::ControlHitSlide);
        assert_eq!(admitted(strokes).in_parts().clips.len(), 4);
    }
}
