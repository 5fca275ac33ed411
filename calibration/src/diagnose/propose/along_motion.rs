//! Where the fit of a dry friction begins whose gains are known by range alone: gains, friction and unknown weight with which the law's
//! torque, along the measured motion, is what the arm takes (equation error).
//!
//! A joint that sticks stays off its command until the command has gone on by friction over stiffness. Where damping acts on the measured
//! velocity alone, gains that were fitted without friction imitate that by a damping many times too large, and from there no slope
//! leads back: what simulated joints do depends on where they stuck before. Along the measured motion nothing is simulated, and all
//! but the stiffness follows by linear least squares. The stiffness hardly shows there, since slow motion tells ratios alone; it is
//! taken where the simulated clips cost least, each joint by itself.

use super::Around;
use crate::diagnose::known_gains;
use crate::diagnose::library::{Candidate, Library};
use inference::estimate::Unknown;
use inference::likelihood::Setting;
use inference::likelihood::arm::following::Moment;
use inference::likelihood::random_effects::OwnNumbers;
use nalgebra::{DMatrix, DVector};
use rayon::prelude::*;
use std::ops::RangeInclusive;
use twin::arm::JointState;
use twin::effects::Effects;

/// Stiffnesses are tried at these powers of two times the middle of their range.
const STIFFNESS_POWERS: RangeInclusive<i32> = -4..=4;
/// A joint moves that is faster [rad/s]: the speed that half an encoder's step of a hobby servo (1.5 mrad) seems to be within the
/// 80 ms over which motion is smoothed, three times over.
const MIN_SPEED: f64 = 0.03;
/// So many moments for each number at least.
const MIN_MOMENTS_PER_NUMBER: usize = 10;
/// Least squares are solved so often, moments weighed anew each time by how far they were off.
const REWEIGHTINGS: usize = 15;
/// Beyond so many typical deviations a moment counts less and less (Cauchy's weights, with their usual constant; Holland and Welsch
/// 1977).
const CAUCHY_SCALE: f64 = 2.385;

/// Numbers at which the fit of a candidate begins; `None` where it is no dry friction, the gains are known, or the law is another.
pub(in crate::diagnose) fn start<O: OwnNumbers>(at: &Around<'_, O>, candidate: &Candidate) -> Option<Vec<f64>> {
    let (library, from) = (at.bench.library, at.from);
    let joints = Joint::all(library, candidate);
    if joints.is_empty() {
        return None;
    }
    let moments: Vec<Moment> = from.clips().par_iter().flat_map(|clip| at.bench.evidence.following(*clip)).collect();
    if moments.is_empty() {
        return None;
    }
    let with = |power: i32| {
        let solved = joints.iter().filter_map(|joint| joint.solved(library, &from.full, &moments, power));
        let mut full = from.full.clone();
        solved.flatten().for_each(|(number, value)| full[number] = value);
        full
    };
    let tried: Vec<Vec<f64>> = STIFFNESS_POWERS.map(with).collect();
    let costs = tried.iter().map(|full| of_joints(at, full));
    let costs: Vec<Vec<f64>> = costs.take_while(|_| !at.bench.interrupt.asked()).collect();
    let mut full = from.full.clone();
    for joint in &joints {
        let cost = |power: &usize| costs[*power].get(joint.place).copied().unwrap_or(f64::INFINITY);
        let best = (0..costs.len()).min_by(|a, b| cost(a).total_cmp(&cost(b)))?;
        joint.numbers().for_each(|number| full[number] = tried[best][number]);
    }
    // A joint that creeps leaves within seconds what one that sticks keeps: what is held while it is searched at its lower end.
    let mut sticking = full.clone();
    candidate.held.iter().for_each(|number| sticking[*number] = library.unknowns[*number].lower);
    Some(if at.cost(&sticking) < at.cost(&full) { sticking } else { full })
}

/// What the clips of a hypothesis cost in the channels of each joint at other numbers.
fn of_joints<O: OwnNumbers>(at: &Around<'_, O>, full: &[f64]) -> Vec<f64> {
    let Around { bench, from, weights } = at;
    let channels = bench.evidence.channels();
    let dof = channels.iter().filter_map(|channel| channel.joint).max().map_or(0, |last| last + 1);
    let of_clip = |clip: usize| {
        let (mut costs, mut out) = (vec![0.0; dof], Vec::new());
        if bench.evidence.residuals(clip, full, &from.own(clip, bench.scatter.count()), &mut out).is_err() {
            return vec![f64::INFINITY; dof];
        }
        for (residual, row) in out.iter().zip(bench.evidence.rows(clip)) {
            if let Some(joint) = channels[row.channel].joint {
                costs[joint] += (weights[row.channel] * residual).powi(2);
            }
        }
        costs
    };
    let add = |a: Vec<f64>, b: Vec<f64>| a.iter().zip(&b).map(|(a, b)| a + b).collect();
    from.fitted.par_iter().map(|fitted| of_clip(fitted.clip)).reduce(|| vec![0.0; dof], add)
}

/// A joint whose gains are known by range, and the numbers of its own that change what its motor has to give.
struct Joint {
    /// From 0 on.
    place: usize,
    stiffness: usize,
    damping: usize,
    /// Those of friction and weight.
    taken: Vec<usize>,
}

impl Joint {
    /// All joints with sizes of the candidate, where it is a dry friction; none otherwise.
    fn all(library: &Library, candidate: &Candidate) -> Vec<Self> {
        let settings = library.settings.settings();
        let of = |setting: Setting| library.baseline.clone().find(|k| settings[*k] == setting);
        let known = |k: usize| !known_gains::by_range(&library.unknowns[k]);
        let joint = |place: usize| {
            let (stiffness, damping) = (of(Setting::Stiffness(place))?, of(Setting::Damping(place))?);
            let of_joint = |k: &usize| library.joints[*k] == Some(place) && *k != stiffness && *k != damping;
            let sizes: Vec<usize> = candidate.sizes.iter().copied().filter(of_joint).collect();
            let takes = sizes.iter().any(|size| is_dry_friction(library, candidate, place, *size));
            let taken = library.baseline.clone().filter(of_joint).chain(sizes).collect();
            (takes && !known(stiffness)).then_some(Self { place, stiffness, damping, taken })
        };
        (0..dof(library)).filter_map(joint).collect()
    }

    fn numbers(&self) -> impl Iterator<Item = usize> {
        [self.stiffness, self.damping].into_iter().chain(self.taken.iter().copied())
    }

    /// The joint's numbers at one stiffness; `None` where it hardly moved.
    fn solved(&self, library: &Library, full: &[f64], moments: &[Moment], power: i32) -> Option<Vec<(usize, f64)>> {
        let joint = self.place;
        let moving: Vec<&Moment> = moments.iter().filter(|moment| moment.state.dq[joint].abs() > MIN_SPEED).collect();
        if moving.len() < MIN_MOMENTS_PER_NUMBER * (1 + self.taken.len()) {
            return None;
        }
        let Unknown { lower, upper, .. } = library.unknowns[self.stiffness];
        let stiffness = ((lower * upper).sqrt() * 2.0_f64.powi(power)).clamp(lower, upper);
        let (mut damping, mut found) = (0.0, DVector::zeros(0));
        // What friction that follows the load takes depends on the damping's torque, which is found with it.
        for _ in 0..2 {
            let asked = |moment: &&Moment| stiffness * moment.behind[joint] - damping * moment.state.dq[joint];
            let motor: Vec<f64> = moving.iter().map(asked).collect();
            let (columns, others) = self.columns(library, full, &moving, &motor)?;
            let wanted = moving.iter().map(|moment| stiffness * moment.behind[joint] - moment.load[joint]);
            found = robust(&columns, &(DVector::from_iterator(moving.len(), wanted) - others))?;
            damping = found[0].max(0.0);
        }
        let numbers = [self.damping].into_iter().chain(self.taken.iter().copied());
        let within = |(number, value): (usize, &f64)| {
            let unknown = &library.unknowns[number];
            (number, value.clamp(unknown.lower, unknown.upper))
        };
        Some(numbers.zip(&found).map(within).chain([(self.stiffness, stiffness)]).collect())
    }

    /// What the damping and each number of friction and weight take of the motor's torque [N m] at every moment, by unit of the number;
    /// and what effects take that act already.
    fn columns(
        &self,
        library: &Library,
        full: &[f64],
        moving: &[&Moment],
        motor: &[f64],
    ) -> Option<(DMatrix<f64>, DVector<f64>)> {
        let mut resting = full.to_vec();
        self.taken.iter().for_each(|k| resting[*k] = library.unknowns[*k].start);
        let taken = |full: &[f64]| -> Option<DVector<f64>> {
            let effects = effects(library, full)?;
            let of = |(moment, motor): (&&Moment, &f64)| effects.arm.taken(self.place, &moment.state, *motor);
            Some(DVector::from_iterator(moving.len(), moving.iter().zip(motor).map(of)))
        };
        let others = taken(&resting)?;
        let speeds = moving.iter().map(|moment| moment.state.dq[self.place]);
        let mut columns = vec![DVector::from_iterator(moving.len(), speeds)];
        for number in &self.taken {
            let (mut moved, step) = (resting.clone(), library.unknowns[*number].step);
            moved[*number] += step;
            columns.push((taken(&moved)? - &others) / step);
        }
        Some((DMatrix::from_columns(&columns), others))
    }
}

fn dof(library: &Library) -> usize {
    library.settings.base().arm.as_ref().map_or(0, |arm| arm.stiffness.len())
}

fn effects(library: &Library, full: &[f64]) -> Option<Effects> {
    Effects::from_theta(&library.theta(full).effects, dof(library)).ok()
}

/// Whether a size of a candidate takes of a motor's torque what turns round with the motion and hardly depends on how fast it is.
fn is_dry_friction(library: &Library, candidate: &Candidate, joint: usize, size: usize) -> bool {
    let mut full = library.start();
    let strongest = candidate.strongest(size, library.unknowns[size].start);
    full[size] = strongest.unwrap_or(library.unknowns[size].start);
    let Some(effects) = effects(library, &full) else { return false };
    let at = |dq: f64| {
        let mut state = JointState::default();
        state.dq[joint] = dq;
        effects.arm.taken(joint, &state, 1.0)
    };
    at(MIN_SPEED) > 0.0 && at(-MIN_SPEED) < 0.0 && at(2.0 * MIN_SPEED) < 1.5 * at(MIN_SPEED)
}

/// Least squares in which what is far off counts less; `None` where the columns do not tell their coefficients.
fn robust(columns: &DMatrix<f64>, wanted: &DVector<f64>) -> Option<DVector<f64>> {
    let mut weights = DVector::from_element(wanted.len(), 1.0);
    let mut found = None;
    for _ in 0..REWEIGHTINGS {
        let weighed = DMatrix::from_fn(columns.nrows(), columns.ncols(), |i, k| weights[i] * columns[(i, k)]);
        let mut square = weighed.transpose() * columns;
        // A joint that hardly turned tells its weight's constant from the cosine by nothing but rounding.
        let most = square.diagonal().max();
        (0..square.nrows()).for_each(|k| square[(k, k)] += 1e-9 * most);
        let solution = square.cholesky()?.solve(&(weighed.transpose() * wanted));
        let left = wanted - columns * &solution;
        let mut sizes: Vec<f64> = left.iter().map(|left| left.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        // The median of what is left, as a normal distribution's sigma.
        let typical = 1.4826 * sizes.get(sizes.len() / 2)?;
        weights = left.map(|left| 1.0 / (1.0 + (left / (CAUCHY_SCALE * typical).max(f64::MIN_POSITIVE)).powi(2)));
        found = Some(solution);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::test_bench::{ONCE, on_bench};
    use inference::likelihood::setting;
    use shared_mem::cell::Cell;
    use shared_mem::msg::MAX_JOINTS;
    use shared_mem::theta::{ArmTheta, Theta};
    use std::path::Path;
    use worlds::world::{Fault, Kind, World};

    const CELL: &str = "[robot]\njoints = [\"shoulder\", \"elbow\"]\n[controller]\nkind = \"joint_pd\"\n\
                        stiffness_range = [0.5, 200.0]\ndamping_range = [0.0, 40.0]\n";
    /// Held by 30 and 40 mrad.
    const HIDDEN: &str = "[arm]\nstiffness = [90.0, 60.0]\ndamping = [9.0, 5.0]\n\
        [[effect]]\nname = \"joint_weight\"\nconstant = [0.2, 0.0]\nsine = [2.8, 1.9]\ncosine = [-0.6, 1.3]\n\
        [[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = [2.7, 2.4]\ncreep = 0.0\n";

    /// Where the fit of a candidate begins, in a cell of this text in which [`HIDDEN`] holds.
    fn found(cell: &str, candidate: &str) -> Option<Theta> {
        let cell = Cell::parse(cell, Path::new("cell.toml")).expect("a cell");
        let mut world = World::draw(1, Kind::Excitation, Fault::Nothing, &cell);
        let hidden: Theta = shared_mem::toml_file::parse(HIDDEN, Path::new("theta.toml")).expect("a theta.toml");
        world.hidden = Theta { effects: hidden.effects, arm: hidden.arm, ..world.hidden };
        let base = setting::complete(&cell, None).expect("a cell");
        let library = Library::new(&cell, &base, None, &[10.0; MAX_JOINTS]);
        let candidate = &library.candidates[library.find(candidate).expect("a candidate")];
        on_bench((&cell, &world), &library, |bench, even| {
            let baseline = bench.fit(&[], library.start(), &[0, 1], even, None, ONCE).expect("a fit");
            start(&super::super::around(bench, &baseline, even), candidate).map(|full| library.theta(&full))
        })
    }

    #[test]
    fn a_joint_that_sticks_far_off_its_command_begins_near_its_friction() {
        let begun = found(CELL, "joint_coulomb_friction").expect("numbers");
        let ArmTheta { stiffness, damping } = begun.arm.expect("gains");
        let level = begun.effects.iter().find_map(|effect| effect.parameters.get("coulomb"));
        let level: Vec<f64> = level
            .and_then(|level| level.as_array())
            .expect("levels")
            .iter()
            .filter_map(toml::Value::as_float)
            .collect();
        for (joint, [held, late]) in [[0.03, 0.1], [0.04, 5.0 / 60.0]].into_iter().enumerate() {
            let [friction, lag] = [level[joint], damping[joint]].map(|number| number / stiffness[joint]);
            assert!((friction / held - 1.0).abs() < 0.1, "joint {joint} is held by {friction} rad");
            assert!((lag / late - 1.0).abs() < 0.2, "joint {joint} lags by {lag} s");
            assert!((0.5..2.0).contains(&(stiffness[joint] / [90.0, 60.0][joint])), "joint {joint}: {stiffness:?}");
        }
    }

    #[test]
    fn what_is_no_dry_friction_and_laws_that_are_given_the_desired_velocity_begin_where_the_search_stands() {
        assert_eq!(found(CELL, "joint_viscous_friction"), None);
        assert_eq!(found(&CELL.replace("joint_pd", "joint_impedance"), "joint_coulomb_friction"), None);
    }
}
