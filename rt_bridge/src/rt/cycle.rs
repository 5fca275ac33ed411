//! One turn of the control loop: read, check, command, hand to the pump.
//!
//! | word | meaning |
//! |---|---|
//! | cycle | one state received, and one command that answers it |
//! | beat | what a cycle leaves for the pump: the state and the command |
//! | commanding | the arm follows us; a fault ends it, states go on being read; a reflex may be recovered from |

use super::law::TorquePd;
use super::orders::Orders;
use super::stats::{ArrivalLine, LoopStats};
use crate::arm::{Arm, ArmFault, Clock, Desired, Read};
use crate::motion::Player;
use crate::remark::{BrakeReason, Remark};
use crate::rt::deadline::Wake;
use crate::safety::{Limits, TorqueGuard, Watchdog, watchdog::LONGEST_SILENCE_NS};
use rtrb::Producer;
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState, CommandInterface};
use shared_mem::msg::motion::{MotionKind, SetPoint};
use shared_mem::msg::{Joints, MAX_JOINTS};
use shared_mem::time::TICK_NS;
use shared_mem::time::now_ns;
use shared_mem::topics;
use std::thread::Thread;
use twin::arm::JointState;

/// Targets that are taken in each cycle: one of every sender. More of them wait, so that no flood of them takes a cycle's time.
const TARGETS_A_CYCLE: usize = topics::ARM_TARGET.limits.publishers;

/// What a cycle leaves for the pump.
#[derive(Debug, Clone, Copy)]
pub struct Beat {
    /// State of the cycle.
    pub state: ArmState,
    /// The command that answered it; none when the arm is not commanded.
    pub command: Option<ArmCommand>,
}

/// The control thread's ends of the rings to the pump.
#[derive(Debug)]
pub struct Link {
    /// Beats to publish.
    pub beats: Producer<Beat>,
    /// Things to tell.
    pub remarks: Producer<Remark>,
    /// Motions to play, and stops.
    pub orders: Orders,
    /// Woken after each beat.
    pub pump: Thread,
}

/// Whether the loop goes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    Continue,
    /// Nothing more will come from the arm: it was lost, or a recording is played through.
    End,
}

/// What the loop needs to know about the cell.
#[derive(Debug)]
pub struct Plan {
    /// What the arm is to follow.
    pub interface: CommandInterface,
    /// The law of [`CommandInterface::Torque`]; not used otherwise.
    pub law: Option<TorquePd>,
    pub limits: Limits,
    /// Drawn at the start of the bridge.
    pub session: u64,
}

/// The loop's memory from cycle to cycle.
pub struct Cycle {
    arm: Box<dyn Arm>,
    plan: Plan,
    player: Player,
    link: Link,
    desired: Desired,
    commanding: bool,
    /// Somebody asked to recover from a reflex.
    to_recover: bool,
    torque: TorqueGuard,
    watchdog: Watchdog,
    arrival: ArrivalLine,
    state: ArmState,
    last_begin_ns: u64,
    last_device_ns: u64,
    /// The arm's clock in the state that was answered last.
    answered_ns: u64,
    stats: LoopStats,
}

impl Cycle {
    /// A loop that has not read yet. Allocates; what follows does not.
    pub fn new(arm: Box<dyn Arm>, plan: Plan, player: Player, link: Link) -> Self {
        Self {
            arm,
            plan,
            player,
            link,
            desired: Desired::Commanded,
            commanding: false,
            to_recover: false,
            torque: TorqueGuard::default(),
            watchdog: Watchdog::new(now_ns(), LONGEST_SILENCE_NS),
            arrival: ArrivalLine::default(),
            state: ArmState::default(),
            last_begin_ns: 0,
            last_device_ns: 0,
            answered_ns: 0,
            stats: LoopStats::default(),
        }
    }

    /// Who says when a cycle begins.
    pub fn clock(&self) -> Clock {
        self.arm.clock()
    }

    /// `true` when nothing moves by our command.
    pub fn is_at_rest(&self) -> bool {
        !self.commanding || self.player.is_at_rest()
    }

    /// Waits for the first state, clears a reflex that is left from before and takes command. A refusal is reported, and
    /// leaves the loop reading.
    pub fn take_command(&mut self) -> Turn {
        if let Err(fault) = self.first_state().and_then(|()| self.start()) {
            return self.fail(fault);
        }
        self.watchdog.feed(now_ns());
        match self.arm.clock() {
            // In lock-step the next state follows the answer to this one; a device's own clock has ticked on meanwhile.
            Clock::Timer { .. } => self.answer(false),
            Clock::Device => Turn::Continue,
        }
    }

    fn first_state(&mut self) -> Result<(), ArmFault> {
        self.next_state()?;
        if self.state.mode != ArmMode::Reflex {
            return Ok(());
        }
        self.arm.recover()?;
        // It stands elsewhere, maybe, and is commanded to be there: brakes have closed and opened.
        self.next_state()
    }

    fn next_state(&mut self) -> Result<(), ArmFault> {
        loop {
            match self.arm.read(&mut self.state) {
                Ok(Read::Fresh) => return Ok(()),
                // A robot that came up in a reflex or under the user stop is reported once, by `start`.
                Err(fault) if !fault.is_final() => return Ok(()),
                Err(fault) => return Err(fault),
                Ok(Read::Missing | Read::End) => {
                    if let Some(ms) = self.watchdog.expired(now_ns()) {
                        return Err(ArmFault::Silent { ms });
                    }
                    std::thread::sleep(std::time::Duration::from_millis(1));
                }
            }
        }
    }

    /// Takes command again after a reflex, where that was asked for. The arm is not commanded then: as before the first
    /// cycle, this may block and allocate.
    fn recover(&mut self) -> Option<Turn> {
        let asked = std::mem::take(&mut self.to_recover);
        if !asked || self.commanding || self.state.mode != ArmMode::Reflex {
            return None;
        }
        let turn = self.take_command();
        if self.commanding {
            self.tell(Remark::Recovered);
        }
        self.last_begin_ns = 0;
        Some(turn)
    }

    fn start(&mut self) -> Result<(), ArmFault> {
        self.desired = self.arm.start(self.plan.interface)?;
        self.commanding = self.desired != Desired::Recorded;
        // A torque law starts where the arm is, a position interface where the robot is commanded to be already.
        self.player.hold_at(match self.plan.interface {
            CommandInterface::Torque => self.state.q,
            CommandInterface::JointPosition => self.state.q_d,
        });
        if !self.commanding {
            self.player.halt();
        }
        self.torque = TorqueGuard::after(&self.state.tau_J_d, &self.plan.limits);
        Ok(())
    }

    /// One turn. `wake` is what the timer said; none with a device's clock.
    pub fn turn(&mut self, wake: Option<Wake>) -> Turn {
        if let Some(wake) = wake {
            self.stats.wake.record(wake.late_ns);
            self.stats.missed_cycles += wake.missed;
        }
        if let Some(turn) = self.recover() {
            return turn;
        }
        match self.arm.read(&mut self.state) {
            Ok(Read::Fresh) => self.answer(wake.is_none()),
            Ok(Read::Missing) => self.missing(),
            Ok(Read::End) => Turn::End,
            Err(fault) if fault.is_final() => self.fail(fault),
            Err(fault) => {
                self.fail(fault);
                self.answer(wake.is_none())
            }
        }
    }

    /// Brakes whatever is played, because the run is to end.
    pub fn begin_stop(&mut self) {
        if let Some(remark) = self.player.stop(BrakeReason::RunEnds) {
            self.tell(remark);
        }
    }

    /// Lets the arm go and returns what was measured.
    pub fn finish(mut self) -> LoopStats {
        if self.commanding {
            self.arm.stop();
        }
        self.stats
    }

    fn answer(&mut self, device_clocked: bool) -> Turn {
        let begin_ns = now_ns();
        self.watchdog.feed(begin_ns);
        self.count(begin_ns, device_clocked);
        if let Some(joint) = self.not_finite()
            && self.commanding
        {
            self.fail(ArmFault::BadState { joint });
        }
        self.take_orders();
        self.reconcile();
        if self.commanding {
            self.player.see(&JointState { q: self.state.q, dq: self.state.dq });
        }
        let (point, remark) = self.player.advance();
        if let Some(remark) = remark {
            self.tell(remark);
        }
        let command = match self.desired {
            Desired::Recorded => Some(self.recorded_command()),
            _ if self.commanding => self.send(&point),
            _ => None,
        };
        if self.desired == Desired::Commanded && self.commanding {
            (self.state.q_d, self.state.dq_d) = (point.q_d, point.dq_d);
        }
        self.player.report(&mut self.state);
        if self.link.beats.push(Beat { state: self.state, command }).is_err() {
            self.stats.dropped += 1;
        }
        self.link.pump.unpark();
        let exec_ns = now_ns().saturating_sub(begin_ns);
        self.stats.exec.record(exec_ns);
        self.stats.overruns += u64::from(exec_ns > TICK_NS);
        Turn::Continue
    }

    fn count(&mut self, begin_ns: u64, device_clocked: bool) {
        self.stats.cycles += 1;
        self.state.cycle = self.stats.cycles;
        self.state.session = self.plan.session;
        self.state.dof = u32::try_from(self.arm.dof()).unwrap_or(0);
        if self.last_begin_ns != 0 {
            self.stats.period.record(begin_ns.saturating_sub(self.last_begin_ns));
            let steps = self.state.device_ns.saturating_sub(self.last_device_ns) / TICK_NS;
            if device_clocked && self.desired != Desired::Recorded {
                self.stats.lost_packets += steps.saturating_sub(1);
            }
        }
        (self.last_begin_ns, self.last_device_ns) = (begin_ns, self.state.device_ns);
        if device_clocked {
            self.stats.wake.record(self.arrival.late_ns(self.state.stamp_ns, self.state.device_ns));
        }
    }

    /// Goes on from what the arm has, where it did not get everything that was sent.
    fn reconcile(&mut self) {
        if !self.commanding || self.arm.clock() != Clock::Device {
            return;
        }
        match self.plan.interface {
            CommandInterface::Torque => self.torque.resume(&self.state.tau_J_d),
            CommandInterface::JointPosition if !self.arm.extrapolates() => {}
            CommandInterface::JointPosition => {
                self.player.reconcile(&self.state.q_d, self.state.device_ns.saturating_sub(self.answered_ns) / TICK_NS);
            }
        }
    }

    /// Takes in what was sent: a stop at once, whatever waits before it; of the rest a target of
    /// every sender and a chunk a cycle, where there is room.
    fn take_orders(&mut self) {
        if self.link.orders.is_stopped() {
            self.to_recover = false;
            self.player.stop(BrakeReason::Asked).into_iter().for_each(|remark| self.tell(remark));
            while let Some(chunk) = self.link.orders.overtaken() {
                self.player.discard(&chunk).into_iter().for_each(|remark| self.tell(remark));
            }
        }
        for _ in 0..TARGETS_A_CYCLE {
            let Some(target) = self.link.orders.target() else { break };
            self.player.aim(&target).into_iter().for_each(|remark| self.tell(remark));
        }
        if self.player.has_room()
            && let Some(chunk) = self.link.orders.take()
        {
            self.to_recover = chunk.kind == MotionKind::Recover;
            let remark = if self.to_recover { None } else { self.player.take(&chunk) };
            remark.into_iter().for_each(|remark| self.tell(remark));
        }
    }

    fn send(&mut self, point: &SetPoint) -> Option<ArmCommand> {
        let mut command = ArmCommand {
            answers_device_ns: self.state.device_ns,
            cycle: self.state.cycle,
            dof: self.state.dof,
            interface: self.plan.interface,
            q_d: point.q_d,
            dq_d: point.dq_d,
            ..ArmCommand::default()
        };
        if let (CommandInterface::Torque, Some(law)) = (self.plan.interface, &self.plan.law) {
            let wanted = law.torque(&JointState { q: self.state.q, dq: self.state.dq }, point);
            let clamped = self.torque.clamp(&wanted, &self.plan.limits, TICK_NS as f64 * 1e-9);
            command.tau_J_d = clamped.tau;
            self.stats.clamped += u64::from(clamped.held_back);
        }
        command.stamp_ns = now_ns();
        self.answered_ns = self.state.device_ns;
        match self.arm.command(&command) {
            Ok(()) => Some(command),
            Err(fault) => {
                self.fail(fault);
                None
            }
        }
    }

    /// The command of a recording is what its state says was desired.
    fn recorded_command(&self) -> ArmCommand {
        ArmCommand {
            stamp_ns: self.state.stamp_ns,
            answers_device_ns: self.state.device_ns,
            cycle: self.state.cycle,
            dof: self.state.dof,
            interface: CommandInterface::JointPosition,
            q_d: self.state.q_d,
            dq_d: self.state.dq_d,
            tau_J_d: self.state.tau_J_d,
        }
    }

    fn missing(&mut self) -> Turn {
        self.stats.lost_packets += 1;
        match self.watchdog.expired(now_ns()) {
            Some(ms) => self.fail(ArmFault::Silent { ms }),
            None => Turn::Continue,
        }
    }

    /// Commanding ends; reading too, where nothing more will come.
    fn fail(&mut self, fault: ArmFault) -> Turn {
        self.commanding = false;
        self.tell(Remark::Fault(fault));
        if let Some(remark) = self.player.halt() {
            self.tell(remark);
        }
        if fault.is_final() {
            return Turn::End;
        }
        Turn::Continue
    }

    /// Hands something to tell to the pump.
    pub fn tell(&mut self, remark: Remark) {
        // A full ring means that the pump hangs, which the main thread notices by itself.
        let _full = self.link.remarks.push(remark);
        self.link.pump.unpark();
    }

    fn not_finite(&self) -> Option<u8> {
        let good = |values: &Joints, i: usize| values.get(i).is_some_and(|v| v.is_finite());
        let bad = (0..self.arm.dof().min(MAX_JOINTS)).find(|i| !(good(&self.state.q, *i) && good(&self.state.dq, *i)));
        bad.map(|i| u8::try_from(i + 1).unwrap_or(u8::MAX))
    }
}
