//! What sessions of a known truth say.

mod arm_session;
mod command_line;
#[path = "../driven/mod.rs"]
mod driven;
mod foreign_logs;
#[path = "../golden/mod.rs"]
mod golden;
mod hand_eye;
mod identified;
mod identify_arm;
mod identify_joint;
mod keeping;
mod long_clips;
mod measured_stiffness;
mod object;
mod objects_alone;
#[path = "../pushes/mod.rs"]
mod pushes;
#[path = "../slides/mod.rs"]
mod slides;
mod torques;
mod unknown_weight;
