//! Capture: plan a motion, have the bridge play it, record it into a session folder.
//!
//! Planning is pure: [`plan`] for excitation on [`multisine`], [`program`], [`stroke`] and [`way`] for Control-Hit-Slide on
//! [`line`] and [`transit`], both within [`limits`] of the [`body`]. Playing goes through shared memory only ([`stream`],
//! [`link`], [`object_watch`]), with [`recovery`] where the robot stops itself; recording is a process beside us ([`recorder`]). [`excitation`] and [`control_hit_slide`] are the
//! verbs that bind them, and [`task`] is what both are asked for.

pub mod body;
pub mod bridge;
pub mod control_hit_slide;
pub mod excess;
pub mod excitation;
pub mod limits;
pub mod line;
pub mod link;
pub mod multisine;
pub mod object_watch;
pub mod plan;
pub mod program;
pub mod quality;
pub mod recorder;
pub mod recovery;
pub mod session;
pub mod stream;
pub mod stroke;
pub mod task;
pub mod transit;
pub mod way;
