//! Robotiq 2F-85 and 2F-140 over Modbus RTU.
//!
//! | file | owns |
//! |---|---|
//! | [`modbus`] | bytes of requests and replies; pure |
//! | [`registers`] | what the gripper's registers mean; pure |
//! | `orders` | which registers to write next for an order; pure |
//! | `port` | the serial port and its patience |

pub mod modbus;
mod orders;
mod port;
pub mod registers;

pub use port::Robotiq;
