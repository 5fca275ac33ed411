//! Several objects in one picture, each followed by a tracker of its own.

use super::scenes::{cell, standing};
use nalgebra::{Isometry3, Vector3};
use rt_bridge::tracker::{Frame, Sight, Tracker, View};
use shared_mem::cell::{Cell, Object};
use shared_mem::frames::Pose;
use shared_mem::msg::image::ImageHeader;
use shared_mem::msg::object::ObjectName;
use twin::scene::{NamedPoses, SceneSnapshot};
use twin::sensors::camera::SimCamera;

/// A cell with boxes of these sizes.
fn boxes(sizes: &[[f64; 3]]) -> Cell {
    let mut described = cell(sizes[0]);
    let shipped = described.objects.pop().expect("a box");
    let named = |(number, size): (usize, &[f64; 3])| Object {
        name: Some(format!("box_{number}")),
        size: Some(*size),
        ..shipped.clone()
    };
    described.objects = sizes.iter().enumerate().map(named).collect();
    described
}

fn at([x, y]: [f64; 2], size: [f64; 3]) -> Pose<shared_mem::frames::Base, shared_mem::frames::Object> {
    Pose::from_isometry(Isometry3::translation(x, y, size[2] / 2.0))
}

/// Shows a scene of boxes at these places for so many frames; where each was seen last.
fn follow(sizes: &[[f64; 3]], frames: u64, places: impl Fn(u64) -> Vec<[f64; 2]>) -> Vec<Option<Vector3<f64>>> {
    let described = boxes(sizes);
    let mut camera = SimCamera::new(&described).expect("a camera");
    let of = |number: usize| Tracker::new(&Cell { in_question: number, ..described.clone() }).expect("a tracker");
    let mut trackers: Vec<Tracker> = (0..sizes.len()).map(of).collect();
    let view = View::new(&camera.info()).expect("a view");
    trackers.iter_mut().for_each(|tracker| tracker.set_view(view.clone()));
    let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
    let mut seen = vec![None; sizes.len()];
    for number in 0..frames {
        let mut named = NamedPoses::default();
        let poses: Vec<_> = places(number).into_iter().zip(sizes).map(|(place, size)| at(place, *size)).collect();
        for (pose, object) in poses.iter().zip(&described.objects) {
            named.push(ObjectName::new(object.name.as_deref().expect("a name")).expect("a name"), *pose);
        }
        let scene = SceneSnapshot { object: Some(poses[0]), named, ..standing(&described, 0.5, 0.0, 0.0, number) };
        let headers: [ImageHeader; 2] = camera.render(&scene, &mut color, &mut depth);
        let frame = Frame::new(&view, (&headers[1], &depth), Some((&headers[0], &color))).expect("a frame");
        for (i, seen) in seen.iter_mut().enumerate() {
            let (before, rest) = trackers.split_at_mut(i);
            let (tracker, behind) = rest.split_first_mut().expect("a tracker");
            let others: Vec<&Tracker> = before.iter().chain(behind.iter()).collect();
            let sight = tracker.look_beside(&frame, scene.time_ns as f64 * 1e-9, Some(&scene.q), &others);
            *seen = match sight {
                Sight::Tracked(estimate) => Some(estimate.pose.isometry().translation.vector),
                Sight::Lost(_) => None,
            };
        }
    }
    seen
}

#[test]
fn each_of_two_boxes_is_found_and_followed_by_its_own_shape() {
    let sizes = [[0.08, 0.06, 0.10], [0.05, 0.05, 0.16]];
    let moving = |frame: u64| vec![[0.45, -0.12 + 0.004 * frame.saturating_sub(10) as f64], [0.58, 0.15]];
    let seen = follow(&sizes, 30, moving);
    for ((place, size), seen) in moving(29).into_iter().zip(sizes).zip(&seen) {
        let seen = seen.unwrap_or_else(|| panic!("the box of {size:?} is lost"));
        let truth = Vector3::new(place[0], place[1], size[2] / 2.0);
        assert!((seen - truth).norm() < 0.004, "{seen} for {truth}");
    }
}

#[test]
fn of_two_boxes_that_look_the_same_each_tracker_follows_another() {
    let sizes = [[0.07, 0.06, 0.10]; 2];
    let places = [[0.45, -0.12], [0.58, 0.15]];
    let seen = follow(&sizes, 24, |_| places.to_vec());
    let seen: Vec<Vector3<f64>> = seen.into_iter().map(|seen| seen.expect("a box")).collect();
    let truth = places.map(|[x, y]| Vector3::new(x, y, 0.05));
    let off = |order: [usize; 2]| (0..2).map(|i| (seen[i] - truth[order[i]]).norm()).fold(0.0, f64::max);
    assert!(off([0, 1]).min(off([1, 0])) < 0.004, "{seen:?}");
}
