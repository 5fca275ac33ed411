//! Logs of other programs as a session: what they hold, what it means, and clips of it. And data sets for other programs.
//!
//! | file | owns |
//! |---|---|
//! | `sources` | formats: ROS 2 and ROS 1 bags, LeRobot data sets, text tables, npz, libfranka's log, SAGE's folders |
//! | `ros` | ROS messages of any type as rows of numbers |
//! | `log` | what every format is read into: tables of named columns with stamps |
//! | `naming` | what the names of columns say |
//! | `mapping` | `import.toml`: which columns are which quantity, in which unit |
//! | `runs` | which logs a file holds: each of several runs by itself |
//! | `windows` | arrays with a motion in each row |
//! | `propose` | a mapping out of a log, with the reasons |
//! | `clip` | a log by its mapping, in SI |
//! | `pieces` | one long log of many motions as clips |
//! | `cell`, `arm` | the cell.toml of the new session, and what is known of its arm |
//! | `session` | the whole way |
//! | [`weight`], [`lag`] | what torques say about the arm's weight, and motion about the time to its command: for those who look at clips, too |
//! | `contents` | what a log holds of a robot, for those who only look |
//! | `data_set` | writes LeRobot data sets |

mod arm;
mod cell;
mod clip;
mod contents;
mod data_set;
mod error;
pub mod lag;
mod log;
mod mapping;
mod naming;
mod pieces;
mod propose;
mod ros;
mod runs;
mod session;
mod sources;
pub mod weight;
mod windows;

pub use arm::{Arm, Arms};
pub use cell::{Rotors, UsualController, is_franka, usual_controller};
pub use clip::{Gravity, Holds, Moves};
pub use contents::{Contents, look};
pub use data_set::{DataSetError, DataSetPlan, DataSetWriter, Feature, FeatureKind, Frames};
pub use error::ImportError;
pub use log::LeftOut;
pub use mapping::{
    AngleUnit, Factor, JointColumns, LengthUnit, Mapping, Note, Pieces, PoseColumns, RateUnit, TimeUnit, Torque,
    TorquesAct,
};
pub use session::{Imported, Order, Outcome, import};
