//! Where a camera is mounted: on the end effector (`EE_T_camera`), or beside the robot (`O_T_camera`) with the board in the arm's
//! hand. Pictures of a board and the arm's pose in each give it, as `A X = X B` does, and how sure it is.
//!
//! | module | owns |
//! |---|---|
//! | [`command`], [`answer`] | what was asked, what is said |
//! | [`input`] | pictures of the board with `O_T_EE`: of a list, of files beside pictures, of a session |
//! | [`chain`] | from camera to board over the arm, and how that moves with mount, board and an error of the arm |
//! | [`closed_form`] | `A X = X B` solved, and pictures that fit no other |
//! | [`view`] | one picture's corners, and the board by itself |
//! | [`variance`] | how wrong the arm's poses are |
//! | [`refine`] | all pixels at once |
//! | [`fit`] | all of it, pictures left out, intervals, what is left open |
//! | [`simulated`] | pictures of which the truth is known |

pub mod answer;
pub mod chain;
pub mod closed_form;
pub mod command;
pub mod fit;
pub mod input;
pub mod refine;
pub mod simulated;
pub mod variance;
pub mod view;

#[cfg(test)]
mod lens_tests;
#[cfg(test)]
mod tests;
