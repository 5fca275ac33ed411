//! A motion of the arm that an advice asks for: as arguments of `calibration capture excitation`, and in words for arms that no
//! bridge drives.

use super::request::Kind;

/// Clips of one kind of motion, in which the arm moves alone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmMotion {
    pub kind: Kind,
    /// How many clips.
    pub clips: usize,
    /// Largest excursion [rad], where it is another than usual.
    pub amplitude: Option<f64>,
    /// How many times as fast as usual.
    pub speed: f64,
}

impl ArmMotion {
    /// Clips as usual.
    pub const fn of(kind: Kind, clips: usize) -> Self {
        Self { kind, clips, amplitude: None, speed: 1.0 }
    }

    /// Arguments that record it.
    pub fn arguments(&self) -> String {
        let kind = match self.kind {
            Kind::Multisine => String::new(),
            Kind::Chirp { frequency: [lo, hi] } => format!(" --motion chirp --frequency {lo} {hi}"),
            Kind::Ramp { speeds: [lo, hi] } => format!(" --motion ramp --ramp-speeds {lo} {hi}"),
            Kind::Hold { poses } => format!(" --motion hold --poses {poses}"),
        };
        let amplitude = self.amplitude.map_or_else(String::new, |rad| format!(" --amplitude {rad}"));
        let speed = if self.speed == 1.0 { String::new() } else { format!(" --speed {}", self.speed) };
        format!("--clips {}{kind}{amplitude}{speed}", self.clips)
    }

    /// The motion of one clip in words.
    pub fn in_words(&self) -> String {
        let (seconds, amplitude) = self.kind.usual();
        let (seconds, amplitude) = (seconds / self.speed, self.amplitude.unwrap_or(amplitude));
        let kind = match self.kind {
            Kind::Multisine => "sums of sines, 0.2 to 1.6 Hz".to_owned(),
            other => other.to_string(),
        };
        let pace = if self.speed == 1.0 { String::new() } else { format!(" at {} times the speed", self.speed) };
        format!("{kind}, all joints at once by up to {amplitude} rad around where the clips begin, {seconds} s{pace}")
    }
}
