//! A stop lasts: after it nothing begins before nobody has sent for half a second, whoever sent, whatever ids were chosen, and
//! whether anything moved.
#![allow(missing_docs)]

mod running;

use proptest::prelude::*;
use rt_bridge::motion::{Player, Target};
use rt_bridge::remark::{Refusal, Remark};
use rt_bridge::safety::{Guard, Limits, Workspace};
use running::{CELL, LONG, bridge, end, said, target, wait_for};
use shared_mem::cell::{Cell, Robot};
use shared_mem::msg::motion::{CHUNK_LENGTH, MotionChunk, MotionKind, SetPoint};
use shared_mem::msg::target::ArmTarget;
use shared_mem::msg::{Joints, MAX_JOINTS};
use shared_mem::time::now_ns;
use shared_mem::topics::{ARM_MOTION, ARM_STATE, ARM_TARGET};
use shared_mem::transport::Node;
use std::time::{Duration, Instant};
use twin::arm::ArmModel;

const READY: Joints = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785, 0.0];
/// Periods without a sender after which motions may begin again.
const SILENCE: usize = 500;

fn player() -> Player {
    let robot = Robot { model: Some("fr3".into()), ..Robot::default() };
    let cell = Cell { robot: Some(robot), ..Cell::default() };
    let workspace = Workspace::of(&cell, &ArmModel::from_cell(&cell).expect("an FR3"));
    Player::new(Guard { limits: Limits::fr3(), workspace, trailing: None, period_s: 1e-3 }, READY)
}

fn elsewhere(stream: u64) -> Joints {
    let mut q = READY;
    // Some one way, some the other.
    q[0] = if stream.is_multiple_of(2) { 0.6 } else { -0.6 };
    q
}

fn stop() -> MotionChunk {
    MotionChunk { kind: MotionKind::Stop, ..MotionChunk::default() }
}

/// The first chunk of a motion that begins where the arm holds.
fn chunk(motion_id: u64, q_d: Joints) -> MotionChunk {
    let set_points = [SetPoint { q_d, dq_d: [0.0; MAX_JOINTS] }; CHUNK_LENGTH];
    let length = u32::try_from(CHUNK_LENGTH).expect("a small number");
    MotionChunk { motion_id, length, dof: 7, set_points, ..MotionChunk::default() }
}

/// What somebody does, or nobody for so many periods.
#[derive(Debug, Clone)]
enum Event {
    /// A target of one of a few streams.
    Target(u64),
    /// A target of a stream that was never heard before.
    NewStream,
    /// A pose that did not become joints.
    Unseen(u64),
    Motion(u64),
    Stop,
    Wait(usize),
}

fn event() -> impl Strategy<Value = Event> {
    prop_oneof![
        6 => (1_u64..4).prop_map(Event::Target),
        2 => Just(Event::NewStream),
        1 => (1_u64..4).prop_map(Event::Unseen),
        1 => (10_u64..13).prop_map(Event::Motion),
        2 => Just(Event::Stop),
        6 => (1_usize..60).prop_map(Event::Wait),
        1 => (400_usize..600).prop_map(Event::Wait),
    ]
}

/// A player beside what is known of its senders: from a stop on nothing may begin until they were silent for long enough.
struct Watched {
    player: Player,
    q: Joints,
    /// Periods since the stop or what was sent last after it; none while no stop counts.
    silent_for: Option<usize>,
    /// Where the arm rested first after the stop.
    rests: Option<Joints>,
    began: usize,
    next_id: u64,
}

impl Watched {
    fn new() -> Self {
        Self { player: player(), q: READY, silent_for: None, rests: None, began: 0, next_id: 1000 }
    }

    fn hear(&mut self, said: Option<Remark>) {
        let began = matches!(said, Some(Remark::Began { .. }));
        self.began += usize::from(began);
        assert!(!(began && self.silent_for.is_some()), "{said:?} {:?} periods after a stop", self.silent_for);
        self.silent_for = self.silent_for.map(|_| 0);
    }

    fn aim(&mut self, stream: u64, q: Option<Joints>) {
        let said = self.player.aim(&Target { stream, q, speed: 1.0 });
        self.hear(said);
    }

    fn take(&mut self, event: &Event) {
        match *event {
            Event::Target(stream) => self.aim(stream, Some(elsewhere(stream))),
            Event::NewStream => {
                self.next_id += 1;
                self.aim(self.next_id, Some(elsewhere(self.next_id)));
            }
            Event::Unseen(stream) => self.aim(stream, None),
            Event::Motion(motion) => {
                let said = self.player.take(&chunk(motion, self.q));
                self.hear(said);
            }
            Event::Stop => {
                self.player.take(&stop());
                (self.silent_for, self.rests) = (Some(0), None);
            }
            Event::Wait(periods) => (0..periods).for_each(|_| self.go_on()),
        }
    }

    /// A period on. While a stop counts, an arm that has come to rest stays where it is.
    fn go_on(&mut self) {
        self.q = self.player.advance().0.q_d;
        if let Some(silent_for) = &mut self.silent_for {
            *silent_for += 1;
            match self.rests {
                Some(rests) => assert_eq!(self.q, rests, "it moves {silent_for} periods after a stop"),
                None => self.rests = self.player.is_at_rest().then_some(self.q),
            }
        }
        if self.silent_for == Some(SILENCE) {
            (self.silent_for, self.rests) = (None, None);
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn nothing_begins_after_a_stop_before_all_senders_were_silent(events in prop::collection::vec(event(), 1..120)) {
        let mut watched = Watched::new();
        for event in &events {
            watched.take(event);
        }
        // And it is no lock: after the silence somebody who asks is heard.
        watched.take(&Event::Stop);
        watched.take(&Event::Wait(2 * SILENCE));
        let before = watched.began;
        watched.take(&Event::NewStream);
        prop_assert_eq!(watched.began, before + 1);
    }
}

#[test]
fn a_sender_that_takes_a_new_id_with_every_target_does_not_get_around_a_stop_and_each_is_said_once() {
    let mut watched = Watched::new();
    for id in 1..40 {
        watched.take(&Event::Target(id));
        watched.take(&Event::Wait(20));
        if id == 5 {
            watched.take(&Event::Stop);
        }
    }
    assert_eq!(watched.began, 1);
    let mut said = |stream| watched.player.aim(&Target { stream, q: Some(READY), speed: 1.0 });
    let refused = |stream| Some(Remark::Refused { motion: stream, why: Refusal::Stopped });
    assert_eq!([said(70), said(71), said(70), said(71)], [refused(70), refused(71), None, None]);
}

/// Two programs contend for the arm and somebody stops it: neither has it afterwards.
#[test]
fn a_stop_between_two_senders_gives_the_arm_to_neither_and_who_asks_anew_is_told_what_to_do() {
    let bridge = bridge("stops", &[]);
    let node = Node::open_in(&format!("stops{}", std::process::id()), "a test").expect("shared memory");
    let states = node.subscriber(ARM_STATE).expect("a place");
    let [first, second] = [(); 2].map(|()| node.publisher(ARM_TARGET).expect("a place"));
    let stops = node.publisher(ARM_MOTION).expect("a place");
    let here = wait_for(&states, |state| state.cycle > 10);
    let send = |stop_when: &dyn Fn(&shared_mem::msg::arm::ArmState) -> bool| {
        let begin = Instant::now();
        while begin.elapsed() < LONG {
            for (stream, sender, way) in [(5, &first, 0.8), (6, &second, -0.8)] {
                let mut far = ArmTarget { stamp_ns: now_ns(), stream, dof: 7, q: here.q_d, ..ArmTarget::default() };
                far.q[0] += way;
                sender.send(&far).expect("shared memory");
            }
            std::thread::sleep(Duration::from_millis(10));
            if let Some(state) = states.newest().expect("shared memory")
                && stop_when(&state)
            {
                return state;
            }
        }
        panic!("not within half a minute");
    };
    let moving = send(&|state| state.dq_d[0].abs() > 0.2);
    assert!([5, 6].contains(&moving.motion_id));
    stops.send(&stop()).expect("shared memory");
    let rests = send(&|state| state.cycle > moving.cycle && state.dq_d == [0.0; MAX_JOINTS]);
    let later = send(&|state| state.cycle > rests.cycle + 2000);
    assert_eq!((later.q_d, later.motion_id), (rests.q_d, moving.motion_id), "neither moves it");
    let asked = std::thread::scope(|scope| {
        let command = scope.spawn(|| target("stops", &["joints", "0,-0.6,0,-2.2,0,1.6,0.785"]));
        send(&|_| command.is_finished());
        command.join().expect("it ran")
    });
    assert_eq!(asked.status.code(), Some(1));
    assert!(said(&asked).contains("nobody has sent targets or motions for 0.5 s"), "{}", said(&asked));
    let held = wait_for(&states, |_| true);
    assert_eq!(held.q_d, rests.q_d);
    // Both have ended.
    wait_for(&states, |state| state.cycle > held.cycle + 600);
    let anew = target("stops", &["shift", "0,0,0.02", "--cell", CELL]);
    assert!(anew.status.success(), "{}", said(&anew));
    let output = end(bridge);
    assert!(said(&output).contains("refused: the arm was stopped"), "{}", said(&output));
}
