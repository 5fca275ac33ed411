//! The messages that cross process borders. One file a device; each has a plain form ([`Message::Wire`]) for shared memory
//! that is `repr(C)`, holds numbers only and is versioned by its `type_name`: a change of layout changes the name, so old
//! and new programs refuse each other instead of misreading. What comes out of shared memory is checked before it is a
//! message again.

pub mod arm;
pub mod check;
pub mod event;
pub mod gripper;
pub mod image;
pub mod motion;
pub mod object;
pub mod origin;
pub mod target;
pub mod twin;
pub mod wire;
pub mod wrench;

pub use check::Wrong;
pub use wire::Message;

/// Most joints of an arm that fit into a message. Arrays are this long; `dof` says how many entries count, the others are 0.
pub const MAX_JOINTS: usize = 8;

/// One number per joint, of which the first `dof` count.
pub type Joints = [f64; MAX_JOINTS];

/// Copies a slice into a [`Joints`] array; what does not fit is left out, what is missing is 0.
pub fn joints_from(values: &[f64]) -> Joints {
    let mut out = [0.0; MAX_JOINTS];
    for (o, v) in out.iter_mut().zip(values) {
        *o = *v;
    }
    out
}
