//! Hardware to shared memory: the 1 kHz loop, its safety, and the devices behind traits.

pub mod arm;
pub mod fr3;
pub mod rt;
pub mod safety;
