//! Nuisance parameters of a clip with an object: what every clip has of its own, zero where it is like all others, and which of them
//! count for whom.

use super::deviations::{AFTER_HITS, Deviation, OF_AN_OBJECT_ALONE};
use super::noise_of;
use crate::estimate::Random;
use crate::likelihood::random_effects::RandomEffects;
use nalgebra::Vector3;
use shared_mem::cell::{Cell, ClipKind};

/// A nuisance parameter. Axes are those of the base frame: x, y, z.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Nuisance {
    /// Logarithm of this clip's friction over the shared one.
    LnFriction,
    /// How much later than the arm's clock says the poses were taken [s].
    Clock,
    /// True first place of an object that was let go less where its first poses put it, along an axis [m].
    Start(usize),
    /// The same about the vertical [rad].
    StartYaw,
    /// Its first velocity less the one read off the first poses, along an axis [m/s].
    Velocity(usize),
    /// The same of its angular velocity [rad/s].
    Spin(usize),
    /// How its path deviates from the simulated one.
    Path(&'static Deviation),
}

/// What identification estimates of a clip: what a simulation begins with, and when it is looked at. What a hit leaves behind is in the
/// error of the model.
pub const IDENTIFIED: &[Nuisance] = &[
    Nuisance::LnFriction,
    Nuisance::Clock,
    Nuisance::Start(0),
    Nuisance::Start(1),
    Nuisance::StartYaw,
    Nuisance::Velocity(0),
    Nuisance::Velocity(1),
    Nuisance::Velocity(2),
    Nuisance::Spin(0),
    Nuisance::Spin(1),
    Nuisance::Spin(2),
];

/// What the diagnosis estimates of a clip: deviations of the path in place of its beginning, since forty effects are compared and these
/// cost no simulation.
pub fn diagnosed(kind: ClipKind) -> Vec<Nuisance> {
    let path: &[Deviation] = if kind == ClipKind::FreeMotion { &OF_AN_OBJECT_ALONE } else { &AFTER_HITS };
    let before = [Nuisance::LnFriction, Nuisance::Clock].into_iter().filter(|own| own.acts_in(kind));
    before.chain(path.iter().map(Nuisance::Path)).collect()
}

/// Scatter of friction from clip to clip where cell.toml does not state it, one sigma of ln(mu) [1]: a choice.
const FRICTION_SCATTER: f64 = 0.03;
/// The first place of an object that was let go is read off its first poses, right to so many sigmas of one of them [1]: a choice.
const START_SIGMAS: f64 = 3.0;

impl Nuisance {
    /// Name in reports.
    pub fn name(self) -> String {
        let along = |what: &str, axis: usize| format!("{what} {}", ["x", "y", "z"][axis]);
        match self {
            Self::LnFriction => "ln friction".into(),
            Self::Clock => "clock".into(),
            Self::Start(axis) => along("start", axis),
            Self::StartYaw => "start yaw".into(),
            Self::Velocity(axis) => along("first velocity", axis),
            Self::Spin(axis) => along("first spin", axis),
            Self::Path(deviation) => deviation.name.into(),
        }
    }

    /// Whether it means anything in a clip of this kind: an object alone keeps its own time, and one that is hit begins where many rest
    /// frames put it.
    pub fn acts_in(self, kind: ClipKind) -> bool {
        match self {
            Self::LnFriction | Self::Path(_) => true,
            Self::Clock => kind == ClipKind::ControlHitSlide,
            Self::Start(_) | Self::StartYaw | Self::Velocity(_) | Self::Spin(_) => kind == ClipKind::FreeMotion,
        }
    }

    pub(super) fn deviation(self) -> Option<&'static Deviation> {
        if let Self::Path(deviation) = self { Some(deviation) } else { None }
    }

    /// With its scatter from clip to clip, and its difference step: large against rounding, small against what bends.
    fn random(self, cell: &Cell) -> Random {
        let (sigma, step) = match self {
            Self::LnFriction => {
                (cell.object().and_then(|object| object.friction_scatter).unwrap_or(FRICTION_SCATTER), 2e-3)
            }
            Self::Clock => (1e-3, 1e-3),
            Self::Start(_) => (START_SIGMAS * noise_of(cell).position, 1e-4),
            Self::StartYaw => (START_SIGMAS * noise_of(cell).rotation, 1e-3),
            Self::Velocity(_) => (0.05, 1e-3),
            Self::Spin(_) => (0.5, 2e-2),
            Self::Path(deviation) => (deviation.sigma, deviation.sigma),
        };
        Random { name: self.name(), sigma, step }
    }
}

/// These parameters as random effects: those of the path have heavy tails, together, and come last.
pub fn random_effects(parameters: &[Nuisance], cell: &Cell) -> RandomEffects {
    let normal = parameters.iter().position(|own| matches!(own, Nuisance::Path(_))).unwrap_or(parameters.len());
    let random = parameters.iter().map(|own| own.random(cell)).collect();
    RandomEffects { random, heavy: normal..parameters.len(), forgiving: 1.0 }
}

/// What a simulation feels of the nuisance parameters of one clip.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Values {
    pub(super) ln_friction: f64,
    pub(super) clock: f64,
    pub(super) start: Vector3<f64>,
    pub(super) start_yaw: f64,
    pub(super) velocity: Vector3<f64>,
    pub(super) spin: Vector3<f64>,
}

impl Values {
    /// What is missing is zero, and so is what means nothing in a clip of this kind.
    pub(super) fn new(parameters: &[Nuisance], own: &[f64], kind: ClipKind) -> Self {
        let mut values = Self::default();
        for (parameter, value) in parameters.iter().zip(own).filter(|(parameter, _)| parameter.acts_in(kind)) {
            match *parameter {
                Nuisance::LnFriction => values.ln_friction = *value,
                Nuisance::Clock => values.clock = *value,
                Nuisance::Start(axis) => values.start[axis] = *value,
                Nuisance::StartYaw => values.start_yaw = *value,
                Nuisance::Velocity(axis) => values.velocity[axis] = *value,
                Nuisance::Spin(axis) => values.spin[axis] = *value,
                Nuisance::Path(_) => {}
            }
        }
        values
    }

    /// Without the clock, which only says when the simulation is looked at.
    pub(super) fn felt(&self) -> Self {
        Self { clock: 0.0, ..*self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    fn cell(object: &str) -> Cell {
        let text = format!("[object]\nshape = \"box\"\nsize = [0.08, 0.06, 0.1]\n{object}");
        Cell::parse(&text, Path::new("cell.toml")).expect("a cell")
    }

    #[test]
    fn each_kind_of_clip_has_what_it_can_show_of_its_own_and_paths_have_heavy_tails() {
        let cell = cell("friction_scatter = 0.02\npose_noise = { position = 0.0005, rotation = 0.003 }\n");
        for (kind, normal) in [(ClipKind::ControlHitSlide, 2), (ClipKind::FreeMotion, 1)] {
            let effects = random_effects(&diagnosed(kind), &cell);
            assert_eq!(effects.heavy, normal..effects.count());
            assert!(effects.random.iter().all(|random| random.sigma > 0.0 && random.step > 0.0));
            assert_eq!(effects.random[0].sigma, 0.02);
        }
        let started = random_effects(IDENTIFIED, &cell);
        assert!(started.heavy.is_empty() && (started.random[2].sigma - 0.0015).abs() < 1e-12);
        let names: std::collections::BTreeSet<_> = started.random.iter().map(|random| &random.name).collect();
        assert_eq!(names.len(), IDENTIFIED.len());
    }

    #[test]
    fn what_means_nothing_in_a_clip_stays_zero() {
        let own: Vec<f64> = (1..=IDENTIFIED.len()).map(|k| k as f64).collect();
        let stroke = Values::new(IDENTIFIED, &own, ClipKind::ControlHitSlide);
        assert_eq!(stroke, Values { ln_friction: 1.0, clock: 2.0, ..Values::default() });
        assert_eq!(stroke.felt().clock, 0.0);
        let alone = Values::new(IDENTIFIED, &own, ClipKind::FreeMotion);
        assert_eq!(
            (alone.clock, alone.start, alone.spin),
            (0.0, Vector3::new(3.0, 4.0, 0.0), Vector3::new(9.0, 10.0, 11.0))
        );
        assert_eq!(
            Values::new(IDENTIFIED, &own[..1], ClipKind::FreeMotion),
            Values { ln_friction: 1.0, ..Values::default() }
        );
    }
}
