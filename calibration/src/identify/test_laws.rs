//! Gains of a servo under every law that may lead it, from logs with faults, and with what else acts: they come out right, and what was
//! done about it is said.

use super::test_servo::{DOF, Swing, cell, clip, gains, with_effect};
use super::{Identification, Options, arm};
use inference::interrupt::Interrupt;
use shared_mem::cell::{Cell, ControllerKind};
use shared_mem::recording::{Clip, JointSeries};
use shared_mem::theta::Theta;

const STIFFNESS: [f64; DOF] = [33.0, 18.0];
const DAMPING: [f64; DOF] = [2.6, 2.2];

fn truth() -> Theta {
    gains(STIFFNESS, DAMPING)
}

fn swing(seed: u64) -> Swing {
    let faster = 1.0 + 0.15 * seed as f64;
    Swing { speeds: [4.0 * faster, 6.1 * faster], rows: 1000, noise: 2e-5, seed, parts: 3 }
}

fn session(cell: &Cell, hidden: &Theta) -> Vec<Clip> {
    (0..3).map(|seed| clip(cell, hidden, &swing(seed))).collect()
}

fn identify(cell: &Cell, clips: Vec<Clip>, also: &[&str]) -> Identification {
    let options = Options { also: also.iter().map(|name| (*name).to_owned()).collect(), ..Options::default() };
    arm::identify_clips(cell, clips, &options, &Interrupt::default()).expect("an answer")
}

/// The largest relative error of a gain.
fn worst(found: &Identification) -> f64 {
    let of = |name: &str, truth: [f64; DOF]| {
        found.parameters[name]
            .value
            .iter()
            .zip(truth)
            .map(|(found, truth)| (found / truth - 1.0).abs())
            .fold(0.0, f64::max)
    };
    of("stiffness", STIFFNESS).max(of("damping", DAMPING))
}

/// Whether something is said of the session or of one of its clips.
fn says(found: &Identification, what: &str) -> bool {
    let of_clips = found.by_clip.iter().flat_map(|clip| &clip.warnings);
    found.warnings.iter().chain(of_clips).any(|warning| warning.contains(what))
}

/// The session with a fault in its clips, or in the first alone.
fn with_fault(first_alone: bool, fault: impl Fn(&mut Clip)) -> Identification {
    let cell = cell("joint_impedance");
    let mut clips = session(&cell, &truth());
    let many = if first_alone { 1 } else { clips.len() };
    clips[..many].iter_mut().for_each(fault);
    identify(&cell, clips, &[])
}

#[test]
fn gains_are_found_under_every_law() {
    for kind in ["joint_impedance", "joint_pd", "compensated_pd", "inverse_dynamics", "joint_velocity"] {
        let cell = cell(kind);
        let found = identify(&cell, session(&cell, &truth()), &[]);
        assert!(worst(&found) < 0.02 && found.misfit < 1.3, "{kind}: {} and {}", worst(&found), found.misfit);
    }
}

#[test]
fn the_law_is_found_where_cell_toml_does_not_state_it_and_said_with_the_line_to_write() {
    let led = cell("joint_pd");
    let mut unstated = led.clone();
    unstated.controller.as_mut().expect("a controller").kind = ControllerKind::Unstated;
    let found = identify(&unstated, session(&led, &truth()).split_off(1), &[]);
    assert!(worst(&found) < 0.02, "{}", worst(&found));
    assert!(says(&found, "by which law") && says(&found, "kind = \"joint_pd\""), "{:?}", found.warnings);
}

#[test]
fn gains_that_are_known_by_a_range_alone_are_found_from_far_away() {
    let mut ranged = cell("joint_impedance");
    let controller = ranged.controller.as_mut().expect("a controller");
    (controller.stiffness, controller.damping) = (Vec::new(), Vec::new());
    (controller.stiffness_range, controller.damping_range) = (Some([1.0, 400.0].into()), Some([0.1, 40.0].into()));
    let found = identify(&ranged, session(&cell("joint_impedance"), &truth()), &[]);
    assert!(worst(&found) < 0.03, "{}: {:?}", worst(&found), found.parameters);
    let start = found.parameters["stiffness"].start[0];
    assert!((start / STIFFNESS[0] - 1.0).abs() > 0.2, "it began far away: {start}");
}

#[test]
fn friction_that_is_searched_besides_is_found_beside_the_gains() {
    let cell = cell("joint_impedance");
    for (name, parameter, size, numbers) in [
        ("joint_viscous_friction", "viscous", 0.9, vec![("viscous", 0.9)]),
        ("joint_coulomb_friction", "coulomb", 0.4, vec![("coulomb", 0.4), ("creep", 0.005)]),
    ] {
        let dragged = session(&cell, &with_effect(&truth(), name, &numbers)).split_off(1);
        let found = identify(&cell, dragged.clone(), &[name]);
        let values = &found.parameters[&format!("{name}.{parameter}")].value;
        assert!(
            values.len() == DOF && values.iter().all(|value| (value / size - 1.0).abs() < 0.1),
            "{name}: {values:?}"
        );
        assert!(worst(&found) < 0.05, "{name}: {}", worst(&found));
        // Gains alone do not explain it.
        let without = identify(&cell, dragged, &[]);
        assert!(without.misfit > 2.0 * found.misfit, "{name}: {} {}", without.misfit, found.misfit);
    }
}

#[test]
fn a_torque_limit_that_is_not_reached_is_left_away() {
    let cell = cell("joint_impedance");
    let free = identify(&cell, session(&cell, &truth()), &["torque_saturation"]);
    assert!(free.parameters["torque_saturation.limit"].value.iter().all(|limit| limit.is_infinite()));
    assert!(worst(&free) < 0.02, "{}", worst(&free));
}

#[test]
fn commands_that_are_missing_for_a_while_are_left_out_and_said() {
    let found = with_fault(true, |clip| {
        let kept: Vec<usize> = (0..clip.desired.len()).filter(|row| !(300..550).contains(row)).collect();
        clip.desired = clip.desired.select_rows(&kept);
    });
    assert!(worst(&found) < 0.03 && says(&found, "no commands for 0.25"), "{} {:?}", worst(&found), found.warnings);
}

#[test]
fn what_follows_a_jump_of_the_clock_is_left_out_and_said() {
    let found = with_fault(true, |clip| {
        clip.measured.stamps_ns.iter_mut().skip(700).for_each(|stamp| *stamp += 60_000_000);
    });
    assert!(worst(&found) < 0.03 && says(&found, "clock jumps by 0.061 s"), "{} {:?}", worst(&found), found.warnings);
}

#[test]
fn velocities_that_were_filtered_or_are_of_another_unit_do_not_count() {
    let late = with_fault(false, |clip| {
        let JointSeries { dq, dof, .. } = &mut clip.measured;
        let mut last = dq[..*dof].to_vec();
        for row in dq.chunks_exact_mut(*dof) {
            for (value, last) in row.iter_mut().zip(&mut last) {
                *last += (*value - *last) / 20.0;
                *value = *last;
            }
        }
    });
    assert!(worst(&late) < 0.02 && says(&late, "were filtered and come late"), "{} {:?}", worst(&late), late.warnings);
    let degrees = with_fault(false, |clip| clip.measured.dq.iter_mut().for_each(|dq| *dq = dq.to_degrees()));
    assert!(worst(&degrees) < 0.02 && says(&degrees, "not the slopes of the positions"), "{:?}", degrees.warnings);
    let none = with_fault(false, |clip| clip.measured.dq.clear());
    assert!(worst(&none) < 0.02, "{}", worst(&none));
}

#[test]
fn slow_logs_tell_less_and_the_same() {
    let [fast, slow] = [1, 10].map(|every| {
        with_fault(false, |clip| {
            clip.measured = clip.measured.select_rows(&(0..clip.measured.len()).step_by(every).collect::<Vec<_>>());
        })
    });
    assert!(worst(&fast) < 0.02 && worst(&slow) < 0.05, "{} {}", worst(&fast), worst(&slow));
    let width = |found: &Identification| {
        let [low, high] = found.parameters["damping"].ci95[0];
        high - low
    };
    assert!(width(&slow) > width(&fast), "{} {}", width(&slow), width(&fast));
}

#[test]
fn a_joint_that_does_not_follow_keeps_its_gains_and_the_other_is_found() {
    let found = with_fault(false, |clip| {
        let stays = clip.measured.q[1];
        clip.measured.q.iter_mut().skip(1).step_by(DOF).for_each(|q| *q = stays);
        clip.measured.dq.clear();
    });
    assert!(says(&found, "joint 2 `b` does not move though it is commanded"), "{:?}", found.warnings);
    assert_eq!((found.parameters["stiffness"].value[1], found.parameters["damping"].value[1]), (20.0, 2.0));
    assert!((found.parameters["stiffness"].value[0] / STIFFNESS[0] - 1.0).abs() < 0.02);
    let open: Vec<&str> = found.not_identifiable.iter().map(|open| open.parameter.as_str()).collect();
    assert!(
        open.contains(&"stiffness[1]") && open.contains(&"damping[1]") && !open.contains(&"stiffness[0]"),
        "{open:?}"
    );
}
