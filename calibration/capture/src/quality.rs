//! Judges a clip from the states that passed by while it was played. Units: rad, s.

use super::rate::RATE;
use serde::Serialize;
use shared_mem::msg::arm::ArmState;

/// Share of lost packets from which a clip is better repeated: lost states leave holes that a fit has to bridge by guessing.
const LOSS_BEARABLE: f64 = 0.01;
/// Share of the planned peak speed below which the arm did not do what was asked.
const SPEED_EXPECTED: f64 = 0.5;
/// So many times the planned peak speed, and so much more [rad/s], is no motion that was asked for: an overshoot stays within a
/// factor of two, a velocity's noise within the other. Both are choices.
const SPEED_BEYOND: f64 = 3.0;
const SPEED_MORE: f64 = 0.5;
/// An arm that is farther from its command while it plays a clip does not follow it [rad, or m of a joint that slides]: hobby servos under a
/// load hang by a tenth, and two of them are 20 cm at the end of a metre. A choice.
const MAX_TRACKING_ERROR: f64 = 0.2;
/// An arm that is farther from its command at rest does not hold it [rad]. A choice.
pub(super) const MAX_REST_ERROR: f64 = 0.5;
/// An arm that turns faster does not hold still [rad/s]: the noise of a velocity stays below. A choice.
pub(super) const MAX_REST_SPEED: f64 = 3.0;

/// What a person does about an arm that does not follow.
pub(super) const GAINS: &str = "look at `stiffness` and `damping` of `[controller]` in cell.toml, which have to hold this arm (a light link \
     takes little damping), and at the arm's masses and limits";

/// Watches one clip.
#[derive(Debug, Clone, Default)]
pub struct Watch {
    last_device_ns: Option<u64>,
    quality: Quality,
}

/// What was seen.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Quality {
    pub states: u64,
    /// States missing in the robot's own counter.
    pub lost_packets: u64,
    /// Largest measured joint speed [rad/s]; `None` without states.
    pub peak_speed: Option<f64>,
    /// Largest distance between desired and measured joint position [rad]; `None` without states.
    pub tracking_error: Option<f64>,
}

/// Whether a clip is worth keeping.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    Keep,
    /// It is not, and why.
    Repeat(String),
}

impl Watch {
    /// Takes note of a state.
    pub fn see(&mut self, state: &ArmState) {
        let seen = &mut self.quality;
        seen.states += 1;
        if let Some(last) = self.last_device_ns {
            let cycles = (state.device_ns.saturating_sub(last) as f64 * 1e-9 * RATE).round();
            seen.lost_packets += (cycles as u64).saturating_sub(1);
        }
        self.last_device_ns = Some(state.device_ns);
        let dof = (state.dof as usize).min(state.q.len());
        for joint in 0..dof {
            let finite = |value: f64| if value.is_nan() { f64::INFINITY } else { value.abs() };
            let (speed, error) = (finite(state.dq[joint]), finite(state.q_d[joint] - state.q[joint]));
            seen.peak_speed = Some(seen.peak_speed.map_or(speed, |peak| peak.max(speed)));
            seen.tracking_error = Some(seen.tracking_error.map_or(error, |worst| worst.max(error)));
        }
    }

    /// What was seen so far.
    pub fn quality(&self) -> Quality {
        self.quality
    }
}

impl Quality {
    /// The verdict, given the peak speed that was planned [rad/s].
    pub fn verdict(&self, planned_speed: f64) -> Verdict {
        let expected = self.states + self.lost_packets;
        let lost = self.lost_packets as f64 / expected.max(1) as f64;
        if lost > LOSS_BEARABLE {
            return Verdict::Repeat(format!("{:.1} % of the packets are lost", 100.0 * lost));
        }
        let Some(seen) = self.peak_speed else {
            return Verdict::Repeat("no state of the arm came while it was played".to_owned());
        };
        if seen < SPEED_EXPECTED * planned_speed {
            return Verdict::Repeat(format!("the arm reached {seen:.2} rad/s of {planned_speed:.2} planned"));
        }
        if seen > SPEED_BEYOND * planned_speed + SPEED_MORE {
            return Verdict::Repeat(format!(
                "the arm reached {seen:.2} rad/s where {planned_speed:.2} were planned: it does not do as it is commanded; {GAINS}"
            ));
        }
        if let Some(error) = self.tracking_error.filter(|error| *error > MAX_TRACKING_ERROR) {
            return Verdict::Repeat(format!(
                "the arm was {error:.2} rad away from its command, more than {MAX_TRACKING_ERROR} rad: it does not follow; {GAINS}"
            ));
        }
        Verdict::Keep
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn states(device_ms: impl IntoIterator<Item = u64>) -> Quality {
        let mut watch = Watch::default();
        for ms in device_ms {
            let mut state = ArmState { device_ns: ms * 1_000_000, dof: 7, ..ArmState::default() };
            state.dq[2] = -0.8;
            state.q_d[4] = 0.02;
            watch.see(&state);
        }
        watch.quality()
    }

    #[test]
    fn a_complete_clip_is_kept() {
        let quality = states(0..2000);
        let expected = Quality { states: 2000, lost_packets: 0, peak_speed: Some(0.8), tracking_error: Some(0.02) };
        assert_eq!(quality, expected);
        assert_eq!(quality.verdict(0.9), Verdict::Keep);
    }

    #[test]
    fn gaps_in_the_robots_counter_are_lost_packets() {
        let quality = states((0..2000).filter(|ms| ms % 50 != 7));
        assert_eq!(quality.lost_packets, 40);
        assert!(matches!(quality.verdict(0.9), Verdict::Repeat(why) if why.contains("2.0 %")));
    }

    #[test]
    fn what_was_not_seen_is_null_and_no_zero() {
        let json = serde_json::to_value(states([])).expect("JSON");
        assert!(json["peak_speed"].is_null() && json["tracking_error"].is_null(), "{json}");
        assert!(matches!(states([]).verdict(0.0), Verdict::Repeat(_)));
    }

    #[test]
    fn an_arm_that_does_not_follow_or_is_far_faster_than_planned_is_never_kept() {
        let seen = |dq: f64, off: f64| {
            let mut watch = Watch::default();
            for ms in 0..100 {
                let mut state = ArmState { device_ns: ms * 1_000_000, dof: 4, ..ArmState::default() };
                (state.dq[3], state.q_d[1]) = (dq, off);
                watch.see(&state);
            }
            watch.quality().verdict(1.2)
        };
        assert_eq!(seen(1.5, 0.1), Verdict::Keep);
        for (dq, off, word) in [
            (11_764.76, 0.1, "does not do as it is commanded"),
            (f64::NAN, 0.1, "does not do as it is commanded"),
            (1.2, 2.0, "does not follow"),
            (1.2, 0.25, "more than 0.2 rad"),
            (1.2, f64::NAN, "does not follow"),
        ] {
            assert!(matches!(seen(dq, off), Verdict::Repeat(why) if why.contains(word)), "{dq} {off}");
        }
    }

    #[test]
    fn an_arm_that_hardly_moved_is_to_be_repeated() {
        assert!(matches!(states(0..100).verdict(2.0), Verdict::Repeat(_)));
    }
}
