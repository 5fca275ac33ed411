//! Whatever bits lie in shared memory, on whatever topic: what is received is a message, the rest is ignored and counted.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use shared_mem::msg::Message;
use shared_mem::msg::arm::{ArmCommand, ArmMode, ArmState};
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use shared_mem::msg::gripper::{GripperAction, GripperCommand, GripperState};
use shared_mem::msg::image::{CameraInfo, ImageHeader, ImageHeaderWire};
use shared_mem::msg::motion::MotionChunk;
use shared_mem::msg::object::{NamedPose, ObjectName, ObjectPose};
use shared_mem::msg::target::{ArmTarget, GripperTarget};
use shared_mem::msg::twin::{TwinGap, TwinObject, TwinState};
use shared_mem::msg::wrench::Wrench;
use shared_mem::topics::{self, ImageTopic, Topic, Visitor};
use shared_mem::transport::Node;
use std::fmt::Debug;
use zerocopy::{FromBytes, IntoBytes};

/// A node in the domain of one test.
fn node(test: &str) -> Node {
    Node::open_in(&format!("{test}-{}", std::process::id()), "any bits").expect("shared memory")
}

/// Bytes of a message that is one. A topic that is missing here fails the tests below.
fn valid(topic: &str) -> Vec<u8> {
    fn bytes(message: &impl Message) -> Vec<u8> {
        message.to_wire().as_bytes().to_vec()
    }
    match topic {
        "/arm/state" => bytes(&ArmState { dof: 7, mode: ArmMode::Move, ..ArmState::default() }),
        "/arm/command" => bytes(&ArmCommand { dof: 7, ..ArmCommand::default() }),
        "/arm/motion" => bytes(&MotionChunk { dof: 7, length: 50, ..MotionChunk::default() }),
        "/arm/target" => bytes(&ArmTarget { dof: 7, stream: 3, ..ArmTarget::default() }),
        "/gripper/target" => bytes(&GripperTarget { width: 0.04, ..GripperTarget::default() }),
        "/object/pose" => bytes(&ObjectPose::default()),
        "/object/poses" => bytes(&NamedPose::new(ObjectName::new("cup").expect("a name"), &ObjectPose::default())),
        "/camera/info" => bytes(&CameraInfo { width: 640, height: 480, ..CameraInfo::default() }),
        "/wrench" => bytes(&Wrench::default()),
        "/gripper" => bytes(&GripperState { width: 0.04, ..GripperState::default() }),
        "/gripper/command" => bytes(&GripperCommand { action: GripperAction::Grasp, ..GripperCommand::default() }),
        "/twin/state" => bytes(&TwinState { dof: 7, has_object: 1, ..TwinState::default() }),
        "/twin/gap" => bytes(&TwinGap { dof: 7, ..TwinGap::default() }),
        "/twin/objects" => {
            bytes(&TwinObject { name: ObjectName::new("cup").expect("a name"), ..TwinObject::default() })
        }
        "/events" => bytes(&Event::new(EventLevel::Warning, EventSource::Twin, "größer als erlaubt")),
        "/camera/color" | "/camera/depth" => {
            bytes(&ImageHeader { width: 8, height: 2, stride: 24, ..ImageHeader::default() })
        }
        other => panic!("{other} is a new topic: name a message of it that is valid"),
    }
}

/// Random bytes, or a valid message of which a run of bytes is random, or one of which one bit is another.
fn throw(random: &mut Pcg64, valid: &[u8]) -> Vec<u8> {
    let mut bytes = valid.to_vec();
    match random.random_range(0..3) {
        0 => bytes.iter_mut().for_each(|byte| *byte = random.random()),
        1 => {
            let begin = random.random_range(0..bytes.len());
            let end = (begin + random.random_range(1..=16)).min(bytes.len());
            bytes[begin..end].iter_mut().for_each(|byte| *byte = random.random());
        }
        _ => {
            let bit = random.random_range(0..8 * bytes.len());
            bytes[bit / 8] ^= 1 << (bit % 8);
        }
    }
    bytes
}

fn numbers<W: FromBytes + Debug>(bytes: &[u8]) -> W {
    W::read_from_bytes(bytes).expect("as many bytes as the numbers take")
}

const THROWS: u64 = 1000;

/// Sends to itself on every topic.
struct Thrower {
    node: Node,
    random: Pcg64,
    topics: usize,
}

impl Thrower {
    /// What was received and what was ignored are all that was sent, and some of it is ignored.
    fn settle(&mut self, topic: &str, received: u64, mut ignored: u64) {
        ignored += received;
        assert_eq!(ignored, THROWS, "{topic}: messages neither handed on nor counted");
        assert!(received < THROWS, "{topic} has no check: every random message was handed on");
        self.topics += 1;
    }
}

impl Visitor for Thrower {
    fn messages<M: Message>(&mut self, topic: Topic<M>) {
        let publisher = self.node.publisher(topic).expect("a publisher");
        let subscriber = self.node.subscriber(topic).expect("a subscriber");
        let good = valid(topic.name);
        publisher.send_numbers(&numbers(&good)).expect("sent");
        assert!(subscriber.receive().expect("received").is_some(), "{} refuses a valid message", topic.name);
        let mut received = 0;
        for _ in 0..THROWS {
            publisher.send_numbers(&numbers(&throw(&mut self.random, &good))).expect("sent");
            if let Some(message) = subscriber.receive().expect("received") {
                // Formats every field, so that a value that is none of its type would show.
                assert!(!format!("{message:?}").is_empty());
                assert_eq!(M::from_wire(&message.to_wire()).err(), None);
                received += 1;
            }
        }
        self.settle(topic.name, received, subscriber.ignored());
    }

    fn pictures(&mut self, topic: ImageTopic) {
        const BYTES: usize = 48;
        let publisher = self.node.image_publisher(topic, 2 * BYTES).expect("a publisher");
        let subscriber = self.node.image_subscriber(topic).expect("a subscriber");
        let good = valid(topic.name);
        let send = |header: &[u8], bytes: usize| {
            publisher.send_numbers_with(bytes, |_| numbers::<ImageHeaderWire>(header)).expect("sent");
        };
        send(&good, BYTES);
        assert!(subscriber.receive().expect("received").is_some(), "{} refuses a valid picture", topic.name);
        let mut received = 0;
        for _ in 0..THROWS {
            let header = throw(&mut self.random, &good);
            send(&header, self.random.random_range(0..=2 * BYTES));
            if let Some(picture) = subscriber.receive().expect("received") {
                let ImageHeader { width, height, stride, encoding, .. } = *picture.header();
                assert_eq!(picture.bytes().len(), stride as usize * height as usize);
                assert!(stride >= width * encoding.bytes_per_pixel());
                received += 1;
            }
        }
        self.settle(topic.name, received, subscriber.ignored());
    }
}

#[test]
fn any_bits_on_any_topic_are_a_message_or_are_ignored_and_counted() {
    let mut thrower = Thrower { node: node("bits"), random: Pcg64::seed_from_u64(1), topics: 0 };
    topics::visit(&mut thrower);
    assert_eq!(thrower.topics, topics::ALL.len());
}

/// The receiver of each of these used to die of it.
#[test]
fn a_number_that_names_nothing_is_ignored_and_the_next_message_is_received() {
    let node = node("codes");
    let publisher = node.publisher(topics::GRIPPER_COMMAND).expect("a publisher");
    let subscriber = node.subscriber(topics::GRIPPER_COMMAND).expect("a subscriber");
    let stop = GripperCommand { action: GripperAction::Stop, ..GripperCommand::default() };
    for action in [4, 5, 255, u32::MAX] {
        let mut wrong = stop.to_wire();
        wrong.action = action;
        publisher.send_numbers(&wrong).expect("sent");
    }
    publisher.send(&stop).expect("sent");
    assert_eq!(subscriber.receive().expect("received"), Some(stop));
    assert_eq!(subscriber.receive().expect("received"), None);
    let remarks: Vec<String> = node.newly_ignored().iter().map(ToString::to_string).collect();
    let expected = "ignored 4 messages on /gripper/command: action is 4294967295, which stands for nothing; stop the \
                    program that sends them";
    assert_eq!(remarks, [expected]);
}

#[test]
fn what_is_ignored_is_news_at_the_first_message_and_at_ten_times_as_many() {
    let node = node("news");
    let publisher = node.publisher(topics::EVENTS).expect("a publisher");
    let subscriber = node.subscriber(topics::EVENTS).expect("a subscriber");
    assert!(node.newly_ignored().is_empty());
    let mut wrong = Event::new(EventLevel::Info, EventSource::Bridge, "cut").to_wire();
    wrong.length = 233;
    let counts: Vec<u64> = (0..100)
        .flat_map(|_| {
            publisher.send_numbers(&wrong).expect("sent");
            assert_eq!(subscriber.receive().expect("received"), None);
            node.newly_ignored().into_iter().map(|ignored| ignored.count)
        })
        .collect();
    assert_eq!(counts, [1, 10, 100]);
}

#[test]
fn each_check_names_its_field() {
    fn why<M: Message>(message: &M) -> String {
        M::from_wire(&message.to_wire()).map_or_else(|wrong| wrong.to_string(), |_| "valid".into())
    }
    let mut event = Event::new(EventLevel::Error, EventSource::Bridge, "ä");
    event.length = 1;
    assert_eq!(why(&event), "text is no UTF-8");
    assert_eq!(why(&ArmState { dof: 9, ..ArmState::default() }), "dof is 9, not 0 to 8");
    assert_eq!(why(&ArmState { q: [f64::NAN; 8], ..ArmState::default() }), "q holds NaN, not a number of at most 1e9");
    assert_eq!(
        why(&ArmState { cycle: u64::MAX, ..ArmState::default() }),
        "cycle is 18446744073709551615, not 0 to 4611686018427387904"
    );
    let mut chunk = MotionChunk { dof: 7, length: 1, ..MotionChunk::default() };
    chunk.set_points[1].dq_d[7] = -1.9e157;
    assert_eq!(why(&chunk), "valid", "only the first set point counts");
    chunk.set_points[0].dq_d[7] = -1.9e157;
    assert_eq!(why(&chunk), "dq_d holds -1.9e157 for a joint beyond dof");
    assert_eq!(why(&MotionChunk { length: 51, ..MotionChunk::default() }), "length is 51, not 0 to 50");
    assert_eq!(
        why(&ObjectPose { wxyz: [0.0; 4], ..ObjectPose::default() }),
        "wxyz is no unit quaternion: its length is 0.0000"
    );
    assert_eq!(why(&TwinGap { object_add_m: f64::NAN, ..TwinGap::default() }), "valid", "no object, no gap of it");
    assert_eq!(
        why(&TwinGap { joint_rms: [f64::INFINITY; 8], ..TwinGap::default() }),
        "joint_rms holds inf, not a number of at most 1e9"
    );
    assert_eq!(why(&Wrench { saturated: 64, ..Wrench::default() }), "saturated is 64, not 0 to 63");
    assert_eq!(why(&CameraInfo { width: 640, ..CameraInfo::default() }), "height is 0, not 1 to 8192");
    let huge = ImageHeader { width: 8192, height: 8192, stride: u32::MAX, ..ImageHeader::default() };
    assert_eq!(why(&huge), "valid");
    let size = huge.check_size(3).expect_err("too few").to_string();
    assert_eq!(size, "the picture has 3 bytes, its header describes 35184372080640");
}
