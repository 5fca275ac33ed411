//! What a client may send to the served Franka Hand, in any pieces.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rt_bridge::serve::fuzzing;

fuzz_target!(
    init: fuzz::seeds(fuzzing::hand_seeds()),
    |bytes: &[u8]| fuzzing::hand(bytes)
);
