//! Whether the intervals that identification and diagnosis print hold the truth as often as they say: sessions of sealed
//! worlds, every number that is printed with an interval, and how often the truth lies inside.

use calibration::answer::identification::Parameter;
use calibration::benchmark::score::Rate;
use calibration::benchmark::trial;
use calibration::diagnose::{self, Diagnosis, diagnose_clips};
use calibration::identify::{Identification, arm, object};
use inference::statistics;
use serde::{Deserialize, Serialize};
use shared_mem::cell::Cell;
use shared_mem::interrupt::Interrupt;
use shared_mem::theta::Theta;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use toml::Value;
use worlds::draw;
use worlds::session::record;
use worlds::world::{Fault, Kind, Truth, World};

/// Whose intervals are held against the truth.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Subject {
    /// `identify arm`; with an effect that acts and is searched besides.
    Arm(Option<String>),
    /// `identify object`.
    Object,
    /// `diagnose`, in worlds with one effect; its numbers count where it is named.
    Diagnosis(Kind),
}

/// A number that was printed with an interval, and what it is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Printed {
    /// Its name in reports.
    pub name: String,
    /// Its true value.
    pub truth: f64,
    /// The value printed.
    pub value: f64,
    /// The interval printed.
    pub interval: [f64; 2],
}

/// What one world's session printed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Session {
    /// Number of the world.
    pub world: u64,
    /// All numbers that were printed with an interval; none where nothing was.
    pub printed: Vec<Printed>,
    /// Why there is nothing.
    pub left_out: Option<String>,
}

impl Subject {
    /// How often its intervals say that they hold the truth.
    pub const fn level(&self) -> f64 {
        match self {
            Self::Arm(_) | Self::Object => 0.95,
            Self::Diagnosis(_) => 0.9,
        }
    }

    /// The world of a number.
    ///
    /// # Errors
    /// When there is no effect of the name that was asked for.
    pub fn world(&self, number: u64, cell: &Cell) -> anyhow::Result<World> {
        let (kind, fault) = match self {
            Self::Arm(None) => (Kind::Excitation, Fault::Nothing),
            Self::Arm(Some(name)) => {
                let all = draw::candidates(false);
                let which = all.iter().position(|effect| effect.name == name);
                let known = || all.iter().map(|effect| effect.name).collect::<Vec<_>>().join(", ");
                let which =
                    which.ok_or_else(|| anyhow::anyhow!("no effect on the arm is called {name}: {}", known()))?;
                (Kind::Excitation, Fault::Single(which))
            }
            Self::Object => (Kind::Strokes, Fault::Nothing),
            Self::Diagnosis(kind) => (*kind, Fault::Single(usize::try_from(number)?)),
        };
        Ok(World::draw(number, kind, fault, cell))
    }

    /// What the session of a world tells, of so many clips.
    #[must_use]
    pub fn examine(&self, world: &World, clips: usize, interrupt: &Interrupt) -> Session {
        let (printed, left_out) = match self.printed(world, clips, interrupt) {
            Ok(printed) => (printed, None),
            Err(error) => (Vec::new(), Some(error.to_string())),
        };
        Session { world: world.number, printed, left_out }
    }

    fn printed(&self, world: &World, clips: usize, interrupt: &Interrupt) -> anyhow::Result<Vec<Printed>> {
        let (clips, seed) = (record(world, clips)?, world.number);
        match self {
            Self::Arm(effect) => {
                let also = effect.iter().cloned().collect();
                let options = arm::Options { also, seed, ..arm::Options::default() };
                let cell = Cell { objects: Vec::new(), ..world.cell.clone() };
                let found = arm::identify_clips(&cell, clips, &options, interrupt)?;
                Ok(of_identification(&found, &world.hidden))
            }
            Self::Object => {
                let options = object::Options { seed, ..object::Options::default() };
                let found = object::identify_clips(&world.cell, clips, &options, interrupt)?;
                Ok(of_identification(&found, &world.hidden))
            }
            Self::Diagnosis(_) => {
                let (session, admitted) = trial::sealed(world, clips);
                let options = diagnose::Options { seed, ..diagnose::Options::default() };
                Ok(of_diagnosis(&diagnose_clips(&session, &admitted, &options, interrupt)?, world))
            }
        }
    }
}

fn of_identification(found: &Identification, truth: &Theta) -> Vec<Printed> {
    let of = |(name, parameter): (&String, &Parameter)| {
        let values = parameter.value.iter().copied().zip(parameter.ci95.iter().copied());
        printed(name, values, &numbers(truth, name))
    };
    found.parameters.iter().flat_map(of).collect()
}

fn of_diagnosis(found: &Diagnosis, world: &World) -> Vec<Printed> {
    let Truth::Effects(effects) = &world.truth else { return Vec::new() };
    let named = found.candidates.iter().filter(|candidate| candidate.status == diagnose::Status::Named);
    let right = named.filter(|candidate| effects.contains(&candidate.effect));
    let of = |candidate: &diagnose::Candidate| -> Vec<Printed> {
        let sizes = candidate.parameters.iter().flat_map(|(parameter, size)| {
            let name = format!("{}.{parameter}", candidate.effect);
            let values = size.values.iter().copied().zip(size.ci90.iter().copied());
            printed(&name, values, &numbers(&world.hidden, &name))
        });
        sizes.collect()
    };
    right.flat_map(of).collect()
}

/// Those of a parameter's numbers whose truth is known and whose interval ends.
fn printed(name: &str, values: impl Iterator<Item = (f64, [f64; 2])>, truth: &[f64]) -> Vec<Printed> {
    let values: Vec<(f64, [f64; 2])> = values.collect();
    let single = values.len() == 1;
    let of = |(k, (value, interval)): (usize, (f64, [f64; 2]))| {
        // One number stands for all joints.
        let truth = *truth.get(k).or(truth.first().filter(|_| truth.len() == 1))?;
        let name = if single { name.to_owned() } else { format!("{name}[{k}]") };
        let ends = interval.iter().all(|end| end.is_finite());
        ends.then_some(Printed { name, truth, value, interval })
    };
    values.into_iter().enumerate().filter_map(of).collect()
}

/// The numbers of a parameter in a theta, by its name in reports; none where it does not say.
fn numbers(theta: &Theta, name: &str) -> Vec<f64> {
    let (arm, object) = (theta.arm.as_ref(), theta.object.as_ref());
    let one = |value: Option<f64>| value.into_iter().collect();
    match name {
        "stiffness" => arm.map(|arm| arm.stiffness.clone()).unwrap_or_default(),
        "damping" => arm.map(|arm| arm.damping.clone()).unwrap_or_default(),
        "friction" => one(object.and_then(|object| object.friction)),
        "mass" => one(object.and_then(|object| object.mass)),
        "tip_friction" => one(object.and_then(|object| object.tip_friction)),
        "centre_of_mass" => object.and_then(|object| object.centre_of_mass).map(Vec::from).unwrap_or_default(),
        _ => {
            let Some((effect, parameter)) = name.split_once('.') else { return Vec::new() };
            let block = theta.effects.iter().find(|block| block.name == effect);
            match block.and_then(|block| block.parameters.get(parameter)) {
                Some(Value::Array(values)) => values.iter().filter_map(Value::as_float).collect(),
                Some(value) => one(value.as_float()),
                None => Vec::new(),
            }
        }
    }
}

/// Of one number how often its intervals held the truth.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Covered {
    /// Sessions in which the truth lay inside.
    pub inside: Rate,
    /// Sessions in which it lay below and above the interval.
    pub beside: [usize; 2],
    /// Root mean square of the error over half the interval, times the quantile of the level: 1 where intervals are right.
    pub spread: f64,
    /// Median half width over the truth's size; of the half width itself where the truth may be zero.
    pub half_width: f64,
}

/// Every number that sessions printed, by name.
pub fn covered(sessions: &[Session], level: f64) -> BTreeMap<String, Covered> {
    let mut by_name: BTreeMap<String, Vec<&Printed>> = BTreeMap::new();
    for printed in sessions.iter().flat_map(|session| &session.printed) {
        by_name.entry(printed.name.clone()).or_default().push(printed);
    }
    by_name.into_iter().map(|(name, printed)| (name, Covered::of(&printed, level))).collect()
}

impl Covered {
    fn of(printed: &[&Printed], level: f64) -> Self {
        let count = |of: fn(&Printed) -> bool| printed.iter().filter(|printed| of(printed)).count();
        let half = |printed: &Printed| 0.5 * (printed.interval[1] - printed.interval[0]);
        let z = |printed: &&&Printed| {
            let half = half(printed);
            (half > 0.0).then(|| statistics::normal(level) * (printed.value - printed.truth) / half)
        };
        let z: Vec<f64> = printed.iter().filter_map(|printed| z(&printed)).collect();
        let mut halves: Vec<f64> = printed.iter().map(|printed| half(printed)).collect();
        halves.sort_by(f64::total_cmp);
        Self {
            inside: Rate::count(printed.iter().map(|printed| printed.holds())),
            beside: [
                count(|printed| printed.truth < printed.interval[0]),
                count(|printed| printed.truth > printed.interval[1]),
            ],
            spread: (z.iter().map(|z| z * z).sum::<f64>() / z.len().max(1) as f64).sqrt(),
            half_width: halves.get(halves.len() / 2).copied().unwrap_or(0.0),
        }
    }
}

impl Printed {
    /// Whether the interval holds the truth.
    pub fn holds(&self) -> bool {
        (self.interval[0]..=self.interval[1]).contains(&self.truth)
    }
}

/// A line for each number, and one for all together.
pub fn table(sessions: &[Session], level: f64) -> String {
    let printed: Vec<&Printed> = sessions.iter().flat_map(|session| &session.printed).collect();
    let mut all: Vec<(String, Covered)> = covered(sessions, level).into_iter().collect();
    all.push(("all".to_owned(), Covered::of(&printed, level)));
    let mut out = String::new();
    let _ = writeln!(
        out,
        "{:<44}{:>5}{:>8}{:>16}{:>7}{:>7}{:>8}{:>13}",
        "number", "n", "inside", "(95 %)", "below", "above", "spread", "half width"
    );
    for (name, Covered { inside, beside: [below, above], spread, half_width }) in all {
        let [low, high] = inside.ci95.map(|end| 100.0 * end);
        let (share, n) = (100.0 * inside.value(), inside.of);
        let _ = writeln!(
            out,
            "{name:<44}{n:>5}{share:>7.1} %{:>16}{below:>7}{above:>7}{spread:>8.2}{half_width:>13.3e}",
            format!("{low:.1} to {high:.1}")
        );
    }
    let _ = writeln!(
        out,
        "{} sessions, {} left out; the intervals say {:.0} %; spread: rms error in sigmas of the interval, 1 where it is right",
        sessions.len(),
        sessions.iter().filter(|session| session.left_out.is_some()).count(),
        100.0 * level
    );
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn cell() -> Cell {
        let text = include_str!("../../../config/fr3_cell.toml");
        shared_mem::toml_file::parse(text, Path::new("fr3_cell.toml")).expect("the shipped file")
    }

    #[test]
    fn every_number_that_can_be_printed_finds_its_truth() {
        for (subject, names) in [
            (Subject::Arm(None), vec!["stiffness", "damping"]),
            (Subject::Arm(Some("command_delay".into())), vec!["command_delay.delay"]),
            (Subject::Object, vec!["friction", "mass", "centre_of_mass", "tip_friction"]),
        ] {
            let world = subject.world(3, &cell()).expect("a world");
            for name in names {
                assert!(!numbers(&world.hidden, name).is_empty(), "{name}");
            }
        }
        assert!(Subject::Arm(Some("no_such".into())).world(3, &cell()).is_err());
    }

    #[test]
    fn a_truth_below_inside_and_above_is_counted_where_it_lies() {
        let printed =
            |value: f64| Printed { name: "a".into(), truth: 0.0, value, interval: [value - 1.0, value + 1.0] };
        let session = |world, value| Session { world, printed: vec![printed(value)], left_out: None };
        let sessions = [session(1, 2.0), session(2, 0.5), session(3, -2.0), session(4, -0.5)];
        let covered = &covered(&sessions, 0.95)["a"];
        assert_eq!((covered.inside.hits, covered.inside.of, covered.beside), (2, 4, [1, 1]));
        assert!(
            (covered.spread - statistics::normal(0.95) * (8.5f64 / 4.0).sqrt()).abs() < 1e-12
                && covered.half_width == 1.0
        );
        assert!(table(&sessions, 0.95).contains("50.0 %"));
    }
}
