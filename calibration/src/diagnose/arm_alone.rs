//! Clips with an object as if only the arm had been recorded. What the joints' own channels tell about an effect in the
//! joints needs no object, and simulating the arm up to the touch takes a tenth of the time of a whole stroke.

use super::evidence::{Channel, Evidence, Reach, Row};
use super::fit::Bench;
use super::scatter::Scatter;
use crate::estimate::{ClipModel, Impossible};

/// The same clips, rows and channels; residuals of the object are zero, and clips have no numbers of their own.
pub struct ArmAlone<'a, E>(pub &'a E);

impl<E: Evidence> ArmAlone<'_, E> {
    /// A bench for these.
    pub fn bench<'b>(&'b self, whole: &Bench<'b, E>) -> Bench<'b, Self> {
        Bench { evidence: self, library: whole.library, scatter: Scatter::default(), interrupt: whole.interrupt }
    }
}

impl<E: Evidence> ClipModel for ArmAlone<'_, E> {
    fn clips(&self) -> usize {
        self.0.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let nothing = vec![0.0; self.rows(clip).len()];
        self.0.changed(clip, (shared, own), (Reach::Arm, &nothing), out)
    }
}

impl<E: Evidence> Evidence for ArmAlone<'_, E> {
    fn changed(
        &self,
        clip: usize,
        numbers: (&[f64], &[f64]),
        (reach, base): (Reach, &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        match reach {
            Reach::Object => {
                out.clear();
                out.extend_from_slice(base);
                Ok(())
            }
            Reach::All | Reach::Arm => self.0.changed(clip, numbers, (Reach::Arm, base), out),
        }
    }

    fn channels(&self) -> &[Channel] {
        self.0.channels()
    }

    fn rows(&self, clip: usize) -> &[Row] {
        self.0.rows(clip)
    }

    fn scatter(&self) -> Scatter {
        Scatter::default()
    }
}

#[cfg(test)]
mod tests {
    use super::super::fit::Effort;
    use super::super::sweep::Precision;
    use super::super::test_bench::{on_strokes, shipped};
    use super::*;
    use crate::benchmark::world::{Fault, Kind, World};

    #[test]
    fn the_object_is_silent_and_fits_turn_what_they_may() {
        let cell = shipped();
        let world = World::draw(3, Kind::Strokes, Fault::Nothing, &cell);
        on_strokes((&cell, &world), |whole, even| {
            let (evidence, library, alone) = (whole.evidence, whole.library, ArmAlone(whole.evidence));
            let (mut all, mut some) = (Vec::new(), Vec::new());
            evidence.residuals(0, &library.start(), &[], &mut all).expect("a stroke");
            alone.residuals(0, &library.start(), &[], &mut some).expect("a stroke");
            let of_joint = |row: &Row| evidence.channels()[row.channel].joint.is_some();
            for ((row, all), some) in evidence.rows(0).iter().zip(&all).zip(&some) {
                assert_eq!(*some, if of_joint(row) { *all } else { 0.0 });
            }

            let step = Effort::of(2, Precision::Joints);
            let moved = |numbers: Vec<f64>| -> Vec<usize> {
                let of_baseline = library.baseline.clone();
                of_baseline.filter(|k| numbers[*k] != library.unknowns[*k].start).collect()
            };
            let (gains, of_object): (Vec<usize>, Vec<usize>) =
                library.baseline.clone().partition(|k| library.joints[*k].is_some());
            let fit = alone.bench(whole).fit((&[], library.start()), &[0, 1], even, None, step).expect("a fit");
            assert_eq!(moved(fit.full), gains, "joints' channels tell the gains, and nothing of the object");
            let effort = Effort { holds_joints: true, ..step };
            let fit = whole.fit((&[], library.start()), &[0, 1], even, None, effort).expect("a fit");
            let moved = moved(fit.full);
            assert!(!moved.is_empty() && moved.iter().all(|k| of_object.contains(k)), "{moved:?} of {of_object:?}");
        });
    }
}
