//! CAN frames of a force/torque sensor, and the forces that come out of them.
#![no_main]

use libfuzzer_sys::fuzz_target;
use rt_bridge::wrench::netcan::{Calibration, Frame, Part, status_in_words};

fuzz_target!(|bytes: &[u8]| {
    let mut matrix = [[0.0; 6]; 6];
    let (mut counts, mut units, mut gauges) = ([1; 2], [2, 3], [0; 6]);
    for record in bytes.chunks(11) {
        let &[low, high, length, ref data @ ..] = record else { break };
        let id = u16::from_le_bytes([low, high]);
        let Some(frame) = Frame::new(id, &data[..data.len().min(usize::from(length))]) else { continue };
        let base = (frame.id() >> 4) as u8;
        let Some(part) = Part::of(&frame, base) else { continue };
        // NaN is not equal to itself: frames are compared instead.
        assert_eq!(Part::of(&part.frame(base), base).map(|again| again.frame(base)), Some(part.frame(base)));
        match part {
            Part::EvenGauges { status, gauges: [a, b, c] } => {
                (gauges[0], gauges[2], gauges[4]) = (a, b, c);
                assert_eq!(status_in_words(status).is_some(), status & 0x59FF != 0, "{status:#06x}");
            }
            Part::OddGauges([a, b, c]) => (gauges[1], gauges[3], gauges[5]) = (a, b, c),
            Part::Matrix { column, values } => {
                matrix[usize::from(length) % 6][column..column + 2].copy_from_slice(&values)
            }
            Part::Counts { force, torque } => counts = [force, torque],
            Part::Units { force, torque } => units = [force, torque],
        }
        if let Some(calibration) = Calibration::new(matrix, counts, units) {
            let wrench = calibration.wrench(&gauges);
            assert!(wrench.iter().flatten().all(|value| value.is_finite()), "{wrench:?}");
        }
    }
});
