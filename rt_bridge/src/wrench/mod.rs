//! Force/torque sensors: one on a CAN bus, or the simulated cell's. Both speak [`Wrench`] on `/wrench`.
//!
//! | file | owns |
//! |---|---|
//! | [`netcan`] | frames of the sensor and what they mean; pure |
//! | [`poller`] | which frame to ask for, and patience; over any bus |
//! | `can` | a SocketCAN interface as a bus |
//! | `sim` | samples of the simulated cell |

mod can;
pub mod netcan;
pub mod poller;
mod sim;

use crate::device::{Device, DeviceFault, Lines, Service, ServiceError};
use crate::pump::Notice;
use rtrb::Consumer;
use shared_mem::cell::Cell;
use shared_mem::msg::wrench::Wrench;
use shared_mem::topics;
use shared_mem::transport::{Node, Publisher, TransportError};
use std::fmt;
use std::str::FromStr;
use std::sync::mpsc::Sender;

#[derive(Debug, Clone, PartialEq, Eq)]
pub enum WrenchChoice {
    /// The simulated cell's.
    Sim,
    /// One on this CAN interface.
    Can(String),
    /// What a recording holds of one.
    Replay,
    Off,
}

impl FromStr for WrenchChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.split_once("://") {
            None if text == "sim" => Ok(Self::Sim),
            None if text == "replay" => Ok(Self::Replay),
            None if text == "off" => Ok(Self::Off),
            // Longest name of a network interface: 15 bytes.
            Some(("can", name)) if (1..16).contains(&name.len()) && !name.contains(['/', ' ']) => {
                Ok(Self::Can(name.to_owned()))
            }
            _ => Err("use sim, can://INTERFACE (for example can://can0), replay or off".into()),
        }
    }
}

impl fmt::Display for WrenchChoice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sim => f.write_str("sim"),
            Self::Can(interface) => write!(f, "can://{interface}"),
            Self::Replay => f.write_str("replay"),
            Self::Off => f.write_str("off"),
        }
    }
}

/// Takes a sensor on a CAN interface into service.
///
/// # Errors
/// [`ServiceError`] when the interface cannot be opened or shared memory fails.
pub fn serve_can(interface: &str, cell: &Cell, notices: Sender<Notice>) -> Result<Service, ServiceError> {
    let (described, name) = (cell.wrench.unwrap_or_default(), interface.to_owned());
    let device = format!("the force sensor can://{interface}");
    let open = move || Ok(poller::Poller::new(can::CanPort::open(&name, described.can_id)?, described));
    Service::start("rt_bridge_wrench", device, open, WrenchLines::open, notices)
}

/// Publishes what the simulated cell's sensor measures.
///
/// # Errors
/// [`ServiceError`] when shared memory fails.
pub fn serve_simulated(samples: Consumer<Wrench>, notices: Sender<Notice>) -> Result<Service, ServiceError> {
    let mut samples = Some(sim::SimWrench::new(samples));
    let open = move || {
        let gone = || DeviceFault::Gone { device: "sim".into(), why: "the cell has ended".into() };
        samples.take().ok_or_else(gone)
    };
    Service::start("rt_bridge_wrench", "the force sensor sim".into(), open, WrenchLines::open, notices)
}

/// Opens the sensor on `interface` and waits for one sample: for a look at it without a run.
///
/// # Errors
/// [`DeviceFault`] when there is none to be had.
pub fn probe(interface: &str, cell: &Cell) -> Result<Wrench, DeviceFault> {
    let described = cell.wrench.unwrap_or_default();
    let mut sensor = poller::Poller::new(can::CanPort::open(interface, described.can_id)?, described);
    loop {
        if let Some(sample) = sensor.round(None)? {
            return Ok(sample);
        }
    }
}

/// The topic of a force sensor.
struct WrenchLines {
    wrench: Publisher<Wrench>,
}

impl WrenchLines {
    fn open(node: &Node) -> Result<Self, TransportError> {
        Ok(Self { wrench: node.publisher(topics::WRENCH)? })
    }
}

impl<D: Device<Sample = Wrench, Order = ()>> Lines<D> for WrenchLines {
    fn order(&mut self) -> Result<Option<()>, TransportError> {
        Ok(None)
    }

    fn publish(&mut self, sample: &Wrench) -> Result<(), TransportError> {
        self.wrench.send(sample)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sensor_is_named_by_its_interface() {
        for text in ["sim", "replay", "off", "can://can0", "can://vcan0"] {
            assert_eq!(text.parse::<WrenchChoice>().expect("a sensor").to_string(), text);
        }
        for wrong in ["", "can0", "can://", "can:///dev/can0", "can://a-name-that-is-too-long", "serial:///dev/ttyUSB0"]
        {
            assert!(wrong.parse::<WrenchChoice>().is_err(), "{wrong}");
        }
    }
}
