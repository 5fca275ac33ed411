//! Where cameras are, out of pictures: of a board of known size, and of the robot itself.
//!
//! | module | owns |
//! |---|---|
//! | [`hand_eye`] | where a camera is mounted on an arm or beside it, from pictures of a board |
//! | [`viewpoint`] | the camera's pose from pictures of the robot |

pub mod hand_eye;
pub mod viewpoint;
