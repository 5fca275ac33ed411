//! The live twin as the camera sees it: its picture at the moment of the camera's, and both mixed and subtracted.

use super::session::{TwinView, ViewError, difference, tight_pixels};
use crate::arm::{Joints, MAX_JOINTS};
use shared_mem::frames::{Base, Object, Pose};
use shared_mem::msg::image::{ImageHeader, PixelEncoding};
use shared_mem::msg::twin::{TwinObject, TwinState};
use std::collections::VecDeque;

/// The twin is remembered for so many of its states: at 30 a second, longer than a picture is under way.
const REMEMBERED: usize = 32;

/// The view, and where the twin was lately.
#[derive(Debug)]
pub struct LiveView {
    view: TwinView,
    latency_ns: u64,
    moments: VecDeque<Moment>,
    /// Where the objects beside the first are.
    others: Vec<Option<Pose<Base, Object>>>,
}

#[derive(Debug, Clone, Copy)]
struct Moment {
    stamp_ns: u64,
    q: Joints,
    object: Option<Pose<Base, Object>>,
}

/// Three pictures of the camera's size: red, green, blue, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct Beside {
    /// Columns and rows.
    pub size: [usize; 2],
    /// The twin alone.
    pub twin: Vec<u8>,
    /// Half camera, half twin.
    pub blend: Vec<u8>,
    /// How far they are apart.
    pub difference: Vec<u8>,
}

impl LiveView {
    /// A view, and how long after its exposure a picture arrives [s].
    pub fn new(view: TwinView, latency: f64) -> Self {
        let others = vec![None; view.names().len().saturating_sub(1)];
        Self { view, latency_ns: (latency * 1e9) as u64, moments: VecDeque::with_capacity(REMEMBERED), others }
    }

    /// Takes note of where the twin is.
    pub fn remember(&mut self, state: &TwinState) {
        let object = Pose::from_parts(state.object_position, state.object_wxyz).filter(|_| state.has_object == 1);
        // A bridge that was started again begins a new story.
        if self.moments.back().is_some_and(|last| last.stamp_ns > state.mirrors_ns) {
            self.moments.clear();
        }
        if self.moments.len() == REMEMBERED {
            self.moments.pop_front();
        }
        self.moments.push_back(Moment { stamp_ns: state.mirrors_ns, q: state.q, object });
    }

    /// Takes note of where one of several objects is in the twin.
    pub fn remember_object(&mut self, object: &TwinObject) {
        let place = self.view.names().iter().position(|name| *name == object.name);
        if let Some(other) = place.and_then(|place| self.others.get_mut(place.checked_sub(1)?)) {
            *other = Pose::from_parts(object.position, object.wxyz);
        }
    }

    /// The twin beside a colour picture; `None` before the twin is known.
    ///
    /// # Errors
    /// [`ViewError::Size`] when the picture is not of the cell's camera, [`ViewError::Paint`] when a device fails.
    pub fn beside(&mut self, header: &ImageHeader, bytes: &[u8]) -> Result<Option<Beside>, ViewError> {
        let of_pictures = [header.width as usize, header.height as usize];
        if of_pictures != self.view.size() || header.encoding != PixelEncoding::Rgb8 {
            return Err(ViewError::Size { of_pictures, of_camera: self.view.size() });
        }
        let Some((q, object)) = self.at(header.stamp_ns.saturating_sub(self.latency_ns)) else { return Ok(None) };
        let (size, camera) = tight_pixels(header, bytes);
        let objects: Vec<_> = [object].into_iter().chain(self.others.iter().copied()).collect();
        let twin = self.view.draw_all(&q, &objects)?;
        let blend = camera.iter().zip(&twin).map(|(a, b)| a.midpoint(*b)).collect();
        let difference = difference(&camera, &twin);
        Ok(Some(Beside { size, twin, blend, difference }))
    }

    /// Joints between the states around a moment, and the object of the later one.
    fn at(&self, stamp_ns: u64) -> Option<(Joints, Option<Pose<Base, Object>>)> {
        let next = self.moments.partition_point(|moment| moment.stamp_ns < stamp_ns);
        let (Some(after), Some(before)) = (self.moments.get(next), self.moments.get(next.saturating_sub(1))) else {
            return self.moments.back().map(|last| (last.q, last.object));
        };
        let span = after.stamp_ns.saturating_sub(before.stamp_ns).max(1);
        let share = stamp_ns.saturating_sub(before.stamp_ns) as f64 / span as f64;
        let mut q = [0.0; MAX_JOINTS];
        for (i, q) in q.iter_mut().enumerate() {
            *q = before.q[i] + share.min(1.0) * (after.q[i] - before.q[i]);
        }
        Some((q, after.object))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Drawer;
    use crate::scene::SceneSnapshot;
    use crate::sensors::camera::SimCamera;
    use crate::shipped::shipped;
    use shared_mem::cell::Cell;

    fn live() -> (Cell, LiveView) {
        let cell = shipped();
        let view = TwinView::new(&cell, None, None, Drawer::Processor).expect("a view");
        (cell, LiveView::new(view, 0.01))
    }

    #[test]
    fn the_twin_is_shown_where_it_was_when_the_picture_was_taken() {
        let (cell, mut live) = live();
        let state =
            |ms: u64, q: f64| TwinState { mirrors_ns: ms * 1_000_000, q: [q; MAX_JOINTS], ..TwinState::default() };
        assert!(live.at(5).is_none());
        live.remember(&state(100, 0.0));
        live.remember(&state(133, 0.33));
        let q = |live: &LiveView, ms: u64| live.at(ms * 1_000_000).expect("a moment").0[0];
        assert!((q(&live, 110) - 0.1).abs() < 1e-9 && q(&live, 50) == 0.0 && q(&live, 200) == 0.33);
        // The camera's own picture of a scene at that moment, 10 ms under way.
        let joints = [0.0, -0.8, 0.0, -2.4, 0.0, 1.6, 0.8, 0.0];
        live.remember(&TwinState { mirrors_ns: 150_000_000, q: joints, ..TwinState::default() });
        let mut camera = SimCamera::new(&cell).expect("a camera");
        let (mut color, mut depth) = (vec![0; camera.color_bytes()], vec![0; camera.depth_bytes()]);
        let scene = SceneSnapshot { q: joints, dof: 7, ..SceneSnapshot::default() };
        let [mut header, _] = camera.render(&scene, &mut color, &mut depth);
        header.stamp_ns = 160_000_000;
        let seen = live.beside(&header, &color).expect("the same size").expect("a picture");
        let white = |rgb: &[u8]| rgb.iter().all(|c| *c > 200);
        let arm = seen.twin.chunks_exact(3).filter(|rgb| white(rgb)).count();
        let apart = seen.difference.chunks_exact(3).zip(seen.twin.chunks_exact(3));
        let wrong = apart.filter(|(off, twin)| white(twin) && off.iter().any(|c| *c > 20)).count();
        assert!(arm > 2000 && wrong * 100 < arm, "{wrong} of {arm} pixels of the arm");
        let halves = seen.blend.iter().zip(color.iter().zip(&seen.twin));
        assert!(
            halves.into_iter().all(|(mix, (a, b))| (i32::from(*mix) * 2).abs_diff(i32::from(*a) + i32::from(*b)) <= 1)
        );
    }

    #[test]
    fn a_bridge_that_begins_again_leaves_no_old_states_and_another_size_is_refused() {
        let (_, mut live) = live();
        live.remember(&TwinState { mirrors_ns: 9_000_000_000, ..TwinState::default() });
        live.remember(&TwinState { mirrors_ns: 1_000_000, q: [0.5; MAX_JOINTS], ..TwinState::default() });
        assert_eq!((live.moments.len(), live.at(0).map(|(q, _)| q[0])), (1, Some(0.5)));
        let header = ImageHeader { width: 1280, height: 720, ..ImageHeader::default() };
        let error = live.beside(&header, &[]).expect_err("another size").to_string();
        assert!(error.contains("1280 x 720") && !error.contains('\n'), "{error}");
    }
}
