//! A SocketCAN interface as a bus: frames with the kernel's receive stamps, and the controller's own errors.

use super::netcan::Frame;
use super::poller::Bus;
use crate::device::DeviceFault;
use socketcan::{
    CanDataFrame, CanError, CanFilter, CanFrame, CanSocket, EmbeddedFrame as _, Frame as _, ShouldRetry as _,
    Socket as _, SocketOptions as _, StandardId,
};
use std::io;
use std::time::{Duration, Instant, UNIX_EPOCH};

/// Mask of the seven bits by which a sensor is known.
const BASE_MASK: u32 = 0x7F0;
/// Shortest wait that the kernel knows.
const SHORTEST_WAIT: Duration = Duration::from_micros(100);

/// An open interface that hears one sensor.
#[derive(Debug)]
pub(super) struct CanPort {
    socket: CanSocket,
    interface: String,
}

impl CanPort {
    /// Opens `interface` for the sensor of the seven-bit identifier `base`.
    pub(super) fn open(interface: &str, base: u8) -> Result<Self, DeviceFault> {
        let open = || -> io::Result<CanSocket> {
            let socket = CanSocket::open(interface)?;
            socket.set_filters(&[CanFilter::new(u32::from(base & 0x7F) << 4, BASE_MASK)])?;
            socket.set_error_filter_accept_all()?;
            socket.set_recv_timestamp(true)?;
            Ok(socket)
        };
        let socket = open().map_err(|e| DeviceFault::NotOpened {
            device: format!("can://{interface}"),
            why: e.to_string().to_lowercase(),
            remedy: remedy(interface),
        })?;
        Ok(Self { socket, interface: interface.to_owned() })
    }

    fn gone(&self, error: &io::Error) -> DeviceFault {
        if error.raw_os_error() == Some(libc::ENETDOWN) {
            let interface = &self.interface;
            let (device, why) = (self.device(), "the interface is down".into());
            return DeviceFault::NotOpened { device, why, remedy: bring_up(interface) };
        }
        DeviceFault::Gone { device: self.device(), why: error.to_string().to_lowercase() }
    }
}

impl Bus for CanPort {
    fn device(&self) -> String {
        format!("can://{}", self.interface)
    }

    fn send(&mut self, frame: &Frame) -> Result<(), DeviceFault> {
        let id = StandardId::new(frame.id()).expect("eleven bits");
        let frame = CanDataFrame::new(id, frame.bytes()).expect("eight bytes at most");
        match self.socket.write_frame(&frame) {
            Ok(()) => Ok(()),
            // Nobody acknowledges and the queue is full: the silence will be reported.
            Err(e) if e.should_retry() || e.raw_os_error() == Some(libc::ENOBUFS) => Ok(()),
            Err(e) => Err(self.gone(&e)),
        }
    }

    fn receive(&mut self, patience: Duration) -> Result<Option<(Frame, u64)>, DeviceFault> {
        let begin = Instant::now();
        loop {
            let left = patience.saturating_sub(begin.elapsed());
            if left.is_zero() {
                return Ok(None);
            }
            self.socket.set_read_timeout(left.max(SHORTEST_WAIT)).map_err(|e| self.gone(&e))?;
            let (frame, received) = match self.socket.read_frame_with_timestamp() {
                Ok(read) => read,
                Err(e) if e.should_retry() || e.kind() == io::ErrorKind::Interrupted => continue,
                Err(e) => return Err(self.gone(&e)),
            };
            match frame {
                CanFrame::Data(data) if data.is_standard() => {
                    let id = u16::try_from(data.raw_id()).unwrap_or(u16::MAX);
                    let since = received.duration_since(UNIX_EPOCH).unwrap_or_default();
                    if let Some(frame) = Frame::new(id, data.data()) {
                        return Ok(Some((frame, since.as_nanos() as u64)));
                    }
                }
                CanFrame::Error(error) if CanError::from(error).is_bus_off() => {
                    return Err(DeviceFault::BusOff { device: self.device(), interface: self.interface.clone() });
                }
                _ => {}
            }
        }
    }
}

/// What to do about an interface that cannot be opened.
fn remedy(interface: &str) -> String {
    if std::path::Path::new("/sys/class/net").join(interface).exists() {
        return bring_up(interface);
    }
    "plug the adapter in, load its driver, and see `ip -brief link` for its name".into()
}

fn bring_up(interface: &str) -> String {
    format!("bring it up with `ip link set {interface} up type can bitrate 1000000`")
}

#[cfg(test)]
mod tests {
    use super::super::netcan::{Ask, Part};
    use super::super::poller::Poller;
    use super::*;
    use crate::device::Device as _;
    use shared_mem::cell::WrenchSensor;

    #[test]
    fn an_interface_that_is_not_there_is_refused_with_what_to_do() {
        let error = CanPort::open("nosuchcan", 0x20).expect_err("no such interface").to_string();
        assert!(error.contains("can://nosuchcan cannot be opened") && error.contains("ip -brief link"), "{error}");
    }

    /// `ip link add dev vcan0 type vcan && ip link set vcan0 up` makes the interface this test wants.
    #[test]
    fn a_sensor_on_a_virtual_bus_is_asked_and_heard() {
        let base = 0x21;
        let Ok(port) = CanPort::open("vcan0", base) else {
            eprintln!("skipped: there is no interface vcan0 here");
            return;
        };
        let stop = std::sync::atomic::AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| play_a_sensor(base, &stop));
            let mut poller = Poller::new(port, WrenchSensor { can_id: base, ..WrenchSensor::default() });
            let sample = loop {
                match poller.round(None) {
                    Ok(Some(sample)) => break sample,
                    // The other end may not listen yet.
                    Ok(None) | Err(DeviceFault::Silent { .. }) => {}
                    Err(other) => panic!("{other}"),
                }
            };
            stop.store(true, std::sync::atomic::Ordering::Relaxed);
            assert_eq!((sample.force, sample.torque), ([1.0; 3], [0.1; 3]));
            assert!(sample.device_ns > 0, "the kernel stamps what it receives");
        });
    }

    /// All gauges at 100, the identity as matrix, 100 counts a newton, 1000 a newton metre.
    fn play_a_sensor(base: u8, stop: &std::sync::atomic::AtomicBool) {
        let mut port = CanPort::open("vcan0", base).expect("it was there");
        while !stop.load(std::sync::atomic::Ordering::Relaxed) {
            let Ok(Some((asked, _))) = port.receive(Duration::from_millis(20)) else { continue };
            let of = |column: usize| f32::from(u8::from(asked.bytes() == [column as u8]));
            let parts = match asked {
                frame if frame == Ask::Gauges.frame(base) => {
                    vec![Part::EvenGauges { status: 0, gauges: [100; 3] }, Part::OddGauges([100; 3])]
                }
                frame if frame == Ask::Counts.frame(base) => vec![Part::Counts { force: 100, torque: 1000 }],
                frame if frame == Ask::Units.frame(base) => vec![Part::Units { force: 2, torque: 3 }],
                _ => [0, 2, 4].map(|c| Part::Matrix { column: c, values: [of(c), of(c + 1)] }).to_vec(),
            };
            for part in parts {
                port.send(&part.frame(base)).expect("the bus is up");
            }
        }
    }
}
