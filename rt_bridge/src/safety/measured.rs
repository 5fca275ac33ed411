//! The arm that is there, beside the one that is asked for. A law that feeds no acceleration forward lets the arm trail its
//! commands while they speed up and run ahead of them while they are braked, by tens of milliradians at a hard stop: so the
//! stop of the measured arm is looked along too, as it follows from the law, the mass matrix and where the arm is now.
//!
//! Where it hangs lower at rest than it is commanded to (a load that nobody declared, friction), it is taken to do so all the way.
//! Where no law is known, the gap between command and arm is taken to stay as it is now.

use super::workspace::is_inside;
use super::{Limits, Outside, Stopping, Trace, Trailing, Workspace};
use shared_mem::msg::{Joints, MAX_JOINTS};
use twin::arm::JointState;

/// Length of the steps in which the arm is followed on its way [s]. Between two of them the lowest point of a swing lies less
/// than a quarter of a millimetre deeper than at them.
const STEP: f64 = 0.01;
/// Share of a way down that is still to come by which the arm may get lower than commanded: what law and model do not say
/// (torque that has come to its limit, periods, the steps here).
const MARGIN: f64 = 0.02;
/// How long the arm is followed after its commands have come to rest [s]: what slow joints still creep is less than a millimetre.
const SETTLING: f64 = 0.3;
/// An arm that was commanded to rest for so long rests [s].
const RESTS: f64 = 0.5;

/// What was measured of an arm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    state: JointState,
    /// Where it is commanded to be [rad].
    commanded: Joints,
    /// How long it has been commanded to rest [s].
    rested: f64,
    /// How far it is behind its command where it rests, where that is lower [rad].
    hangs: Joints,
    /// How far outside the workspace it was when it last rested.
    outside: Outside,
}

impl Measured {
    /// An arm in this state, commanded to rest at `q_d`.
    pub fn at_rest(state: &JointState, q_d: &Joints, workspace: &Workspace) -> Self {
        let outside = workspace.outside_measured(&state.q);
        let mut arm = Self { state: *state, commanded: *q_d, rested: 0.0, hangs: [0.0; MAX_JOINTS], outside };
        arm.rest(workspace);
        arm
    }

    /// Takes in a newer state of the arm, whose last command was `commands`, a period of `period_s` after the one before.
    pub fn see(&mut self, state: &JointState, commands: &Trace, workspace: &Workspace, limits: &Limits, period_s: f64) {
        (self.state, self.commanded) = (*state, commands.q);
        self.rested = if commands.is_at_rest(limits.dof, period_s) { self.rested + period_s } else { 0.0 };
        if self.rested >= RESTS {
            self.rest(workspace);
            self.outside = workspace.outside_after(&state.q, &self.outside);
        }
    }

    fn rest(&mut self, workspace: &Workspace) {
        let is_lower = workspace.room(&self.state.q) < workspace.room(&self.commanded);
        self.hangs = if is_lower { self.gap() } else { [0.0; MAX_JOINTS] };
    }

    fn gap(&self) -> Joints {
        std::array::from_fn(|i| self.commanded[i] - self.state.q[i])
    }

    /// Whether the arm stays in the workspace on its whole way to rest when it follows commands that are braked from `next` on.
    pub fn keeps(
        &self,
        next: &Trace,
        trailing: &Trailing,
        workspace: &Workspace,
        limits: &Limits,
        period_s: f64,
    ) -> bool {
        if !workspace.is_somewhere() {
            return true;
        }
        let way = Stopping::of(next, limits, period_s);
        let last = ((way.duration() + SETTLING) / STEP).ceil() as u32;
        let commanded = |step: u32| {
            let moment = way.at(f64::from(step) * STEP);
            let q = std::array::from_fn(|i| moment.q[i] - self.hangs[i]);
            (JointState { q, dq: moment.dq }, moment)
        };
        let (mut step, (mut command, mut moment)) = (0, commanded(0));
        let mut trail = trailing.from(&self.state, &command);
        let at_first = workspace.left(&self.state.q, &self.outside);
        loop {
            let from = trail.state.q;
            let left_there = workspace.left(&from, &self.outside);
            let left = [0, 1].map(|of| left_there[of] - MARGIN * (at_first[of] - left_there[of]).max(0.0));
            if !is_inside(left) {
                return false;
            }
            let swing = trailing.swing(&trail, &command, &moment.change);
            let ahead =
                std::array::from_fn(|i| (1.0 + MARGIN) * (moment.left[i] + (command.q[i] - from[i]).abs() + swing[i]));
            if workspace.is_too_little(&ahead, left) {
                return true;
            }
            // Positions need no look before the joints have moved by as much as takes the arm to a bound.
            loop {
                if step == last {
                    return true;
                }
                step += 1;
                (command, moment) = commanded(step);
                trailing.step(&mut trail, &command, STEP);
                let moved = std::array::from_fn(|i| (1.0 + MARGIN) * (trail.state.q[i] - from[i]).abs());
                if !workspace.is_too_little(&moved, left) {
                    break;
                }
            }
        }
    }

    /// The same of an arm that stays as far from its commands as it is now.
    pub fn keeps_its_gap(&self, next: &Trace, workspace: &Workspace, limits: &Limits, period_s: f64) -> bool {
        let gap = self.gap();
        let shifted = Trace { q: std::array::from_fn(|i| next.q[i] - gap[i]), ..*next };
        workspace.keeps(&shifted, limits, period_s, &self.outside)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use shared_mem::cell::{Cell, Table};
    use twin::arm::{ArmModel, ControlLaw};

    const T: f64 = 1e-3;
    /// The tool looks down beside the base, lower than any link.
    const LOW: Joints = [0.0, 0.3, 0.0, -2.0, 0.0, 2.3, 0.785, 0.0];

    struct Lab {
        cell: Cell,
        model: ArmModel,
        law: ControlLaw,
        trailing: Trailing,
        limits: Limits,
    }

    fn lab() -> Lab {
        let text = include_str!("../../../config/fr3_cell.toml");
        let cell = Cell::parse(text, "cell.toml".as_ref()).expect("the shipped cell");
        let model = ArmModel::from_cell(&cell).expect("an FR3");
        let law = ControlLaw::new(cell.controller.as_ref(), None, &model).expect("gains");
        let trailing = Trailing::new(&model, &law).expect("springs");
        Lab { cell, model, law, trailing, limits: Limits::fr3() }
    }

    impl Lab {
        /// The space above a table of this height.
        fn above(&self, height: f64) -> Workspace {
            Workspace::of(&Cell { table: Some(Table { height }), ..self.cell.clone() }, &self.model)
        }

        /// Least room that the arm itself has on its way to rest from `trace` on, by its equations of motion.
        fn least_room(&self, space: &Workspace, state: &JointState, trace: &Trace) -> f64 {
            let way = Stopping::of(trace, &self.limits, T);
            let (mut arm, mut least) = (*state, space.room(&state.q));
            for k in 0..((way.duration() + SETTLING) / T) as u32 {
                let moment = way.at(f64::from(k) * T);
                let torque = self.law.torque(&self.model, &arm, &moment.q, &moment.dq);
                self.model.step(&mut arm, &torque, T);
                least = least.min(space.room(&arm.q));
            }
            least
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(96))]

        /// Where the arm gets, and hardly more cautious than that.
        #[test]
        fn a_stop_is_kept_when_the_arm_itself_stays_inside(
            q in prop::array::uniform7(-0.7..0.7_f64),
            v in prop::array::uniform7(-1.3..1.3_f64),
            a in prop::array::uniform7(-8.0..8.0_f64),
            ahead in prop::array::uniform7(-0.01..0.01_f64),
            gap in -0.03..0.03_f64,
        ) {
            let (lab, mut trace) = (lab(), Trace::at_rest(LOW));
            let mut state = JointState::at_rest(LOW);
            for i in 0..7 {
                trace.q[i] += q[i];
                (trace.v[i], trace.a[i]) = (v[i], a[i]);
                (state.q[i], state.dq[i]) = (trace.q[i] + ahead[i], v[i]);
            }
            let level = lab.above(0.0);
            // The table lies so that this much is left, or is missing, where the arm is lowest.
            let least = lab.least_room(&level, &state, &trace);
            let space = lab.above(least - gap);
            let is_at_table = (lab.least_room(&space, &state, &trace) - gap).abs() < 1e-9;
            let arm = Measured { outside: space.outside_measured(&LOW), ..Measured::at_rest(&state, &trace.q, &space) };
            let kept = Measured { hangs: [0.0; MAX_JOINTS], ..arm }.keeps(&trace, &lab.trailing, &space, &lab.limits, T);
            if is_at_table && space.room(&LOW) >= 0.0 {
                let margin = MARGIN * (space.room(&state.q) - gap);
                prop_assert!(kept || gap < 1e-3 + margin, "{gap} m of room are not seen");
                prop_assert!(!kept || gap > -1.5e-3, "{gap} m of room were not missed");
            }
        }
    }

    #[test]
    fn an_arm_that_runs_ahead_of_its_commands_is_braked_sooner_than_they_would_have_to_be() {
        let lab = lab();
        let level = lab.above(0.0);
        let mut trace = Trace::at_rest(LOW);
        // Down, by shoulder and elbow.
        (trace.v[1], trace.v[3]) = (1.0, 0.3);
        let state = JointState { q: trace.q, dq: trace.v };
        let way = Stopping::of(&trace, &lab.limits, T);
        let commanded = level.room(&way.at(way.duration()).q);
        let lower = commanded - lab.least_room(&level, &state, &trace);
        assert!(lower > 5e-3, "the arm comes {lower} m lower than its commands");
        let space = lab.above(commanded - 0.5 * lower);
        let arm = Measured::at_rest(&state, &trace.q, &space);
        assert!(space.keeps(&trace, &lab.limits, T, &space.outside(&LOW)));
        assert!(!arm.keeps(&trace, &lab.trailing, &space, &lab.limits, T));
        let upwards = Trace { v: trace.v.map(|v| -v), ..trace };
        assert!(arm.keeps(&upwards, &lab.trailing, &space, &lab.limits, T));
    }

    #[test]
    fn an_arm_that_hangs_below_its_commands_is_taken_to_stay_there_and_may_rise() {
        let lab = lab();
        let space = lab.above(lab.above(0.0).room(&LOW) - 0.01);
        let commanded = |by: f64| {
            let mut q = LOW;
            q[1] += by;
            Trace::at_rest(q)
        };
        // A hundredth of a radian more of the shoulder: the tool is some 5 mm lower.
        let state = JointState::at_rest(commanded(0.01).q);
        let hangs = space.room(&LOW) - space.room(&state.q);
        assert!(hangs > 3e-3, "{hangs}");
        let lowest = |keeps: &dyn Fn(&Trace) -> bool| {
            let deepest =
                (0..400).map(|k| commanded(f64::from(k) * 1e-4)).take_while(keeps).last().expect("it may stay");
            space.room(&deepest.q)
        };
        let arm = Measured::at_rest(&state, &LOW, &space);
        let by_law = lowest(&|trace| arm.keeps(trace, &lab.trailing, &space, &lab.limits, T));
        let by_gap = lowest(&|trace| arm.keeps_its_gap(trace, &space, &lab.limits, T));
        for room in [by_law, by_gap] {
            assert!((room - hangs).abs() < 1e-3, "commanded down to {room} m, hangs {hangs} m lower");
        }
        // Outside already, by what a higher table takes.
        let space = lab.above(lab.above(0.0).room(&state.q) + 0.004);
        let arm = Measured::at_rest(&state, &LOW, &space);
        assert!(arm.keeps(&commanded(-0.02), &lab.trailing, &space, &lab.limits, T), "it may rise");
        assert!(arm.keeps_its_gap(&commanded(-0.02), &space, &lab.limits, T), "it may rise");
        assert!(!arm.keeps(&commanded(0.01), &lab.trailing, &space, &lab.limits, T), "and not sink");
        assert!(!arm.keeps_its_gap(&commanded(0.01), &space, &lab.limits, T), "and not sink");
    }

    #[test]
    fn what_is_no_number_is_outside() {
        let lab = lab();
        let space = lab.above(-1.0);
        let trace = Trace::at_rest(LOW);
        let arm = Measured::at_rest(&JointState::at_rest([f64::NAN; MAX_JOINTS]), &LOW, &space);
        assert!(!arm.keeps(&trace, &lab.trailing, &space, &lab.limits, T));
        assert!(!arm.keeps_its_gap(&trace, &space, &lab.limits, T));
    }
}
