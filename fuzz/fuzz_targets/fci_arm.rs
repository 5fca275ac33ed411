//! What a client may send to the served arm: requests over TCP in any pieces, set points as datagrams, milliseconds between.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rt_bridge::serve::fuzzing;

fuzz_target!(
    init: fuzz::seeds(fuzzing::arm_seeds()),
    |bytes: &[u8]| {
        let _motions = fuzzing::arm(bytes);
    }
);
