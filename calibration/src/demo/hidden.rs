//! The truth that the demo hides from its twin: gains that differ from cell.toml as much as a laboratory admits, and an
//! effect that no twin has by itself.

use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64Mcg;
use shared_mem::cell::Controller;
use shared_mem::theta::{ArmTheta, EffectTheta, Theta};

/// Gains lie within this share of the nominal ones: what cell.toml promises unless it says otherwise.
const WITHIN: f64 = 0.2;

/// Draws every stiffness and damping of the robot by `seed`.
pub(super) fn gains(nominal: &Controller, seed: u64) -> Theta {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let mut draw = |values: &[f64]| values.iter().map(|v| v * rng.random_range(1.0 - WITHIN..1.0 + WITHIN)).collect();
    let arm = ArmTheta { stiffness: draw(&nominal.stiffness), damping: draw(&nominal.damping) };
    Theta { arm: Some(arm), ..Theta::default() }
}

/// Effects that are hidden, each with the parameter that says how strong it is, and that parameter's range [SI].
const EFFECTS: [(&str, &str, [f64; 2]); 4] = [
    ("command_delay", "delay", [0.008, 0.016]),
    ("command_lag", "time_constant", [0.008, 0.016]),
    ("torque_delay", "delay", [0.002, 0.004]),
    ("payload", "mass", [0.3, 0.6]),
];

/// The same of strokes, on the way of the object.
const EFFECTS_OF_STROKES: [(&str, &str, [f64; 2]); 3] = [
    ("camera_latency", "latency", [0.015, 0.03]),
    ("tracker_smoothing", "time_constant", [0.02, 0.05]),
    ("velocity_dependent_friction", "slope", [0.15, 0.3]),
];

/// Draws an effect on the arm by `seed`.
pub(super) fn effect(seed: u64) -> EffectTheta {
    drawn(&EFFECTS, seed)
}

/// Draws an effect on an object's way by `seed`.
pub(super) fn effect_of_strokes(seed: u64) -> EffectTheta {
    drawn(&EFFECTS_OF_STROKES, seed)
}

fn drawn(effects: &[(&str, &str, [f64; 2])], seed: u64) -> EffectTheta {
    let mut rng = Pcg64Mcg::seed_from_u64(seed);
    let (name, parameter, [lo, hi]) = effects[rng.random_range(0..effects.len())];
    EffectTheta { name: name.into(), parameters: [(parameter.into(), rng.random_range(lo..hi).into())].into() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_hidden_effect_is_one_that_the_simulated_cell_knows() {
        let names = |drawn: fn(u64) -> EffectTheta| -> std::collections::BTreeSet<String> {
            let name = |seed| {
                let theta = Theta { effects: vec![drawn(seed)], ..Theta::default() };
                twin::effects::Effects::from_theta(&theta.effects, 7).expect("an effect of the registry");
                theta.effects[0].name.clone()
            };
            (0..40).map(name).collect()
        };
        assert_eq!((names(effect).len(), names(effect_of_strokes).len()), (EFFECTS.len(), EFFECTS_OF_STROKES.len()));
    }

    #[test]
    fn every_gain_is_hidden_within_a_fifth_and_the_seed_decides_where() {
        let nominal = Controller { stiffness: vec![600.0; 7], damping: vec![50.0; 7], ..Controller::default() };
        let arm = gains(&nominal, 4).arm.expect("an arm");
        assert!(arm.stiffness.iter().all(|k| (480.0..720.0).contains(k) && *k != 600.0));
        assert!(arm.damping.iter().all(|d| (40.0..60.0).contains(d) && *d != 50.0));
        assert_eq!(gains(&nominal, 4), gains(&nominal, 4));
        assert_ne!(gains(&nominal, 4), gains(&nominal, 5));
    }
}
