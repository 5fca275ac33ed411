//! The one clip that would separate the leaders, from the pairs that are easily taken for each other.

/// Pairs and what separates them.
const PAIRS: &[(&str, &str, &str)] = &[
    (
        "joint_coulomb_friction",
        "joint_load_friction",
        "the same slow velocity sweep once with the arm stretched out and once folded",
    ),
    ("joint_coulomb_friction", "joint_stribeck_friction", "slow ramps from 0.005 to 0.5 rad/s with many reversals"),
    (
        "joint_viscous_friction",
        "torque_delay",
        "the same chirp with the nominal damping and with half of it, torques logged",
    ),
    ("command_delay", "command_lag", "a chirp up to 10 Hz: only a lag lowers the gain"),
    ("command_delay", "camera_latency", "a sharp stop of the arm with the tool in view: compare encoders with poses"),
    (
        "joint_stribeck_friction",
        "joint_backlash",
        "approach one pose from both sides, with and without a weight that keeps the gears pressed",
    ),
    (
        "joint_coulomb_friction",
        "joint_backlash",
        "approach one pose from both sides, with and without a weight that keeps the gears pressed",
    ),
    ("rotor_inertia", "payload", "the same fast motion in three poses: a payload's inertia changes with the pose"),
    ("rotor_inertia", "joint_elasticity", "a chirp from 5 to 40 Hz: look for a resonance"),
    ("payload", "torque_gain", "rest in eight poses or more, gravity pulling either way"),
    ("payload", "joint_friction_asymmetry", "rest in eight poses or more, gravity pulling either way"),
    ("payload", "base_tilt", "rest in eight poses or more, turned about the base's axis"),
    ("torque_sensor_bias", "joint_friction_asymmetry", "hang a known weight on the flange and log the torques"),
    ("restitution", "contact_compliance", "hits from 0.1 to 0.6 m/s with the nominal stiffness and with half of it"),
    ("tip_friction", "tool_offset", "straight hits with the object turned by 0, 90 and 180 degrees"),
    ("object_inertia", "pressure_distribution", "spin the object on the spot by hand, and push it without spin"),
    ("table_tilt", "anisotropic_friction", "slides in eight headings through the same place"),
    ("table_tilt", "base_tilt", "rest the arm in eight poses, and slide in eight headings"),
    (
        "anisotropic_friction",
        "friction_patch",
        "the same heading in different places, the same place with different headings",
    ),
    ("velocity_dependent_friction", "viscous_sliding_drag", "the same slides with a known weight on top of the object"),
    (
        "camera_latency",
        "tracker_smoothing",
        "a sharp stop of the object against a wall: smoothing rounds it, latency does not",
    ),
    ("camera_extrinsic_rotation", "camera_extrinsic_translation", "rest the object in four places far apart"),
    ("camera_scale", "camera_extrinsic_rotation", "rest the object in places a known distance apart"),
];

/// What to record next to tell these effects apart.
#[must_use]
pub fn separating(effects: &[&str]) -> String {
    let both = |a: &str, b: &str| effects.contains(&a) && effects.contains(&b);
    if let Some((a, b, clip)) = PAIRS.iter().find(|(a, b, _)| both(a, b)) {
        return format!("To tell {a} from {b}: {clip}.");
    }
    match effects {
        [] => String::new(),
        all => format!(
            "To tell {} apart: slow triangles, a chirp and holds in one clip, with desired and measured torques logged.",
            all.join(", ")
        ),
    }
}

/// What to record next to confirm what was found.
#[must_use]
pub fn confirming(effects: &[String]) -> String {
    let effects = effects.join(" and ");
    format!("To confirm {effects}: repeat two of these clips and add one with half and one with twice the speed.")
}

/// What to record where something unknown is left.
#[must_use]
pub fn unexplained(place: Option<(&str, &str)>) -> String {
    let Some((channel, regime)) = place else { return String::new() };
    format!(
        "What is left is largest in {channel} ({regime}): repeat one clip eight times there, then once at half and once at \
         double speed, to see whether it repeats and how it grows."
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use twin::effects::find;

    #[test]
    fn advice_names_effects_that_exist() {
        for (a, b, _) in PAIRS {
            assert!(find(a).is_some() && find(b).is_some(), "{a} {b}");
        }
    }

    #[test]
    fn a_class_of_two_gets_the_clip_that_separates_them_and_two_that_act_together_one_that_confirms_them() {
        assert!(separating(&["command_lag", "command_delay"]).contains("10 Hz"));
        assert!(
            confirming(&["command_delay".into(), "friction_patch".into()]).contains("delay and friction_patch: repeat")
        );
    }
}
