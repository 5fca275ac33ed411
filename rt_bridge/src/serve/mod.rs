//! `rt_bridge serve`: the simulated cell as a Franka robot that speaks FCI version 10, so that anybody's libfranka program
//! can be tried against honest dynamics.
//!
//! ```text
//! client --requests, TCP 1337-----> session --> robot: settings, motion, reflexes --drive--> body: the twin's physics
//!        --set points, UDP--------/    ^          |                                             |
//!        <--states, UDP, 1 kHz--------/           \<-- watch: limits, contact, collision <-- sensors, observer
//! client --requests, TCP 1338-----> hand
//! ```
//!
//! | file | owns |
//! |---|---|
//! | [`server`] | the ports, who is served, the robot's millisecond: free-running or in lock-step with its client |
//! | `connection` | bytes of a connection as they arrive, and why it ends |
//! | `arrivals` | connections before their first request |
//! | `session` | one client: its sockets, the handshake, what it is sent and when |
//! | `notices` | lines on standard error, and how many there may be |
//! | `framing` | from a stream of bytes to messages |
//! | `wire` | from messages to requests and set points |
//! | `robot` | modes, requests and their statuses, the robot's cycle |
//! | `settings` | what setters change, and which arguments a robot takes |
//! | `motion` | a running motion: set points, torques, its end |
//! | `generator` | joint and Cartesian set points, their limits, inverse kinematics |
//! | `losses` | commands that did not come: the success rate, the twenty in a row |
//! | `hold` | the arm's own set points while nobody commands it |
//! | `impedance` | the Cartesian impedance controller; the joint one is the twin's |
//! | `body` | the simulated arm and its sensors |
//! | `observer` | external torque and wrench, contact and collision |
//! | `self_collision` | whether the arm is about to run into itself |
//! | `watch` | what the robot objects to in what it measures |
//! | `faults` | by which names it objects |
//! | `state` | the datagram with all of it |
//! | `kinematics` | frames on the flange |
//! | `hand` | the Franka Hand |
//! | `fuzzing` | what a client can send, for the fuzz targets and tests alone |
//!
//! Everything but `server`, `connection`, `arrivals`, `session`, `notices` and the hand's service is without sockets and clocks, and deterministic.
//!
//! Sources: libfranka's documentation and its protocol headers (Apache-2.0), by way of `franka-rs`'s wire structs.

mod arrivals;
mod body;
mod connection;
mod faults;
mod framing;
#[cfg(any(test, fuzzing))]
pub mod fuzzing;
mod generator;
mod hand;
mod hold;
mod impedance;
mod kinematics;
mod losses;
mod motion;
mod notices;
mod observer;
mod robot;
mod self_collision;
pub mod server;
mod session;
mod settings;
mod state;
mod watch;
mod wire;

pub use robot::Tally;
pub use server::{Pace, Ports, Report, Server};

use std::net::SocketAddr;
use twin::sim::SimError;

/// The cell cannot be served.
#[derive(Debug, thiserror::Error)]
pub enum ServeError {
    /// Another arm, or none.
    #[error("only an FR3 speaks the Franka Control Interface; give cell.toml a [robot] block with `model = \"fr3\"`")]
    NotAnFr3,
    /// A servo, or nothing known.
    #[error(
        "the FR3's own controller is compliant; give cell.toml a [controller] block with `kind = \"joint_impedance\"`"
    )]
    NotCompliant,
    /// The cell cannot be simulated.
    #[error(transparent)]
    Sim(#[from] SimError),
    /// Somebody else listens there.
    #[error(
        "port {} of {} is taken, perhaps by another `rt_bridge serve`; end that, or choose another with `{flag}` (0: any that is free)",
        address.port(),
        address.ip()
    )]
    PortTaken {
        address: SocketAddr,
        /// The argument that chooses it.
        flag: &'static str,
    },
    /// The system does not let us listen there.
    #[error("cannot listen on {address} ({source}); give `--bind` an address of this machine, for example 127.0.0.1")]
    Bind {
        address: SocketAddr,
        /// The system's reason.
        source: std::io::Error,
    },
}
