//! Whether stamps of a log say when its rows were taken, or jitter about an even clock: the motion between the rows decides.
//!
//! Stamps `t_i = line(i) + d_i`; were rows taken at `line(i)`, positions are smooth row by row, and were they taken at `t_i`, third
//! differences of the positions follow those of the stamps: `D3 q = share dq D3 t` with a share of 0 or of 1.

use super::noise;
use shared_mem::recording::{Clip, JointSeries};
use shared_mem::statistics::usual_step_ns;

/// Stamps that jitter less leave no residual that an encoder of an arm shows [s]: 1 rad/s makes of it its least noise.
const NOT_SEEN: f64 = 1e-6;
/// Deviations of which more neighbours than this say the same are a clock that wanders, or steps of its resolution [1]: a choice.
const WHITE_WITHIN: f64 = 2.0;
/// A share is known when it lies so many standard errors from one half [1]: a choice, beyond chance.
const SURE_SIGMAS: f64 = 3.0;
/// So many rows tell whether deviations are white [1]: a choice.
const ROWS_THAT_TELL: usize = 2000;
/// Third differences overlap: three neighbours in a row say part of the same, and the standard error grows by about this [1].
const OVERLAP: f64 = 2.0;

/// Stamps beside an even clock.
struct Clock {
    /// The first stamp [ns].
    first_ns: u64,
    /// Where an even clock puts each row, since the first stamp [ns].
    even_ns: Vec<f64>,
    /// How far each stamp is from there [s].
    off: Vec<f64>,
}

impl Clock {
    /// `None` of fewer rows than third differences need, or of rows that no even clock counts.
    fn of(stamps_ns: &[u64]) -> Option<Self> {
        let usual = usual_step_ns(stamps_ns).filter(|usual| *usual > 0 && stamps_ns.len() > 8)?;
        // Rows may have been lost, as a step of about two says, or late by as much.
        let lost = stamps_ns.windows(2).scan(0, |count, pair| {
            *count += ((pair[1].saturating_sub(pair[0]) + usual / 2) / usual).max(1);
            Some(*count as f64)
        });
        let lost: Vec<f64> = std::iter::once(0.0).chain(lost).collect();
        let none: Vec<f64> = (0..stamps_ns.len()).map(|row| row as f64).collect();
        let both = [none, lost].map(|counts| Self::counted(stamps_ns, &counts)).into_iter().flatten();
        let within = |clock: &Self| clock.off.iter().all(|off| off.abs() < usual as f64 * 1e-9);
        both.filter(within).min_by(|a, b| a.jitter().total_cmp(&b.jitter()))
    }

    /// The even clock whose periods are so many at each row that comes nearest to the stamps.
    fn counted(stamps_ns: &[u64], counts: &[f64]) -> Option<Self> {
        let first_ns = *stamps_ns.first()?;
        let times: Vec<f64> = stamps_ns.iter().map(|stamp| stamp.saturating_sub(first_ns) as f64).collect();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let (middle, at) = (mean(counts), mean(&times));
        let along: f64 = counts.iter().map(|count| (count - middle).powi(2)).sum();
        let slope = counts.iter().zip(&times).map(|(count, time)| (count - middle) * (time - at)).sum::<f64>() / along;
        let going = |period: f64| {
            let even_ns: Vec<f64> = counts.iter().map(|count| at + period * (count - middle)).collect();
            let off = times.iter().zip(&even_ns).map(|(time, even)| (time - even) * 1e-9).collect();
            Self { first_ns, even_ns, off }
        };
        let (fitted, whole) = (going(slope), (slope * 1e-3).round() * 1e3);
        // Periods are whole microseconds, and torques belong to periods: a clock that may go by those does.
        let sure = SURE_SIGMAS * fitted.jitter() * 1e9 / along.sqrt();
        Some(if (slope - whole).abs() <= sure { going(whole) } else { fitted })
    }

    /// Whether a deviation says nothing of the next ones.
    fn is_white(&self) -> bool {
        noise::correlation_length(&self.off[..self.off.len().min(ROWS_THAT_TELL)]) <= WHITE_WITHIN
    }

    /// One sigma of the deviations [s].
    fn jitter(&self) -> f64 {
        (self.off.iter().map(|off| off * off).sum::<f64>() / self.off.len() as f64).sqrt()
    }

    /// Which share of the deviations positions followed, and its standard error.
    fn followed(&self, log: &JointSeries) -> Option<(f64, f64)> {
        let third =
            |of: &dyn Fn(usize) -> f64, row: usize| of(row + 3) - 3.0 * of(row + 2) + 3.0 * of(row + 1) - of(row);
        let (mut squares, mut both, mut rows) = (0.0, 0.0, Vec::new());
        for joint in 0..log.dof {
            for row in 0..log.len() - 3 {
                let q = |row: usize| log.q[row * log.dof + joint];
                let speed = (q(row + 3) - q(row)) / ((self.even_ns[row + 3] - self.even_ns[row]) * 1e-9);
                let pair = (speed * third(&|row| self.off[row], row), third(&q, row));
                squares += pair.0 * pair.0;
                both += pair.0 * pair.1;
                rows.push(pair);
            }
        }
        let share = both / squares;
        let left = rows.iter().map(|(moved, seen)| (seen - share * moved).powi(2)).sum::<f64>() / rows.len() as f64;
        share.is_finite().then(|| (share, OVERLAP * (left / squares).sqrt()))
    }

    fn even(&self) -> Vec<u64> {
        let first = self.even_ns[0].round();
        let begins = self.first_ns.saturating_add_signed(first as i64);
        self.even_ns.iter().map(|even| begins + (even - self.even_ns[0]).round() as u64).collect()
    }
}

/// Puts rows that an even clock took where it did, measured and commanded, and says so.
pub(super) fn evened(clip: &mut Clip) -> Option<String> {
    let clock = Clock::of(&clip.measured.stamps_ns).filter(|clock| clock.jitter() > NOT_SEEN)?;
    let (share, sigma) = clock.followed(&clip.measured)?;
    if share + SURE_SIGMAS * sigma > 0.5 || !clock.is_white() {
        return None;
    }
    clip.measured.stamps_ns = clock.even();
    if let Some(commands) = Clock::of(&clip.desired.stamps_ns).filter(Clock::is_white) {
        clip.desired.stamps_ns = commands.even();
    }
    // Without its number, so that clips of one kind share a line.
    Some("its stamps jitter while its positions go on evenly: rows are taken as those of an even clock".into())
}

/// How uncertain the time of a row remains, one sigma [s]: what stamps deviate from an even clock and positions do not follow.
pub(super) fn jitter(measured: &JointSeries) -> f64 {
    let Some(clock) = Clock::of(&measured.stamps_ns).filter(|clock| clock.jitter() > NOT_SEEN) else { return 0.0 };
    let Some((share, sigma)) = clock.followed(measured) else { return 0.0 };
    let left = clock.jitter() * (1.0 - share).min(1.0);
    if (1.0 - share) > SURE_SIGMAS * sigma && left > NOT_SEEN { left } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt as _, SeedableRng as _};
    use shared_mem::cell::ClipKind;
    use shared_mem::origin::Origins;
    use shared_mem::recording::ObjectSeries;

    /// Stamps of this century have more digits than a floating-point number [ns].
    const TODAY_NS: u64 = 1_760_000_000_000_000_000;

    /// Two joints that swing, and their commands; rows are taken at stamps that deviate by up to `off` [s] or, where `even`, at even times.
    fn clip(off: f64, even: bool) -> Clip {
        let mut random = rand_pcg::Pcg64::seed_from_u64(5);
        let mut draw = |most: f64| if most > 0.0 { random.random_range(-most..most) } else { 0.0 };
        let (mut stamps_ns, mut q) = (Vec::new(), Vec::new());
        for row in 0..3000 {
            let (clock, by) = (1.0 + f64::from(row) * 1e-3, draw(off));
            stamps_ns.push(TODAY_NS + ((clock + by) * 1e9) as u64);
            let t = if even { clock } else { clock + by };
            q.extend([0.3 * (5.0 * t).sin(), 0.2 * (8.0 * t).cos()].map(|q| q + draw(7e-6)));
        }
        let measured = JointSeries { dof: 2, stamps_ns, q, ..JointSeries::default() };
        Clip {
            file: "clip.mcap".into(),
            kind: ClipKind::Excitation,
            joint_names: Vec::new(),
            desired: measured.clone(),
            measured,
            torques_end_at_rows: false,
            object: ObjectSeries::default(),
            others: Vec::new(),
            origins: Origins::default(),
            warnings: Vec::new(),
            damage: None,
        }
    }

    #[test]
    fn rows_of_an_even_clock_are_put_where_it_took_them() {
        for off in [15e-6, 430e-6] {
            let mut clip = clip(off, true);
            assert!((jitter(&clip.measured) / off * 3.0_f64.sqrt() - 1.0).abs() < 0.1, "{}", jitter(&clip.measured));
            assert!(evened(&mut clip).is_some_and(|said| said.contains("jitter")));
            let worst = (0..3000)
                .map(|row| clip.measured.stamps_ns[row].abs_diff(TODAY_NS + 1_000_000_000 + row as u64 * 1_000_000));
            assert!(worst.max().is_some_and(|worst| (worst as f64) < 0.1 * off * 1e9));
            assert_eq!(clip.desired.stamps_ns, clip.measured.stamps_ns);
            assert_eq!(jitter(&clip.measured), 0.0);
            // Torques belong to control periods: rows lie on their grid to the nanosecond.
            assert!(clip.measured.stamps_ns.windows(2).all(|pair| pair[1] - pair[0] == 1_000_000));
        }
    }

    #[test]
    fn stamps_that_the_motion_follows_are_left_as_they_are() {
        for off in [0.0, 15e-6, 200e-6] {
            let mut clip = clip(off, false);
            let before = clip.measured.stamps_ns.clone();
            assert_eq!((evened(&mut clip), jitter(&clip.measured)), (None, 0.0));
            assert_eq!(clip.measured.stamps_ns, before);
        }
    }

    #[test]
    fn a_clock_of_coarse_steps_is_not_evened_but_leaves_rows_uncertain() {
        let mut clip = clip(0.0, true);
        // Steps of 0.33 ms beat slowly with those of the log.
        clip.measured.stamps_ns.iter_mut().for_each(|stamp| *stamp = *stamp / 330_000 * 330_000);
        assert_eq!(evened(&mut clip), None);
        assert!((jitter(&clip.measured) / 330e-6 * 12.0_f64.sqrt() - 1.0).abs() < 0.3, "{}", jitter(&clip.measured));
    }
}
