//! The cell in simulation: arm, contact, sensors, live shadow, replay.

pub mod arm;
pub mod cli;
pub mod contact_law;
pub mod control;
pub mod description;
pub mod effects;
pub mod metrics;
pub mod physics;
pub mod pose_fit;
pub mod reconstruct;
pub mod render;
pub mod replay;
pub mod rollout;
pub mod scene;
pub mod sensors;
pub mod shadow;
#[cfg(test)]
mod shipped;
#[cfg(feature = "teleop")]
pub mod show;
pub mod sim;
pub mod sliding;
pub mod task;
#[cfg(feature = "teleop")]
pub mod teleop;
#[cfg(feature = "viewer")]
pub mod viewer;
#[cfg(feature = "teleop")]
pub mod web;
pub mod world;
pub mod xml;
