//! The program `rt_bridge`: arguments in, exit code out. Everything else is in the library.

use std::process::ExitCode;

fn main() -> ExitCode {
    rt_bridge::cli::main()
}
