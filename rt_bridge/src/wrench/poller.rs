//! Asks the sensor who it is, then for sample after sample. Works over any [`Bus`], so that it is tested without one.

use super::netcan::{Ask, Calibration, Frame, Part, status_in_words};
use crate::device::{Device, DeviceFault};
use shared_mem::cell::WrenchSensor;
use shared_mem::msg::wrench::Wrench;
use shared_mem::time::now_ns;
use std::thread;
use std::time::{Duration, Instant};

/// How long the answer to one question may take.
const PATIENCE: Duration = Duration::from_millis(50);
/// Questions that may go unanswered in a row.
const TRIES: u32 = 5;

/// A way to send and receive frames.
pub trait Bus {
    /// What the user called it.
    fn device(&self) -> String;

    /// Sends a frame.
    ///
    /// # Errors
    /// [`DeviceFault`] when the bus cannot be used any more.
    fn send(&mut self, frame: &Frame) -> Result<(), DeviceFault>;

    /// The next frame and when the kernel received it [ns of wall-clock time]; `None` when none comes within `patience`.
    ///
    /// # Errors
    /// [`DeviceFault`] when the bus cannot be used any more.
    fn receive(&mut self, patience: Duration) -> Result<Option<(Frame, u64)>, DeviceFault>;
}

/// A sensor on a bus.
#[derive(Debug)]
pub struct Poller<B> {
    bus: B,
    described: WrenchSensor,
    setup: Setup,
    calibration: Option<Calibration>,
    status: u16,
    sequence: u64,
    unanswered: u32,
    /// When the next sample is due.
    due: Instant,
}

/// What the sensor has reported about itself so far.
#[derive(Debug, Default)]
struct Setup {
    rows: Vec<[f32; 6]>,
    counts: Option<[u32; 2]>,
    units: Option<[u8; 2]>,
}

/// The answer to one question, frame by frame.
#[derive(Debug, Default)]
struct Answer {
    gauges: [i16; 6],
    status: u16,
    row: [f32; 6],
    counts: [u32; 2],
    units: [u8; 2],
    received_ns: u64,
    /// Bit i: part i has come.
    parts: u8,
}

impl<B: Bus> Poller<B> {
    /// The sensor of cell.toml's `[wrench]` on `bus`.
    pub fn new(bus: B, described: WrenchSensor) -> Self {
        Self {
            bus,
            described,
            setup: Setup::default(),
            calibration: None,
            status: 0,
            sequence: 0,
            unanswered: 0,
            due: Instant::now(),
        }
    }

    /// Asks, and collects the answer's parts; `None` when they do not come.
    fn ask(&mut self, ask: Ask) -> Result<Option<Answer>, DeviceFault> {
        self.bus.send(&ask.frame(self.described.can_id))?;
        let (asked, mut answer) = (Instant::now(), Answer::default());
        loop {
            let left = PATIENCE.saturating_sub(asked.elapsed());
            let Some((frame, received_ns)) = self.bus.receive(left)? else {
                self.unanswered += 1;
                if self.unanswered < TRIES {
                    return Ok(None);
                }
                self.unanswered = 0;
                let (device, check) = (self.bus.device(), "its power, its base identifier and the bit rate");
                return Err(DeviceFault::Silent { device, check });
            };
            if let Some(part) = Part::of(&frame, self.described.can_id) {
                answer.take(ask, &part, received_ns);
            }
            if answer.parts.count_ones() as usize == ask.answers() {
                self.unanswered = 0;
                return Ok(Some(answer));
            }
        }
    }

    /// Asks for the next thing that is not known about the sensor yet.
    fn learn(&mut self) -> Result<(), DeviceFault> {
        let row = self.setup.rows.len() as u8;
        let ask = match (&self.setup.counts, row) {
            (_, 0..=5) => Ask::Row(row),
            (None, _) => Ask::Counts,
            (Some(_), _) => Ask::Units,
        };
        let Some(answer) = self.ask(ask)? else { return Ok(()) };
        match ask {
            Ask::Row(_) => self.setup.rows.push(answer.row),
            Ask::Counts => self.setup.counts = Some(answer.counts),
            _ => self.setup.units = Some(answer.units),
        }
        let Setup { rows, counts: Some(counts), units: Some(units) } = &self.setup else { return Ok(()) };
        let matrix = std::array::from_fn(|i| rows[i]);
        let calibration = Calibration::new(matrix, *counts, *units);
        self.calibration = Some(calibration.ok_or_else(|| DeviceFault::Garbled {
            device: self.bus.device(),
            why: format!("counts {counts:?}, units {units:?}"),
            check: "that a calibration is chosen in the sensor",
        })?);
        self.due = Instant::now();
        Ok(())
    }

    fn sample(&mut self, answer: &Answer, calibration: &Calibration) -> Wrench {
        self.status = answer.status;
        self.sequence += 1;
        let [force, torque] = calibration.wrench(&answer.gauges);
        let over = |value: f64, range: f64| value.abs() >= range;
        let mut saturated = 0;
        for axis in 0..3 {
            saturated |= u32::from(over(force[axis], self.described.force_range)) << axis;
            saturated |= u32::from(over(torque[axis], self.described.torque_range)) << (3 + axis);
        }
        // Every channel is made of all gauges: one at its end spoils them all.
        if answer.gauges.iter().any(|gauge| [i16::MIN, i16::MAX].contains(gauge)) {
            saturated = 0b11_1111;
        }
        Wrench {
            stamp_ns: now_ns(),
            device_ns: answer.received_ns,
            sequence: self.sequence,
            force,
            torque,
            saturated,
            reserved: 0,
        }
    }
}

impl Answer {
    /// Takes a part that belongs to the question.
    fn take(&mut self, ask: Ask, part: &Part, received_ns: u64) {
        match (ask, *part) {
            (Ask::Gauges, Part::EvenGauges { status, gauges: [a, b, c] }) => {
                (self.status, self.received_ns) = (status, received_ns);
                (self.gauges[0], self.gauges[2], self.gauges[4]) = (a, b, c);
                self.parts |= 1;
            }
            (Ask::Gauges, Part::OddGauges([a, b, c])) => {
                (self.gauges[1], self.gauges[3], self.gauges[5]) = (a, b, c);
                self.parts |= 2;
            }
            (Ask::Row(_), Part::Matrix { column, values }) => {
                self.row[column..column + 2].copy_from_slice(&values);
                self.parts |= 1 << (column / 2);
            }
            (Ask::Counts, Part::Counts { force, torque }) => (self.counts, self.parts) = ([force, torque], 1),
            (Ask::Units, Part::Units { force, torque }) => (self.units, self.parts) = ([force, torque], 1),
            _ => {}
        }
    }
}

impl<B: Bus> Device for Poller<B> {
    type Sample = Wrench;
    type Order = ();

    fn round(&mut self, _order: Option<&()>) -> Result<Option<Wrench>, DeviceFault> {
        let Some(calibration) = self.calibration else {
            self.learn()?;
            return Ok(None);
        };
        thread::sleep(self.due.saturating_duration_since(Instant::now()));
        // A sample that is late is left out: no burst.
        let period = Duration::from_secs_f64(1.0 / self.described.rate);
        self.due = (self.due + period).max(Instant::now());
        let answer = self.ask(Ask::Gauges)?;
        Ok(answer.map(|answer| self.sample(&answer, &calibration)))
    }

    fn complaint(&self) -> Option<String> {
        status_in_words(self.status).map(str::to_owned)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::VecDeque;

    const BASE: u8 = 0x20;

    /// A sensor that answers at once, or as `mood` says.
    struct Played {
        answers: VecDeque<Frame>,
        mood: Mood,
        asked: u32,
    }

    #[derive(Clone, Copy, PartialEq)]
    enum Mood {
        Well,
        /// Every third question is lost.
        Forgetful,
        Silent,
        BusOff,
        Overloaded,
        Uncalibrated,
    }

    impl Bus for Played {
        fn device(&self) -> String {
            "can://played".into()
        }

        fn send(&mut self, frame: &Frame) -> Result<(), DeviceFault> {
            self.asked += 1;
            if self.mood == Mood::Silent || self.mood == Mood::Forgetful && self.asked.is_multiple_of(3) {
                return Ok(());
            }
            let parts = match (frame.id() & 0xF, frame.bytes()) {
                (2, [row]) => {
                    let value = |column| f32::from(u8::from(column == usize::from(*row)));
                    // Out of order, and with somebody else's frame in between.
                    [2, 0, 4].map(|c| Part::Matrix { column: c, values: [value(c), value(c + 1)] }).to_vec()
                }
                (7, []) => {
                    vec![Part::Counts { force: if self.mood == Mood::Uncalibrated { 0 } else { 100 }, torque: 1000 }]
                }
                (8, []) => vec![Part::Units { force: 2, torque: 3 }],
                (0, []) => {
                    let high = if self.mood == Mood::Overloaded { i16::MAX } else { 300 };
                    let status = if self.mood == Mood::Overloaded { 0x8002 } else { 0 };
                    vec![Part::EvenGauges { status, gauges: [100, high, -50] }, Part::OddGauges([200, 400, 600])]
                }
                _ => vec![],
            };
            self.answers.push_back(Part::OddGauges([9; 3]).frame(BASE + 1));
            self.answers.extend(parts.iter().map(|part| part.frame(BASE)));
            Ok(())
        }

        fn receive(&mut self, _patience: Duration) -> Result<Option<(Frame, u64)>, DeviceFault> {
            if self.mood == Mood::BusOff {
                return Err(DeviceFault::BusOff { device: self.device(), interface: "can0".into() });
            }
            Ok(self.answers.pop_front().map(|frame| (frame, 77)))
        }
    }

    fn poller(mood: Mood) -> Poller<Played> {
        let described = WrenchSensor { can_id: BASE, rate: 1000.0, torque_range: 0.55, ..WrenchSensor::default() };
        Poller::new(Played { answers: VecDeque::new(), mood, asked: 0 }, described)
    }

    fn first(poller: &mut Poller<Played>) -> Result<Wrench, DeviceFault> {
        for _ in 0..40 {
            if let Some(sample) = poller.round(None)? {
                return Ok(sample);
            }
        }
        panic!("neither a sample nor a fault");
    }

    #[test]
    fn it_learns_what_the_sensor_is_and_then_measures() {
        for mood in [Mood::Well, Mood::Forgetful] {
            let mut poller = poller(mood);
            let sample = first(&mut poller).expect("a sample");
            assert_eq!((sample.force, sample.torque), ([1.0, 2.0, 3.0], [0.4, -0.05, 0.6]));
            assert_eq!((sample.sequence, sample.device_ns, sample.saturated), (1, 77, 0b10_0000));
            assert_eq!(first(&mut poller).expect("another").sequence, 2);
            assert_eq!(poller.complaint(), None);
        }
    }

    #[test]
    fn silence_a_bus_that_is_off_and_a_sensor_without_calibration_are_told_apart() {
        let silent = first(&mut poller(Mood::Silent)).expect_err("nobody answers").to_string();
        assert!(silent.contains("does not answer; check its power") && !silent.contains('\n'), "{silent}");
        let off = first(&mut poller(Mood::BusOff)).expect_err("the bus is off").to_string();
        assert!(off.contains("bus is off") && off.contains("ip link set can0 up"), "{off}");
        let bare = first(&mut poller(Mood::Uncalibrated)).expect_err("no calibration").to_string();
        assert!(bare.contains("calibration is chosen"), "{bare}");
    }

    #[test]
    fn an_overloaded_sensor_spoils_every_channel_and_says_so() {
        let mut poller = poller(Mood::Overloaded);
        assert_eq!(first(&mut poller).expect("a sample").saturated, 0b11_1111);
        assert!(poller.complaint().expect("a complaint").contains("overloaded"));
    }
}
