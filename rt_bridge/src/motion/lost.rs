//! What became of set points that did not come in time. An FCI robot goes on with the last acceleration instead, and refuses
//! whoever goes on as if nothing had happened; what it is commanded to do by then is in its state. Pure.

use crate::safety::Trace;
use shared_mem::msg::Joints;

/// What single precision makes of an angle is off by no more [rad].
const ROUNDING: f64 = 3e-7;
/// What a robot says is off by no more from what it does, its own arithmetic included [rad].
const ECHO: f64 = 2e-6;
/// After more it has stopped by itself.
const MAX_LOST_PERIODS: u64 = 20;

/// The command in force now, where that is not as `sent`: `before` came before that, `in_force` is what its newest
/// state says, `periods` after the one that `sent` answered. `None`: it has what was sent, or nobody can tell what it has.
pub(super) fn in_force(sent: &Trace, before: &Trace, in_force: &Joints, periods: u64, period_s: f64) -> Option<Trace> {
    if !(1..=MAX_LOST_PERIODS).contains(&periods) {
        return None;
    }
    let off =
        |trace: &Trace| trace.q.iter().zip(in_force).map(|(q, in_force)| (q - in_force).abs()).fold(0.0, f64::max);
    let taken = (1..periods).fold(*sent, |trace, _| trace.onward(period_s));
    let lost = (0..periods).fold(*before, |trace, _| trace.onward(period_s));
    let likelier = if off(&taken) <= ROUNDING { taken } else { lost };
    if off(sent) <= ROUNDING {
        // All is well, or the robot waits; unless it turned round meanwhile and is on its way back through the same place.
        let apart = likelier.v.iter().zip(&sent.v).map(|(a, b)| (a - b).abs() * period_s).fold(0.0, f64::max);
        return (off(&likelier) <= ROUNDING && apart > ROUNDING).then_some(likelier);
    }
    // An arm that stands has lost nothing, however it rounds.
    (off(&likelier) <= ECHO && likelier != *sent).then_some(likelier)
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::msg::MAX_JOINTS;

    const T: f64 = 1e-3;

    fn echo(trace: &Trace) -> Joints {
        trace.q.map(|q| f64::from(q as f32))
    }

    #[test]
    fn what_the_robot_has_is_told_from_what_it_says() {
        let mut before = Trace::at_rest([2.0; MAX_JOINTS]);
        (before.v, before.a) = ([0.5; MAX_JOINTS], [3.0; MAX_JOINTS]);
        // A plan that accelerates less and less.
        let sent = before.after(&std::array::from_fn(|i| before.q[i] + 0.5e-3 - 4e-6 * (i as f64 + 1.0)), T);
        assert_eq!(in_force(&sent, &before, &echo(&sent), 1, T), None, "all is well");
        let lost = before.onward(T);
        assert_eq!(in_force(&sent, &before, &echo(&lost), 1, T), Some(lost), "it did not come in time");
        let late = sent.onward(T).onward(T);
        assert_eq!(in_force(&sent, &before, &echo(&late), 3, T), Some(late), "two states went by without an answer");
        assert_eq!(in_force(&sent, &before, &echo(&sent), 3, T), None, "a robot that waits");
        assert_eq!(in_force(&sent, &before, &[0.0; MAX_JOINTS], 1, T), None, "a robot that says nothing");
        assert_eq!(in_force(&sent, &before, &echo(&sent), 40, T), None);
    }

    #[test]
    fn a_robot_that_turned_round_in_the_place_where_it_was_sent_is_not_where_it_should_be() {
        // Ten periods on, constant deceleration brings it back to where it was after the first.
        let mut before = Trace::at_rest([1.0; MAX_JOINTS]);
        (before.v, before.a) = ([0.012; MAX_JOINTS], [-2.0; MAX_JOINTS]);
        let sent = before.onward(T);
        let back = (0..10).fold(before, |trace, _| trace.onward(T));
        assert!((sent.q[0] - back.q[0]).abs() < ROUNDING && sent.v[0] > 0.0 && back.v[0] < 0.0, "{sent:?} {back:?}");
        let found = in_force(&sent, &before, &echo(&back), 10, T).expect("it went on");
        assert!((found.v[0] - back.v[0]).abs() < 1e-9);
    }

    #[test]
    fn an_arm_that_holds_loses_nothing() {
        let still = Trace::at_rest([1.0; MAX_JOINTS]);
        assert_eq!(in_force(&still, &still, &echo(&still), 5, T), None);
        let rounded = still.q.map(|q| q + 1e-6);
        assert_eq!(in_force(&still, &still, &rounded, 1, T), None, "its own arithmetic");
    }
}
