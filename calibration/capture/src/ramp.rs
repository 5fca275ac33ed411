//! Ramps: triangles to and fro at constant speeds that grow geometrically from level to level, with rounded reversals. What
//! friction does at creep, and what is lost at each reversal, shows here. Pure; rad, s.
//!
//! Between constant speeds the speed follows a quintic, so that acceleration and jerk are continuous and analytic.

use super::jet::{Jet, quintic, swept};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;

/// Most levels of speed, evenly spaced in their logarithm: four to a power of ten over two powers.
const MAX_LEVELS: usize = 9;
/// A level takes about so long where the whole allows it [s].
const LEVEL_TIME: f64 = 4.0;
/// Shortest duration that holds a few levels [s].
pub const MIN_DURATION: f64 = 12.0;
/// Rest between levels, so that each begins by breaking loose [s].
const REST_TIME: f64 = 0.2;
/// A reversal takes this long [s], or as long as it has to at ...
const MIN_REVERSAL_TIME: f64 = 0.3;
/// ... this acceleration [rad/s²].
const REVERSAL_ACCELERATION: f64 = 6.0;
/// Peak slope of the quintic.
const QUINTIC_PEAK_SPEED: f64 = 1.875;
/// How much further a reversal leads, as a share of speed times its duration: `1/2 - 2 swept(1/2)`.
const REVERSAL_OVERSHOOT: f64 = 0.343_75;

/// Triangles of one speed after the other.
#[derive(Debug, Clone, PartialEq)]
pub struct Ramp {
    pieces: Vec<Piece>,
    /// Direction of each joint's first way, 1 or -1.
    directions: Vec<f64>,
    duration: f64,
}

/// From one speed to another along a quintic.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    begin: f64,
    duration: f64,
    from: f64,
    speeds: [f64; 2],
}

impl Ramp {
    /// Triangles at the speeds from the lower to the higher of `speeds` [rad/s] in about `duration` [s], each as wide as its
    /// speed reaches and no wider than `amplitude` [rad] to either side; `seed` draws each joint's direction.
    pub fn draw(speeds: [f64; 2], amplitude: f64, duration: f64, dof: usize, seed: u64) -> Self {
        let mut rng = Pcg64Mcg::seed_from_u64(seed);
        let directions = (0..dof).map(|_| if rng.random_bool(0.5) { 1.0 } else { -1.0 }).collect();
        let levels = ((duration / LEVEL_TIME) as usize).clamp(3, MAX_LEVELS);
        let each = duration / levels as f64 - REST_TIME;
        let mut course = Course::default();
        course.turn(0.0, REST_TIME);
        for level in 0..levels {
            let share = level as f64 / (levels - 1) as f64;
            let speed = speeds[0] * (speeds[1] / speeds[0]).powf(share);
            course.triangles(speed.min(fastest(amplitude)), amplitude, each);
            course.turn(0.0, REST_TIME);
        }
        Self { duration: course.time, pieces: course.pieces, directions }
    }

    /// Length [s].
    pub fn duration(&self) -> f64 {
        self.duration
    }

    /// Excursion of `joint` at `t` [s] and its derivatives [rad].
    pub fn at(&self, joint: usize, t: f64) -> Jet {
        let piece = self.pieces[self.pieces.partition_point(|piece| piece.begin <= t).saturating_sub(1)];
        piece.at(t).map(|x| self.directions[joint] * x)
    }
}

/// How long a reversal at this speed takes [s].
fn reversal(speed: f64) -> f64 {
    MIN_REVERSAL_TIME.max(2.0 * QUINTIC_PEAK_SPEED * speed / REVERSAL_ACCELERATION)
}

/// The highest speed that a triangle of so small an amplitude reaches before it has to turn: a little cruise is left [rad/s].
fn fastest(amplitude: f64) -> f64 {
    let at_shortest = amplitude / MIN_REVERSAL_TIME;
    let accelerated = (amplitude * REVERSAL_ACCELERATION / (2.0 * QUINTIC_PEAK_SPEED)).sqrt();
    at_shortest.min(accelerated)
}

impl Piece {
    fn at(&self, t: f64) -> Jet {
        let since = (t - self.begin).clamp(0.0, self.duration);
        let [v0, v1] = self.speeds;
        let u = since / self.duration;
        let [share, rate, bend, _] = quintic(u, 1.0 / self.duration);
        let change = v1 - v0;
        [self.from + v0 * since + change * self.duration * swept(u), v0 + change * share, change * rate, change * bend]
    }
}

/// Pieces one after the other.
#[derive(Debug, Default)]
struct Course {
    pieces: Vec<Piece>,
    time: f64,
    place: f64,
    speed: f64,
}

impl Course {
    /// To another speed in so much time.
    fn turn(&mut self, speed: f64, duration: f64) {
        let piece = Piece { begin: self.time, duration, from: self.place, speeds: [self.speed, speed] };
        self.pieces.push(piece);
        self.time += duration;
        self.place += 0.5 * (self.speed + speed) * duration;
        self.speed = speed;
    }

    /// On at the speed there is, up to a place.
    fn cruise(&mut self, to: f64) {
        let duration = (to - self.place) / self.speed;
        if duration > 0.0 {
            self.turn(self.speed, duration);
            self.place = to;
        }
    }

    /// As many triangles at one speed as fit into `time`, one at least, from rest to rest at 0.
    fn triangles(&mut self, speed: f64, amplitude: f64, time: f64) {
        let bend = reversal(speed);
        let reach = amplitude.min(speed * (0.25 * time).max(bend));
        let count = (time * speed / (4.0 * reach)) as usize;
        let edge = reach - REVERSAL_OVERSHOOT * speed * bend;
        self.turn(speed, bend);
        for _ in 0..count.max(1) {
            self.cruise(edge);
            self.turn(-speed, bend);
            self.cruise(-edge);
            self.turn(speed, bend);
        }
        self.cruise(-0.5 * speed * bend);
        self.turn(0.0, bend);
        // What is left of rounding; the way back to 0 is exact.
        self.place = 0.0;
    }
}

#[cfg(test)]
mod tests {
    use super::super::jet::tests::assert_derivatives;
    use super::*;

    #[test]
    fn its_derivatives_are_those_of_its_value() {
        let ramp = Ramp::draw([0.01, 0.5], 0.25, 12.0, 2, 4);
        assert_derivatives(|t| ramp.at(0, t), (1..390).map(|i| 0.03 * f64::from(i) + 0.0037));
    }

    #[test]
    fn it_runs_to_and_fro_at_each_speed_from_creep_on_and_ends_where_it_began() {
        let ramp = Ramp::draw([0.005, 0.5], 0.25, 40.0, 1, 0);
        let samples: Vec<Jet> = (0..=(ramp.duration() * 1e3) as u32).map(|i| ramp.at(0, f64::from(i) * 1e-3)).collect();
        let widest = samples.iter().map(|x| x[0].abs()).fold(0.0, f64::max);
        assert!((widest - 0.25).abs() < 1e-3, "{widest}");
        for (lo, hi) in [(0.0049, 0.0051), (0.049, 0.051), (0.499, 0.501)] {
            for sign in [1.0, -1.0] {
                let steady = samples.iter().filter(|x| (lo..hi).contains(&(sign * x[1])) && x[2] == 0.0).count();
                assert!(steady > 500, "{steady} ms at {lo} rad/s");
            }
        }
        let reversals = samples.windows(2).filter(|w| w[0][1] * w[1][1] < 0.0).count();
        assert!(reversals >= 18, "{reversals}");
        let last = samples[samples.len() - 1];
        assert!(last[..3].iter().all(|x| x.abs() < 1e-9), "{last:?}");
        assert!((30.0..50.0).contains(&ramp.duration()), "{} s", ramp.duration());
    }

    #[test]
    fn no_reversal_leads_beyond_the_amplitude_however_small() {
        for amplitude in [0.02, 0.1, 1.0] {
            let ramp = Ramp::draw([0.005, 2.0], amplitude, 30.0, 1, 7);
            let times = 0..(ramp.duration() * 1e3) as u32;
            let jets = times.map(|i| ramp.at(0, f64::from(i) * 1e-3));
            let widest = jets.map(|x| x[0].abs()).fold(0.0, f64::max);
            assert!(widest < amplitude + 1e-9, "{widest} of {amplitude}");
        }
    }
}
