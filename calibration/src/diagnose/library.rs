//! The candidates: every effect of the registry that can show in the clips, as parameters to search, with the probes
//! by which its signature is taken.
//!
//! A signature is a difference over a finite step of a plausible size, not a slope at zero: dry friction,
//! play and saturation have no slope there. An effect with a form beside its size (a place, an axis, a speed) has one
//! alternative for each of a few forms.

use crate::diagnose::ground::{Ground, Patch};
use crate::diagnose::known_gains;
use inference::estimate::Unknown;
use inference::likelihood::setting::{self, Setting, Settings};
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use std::ops::Range;
use twin::arm::{ArmModel, Joints};
use twin::effects::{EffectInfo, OnTable, Place, Robot, Role, Search, Shape, Stage, find, registry};

/// All numbers of all hypotheses.
#[derive(Debug, Clone)]
pub struct Library {
    /// From numbers to parameters of the cell.
    pub settings: Settings,
    /// Bounds, steps, and where the baseline begins; effects rest.
    pub unknowns: Vec<Unknown>,
    /// The joint in whose channels each number shows, from 0; `None` for numbers of the whole arm and of the object, and for
    /// those of a joint that an object alone may show.
    pub joints: Vec<Option<usize>>,
    /// Whether joints move without one another: nothing but a second-order model of each is known.
    pub joints_apart: bool,
    /// What each number does to the arm.
    reaches: Vec<ArmReach>,
    /// The baseline's numbers: gains, and the object's parameters.
    pub baseline: Range<usize>,
    pub candidates: Vec<Candidate>,
    /// How strong they may be on this robot.
    robot: Robot,
}

/// One effect as a hypothesis.
#[derive(Debug, Clone)]
pub struct Candidate {
    pub effect: &'static EffectInfo,
    pub numbers: Range<usize>,
    /// Those of them that are fitted.
    pub turned: Vec<usize>,
    /// Those of them that stay where they are until what was found is fitted to the end.
    pub held: Vec<usize>,
    /// Those of them that say how strong it is.
    pub sizes: Vec<usize>,
    /// Forms to try.
    pub alternatives: Vec<Alternative>,
}

/// An effect in one form.
#[derive(Debug, Clone)]
pub struct Alternative {
    /// Numbers of the form.
    pub form: Vec<(usize, f64)>,
    /// Directions of its strength.
    pub probes: Vec<Probe>,
}

/// One direction of an effect's strength: numbers and their values at one unit of it.
#[derive(Debug, Clone)]
pub struct Probe {
    /// Number and value at one unit.
    pub moves: Vec<(usize, f64)>,
    /// Whether it acts one way only.
    pub one_sided: bool,
    /// Units at the strongest that is plausible.
    pub largest: f64,
}

impl Candidate {
    /// Whether it acts on the arm itself; the others act on what the arm meets and on what the camera sees of it.
    pub fn is_of_arm(&self) -> bool {
        self.effect.stage == Stage::Control
    }

    /// Whether one of its parameters is come by in this way.
    pub fn is_searched(&self, search: Search) -> bool {
        self.effect.parameters.iter().any(|parameter| parameter.search == search)
    }

    /// One of the sizes at the strongest that is plausible; `resting`: where it changes nothing.
    pub fn strongest(&self, size: usize, resting: f64) -> Option<f64> {
        let mut probes = self.alternatives.iter().flat_map(|alternative| &alternative.probes);
        let probe = probes.find(|probe| probe.moves[0].0 == size)?;
        Some(resting + probe.largest * (probe.moves[0].1 - resting))
    }
}

impl Library {
    /// The library of a cell: with effects on the arm, and with those on hit, slide and camera where clips have an object,
    /// which crossed this `ground`. `base`: a complete theta whose effects act in the baseline already and are no candidates.
    /// `peaks`: the largest torque that each joint is asked for in the clips [N m].
    pub fn new(cell: &Cell, base: &Theta, ground: Option<&Ground>, peaks: &Joints) -> Self {
        let with_object = ground.is_some();
        let dof = base.arm.as_ref().map_or(0, |arm| arm.stiffness.len());
        let mut numbers = setting::arm_numbers(cell, base);
        if with_object {
            // How heavy an object is that moves by itself no pose shows.
            let shows = |(setting, _): &(Setting, Unknown)| cell.robot.is_some() || *setting != Setting::Mass;
            numbers.extend(setting::object_parameters(cell, base).into_iter().filter(shows));
        }
        for (_, unknown) in &mut numbers {
            known_gains::keep(cell, unknown);
        }
        let baseline = 0..numbers.len();
        let robot = ArmModel::from_cell(cell).map_or_else(|_| Robot::unknown(), |arm| Robot::of(&arm));
        let mut candidates = Vec::new();
        let stated = twin::effects::stated(cell.controller.as_ref());
        let fits = |effect: &&EffectInfo| {
            let mut given = base.effects.iter().chain(&stated);
            let known = given.any(|given| given.name == effect.name);
            let touched = cell.robot.is_some() || effect.acts_on != Place::ToolContact;
            let visible = if effect.stage == Stage::Control { dof > 0 } else { with_object && touched };
            visible && !known && effect.is_cause()
        };
        for effect in registry().iter().filter(fits) {
            let at = numbers.len();
            numbers.extend(setting::effect_settings(effect, &robot, dof));
            for (setting, unknown) in &mut numbers[at..] {
                if let Some(bound) = bound_of(setting, peaks) {
                    unknown.step = LIMIT_STEP_SHARE / bound;
                }
            }
            candidates.push(Candidate::new(effect, at, &numbers, Setup { ground, peaks, robot: &robot }));
        }
        let joint = |setting| joint_of(setting).filter(|_| !(with_object && moves_the_tip_unseen(setting)));
        let joints = numbers.iter().map(|(setting, _)| joint(setting)).collect();
        let felt = (numbers.iter().enumerate()).find_map(|(number, (setting, _))| Some((felt_with(setting)?, number)));
        let reaches = numbers.iter().map(|(setting, _)| arm_reach(setting, felt)).collect();
        let (all, unknowns): (Vec<Setting>, Vec<Unknown>) = numbers.into_iter().unzip();
        let joints_apart = cell.robot.as_ref().is_some_and(|robot| robot.joints_only());
        let settings = Settings::new(base.clone(), all);
        Self { settings, unknowns, joints, joints_apart, reaches, baseline, candidates, robot }
    }

    /// Puts angles that have come to one end of their turn, which their bounds span, to its other end: the same angle.
    pub fn turn_round(&self, full: &mut [f64]) {
        for (k, setting) in self.settings.settings().iter().enumerate() {
            if matches!(setting.search(), Some(Search::Angle { .. })) {
                let Unknown { lower, upper, .. } = self.unknowns[k];
                let angle = &mut full[k];
                if *angle <= lower {
                    *angle = upper;
                } else if *angle >= upper {
                    *angle = lower;
                }
            }
        }
    }

    /// Some of its numbers, one of them perhaps several times, each with its own bounds, as the baseline of a library without
    /// candidates.
    pub(super) fn of_numbers(&self, chosen: Vec<(usize, Unknown)>) -> Self {
        let turned = |number: usize| chosen.iter().any(|(k, _)| *k == number);
        let reach = |k: usize| match self.reaches[k] {
            ArmReach::With(other) if turned(other) => ArmReach::Always,
            ArmReach::With(_) => ArmReach::Never,
            plain => plain,
        };
        let all = self.settings.settings();
        Self {
            settings: Settings::new(self.settings.base().clone(), chosen.iter().map(|(k, _)| all[*k]).collect()),
            joints: chosen.iter().map(|(k, _)| self.joints[*k]).collect(),
            joints_apart: self.joints_apart,
            reaches: chosen.iter().map(|(k, _)| reach(*k)).collect(),
            baseline: 0..chosen.len(),
            candidates: Vec::new(),
            robot: self.robot,
            unknowns: chosen.into_iter().map(|(_, unknown)| unknown).collect(),
        }
    }

    /// Where every search begins: the baseline's values, all effects at rest.
    pub fn start(&self) -> Vec<f64> {
        self.unknowns.iter().map(|unknown| unknown.start).collect()
    }

    /// The parameters that go with these numbers, without effects that change nothing.
    pub fn theta(&self, numbers: &[f64]) -> Theta {
        let mut theta = self.settings.theta(numbers);
        let resting: Vec<&str> = (self.candidates.iter())
            .filter(|candidate| candidate.sizes.iter().all(|k| numbers[*k] == self.unknowns[*k].start))
            .map(|candidate| candidate.effect.name)
            .collect();
        theta.effects.retain(|effect| !resting.contains(&effect.name.as_str()));
        theta
    }

    /// Numbers with the baseline's object as others have it.
    pub fn with_object_of(&self, mut numbers: Vec<f64>, others: &[f64]) -> Vec<f64> {
        for k in self.baseline.clone().filter(|k| !self.arm_feels(*k, &numbers)).collect::<Vec<_>>() {
            numbers[k] = others[k];
        }
        numbers
    }

    /// Numbers with some effects as others have them.
    pub fn with_effects_of(&self, mut numbers: Vec<f64>, effects: &[usize], others: &[f64]) -> Vec<f64> {
        for effect in effects {
            let own = self.candidates[*effect].numbers.clone();
            numbers[own.clone()].copy_from_slice(&others[own]);
        }
        numbers
    }

    /// Whether the arm feels a number where the numbers are these.
    pub fn arm_feels(&self, number: usize, numbers: &[f64]) -> bool {
        match self.reaches[number] {
            ArmReach::Always => true,
            ArmReach::Never => false,
            ArmReach::With(other) => numbers[other] != 0.0,
        }
    }

    /// Whether the arm feels a candidate in one of its forms.
    pub fn arm_may_feel(&self, candidate: usize) -> bool {
        self.candidates[candidate].numbers.clone().any(|k| !matches!(self.reaches[k], ArmReach::Never))
    }

    /// Those of the numbers that the arm feels.
    pub fn felt_by_arm(&self, numbers: &[f64]) -> Vec<f64> {
        (0..numbers.len()).filter(|k| self.arm_feels(*k, numbers)).map(|k| numbers[k]).collect()
    }

    /// Values of the parameter behind a number of an effect that are plausible on this robot; `None` for numbers of the
    /// baseline.
    pub fn plausible(&self, number: usize) -> Option<[f64; 2]> {
        plausible(&self.robot, &self.settings.settings()[number])
    }

    /// How strong effects may be on this robot.
    pub fn robot(&self) -> &Robot {
        &self.robot
    }

    /// Whether two candidates are known to look alike in some recordings.
    pub fn look_alike(&self, a: usize, b: usize) -> bool {
        let [a, b] = [a, b].map(|candidate| self.candidates[candidate].effect);
        a.confusable_with.contains(&b.name) || b.confusable_with.contains(&a.name)
    }

    /// Name of a candidate.
    pub fn name(&self, candidate: usize) -> &'static str {
        self.candidates[candidate].effect.name
    }

    /// [`Candidate::is_of_arm`].
    pub fn is_of_arm(&self, candidate: usize) -> bool {
        self.candidates[candidate].is_of_arm()
    }

    /// Index of the candidate with this name.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.candidates.iter().position(|candidate| candidate.effect.name == name)
    }
}

fn joint_of(setting: &Setting) -> Option<usize> {
    match *setting {
        Setting::Stiffness(joint) | Setting::Damping(joint) => Some(joint),
        Setting::Effect { index, .. } => setting.of_effect().filter(|p| p.shape == Shape::PerJoint).and(index),
        _ => None,
    }
}

/// Whether a number of a joint moves the tip by what no sensor of the arm need show: nothing shows of a vertical joint's
/// encoder but what the tip hits.
fn moves_the_tip_unseen(setting: &Setting) -> bool {
    setting.of_effect().is_some_and(|parameter| parameter.moves_tip_unseen)
}

/// Whether the arm feels a number.
#[derive(Debug, Clone, Copy)]
enum ArmReach {
    Always,
    Never,
    /// Where another number is not zero.
    With(usize),
}

/// `felt`: the effect on the hit that the arm may feel, and the number on which that depends.
fn arm_reach(setting: &Setting, felt: Option<(&str, usize)>) -> ArmReach {
    match (*setting, felt) {
        (Setting::Stiffness(_) | Setting::Damping(_), _) => ArmReach::Always,
        (Setting::Effect { name, .. }, Some((felt, number))) if name == felt => ArmReach::With(number),
        (Setting::Effect { name, .. }, _) if find(name).is_some_and(|effect| effect.stage == Stage::Control) => {
            ArmReach::Always
        }
        _ => ArmReach::Never,
    }
}

/// The effect that the arm feels where a number is not 0, though it shows in a later stage.
fn felt_with(setting: &Setting) -> Option<&'static str> {
    let Setting::Effect { name, .. } = *setting else { return None };
    setting.of_effect().filter(|parameter| parameter.felt_by_arm).map(|_| name)
}

impl Candidate {
    fn new(effect: &'static EffectInfo, at: usize, numbers: &[(Setting, Unknown)], setup: Setup<'_>) -> Self {
        let is_size = |setting: &Setting| match setting {
            Setting::Effect { parameter, .. } => {
                effect.parameters.iter().any(|p| p.name == *parameter && matches!(p.role, Role::Size { .. }))
            }
            _ => false,
        };
        let sizes: Vec<usize> = (at..numbers.len()).filter(|k| is_size(&numbers[*k].0)).collect();
        let (held, turned): (Vec<usize>, Vec<usize>) = (at..numbers.len()).partition(|k| is_held(&numbers[*k].0));
        let held = held.into_iter().filter(|k| numbers[*k].0.search() == Some(Search::Held)).collect();
        let alternatives = alternatives(effect, at, &sizes, numbers, setup);
        Self { effect, numbers: at..numbers.len(), turned, held, sizes, alternatives }
    }
}

/// The torque at which a limit of a joint begins to bite [N m], where a number is such a limit.
fn bound_of(setting: &Setting, peaks: &Joints) -> Option<f64> {
    match *setting {
        Setting::Effect { index: Some(joint), .. } if setting.search() == Some(Search::Limit) => {
            Some(peaks[joint]).filter(|peak| *peak > 0.0)
        }
        _ => None,
    }
}

/// Whether a number of an effect does not move along with the others.
fn is_held(setting: &Setting) -> bool {
    matches!(setting.search(), Some(Search::Held | Search::Middle))
}

/// A limit of its own for every joint: what it does depends on how hard the clips drive that joint, and above that it does
/// nothing at all.
fn biting(number: usize, peak: f64, unknown: &Unknown) -> Probe {
    let moves = vec![(number, ((1.0 - PROBE_SHARE) * peak).recip().min(unknown.upper))];
    Probe { moves, one_sided: true, largest: MIN_LIMIT_SHARE.recip() }
}

/// The difference step of a limit is this share of a joint's largest torque, and below this share of it no limit is looked for [1]:
/// choices.
const LIMIT_STEP_SHARE: f64 = 0.01;
const MIN_LIMIT_SHARE: f64 = 0.03;

/// The step of a probe as a share of what is plausible, and what the probe of a limit cuts off of a joint's largest torque [1]: small
/// enough to be in proportion, large against noise.
const PROBE_SHARE: f64 = 0.1;

/// What decides which probes of an effect make sense.
#[derive(Clone, Copy)]
struct Setup<'a> {
    /// Where objects slid.
    ground: Option<&'a Ground>,
    /// What the joints were asked for [N m].
    peaks: &'a Joints,
    robot: &'a Robot,
}

/// Values of the parameter behind a number of an effect that are plausible on a robot.
fn plausible(robot: &Robot, setting: &Setting) -> Option<[f64; 2]> {
    let Setting::Effect { index, .. } = *setting else { return None };
    setting.of_effect().map(|parameter| robot.range(parameter, index))
}

fn alternatives(
    effect: &EffectInfo,
    at: usize,
    sizes: &[usize],
    numbers: &[(Setting, Unknown)],
    Setup { ground, peaks, robot }: Setup<'_>,
) -> Vec<Alternative> {
    let probe = |k: &usize| match bound_of(&numbers[*k].0, peaks) {
        Some(peak) => biting(*k, peak, &numbers[*k].1),
        None => probe(*k, &numbers[*k], robot),
    };
    let index = |parameter: &str| -> Vec<usize> {
        let is = |setting: &Setting| matches!(setting, Setting::Effect { parameter: p, .. } if *p == parameter);
        (at..numbers.len()).filter(|k| is(&numbers[*k].0)).collect()
    };
    let angle = effect.parameters.iter().find_map(|p| match p.search {
        Search::Angle { quarter } => Some((index(p.name), quarter)),
        _ => None,
    });
    let probes: Vec<Probe> = match angle {
        Some((angles, quarter)) => [0.0, quarter].map(|angle| across(sizes, numbers, &angles, angle, robot)).concat(),
        None => sizes.iter().map(probe).collect(),
    };
    let with = |form: Vec<(usize, f64)>| Alternative { form, probes: probes.clone() };
    let on_table: Vec<(usize, OnTable)> = (effect.parameters.iter())
        .filter_map(|parameter| match parameter.search {
            Search::OnTable(coordinate) => Some((index(parameter.name)[0], coordinate)),
            _ => None,
        })
        .collect();
    if !on_table.is_empty() {
        let place = |patch: Patch| {
            let coordinate = |(number, coordinate): &(usize, OnTable)| match coordinate {
                OnTable::Direction => (*number, patch.direction),
                OnTable::Distance => (*number, patch.distance),
                OnTable::Radius => (*number, patch.curvature),
            };
            with(on_table.iter().map(coordinate).collect())
        };
        return ground.map(Ground::patches).unwrap_or_default().into_iter().map(place).collect();
    }
    if let Some(place) = effect.parameters.iter().find(|parameter| parameter.search == Search::Middle) {
        let at = |place_is: [f64; 3]| with(index(place.name).into_iter().zip(place_is).collect());
        let middle = ground.map(|ground| [ground.middle[0], ground.middle[1], 0.0]);
        return [Some([place.resting_value(); 3]), middle].into_iter().flatten().map(at).collect();
    }
    match effect.parameters.iter().find(|parameter| !parameter.begun_at.is_empty()) {
        Some(form) => {
            let from =
                |values: &&[f64]| with(index(form.name).into_iter().zip(values.iter().copied().cycle()).collect());
            form.begun_at.iter().map(from).collect()
        }
        None => vec![with(Vec::new())],
    }
}

/// Every size at an angle, as strong as a probe of it is.
fn across(sizes: &[usize], numbers: &[(Setting, Unknown)], angles: &[usize], angle: f64, robot: &Robot) -> Vec<Probe> {
    let share = 2.0 * PROBE_SHARE;
    let of = |(size, number): (&usize, &usize)| {
        let [_, strongest] = plausible(robot, &numbers[*size].0).expect("a size is a parameter");
        Probe { moves: vec![(*size, share * strongest), (*number, angle)], one_sided: false, largest: share.recip() }
    };
    sizes.iter().zip(angles).map(of).collect()
}

fn probe(number: usize, (setting, unknown): &(Setting, Unknown), robot: &Robot) -> Probe {
    let Setting::Effect { inverse, .. } = setting else { unreachable!("sizes belong to effects") };
    let info = setting.of_effect().expect("a size is a parameter");
    let [lo, hi] = plausible(robot, setting).expect("a size is a parameter");
    let reach = match info.usual {
        _ if *inverse => lo.recip(),
        Some(usual) => (usual - unknown.start).abs(),
        None => (hi - unknown.start).max(unknown.start - lo),
    };
    let one_sided = *inverse || unknown.lower >= unknown.start || unknown.upper <= unknown.start;
    let way = if unknown.upper > unknown.start { 1.0 } else { -1.0 };
    let share = if info.shape == Shape::PerJoint || *inverse { PROBE_SHARE } else { 0.5 * PROBE_SHARE };
    Probe { moves: vec![(number, unknown.start + way * share * reach)], one_sided, largest: 1.0 / share }
}
