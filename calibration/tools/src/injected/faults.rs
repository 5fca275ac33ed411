//! Every fault that foreign logs are known to have: its name, the remarks that find it, the sessions that can have it.

use super::sessions::Clean;
use calibration::check::remark::Fault;
use shared_mem::cell::ClipKind;

/// What is put into a session.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Injected {
    /// Packets of a 1 kHz log that did not arrive, 3 to 40 in a clip.
    LostPackets,
    /// A first row that is not the arm's.
    StartGlitch,
    /// Stamps that jitter, with gaps to 9 ms.
    UnevenStamps,
    /// One topic in degrees.
    OneTopicInDegrees,
    /// Both topics in degrees.
    BothTopicsInDegrees,
    /// Rows of a second arm on the measured topic, in turns or by lot.
    TwoPublishers,
    /// An angle that wraps, and velocities computed across.
    AngleWraps,
    /// Velocities computed across wraps of angles that were unwrapped.
    VelocitySpikes,
    /// Measured torques less gravity.
    TorqueWithoutGravity,
    /// Measured torques of an arm that hangs on its side, beside a model that stands.
    BaseOnItsSide,
    /// The torque of one joint turned round.
    TorqueSignOfOneJoint,
    /// Commands that are the measured positions.
    CopiedCommands,
    /// Half widths in `object.size`.
    HalfWidths,
    /// Poses in millimetres.
    Millimetres,
    /// Quaternions with w first.
    QuaternionWFirst,
    /// A joint log that runs faster than the joints it logs.
    HeldStates,
    /// Poses written once a loop that runs faster than the camera.
    HeldPoses,
    /// Commands at a rate that beats against the states'.
    UnsynchronisedCommands,
    /// A channel of a joint that holds one number.
    PlaceholderConstant,
    /// Poses of another scale.
    FallScale,
    /// Poses stamped by another clock.
    FallClock,
    /// Measurements shifted by rows, so that the lag goes with 1 / speed.
    MisalignedLogs,
    /// Measurements that lead their commands.
    LeadingLogs,
    /// A file cut at its end.
    CutFile,
    /// Two joints of the measured topic exchanged.
    OrderOfOneTopic,
    /// Two joints of both topics exchanged.
    OrderOfBothTopics,
    /// A joint of the measured topic turned round.
    SignOfOneTopic,
    /// A joint of both topics turned round.
    SignOfBothTopics,
    /// Stamps in milliseconds.
    StampsInMilliseconds,
    /// Stamps in microseconds.
    StampsInMicroseconds,
    /// Commands divided by 57.3 twice.
    CommandsDividedTwice,
    /// Velocities in degrees a second.
    VelocityUnit,
    /// Velocities behind a low pass of 6 to 40 ms.
    VelocityFilter,
}

impl Injected {
    /// All of them.
    pub const ALL: [Self; 33] = [
        Self::LostPackets,
        Self::StartGlitch,
        Self::UnevenStamps,
        Self::OneTopicInDegrees,
        Self::BothTopicsInDegrees,
        Self::TwoPublishers,
        Self::AngleWraps,
        Self::VelocitySpikes,
        Self::TorqueWithoutGravity,
        Self::BaseOnItsSide,
        Self::TorqueSignOfOneJoint,
        Self::CopiedCommands,
        Self::HalfWidths,
        Self::Millimetres,
        Self::QuaternionWFirst,
        Self::HeldStates,
        Self::HeldPoses,
        Self::UnsynchronisedCommands,
        Self::PlaceholderConstant,
        Self::FallScale,
        Self::FallClock,
        Self::MisalignedLogs,
        Self::LeadingLogs,
        Self::CutFile,
        Self::OrderOfOneTopic,
        Self::OrderOfBothTopics,
        Self::SignOfOneTopic,
        Self::SignOfBothTopics,
        Self::StampsInMilliseconds,
        Self::StampsInMicroseconds,
        Self::CommandsDividedTwice,
        Self::VelocityUnit,
        Self::VelocityFilter,
    ];

    /// Its name in tables.
    pub fn name(self) -> &'static str {
        match self {
            Self::LostPackets => "lost packets",
            Self::StartGlitch => "start-up glitch row",
            Self::UnevenStamps => "uneven stamps, gaps to 9 ms",
            Self::OneTopicInDegrees => "one topic in degrees",
            Self::BothTopicsInDegrees => "both topics in degrees",
            Self::TwoPublishers => "two publishers on one topic",
            Self::AngleWraps => "angle wraps with velocity spikes",
            Self::VelocitySpikes => "velocity spikes at wraps, q unwrapped",
            Self::TorqueWithoutGravity => "torque without gravity",
            Self::BaseOnItsSide => "base on its side",
            Self::TorqueSignOfOneJoint => "torque sign of one joint",
            Self::CopiedCommands => "commands copied from measurements",
            Self::HalfWidths => "half widths as size",
            Self::Millimetres => "poses in mm",
            Self::QuaternionWFirst => "quaternions w first",
            Self::HeldStates => "states slower than their log",
            Self::HeldPoses => "images slower than their log",
            Self::UnsynchronisedCommands => "commands at an unsynchronised rate",
            Self::PlaceholderConstant => "placeholder constant",
            Self::FallScale => "free fall: scale",
            Self::FallClock => "free fall: clock",
            Self::MisalignedLogs => "lag that halves when speed doubles",
            Self::LeadingLogs => "measurement leads its command",
            Self::CutFile => "last chunk cut",
            Self::OrderOfOneTopic => "joint order of one topic",
            Self::OrderOfBothTopics => "joint order of both topics",
            Self::SignOfOneTopic => "joint sign in one topic",
            Self::SignOfBothTopics => "joint sign in both topics",
            Self::StampsInMilliseconds => "stamps in ms",
            Self::StampsInMicroseconds => "stamps in us",
            Self::CommandsDividedTwice => "commands divided by 57.3 twice",
            Self::VelocityUnit => "dq in degrees/s",
            Self::VelocityFilter => "dq filtered",
        }
    }

    /// Whether a remark names this fault.
    pub fn is_found_as(self, fault: Fault) -> bool {
        match self {
            Self::LostPackets => fault == Fault::LostSamples,
            Self::StartGlitch => fault == Fault::StartGlitch,
            Self::UnevenStamps => fault == Fault::UnevenStamps,
            Self::OneTopicInDegrees | Self::BothTopicsInDegrees => fault == Fault::Degrees,
            Self::TwoPublishers => fault == Fault::TwoPublishers,
            Self::AngleWraps | Self::VelocitySpikes => fault == Fault::AngleWraps,
            Self::TorqueWithoutGravity => fault == Fault::TorqueGravity,
            Self::BaseOnItsSide => fault == Fault::GravityDirection,
            Self::TorqueSignOfOneJoint => fault == Fault::TorqueUnit,
            Self::CopiedCommands => fault == Fault::CopiedCommands,
            Self::HalfWidths | Self::Millimetres => fault == Fault::LengthUnit,
            Self::QuaternionWFirst => fault == Fault::Quaternion,
            Self::HeldStates | Self::HeldPoses => fault == Fault::HeldRows,
            Self::UnsynchronisedCommands => fault == Fault::UnsynchronisedRates,
            Self::PlaceholderConstant => fault == Fault::PlaceholderConstant,
            Self::FallScale | Self::FallClock => fault == Fault::FreeFall,
            Self::MisalignedLogs | Self::LeadingLogs => fault == Fault::MisalignedLogs,
            Self::CutFile => fault == Fault::CutFile,
            Self::OrderOfOneTopic | Self::OrderOfBothTopics => fault == Fault::JointOrder,
            // Two joints that both leave their ranges or one that does: the sign is what is wrong.
            Self::SignOfOneTopic | Self::SignOfBothTopics => fault == Fault::JointSign,
            Self::StampsInMilliseconds | Self::StampsInMicroseconds => fault == Fault::StampUnit,
            Self::CommandsDividedTwice => fault == Fault::CommandUnit,
            Self::VelocityUnit => fault == Fault::VelocityUnit,
            Self::VelocityFilter => fault == Fault::VelocityFilter,
        }
    }

    /// Whether a session has what could have the fault.
    pub fn fits(self, session: &Clean) -> bool {
        let tossed = session.clips.iter().any(|(_, clip)| clip.kind == ClipKind::FreeMotion);
        match self {
            Self::FallScale | Self::FallClock => tossed,
            Self::HalfWidths | Self::Millimetres | Self::QuaternionWFirst | Self::HeldPoses => {
                session.has_poses() && !tossed
            }
            // Of both topics alike only torques tell, and these only where the joints move much.
            Self::SignOfBothTopics | Self::OrderOfBothTopics | Self::TorqueSignOfOneJoint => {
                session.has_arm() && !session.has_poses()
            }
            Self::MisalignedLogs => session.has_arm() && session.paces() > PACES,
            _ => session.has_arm(),
        }
    }
}

/// A lag that goes with speed needs clips of which one takes so many times as long as another.
const PACES: f64 = 1.5;
