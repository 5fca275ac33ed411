//! What is written to disk comes back, and what is damaged is refused.

mod cell_document;
mod recording_bags;
mod recording_damage;
mod recording_data;
mod recording_export;
mod recording_origins;
mod recording_own_clips;
mod recording_rosbag2;
mod recording_twinaligner;
mod several_objects;
