//! Ways of searching side by side, on the same clips: `identify object`'s own, which also listens to what the arm felt;
//! by the loss on the surface's points alone its modelled descent, the particle swarm and CMA-ES; and least squares
//! without the centre of mass, the set of numbers that gradients through a differentiable simulator were used for
//! (PIN-WM).

use super::figures::{figures, gaps};
use super::material::Material;
use super::paper::SurfaceLoss;
use super::polish::{fit_polished, fit_poses_alone, usual_evaluations};
use super::{Options, Problem};
use crate::answer::identification::Figures;
use crate::identify::error::IdentifyError;
use crate::identify::options::Optimizer;
use crate::identify::run::{Outcome, Run};
use crate::identify::work::{Work, stopped};
use inference::interrupt::Interrupt;
use inference::kept::Kept;
use inference::likelihood::object::ObjectClips;
use inference::likelihood::{Setting, Settings};
use inference::object_fit::ObjectFit;
use inference::object_fit::fit_object;
use serde::Serialize;
use shared_mem::progress::Progress;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::sync::Mutex;
use std::time::Instant;

/// What the comparison found. SI units.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Comparison {
    pub session: String,
    /// Ways of searching, in the order of the table's columns.
    pub methods: Vec<Method>,
    /// Loss that the swarm ended with, ADD + ADD-S on the clips fitted [m].
    pub target_loss_m: f64,
    /// Clips that the swarm simulated over those that the modelled descent took to the same loss; none where it never came
    /// there.
    pub fewer: Option<f64>,
}

/// One way of searching.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Method {
    pub name: String,
    pub parameters: BTreeMap<String, f64>,
    /// Clips simulated until it ended.
    pub evaluations: usize,
    /// Wall time until then [s].
    pub seconds: f64,
    /// ADD + ADD-S on the clips fitted [m].
    pub loss_m: f64,
    /// Clips simulated and wall time [s] when its loss was first as low as the swarm's at last; none where it never was.
    pub to_target: Option<(usize, f64)>,
    pub holdout: Figures,
    pub train: Figures,
    /// Clips held out, one by one: file, ADD, ADD-S [m].
    pub clips: Vec<(String, f64, f64)>,
    /// Clips simulated, wall time [s] and loss [m] along the way.
    pub way: Vec<(usize, f64, f64)>,
}

/// Runs all of them.
///
/// # Errors
/// [`IdentifyError`] naming what is wrong and the remedy.
pub fn compare(options: &Options, interrupt: &Interrupt) -> Result<Comparison, IdentifyError> {
    let material = Material::open(options)?;
    let problem = Problem::new(&material, options, Work::passing(interrupt))?;
    let is_centre = |k: &usize| matches!(problem.settings.settings()[*k], Setting::CentreOfMass(_));
    let without: Vec<usize> = (0..problem.unknowns.len()).filter(|k| !is_centre(k)).collect();
    let whole = Contest { problem: &problem, material: &material, options, interrupt };
    let pin = Contest { problem: &problem.of(&without), ..whole };
    let usual = whole.sloped("least squares", Searcher::Usual)?;
    let alone = whole.sloped("poses alone", Searcher::PosesAlone)?;
    let swarm = whole.slopeless("particle swarm", Optimizer::Swarm)?;
    let evolution = whole.slopeless("CMA-ES", Optimizer::Evolution)?;
    let slopes = pin.sloped("gradient without centre of mass", Searcher::Slopes)?;
    stopped(Work::passing(interrupt))?;
    let target = swarm.loss_m;
    let clips = |method: &Method| method.to(target).map(|(clips, _)| clips as f64);
    let fewer = clips(&alone).zip(clips(&swarm)).map(|(alone, swarm)| swarm / alone);
    let mut methods = vec![usual, alone, swarm, evolution, slopes];
    for method in &mut methods {
        method.to_target = method.to(target);
    }
    Ok(Comparison { session: options.session.display().to_string(), methods, target_loss_m: target, fewer })
}

impl Method {
    /// Clips simulated and wall time [s] when the loss was first as low as this [m].
    fn to(&self, loss_m: f64) -> Option<(usize, f64)> {
        self.way.iter().find(|(.., loss)| *loss <= loss_m).map(|(clips, seconds, _)| (*clips, *seconds))
    }
}

impl Problem {
    /// The same with some of its numbers; the others stay where the search begins.
    fn of(&self, numbers: &[usize]) -> Self {
        let settings = numbers.iter().map(|k| self.settings.settings()[*k]).collect();
        Self {
            settings: Settings::new(self.settings.base().clone(), settings),
            unknowns: numbers.iter().map(|k| self.unknowns[*k].clone()).collect(),
            known: self.known.clone(),
            warnings: self.warnings.clone(),
        }
    }
}

/// How far slopes are followed.
#[derive(Clone, Copy)]
enum Searcher {
    /// As `identify object` goes.
    Usual,
    /// By the loss of poses alone.
    PosesAlone,
    /// Nothing but slopes.
    Slopes,
}

/// What every way of searching is given.
#[derive(Clone, Copy)]
struct Contest<'a> {
    problem: &'a Problem,
    material: &'a Material,
    options: &'a Options,
    interrupt: &'a Interrupt,
}

impl Contest<'_> {
    fn clips(&self) -> Result<ObjectClips, IdentifyError> {
        Ok(ObjectClips::new(&self.material.cell, self.material.train(), self.problem.settings.clone())?)
    }

    fn sloped(&self, name: &str, searcher: Searcher) -> Result<Method, IdentifyError> {
        let (mut clips, start) = (self.clips()?, self.problem.start());
        let (began, steps) = (Instant::now(), Mutex::new(Vec::new()));
        let shape = self.problem.shape(&clips)?;
        let searched = self.problem.searched(&shape, self.options.seed);
        let bar = Progress::new(name, usual_evaluations(&clips, searched.unknowns) as u64);
        let watch = |numbers: &[f64], evaluations: usize| {
            bar.show(evaluations as u64, &format!("{evaluations} clips simulated"));
            let step = (numbers.to_vec(), evaluations, began.elapsed().as_secs_f64());
            steps.lock().expect("no holder panics").push(step);
            !self.interrupt.asked()
        };
        let trail = (Kept::nothing(), "");
        let at = |found: ObjectFit| (found.at.shared, found.evaluations);
        let (numbers, evaluations) = match searcher {
            Searcher::Usual => at(fit_polished(&mut clips, searched, &start, trail, watch)?),
            Searcher::PosesAlone => fit_poses_alone(&mut clips, searched, &start, watch)?,
            Searcher::Slopes => at(fit_object(&mut clips, searched.unknowns, &start, trail, watch)?),
        };
        let seconds = began.elapsed().as_secs_f64();
        // What the way cost is measured afterwards: the losses along it are none of the search's own simulations.
        let loss = SurfaceLoss::new(&clips, &shape);
        let way = steps.into_inner().expect("no holder panics").into_iter();
        let way = way.map(|(numbers, n, at)| Ok((n, at, loss.mean(&numbers)?)));
        let way = way.collect::<Result<Vec<_>, IdentifyError>>()?;
        Ok(Method { evaluations, seconds, loss_m: loss.mean(&numbers)?, way, ..self.found(name, &numbers)? })
    }

    fn slopeless(&self, name: &str, optimizer: Optimizer) -> Result<Method, IdentifyError> {
        let clips = self.clips()?;
        let loss = SurfaceLoss::new(&clips, &self.problem.shape(&clips)?);
        let options = &Options { optimizer, ..self.options.clone() };
        let run = Run { unknowns: &self.problem.unknowns, random: &[], options, work: Work::passing(self.interrupt) };
        let began = Instant::now();
        let Outcome { fit, simulated, convergence, .. } = run.search(&loss, &loss)?;
        let seconds = began.elapsed().as_secs_f64();
        let at = |n: f64| seconds * n / simulated.max(1) as f64;
        let way = convergence.into_iter().map(|[n, loss]| (n as usize, at(n), loss)).collect();
        let loss_m = loss.mean(&fit.shared)?;
        Ok(Method { evaluations: simulated, seconds, loss_m, way, ..self.found(name, &fit.shared)? })
    }

    /// What a way found and how far off that is, without what it cost.
    fn found(&self, name: &str, numbers: &[f64]) -> Result<Method, IdentifyError> {
        let Self { problem, material, .. } = *self;
        let theta = problem.settings.theta(numbers);
        let (gaps, _) = gaps(material, &theta, (None, &theta))?;
        let mean = |of: &[usize]| Figures::mean(&of.iter().map(|clip| figures(&gaps[*clip])).collect::<Vec<_>>());
        let clip = |clip: &usize| {
            let [add, add_s] = [gaps[*clip].object_add_m, gaps[*clip].object_add_s_m].map(Option::unwrap_or_default);
            (material.usable[*clip].file.clone(), add, add_s)
        };
        Ok(Method {
            name: name.into(),
            parameters: problem
                .unknowns
                .iter()
                .map(|unknown| unknown.name.clone())
                .zip(numbers.iter().copied())
                .collect(),
            holdout: mean(&material.used.split.confirm),
            train: mean(&material.used.split.train),
            clips: material.used.split.confirm.iter().map(clip).collect(),
            ..Method::default()
        })
    }
}

/// Width of a column that holds the name of a way of searching.
const COLUMN: usize = 34;

impl Comparison {
    /// Three tables: ADD and ADD-S on clips held out, a row a clip and their mean, a column a way of searching; and what
    /// each way cost.
    pub fn table(&self) -> String {
        let mut out = String::new();
        self.errors(&mut out, "ADD", |figures| figures.object_add_m, |clip| clip.1);
        self.errors(&mut out, "ADD-S", |figures| figures.object_add_s_m, |clip| clip.2);
        let _ = writeln!(
            out,
            "{:<COLUMN$}{:>9}{:>9}{:>12}   to the swarm's loss",
            "what it cost", "clips", "s", "loss [mm]"
        );
        for m in &self.methods {
            let to = m.to_target.map_or("never".into(), |(n, s)| format!("{n} clips, {s:.1} s"));
            let _ = writeln!(
                out,
                "{:<COLUMN$}{:>9}{:>9.1}{:>12.3}   {to}",
                m.name,
                m.evaluations,
                m.seconds,
                m.loss_m * 1e3
            );
        }
        let alone = match self.fewer {
            Some(fewer) => format!("{fewer:.1} times fewer clips were simulated than by the swarm for the same loss"),
            None => "the swarm's loss was not reached".into(),
        };
        let _ = writeln!(out, "by poses alone, {alone}");
        out
    }

    /// One error: a row a clip, a column a way of searching.
    fn errors(
        &self,
        out: &mut String,
        name: &str,
        mean: impl Fn(&Figures) -> Option<f64>,
        of: impl Fn(&(String, f64, f64)) -> f64,
    ) {
        let widths: Vec<usize> = self.methods.iter().map(|m| m.name.len() + 2).collect();
        let mut line = |title: &str, cells: Vec<String>| {
            let cells: String = cells.iter().zip(&widths).map(|(cell, width)| format!("{cell:>width$}")).collect();
            let _ = writeln!(out, "{title:<COLUMN$}{cells}");
        };
        let millimetres = |metres: f64| format!("{:.2}", metres * 1e3);
        line(&format!("{name} on clips held out [mm]"), self.methods.iter().map(|m| m.name.clone()).collect());
        let clips = self.methods.first().map_or(&[][..], |m| &m.clips[..]);
        for (row, (file, ..)) in clips.iter().enumerate() {
            let cell = |m: &Method| m.clips.get(row).map_or_else(String::new, |clip| millimetres(of(clip)));
            line(file, self.methods.iter().map(cell).collect());
        }
        let means = self.methods.iter().map(|m| mean(&m.holdout).map_or_else(|| "-".into(), millimetres));
        line("mean", means.collect());
        out.push('\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_stand_under_the_way_they_belong_to() {
        let method = |name: &str, add: f64, to_target| Method {
            name: name.into(),
            evaluations: 120,
            seconds: 1.5,
            loss_m: 0.005,
            to_target,
            holdout: Figures { object_add_m: Some(add), object_add_s_m: Some(0.5 * add), ..Figures::default() },
            clips: vec![("clip_03.mcap".into(), add, 0.5 * add)],
            ..Method::default()
        };
        let methods = vec![method("least squares", 0.0028, Some((40, 0.5))), method("particle swarm", 0.0139, None)];
        let table = Comparison { methods, fewer: Some(12.0), ..Comparison::default() }.table();
        let expected = "\
ADD on clips held out [mm]          least squares  particle swarm
clip_03.mcap                                 2.80           13.90
mean                                         2.80           13.90

ADD-S on clips held out [mm]        least squares  particle swarm
clip_03.mcap                                 1.40            6.95
mean                                         1.40            6.95

what it cost                          clips        s   loss [mm]   to the swarm's loss
least squares                           120      1.5       5.000   40 clips, 0.5 s
particle swarm                          120      1.5       5.000   never
by poses alone, 12.0 times fewer clips were simulated than by the swarm for the same loss
";
        assert_eq!(table, expected);
    }
}
