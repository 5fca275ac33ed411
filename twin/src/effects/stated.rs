//! What cell.toml states of a controller beside its law: an integral part, drives that run out of voltage. They act as the effects of
//! that name do, and what theta.toml says of one replaces it.

use super::{EffectError, Effects};
use shared_mem::cell::Controller;
use shared_mem::theta::EffectTheta;
use toml::Value;

/// The blocks that cell.toml's `[controller]` stands for.
pub fn stated(controller: Option<&Controller>) -> Vec<EffectTheta> {
    let Some(controller) = controller else { return Vec::new() };
    let given = [
        ("integral_action", "rate", &controller.integral_rate),
        ("voltage_saturation", "limit", &controller.voltage_limit),
    ];
    let block = |(name, parameter, values): (&str, &str, &Vec<f64>)| EffectTheta {
        name: name.into(),
        parameters: [(parameter.to_owned(), Value::Array(values.iter().copied().map(Value::Float).collect()))].into(),
    };
    given.into_iter().filter(|(_, _, values)| !values.is_empty()).map(block).collect()
}

impl Effects {
    /// The effects of a cell, for an arm of `dof` joints: those of a theta.toml, and what the controller is stated to do.
    ///
    /// # Errors
    /// [`EffectError`] naming the effect, the parameter and the remedy.
    pub fn of(controller: Option<&Controller>, blocks: &[EffectTheta], dof: usize) -> Result<Self, EffectError> {
        let mut all = stated(controller);
        all.retain(|stated| blocks.iter().all(|block| block.name != stated.name));
        all.extend(blocks.iter().cloned());
        Self::from_theta(&all, dof)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_controller_is_stated_to_do_acts_unless_parameters_say_otherwise() {
        let controller =
            Controller { integral_rate: vec![3.0, 4.0], voltage_limit: vec![1.0, 2.0], ..Controller::default() };
        let all = Effects::of(Some(&controller), &[], 2).expect("known effects");
        assert_eq!(all, Effects::from_theta(&stated(Some(&controller)), 2).expect("the same"));
        assert!(all.arm.integral_action.is_some() && all.arm.voltage_saturation.is_some());
        let off =
            EffectTheta { name: "integral_action".into(), parameters: [("rate".into(), Value::Float(0.0))].into() };
        let found = Effects::of(Some(&controller), &[off], 2).expect("known effects");
        assert!(found.arm.integral_action.is_none() && found.arm.voltage_saturation.is_some());
        assert!(Effects::of(Some(&controller), &[], 3).is_err(), "one number a joint");
        assert!(Effects::of(None, &[], 7).expect("none").is_none());
    }
}
