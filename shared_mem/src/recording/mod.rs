//! Clips and sessions on disk: the only code that knows MCAP.
//!
//! A clip is found out, not declared: an own recording (MCAP, protobuf), a ROS 2 bag (MCAP, CDR) or a TwinAligner
//! folder all become the same [`Clip`]. Nothing that a file says is trusted: lengths are bounded, checksums are
//! compared, and what had to be left out is told in [`Clip::damage`] and [`Clip::warnings`].
//!
//! | file | owns |
//! |---|---|
//! | `container` | MCAP records and messages of a file that may be cut or changed |
//! | `cdr`, `ros2`, `definitions` | ROS 2 messages, and how they are defined |
//! | `read` | which kind of clip a file is, and reading it |
//! | `own`, `logged` | an own recording as a clip, and what of its states to believe |
//! | `messages`, `picture`, `picture_file`, `pictures` | all messages one by one, a picture, pictures as files, a clip's pictures |
//! | `bag`, `cameras` | a ROS 2 bag as a clip, and what it says of its cameras |
//! | `twinaligner`, `npy` | a TwinAligner folder as a clip |
//! | `tracked` | objects by name, and the topics that they are on |
//! | `controller_log` | commanded velocities and motor currents, made into positions and torques |
//! | `joint_log` | joint rows: one publisher, one joint order |
//! | `checks` | faults that foreign logs have, each told in a sentence |
//! | `wire`, `writer` | own clips: messages and file, and what viewers are shown of the robot |
//! | `encoded` | the bytes of messages without a file, as they go to another host |
//! | `robot` | a robot as viewers want it |
//! | `episode` | one run of a task as a clip, there and back |
//! | `raw` | messages as bytes, for readers of other programs' bags |
//! | `recover` | a damaged file, rewritten |
//! | `export` | a session in another format |
//! | `clip`, `series`, `session` | what callers get |
//! | `origins`, `provenance` | where a clip says that it comes from, and what that makes of a session |
//! | `subject` | of several objects the one that a command is about |

mod bag;
mod cameras;
mod cdr;
mod checks;
mod clip;
mod container;
mod controller_log;
mod definitions;
mod device_clock;
mod encoded;
mod episode;
mod error;
mod export;
mod joint_log;
mod logged;
mod messages;
mod npy;
mod origins;
mod own;
mod picture;
mod picture_file;
mod pictures;
mod provenance;
mod raw;
mod read;
mod recover;
mod robot;
mod ros2;
mod series;
mod session;
mod subject;
mod torques;
mod tracked;
mod twinaligner;
mod wire;
mod writer;

pub use cameras::Cameras;
pub use checks::few_rows;
pub use clip::{Clip, TrackedObject};
pub use definitions::definition as ros2_definition;
pub use encoded::{
    Encoded, EncodedVisitor, append_picture, picture_from_bytes, picture_schema, schema_checksum, visit_encoded,
};
pub use episode::{Episode, EpisodeInfo, EpisodeMoment, RigidPose, read_episode, write_episode};
pub use error::ReadError;
pub use export::{ExportError, Exported, FlangeAt, Format, LeftOut, Order, export_session, session_folder, write_clip};
pub use messages::{ClipMessage, ClipMessages, Payload};
pub use npy::{Array, ArrayError, parse as parse_npy};
pub use own::{read_arm_states, read_clip_info};
pub use picture::Picture;
pub use picture_file::{
    pack_picture, pack_quickly, pack_with_alpha, picture_size, read_alpha, read_picture, unpack_picture, write_png,
    write_png_to,
};
pub use pictures::{PictureKind, for_pictures};
pub use provenance::{ClipOrigins, Provenance, read_origins};
pub use raw::{RawMessage, RawMessages};
pub use read::read_clip;
pub use recover::{RecoverError, Recovered, recover};
pub use robot::{FramesAt, JOINT_STATES, ROBOT_DESCRIPTION, RobotModel, TF, TF_STATIC, Transform};
pub use series::{JointSeries, ObjectSeries};
pub use session::{Session, SessionFiles};
pub use subject::{Subject, Why};
pub use writer::{ClipInfo, ClipWriter, WriteError, WriteSummary};
