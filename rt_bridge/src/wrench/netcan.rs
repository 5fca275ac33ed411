//! Frames of a force/torque sensor behind an ATI NETCANOEM board (ATI and Schunk six-axis sensors), and what they mean.
//! Total over frames, no I/O. The protocol is written down in `docs/devices.md`.
//!
//! The sensor sends the raw values of six strain gauges. Its own calibration matrix makes counts of force and torque of
//! them, its counts per unit make numbers, its unit codes make SI.

/// A classic CAN frame with an eleven-bit identifier.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Frame {
    id: u16,
    length: u8,
    data: [u8; 8],
}

/// What can be asked.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ask {
    /// One sample: [`Part::EvenGauges`] and [`Part::OddGauges`].
    Gauges,
    /// One row of the calibration matrix, 0 to 5 for Fx to Tz: three times [`Part::Matrix`].
    Row(u8),
    /// [`Part::Counts`].
    Counts,
    /// [`Part::Units`].
    Units,
}

/// What one frame says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Part {
    /// First half of a sample.
    EvenGauges {
        /// Bits of [`status_in_words`].
        status: u16,
        /// Gauges 0, 2, 4 [count].
        gauges: [i16; 3],
    },
    /// Second half of a sample: gauges 1, 3, 5 [count].
    OddGauges([i16; 3]),
    /// Two numbers of the row that was asked for last.
    Matrix {
        /// First of their columns: 0, 2 or 4.
        column: usize,
        values: [f32; 2],
    },
    /// Counts in one unit.
    Counts { force: u32, torque: u32 },
    Units {
        /// Code of the force's.
        force: u8,
        /// Code of the torque's.
        torque: u8,
    },
}

impl Frame {
    /// A frame; `None` for an identifier of more than eleven bits or more than eight bytes.
    pub fn new(id: u16, bytes: &[u8]) -> Option<Self> {
        let mut data = [0; 8];
        data.get_mut(..bytes.len())?.copy_from_slice(bytes);
        (id < 1 << 11).then_some(Self { id, length: bytes.len() as u8, data })
    }

    pub fn id(&self) -> u16 {
        self.id
    }

    pub fn bytes(&self) -> &[u8] {
        &self.data[..usize::from(self.length)]
    }
}

impl Ask {
    /// The frame that asks the sensor of the seven-bit identifier `base`.
    pub fn frame(self, base: u8) -> Frame {
        let (code, row) = match self {
            Self::Gauges => (0, None),
            Self::Row(row) => (2, Some(row)),
            Self::Counts => (7, None),
            Self::Units => (8, None),
        };
        let mut data = [0; 8];
        data[0] = row.unwrap_or(0);
        Frame { id: u16::from(base & 0x7F) << 4 | code, length: u8::from(row.is_some()), data }
    }

    /// Frames that answer it.
    pub fn answers(self) -> usize {
        match self {
            Self::Gauges => 2,
            Self::Row(_) => 3,
            Self::Counts | Self::Units => 1,
        }
    }
}

impl Part {
    /// What a frame of the sensor `base` says; `None` for frames of others, questions and what has the wrong length.
    pub fn of(frame: &Frame, base: u8) -> Option<Self> {
        if frame.id >> 4 != u16::from(base & 0x7F) {
            return None;
        }
        let d = &frame.data;
        let pair = |at: usize| u16::from_be_bytes([d[at], d[at + 1]]);
        let signed = |at: usize| pair(at).cast_signed();
        let four = |at: usize| [d[at], d[at + 1], d[at + 2], d[at + 3]];
        match (frame.id & 0xF, frame.length) {
            (0, 8) => Some(Self::EvenGauges { status: pair(0), gauges: [2, 4, 6].map(signed) }),
            (1, 6) => Some(Self::OddGauges([0, 2, 4].map(signed))),
            (code @ 2..=4, 8) => {
                let values = [0, 4].map(|at| f32::from_be_bytes(four(at)));
                Some(Self::Matrix { column: 2 * usize::from(code - 2), values })
            }
            (7, 8) => Some(Self::Counts { force: u32::from_be_bytes(four(0)), torque: u32::from_be_bytes(four(4)) }),
            (8, 2) => Some(Self::Units { force: d[0], torque: d[1] }),
            _ => None,
        }
    }

    /// The frame by which the sensor `base` says this: for sensors that are played.
    pub fn frame(&self, base: u8) -> Frame {
        let shorts = |values: &[i16; 3]| values.map(i16::to_be_bytes).concat();
        let (code, bytes) = match self {
            Self::EvenGauges { status, gauges } => (0, [&status.to_be_bytes()[..], &shorts(gauges)].concat()),
            Self::OddGauges(gauges) => (1, shorts(gauges)),
            Self::Matrix { column, values } => (2 + *column as u16 / 2, values.map(f32::to_be_bytes).concat()),
            Self::Counts { force, torque } => (7, [force.to_be_bytes(), torque.to_be_bytes()].concat()),
            Self::Units { force, torque } => (8, vec![*force, *torque]),
        };
        Frame::new(u16::from(base & 0x7F) << 4 | code & 0xF, &bytes).expect("eleven bits and eight bytes at most")
    }
}

/// How gauges become newtons and newton metres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Calibration {
    matrix: [[f64; 6]; 6],
    /// Factor of each row.
    scale: [f64; 6],
}

impl Calibration {
    /// From what the sensor tells about itself; `None` for units that are not known, no counts, or a matrix that holds
    /// something that is no number.
    pub fn new(matrix: [[f32; 6]; 6], counts: [u32; 2], units: [u8; 2]) -> Option<Self> {
        let finite = matrix.iter().flatten().all(|value| value.is_finite());
        if !finite || counts.contains(&0) {
            return None;
        }
        let force = newtons(units[0])? / f64::from(counts[0]);
        let torque = newton_metres(units[1])? / f64::from(counts[1]);
        let scale = [force, force, force, torque, torque, torque];
        Some(Self { matrix: matrix.map(|row| row.map(f64::from)), scale })
    }

    /// Force [N] and torque [N m] of a sample.
    pub fn wrench(&self, gauges: &[i16; 6]) -> [[f64; 3]; 2] {
        let value = |row: usize| {
            let counts: f64 = self.matrix[row].iter().zip(gauges).map(|(m, gauge)| m * f64::from(*gauge)).sum();
            counts * self.scale[row]
        };
        [[0, 1, 2].map(value), [3, 4, 5].map(value)]
    }
}

/// A unit of force in newtons.
fn newtons(code: u8) -> Option<f64> {
    Some(match code {
        1 => 4.448_221_615_260_5,
        2 => 1.0,
        3 => 4_448.221_615_260_5,
        4 => 1000.0,
        5 => 9.806_65,
        6 => 9.806_65e-3,
        _ => return None,
    })
}

/// A unit of torque in newton metres.
fn newton_metres(code: u8) -> Option<f64> {
    Some(match code {
        1 => 0.112_984_829_027_616_7,
        2 => 1.355_817_948_331_400_4,
        3 => 1.0,
        4 => 1e-3,
        5 => 9.806_65e-2,
        6 => 1000.0,
        _ => return None,
    })
}

/// What a sample's status complains about, the most serious first, with the remedy; `None` where all is well.
pub fn status_in_words(status: u16) -> Option<&'static str> {
    const WORDS: [(u16, &str); 12] = [
        (7, "cannot read its memory; have it repaired"),
        (8, "has no valid configuration; have it set up again by its maker's tool"),
        (6, "has no valid calibration; choose one by its maker's tool"),
        (4, "has too high a supply voltage; check its supply"),
        (5, "has too low a supply voltage; check its supply and its cable"),
        (1, "reads its gauges too high; check the cable between sensor and board, and whether it is overloaded"),
        (2, "reads its gauges too low; check the cable between sensor and board, and whether it is overloaded"),
        (3, "has no sound analogue ground; check the cable between sensor and board"),
        (11, "is too hot; let it cool"),
        (12, "is too cold; let it warm up"),
        (14, "saw errors on the bus; check bit rate and termination"),
        (0, "was restarted by its watchdog; check its supply"),
    ];
    WORDS.iter().find(|(bit, _)| status >> bit & 1 == 1).map(|(_, words)| *words)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn frames_have_the_identifiers_and_lengths_of_the_protocol() {
        let ask = Ask::Row(3).frame(0x20);
        assert_eq!((ask.id(), ask.bytes()), (0x202, &[3][..]));
        assert_eq!((Ask::Gauges.frame(0x20).id(), Ask::Gauges.frame(0x20).bytes()), (0x200, &[][..]));
        let first = Frame::new(0x200, &[0x80, 0x20, 0x00, 0x01, 0xFF, 0xFF, 0x7F, 0xFF]).expect("a frame");
        assert_eq!(Part::of(&first, 0x20), Some(Part::EvenGauges { status: 0x8020, gauges: [1, -1, 32767] }));
        let row = Frame::new(0x203, &[0x3F, 0x80, 0, 0, 0xC0, 0, 0, 0]).expect("a frame");
        assert_eq!(Part::of(&row, 0x20), Some(Part::Matrix { column: 2, values: [1.0, -2.0] }));
        assert_eq!(Part::of(&first, 0x21), None, "another sensor's");
        assert_eq!(Part::of(&Ask::Gauges.frame(0x20), 0x20), None, "a question");
    }

    #[test]
    fn gauges_become_newtons_by_matrix_counts_and_units() {
        let mut matrix = [[0.0; 6]; 6];
        (matrix[0][1], matrix[5][0], matrix[5][5]) = (2.0, 1.0, -1.0);
        let calibration = Calibration::new(matrix, [1000, 10_000], [2, 4]).expect("known units");
        let [force, torque] = calibration.wrench(&[300, 500, 0, 0, 0, 100]);
        assert_eq!((force, torque[0], torque[1]), ([1.0, 0.0, 0.0], 0.0, 0.0));
        assert!((torque[2] - 0.02e-3).abs() < 1e-12, "{torque:?}");
        assert_eq!(Calibration::new(matrix, [0, 1], [2, 3]), None);
        assert_eq!(Calibration::new(matrix, [1, 1], [2, 9]), None);
        matrix[0][0] = f32::NAN;
        assert_eq!(Calibration::new(matrix, [1, 1], [2, 3]), None);
    }

    #[test]
    fn the_gravest_complaint_is_told_first() {
        assert_eq!(status_in_words(0), None);
        assert!(status_in_words(0x8020).expect("low voltage").contains("too low a supply"));
        assert!(status_in_words(0xFFFF).expect("everything").contains("repaired"));
    }

    fn part() -> impl Strategy<Value = Part> {
        prop_oneof![
            (any::<u16>(), any::<[i16; 3]>()).prop_map(|(status, gauges)| Part::EvenGauges { status, gauges }),
            any::<[i16; 3]>().prop_map(Part::OddGauges),
            (0_usize..3, -1e9_f32..1e9, -1e-9_f32..1e-9)
                .prop_map(|(pair, a, b)| Part::Matrix { column: 2 * pair, values: [a, b] }),
            any::<[u32; 2]>().prop_map(|[force, torque]| Part::Counts { force, torque }),
            any::<[u8; 2]>().prop_map(|[force, torque]| Part::Units { force, torque }),
        ]
    }

    proptest! {
        #[test]
        fn what_a_sensor_says_is_understood_by_whom_it_is_said_to(part in part(), base in 0_u8..128, other in 0_u8..128) {
            let frame = part.frame(base);
            prop_assert_eq!(Part::of(&frame, base), Some(part));
            prop_assert_eq!(Part::of(&frame, other).is_some(), other == base);
        }

        #[test]
        fn any_frame_is_understood_or_passed_over(
            id in any::<u16>(), bytes in proptest::collection::vec(any::<u8>(), 0..12), base: u8, gauges: [i16; 6],
        ) {
            let frame = Frame::new(id, &bytes);
            prop_assert_eq!(frame.is_some(), id < 2048 && bytes.len() <= 8);
            let part = frame.and_then(|frame| Part::of(&frame, base));
            if let Some(Part::Counts { force, torque }) = part
                && let Some(calibration) = Calibration::new([[1.0; 6]; 6], [force, torque], [2, 3])
            {
                prop_assert!(calibration.wrench(&gauges).iter().flatten().all(|value| value.is_finite()));
            }
        }
    }
}
