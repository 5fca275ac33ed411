//! The joint and the parts of known objects, out of two of their states each and out of marks in pictures of one.

mod states;

use nalgebra::{Isometry3, Point3, Unit, Vector3};
use reconstruct::articulated::{Articulated, ArticulatedError, Joint, MarkedView, between, marked};
use reconstruct::mesh::Mesh;
use reconstruct::scan::Camera;
use shared_mem::lens::Distortion;
use states::{Kind, State, kinds};

/// What was found beside the truth.
struct Score {
    /// Between the axes [degree].
    direction: f64,
    /// From the true axis to the found one, near the part [m].
    place: f64,
    kind: bool,
    /// What base and part have in common with the true ones, of what either has; the smaller one.
    overlap: f64,
}

fn score(kind: &Kind, state: &State, truth: &Joint, found: &Articulated) -> Score {
    let (a, b) = (found.joint.direction().into_inner(), truth.direction().into_inner());
    let direction = a.dot(&b).abs().min(1.0).acos().to_degrees();
    let (place, same) = match (&found.joint, truth) {
        (Joint::Revolute { point, .. }, Joint::Revolute { point: own, .. }) => {
            let away = point - own;
            ((away - b * b.dot(&away)).norm(), true)
        }
        (Joint::Prismatic { .. }, Joint::Prismatic { .. }) => (0.0, true),
        _ => (f64::INFINITY, false),
    };
    // Areas [truth][found] of the base and of the part.
    let mut areas = [[0.0; 2]; 2];
    let mesh = &state.mesh;
    for number in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners(number);
        let middle = Point3::from((a.coords + b.coords + c.coords) / 3.0);
        areas[usize::from(kind.is_part(state, &middle))][usize::from(found.moves(&middle))] += mesh.area(number);
    }
    // Frames of their own do not say which of the two stays.
    let common = |[base, part]: [[f64; 2]; 2]| {
        let wrong = base[1] + part[0];
        (base[0] / (base[0] + wrong)).min(part[1] / (part[1] + wrong))
    };
    let swapped = areas.map(|[base, part]| [part, base]);
    Score { direction, place, kind: same, overlap: common(areas).max(common(swapped)) }
}

/// Whether a state of an object is found well enough, and a line about it.
fn judged(kind: &Kind, seed: u64) -> (bool, String) {
    let [first, second] = kind.states(seed);
    let truth = kind.joint_in(&second, second.travel - first.travel);
    let head = format!("{} {seed}: {:.3} and {:.3}", kind.name, first.travel, second.travel);
    match between(first.mesh.clone(), second.mesh.clone()) {
        Ok(found) => {
            let Score { direction, place, kind, overlap } = score(kind, &second, &truth, &found);
            let fine = direction <= 1.0 && place <= 3e-3 && kind && overlap >= 0.95;
            let sure = found.certainty.expect("two states");
            let line = format!(
                "{head}: {direction:.2} degrees, {:.2} mm, kind {kind}, overlap {overlap:.3}; evidence {:.0}, noise {:.2} mm, \
                 deviations {:.2} degrees, {:.2} mm{}",
                1e3 * place,
                sure.evidence,
                1e3 * sure.noise,
                sure.direction.to_degrees(),
                1e3 * sure.place,
                if fine { "" } else { " MISSED" }
            );
            (fine, line)
        }
        Err(error) => (false, format!("{head}: {error} MISSED")),
    }
}

fn ten_states(of: usize) {
    let kind = &kinds()[of];
    let mut missed = 0;
    for seed in 0..10 {
        let (fine, line) = judged(kind, seed);
        eprintln!("{line}");
        missed += u32::from(!fine);
    }
    assert_eq!(missed, 0, "of ten");
}

#[test]
fn joint_and_parts_of_a_laptop_and_a_drawer_are_found_out_of_two_states_each() {
    // A box's lid turns as a laptop's does: its ten states are enough.
    for kind in &kinds()[..2] {
        // Of the drawer, states in which the case's ceiling and the drawer's sides slide within their own planes.
        let (fine, line) = judged(kind, 1);
        assert!(fine, "{line}");
    }
}

#[test]
#[ignore = "takes minutes: cargo test --release --workspace --test articulated -- --ignored --nocapture"]
fn ten_states_of_a_laptop() {
    ten_states(0);
}

#[test]
#[ignore = "takes minutes: cargo test --release --workspace --test articulated -- --ignored --nocapture"]
fn ten_states_of_a_drawer() {
    ten_states(1);
}

#[test]
#[ignore = "takes minutes: cargo test --release --workspace --test articulated -- --ignored --nocapture"]
fn ten_states_of_a_box_with_a_lid() {
    ten_states(2);
}

/// A picture of a state from a place in the object's frame, with the part marked.
fn view(kind: &Kind, state: &State, eye: Point3<f64>, axis: Option<[Point3<f64>; 2]>) -> MarkedView {
    let camera = Camera { width: 160, height: 120, focal: [190.0; 2], centre: [80.0, 60.0], lens: Distortion::NONE };
    let pose = state.frame * Isometry3::face_towards(&eye, &Point3::new(0.08, 0.0, 0.05), &-Vector3::z());
    let is_part = |pixel: usize| {
        let [x, y] = camera.direction([(pixel % 160) as f64 + 0.5, (pixel / 160) as f64 + 0.5]);
        let way = Unit::new_normalize(pose * Vector3::new(x, y, 1.0));
        let mut along = 0.0;
        for _ in 0..100 {
            let place = Point3::from(pose.translation.vector) + way.into_inner() * along;
            let [base, part] = kind.distances(state, &place);
            along += base.min(part);
            if base.min(part) < 1e-4 {
                return part < base;
            }
        }
        false
    };
    let pixel = |place: Point3<f64>| {
        camera.project(&pose.inverse_transform_point(&(state.frame * place))).expect("before the camera")
    };
    MarkedView {
        name: "a".into(),
        camera,
        mesh_from_camera: pose,
        part: (0..160 * 120).map(is_part).collect(),
        axis: axis.map(|places| places.map(pixel)),
    }
}

#[test]
fn a_laptop_marked_in_three_pictures_of_one_state_is_parted_there_and_turns_about_the_marked_axis() {
    let [kind, ..] = kinds();
    let [_, state] = kind.states(5);
    let ends = [Point3::new(0.0, 0.12, 0.0165), Point3::new(0.0, -0.12, 0.0165)];
    let views = [
        view(&kind, &state, Point3::new(-0.4, 0.1, 0.15), Some(ends)),
        view(&kind, &state, Point3::new(0.5, 0.2, 0.4), None),
        view(&kind, &state, Point3::new(0.2, -0.4, -0.2), None),
    ];
    let found = marked(state.mesh.clone(), &views, true, [-1.0, 0.4]).expect("an object");
    let Score { direction, place, overlap, .. } = score(&kind, &state, &kind.joint_in(&state, 1.0), &found);
    // Where a pixel is two millimetres wide.
    assert!(direction < 1.5 && place < 5e-3 && overlap > 0.95, "{direction} {} {overlap}", place * 1e3);
    let nowhere = [MarkedView { axis: Some([[1.0, 1.0], [3.0, 1.0]]), ..views[0].clone() }];
    let error = marked(state.mesh.clone(), &nowhere, true, [-1.0, 0.4]).expect_err("no axis");
    assert!(error.to_string().contains("not at pixel (1, 1)"), "{error}");
}

#[test]
fn states_in_which_nothing_moves_and_meshes_of_two_objects_are_refused() {
    let [laptop, drawer, _] = kinds();
    let [first, second] = laptop.states(1);
    let still = between(first.mesh.clone(), first.mesh.clone());
    assert!(matches!(still, Err(ArticulatedError::Still { .. })), "{still:?}");
    let [_, other] = drawer.states(1);
    let refused = between(second.mesh.clone(), other.mesh);
    assert!(matches!(refused, Err(ArticulatedError::Unexplained { .. })), "{refused:?}");
    let mut open: Mesh = first.mesh;
    open.triangles.pop();
    assert!(matches!(between(open, second.mesh), Err(ArticulatedError::Flaw(_))));
}
