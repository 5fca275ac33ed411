//! Which states an arm and an object can have. A simulation that flies apart answers with others; squared they are no numbers any more.

use super::ability::Quantity;
use super::{POSE, Question};

/// Beyond this no joint and no object has a number, as in recordings [rad, rad/s, N m, m].
const MAX_PHYSICAL_VALUE: f64 = 1e6;

impl Quantity {
    fn unit(self) -> &'static str {
        match self {
            Self::Position => "rad",
            Self::Velocity => "rad/s",
            Self::Torque | Self::DesiredTorque => "N m",
        }
    }
}

/// What no arm or object has of the states that a question was answered with, as many as it asks for; `None` where all are possible.
pub(super) fn impossible(question: &Question<'_>, states: &[f64]) -> Option<String> {
    let Question { dof, readings, times, object, .. } = *question;
    let columns = readings.len() * dof;
    let (of_arm, poses) = states.split_at(times.len() * columns);
    let is_beyond = |number: &f64| !number.is_finite() || number.abs() > MAX_PHYSICAL_VALUE;
    if let Some(place) = of_arm.iter().position(is_beyond) {
        let (quantity, joint, time) = (readings[place % columns / dof], place % dof + 1, times[place / columns]);
        let whose = format!("{} of joint {joint} at {time:.3} s", quantity.name());
        return Some(sentence(&whose, of_arm[place], quantity.unit()));
    }
    let place = poses.iter().position(is_beyond)?;
    let time = object.and_then(|object| object.times.get(place / POSE)).copied().unwrap_or_default();
    Some(sentence(&format!("the object's pose at {time:.3} s"), poses[place], "m"))
}

fn sentence(whose: &str, number: f64, unit: &str) -> String {
    let what = if number.is_finite() {
        format!("{whose} is {number:e} {unit}, beyond {MAX_PHYSICAL_VALUE:e}")
    } else {
        format!("a state of the engine is no number: {whose}")
    };
    format!("{what}; where this is so from the beginning on, its model and the gains of cell.toml do not go together")
}
