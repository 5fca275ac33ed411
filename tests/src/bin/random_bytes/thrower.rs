//! Throws at every topic whose sender's place is free: random bytes, valid messages with a run of random bytes, and valid
//! messages with one bit turned over.

use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;
use shared_mem::msg::Message;
use shared_mem::msg::arm::{ArmMode, ArmState, MotionStatus};
use shared_mem::msg::event::{Event, EventLevel, EventSource};
use shared_mem::msg::gripper::{GripperAction, GripperCommand};
use shared_mem::msg::image::{CameraInfo, ImageHeader, ImageHeaderWire};
use shared_mem::msg::motion::{CHUNK_LENGTH, MotionChunk, MotionKind};
use shared_mem::msg::object::{NamedPose, ObjectName, ObjectPose};
use shared_mem::msg::target::{ArmTarget, GripperTarget};
use shared_mem::msg::twin::{TwinGap, TwinObject, TwinState};
use shared_mem::time::now_ns;
use shared_mem::topics::{self, ImageTopic, Topic, Visitor};
use shared_mem::transport::{ImagePublisher, Node, Publisher, TransportError};
use std::collections::BTreeMap;
use zerocopy::{FromBytes as _, IntoBytes as _};

/// Of a small picture.
const PICTURE: [u32; 2] = [16, 12];
/// Chunks of a motion: half a second.
const CHUNKS: u32 = 10;
/// How far a motion goes at most [rad].
const REACH: f64 = 0.06;
/// A target within reach [rad].
const TARGET: [f64; 8] = [0.1, -0.6, 0.0, -2.2, 0.0, 1.6, 0.7, 0.0];
/// One chunk of a motion in so many is spoilt.
const SPOILT: u32 = 100;

/// Sends bytes to one topic.
type Send = Box<dyn Fn(&[u8], &mut Pcg64) -> Result<(), TransportError>>;

struct Target {
    valid: Vec<u8>,
    send: Send,
}

/// The senders of one domain.
pub(crate) struct Thrower {
    random: Pcg64,
    targets: BTreeMap<&'static str, Target>,
    motion: Option<Motion>,
    /// Messages a topic.
    pub(crate) thrown: BTreeMap<&'static str, u64>,
    /// Topics on which another process has the only place to send.
    pub(crate) occupied: Vec<&'static str>,
    // Declared last: ports go before the node they belong to.
    node: Node,
}

impl Thrower {
    pub(crate) fn open(domain: &str, seed: u64) -> Self {
        let node = Node::open_in(domain, "random bytes").expect("shared memory");
        let random = Pcg64::seed_from_u64(seed);
        let (targets, thrown) = (BTreeMap::new(), BTreeMap::new());
        let mut thrower = Self { random, targets, motion: None, thrown, occupied: Vec::new(), node };
        topics::visit(&mut thrower);
        thrower
    }

    /// One message to each topic.
    pub(crate) fn throw(&mut self) {
        for (topic, target) in &self.targets {
            // Of motions, most that is sent is none, and a real one runs beside it: see `go_on`.
            let bytes = match (*topic, self.random.random_range(0..3)) {
                ("/arm/motion", _) | (_, 0) => (0..target.valid.len()).map(|_| self.random.random()).collect(),
                (_, kind) => spoilt(&target.valid, kind == 1, &mut self.random),
            };
            (target.send)(&bytes, &mut self.random).expect("sent");
            *self.thrown.entry(topic).or_default() += 1;
        }
    }

    /// Keeps the arm moving from where it is commanded to be, with a spoilt chunk now and then.
    pub(crate) fn go_on(&mut self, state: &ArmState) {
        let Some(target) = self.targets.get("/arm/motion") else { return };
        if self.motion.as_ref().is_some_and(|motion| !motion.has_ended(state)) {
            return;
        }
        let motion = Motion::new(state, &mut self.random);
        for index in 0..CHUNKS {
            let mut bytes = motion.chunk(index).to_wire().as_bytes().to_vec();
            if self.random.random_range(0..SPOILT) == 0 {
                bytes = spoilt(&bytes, self.random.random(), &mut self.random);
            }
            (target.send)(&bytes, &mut self.random).expect("sent");
        }
        self.motion = Some(motion);
    }

    fn add(&mut self, topic: &'static str, valid: Vec<u8>, opened: Result<Send, TransportError>) {
        match opened {
            Ok(send) => {
                self.targets.insert(topic, Target { valid, send });
            }
            Err(TransportError::Full { .. }) => self.occupied.push(topic),
            Err(error) => panic!("{error}"),
        }
    }
}

impl Visitor for Thrower {
    fn messages<M: Message>(&mut self, topic: Topic<M>) {
        let opened = self.node.publisher(topic).map(|publisher: Publisher<M>| -> Send {
            Box::new(move |bytes, _| {
                publisher.send_numbers(&M::Wire::read_from_bytes(bytes).expect("as many bytes as the numbers take"))
            })
        });
        self.add(topic.name, valid(topic.name), opened);
    }

    fn pictures(&mut self, topic: ImageTopic) {
        let size = (3 * PICTURE[0] * PICTURE[1]) as usize;
        let opened = self.node.image_publisher(topic, size).map(|publisher: ImagePublisher| -> Send {
            Box::new(move |bytes, random| {
                let header = ImageHeaderWire::read_from_bytes(bytes).expect("as many bytes as the numbers take");
                let size = if random.random() { size } else { random.random_range(0..=size) };
                publisher.send_numbers_with(size, |pixels| {
                    pixels.iter_mut().for_each(|byte| *byte = random.random());
                    header
                })
            })
        });
        self.add(topic.name, valid(topic.name), opened);
    }
}

/// A message of which a run of bytes is random, or one bit turned over.
fn spoilt(valid: &[u8], run: bool, random: &mut Pcg64) -> Vec<u8> {
    let mut bytes = valid.to_vec();
    let begin = random.random_range(0..bytes.len());
    if run {
        let end = (begin + random.random_range(1..=16)).min(bytes.len());
        bytes[begin..end].iter_mut().for_each(|byte| *byte = random.random());
    } else {
        bytes[begin] ^= 1 << random.random_range(0..8);
    }
    bytes
}

/// Bytes of a message that is one.
fn valid(topic: &str) -> Vec<u8> {
    fn bytes(message: &impl Message) -> Vec<u8> {
        message.to_wire().as_bytes().to_vec()
    }
    let stamp_ns = now_ns();
    let [width, height] = PICTURE;
    match topic {
        "/arm/state" => bytes(&ArmState { stamp_ns, dof: 7, mode: ArmMode::Move, ..ArmState::default() }),
        "/arm/command" => bytes(&shared_mem::msg::arm::ArmCommand { stamp_ns, dof: 7, ..Default::default() }),
        "/arm/motion" => bytes(&MotionChunk { stamp_ns, dof: 7, ..MotionChunk::default() }),
        "/arm/target" => bytes(&ArmTarget { stamp_ns, stream: 3, dof: 7, q: TARGET, ..ArmTarget::default() }),
        "/gripper/target" => bytes(&GripperTarget { stamp_ns, stream: 3, width: 0.03, ..GripperTarget::default() }),
        "/object/pose" => bytes(&ObjectPose { stamp_ns, position: [0.55, 0.0, 0.05], ..ObjectPose::default() }),
        "/object/poses" => bytes(&NamedPose::new(
            ObjectName::new("cup").expect("a name"),
            &ObjectPose { stamp_ns, position: [0.55, 0.0, 0.05], ..ObjectPose::default() },
        )),
        "/camera/color" | "/camera/depth" => {
            bytes(&ImageHeader { stamp_ns, width, height, stride: 3 * width, ..ImageHeader::default() })
        }
        "/camera/info" => bytes(&CameraInfo { stamp_ns, width, height, ..CameraInfo::default() }),
        "/wrench" => bytes(&shared_mem::msg::wrench::Wrench { stamp_ns, ..Default::default() }),
        "/gripper" => bytes(&shared_mem::msg::gripper::GripperState { stamp_ns, ..Default::default() }),
        "/gripper/command" => {
            bytes(&GripperCommand { stamp_ns, action: GripperAction::Grasp, width: 0.03, ..GripperCommand::default() })
        }
        "/twin/state" => bytes(&TwinState { stamp_ns, dof: 7, has_object: 1, ..TwinState::default() }),
        "/twin/gap" => bytes(&TwinGap { stamp_ns, dof: 7, ..TwinGap::default() }),
        "/twin/objects" => {
            bytes(&TwinObject { stamp_ns, name: ObjectName::new("cup").expect("a name"), ..TwinObject::default() })
        }
        "/events" => bytes(&Event::new(EventLevel::Warning, EventSource::Capture, "größer als erlaubt")),
        other => panic!("{other} is a new topic: name a message of it that is valid"),
    }
}

/// A motion of half a second from rest to rest.
struct Motion {
    id: u64,
    begin: [f64; 8],
    way: [f64; 8],
    sent_ns: u64,
}

impl Motion {
    fn new(state: &ArmState, random: &mut Pcg64) -> Self {
        let way = std::array::from_fn(|joint| if joint < 7 { random.random_range(-REACH..REACH) } else { 0.0 });
        Self { id: random.random_range(1..u64::MAX), begin: state.q_d, way, sent_ns: now_ns() }
    }

    /// Played, refused or braked; or spoilt, so that nothing came of it.
    fn has_ended(&self, state: &ArmState) -> bool {
        let over = [MotionStatus::Done, MotionStatus::Refused, MotionStatus::Braked].contains(&state.motion);
        (state.motion_id == self.id && over) || now_ns().saturating_sub(self.sent_ns) > 2_000_000_000
    }

    /// The smoothest way of fifth order: at rest, without acceleration, at both ends.
    fn chunk(&self, index: u32) -> MotionChunk {
        let (last, length) = (index + 1 == CHUNKS, CHUNK_LENGTH as u32);
        let kind = if last { MotionKind::Last } else { MotionKind::Play };
        let mut chunk = MotionChunk {
            stamp_ns: now_ns(),
            motion_id: self.id,
            kind,
            index,
            length,
            dof: 7,
            ..MotionChunk::default()
        };
        let duration = f64::from(CHUNKS * length) * 1e-3;
        for (k, point) in (1..).zip(&mut chunk.set_points) {
            let x = f64::from(index * length + k) * 1e-3 / duration;
            let share = x * x * x * (10.0 + x * (6.0 * x - 15.0));
            let rate = 30.0 * x * x * (1.0 - x) * (1.0 - x) / duration;
            point.q_d = std::array::from_fn(|joint| self.begin[joint] + self.way[joint] * share);
            point.dq_d = std::array::from_fn(|joint| self.way[joint] * rate);
        }
        chunk
    }
}
