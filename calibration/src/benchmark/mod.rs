//! How good the diagnosis is: sealed simulated worlds, diagnosed and scored, beside the simple rules that people use.

pub mod draw;
pub mod score;
pub mod session;
pub mod world;
