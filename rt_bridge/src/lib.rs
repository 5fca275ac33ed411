//! Hardware to shared memory: the 1 kHz loop, its safety, and the devices behind traits.
//!
//! Threads of `rt_bridge run`:
//!
//! | thread | runs | owns |
//! |---|---|---|
//! | control | [`rt`], [`motion`], [`safety`], an [`arm::Arm`] | the arm; neither memory nor locks nor files while it loops |
//! | pump | [`pump`], [`targets`] | the ports for states, commands, motions, targets and events |
//! | world | [`sim`] | the simulated cell, with `--arm sim` |
//! | camera | [`camera`] | the ports for pictures, with a simulated or replayed camera; a RealSense camera has one like the gripper's |
//! | tracker | [`tracker`] | reads the pictures and joints, owns the port for the object's poses, with `--tracker rgbd` |
//! | gripper, wrench | [`device`], [`gripper`], [`mod@wrench`] | one device each, and its ports |
//! | instruments | [`replay`] | the ports of a recording's gripper and force sensor, with `--arm replay://` |
//! | console | [`shared_mem::console`] | standard error: nobody else waits for it |
//! | main | [`run`] | duration, Ctrl-C, the recorder's process, the report |
//!
//! `rt_bridge serve` ([`serve`]) is the other side of the line: it plays the robot.
//!
//! Rings without locks join control, pump and world. The recorder ([`recorder`]) is a process of its own.

pub mod arm;
pub mod camera;
pub mod cli;
pub mod device;
pub mod doctor;
pub mod fr3;
pub mod gripper;
pub mod motion;
pub mod pump;
pub mod recorder;
pub mod remark;
pub mod replay;
pub mod rt;
pub mod run;
pub mod safety;
pub mod serve;
pub mod sighting;
pub mod sim;
pub mod starting;
pub mod targets;
pub mod times;
pub mod tracker;
pub mod wrench;
