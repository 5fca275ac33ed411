//! Strokes that another program simulates, looked at around one point: its residuals there, and what the twin changes of them from
//! there on.
//!
//! ```text
//! residuals(numbers) = engine(point) + twin(numbers) - twin(point)
//! ```
//!
//! So a search over forty effects asks for one roll-out of each stroke. It is output space mapping with the twin as the coarse model
//! (Bandler et al. 2004, "Space mapping: the state of the art"): right at the point, to first order around it, and off by what the two
//! models differ by in what a number changes. What is chosen is fitted to the engine's own roll-outs afterwards.

use super::bench::Bench;
use inference::engine::Engine;
use inference::estimate::{ClipModel, Impossible};
use inference::likelihood::arm::following::Moment;
use inference::likelihood::random_effects::{RandomEffects, WithOwn};
use inference::likelihood::recent::Recent;
use inference::likelihood::{Channel, Evidence, Group, Likelihood, Near, Reach, Row};
use std::sync::Arc;

/// Clips around a point where another program simulates strokes; elsewhere the clips as they are.
pub(in crate::diagnose) struct Anchored<'a> {
    whole: &'a Evidence<'a>,
    around: Option<Around>,
}

struct Around {
    /// Shared numbers; clips' own are at rest there.
    point: Vec<f64>,
    nothing: Vec<f64>,
    /// Residuals there, clip by clip.
    there: Vec<Recent<Vec<f64>, Vec<f64>>>,
    /// What separates kept work from that around other points.
    label: String,
}

impl<'a> Anchored<'a> {
    pub(in crate::diagnose) fn new(whole: &'a Evidence<'a>, point: &[f64]) -> Self {
        Self { whole, around: whole.engine().map(|_| Around::new(whole, point)) }
    }

    /// A bench for these.
    pub(in crate::diagnose) fn bench<'b>(&'b self, whole: &Bench<'b>) -> Bench<'b> {
        whole.seen_as(self, self.around.as_ref().map_or(whole.trail.1, |around| &around.label))
    }
}

impl Around {
    fn new(whole: &Evidence<'_>, point: &[f64]) -> Self {
        Self {
            point: point.to_vec(),
            nothing: vec![0.0; whole.scatter().count()],
            there: (0..whole.clips()).map(|_| Recent::default()).collect(),
            label: format!("around {point:?}"),
        }
    }

    fn there(&self, whole: &Evidence<'_>, clip: usize) -> Result<Arc<Vec<f64>>, Impossible> {
        self.there[clip].at(self.point.clone(), || {
            let mut residuals = Vec::new();
            whole.residuals(clip, &self.point, &self.nothing, &mut residuals)?;
            Ok(residuals)
        })
    }

    fn at(&self) -> Option<(&[f64], &[f64])> {
        Some((&self.point, &self.nothing))
    }
}

impl ClipModel for Anchored<'_> {
    fn clips(&self) -> usize {
        self.whole.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        let Some(around) = &self.around else { return self.whole.residuals(clip, shared, own, out) };
        let there = around.there(self.whole, clip)?;
        self.whole.changed(clip, (shared, own), (Reach::All, &there, around.at()), out)
    }
}

impl Likelihood for Anchored<'_> {
    type Own = WithOwn;

    fn changed(
        &self,
        clip: usize,
        numbers: (&[f64], &[f64]),
        (reach, base, at): Near<'_>,
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        let Some(around) = self.around.as_ref().filter(|_| at.is_none()) else {
            return self.whole.changed(clip, numbers, (reach, base, at), out);
        };
        let there = around.there(self.whole, clip)?;
        self.whole.changed(clip, numbers, (reach, &there, around.at()), out)?;
        for ((out, base), row) in out.iter_mut().zip(base).zip(self.rows(clip)) {
            let of_arm = self.channels()[row.channel].group == Group::Arm;
            if (reach == Reach::Arm && !of_arm) || (reach == Reach::Object && of_arm) {
                *out = *base;
            }
        }
        Ok(())
    }

    fn engine(&self) -> Option<&Arc<Engine>> {
        self.whole.engine()
    }

    fn following(&self, clip: usize) -> Vec<Moment> {
        self.whole.following(clip)
    }

    fn in_halves(&self, clip: usize, shared: &[f64]) -> Option<Vec<f64>> {
        self.whole.in_halves(clip, shared)
    }

    fn torque_sigma(&self) -> Option<&[f64]> {
        self.whole.torque_sigma()
    }

    fn channels(&self) -> &[Channel] {
        self.whole.channels()
    }

    fn rows(&self, clip: usize) -> &[Row] {
        self.whole.rows(clip)
    }

    fn scatter(&self) -> RandomEffects {
        self.whole.scatter()
    }

    fn has_object(&self) -> bool {
        self.whole.has_object()
    }

    fn own_slope(&self, clip: usize, own: usize) -> Option<&[f64]> {
        self.whole.own_slope(clip, own)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use inference::likelihood::StageName;
    use std::sync::atomic::{AtomicUsize, Ordering};

    /// A row of the arm and one of the object; the engine's residuals bend, the twin's are straight.
    struct Bent {
        asked: AtomicUsize,
        channels: [Channel; 2],
        rows: [Row; 2],
    }

    impl Bent {
        fn new() -> Self {
            let channel = |group| Channel { quantity: "q", place: "joint1".into(), joint: None, group };
            let row = |channel| Row { channel, stage: StageName::Slide, regime: "free", time: 0.0 };
            let channels = [channel(Group::Arm), channel(Group::Object)];
            Self { asked: AtomicUsize::new(0), channels, rows: [row(0), row(1)] }
        }
    }

    const TWINS: [f64; 2] = [2.0, -3.0];

    impl ClipModel for Bent {
        fn clips(&self) -> usize {
            1
        }

        fn residuals(&self, _: usize, shared: &[f64], _: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
            self.asked.fetch_add(1, Ordering::Relaxed);
            *out = TWINS.map(|slope| slope * shared[0] + shared[0].powi(2)).to_vec();
            Ok(())
        }
    }

    impl Likelihood for Bent {
        type Own = WithOwn;

        fn changed(
            &self,
            _: usize,
            (shared, _): (&[f64], &[f64]),
            (reach, base, at): Near<'_>,
            out: &mut Vec<f64>,
        ) -> Result<(), Impossible> {
            let (at, _) = at.expect("a point");
            *out = base.to_vec();
            let felt = |row: usize| reach == Reach::All || (row == 0) == (reach == Reach::Arm);
            (0..2).filter(|row| felt(*row)).for_each(|row| out[row] += TWINS[row] * (shared[0] - at[0]));
            Ok(())
        }

        fn channels(&self) -> &[Channel] {
            &self.channels
        }

        fn rows(&self, _: usize) -> &[Row] {
            &self.rows
        }

        fn scatter(&self) -> RandomEffects {
            RandomEffects::default()
        }
    }

    #[test]
    fn an_engine_is_asked_once_and_the_twin_says_what_changes_from_there_on() {
        let whole = Bent::new();
        let around = Anchored { whole: &whole, around: Some(Around::new(&whole, &[1.0])) };
        let mut out = Vec::new();
        around.residuals(0, &[1.0], &[], &mut out).expect("residuals");
        assert_eq!(out, [3.0, -2.0]);
        around.residuals(0, &[1.5], &[], &mut out).expect("residuals");
        assert_eq!(out, [4.0, -3.5]);
        // Of the arm alone the other rows are those that are given.
        around.changed(0, (&[1.5], &[]), (Reach::Arm, &[0.0, 7.0], None), &mut out).expect("residuals");
        assert_eq!(out, [4.0, 7.0]);
        around.changed(0, (&[1.5], &[]), (Reach::Object, &[7.0, 0.0], None), &mut out).expect("residuals");
        assert_eq!(out, [7.0, -3.5]);
        assert_eq!(whole.asked.load(Ordering::Relaxed), 1);
    }
}
