//! All signatures at once: every clip linearised around one point by all free numbers, all numbers of its own, and all
//! probes of all candidates that are not in the hypothesis yet.
//!
//! A column of a probe is the change of the residuals over one unit of it. Columns of numbers are slopes. What varies from
//! clip to clip is eliminated with its prior ([`Swept::reduced`]), so that what remains is a quadratic form in the shared
//! numbers and the probes' units alone.
//!
//! Numbers of different joints are turned in one simulation and separated by the joint in which they show
//! ([`Precision::Joints`]): a stiff controller leaves little of one joint in another. That costs a seventh of turning
//! them one by one ([`Precision::Exact`]).

use crate::diagnose::library::{Alternative, Library};
use inference::estimate::{Eliminated, Impossible};
use inference::kept::numbers;
use inference::likelihood::random_effects::{OwnNumbers, RandomEffects};
use inference::likelihood::random_effects_scale::Around;
use inference::likelihood::{Group, Likelihood, Reach};
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// A column: a free number, or a probe.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Column {
    /// A free number, by its index.
    Number(usize),
    /// A probe: candidate, alternative, probe.
    Probe(usize, usize, usize),
}

/// How columns are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Precision {
    /// Joints together, each seen in its own channels.
    Joints,
    /// One simulation for each column; for those of all joints where these move without one another.
    Exact,
}

/// One clip's residuals and columns, rows as in the evidence, not weighted.
#[derive(Debug, Clone)]
pub struct SweptClip {
    /// Index of the clip.
    pub clip: usize,
    /// Column 0 the residuals, then [`Swept::columns`], then the clip's nuisance parameters.
    pub matrix: DMatrix<f64>,
    /// The clip's nuisance parameters there.
    pub own: Vec<f64>,
}

/// All clips around one point.
#[derive(Debug, Clone)]
pub struct Swept {
    /// What the columns are.
    pub columns: Vec<Column>,
    /// What varies from clip to clip.
    pub scatter: RandomEffects,
    pub clips: Vec<SweptClip>,
}

/// One clip with its nuisance parameters eliminated.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Reduced {
    /// Quadratic form over (residual, columns).
    #[serde(with = "numbers")]
    pub form: DMatrix<f64>,
    /// Logarithm of the volume that the nuisance parameters were integrated over; part of the deviance.
    pub volume: f64,
    /// The clip around its nuisance parameters.
    pub around: Around,
}

/// Where a sweep stands.
pub struct Point<'a> {
    pub full: &'a [f64],
    pub free: &'a [usize],
    /// Candidates to probe.
    pub probed: &'a [usize],
    /// Clips, each with its nuisance parameters.
    pub clips: &'a [(usize, Vec<f64>)],
    /// How columns are taken.
    pub precision: Precision,
}

/// Columns that are taken in one simulation.
type Batch = Vec<usize>;

/// Linearises.
///
/// # Errors
/// [`Impossible`] when the point itself has no answer, or `go_on` says no; it is given, before each simulation, the share of a clip
/// that it is. A column without an answer counts as one that changes nothing.
pub fn sweep<O: OwnNumbers>(
    evidence: &dyn Likelihood<Own = O>,
    library: &Library,
    point: &Point<'_>,
    scatter: &RandomEffects,
    go_on: &(impl Fn(f64) -> bool + Sync),
) -> Result<Swept, Impossible> {
    let mut columns: Vec<Column> = point.free.iter().map(|k| Column::Number(*k)).collect();
    for candidate in point.probed {
        for (a, alternative) in library.candidates[*candidate].alternatives.iter().enumerate() {
            columns.extend((0..alternative.probes.len()).map(|p| Column::Probe(*candidate, a, p)));
        }
    }
    let batches = batches(library, &columns, point.precision);
    let one = |(clip, own): &(usize, Vec<f64>)| {
        let work = Work { evidence, library, full: point.full, columns: &columns, batches: &batches, scatter, go_on };
        work.clip(*clip, own)
    };
    let clips = point.clips.par_iter().map(one).collect::<Result<_, _>>()?;
    Ok(Swept { columns, scatter: scatter.clone(), clips })
}

/// Neighbouring columns that belong to different joints and to one form go together.
fn batches(library: &Library, columns: &[Column], precision: Precision) -> Vec<Batch> {
    let mut batches: Vec<Batch> = Vec::new();
    let form = |column: Column| match column {
        Column::Number(_) => None,
        Column::Probe(candidate, alternative, _) => Some((candidate, alternative)),
    };
    for (k, column) in columns.iter().enumerate() {
        let joint = library.joints[number_of(library, *column)];
        let joins = (precision == Precision::Joints || library.joints_apart)
            && joint.is_some()
            && batches.last().is_some_and(|batch| {
                batch.iter().all(|other| {
                    let there = library.joints[number_of(library, columns[*other])];
                    there.is_some() && there != joint && form(columns[*other]) == form(*column)
                })
            });
        match batches.last_mut().filter(|_| joins) {
            Some(batch) => batch.push(k),
            None => batches.push(vec![k]),
        }
    }
    batches
}

/// The number that a column moves first.
fn number_of(library: &Library, column: Column) -> usize {
    match column {
        Column::Number(k) => k,
        Column::Probe(candidate, a, p) => library.candidates[candidate].alternatives[a].probes[p].moves[0].0,
    }
}

struct Work<'a, O: OwnNumbers, G> {
    evidence: &'a dyn Likelihood<Own = O>,
    library: &'a Library,
    full: &'a [f64],
    columns: &'a [Column],
    batches: &'a [Batch],
    scatter: &'a RandomEffects,
    go_on: &'a G,
}

impl<O: OwnNumbers, G: Fn(f64) -> bool + Sync> Work<'_, O, G> {
    fn clip(&self, clip: usize, own: &[f64]) -> Result<SweptClip, Impossible> {
        let mut base = Vec::new();
        self.evidence.residuals(clip, self.full, own, &mut base)?;
        let share = 1.0 / self.batches.len().max(1) as f64;
        let batch = |batch: &Batch| {
            let goes_on = (self.go_on)(share);
            if goes_on { Ok(self.batch(batch, clip, own, &base)) } else { Err(Impossible("cut short".into())) }
        };
        let shared: Vec<Vec<(usize, Vec<f64>)>> = self.batches.par_iter().map(batch).collect::<Result<_, _>>()?;
        let owns: Vec<Vec<f64>> =
            (0..self.scatter.count()).into_par_iter().map(|k| self.own(k, clip, own, &base)).collect();
        let count = 1 + self.columns.len();
        let mut matrix = DMatrix::zeros(base.len(), count + owns.len());
        matrix.column_mut(0).copy_from_slice(&base);
        for (k, column) in shared.iter().flatten() {
            matrix.column_mut(k + 1).copy_from_slice(column);
        }
        for (k, column) in owns.iter().enumerate() {
            matrix.column_mut(count + k).copy_from_slice(column);
        }
        Ok(SweptClip { clip, matrix, own: own.to_vec() })
    }

    /// The columns of a batch.
    fn batch(&self, batch: &[usize], clip: usize, own: &[f64], base: &[f64]) -> Vec<(usize, Vec<f64>)> {
        let mut numbers = self.full.to_vec();
        let units: Vec<f64> = batch.iter().map(|k| self.turn(&mut numbers, self.columns[*k])).collect();
        let mut out = Vec::with_capacity(base.len());
        let reach = self.reach(batch, &numbers);
        let answer = self.evidence.changed(clip, (&numbers, own), (reach, base, Some((self.full, own))), &mut out);
        let answered = answer.is_ok() && out.len() == base.len() && out.iter().all(|residual| residual.is_finite());
        if !answered {
            return Vec::new();
        }
        let (rows, channels) = (self.evidence.rows(clip), self.evidence.channels());
        let column = |(k, units): (&usize, &f64)| {
            let joint = self.library.joints[number_of(self.library, self.columns[*k])].filter(|_| batch.len() > 1);
            let slope = |((out, base), row): ((&f64, &f64), &inference::likelihood::Row)| {
                let channel = &channels[row.channel];
                let foreign = joint.is_some_and(|joint| channel.joint != Some(joint));
                // What the arm feels is not learned from contact: see `contact.rs`.
                if foreign || (reach != Reach::Object && channel.group == Group::Contact) {
                    0.0
                } else {
                    (out - base) / units
                }
            };
            (*k, out.iter().zip(base).zip(rows).map(slope).collect())
        };
        batch.iter().zip(&units).map(column).collect()
    }

    /// What the columns of a batch can change; several joints at once are separated by the arm alone.
    fn reach(&self, batch: &[usize], numbers: &[f64]) -> Reach {
        match batch {
            [_, _, ..] => Reach::Arm,
            _ if !batch.iter().any(|k| self.library.arm_feels(number_of(self.library, self.columns[*k]), numbers)) => {
                Reach::Object
            }
            _ => Reach::All,
        }
    }

    /// Moves numbers one step along a column; by how many of its units.
    fn turn(&self, numbers: &mut [f64], column: Column) -> f64 {
        match column {
            Column::Number(k) => {
                let unknown = &self.library.unknowns[k];
                let step = if unknown.upper - numbers[k] < unknown.step { -unknown.step } else { unknown.step };
                numbers[k] += step;
                step
            }
            Column::Probe(candidate, a, p) => {
                let Alternative { form, probes } = &self.library.candidates[candidate].alternatives[a];
                for (k, value) in form.iter().chain(&probes[p].moves) {
                    numbers[*k] = *value;
                }
                1.0
            }
        }
    }

    /// The slope by a number of the clip's own.
    fn own(&self, k: usize, clip: usize, own: &[f64], base: &[f64]) -> Vec<f64> {
        if let Some(slope) = self.evidence.own_slope(clip, k) {
            return slope.to_vec();
        }
        let effect = &self.scatter.random[k];
        let (mut moved, mut out) = (own.to_vec(), Vec::new());
        moved[k] += effect.step;
        let near = (Reach::Object, base, Some((self.full, own)));
        let changed = |out: &mut Vec<f64>| self.evidence.changed(clip, (self.full, &moved), near, out);
        let turned = effect.sigma > 0.0 && changed(&mut out).is_ok();
        if !turned || out.len() != base.len() || !out.iter().all(|residual| residual.is_finite()) {
            return vec![0.0; base.len()];
        }
        out.iter().zip(base).map(|(out, base)| (out - base) / effect.step).collect()
    }
}

impl Swept {
    /// Each clip with channel weights and its nuisance parameters eliminated.
    ///
    /// # Errors
    /// As of [`Eliminated::of`].
    pub fn reduced<O: OwnNumbers>(
        &self,
        evidence: &dyn Likelihood<Own = O>,
        weights: &[f64],
    ) -> Result<Vec<Reduced>, Impossible> {
        self.clips.par_iter().map(|clip| self.reduce(clip, evidence, weights)).collect()
    }

    /// The sum of the clips' forms.
    ///
    /// # Errors
    /// As of [`Self::reduced`].
    pub fn total<O: OwnNumbers>(
        &self,
        evidence: &dyn Likelihood<Own = O>,
        weights: &[f64],
    ) -> Result<DMatrix<f64>, Impossible> {
        let size = 1 + self.columns.len();
        let forms = self.reduced(evidence, weights)?;
        Ok(forms.iter().fold(DMatrix::zeros(size, size), |sum, clip| sum + &clip.form))
    }

    fn reduce<O: OwnNumbers>(
        &self,
        clip: &SweptClip,
        evidence: &dyn Likelihood<Own = O>,
        weights: &[f64],
    ) -> Result<Reduced, Impossible> {
        let gram = gram(clip, evidence, weights);
        // The residual and the clip's nuisance parameters, without the columns between them.
        let of_clip = |k: usize| if k == 0 { 0 } else { self.columns.len() + k };
        let alone = 1 + self.scatter.count();
        let alone = DMatrix::from_fn(alone, alone, |i, k| gram[(of_clip(i), of_clip(k))]);
        let around = Around { gram: alone, own: clip.own.clone() };
        let Eliminated { form, volume, .. } = self.eliminated(clip, &gram)?;
        let correction = if self.scatter.count() == 0 { 0.0 } else { self.scatter.correction(&clip.own) };
        Ok(Reduced { form, volume: volume + correction, around })
    }

    fn eliminated(&self, clip: &SweptClip, gram: &DMatrix<f64>) -> Result<Eliminated, Impossible> {
        Eliminated::of(gram, &self.scatter.precision(&clip.own), &clip.own)
    }

    /// A clip's nuisance parameters at their best for shared ones nearby, from `ahead` on by the slopes of here.
    ///
    /// # Errors
    /// [`Impossible`] where the clip has no answer there, and as of [`Eliminated::of`].
    pub(super) fn own_there<O: OwnNumbers>(
        &self,
        clip: &SweptClip,
        ahead: Vec<f64>,
        evidence: &dyn Likelihood<Own = O>,
        (full, weights): (&[f64], &[f64]),
    ) -> Result<Vec<f64>, Impossible> {
        if self.scatter.count() == 0 {
            return Ok(ahead);
        }
        let mut residuals = Vec::new();
        evidence.residuals(clip.clip, full, &ahead, &mut residuals)?;
        let mut there = SweptClip { own: ahead, ..clip.clone() };
        there.matrix.set_column(0, &DVector::from_vec(residuals));
        self.own_after(&there, evidence, weights, &DVector::zeros(self.columns.len()))
    }

    /// A clip's nuisance parameters at their best for coefficients of all columns.
    ///
    /// # Errors
    /// As of [`Eliminated::of`].
    pub fn own_after<O: OwnNumbers>(
        &self,
        clip: &SweptClip,
        evidence: &dyn Likelihood<Own = O>,
        weights: &[f64],
        at: &DVector<f64>,
    ) -> Result<Vec<f64>, Impossible> {
        if self.scatter.count() == 0 {
            return Ok(Vec::new());
        }
        let step = self.eliminated(clip, &gram(clip, evidence, weights))?.own_change(at);
        Ok(clip.own.iter().zip(step.iter()).map(|(own, step)| own + step).collect())
    }
}

/// Products of all columns of a clip, weighted.
fn gram<O: OwnNumbers>(clip: &SweptClip, evidence: &dyn Likelihood<Own = O>, weights: &[f64]) -> DMatrix<f64> {
    let mut weighted = clip.matrix.clone();
    let factors: Vec<f64> = evidence.rows(clip.clip).iter().map(|row| weights[row.channel]).collect();
    for mut column in weighted.column_iter_mut() {
        column.iter_mut().zip(&factors).for_each(|(value, factor)| *value *= factor);
    }
    // As a product of matrices: nalgebra's `tr_mul` takes one dot product after another, several times slower.
    weighted.transpose() * weighted
}

#[cfg(test)]
mod tests {
    use super::*;
    use inference::likelihood::setting;
    use shared_mem::cell::Cell;
    use shared_mem::msg::MAX_JOINTS;
    use std::path::Path;

    #[test]
    fn joints_that_move_without_one_another_are_turned_together_however_exact() {
        let text = "[robot]\njoints = [\"a\", \"b\", \"c\"]\n[controller]\nkind = \"joint_pd\"\nstiffness_range = [0.5, 200.0]\n\
                    damping_range = [0.0, 20.0]\n";
        let cell = Cell::parse(text, Path::new("cell.toml")).expect("a cell");
        let base = setting::complete(&cell, None).expect("a cell");
        let apart = Library::new(&cell, &base, None, &[10.0; MAX_JOINTS]);
        let columns: Vec<Column> = apart.baseline.clone().map(Column::Number).collect();
        let count = |library: &Library, precision| batches(library, &columns, precision).len();
        assert_eq!(count(&apart, Precision::Exact), count(&apart, Precision::Joints));
        let mut coupled = apart;
        coupled.joints_apart = false;
        assert_eq!(count(&coupled, Precision::Exact), columns.len());
        assert!(count(&coupled, Precision::Joints) < columns.len());
    }
}
