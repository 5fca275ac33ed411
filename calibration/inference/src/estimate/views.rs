//! A model seen another way: its calls counted, its shared parameters given, its residuals shifted, some of its clips alone.

use super::problem::{ClipModel, Impossible};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Counts the calls.
pub(super) struct Counted<'a, M> {
    model: &'a M,
    calls: AtomicUsize,
}

impl<'a, M> Counted<'a, M> {
    pub(super) fn new(model: &'a M) -> Self {
        Self { model, calls: AtomicUsize::new(0) }
    }

    pub(super) fn calls(&self) -> usize {
        self.calls.load(Ordering::Relaxed)
    }
}

impl<M: ClipModel> ClipModel for Counted<'_, M> {
    fn clips(&self) -> usize {
        self.model.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        self.model.residuals(clip, shared, own, out)
    }

    fn stepped(
        &self,
        clip: usize,
        to: (&[f64], &[f64]),
        from: ((&[f64], &[f64]), &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        self.calls.fetch_add(1, Ordering::Relaxed);
        self.model.stepped(clip, to, from, out)
    }

    fn stretches(&self, clip: usize) -> Vec<usize> {
        self.model.stretches(clip)
    }
}

/// A model whose shared parameters are given.
pub(super) struct Given<'a, M> {
    pub(super) model: &'a M,
    pub(super) shared: &'a [f64],
}

impl<M: ClipModel> ClipModel for Given<'_, M> {
    fn clips(&self) -> usize {
        self.model.clips()
    }

    fn residuals(&self, clip: usize, _: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.model.residuals(clip, self.shared, own, out)
    }

    fn stepped(
        &self,
        clip: usize,
        (_, own): (&[f64], &[f64]),
        ((_, from), base): ((&[f64], &[f64]), &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        self.model.stepped(clip, (self.shared, own), ((self.shared, from), base), out)
    }

    fn stretches(&self, clip: usize) -> Vec<usize> {
        self.model.stretches(clip)
    }
}

/// A model whose residuals are larger by what is known of each clip.
pub struct Shifted<'a, M> {
    pub model: &'a M,
    /// What is added to the residuals, clip by clip.
    pub by: &'a [Vec<f64>],
}

impl<M: ClipModel> ClipModel for Shifted<'_, M> {
    fn clips(&self) -> usize {
        self.model.clips()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.model.residuals(clip, shared, own, out)?;
        out.iter_mut().zip(&self.by[clip]).for_each(|(residual, by)| *residual += by);
        Ok(())
    }

    fn stepped(
        &self,
        clip: usize,
        to: (&[f64], &[f64]),
        (from, base): ((&[f64], &[f64]), &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        let base: Vec<f64> = base.iter().zip(&self.by[clip]).map(|(residual, by)| residual - by).collect();
        self.model.stepped(clip, to, (from, &base), out)?;
        out.iter_mut().zip(&self.by[clip]).for_each(|(residual, by)| *residual += by);
        Ok(())
    }

    fn stretches(&self, clip: usize) -> Vec<usize> {
        self.model.stretches(clip)
    }
}

/// Some clips of a model.
pub struct Subset<'a, M> {
    pub model: &'a M,
    /// Which of its clips, in the order they get here.
    pub clips: &'a [usize],
}

impl<M: ClipModel> ClipModel for Subset<'_, M> {
    fn clips(&self) -> usize {
        self.clips.len()
    }

    fn residuals(&self, clip: usize, shared: &[f64], own: &[f64], out: &mut Vec<f64>) -> Result<(), Impossible> {
        self.model.residuals(self.clips[clip], shared, own, out)
    }

    fn stepped(
        &self,
        clip: usize,
        to: (&[f64], &[f64]),
        from: ((&[f64], &[f64]), &[f64]),
        out: &mut Vec<f64>,
    ) -> Result<(), Impossible> {
        self.model.stepped(self.clips[clip], to, from, out)
    }

    fn stretches(&self, clip: usize) -> Vec<usize> {
        self.model.stretches(self.clips[clip])
    }
}
