//! Commands, planned and sent, stay within every limit.

mod arm_above_table;
#[path = "../bench/mod.rs"]
mod bench;
mod command_limits;
mod command_line;
mod gripper_port;
mod motion_safety;
mod recovery;
mod target_arrival;
mod target_stream;
