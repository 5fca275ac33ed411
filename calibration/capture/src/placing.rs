//! The object where a stroke needs it: put there by a person who is asked for it, or, where this capture has started the
//! simulated cell itself, by starting that cell anew with the object there and the others where they are. Base frame; m, rad.

use super::bridge::{Bridge, Wanted};
use super::link::Link;
use super::object_watch::{ObjectWatch, WatchError};
use super::program::Standing;
use super::stay::stay;
use super::task::Task;
use shared_mem::cell::Cell;
use shared_mem::interrupt::Interrupt;
use shared_mem::{console, output};
use std::path::PathBuf;
use std::time::{Duration, Instant};
use twin::scene::cell_bodies;

/// How near is near enough [m, rad]: what a hand can do.
const PLACING_TOLERANCE: [f64; 2] = [5e-3, 0.05];
/// How long a person has.
pub const BY_HAND: Duration = Duration::from_secs(120);
/// How often the person is shown what is missing.
const PROMPT_INTERVAL: Duration = Duration::from_secs(5);
/// How long an object may take to come to rest.
pub const COMES_TO_REST: Duration = Duration::from_secs(10);

/// Puts the object, or has it put, where strokes need it.
#[derive(Debug)]
pub struct Placing<'a> {
    /// What the capture is asked for.
    pub task: &'a Task,
    /// The laboratory's cell as it was simulated last, at first [`Self::simulated`].
    pub simulated: Cell,
    /// The bridge that is in use.
    pub bridge: &'a mut Bridge,
    /// Where the user ends it.
    pub interrupt: &'a Interrupt,
}

impl Placing<'_> {
    /// Returns where the object stands once that is near enough to `wanted`; `None` when the user gave up.
    ///
    /// # Errors
    /// One line: nobody put it there in time, or the tracker or the simulated cell failed.
    pub fn place(
        &mut self,
        wanted: &Standing,
        link: &mut Link,
        object: &mut ObjectWatch,
    ) -> anyhow::Result<Option<Standing>> {
        let Some(stands) = object.standing(COMES_TO_REST, self.interrupt)? else { return Ok(None) };
        if near(&stands, wanted) {
            return Ok(Some(stands));
        }
        if self.simulates() {
            self.simulate(wanted, link, object)?;
            return Ok(object.standing(COMES_TO_REST, self.interrupt)?);
        }
        self.by_hand(wanted, stands, object)
    }

    /// Whether this capture has started the simulated cell itself.
    pub fn simulates(&self) -> bool {
        self.bridge.is_own() && self.task.arm.as_deref().is_none_or(|arm| arm == "sim")
    }

    /// The cell as the simulated bridge reads it first.
    pub fn simulated(cell: &Cell) -> Cell {
        Cell { clips: Vec::new(), ..cell.at_home_anywhere() }
    }

    /// Starts the simulated cell anew with the object in its place and the others where they are.
    fn simulate(&mut self, wanted: &Standing, link: &mut Link, object: &mut ObjectWatch) -> anyhow::Result<()> {
        let bodies = cell_bodies(&self.simulated)?;
        for name in stay(&mut self.simulated, &bodies, &object.others()) {
            console::line(format_args!(
                "`{name}` lies on a side; in the cell that is started anew it stands upright there"
            ));
        }
        self.simulated.start_object_at(wanted.place, wanted.yaw.sin().atan2(wanted.yaw.cos()));
        let file = self.cell_file();
        output::write(&file, self.simulated.to_toml())?;
        console::line(format_args!("restarting the simulation with the object at {}", words(wanted)));
        let Task { realtime, domain, no_camera, .. } = self.task;
        let wanted = Wanted {
            cell: &file,
            arm: None,
            hand_eye: None,
            no_camera: *no_camera,
            realtime: realtime.as_deref(),
            domain: domain.as_deref(),
        };
        let started = self.bridge.simulate_anew(link, &wanted, self.interrupt);
        object.begin_anew()?;
        let removed = std::fs::remove_file(&file);
        started?;
        removed.map_err(|error| anyhow::anyhow!("cannot remove {}: {error}; remove it by hand", file.display()))
    }

    /// The cell.toml of the simulated cell, beside the session's own.
    fn cell_file(&self) -> PathBuf {
        self.task.out.join(format!(".placed-{}.toml", std::process::id()))
    }

    /// Asks a person, and says every few seconds what is missing.
    fn by_hand(
        &self,
        wanted: &Standing,
        mut stands: Standing,
        object: &mut ObjectWatch,
    ) -> anyhow::Result<Option<Standing>> {
        console::line(format_args!(
            "put the object at {} and take your hands away; waiting {} s (Ctrl-C ends). In a simulated cell nobody can: end the \
             bridge that runs, and this capture starts one of its own and sets the object there itself",
            words(wanted),
            BY_HAND.as_secs()
        ));
        let begin = Instant::now();
        let mut said = Instant::now();
        loop {
            // An object in somebody's hand does not come to rest: that is what is waited for.
            match object.resting(PROMPT_INTERVAL, self.interrupt) {
                Ok(None) => return Ok(None),
                Ok(Some(standing)) if near(&standing, wanted) => {
                    return Ok(object.standing(COMES_TO_REST, self.interrupt)?);
                }
                Ok(Some(standing)) => stands = standing,
                Err(WatchError::Restless(_) | WatchError::RestlessOf(..)) => {}
                Err(error) => return Err(error.into()),
            }
            if begin.elapsed() > BY_HAND {
                anyhow::bail!(
                    "the object stands at {}, not at {}, and nobody put it there within {} s; put it there and start the same \
                     command again, or end the running bridge where it is a simulated one",
                    words(&stands),
                    words(wanted),
                    BY_HAND.as_secs()
                );
            }
            if said.elapsed() > PROMPT_INTERVAL {
                said = Instant::now();
                console::line(format_args!("  {}", missing(&stands, wanted)));
            }
        }
    }
}

fn words(standing: &Standing) -> String {
    // What rounds to 0 has no sign.
    let round = |value: f64, steps: f64| (value * steps).round() / steps + 0.0;
    let [x, y] = standing.place.map(|x| round(x, 1e3));
    let yaw = round(standing.yaw.sin().atan2(standing.yaw.cos()).to_degrees(), 1.0);
    format!("x {x:.3} m, y {y:.3} m, turned to {yaw:.0} degrees")
}

/// What is missing, for a person's hands.
fn missing(stands: &Standing, wanted: &Standing) -> String {
    let [x, y] = [0, 1].map(|axis| 1e3 * (wanted.place[axis] - stands.place[axis]));
    let turn = between(wanted.yaw, stands.yaw).to_degrees();
    format!("still to move: {x:+.0} mm along x, {y:+.0} mm along y; still to turn: {turn:+.0} degrees")
}

fn near(stands: &Standing, wanted: &Standing) -> bool {
    let away = (stands.place[0] - wanted.place[0]).hypot(stands.place[1] - wanted.place[1]);
    away < PLACING_TOLERANCE[0] && between(stands.yaw, wanted.yaw).abs() < PLACING_TOLERANCE[1]
}

fn between(a: f64, b: f64) -> f64 {
    (a - b).sin().atan2((a - b).cos())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_hand_is_told_what_is_missing_the_shorter_way_round() {
        let wanted = Standing { place: [0.5, -0.02], yaw: 3.1 };
        let stands = Standing { place: [0.48, 0.01], yaw: -3.0 };
        assert!(!near(&stands, &wanted));
        assert_eq!(
            missing(&stands, &wanted),
            "still to move: +20 mm along x, -30 mm along y; still to turn: -10 degrees"
        );
        let level = Standing { place: [0.55, -1e-5], yaw: -1e-3 };
        assert_eq!(words(&level), "x 0.550 m, y 0.000 m, turned to 0 degrees");
        let there = Standing { place: [0.503, -0.018], yaw: 3.1 - std::f64::consts::TAU };
        assert!(near(&there, &wanted));
    }
}
