//! The way to the robot, and other devices that are plugged in.

use super::Finding;
use std::fs;
use std::net::{TcpStream, ToSocketAddrs as _};
use std::time::{Duration, Instant};

/// The robot's command port.
const COMMAND_PORT: u16 = 1337;
/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(2);
/// Connections that are timed.
const TRIES: u32 = 5;
/// A round trip that leaves the control loop its share of the millisecond.
const GOOD: Duration = Duration::from_micros(400);

/// Opens and closes the robot's command port a few times, without a word.
pub(super) fn robot(host: &str) -> Finding {
    let with_port = if host.contains(':') { host.to_owned() } else { format!("{host}:{COMMAND_PORT}") };
    let address = match with_port.to_socket_addrs().map(|mut found| found.next()) {
        Ok(Some(address)) => address,
        _ => return Finding::problem("robot", format!("{host} is no address"), "give the robot's IP address"),
    };
    let mut worst = Duration::ZERO;
    for _ in 0..TRIES {
        let begin = Instant::now();
        if let Err(e) = TcpStream::connect_timeout(&address, PATIENCE) {
            return Finding::problem(
                "robot",
                format!("{address} does not answer ({e})"),
                "check the cable and this machine's address in the robot's network, and activate FCI in its web page",
            );
        }
        worst = worst.max(begin.elapsed());
    }
    let found = format!("{address} answers within {} us (worst of {TRIES})", worst.as_micros());
    if worst <= GOOD {
        return Finding::ok("robot", found);
    }
    let remedy = "connect it directly, without switch or Wi-Fi: state, computing and command share one millisecond";
    Finding::warning("robot", found, remedy)
}

/// Cameras, serial ports and CAN interfaces.
pub(super) fn devices() -> Finding {
    let named = |folder: &str, starts: &[&str]| -> Vec<String> {
        let entries = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
        let names = entries.map(|e| e.file_name().to_string_lossy().into_owned());
        names.filter(|name| starts.iter().any(|start| name.starts_with(start))).collect()
    };
    let mut found = named("/dev", &["video", "ttyUSB", "ttyACM"]);
    found.extend(named("/sys/class/net", &["can", "vcan"]));
    found.sort();
    Finding::ok("devices", if found.is_empty() { "no camera, serial port or CAN".into() } else { found.join(", ") })
}
