//! What to do about an effect that was found, in plain words: in the cell, and in a model of it, whichever simulator it is for.
//!
//! Each effect says it in its own file, from the numbers that were identified. Numbers are SI with three digits that count;
//! angles are in degrees too where a person turns something.

use super::parameter::{Parameter, Role};
use nalgebra::{Rotation3, Vector3};
use shared_mem::cell::{Cell, GRAVITY};

/// Where an identified number is this close to the one that changes nothing, as a share of the largest, it is not worth a word.
const NOTHING: f64 = 0.02;

/// What to do about an effect.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remedy {
    /// In the cell: on the hardware, in the robot's settings, or in cell.toml.
    pub in_cell: String,
    /// In a model of the cell.
    pub in_model: String,
}

/// Parameters of an effect with the numbers that were found for them, in the cell it was found in.
pub struct Found<'a> {
    parameters: &'static [Parameter],
    numbers: &'a dyn Fn(&str) -> Option<Vec<f64>>,
    cell: &'a Cell,
}

impl Remedy {
    pub(super) fn new(in_cell: impl Into<String>, in_model: impl Into<String>) -> Self {
        Self { in_cell: in_cell.into(), in_model: in_model.into() }
    }
}

impl<'a> Found<'a> {
    pub(super) fn new(
        parameters: &'static [Parameter],
        numbers: &'a dyn Fn(&str) -> Option<Vec<f64>>,
        cell: &'a Cell,
    ) -> Self {
        Self { parameters, numbers, cell }
    }

    /// The cell it was found in.
    pub(super) fn cell(&self) -> &Cell {
        self.cell
    }

    fn resting(&self, name: &str) -> f64 {
        let parameter = self.parameters.iter().find(|p| p.name == name);
        parameter.expect("an effect asks for its own parameters").resting_value()
    }

    /// All numbers of a parameter.
    pub(super) fn all(&self, name: &str) -> Vec<f64> {
        (self.numbers)(name).filter(|all| !all.is_empty()).unwrap_or_else(|| vec![self.resting(name)])
    }

    /// A single number.
    pub(super) fn number(&self, name: &str) -> f64 {
        self.all(name)[0]
    }

    pub(super) fn vector<const N: usize>(&self, name: &str) -> [f64; N] {
        let all = self.all(name);
        std::array::from_fn(|i| all.get(i).copied().unwrap_or(0.0))
    }

    /// The joints in which a parameter says something, with their numbers: `1.1 N m in joint 2, 0.4 N m in joint 5`.
    pub(super) fn joints(&self, name: &str, unit: &str) -> String {
        self.joints_by(name, &|value| with_unit(value, unit))
    }

    /// The same, each number in words of its own.
    pub(super) fn joints_by(&self, name: &str, words: &dyn Fn(f64) -> String) -> String {
        let (all, resting) = (self.all(name), self.resting(name));
        let parameter = self.parameters.iter().find(|p| p.name == name);
        let is_size = parameter.is_some_and(|p| matches!(p.role, Role::Size { .. }));
        if let [one] = all[..] {
            return format!("{} in every joint", words(one));
        }
        let off =
            |value: &f64| if resting.is_finite() { (value - resting).abs() } else { f64::from(value.is_finite()) };
        let most = all.iter().map(off).fold(0.0, f64::max);
        let says = |value: &f64| !is_size || off(value) > NOTHING * most;
        let each = all.iter().enumerate().filter(|(_, value)| says(value));
        let each: Vec<String> =
            each.map(|(joint, value)| format!("{} in joint {}", words(*value), joint + 1)).collect();
        if each.is_empty() { "nothing in any joint".into() } else { each.join(", ") }
    }
}

/// A number with three digits that count, without needless zeros.
pub(super) fn short(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let decimals = (2.0 - value.abs().log10().floor()).clamp(0.0, 9.0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// A number with its unit; a pure one without.
pub(super) fn with_unit(value: f64, unit: &str) -> String {
    if unit == "1" { short(value) } else { format!("{} {unit}", short(value)) }
}

/// An angle as a person reads it.
pub(super) fn degrees(angle: f64) -> String {
    format!("{} degrees", short(angle.to_degrees()))
}

/// A time in milliseconds.
pub(super) fn milliseconds(time: f64) -> String {
    format!("{} ms", short(1e3 * time))
}

/// `[1, 2, 3]`.
pub(super) fn list(values: &[f64]) -> String {
    format!("[{}]", values.iter().map(|value| short(*value)).collect::<Vec<_>>().join(", "))
}

/// How something leans that was turned by `tilt` about the base's x and y axes [rad], and which sides to raise.
pub(super) fn leaning(tilt: [f64; 2]) -> String {
    let most = tilt[0].abs().max(tilt[1].abs());
    // Turned about x by a positive angle the +y side goes up; about y the +x side goes down.
    let sides = [(tilt[0], "x", ["+y", "-y"]), (tilt[1], "y", ["-x", "+x"])];
    let one = |(angle, axis, sides): (f64, &str, [&str; 2])| {
        let low = if angle > 0.0 { sides[1] } else { sides[0] };
        format!("by {} about {axis} (raise the {low} side)", degrees(angle.abs()))
    };
    let all: Vec<String> = sides.into_iter().filter(|(angle, ..)| angle.abs() > NOTHING * most).map(one).collect();
    if all.is_empty() { "by 0 degrees".into() } else { all.join(" and ") }
}

/// Gravity in axes that lean by `tilt` about the base's x and y axes [m/s²].
pub(super) fn gravity(tilt: [f64; 2]) -> [f64; 3] {
    let turn = Rotation3::new(Vector3::new(tilt[0], tilt[1], 0.0));
    (turn.inverse() * Vector3::new(0.0, 0.0, -GRAVITY)).into()
}

#[cfg(test)]
mod tests {
    use super::super::registry::{find, registry};
    use super::*;

    fn shipped() -> Cell {
        let text = include_str!("../../../config/fr3_cell.toml");
        shared_mem::toml_file::parse(text, std::path::Path::new("fr3_cell.toml")).expect("the shipped file")
    }

    fn remedy(effect: &str, numbers: &[(&str, &[f64])]) -> Remedy {
        let known = |name: &str| numbers.iter().find(|(key, _)| *key == name).map(|(_, values)| values.to_vec());
        find(effect).expect("an effect").remedy(&shipped(), &known)
    }

    #[test]
    fn every_effect_says_what_to_do_in_whole_sentences_with_numbers_that_are_numbers() {
        for effect in registry() {
            let strongest = |name: &str| {
                let parameter = effect.parameters.iter().find(|p| p.name == name)?;
                Some(vec![parameter.plausible[1]; 7])
            };
            for known in [&strongest as &dyn Fn(&str) -> Option<Vec<f64>>, &|_| None] {
                let Remedy { in_cell, in_model } = effect.remedy(&shipped(), known);
                for text in [in_cell, in_model] {
                    assert!(text.ends_with('.') && text.len() > 25, "{}: {text}", effect.name);
                    assert!(!text.contains("NaN") && !text.contains("  "), "{}: {text}", effect.name);
                }
            }
        }
    }

    #[test]
    fn a_leaning_table_is_raised_where_it_is_low() {
        // A table with tilt about +y leans towards +x, one about +x towards -y.
        let text = remedy("table_tilt", &[("tilt", &[0.0, 0.04])]).in_cell;
        assert!(text.contains("by 2.29 degrees about y (raise the +x side)") && !text.contains("about x"), "{text}");
        let text = remedy("base_tilt", &[("tilt", &[0.02, -0.04])]).in_cell;
        assert!(
            text.contains("1.15 degrees about x (raise the -y side) and by 2.29 degrees about y (raise the -x side)")
        );
        assert!(gravity([0.0, 0.04])[0] > 0.39, "what leans towards +x pulls that way");
        assert!(gravity([0.04, 0.0])[1] < -0.39, "what leans towards -y pulls that way");
    }

    #[test]
    fn what_cell_toml_knows_is_set_to_the_sum() {
        // The shipped cell has a latency of 0.009 s, a tool of 0.25 kg and rotors of 0.195 and 0.074 kg m^2.
        let latency = remedy("camera_latency", &[("latency", &[0.022])]).in_cell;
        assert!(latency.contains("latency = 0.031 (0.022 s more"), "{latency}");
        let payload = remedy("payload", &[("mass", &[0.4]), ("centre", &[0.0, 0.01, 0.06])]).in_cell;
        assert!(payload.contains("mass = 0.65 under [tool]") && payload.contains("[0, 0.01, 0.06] m"), "{payload}");
        let rotors = remedy("rotor_inertia", &[("extra", &[0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.02])]).in_cell;
        assert!(rotors.contains("rotor_inertia = [0.295, 0.195, 0.195, 0.195, 0.074, 0.074, 0.094]"), "{rotors}");
        let place = remedy("camera_extrinsic_translation", &[("translation", &[0.01, -0.02, 0.0])]).in_cell;
        assert!(place.contains("position = [1.4400, 0.8700, 0.8500]"), "{place}");
    }

    #[test]
    fn numbers_of_joints_name_those_that_count_and_keep_their_signs() {
        let friction =
            remedy("joint_coulomb_friction", &[("coulomb", &[0.0, 1.1, 0.001, 0.0, 0.44, 0.0, 0.0])]).in_model;
        assert!(friction.contains("frictionloss 1.1 N m in joint 2, 0.44 N m in joint 5."), "{friction}");
        let asymmetry = remedy("joint_friction_asymmetry", &[("offset", &[0.0, 0.3, 0.0, 0.0, 0.0, 0.0, 0.0])]);
        assert!(asymmetry.in_model.contains("-0.3 N m in joint 2") && asymmetry.in_cell.contains("torque 0.3 N m"));
        let gain = remedy("torque_gain", &[("gain", &[0.8])]);
        assert!(gain.in_cell.contains("by 1.25 in every joint") && gain.in_model.contains("0.8 in every"), "{gain:?}");
        let backlash = remedy("joint_backlash", &[("play", &[0.0, 0.01])]).in_cell;
        assert!(backlash.contains("0.01 rad (0.573 degrees) in joint 2"), "{backlash}");
        let lag = remedy("command_lag", &[("time_constant", &[0.0016])]).in_cell;
        assert!(lag.contains("99.5 Hz") && lag.contains("1.6 ms"), "{lag}");
    }

    #[test]
    fn the_camera_is_turned_back_by_what_it_was_turned() {
        let cell = shipped();
        let turn = [0.0, 0.0, 0.05];
        let text = remedy("camera_extrinsic_rotation", &[("rotation", &turn)]).in_cell;
        assert!(text.contains("back by 0, 0, 2.86 degrees"), "{text}");
        let numbers = text.split_once("position = [").expect("a pose").1.split_once(']').expect("its end").0;
        let place: Vec<f64> = numbers.split(", ").map(|x| x.parse().expect("a number")).collect();
        let there = Rotation3::new(Vector3::from(turn)) * Vector3::new(place[0], place[1], place[2]);
        let known = cell.camera.expect("a camera").pose.position;
        assert!((there - Vector3::from(known)).norm() < 1e-3, "{there} is not {known:?}");
    }
}
