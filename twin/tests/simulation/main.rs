//! The simulated cell: arm, contact, camera, replay.

mod arm_choice;
mod arm_dynamics;
mod device_pictures;
mod effects;
mod effects_clips;
#[cfg(feature = "render")]
#[path = "../../benches/shared/eye.rs"]
mod eye;
mod label_splats;
mod odd_descriptions;
mod push;
mod render_command;
mod replay;
mod replay_data;
#[path = "../../benches/shared/robot_splats.rs"]
mod robot_splats;
mod rollout;
mod several_objects;
mod shadow_command;
mod sliding_clips;
mod sliding_rest;
mod sliding_travel;
mod splats;
#[path = "../stroke/mod.rs"]
mod stroke;
mod task_files;
