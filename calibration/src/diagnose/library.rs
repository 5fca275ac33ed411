//! The candidates: every effect of the registry that can show in the clips, as numbers a search may turn, with the probes
//! by which its signature is taken.
//!
//! A signature is a difference over a finite step of the size that is met in practice, not a slope at zero: dry friction,
//! play and saturation have no slope there. An effect with a form beside its size (a place, an axis, a speed) has one
//! alternative for each of a few forms.

use super::ground::{Ground, Patch};
use crate::estimate::Unknown;
use crate::forward::setting::{self, Setting, Settings};
use shared_mem::cell::Cell;
use shared_mem::theta::Theta;
use std::ops::Range;
use twin::arm::Joints;
use twin::effects::{EffectInfo, Role, Shape, Stage, find, registry};

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
    /// What each number does to the arm.
    reaches: Vec<ArmReach>,
    /// The baseline's numbers: gains, and the object's parameters.
    pub baseline: Range<usize>,
    /// Effects.
    pub candidates: Vec<Candidate>,
}

/// One effect as a hypothesis.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// The effect.
    pub effect: &'static EffectInfo,
    /// Its numbers.
    pub numbers: Range<usize>,
    /// Those of them that are fitted.
    pub turned: Vec<usize>,
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
    /// Units at the strongest that is met in practice.
    pub largest: f64,
}

impl Candidate {
    /// Whether it acts on the arm itself; the others act on what the arm meets and on what the camera sees of it.
    #[must_use]
    pub fn is_of_arm(&self) -> bool {
        self.effect.stage == Stage::Control
    }

    /// One of the sizes at the strongest that is met in practice; `resting`: where it changes nothing.
    #[must_use]
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
    #[must_use]
    pub fn new(cell: &Cell, base: &Theta, ground: Option<&Ground>, peaks: &Joints) -> Self {
        let with_object = ground.is_some();
        let dof = base.arm.as_ref().map_or(0, |arm| arm.stiffness.len());
        let mut numbers = setting::gains(cell, base);
        if with_object {
            numbers.extend(setting::object_parameters(cell, base));
        }
        for (_, unknown) in &mut numbers {
            keep_known_gains(cell, unknown);
        }
        let baseline = 0..numbers.len();
        let mut candidates = Vec::new();
        let fits = |effect: &&EffectInfo| {
            let known = base.effects.iter().any(|given| given.name == effect.name);
            let visible = if effect.stage == Stage::Control { dof > 0 } else { with_object };
            visible && !known
        };
        for effect in registry().iter().filter(fits) {
            let at = numbers.len();
            numbers.extend(setting::effect_settings(effect, dof));
            for (setting, unknown) in &mut numbers[at..] {
                if let Some(bound) = bound_of(setting, peaks) {
                    unknown.step = BOUND_STEP / bound;
                }
            }
            candidates.push(Candidate::new(effect, at, &numbers, (ground, peaks)));
        }
        let joint = |setting| joint_of(setting).filter(|_| !(with_object && moves_the_tip_unseen(setting)));
        let joints = numbers.iter().map(|(setting, _)| joint(setting)).collect();
        let carried = numbers.iter().position(|(setting, _)| is_carried(setting));
        let reaches = numbers.iter().map(|(setting, _)| arm_reach(setting, carried)).collect();
        let (all, unknowns): (Vec<Setting>, Vec<Unknown>) = numbers.into_iter().unzip();
        Self { settings: Settings::new(base.clone(), all), unknowns, joints, reaches, baseline, candidates }
    }

    /// Where every search begins: the baseline's values, all effects at rest.
    #[must_use]
    pub fn start(&self) -> Vec<f64> {
        self.unknowns.iter().map(|unknown| unknown.start).collect()
    }

    /// The parameters that go with these numbers, without effects that change nothing.
    #[must_use]
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
    #[must_use]
    pub fn with_object_of(&self, mut numbers: Vec<f64>, others: &[f64]) -> Vec<f64> {
        for k in self.baseline.clone().filter(|k| !self.arm_feels(*k, &numbers)).collect::<Vec<_>>() {
            numbers[k] = others[k];
        }
        numbers
    }

    /// Whether the arm feels a number where the numbers are these.
    #[must_use]
    pub fn arm_feels(&self, number: usize, numbers: &[f64]) -> bool {
        match self.reaches[number] {
            ArmReach::Always => true,
            ArmReach::Never => false,
            ArmReach::With(other) => numbers[other] != 0.0,
        }
    }

    /// Whether the arm feels a candidate in one of its forms.
    #[must_use]
    pub fn arm_may_feel(&self, candidate: usize) -> bool {
        self.candidates[candidate].numbers.clone().any(|k| !matches!(self.reaches[k], ArmReach::Never))
    }

    /// Those of the numbers that the arm feels.
    #[must_use]
    pub fn felt_by_arm(&self, numbers: &[f64]) -> Vec<f64> {
        (0..numbers.len()).filter(|k| self.arm_feels(*k, numbers)).map(|k| numbers[k]).collect()
    }

    /// Index of the candidate with this name.
    #[must_use]
    pub fn find(&self, name: &str) -> Option<usize> {
        self.candidates.iter().position(|candidate| candidate.effect.name == name)
    }
}

fn joint_of(setting: &Setting) -> Option<usize> {
    match *setting {
        Setting::Stiffness(joint) | Setting::Damping(joint) => Some(joint),
        Setting::Effect { name, parameter, index, .. } => {
            let info = find(name)?.parameters.iter().find(|p| p.name == parameter)?;
            if info.shape == Shape::PerJoint { index } else { None }
        }
        _ => None,
    }
}

/// Whether a number of a joint moves the tip by what no sensor of the arm need show: nothing tells of a vertical joint's
/// encoder but what the tip hits.
fn moves_the_tip_unseen(setting: &Setting) -> bool {
    matches!(setting, Setting::Effect { name: "joint_encoder_offset", .. })
}

/// Whether the arm feels a number.
#[derive(Debug, Clone, Copy)]
enum ArmReach {
    Always,
    Never,
    /// Where another number is not zero.
    With(usize),
}

fn arm_reach(setting: &Setting, carried: Option<usize>) -> ArmReach {
    match (*setting, carried) {
        (Setting::Stiffness(_) | Setting::Damping(_), _) => ArmReach::Always,
        (Setting::Effect { name: TOOL_OFFSET, .. }, Some(carried)) => ArmReach::With(carried),
        (Setting::Effect { name, .. }, _) if find(name).is_some_and(|effect| effect.stage == Stage::Control) => {
            ArmReach::Always
        }
        _ => ArmReach::Never,
    }
}

/// The one effect on the hit that the arm may feel: where the tool's mass stands off with its tip.
const TOOL_OFFSET: &str = "tool_offset";
const CARRIED: &str = "carried";

fn is_carried(setting: &Setting) -> bool {
    matches!(setting, Setting::Effect { name: TOOL_OFFSET, parameter: CARRIED, .. })
}

/// How far gains stated by value may be off: cell.toml's own statement, and a quarter more.
const GAIN_TOLERANCE: f64 = 0.25;

/// Gains that cell.toml states by value are right to 20 %: without that, viscous friction is a damping that is off.
fn keep_known_gains(cell: &Cell, unknown: &mut Unknown) {
    let Some(controller) = &cell.controller else { return };
    let stated = (unknown.name.starts_with("stiffness") && controller.stiffness_range.is_none())
        || (unknown.name.starts_with("damping") && controller.damping_range.is_none());
    if stated {
        // The bounds are symmetric in the logarithm around the stated value.
        let nominal = (unknown.lower * unknown.upper).sqrt();
        unknown.lower = nominal * (1.0 - GAIN_TOLERANCE);
        unknown.upper = nominal * (1.0 + GAIN_TOLERANCE);
        unknown.start = unknown.start.clamp(unknown.lower, unknown.upper);
    }
}

impl Candidate {
    fn new(effect: &'static EffectInfo, at: usize, numbers: &[(Setting, Unknown)], met: Met<'_>) -> Self {
        let is_size = |setting: &Setting| match setting {
            Setting::Effect { parameter, .. } => {
                effect.parameters.iter().any(|p| p.name == *parameter && matches!(p.role, Role::Size { .. }))
            }
            _ => false,
        };
        let sizes: Vec<usize> = (at..numbers.len()).filter(|k| is_size(&numbers[*k].0)).collect();
        let kept = |setting: &Setting| matches!(setting, Setting::Effect { parameter, .. } if KEPT.contains(parameter));
        let turned = (at..numbers.len()).filter(|k| !kept(&numbers[*k].0)).collect();
        let alternatives = alternatives(effect, at, &sizes, numbers, met);
        Self { effect, numbers: at..numbers.len(), turned, sizes, alternatives }
    }
}

/// The torque at which a limit of a joint begins to bite [N m], where a number is such a limit.
fn bound_of(setting: &Setting, peaks: &Joints) -> Option<f64> {
    match *setting {
        Setting::Effect { name: TORQUE_SATURATION, index: Some(joint), .. } => {
            Some(peaks[joint]).filter(|peak| *peak > 0.0)
        }
        _ => None,
    }
}

/// A limit of its own for every joint: what it does depends on how hard the clips drive that joint, and above that it does
/// nothing at all.
fn biting(number: usize, peak: f64, unknown: &Unknown) -> Probe {
    let moves = vec![(number, (BITES * peak).recip().min(unknown.upper))];
    Probe { moves, one_sided: true, largest: LOWEST_LIMIT.recip() }
}

/// The one effect on torques that does nothing below a threshold.
pub const TORQUE_SATURATION: &str = "torque_saturation";
/// The one effect that has to be met in step.
pub const TORQUE_RIPPLE: &str = "torque_ripple";
/// The one effect on the slide that changes the hit as well.
pub const PRESSURE_DISTRIBUTION: &str = "pressure_distribution";
/// Its probe is a limit at this share of a joint's largest torque, its difference step is this share of it, and below this
/// share of it no limit is looked for.
const BITES: f64 = 0.9;
const BOUND_STEP: f64 = 0.01;
const LOWEST_LIMIT: f64 = 0.25;

/// Forms that no clip shows well enough to be worth their numbers: they keep the registry's default, or what an alternative
/// says.
const KEPT: [&str; 2] = ["creep", CARRIED];

/// The step of a probe as a share of what is met in practice.
const PROBE_SHARE: f64 = 0.1;

/// Where objects slid, and what the joints were asked for [N m].
type Met<'a> = (Option<&'a Ground>, &'a Joints);

fn alternatives(
    effect: &EffectInfo,
    at: usize,
    sizes: &[usize],
    numbers: &[(Setting, Unknown)],
    (ground, peaks): Met<'_>,
) -> Vec<Alternative> {
    let probe = |k: &usize| match bound_of(&numbers[*k].0, peaks) {
        Some(peak) => biting(*k, peak, &numbers[*k].1),
        None => probe(effect, *k, &numbers[*k]),
    };
    let probes: Vec<Probe> = sizes.iter().map(probe).collect();
    let index = |parameter: &str| -> Vec<usize> {
        let is = |setting: &Setting| matches!(setting, Setting::Effect { parameter: p, .. } if *p == parameter);
        (at..numbers.len()).filter(|k| is(&numbers[*k].0)).collect()
    };
    let with = |form: Vec<(usize, f64)>| Alternative { form, probes: probes.clone() };
    let set = |parameter: &str, value: f64| index(parameter).into_iter().map(|k| (k, value)).collect::<Vec<_>>();
    match effect.name {
        "joint_stribeck_friction" => [0.03, 0.1].map(|v| with(set("velocity", v))).to_vec(),
        "stribeck_sliding_friction" => [0.05, 0.1, 0.2].map(|v| with(set("velocity", v))).to_vec(),
        // About the base, or about the middle of a table in front of it.
        "camera_scale" => [0.0, 0.5].map(|x| with(vec![(index("centre")[0], x)])).to_vec(),
        // At rest as in motion, and none at rest.
        "joint_friction_asymmetry" => [0.0, 0.01].map(|fading| with(set("fading", fading))).to_vec(),
        // Rigid flanks, and such as yield like the gears of an arm.
        "joint_backlash" => [1e-7, 4e-5].map(|compliance| with(set("compliance", compliance))).to_vec(),
        // An object that pivots about feet, and one that pivots about its corners.
        PRESSURE_DISTRIBUTION => [0.75, 1.0].map(|pivot| with(set("pivot", pivot))).to_vec(),
        TOOL_OFFSET => [0.0, 1.0].map(|share| with(set(CARRIED, share))).to_vec(),
        "payload" => [0.0, 0.06].map(|z| with(vec![(index("centre")[2], z)])).to_vec(),
        "anisotropic_friction" => {
            let (size, axis) = (sizes[0], index("axis")[0]);
            let turned = |angle: f64| Probe { moves: vec![(size, 0.1), (axis, angle)], one_sided: false, largest: 5.0 };
            let probes = vec![turned(0.0), turned(std::f64::consts::FRAC_PI_4)];
            // Slips that are turned aside as far as they can be, and not at all.
            [1.0, 0.0].map(|drift| Alternative { form: set("drift", drift), probes: probes.clone() }).to_vec()
        }
        "friction_patch" => {
            let [direction, distance, radius] = ["direction", "distance", "radius"].map(|form| index(form)[0]);
            let place = |patch: Patch| {
                with(vec![(direction, patch.direction), (distance, patch.distance), (radius, patch.curvature)])
            };
            ground.map(Ground::patches).unwrap_or_default().into_iter().map(place).collect()
        }
        TORQUE_RIPPLE => {
            let (order, phase) = (index("order"), index("phase"));
            let orders = [10.0, 20.0, 40.0, 60.0, 100.0, 200.0];
            orders.map(|k| ripple(sizes, (&order, k), &phase)).to_vec()
        }
        _ => vec![with(Vec::new())],
    }
}

/// Sine and cosine of every joint's ripple.
fn ripple(sizes: &[usize], (order, k): (&[usize], f64), phase: &[usize]) -> Alternative {
    let quarter = |angle: f64| {
        let of = move |(size, phase): (&usize, &usize)| Probe {
            moves: vec![(*size, 0.1), (*phase, angle)],
            one_sided: false,
            largest: 5.0,
        };
        sizes.iter().zip(phase).map(of).collect::<Vec<_>>()
    };
    let probes = [quarter(0.0), quarter(std::f64::consts::FRAC_PI_2)].concat();
    Alternative { form: order.iter().map(|index| (*index, k)).collect(), probes }
}

fn probe(effect: &EffectInfo, number: usize, (setting, unknown): &(Setting, Unknown)) -> Probe {
    let Setting::Effect { parameter, inverse, .. } = setting else { unreachable!("sizes belong to effects") };
    let info = effect.parameters.iter().find(|p| p.name == *parameter).expect("a size is a parameter");
    let [lo, hi] = info.plausible;
    let reach = if *inverse { lo.recip() } else { (hi - unknown.start).max(unknown.start - lo) };
    // The registry's range reaches to hobby servos; gears of an arm have a tenth of that play.
    let reach = if effect.name == "joint_backlash" { 0.1 * reach } else { reach };
    let one_sided = *inverse || unknown.lower >= unknown.start || unknown.upper <= unknown.start;
    let way = if unknown.upper > unknown.start { 1.0 } else { -1.0 };
    let share = if info.shape == Shape::PerJoint || *inverse { PROBE_SHARE } else { 0.5 * PROBE_SHARE };
    Probe { moves: vec![(number, unknown.start + way * share * reach)], one_sided, largest: 1.0 / share }
}
