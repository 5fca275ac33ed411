//! What a joint is commanded to do at a moment: it stands, or moves slowly or fast one way or the other.

use shared_mem::recording::JointSeries;

/// A joint slower than this stands [rad/s]: a choice.
const STANDING_SPEED: f64 = 0.02;
/// Share of a joint's top speed from which on it is fast [1]: a choice.
const FAST_SHARE: f64 = 0.5;

/// The fastest that each joint is commanded to move in any clip [rad/s].
pub(super) struct Regimes(Vec<f64>);

impl Regimes {
    pub(super) fn of<'a>(commands: impl Iterator<Item = &'a JointSeries> + Clone, dof: usize) -> Self {
        let speed = |joint: usize| {
            let rows = commands.clone().flat_map(|desired| {
                (0..desired.len()).filter_map(move |row| desired.dq_row(row).map(|dq| dq[joint].abs()))
            });
            rows.fold(0.0, f64::max)
        };
        Self((0..dof).map(speed).collect())
    }

    /// By the command that holds at a stamp; without desired velocities every joint stands.
    pub(super) fn at(&self, desired: &JointSeries, stamp_ns: u64, joint: usize) -> &'static str {
        let row = desired.stamps_ns.partition_point(|stamp| *stamp <= stamp_ns).saturating_sub(1);
        let dq = desired.dq_row(row).map_or(0.0, |dq| dq[joint]);
        match dq {
            _ if dq.abs() < STANDING_SPEED => "at rest or reversing",
            _ if dq > FAST_SHARE * self.0[joint] => "fast forward",
            _ if dq < -FAST_SHARE * self.0[joint] => "fast backward",
            _ if dq > 0.0 => "slow forward",
            _ => "slow backward",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_that_holds_says_what_a_joint_does_whichever_rows_were_logged() {
        let rows = [0.0, 0.1, 1.0, -0.6, -0.1];
        let stamps_ns = (0..rows.len() as u64).map(|row| 500 + 10 * row).collect();
        let desired = JointSeries { dof: 1, stamps_ns, q: vec![0.0; rows.len()], dq: rows.to_vec(), tau: Vec::new() };
        let regimes = Regimes(vec![1.0]);
        let at = |stamp_ns| regimes.at(&desired, stamp_ns, 0);
        assert_eq!(
            [at(504), at(510), at(529), at(530), at(600)],
            ["at rest or reversing", "slow forward", "fast forward", "fast backward", "slow backward"]
        );
        let bare = JointSeries { dq: Vec::new(), ..desired.clone() };
        assert_eq!(regimes.at(&bare, 529, 0), "at rest or reversing");
    }
}
