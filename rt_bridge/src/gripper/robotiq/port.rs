//! The serial port of a Robotiq: one question at a time, a few tries, then a fault.

use super::modbus::{InvalidReply, Reply, Request};
use super::orders::Orders;
use super::registers::{COUNT, INPUT, OUTPUT, Status, fault_in_words};
use crate::device::{Device, DeviceFault};
use crate::gripper::PERIOD;
use serialport::{ClearBuffer, SerialPort};
use shared_mem::cell::Gripper;
use shared_mem::msg::gripper::{GripperCommand, GripperState};
use shared_mem::time::now_ns;
use std::io::{ErrorKind, Read as _, Write as _};
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

/// Speed as shipped [bit/s]; 8 data bits, no parity, one stop bit.
const BAUD: u32 = 115_200;
/// Station as shipped.
const STATION: u8 = 9;
/// How long an answer may take: thirty times what it takes on the line, for adapters that collect bytes.
const PATIENCE: Duration = Duration::from_millis(100);
/// Questions that may go without a good answer.
const TRIES: u32 = 3;
/// What a person is asked to check when answers come damaged.
const WIRING: &str = "the shield, the ground wire and that A and B are not swapped";

/// A Robotiq 2F at a serial port.
pub struct Robotiq {
    device: String,
    port: Box<dyn SerialPort>,
    orders: Orders,
    fault: u8,
    patience: Duration,
}

impl Robotiq {
    /// Opens the port at `path`. Whether a gripper is there shows in the first round.
    ///
    /// # Errors
    /// [`DeviceFault::NotOpened`] with the remedy.
    pub fn open(path: &Path, gripper: &Gripper) -> Result<Self, DeviceFault> {
        let device = format!("serial://{}", path.display());
        let opened = serialport::new(path.to_string_lossy(), BAUD).timeout(PATIENCE).open();
        let port = opened.map_err(|e| DeviceFault::NotOpened {
            device: device.clone(),
            why: e.description.to_lowercase(),
            remedy: remedy(path),
        })?;
        Ok(Self::on(port, device, gripper, PATIENCE))
    }

    /// On a port that is open; `device` is its name for people, `patience` how long an answer may take.
    pub fn on(port: Box<dyn SerialPort>, device: String, gripper: &Gripper, patience: Duration) -> Self {
        Self { device, port, orders: Orders::new(gripper), fault: 0, patience }
    }

    /// Asks until an answer is good, a few times.
    fn ask(&mut self, request: &Request) -> Result<Reply, DeviceFault> {
        let mut garbage = None;
        for _ in 0..TRIES {
            match self.try_once(request).map_err(|why| self.gone(&why))? {
                Ok(Some(reply)) => return Ok(reply),
                Ok(None) => {}
                Err(bad) => garbage = Some(bad),
            }
        }
        Err(match garbage {
            None => DeviceFault::Silent { device: self.device.clone(), check: "its 24 V supply and the cable" },
            Some(bad) => DeviceFault::Garbled { device: self.device.clone(), why: bad.to_string(), check: WIRING },
        })
    }

    /// The outer error is the port's, the inner one the answer's; `None`: silence.
    fn try_once(&mut self, request: &Request) -> std::io::Result<Result<Option<Reply>, InvalidReply>> {
        // What still lies there belongs to an older question.
        self.port.clear(ClearBuffer::Input)?;
        self.port.write_all(&request.encode(STATION))?;
        let (asked, mut bytes, mut piece) = (Instant::now(), Vec::with_capacity(64), [0; 64]);
        loop {
            let left = self.patience.saturating_sub(asked.elapsed());
            if left.is_zero() {
                let cut_off = !bytes.is_empty();
                return Ok(if cut_off { Err(InvalidReply::Size) } else { Ok(None) });
            }
            self.port.set_timeout(left)?;
            match self.port.read(&mut piece) {
                Ok(0) => return Err(ErrorKind::UnexpectedEof.into()),
                Ok(length) => bytes.extend_from_slice(&piece[..length]),
                Err(e) if matches!(e.kind(), ErrorKind::TimedOut | ErrorKind::Interrupted) => continue,
                Err(e) => return Err(e),
            }
            match request.answer(STATION, &bytes) {
                Ok(None) => {}
                whole => return Ok(whole),
            }
        }
    }

    fn gone(&self, why: &std::io::Error) -> DeviceFault {
        DeviceFault::Gone { device: self.device.clone(), why: why.to_string().to_lowercase() }
    }

    /// What the gripper reports now.
    fn status(&mut self) -> Result<Status, DeviceFault> {
        match self.ask(&Request::Read { address: INPUT, count: COUNT })? {
            Reply::Registers(values) => {
                Ok(Status::from_registers(std::array::from_fn(|i| values.get(i).copied().unwrap_or(0))))
            }
            other => Err(self.refused(&other)),
        }
    }

    fn refused(&self, reply: &Reply) -> DeviceFault {
        let why = match reply {
            Reply::Refused(code) => format!("it refuses its own registers, code {code}"),
            _ => "it answers another question".into(),
        };
        DeviceFault::Garbled { device: self.device.clone(), why, check: "that a Robotiq 2F is at this port" }
    }
}

impl Device for Robotiq {
    type Sample = GripperState;
    type Order = GripperCommand;

    fn round(&mut self, order: Option<&GripperCommand>) -> Result<Option<GripperState>, DeviceFault> {
        if let Some(order) = order {
            self.orders.take(order);
        }
        let status = self.status()?;
        self.fault = status.fault;
        let state = self.orders.state(&status, now_ns());
        if let Some(action) = self.orders.next(&status) {
            let write = Request::Write { address: OUTPUT, values: action.registers().to_vec() };
            match self.ask(&write)? {
                Reply::Written => {}
                other => return Err(self.refused(&other)),
            }
        }
        thread::sleep(PERIOD);
        Ok(Some(state))
    }

    fn complaint(&self) -> Option<String> {
        fault_in_words(self.fault).map(str::to_owned)
    }
}

/// What to do about a port that cannot be opened.
fn remedy(path: &Path) -> String {
    if !path.exists() {
        return "plug the adapter in and see `ls /dev/serial/by-id` for its name".into();
    }
    match rustix::fs::access(path, rustix::fs::Access::READ_OK | rustix::fs::Access::WRITE_OK) {
        Ok(()) => "close the program that uses it".into(),
        Err(_) => "add yourself to the group `dialout` and log in again".into(),
    }
}
