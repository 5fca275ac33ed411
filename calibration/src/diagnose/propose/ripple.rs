//! Where the fit of a torque ripple begins: the order at which each joint's residuals follow its position best.
//!
//! A ripple a few periods a turn off shows nothing of the true one: it runs out of step within a joint's travel, and no
//! slope leads from one to the other. So all orders are tried in steps that a fit can bridge, every joint by itself (a
//! periodogram over the position instead of over time, by least squares: Lomb 1976).

use super::Around;
use inference::likelihood::Reach;
use inference::likelihood::random_effects::OwnNumbers;
use nalgebra::{Matrix2, Vector2};
use rayon::prelude::*;
use std::f64::consts::FRAC_PI_2;

/// Orders are this far apart [periods per turn]: half of it is a third of a period within a joint's travel of 1 rad.
const ORDER_STEP: f64 = 4.0;
/// So many clips are looked at: a joint that turns through a radian or two in each tells its order from all others there,
/// and every further one would cost two simulations an order.
const MAX_CLIPS: usize = 2;
/// Strength at which the answer is looked at [N m].
const PROBE_NM: f64 = 0.05;

/// Two columns against the residuals of one joint.
#[derive(Debug, Clone, Copy, Default)]
struct Waves {
    squares: Matrix2<f64>,
    product: Vector2<f64>,
}

impl Waves {
    /// Strengths of sine and cosine that take most of the residuals, and how much that is.
    fn best(&self) -> Option<(Vector2<f64>, f64)> {
        let strengths = -(self.squares.try_inverse()? * self.product);
        Some((strengths, -strengths.dot(&self.product)))
    }
}

/// Numbers with the candidate's ripple at the order, strength and phase that suit each joint best; `None` where the twin has
/// no answer. `from`: what acts already, and the clips.
pub(in crate::diagnose) fn start<O: OwnNumbers>(at: &Around<'_, O>, candidate: usize) -> Option<Vec<f64>> {
    let Around { bench, from, weights } = at;
    let ripple = &bench.library.candidates[candidate];
    let orders: Vec<usize> = ripple.alternatives.first()?.form.iter().map(|(k, _)| *k).collect();
    let phases: Vec<usize> =
        ripple.numbers.clone().filter(|k| !ripple.sizes.contains(k) && !orders.contains(k)).collect();
    let range = &bench.library.unknowns[*orders.first()?];
    let tried: Vec<f64> = (0..)
        .map(|step| range.lower + ORDER_STEP * f64::from(step))
        .take_while(|order| *order <= range.upper)
        .collect();
    let with = |order: f64, phase: f64| {
        let mut full = from.full.clone();
        ripple.sizes.iter().for_each(|k| full[*k] = PROBE_NM);
        orders.iter().for_each(|k| full[*k] = order);
        phases.iter().for_each(|k| full[*k] = phase);
        full
    };
    let of_clip = |clip: usize| -> Option<Vec<Vec<Waves>>> {
        let own = from.own(clip, bench.scatter.count());
        let mut base = Vec::new();
        bench.evidence.residuals(clip, &from.full, &own, &mut base).ok()?;
        let column = |full: &[f64]| {
            let mut out = Vec::new();
            bench.evidence.changed(clip, (full, &own), (Reach::Arm, &base, Some((&from.full, &own))), &mut out).ok()?;
            Some(out)
        };
        let waves = |order: &f64| {
            let [sine, cosine] = [column(&with(*order, 0.0))?, column(&with(*order, FRAC_PI_2))?];
            let mut joints = vec![Waves::default(); ripple.sizes.len()];
            for (row, place) in bench.evidence.rows(clip).iter().enumerate() {
                let channel = &bench.evidence.channels()[place.channel];
                let Some(joint) = channel.joint.and_then(|joint| joints.get_mut(joint)) else { continue };
                let (weight, rest) = (weights[place.channel].powi(2), base[row]);
                let moved = Vector2::new(sine[row] - rest, cosine[row] - rest) / PROBE_NM;
                joint.squares += moved * moved.transpose() * weight;
                joint.product += moved * (rest * weight);
            }
            Some(joints)
        };
        tried.iter().map(waves).collect()
    };
    let looked_at = &from.fitted[..from.fitted.len().min(MAX_CLIPS)];
    let clips: Vec<Vec<Vec<Waves>>> = looked_at.par_iter().map(|fitted| of_clip(fitted.clip)).collect::<Option<_>>()?;
    let mut full = from.full.clone();
    for (joint, size) in ripple.sizes.iter().enumerate() {
        let over_clips = |order: usize| {
            clips.iter().map(|clip| clip[order][joint]).fold(Waves::default(), |sum, one| Waves {
                squares: sum.squares + one.squares,
                product: sum.product + one.product,
            })
        };
        let found = (0..tried.len()).filter_map(|order| over_clips(order).best().map(|best| (order, best)));
        let (order, (strengths, _)) = found.max_by(|a, b| a.1.1.total_cmp(&b.1.1))?;
        full[*size] = strengths.norm().min(bench.library.unknowns[*size].upper);
        (full[orders[joint]], full[phases[joint]]) = (tried[order], strengths.y.atan2(strengths.x));
    }
    Some(full)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnose::library::Library;
    use crate::diagnose::test_bench::{ONCE, on_bench, shipped};
    use inference::likelihood::setting;
    use shared_mem::theta::{EffectTheta, Theta};
    use worlds::world::{Fault, Kind, World};

    #[test]
    fn every_joint_is_met_at_its_own_order() {
        let cell = shipped();
        let well = World::draw(3, Kind::Excitation, Fault::Nothing, &cell);
        let base = setting::complete(&cell, Some(&well.hidden)).expect("a cell");
        let (amplitude, order) = ([0.6, 0.6, 0.6, 0.6, 0.3, 0.3, 0.3], [33.0, 61.7, 161.3, 77.0, 145.0, 111.1, 52.4]);
        let parameters =
            [("amplitude", amplitude), ("order", order)].map(|(name, of)| (name.to_owned(), of.to_vec().into()));
        let rippled = EffectTheta { name: "torque_ripple".into(), parameters: parameters.into() };
        let world = World { hidden: Theta { effects: vec![rippled], ..well.hidden.clone() }, ..well };
        let library = Library::new(&cell, &base, None, &[87.0; 8]);
        let candidate = library.find("torque_ripple").expect("a candidate");
        let begun = on_bench((&cell, &world), &library, |bench, even| {
            let baseline = bench.fit(&[], library.start(), &[0, 1], even, None, ONCE).expect("a fit");
            start(&super::super::around(bench, &baseline, even), candidate).expect("numbers")
        });
        let orders = library.candidates[candidate].alternatives[0].form.iter().map(|(k, _)| begun[*k]);
        for (joint, (found, order)) in orders.zip(order).enumerate() {
            assert!((found - order).abs() < ORDER_STEP, "joint {joint}: {found} instead of {order}");
        }
    }
}
