//! The effects as a whole: the list, what an `[[effect]]` block may hold, and that nothing means nothing.

use shared_mem::theta::{EffectTheta, Theta};
use twin::arm::{ArmModel, ControlLaw, JointState};
use twin::control::{ArmRollout, CommandTrack};
use twin::effects::{Effects, Elsewhere, Role, Shape, registry};

/// Every name that reports and files may rely on.
const NAMES: [&str; 40] = [
    "joint_coulomb_friction",
    "joint_viscous_friction",
    "joint_stribeck_friction",
    "joint_friction_asymmetry",
    "joint_load_friction",
    "joint_presliding_friction",
    "joint_position_dependent_friction",
    "command_delay",
    "command_lag",
    "integral_action",
    "torque_delay",
    "rotor_inertia",
    "payload",
    "torque_gain",
    "joint_elasticity",
    "joint_backlash",
    "joint_encoder_offset",
    "torque_saturation",
    "voltage_saturation",
    "torque_ripple",
    "torque_sensor_bias",
    "base_tilt",
    "joint_weight",
    "restitution",
    "contact_compliance",
    "tip_friction",
    "tool_offset",
    "object_inertia",
    "anisotropic_friction",
    "stribeck_sliding_friction",
    "velocity_dependent_friction",
    "viscous_sliding_drag",
    "table_tilt",
    "friction_patch",
    "pressure_distribution",
    "camera_latency",
    "camera_extrinsic_rotation",
    "camera_extrinsic_translation",
    "camera_scale",
    "tracker_smoothing",
];

fn blocks(text: &str) -> Vec<EffectTheta> {
    shared_mem::toml_file::parse::<Theta>(text, std::path::Path::new("theta.toml")).expect("a theta.toml").effects
}

fn refusal(text: &str) -> String {
    Effects::from_theta(&blocks(text), 7).expect_err("refused").to_string()
}

/// A block of each effect, its sizes at a share of the way from neutral to the upper end of what is plausible.
fn every_effect(share: f64) -> Vec<EffectTheta> {
    let value = |p: &twin::effects::Parameter| {
        let size = match p.role {
            // Halfway to infinity is nowhere: an endless stiffness or limit becomes the highest plausible one.
            Role::Size { neutral } if neutral.is_infinite() && share > 0.0 => p.plausible[1] / share,
            Role::Size { neutral } if share > 0.0 => neutral + share * (p.plausible[1] - neutral),
            Role::Size { neutral } => neutral,
            Role::Form { default } => default,
        };
        match p.shape {
            Shape::Vector(n) => toml::Value::Array(vec![toml::Value::Float(size); n]),
            Shape::Number | Shape::PerJoint => toml::Value::Float(size),
        }
    };
    let block = |effect: &twin::effects::EffectInfo| EffectTheta {
        name: effect.name.into(),
        parameters: effect.parameters.iter().map(|p| (p.name.to_owned(), value(p))).collect(),
    };
    registry().iter().map(block).collect()
}

#[test]
fn the_registry_lists_every_name_once_and_in_order() {
    let listed: Vec<&str> = registry().iter().map(|effect| effect.name).collect();
    assert_eq!(listed, NAMES);
}

#[test]
fn what_an_effect_is_confused_with_exists_and_is_another() {
    for effect in registry() {
        for other in effect.confusable_with {
            assert!(NAMES.contains(other) && *other != effect.name, "{}: {other}", effect.name);
        }
    }
}

#[test]
fn every_parameter_can_rest_and_what_is_plausible_is_possible() {
    for effect in registry() {
        assert!(effect.parameters.iter().any(|p| matches!(p.role, Role::Size { .. })), "{} has no size", effect.name);
        for p in effect.parameters {
            let inside = |value: f64| (p.possible[0]..=p.possible[1]).contains(&value);
            assert!(p.plausible[0] < p.plausible[1], "{} {}", effect.name, p.name);
            assert!(p.plausible.into_iter().all(inside), "{} {}", effect.name, p.name);
        }
    }
}

#[test]
fn neutral_effects_are_no_effects() {
    assert_eq!(Effects::from_theta(&every_effect(0.0), 7).expect("known effects"), Effects::default());
}

#[test]
fn an_effect_fades_out_towards_neutral() {
    let nominal = swing(&Effects::default());
    for block in every_effect(1e-7) {
        let name = block.name.clone();
        let effects = Effects::from_theta(&[block], 7).expect("a known effect");
        assert!(!effects.is_none(), "{name}");
        let near = swing(&effects);
        let change = near.q.iter().zip(nominal.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(change < 2e-6, "{name} moves the arm by {change} rad");
    }
}

#[test]
fn the_documentation_lists_every_effect_with_its_parameters() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/effects.md");
    let text = std::fs::read_to_string(path).expect("docs/effects.md");
    let rows: Vec<&str> = text.lines().filter(|line| line.starts_with("| `")).collect();
    let expected: Vec<String> = registry().iter().map(row).collect();
    assert_eq!(rows, expected, "docs/effects.md should hold:\n{}\n", expected.join("\n"));
}

/// An effect as docs/effects.md lists it.
fn row(effect: &twin::effects::EffectInfo) -> String {
    let parameter = |p: &twin::effects::Parameter| {
        let count = match p.shape {
            Shape::Number => String::new(),
            Shape::PerJoint => " per joint".into(),
            Shape::Vector(n) => format!(" x {n}"),
        };
        let rest = match p.role {
            Role::Size { neutral } => format!("neutral {neutral}"),
            Role::Form { default } => format!("default {default}"),
        };
        // Four places behind the point, or all of a number that would have none of them.
        let [low, high] = p.plausible.map(|v| if v.abs() < 1e-4 { v } else { (v * 1e4).round() / 1e4 });
        let of = |[low, high]: [f64; 2], whole: &str| format!(" (elsewhere {low} to {high}{whole})");
        let elsewhere = match p.elsewhere {
            Elsewhere::Same => String::new(),
            Elsewhere::Range(range) => of(range, ""),
            Elsewhere::OfTorqueLimit(share) => of(share, " of the torque limit"),
            Elsewhere::OfInertia(share) => of(share, " of the joint's inertia"),
            Elsewhere::OfMass(share) => of(share, " of the links' mass"),
        };
        format!("`{}` [{}]{count}: {low} to {high}{elsewhere}, {rest}", p.name, p.unit)
    };
    let parameters: Vec<String> = effect.parameters.iter().map(parameter).collect();
    let others = effect.confusable_with.join(", ");
    format!("| `{}` | {} | {} | {others} |", effect.name, effect.stage.name(), parameters.join("<br>"))
}

#[test]
fn all_effects_may_act_at_once() {
    let effects = Effects::from_theta(&every_effect(0.5), 7).expect("known effects");
    assert!(!effects.is_none());
    let after = swing(&effects);
    assert!(after.q.iter().chain(&after.dq).all(|v| v.is_finite()), "{after:?}");
    assert!(after.q.iter().zip(swing(&Effects::default()).q).take(7).all(|(a, b)| (a - b).abs() < 0.3), "{after:?}");
    assert_eq!(after, swing(&effects), "twice the same");
}

/// Where an FR3 is after following two seconds of a sine in all joints.
fn swing(effects: &Effects) -> JointState {
    let nominal = ArmModel::fr3();
    let arm = effects.arm.real_arm(&nominal);
    let per_joint = |each: [f64; 7]| shared_mem::msg::joints_from(&each);
    let law = ControlLaw {
        kind: shared_mem::cell::ControllerKind::JointImpedance,
        stiffness: per_joint([600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0]),
        damping: per_joint([50.0, 50.0, 50.0, 50.0, 30.0, 25.0, 15.0]),
        torque_limit: *nominal.torque_limit(),
    };
    let mut desired = shared_mem::recording::JointSeries { dof: 7, ..Default::default() };
    for tick in 0..2000u64 {
        desired.stamps_ns.push(tick * 1_000_000);
        let swung = 0.2 * (1.0 - (tick as f64 * 4e-3).cos());
        desired.q.extend(nominal.ready()[..7].iter().map(|q| q + swung));
    }
    let commands = CommandTrack::new(&desired).expect("rows");
    let mut out = [JointState::default()];
    let effects = (!effects.arm.is_none()).then_some(&effects.arm);
    let arm = if effects.is_some() { &arm } else { &nominal };
    let rollout = ArmRollout { arm, nominal: &nominal, law: &law, effects, parts: 1 };
    rollout.run(&JointState::at_rest(*nominal.ready()), 0, &commands, &[2_000_000_000], &mut out);
    out[0]
}

#[test]
fn a_number_stands_for_all_joints() {
    let read = |coulomb: &str| {
        let text = format!("[[effect]]\nname = \"joint_coulomb_friction\"\ncoulomb = {coulomb}");
        Effects::from_theta(&blocks(&text), 7).expect("friction")
    };
    assert_eq!(swing(&read("1")), swing(&read("[1, 1.0, 1, 1, 1, 1, 1]")));
}

#[test]
fn a_mistake_is_refused_in_one_line_with_the_remedy() {
    let effect = |text: &str| format!("[[effect]]\nname = {text}");
    for (text, told) in [
        ("\"joint_coulomb\"", "no effect is called `joint_coulomb`; did you mean `joint_coulomb_friction`?"),
        ("\"command_delay\"", "effect `command_delay` lacks `delay` [s]; add `delay = ` and a number"),
        ("\"command_delay\"\nlag = 1", "effect `command_delay` has no parameter `lag`; it takes `delay`"),
        ("\"command_delay\"\ndelay = [0.1, 0.2]", "`delay` of effect `command_delay` does not fit; give a number [s]"),
        ("\"command_delay\"\ndelay = -0.1", "`delay` of effect `command_delay` cannot be -0.1 s; give 0 to 2"),
        ("\"command_delay\"\ndelay = nan", "`delay` of effect `command_delay` cannot be NaN s; give 0 to 2"),
        (
            "\"tool_offset\"\noffset = 0.1",
            "`offset` of effect `tool_offset` does not fit; give an array of 3 numbers [m]",
        ),
        ("\"payload\"\nmass = -0.1", "`mass` of effect `payload` cannot be -0.1 kg; give 0 to 100"),
        (
            "\"torque_gain\"\ngain = [1.0, 0.9]",
            "`gain` of effect `torque_gain` does not fit; give a number, or 7 in an array, one for each joint [1]",
        ),
    ] {
        assert_eq!(refusal(&effect(text)), told);
    }
    let twice = effect("\"command_delay\"\ndelay = 0.1\n") + &effect("\"command_delay\"\ndelay = 0.2");
    assert_eq!(refusal(&twice), "effect `command_delay` is given twice; keep one of its [[effect]] blocks");
}
