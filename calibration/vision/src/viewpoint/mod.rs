//! The camera's pose from pictures of the robot whose joints are known: where its outline must be is drawn, where it is
//! seen is compared, and the pose that makes both agree is the answer.
//!
//! | module | owns |
//! |---|---|
//! | [`command`], [`answer`], [`overlay`] | what was asked, what is said, the picture with the outline |
//! | [`picture`], [`moment`], [`session`] | pictures, masks, differences, joints: from files and from clips |
//! | [`depth`] | the robot in a depth picture without one of the empty cell |
//! | [`frame`] | one picture with its joints, at three resolutions |
//! | [`silhouette`], [`photo`], [`pull`], `profile` | what a mask and what a photo without one say about the outline, and where an edge lies between pixels |
//! | [`shape`], [`outline`] | the robot's meshes, and their outline from a pose |
//! | [`scan`], [`refine`], [`fit`] | the fast way: look everywhere, least squares, keep the best |
//! | [`search`] | the paper's way: a particle swarm |
//! | [`start`], `kept` | a start where none is known, and what an interrupted search for one goes on from |
//! | [`board`], [`lattice`], [`dictionary`], [`planar`] | a start from a ChArUco board at a known place: what it looks like, its crossings, its markers, where it stands |
//! | [`interval`] | how sure the pose is |
//! | [`grid`], [`lens`], [`step`], `distance` | pictures of numbers, projection, moves of a camera |

pub mod answer;
pub mod board;
pub mod command;
pub mod depth;
pub mod dictionary;
mod distance;
pub mod fit;
pub mod frame;
pub mod grid;
pub mod interval;
mod kept;
pub mod lattice;
pub mod lens;
pub mod moment;
pub mod outline;
pub mod overlay;
pub mod photo;
pub mod picture;
pub mod planar;
mod profile;
pub mod pull;
pub mod refine;
pub mod scan;
pub mod search;
pub mod session;
pub mod shape;
pub mod silhouette;
pub mod start;
pub mod step;

#[cfg(test)]
pub mod test_board;
#[cfg(test)]
mod tests;
