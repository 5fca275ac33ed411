//! The rollout engine from the outside: a stroke of the shipped arm against the shipped box, run in every way there is.

use crate::stroke::{Stroke, theta};
use shared_mem::theta::{ObjectTheta, Theta};
use twin::rollout::{CellTrace, ObjectState, Workers};

const EFFECTS: &str = r#"
[[effect]]
name = "command_delay"
delay = 0.0035
[[effect]]
name = "joint_coulomb_friction"
coulomb = 0.8
[[effect]]
name = "torque_delay"
delay = 0.001
[[effect]]
name = "restitution"
restitution = 0.6
[[effect]]
name = "friction_patch"
factor = 1.5
[[effect]]
name = "tracker_smoothing"
time_constant = 0.03
[[effect]]
name = "camera_latency"
latency = 0.02
"#;

fn same(a: &CellTrace, b: &CellTrace) {
    assert!(a.joints == b.joints && a.poses == b.poses, "other bits");
    assert_eq!(a.contact, b.contact);
}

#[test]
fn a_stroke_hits_the_box_and_the_trace_tells_when() {
    let stroke = Stroke::new();
    let trace = stroke.run(&mut stroke.worker(None));
    assert_eq!((trace.joints.len(), trace.poses.len()), (stroke.joints_ns.len(), stroke.poses_ns.len()));
    let contact = trace.contact.expect("a hit");
    let since = |ns: u64| (ns - stroke.joints_ns[0]) as f64 * 1e-9;
    assert!(since(contact.start_ns) > 0.1 && contact.end_ns > contact.start_ns && since(contact.end_ns) < 1.5);
    let gone = trace.poses[0].isometry().inverse() * trace.poses[trace.poses.len() - 1].isometry();
    assert!(gone.translation.vector.norm() > 0.03, "{gone}");
}

#[test]
fn the_torques_are_those_that_move_the_arm() {
    let stroke = Stroke::new();
    let worker = stroke.worker(None);
    let trace = stroke.run(&mut worker.clone());
    let arm = worker.arm().expect("an arm");
    // Before the hit: the sensor behind the gear carries what the links need, the rotor's part excepted.
    for row in 100..150 {
        let [before, now, after] = [row - 1, row, row + 1].map(|row| trace.joints[row].state);
        let acceleration: Vec<f64> = (0..7).map(|i| (now.dq[i] - before.dq[i]) / 1e-3).collect();
        assert!(after.q[0] > now.q[0]);
        let mass = arm.arm.mass_matrix(&now.q);
        let bias = arm.arm.bias(&now);
        let rotor = arm.arm.rotor_inertia();
        for i in 0..7 {
            let needed: f64 = (0..7).map(|j| mass[i][j] * acceleration[j]).sum::<f64>() + bias[i];
            let link = needed - rotor[i] * acceleration[i];
            assert!(
                (trace.joints[row].tau_J[i] - link).abs() < 0.02,
                "joint {i}: {} {link}",
                trace.joints[row].tau_J[i]
            );
            let asked = trace.joints[row].tau_J_d[i] + arm.arm.gravity(&before.q)[i];
            assert!((asked - needed).abs() < 0.02, "joint {i}: {asked} {needed}");
        }
    }
}

#[test]
fn a_resumed_run_is_bit_by_bit_the_uninterrupted_one() {
    let stroke = Stroke::new();
    for theta in [None, Some(theta(EFFECTS))] {
        let mut worker = stroke.worker(theta.as_ref());
        let whole = stroke.run(&mut worker);
        let contact_ns = whole.contact.expect("a hit").start_ns;
        for stop_ns in [stroke.joints_ns[150], contact_ns + 500_000, contact_ns + 60_000_000, contact_ns + 200_000_000]
        {
            stroke.start(&mut worker);
            let mut trace = CellTrace::default();
            worker.run_until(stop_ns, &stroke.course(), &mut trace);
            let (checkpoint, kept) = (worker.checkpoint(), trace.clone());
            worker.run(&stroke.course(), &mut trace);
            same(&trace, &whole);
            // Another worker goes on from there after it did something else.
            let mut other = stroke.worker(theta.as_ref());
            let _ = stroke.run(&mut other);
            trace.clone_from(&kept);
            other.resume(&checkpoint);
            other.run(&stroke.course(), &mut trace);
            same(&trace, &whole);
        }
    }
}

#[test]
fn a_stop_before_the_touch_serves_every_object_that_may_be_hit() {
    let stroke = Stroke::new();
    let mut worker = stroke.worker(None);
    stroke.start(&mut worker);
    let mut control = CellTrace::default();
    let stop_ns = worker.run_until_contact(&stroke.course(), &mut control).expect("a hit");
    assert_eq!(control.contact, None);
    let checkpoint = worker.checkpoint();
    for object in [0.2, 0.45].map(|mass| ObjectTheta { mass: Some(mass), ..ObjectTheta::default() }) {
        let object = ObjectTheta { centre_of_mass: Some([0.004, -0.006, 0.003]), ..object };
        let theta = Theta { object: Some(object), ..Theta::default() };
        let whole = stroke.run(&mut stroke.worker(Some(&theta)));
        let contact = whole.contact.expect("a hit");
        assert!((stop_ns..stop_ns + 1_000_000).contains(&contact.start_ns), "{stop_ns} {contact:?}");
        worker.set_parameters(&theta).expect("parameters");
        worker.resume(&checkpoint);
        let mut trace = control.clone();
        worker.run(&stroke.course(), &mut trace);
        let end = |a: &CellTrace| a.poses[a.poses.len() - 1].isometry().translation.vector;
        assert!((end(&trace) - end(&whole)).norm() < 1e-6, "{} {}", end(&trace), end(&whole));
    }
}

#[test]
fn other_parameters_in_the_same_worker_are_those_of_a_new_one() {
    let stroke = Stroke::new();
    let (changed, nominal) = (theta(EFFECTS), Theta::default());
    let fresh = [&nominal, &changed].map(|theta| stroke.run(&mut stroke.worker(Some(theta))));
    let mut worker = stroke.worker(Some(&changed));
    for _ in 0..2 {
        for (theta, fresh) in [&nominal, &changed].into_iter().zip(&fresh) {
            worker.set_parameters(theta).expect("parameters");
            same(&stroke.run(&mut worker), fresh);
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bits_in_the_order_of_the_jobs() {
    let stroke = Stroke::new();
    let jobs: Vec<Theta> = (0..12)
        .map(|i| {
            let object = ObjectTheta { friction: Some(0.15 + 0.02 * f64::from(i)), ..ObjectTheta::default() };
            Theta { object: Some(object), ..theta(EFFECTS) }
        })
        .collect();
    let answers = [1, 2, 3].map(|threads| {
        let workers = Workers::new((stroke.worker(None), CellTrace::default()), Some(threads)).expect("threads");
        workers.run(&jobs, |(worker, trace), theta| {
            worker.set_parameters(theta).expect("parameters");
            stroke.start(worker);
            trace.clear();
            worker.run(&stroke.course(), trace);
            trace.poses[trace.poses.len() - 1]
        })
    });
    assert!(answers[0].windows(2).all(|pair| pair[0] != pair[1]), "friction changes where the box ends");
    assert!(answers.iter().all(|answer| *answer == answers[0]));
}

#[test]
fn who_takes_no_part_is_not_there() {
    let stroke = Stroke::new();
    let mut worker = stroke.worker(None);
    let _ = stroke.run(&mut worker);
    worker.start(stroke.joints_ns[0], Some(&stroke.arm), None, Some(&stroke.commands));
    let mut alone = CellTrace::default();
    worker.run(&stroke.course(), &mut alone);
    assert_eq!((alone.contact, alone.poses.len()), (None, 0));
    let mut readings = vec![Default::default(); stroke.joints_ns.len()];
    worker.arm().expect("an arm").readings(
        &stroke.arm,
        stroke.joints_ns[0],
        &stroke.commands,
        &stroke.joints_ns,
        &mut readings,
    );
    assert!(alone.joints == readings);
    worker.start(7, None, Some(&ObjectState::at_rest(stroke.object.pose)), None);
    alone.clear();
    worker.run(&twin::rollout::Course { commands: None, joints_ns: &[], poses_ns: &[7, 1_000_000_007] }, &mut alone);
    assert_eq!((alone.contact, alone.joints.len()), (None, 0));
    assert!(
        (alone.poses[1].isometry().translation.vector - stroke.object.pose.isometry().translation.vector).norm() < 1e-6
    );
}

#[test]
fn who_asks_for_poses_alone_gets_the_same_ones_sooner() {
    let stroke = Stroke::new();
    for theta in [None, Some(theta(EFFECTS))] {
        let mut worker = stroke.worker(theta.as_ref());
        let whole = stroke.run(&mut worker);
        let whole_end = worker.now_ns();
        stroke.start(&mut worker);
        let mut poses = CellTrace::default();
        worker.run(&twin::rollout::Course { joints_ns: &[], ..stroke.course() }, &mut poses);
        assert!(poses.poses == whole.poses && poses.contact == whole.contact);
        assert!(worker.now_ns() + 300_000_000 < whole_end, "{} {whole_end}", worker.now_ns());
    }
}
