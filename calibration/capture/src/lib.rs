//! Capture: plan a motion, have the bridge play it, record it into a session folder.
//!
//! Planning is pure: [`plan`] for excitation as a [`request`] asks for it (an [`arm_motion`] is what an advice asks for), on a [`shape`] ([`multisine`], [`chirp`], [`ramp`], [`hold`], built of [`jet`]s), or on a clip that was [`recorded`], at a [`pace`], [`program`], [`staged`], [`stroke`] and [`way`] for Control-Hit-Slide on
//! [`line`] and [`transit`], both at the arm's control [`rate`], within [`limits`] of the [`body`] and clear of every [`obstacle`]. Playing goes through shared memory only ([`stream`],
//! [`link`], [`object_watch`]), of an arm that its session admits ([`admission`]), with [`placing`] where the object has to stand somewhere (others `stay`) and [`recovery`] where the robot stops itself; recording is a process beside us ([`recorder`]), one of the other programs ([`processes`]). [`excitation`] and [`control_hit_slide`] are the
//! verbs that bind them, and [`task`] is what both are asked for. [`scan`] carries a camera around a point: [`dome`] plans its views clear of what stands `around` it, [`shots`] takes the pictures, `cut` says what in them is the object.

pub mod admission;
pub mod arm_motion;
mod around;
pub mod body;
pub mod bridge;
pub mod chirp;
pub mod control_hit_slide;
mod cut;
pub mod dome;
pub mod excess;
pub mod excitation;
pub mod hold;
pub mod jet;
pub mod limits;
pub mod line;
pub mod link;
pub mod multisine;
pub mod object_watch;
pub mod obstacle;
pub mod pace;
mod picture;
pub mod placing;
pub mod plan;
pub mod processes;
pub mod program;
pub mod quality;
pub mod ramp;
pub mod rate;
pub mod recorded;
pub mod recorder;
pub mod recovery;
pub mod request;
pub mod scan;
pub mod session;
pub mod shape;
pub mod shots;
pub mod staged;
mod stay;
pub mod stream;
pub mod stroke;
pub mod stroke_clip;
pub mod task;
pub mod transit;
pub mod way;
