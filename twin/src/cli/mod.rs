//! The verbs of the program `twin`, one file each: arguments and what is printed, nothing that simulates.

pub(crate) mod label_splats;
pub(crate) mod look;
pub(crate) mod render;
pub(crate) mod replay;
pub(crate) mod shadow;
