//! The simulated cell's samples, as they come out of its ring.

use crate::device::{Device, DeviceFault};
use rtrb::Consumer;
use shared_mem::msg::wrench::Wrench;
use shared_mem::time::now_ns;
use std::thread;
use std::time::Duration;

/// How often the thread looks for samples.
const LOOK_EVERY: Duration = Duration::from_millis(1);

/// The receiving end of the simulated sensor.
#[derive(Debug)]
pub(super) struct SimWrench {
    samples: Consumer<Wrench>,
}

impl SimWrench {
    pub(super) fn new(samples: Consumer<Wrench>) -> Self {
        Self { samples }
    }
}

impl Device for SimWrench {
    type Sample = Wrench;
    type Order = ();

    fn round(&mut self, _order: Option<&()>) -> Result<Option<Wrench>, DeviceFault> {
        match self.samples.pop() {
            Ok(sample) => Ok(Some(Wrench { stamp_ns: now_ns(), ..sample })),
            Err(_) => {
                thread::sleep(LOOK_EVERY);
                Ok(None)
            }
        }
    }
}
