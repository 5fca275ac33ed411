//! A stroke whose tool pushes the object on after the hit, as its parameters change by little.

use crate::stroke::{Stroke, theta};
use nalgebra::{Isometry3, Vector3};

/// Where the object comes to rest under a friction.
fn resting_place(stroke: &Stroke, friction: f64) -> Isometry3<f64> {
    let theta = theta(&format!("[object]\nfriction = {friction:?}"));
    let trace = stroke.run(&mut stroke.worker(Some(&theta)));
    let contact = trace.contact.expect("the tool hits the box");
    assert!(contact.end_ns - contact.start_ns > 100_000_000, "pushed for {contact:?}");
    trace.poses.last().expect("poses").isometry()
}

#[test]
fn the_resting_place_follows_the_friction_without_jumps() {
    let stroke = Stroke::new();
    let place = |more: f64| resting_place(&stroke, 0.3 * (1.0 + more)).translation.vector;
    let places: Vec<Vector3<f64>> = (0..8).map(|i| place(1e-4 * f64::from(i))).collect();
    for three in places.windows(3) {
        let (first, second) = (three[1] - three[0], three[2] - three[1]);
        assert!((second - first).norm() < 5e-6, "{first} and then {second}");
    }
    let travel = (place(-0.05) - place(0.05)).norm();
    assert!(travel > 1e-4, "{travel} m");
}
