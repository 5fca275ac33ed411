//! Which clips follow the same command: the one rule for it.
//!
//! Two commands are the same where the joints are sent the same way in the same time. How long they rest before and after does not
//! count, nor at which moments a command was logged: both are held against each other from where they are half of their way off.

use shared_mem::recording::{Clip, JointSeries};
use shared_mem::time::seconds_between;

/// Positions that differ by less are the same [rad]: logs of 50 Hz, of which the rows between are taken on straight lines, agree to
/// half of it at 10 rad/s²; motions of a session differ by ten times as much and more.
const SAME_POSITION: f64 = 2e-3;
/// Moving parts whose durations differ by less are the same, as a share of the longer: when a motion of a second begins and ends is
/// known to a row of the log (a choice).
const SAME_DURATION: f64 = 0.02;
/// Times of the moving part at which positions are compared (a choice: few motions of an arm turn round more often).
const TIMES: usize = 24;

/// What a clip's joints are sent to; times in seconds from its first row.
struct Command<'a> {
    desired: &'a JointSeries,
    /// When the joints leave where they begin, and when they arrive where they end.
    moves: [f64; 2],
    /// When a joint is first half as far from where it began as one ever is.
    half_way: f64,
}

impl<'a> Command<'a> {
    /// `None` where nothing was commanded.
    fn of(desired: &'a JointSeries) -> Option<Self> {
        let rows: Vec<usize> = (0..desired.len()).collect();
        let farthest = rows.iter().map(|row| away(desired, *row, 0)).reduce(f64::max)?;
        let backwards: Vec<usize> = rows.iter().rev().copied().collect();
        let from = leaves(desired, &rows, SAME_POSITION).unwrap_or(0.0);
        // An arm that never moves arrives where it left.
        let to = leaves(desired, &backwards, SAME_POSITION).unwrap_or(from).max(from);
        let half_way = leaves(desired, &rows, 0.5 * farthest).unwrap_or(0.0);
        Some(Self { desired, moves: [from, to], half_way })
    }

    fn duration(&self) -> f64 {
        self.moves[1] - self.moves[0]
    }

    fn is(&self, other: &Self) -> bool {
        let longer = self.duration().max(other.duration());
        if self.desired.dof != other.desired.dof || (self.duration() - other.duration()).abs() > SAME_DURATION * longer
        {
            return false;
        }
        let same_at = |place: usize| {
            let time = self.moves[0] + self.duration() * place as f64 / (TIMES - 1) as f64;
            // Of the other at the moment that lies as far from its half way: stamps and rests before the motion are its own.
            let [q, of_other] =
                [(self, time), (other, time - self.half_way + other.half_way)].map(|(command, time)| command.at(time));
            q.iter().zip(&of_other).all(|(a, b)| (a - b).abs() < SAME_POSITION)
        };
        (0..TIMES).all(same_at)
    }

    /// Positions at a time, on the straight way between two rows [rad].
    fn at(&self, time: f64) -> Vec<f64> {
        let series = self.desired;
        let last = series.len() - 1;
        let stamp_ns = series.stamps_ns[0].saturating_add_signed((1e9 * time).round() as i64);
        let after = series.stamps_ns.partition_point(|stamp| *stamp < stamp_ns).min(last);
        let before = after.saturating_sub(1);
        let [from, to] = [before, after].map(|row| time_of(series, row));
        let share = if to > from { ((time - from) / (to - from)).clamp(0.0, 1.0) } else { 0.0 };
        series.q_row(before).iter().zip(series.q_row(after)).map(|(a, b)| a + share * (b - a)).collect()
    }
}

/// Seconds from the first row.
fn time_of(series: &JointSeries, row: usize) -> f64 {
    seconds_between(series.stamps_ns[0], series.stamps_ns[row])
}

/// How far the joint that is farthest away is from where it is in another row [rad].
fn away(series: &JointSeries, row: usize, from: usize) -> f64 {
    series.q_row(row).iter().zip(series.q_row(from)).map(|(q, start)| (q - start).abs()).fold(0.0, f64::max)
}

/// When, going through the rows in this order, a joint is first so far from where it is in the first of them [s].
fn leaves(series: &JointSeries, rows: &[usize], far: f64) -> Option<f64> {
    let away = |row: usize| away(series, row, rows[0]);
    let pair = rows.windows(2).find(|pair| away(pair[1]) > far)?;
    let share = (far - away(pair[0])) / (away(pair[1]) - away(pair[0]));
    let [before, after] = [pair[0], pair[1]].map(|row| time_of(series, row));
    Some(before + share * (after - before))
}

/// Clips grouped by their commands, groups in the order of their first clips. Clips without a command are each by itself.
pub fn by_command<'a>(clips: impl IntoIterator<Item = &'a Clip>) -> Vec<Vec<usize>> {
    let commands: Vec<Option<Command<'_>>> = clips.into_iter().map(|clip| Command::of(&clip.desired)).collect();
    let same = |a: usize, b: usize| commands[a].as_ref().zip(commands[b].as_ref()).is_some_and(|(a, b)| a.is(b));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for clip in 0..commands.len() {
        // Held against the first of a group alone: along a chain of clips that are nearly the same, small differences add up.
        match groups.iter_mut().find(|group| same(group[0], clip)) {
            Some(group) => group.push(clip),
            None => groups.push(vec![clip]),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::super::test_clip::of_one_joint;
    use super::*;
    use proptest::prelude::*;

    /// A joint that rests, swings by half a radian and back within `seconds`, and rests, logged at so many rows a second from `phase` on.
    fn swing(seconds: f64, rate: f64, [rest, phase]: [f64; 2]) -> Clip {
        let rows = ((seconds + 2.0 * rest) * rate) as u64;
        let stamps = (0..rows).map(|row| (1e9 * (phase + row as f64 / rate)) as u64).collect();
        let turn = move |t: f64| std::f64::consts::TAU * ((t - rest) / seconds).clamp(0.0, 1.0);
        of_one_joint(stamps, move |t| 0.25 * (1.0 - turn(t).cos()))
    }

    proptest! {
        #[test]
        fn a_repeat_is_the_same_command_however_it_was_logged_and_however_long_the_arm_rested(
            seconds in 1.0_f64..8.0,
            rate in 50.0_f64..1000.0,
            rest in 0.1_f64..2.0,
            phase in 0.0_f64..0.02,
        ) {
            let clips = [swing(seconds, 1000.0, [0.5, 0.0]), swing(seconds, rate, [rest, phase])];
            prop_assert_eq!(by_command(&clips), vec![vec![0, 1]]);
        }

        #[test]
        fn groups_do_not_depend_on_the_order_of_the_clips(order in Just([2.0, 3.0, 2.0, 5.0, 3.0, 2.0]).prop_shuffle()) {
            let clips: Vec<Clip> = order.iter().map(|seconds| swing(*seconds, 200.0, [0.5, 0.0])).collect();
            let groups = by_command(&clips);
            let mut found: Vec<(usize, f64)> = groups.iter().map(|group| (group.len(), order[group[0]])).collect();
            found.sort_by(|a, b| a.1.total_cmp(&b.1));
            prop_assert_eq!(found, vec![(3, 2.0), (2, 3.0), (1, 5.0)]);
            for group in &groups {
                prop_assert!(group.iter().all(|clip| order[*clip] == order[group[0]]));
            }
        }
    }

    #[test]
    fn other_speeds_places_and_clips_without_commands_are_other_commands() {
        let mut elsewhere = swing(4.0, 100.0, [0.5, 0.0]);
        elsewhere.desired.q.iter_mut().for_each(|q| *q += 0.01);
        let mut silent = swing(4.0, 100.0, [0.5, 0.0]);
        silent.desired = JointSeries::default();
        let clips = [swing(4.0, 100.0, [0.5, 0.0]), swing(2.0, 100.0, [0.5, 0.0]), elsewhere, silent.clone(), silent];
        assert_eq!(by_command(&clips).len(), 5);
    }

    #[test]
    fn an_arm_that_is_held_in_one_pose_follows_one_command() {
        let hold = |q: f64| of_one_joint((0..50).map(|row| row * 10_000_000).collect(), move |_| q);
        assert_eq!(by_command(&[hold(0.3), hold(0.5), hold(0.3)]), [vec![0, 2], vec![1]]);
    }
}
