//! What an engine says that it can do, held against the registry of effects, and what of a set of parameters that leaves.

use super::message::{Hello, VERSION};
use serde_json::Value;
use shared_mem::theta::{EffectTheta, Theta};
use std::collections::BTreeMap;
use twin::effects::{Stage, find, registry};

/// A quantity of a robot's log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Joint positions as encoders read them [rad].
    Position,
    /// Joint velocities [rad/s].
    Velocity,
    /// Torque behind the gears with gravity [N m].
    Torque,
    /// Torque asked for without gravity [N m].
    DesiredTorque,
}

impl Quantity {
    /// The one of a name of logs and messages; positions where there is none.
    #[must_use]
    pub fn named(name: &str) -> Self {
        QUANTITIES.iter().find(|(known, _)| *known == name).map_or(Self::Position, |(_, quantity)| *quantity)
    }

    /// Its name in messages.
    pub(super) fn name(self) -> &'static str {
        QUANTITIES[self as usize].0
    }
}

/// In the order of [`Quantity`].
const QUANTITIES: [(&str, Quantity); 4] = [
    ("q", Quantity::Position),
    ("dq", Quantity::Velocity),
    ("tau_J", Quantity::Torque),
    ("tau_J_d", Quantity::DesiredTorque),
];
const GAINS: [&str; 2] = ["stiffness", "damping"];

/// What an engine can do.
#[derive(Debug, Clone, PartialEq)]
pub struct Ability {
    /// Its name and version.
    pub name: String,
    /// What it may be asked for.
    readings: Vec<Quantity>,
    stiffness: bool,
    damping: bool,
    /// Effects, with the parameters that it knows.
    effects: BTreeMap<String, Vec<String>>,
}

impl Ability {
    /// From its own words.
    ///
    /// # Errors
    /// What is wrong with them.
    pub(super) fn read(hello: Hello) -> Result<Self, String> {
        let Hello { protocol, name, parameters, effects, readings } = hello;
        if protocol != VERSION {
            return Err(format!("speaks version {protocol} of the protocol, and this program version {VERSION}"));
        }
        if let Some(other) = parameters.iter().find(|name| !GAINS.contains(&name.as_str())) {
            return Err(format!("says that it knows the parameter `{other}`; there are {}", GAINS.join(", ")));
        }
        for (name, parameters) in &effects {
            let on_arm = |effect: &&twin::effects::EffectInfo| effect.stage == Stage::Control;
            let Some(effect) = find(name).filter(on_arm) else {
                let known: Vec<&str> = registry().iter().filter(on_arm).map(|effect| effect.name).collect();
                return Err(format!(
                    "says that it knows the effect `{name}`; on the arm there are {}",
                    known.join(", ")
                ));
            };
            if let Some(other) = parameters.iter().find(|name| effect.parameters.iter().all(|p| p.name != **name)) {
                let known: Vec<&str> = effect.parameters.iter().map(|p| p.name).collect();
                return Err(format!("says that `{name}` has a parameter `{other}`; it has {}", known.join(", ")));
            }
        }
        let quantity = |name: &String| {
            let known = QUANTITIES.iter().find(|(known, _)| known == name).map(|(_, quantity)| *quantity);
            known.ok_or_else(|| format!("says that it reports `{name}`; a robot logs q, dq, tau_J, tau_J_d"))
        };
        let readings: Vec<Quantity> = readings.iter().map(quantity).collect::<Result<_, _>>()?;
        if !readings.contains(&Quantity::Position) {
            return Err("does not report `q`, without which nothing can be compared".into());
        }
        let [stiffness, damping] = GAINS.map(|gain| parameters.iter().any(|name| name == gain));
        Ok(Self { name, readings, stiffness, damping, effects })
    }

    /// All of it as a text: results of one engine are not those of another.
    #[must_use]
    pub fn print(&self) -> String {
        format!("{self:?}")
    }

    /// Whether it reports a quantity.
    #[must_use]
    pub fn reports(&self, quantity: Quantity) -> bool {
        self.readings.contains(&quantity)
    }

    /// Names of the effects that it simulates itself, at least in part.
    pub fn effects(&self) -> impl Iterator<Item = &str> {
        self.effects.keys().map(String::as_str)
    }

    /// Whether it simulates an effect with all its parameters.
    #[must_use]
    pub fn knows(&self, effect: &str) -> bool {
        let all = find(effect).map_or(&[][..], |effect| effect.parameters);
        self.effects.get(effect).is_some_and(|known| all.iter().all(|p| known.iter().any(|name| name == p.name)))
    }

    /// The part of parameters that it simulates itself; gains that it does not know are those of `nominal`.
    #[must_use]
    pub fn part(&self, theta: &Theta, nominal: &Theta) -> Theta {
        let mut part = theta.clone();
        if let (Some(arm), Some(nominal)) = (&mut part.arm, &nominal.arm) {
            if !self.stiffness {
                arm.stiffness.clone_from(&nominal.stiffness);
            }
            if !self.damping {
                arm.damping.clone_from(&nominal.damping);
            }
        }
        part.effects = theta.effects.iter().filter_map(|effect| self.part_of(effect)).collect();
        part
    }

    fn part_of(&self, effect: &EffectTheta) -> Option<EffectTheta> {
        let known = self.effects.get(&effect.name)?;
        let mut part = effect.clone();
        part.parameters.retain(|name, _| known.contains(name));
        Some(part).filter(|part| !part.parameters.is_empty())
    }

    /// What of gains is told to it.
    pub(super) fn gains<'a>(&self, theta: &'a Theta) -> BTreeMap<&'static str, &'a [f64]> {
        let Some(arm) = &theta.arm else { return BTreeMap::new() };
        let told = [(self.stiffness, &arm.stiffness[..]), (self.damping, &arm.damping[..])];
        GAINS.into_iter().zip(told).filter(|(_, (knows, _))| *knows).map(|(name, (_, gains))| (name, gains)).collect()
    }
}

/// Effects as an engine reads them; what has no bound is null.
pub(super) fn blocks(effects: &[EffectTheta]) -> Vec<BTreeMap<String, Value>> {
    let block = |effect: &EffectTheta| {
        let parameters = effect.parameters.iter().map(|(name, value)| (name.clone(), serde_json::json!(value)));
        parameters.chain([("name".to_owned(), Value::from(effect.name.as_str()))]).collect()
    };
    effects.iter().map(block).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::theta::ArmTheta;

    fn hello(effects: &str, parameters: &[&str], readings: &[&str]) -> Hello {
        let list = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        let effects = serde_json::from_str(effects).expect("JSON");
        let (parameters, readings) = (list(parameters), list(readings));
        Hello { protocol: VERSION, name: "engine".into(), parameters, effects, readings }
    }

    fn theta() -> Theta {
        toml::from_str(
            "[arm]\nstiffness = [7.0]\ndamping = [3.0]\n[[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = [0.5]\n\
             creep = 0.01\n[[effect]]\nname = \"command_delay\"\ndelay = 0.004\n",
        )
        .expect("a theta")
    }

    #[test]
    fn what_an_engine_does_not_know_rests_or_is_nominal() {
        let effects = r#"{"joint_coulomb_friction": ["coulomb"]}"#;
        let ability = Ability::read(hello(effects, &["damping"], &["q"])).expect("all known");
        let nominal = Theta { arm: Some(ArmTheta { stiffness: vec![6.0], damping: vec![2.0] }), ..Theta::default() };
        let part = ability.part(&theta(), &nominal);
        assert_eq!(part.arm, Some(ArmTheta { stiffness: vec![6.0], damping: vec![3.0] }));
        let [friction] = &part.effects[..] else { panic!("{part:?}") };
        assert_eq!(friction.parameters.keys().collect::<Vec<_>>(), ["coulomb"]);
        assert!(!ability.knows("joint_coulomb_friction") && !ability.knows("command_delay"));
    }

    #[test]
    fn words_that_the_library_has_not_are_refused_with_those_it_has() {
        let refused = |effects: &str, parameters: &[&str], readings: &[&str]| {
            Ability::read(hello(effects, parameters, readings)).expect_err("refused")
        };
        assert!(refused("{}", &["gain"], &["q"]).contains("stiffness, damping"));
        assert!(refused(r#"{"friction": []}"#, &[], &["q"]).contains("joint_coulomb_friction"));
        assert!(refused(r#"{"command_delay": ["time"]}"#, &[], &["q"]).contains("it has delay"));
        assert!(refused("{}", &[], &["angle"]).contains("tau_J_d"));
        assert!(refused("{}", &[], &["dq"]).contains("without which"));
    }
}
