//! What the programs answer, refuse and write.

mod check;
mod commands;
mod help;
mod init;
mod last_week;
mod sweep;
