//! The verbs of the program `twin`, one file each: arguments and what is printed, nothing that simulates.

#[cfg(feature = "reconstruct")]
mod articulated;
#[cfg(feature = "reconstruct")]
mod asset_folder;
pub(crate) mod label_splats;
pub(crate) mod look;
#[cfg(feature = "reconstruct")]
pub(crate) mod reconstruct;
pub(crate) mod render;
pub(crate) mod replay;
pub(crate) mod shadow;
pub(crate) mod task;
#[cfg(feature = "teleop")]
pub(crate) mod teleop;

use anyhow::Context as _;
use shared_mem::console;

/// For verbs that do not stop by themselves at Ctrl-C: ends the program, without leaving unfinished files. Those that are
/// finished stay.
fn discard_on_signal() -> anyhow::Result<()> {
    let end = || {
        shared_mem::output::discard_unfinished();
        console::line("twin: interrupted; files that were finished stay");
        console::flush();
        std::process::exit(1);
    };
    ctrlc::set_handler(end).context("cannot listen for Ctrl-C")
}
