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
