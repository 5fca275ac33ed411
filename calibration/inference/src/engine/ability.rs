//! What an engine says that it can do, held against the registry of effects, and what of a set of parameters that leaves.

use super::message::{Hello, OLDEST, VERSION};
use serde_json::Value;
use shared_mem::theta::{EffectTheta, Theta};
use std::collections::BTreeMap;
use twin::effects::{EffectInfo, Stage, find, registry};

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
/// Numbers of the controller, then those of the object.
const PARAMETERS: [&str; 6] = ["stiffness", "damping", "friction", "mass", "centre_of_mass", "tip_friction"];
const GAINS: usize = 2;

/// What an engine can do.
#[derive(Debug, Clone, PartialEq)]
pub struct Ability {
    /// Its name and version.
    pub name: String,
    /// What it may be asked for.
    readings: Vec<Quantity>,
    /// Whether it simulates an object that the arm hits.
    pub object: bool,
    /// Which of [`PARAMETERS`] can be set.
    sets: [bool; PARAMETERS.len()],
    /// Effects, with the parameters that it knows.
    effects: BTreeMap<String, Vec<String>>,
}

impl Ability {
    pub(super) fn read(hello: Hello) -> Result<Self, String> {
        let Hello { protocol, name, parameters, effects, readings, object } = hello;
        if !(OLDEST..=VERSION).contains(&protocol) {
            return Err(format!("speaks version {protocol} of the protocol, and this program version {VERSION}"));
        }
        let known = if object { &PARAMETERS[..] } else { &PARAMETERS[..GAINS] };
        if let Some(other) = parameters.iter().find(|name| !known.contains(&name.as_str())) {
            return Err(format!("says that it knows the parameter `{other}`; there are {}", known.join(", ")));
        }
        for (name, parameters) in &effects {
            let simulated = |effect: &&EffectInfo| is_simulated(effect, object);
            let Some(effect) = find(name).filter(simulated) else {
                let known: Vec<&str> = registry().iter().filter(simulated).map(|effect| effect.name).collect();
                let on = if object { "arm and object" } else { "the arm" };
                return Err(format!("says that it knows the effect `{name}`; on {on} there are {}", known.join(", ")));
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
        let sets = PARAMETERS.map(|parameter| parameters.iter().any(|name| name == parameter));
        Ok(Self { name, readings, object, sets, effects })
    }

    /// All of it as a text: results of one engine are not those of another.
    pub fn print(&self) -> String {
        format!("{self:?}")
    }

    /// Whether it reports a quantity.
    pub fn reports(&self, quantity: Quantity) -> bool {
        self.readings.contains(&quantity)
    }

    /// Names of the effects that it simulates itself, at least in part.
    pub fn effects(&self) -> impl Iterator<Item = &str> {
        self.effects.keys().map(String::as_str)
    }

    /// Whether it simulates an effect with all its parameters.
    pub fn knows(&self, effect: &str) -> bool {
        let all = find(effect).map_or(&[][..], |effect| effect.parameters);
        self.effects.get(effect).is_some_and(|known| all.iter().all(|p| known.iter().any(|name| name == p.name)))
    }

    /// The part of parameters that it simulates itself, with what is a camera's: that acts on its answer. Other numbers of controller
    /// and object are those of `nominal`.
    pub fn part(&self, theta: &Theta, nominal: &Theta) -> Theta {
        let mut part = theta.clone();
        let [stiffness, damping, friction, mass, centre_of_mass, tip_friction] = self.sets;
        if let (Some(arm), Some(nominal)) = (&mut part.arm, &nominal.arm) {
            restore(stiffness, &mut arm.stiffness, &nominal.stiffness);
            restore(damping, &mut arm.damping, &nominal.damping);
        }
        if let (Some(object), Some(nominal)) = (&mut part.object, &nominal.object) {
            restore(friction, &mut object.friction, &nominal.friction);
            restore(mass, &mut object.mass, &nominal.mass);
            restore(centre_of_mass, &mut object.centre_of_mass, &nominal.centre_of_mass);
            restore(tip_friction, &mut object.tip_friction, &nominal.tip_friction);
        }
        // What is left out here the twin adds as its own difference.
        part.effects = theta.effects.iter().filter_map(|effect| self.part_of(effect)).collect();
        part
    }

    fn part_of(&self, effect: &EffectTheta) -> Option<EffectTheta> {
        // A camera's part acts on the answer, whoever simulated it.
        if find(&effect.name).is_some_and(|effect| effect.stage == Stage::Camera) {
            return Some(effect.clone());
        }
        let known = self.effects.get(&effect.name)?;
        let mut part = effect.clone();
        part.parameters.retain(|name, _| known.contains(name));
        Some(part).filter(|part| !part.parameters.is_empty())
    }

    /// The gains that the engine sets.
    pub(super) fn gains<'a>(&self, theta: &'a Theta) -> BTreeMap<&'static str, &'a [f64]> {
        let Some(arm) = &theta.arm else { return BTreeMap::new() };
        let sets = PARAMETERS.into_iter().zip(self.sets).zip([&arm.stiffness[..], &arm.damping[..]]);
        sets.filter(|((_, sets), _)| *sets).map(|((name, _), gains)| (name, gains)).collect()
    }

    /// Effects as an engine reads them; what has no bound is null.
    pub(super) fn blocks(&self, effects: &[EffectTheta]) -> Vec<BTreeMap<String, Value>> {
        let block = |effect: &EffectTheta| {
            let parameters = effect.parameters.iter().map(|(name, value)| (name.clone(), serde_json::json!(value)));
            parameters.chain([("name".to_owned(), Value::from(effect.name.as_str()))]).collect()
        };
        effects.iter().filter(|effect| self.effects.contains_key(&effect.name)).map(block).collect()
    }
}

/// Whether an effect is one of what an engine simulates: what a camera makes of poses is applied to its answer.
pub(super) fn is_simulated(effect: &EffectInfo, with_object: bool) -> bool {
    effect.stage == Stage::Control || (with_object && matches!(effect.stage, Stage::Hit | Stage::Slide))
}

fn restore<T: Clone>(is_set: bool, part: &mut T, nominal: &T) {
    if !is_set {
        part.clone_from(nominal);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use shared_mem::theta::ArmTheta;

    fn hello(effects: &str, parameters: &[&str], readings: &[&str]) -> Hello {
        let list = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect();
        let effects = serde_json::from_str(effects).expect("JSON");
        let (parameters, readings) = (list(parameters), list(readings));
        Hello { protocol: VERSION, name: "engine".into(), parameters, effects, readings, object: false }
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
