//! What one model is worth over another: the gain in log-likelihood of clips at numbers that were not fitted to them, clip by clip.

use inference::statistics::{median, student_sigmas};

/// What a clip gains, or leaves, counts up to so many times that of its session's clip in the middle (a choice): no clip decides alone,
/// and none makes what all the others say uncertain.
pub const MAX_OF_MEDIAN: f64 = 5.0;
/// What chance makes of a gain, or of a slope, reaches so many standard errors, were these known exactly: 2.3 % of a normal distribution lie above.
pub const CHANCE_SIGMAS: f64 = 2.0;
/// Models are worth the same that differ by less [nats]: a likelihood ratio of 55. Nats count less than they say, since twins are never
/// exact: over this temperature shares of the evidence agree with frequencies.
pub const SAME_WORTH_NATS: f64 = 4.0;
/// More than this share of the clips is nearly all of them: 11 of 12 do not agree by chance (p = 0.003).
const NEARLY_ALL_CLIPS: f64 = 0.85;
/// What would take more than so many times the clips at hand is no promise (a choice).
const MAX_TIMES_CLIPS: f64 = 6.0;

/// What one model is worth over another on the same clips.
#[derive(Debug, Clone, PartialEq)]
pub struct Gain {
    /// Sum over clips of the gain in ln of the likelihood, outstanding clips cut off [nats].
    pub nats: f64,
    /// Its standard error from the scatter between the clips of each session.
    pub error: f64,
    /// Share of the clips that gain.
    pub share: f64,
    /// Clip by clip, session by session, outstanding ones cut off [nats].
    sessions: Vec<Vec<f64>>,
}

impl Gain {
    /// Of the gains of the clips of each session [nats]; one counts up to `max_of_clip_nats` whatever the others of its session gain.
    pub fn of(mut sessions: Vec<Vec<f64>>, max_of_clip_nats: f64) -> Self {
        for gains in &mut sessions {
            let middle = median(gains.iter().map(|gain| gain.abs())).unwrap_or(0.0);
            let most = (MAX_OF_MEDIAN * middle).max(max_of_clip_nats);
            gains.iter_mut().for_each(|gain| *gain = gain.clamp(-most, most));
        }
        Self::uncut(sessions)
    }

    fn uncut(sessions: Vec<Vec<f64>>) -> Self {
        let (mut nats, mut variance) = (0.0, 0.0);
        // What one session gains says nothing about what another does.
        for gains in &sessions {
            let (total, count) = (gains.iter().sum::<f64>(), gains.len() as f64);
            let mean = total / count.max(1.0);
            let squares: f64 = gains.iter().map(|gain| (gain - mean).powi(2)).sum();
            nats += total;
            variance += squares / (count - 1.0).max(1.0) * count;
        }
        let all = || sessions.iter().flatten();
        let share = all().filter(|gain| **gain > 0.0).count() as f64 / all().count().max(1) as f64;
        Self { nats, error: variance.sqrt(), share, sessions }
    }

    /// How many clips judged.
    pub fn clips(&self) -> usize {
        self.sessions.iter().map(Vec::len).sum()
    }

    /// Whether nearly all clips gain.
    pub fn in_nearly_all(&self) -> bool {
        self.share > NEARLY_ALL_CLIPS
    }

    /// What it is worth less what `cost` numbers gain by chance: half a nat each.
    pub fn net(&self, cost: usize) -> f64 {
        self.nats - 0.5 * cost as f64
    }

    /// What chance may make of it [nats]: its error is itself known from so few clips (Student's t).
    pub fn by_chance(&self) -> f64 {
        student_sigmas(CHANCE_SIGMAS, self.clips().saturating_sub(self.sessions.len())) * self.error
    }

    /// The same as if its error were known exactly.
    pub fn twice_its_error(&self) -> f64 {
        CHANCE_SIGMAS * self.error
    }

    /// Whether more clips gain than lose, and by more, beyond chance (Wilcoxon 1945, "Individual comparisons by ranking methods": the
    /// signed-rank test in its normal approximation). What one clip gains counts by its rank alone, so that clips whose gains differ
    /// widely are no reason to doubt what they say alike.
    pub fn is_no_chance_by_ranks(&self) -> bool {
        self.rank_sigmas() > CHANCE_SIGMAS
    }

    /// How many standard errors the sum of the ranks of the clips that gain lies above what chance makes of it.
    pub fn rank_sigmas(&self) -> f64 {
        let (mut beyond, mut variance) = (0.0, 0.0);
        for gains in &self.sessions {
            let mut sorted = gains.clone();
            sorted.sort_unstable_by(|a, b| a.abs().total_cmp(&b.abs()));
            let count = sorted.len() as f64;
            let ranks = sorted.iter().enumerate().filter(|(_, gain)| **gain > 0.0).map(|(place, _)| (place + 1) as f64);
            beyond += ranks.sum::<f64>() - count * (count + 1.0) / 4.0;
            variance += count * (count + 1.0) * (2.0 * count + 1.0) / 24.0;
        }
        beyond / variance.sqrt().max(f64::MIN_POSITIVE)
    }

    /// Whether the models may be worth the same; differences count `overdispersion` times less than they say.
    pub fn may_be_none(&self, overdispersion: f64) -> bool {
        self.nats / overdispersion < SAME_WORTH_NATS.max(self.by_chance() / overdispersion)
    }

    /// How many clips more would make it twice its error, gaining as those at hand do; `None` where more would prove nothing, at
    /// most as many as there are five times over, or it is proven.
    pub fn clips_more(&self) -> Option<usize> {
        if self.nats <= 0.0 || self.nats > self.twice_its_error() {
            return None;
        }
        // The sum grows with the number of clips, its error with the root of it.
        let count = self.clips() as f64;
        let needed = count * (self.twice_its_error() / self.nats).powi(2);
        (needed <= MAX_TIMES_CLIPS * count).then(|| (needed - count).ceil().max(1.0) as usize)
    }

    /// By how much more this is worth than another on the same clips: what two hypotheses gain alike on a clip says nothing about which
    /// is right.
    pub fn beyond(&self, other: &Self) -> Self {
        let pairs = self.sessions.iter().zip(&other.sessions);
        Self::uncut(pairs.map(|(own, other)| own.iter().zip(other).map(|(a, b)| a - b).collect()).collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_clips_must_differ_by_more() {
        // Quantiles of Student's distribution at 0.977250, from tables.
        for (clips, quantile) in [(3, 4.527), (6, 2.649), (12, 2.255), (1000, 2.003)] {
            let gain = Gain { error: 1.0, ..Gain::of(vec![vec![1.0; clips]], SAME_WORTH_NATS) };
            assert!((gain.by_chance() / quantile - 1.0).abs() < 0.04, "{clips}: {}", gain.by_chance());
        }
    }

    #[test]
    fn ranks_tell_what_clips_of_unequal_weight_say_alike() {
        let most = [3.0, 9.0, 2.0, 40.0, 7.0, 55.0, 1.0, 12.0, 60.0, 4.0, 30.0, 8.0, 2.5, -3.5, -1.5, -20.0];
        let gain = Gain::of(vec![most.to_vec()], SAME_WORTH_NATS);
        assert!(gain.is_no_chance_by_ranks(), "13 of 16, and the large ones");
        let half = most.map(|gain| if gain > 10.0 { -gain } else { gain });
        assert!(!Gain::of(vec![half.to_vec()], SAME_WORTH_NATS).is_no_chance_by_ranks());
        assert!(!Gain::of(vec![vec![5.0; 4]], SAME_WORTH_NATS).is_no_chance_by_ranks(), "four are too few");
        assert!(Gain::of(vec![vec![5.0; 4]; 2], SAME_WORTH_NATS).is_no_chance_by_ranks());
    }

    #[test]
    fn what_one_session_gains_scatters_by_itself() {
        let apart = Gain::of(vec![vec![0.0; 4], vec![10.0; 4]], SAME_WORTH_NATS);
        assert_eq!((apart.nats, apart.error, apart.clips()), (40.0, 0.0, 8));
        assert!(Gain::of(vec![[[0.0; 4], [10.0; 4]].concat()], SAME_WORTH_NATS).error > 10.0);
    }
}
