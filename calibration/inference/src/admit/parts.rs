//! Parts of clips in place of clips, where an arm was recorded with few different commands.
//!
//! Of four clips, one that alone has fast motion is predicted by none of the others, and three that gain against one that loses
//! prove nothing. Parts are simulated from the state that was measured where each begins, and what moves in one of them is for
//! the most part met in others. Parts at the same place of clips with the same command stay together. A fifth of them in turn is
//! left out of the fits that a gap is measured with.

use super::length;
use super::session::Admitted;
use super::split::{COMMANDS_TO_CHOOSE_BY, Split};
use shared_mem::cell::ClipKind;
use shared_mem::recording::{Clip, JointSeries};
use shared_mem::time::seconds_between;

/// So many parts are made of a session: where eleven of twelve speak for an effect, that is no chance (p = 0.003).
const PARTS_WANTED: f64 = 12.0;
/// No part is shorter [s]. Residuals of a model that is not exact are alike over tenths of a second, and what a command moves is
/// over within about one.
const SHORTEST_PART: f64 = 1.5;

/// Fits that a gap is measured with leave out one of so many sets of parts in turn: as many fits as with four or five whole clips.
const SETS_IN_TURN: usize = 5;

impl Admitted {
    /// Clips of arms alone in parts, where there are fewer different commands than a session can be split by. Clips with an
    /// object stay whole: a hit is one event.
    pub fn in_parts(self) -> Self {
        let few =
            self.commands < COMMANDS_TO_CHOOSE_BY && self.clips.iter().all(|clip| clip.kind == ClipKind::Excitation);
        // The shortest clip of a command decides: all its clips are cut into as many parts.
        let seconds = |group: &Vec<usize>| {
            let of = |clip: &usize| span(&self.clips[*clip]);
            group.iter().map(of).map(|[from, to]| seconds_between(from, to)).fold(f64::INFINITY, f64::min)
        };
        let all: f64 = self.groups.iter().map(seconds).sum();
        let length = (all / PARTS_WANTED).max(SHORTEST_PART);
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
    pub fn split(&self, seed: u64) -> Split {
        if self.commands >= COMMANDS_TO_CHOOSE_BY {
            return Split::new(&self.groups, seed);
        }
        if self.groups.len() == self.commands {
            return Split::in_turn(&self.groups);
        }
        let mut sets = vec![Vec::new(); SETS_IN_TURN];
        for (place, group) in self.groups.iter().enumerate() {
            sets[place % SETS_IN_TURN].extend(group);
        }
        sets.retain(|set| !set.is_empty());
        Split::in_turn(&sets)
    }

    /// How many clips there are where they count in parts; `None` where they count whole.
    pub fn cut(&self) -> Option<usize> {
        let mut files = self.files.clone();
        files.dedup();
        (self.groups.len() > self.commands).then_some(files.len())
    }

    /// What a clip is called among all: its file, and which part of it where it counts in parts.
    pub fn label(&self, clip: usize) -> String {
        let file = &self.files[clip];
        let places: Vec<usize> = (0..self.files.len()).filter(|other| self.files[*other] == *file).collect();
        match places.iter().position(|place| *place == clip) {
            Some(part) if places.len() > 1 => format!("{file} (part {} of {})", part + 1, places.len()),
            _ => file.clone(),
        }
    }
}

/// From when to when a clip has both commands and measured joints [ns].
fn span(clip: &Clip) -> [u64; 2] {
    let ends = |series: &JointSeries| [series.stamps_ns.first(), series.stamps_ns.last()].map(Option::<&u64>::copied);
    let ([from, to], [commanded_from, commanded_to]) = (ends(&clip.measured), ends(&clip.desired));
    let from_ns = from.max(commanded_from).unwrap_or_default();
    [from_ns, to.min(commanded_to).unwrap_or_default().max(from_ns)]
}

fn in_equal_parts(clip: &Clip, count: usize) -> impl Iterator<Item = Clip> {
    let [from_ns, to_ns] = span(clip);
    let edge = move |part: usize| from_ns + (to_ns - from_ns) / count as u64 * part as u64;
    (0..count).map(move |part| length::part(clip, [edge(part), edge(part + 1)]))
}

#[cfg(test)]
mod tests {
    use super::super::test_clip::of_one_joint;
    use super::*;

    /// A joint that follows a sine of its own frequency for so many seconds.
    fn clip(seconds: u64, frequency: f64) -> Clip {
        let stamps_ns = (0..=seconds * 100).map(|i| 1_000_000_000 + i * 10_000_000).collect();
        of_one_joint(stamps_ns, |t| (frequency * t).sin())
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
        let split = cut.split(0);
        assert_eq!((split.in_turn.len(), split.train.len(), split.confirm.len(), split.choose.len()), (5, 17, 17, 0));
        assert!(split.in_turn.iter().all(|set| (2..=5).contains(&set.len())), "{split:?}");
        assert_eq!((whole.split(0).in_turn, whole.cut(), cut.cut()), (whole.groups.clone(), None, Some(5)));
        // Every row is in a part, and a part has the commands that are still on their way when it begins.
        let rows: usize = cut.clips[..4].iter().map(|clip| clip.measured.len()).sum();
        assert!(rows >= whole.clips[0].measured.len(), "{rows}");
        assert_eq!(cut.clips[0].desired.stamps_ns[0], 1_000_000_000);
        let [begins, commanded_from] =
            [&cut.clips[1].measured, &cut.clips[1].desired].map(|series| series.stamps_ns[0]);
        assert_eq!(begins - commanded_from, 500_000_000);
    }

    #[test]
    fn rare_commands_lead_a_part_from_before_it_and_what_nothing_leads_any_more_is_no_part() {
        let whole = admitted((1..=4).map(|i| clip(6, f64::from(i))).collect());
        // A command every two seconds, and none in the last two.
        let seldom = |mut clip: Clip| {
            let rows: Vec<usize> = vec![0, 200, 400];
            clip.desired.stamps_ns = rows.iter().map(|row| clip.desired.stamps_ns[*row]).collect();
            clip.desired.q = rows.iter().map(|row| clip.desired.q[*row]).collect();
            clip
        };
        let cut = admitted(whole.clips.into_iter().map(seldom).collect()).in_parts();
        assert_eq!(cut.clips.len(), 12);
        for clip in &cut.clips {
            let [desired, measured] = [&clip.desired.stamps_ns, &clip.measured.stamps_ns];
            assert!(desired[0] <= measured[0] && measured.last() <= Some(&5_000_000_000), "{measured:?}");
        }
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
