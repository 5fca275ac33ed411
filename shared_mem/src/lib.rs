//! The contract between the processes of a cell: what they say to each other, in which units and frames, how long a
//! message waits for its reader, and how all of it is written to disk.
//!
//! No hardware and no physics live here. Units are SI; stamps are integer nanoseconds; quaternions are `w, x, y, z`
//! in messages and files and `nalgebra` quaternions in memory.
//!
//! | module | owns |
//! |---|---|
//! | [`msg`] | the messages: one file a device, every field with unit and frame, their plain form for shared memory and its check |
//! | [`topics`] | every topic's name, message and limits: nothing else names a topic |
//! | [`transport`] | shared memory (the only iceoryx2 code) |
//! | [`recording`] | clips and sessions on disk (the only MCAP code) |
//! | [`cell`] | `cell.toml`: what the laboratory knows about its cell |
//! | [`theta`] | `theta.toml`: what was identified, and the effects that were named |
//! | [`frames`] | typed poses: `Pose<To, From>` |
//! | [`hand_eye`] | `hand_eye.toml`: where a camera is mounted, and `O_T_EE` in lists of pictures |
//! | [`json`] | JSON of other programs: within a budget, and what is wrong with it in words |
//! | [`lens`] | what lenses do to a pinhole's picture, both ways, and how other programs write them |
//! | [`origin`] | where a recording comes from: a simulation, a robot, another recording |
//! | [`budget`] | what reading one input may cost: memory and steps |
//! | [`checksum`] | whether a file that was kept is still what was written |
//! | [`input`] | the one way in for files: regular ones only, each kind up to a size |
//! | [`output`] | files that are whole or not there: every writer but the live recorder goes through it |
//! | [`place`] | paths that are copied from one file into another |
//! | [`interrupt`] | Ctrl-C, pauses, and a budget of time |
//! | [`child_output`] | what other programs say on their pipes |
//! | [`ending`] | whether the process was asked to end |
//! | [`parent`] | programs that end when the one that started them is gone |
//! | [`error_line()`] | an error with its causes in one line |
//! | [`answer`] | what a program answers, on standard output |
//! | [`console`] | what it says on the way, on standard error |
//! | [`progress`] | how far it is, on a terminal |
//! | [`printable`] | text as a terminal may show it |
//! | [`command_line`] | what the command lines of all programs have in common: help, version, completions, manual pages |
//! | [`typed`] | commands as a person types them |
//! | [`usage`] | help, and what is wrong with a command line |
//! | [`quantity`] | numbers with a unit, as they are typed |
//! | [`time`] | the clock that every stamp comes from |
#![warn(missing_docs)]

pub mod answer;
mod blocks;
pub mod budget;
pub mod cell;
pub mod checksum;
pub mod child_output;
pub mod command_line;
pub mod console;
pub mod ending;
mod error_line;
pub mod frames;
pub mod hand_eye;
pub mod input;
pub mod interrupt;
pub mod json;
pub mod lens;
pub mod msg;
pub mod origin;
pub mod output;
pub mod parent;
pub mod place;
pub mod printable;
pub mod progress;
pub mod quantity;
pub mod recording;
pub mod statistics;
pub mod theta;
pub mod time;
pub mod toml_file;
pub mod topics;
pub mod transport;
pub mod typed;
pub mod usage;

pub use error_line::error_line;
