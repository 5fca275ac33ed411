//! What every touching place does within a step: it parts, sticks or slips. Once that is known the impulses are the
//! unknowns of linear equations, and their answer tells whether the places do as was supposed.

use super::{Contact, Impulses};
use nalgebra::Vector3;

/// Most unknowns: one for a place that slips, three for one that sticks. A box on a face has room for it, with a tool.
const UNKNOWNS: usize = 12;
/// Changes of what places are supposed to do, at most [1].
const MODE_CHANGES: usize = 6;
/// Give of a place, as a share of the largest coefficient. It decides what equations of rigid places leave open: the four
/// corners of a face share its load evenly.
const GIVE: f64 = 1e-6;
/// Impulses larger than this many times what would give each place its velocity by itself come of velocities that no rigid
/// body can have, as where both ends of a turning tool hold fast.
const FORCED: f64 = 10.0;
/// A slip slower than this has no direction [m/s].
const DIRECTIONLESS_SLIP: f64 = 1e-6;

/// What a place does.
#[derive(Clone, Copy)]
pub(super) enum Mode {
    Parts,
    Sticks,
    /// With the impulse for a push of one.
    Slips(Vector3<f64>),
}

/// One number to be found, and the equation that it came with.
#[derive(Clone, Copy, Default)]
struct Unknown {
    place: usize,
    /// Impulse for one of it.
    along: Vector3<f64>,
    /// The direction in which the equation asks for a velocity, and how much of it is lacking [m/s].
    across: Vector3<f64>,
    lacking: f64,
}

impl Mode {
    /// Of a place that moves like `relative` towards the surface or along it: it goes on as it does.
    pub(super) fn of_motion(contact: &Contact, relative: &Vector3<f64>) -> Self {
        let parting = relative.dot(&contact.normal);
        if parting >= contact.least_parting {
            return Self::Parts;
        }
        let slip = relative - contact.normal * parting;
        let speed = slip.norm();
        match (speed > DIRECTIONLESS_SLIP, contact.friction > 0.0) {
            (true, _) => Self::Slips(contact.normal - slip * (contact.friction / speed)),
            (false, true) => Self::Sticks,
            (false, false) => Self::Slips(contact.normal),
        }
    }

    /// Of a place with an impulse: on Coulomb's cone it slips, inside it sticks.
    pub(super) fn of_impulse(contact: &Contact, impulse: &Vector3<f64>) -> Self {
        let push = impulse.dot(&contact.normal);
        if push <= 0.0 {
            return Self::Parts;
        }
        let friction_impulse = impulse - contact.normal * push;
        let inside = friction_impulse.norm() < contact.friction * push * (1.0 - 1e-9);
        if inside { Self::Sticks } else { Self::Slips(impulse / push) }
    }
}

impl<const N: usize> Impulses<'_, N> {
    /// Takes the impulses with which every place does what `mode` supposes from its motion and its impulse so far, or, where
    /// that is impossible, something near it; leaves what there is where there is no such answer.
    pub(super) fn follow(&mut self, mode: impl Fn(&Contact, &Vector3<f64>, &Vector3<f64>) -> Mode) {
        if self.count == 0 {
            return;
        }
        let (mut modes, mut before) = ([Mode::Parts; N], [Vector3::zeros(); N]);
        for i in 0..self.count {
            before[i] = self.places[i].impulse;
            modes[i] = mode(&self.places[i].contact, &self.relative(i), &before[i]);
        }
        (0..self.count).for_each(|i| self.push(i, &-before[i]));
        let found = self.supposing(modes).unwrap_or(before);
        (0..self.count).for_each(|i| self.push(i, &found[i]));
    }

    /// The impulses on a body that nothing has pushed yet.
    fn supposing(&self, mut modes: [Mode; N]) -> Option<[Vector3<f64>; N]> {
        for _ in 0..MODE_CHANGES {
            let impulses = self.answer(&modes)?;
            if !self.corrected(&mut modes, &impulses) {
                return Some(impulses);
            }
        }
        None
    }

    /// The one answer to the equations of `modes`.
    fn answer(&self, modes: &[Mode; N]) -> Option<[Vector3<f64>; N]> {
        let (mut unknowns, mut count) = ([Unknown::default(); UNKNOWNS], 0);
        for (place, mode) in modes[..self.count].iter().enumerate() {
            let (contact, relative) = (&self.places[place].contact, self.relative(place));
            let lacking = contact.normal * contact.least_parting - relative;
            let holding = [Vector3::x(), Vector3::y(), Vector3::z()].map(|axis| (axis, axis));
            let directions = match mode {
                Mode::Parts => &[],
                Mode::Sticks => &holding[..],
                Mode::Slips(along) => &[(*along, contact.normal)],
            };
            for &(along, across) in directions {
                *unknowns.get_mut(count)? = Unknown { place, along, across, lacking: lacking.dot(&across) };
                count += 1;
            }
        }
        let unknowns = &unknowns[..count];
        let mut rows = [[0.0; UNKNOWNS + 1]; UNKNOWNS];
        for (column, unknown) in unknowns.iter().enumerate() {
            let turning = self.inverse_inertia * self.places[unknown.place].contact.lever.cross(&unknown.along);
            for (row, asked) in unknowns.iter().enumerate() {
                let moved = unknown.along * self.inverse_mass + turning.cross(&self.places[asked.place].contact.lever);
                rows[row][column] = asked.across.dot(&moved);
            }
            rows[column][UNKNOWNS] = unknown.lacking;
        }
        let sizes = eliminated(&mut rows, count)?;
        let mut impulses = [Vector3::zeros(); N];
        unknowns.iter().zip(&sizes).for_each(|(unknown, size)| impulses[unknown.place] += unknown.along * *size);
        let by_itself = unknowns.iter().map(|unknown| unknown.lacking.abs()).sum::<f64>() / self.inverse_mass;
        // Not `>`: numbers out of range are no answer either.
        let moderate = impulses.iter().all(|impulse| impulse.norm() <= FORCED * by_itself);
        moderate.then_some(impulses)
    }

    /// Whether a place cannot do what was supposed: it would pull, stick beyond its friction, or be driven by it.
    fn corrected(&self, modes: &mut [Mode; N], impulses: &[Vector3<f64>; N]) -> bool {
        let push = |i: usize| impulses[i].dot(&self.places[i].contact.normal);
        let most_pulling = (0..self.count).filter(|i| push(*i) < 0.0).min_by(|a, b| push(*a).total_cmp(&push(*b)));
        if let Some(i) = most_pulling {
            modes[i] = Mode::Parts;
            return true;
        }
        let (mut velocity, mut spin) = (Vector3::zeros(), Vector3::zeros());
        for (place, impulse) in self.places[..self.count].iter().zip(impulses) {
            velocity += impulse * self.inverse_mass;
            spin += self.inverse_inertia * place.contact.lever.cross(impulse);
        }
        let mut corrected = false;
        for i in 0..self.count {
            let Contact { lever, normal, friction, .. } = self.places[i].contact;
            let (push, friction_impulse) = (push(i), impulses[i] - normal * push(i));
            let after = self.relative(i) + velocity + spin.cross(&lever);
            let instead = match modes[i] {
                Mode::Sticks if friction_impulse.norm() > friction * push => {
                    Mode::Slips(normal + friction_impulse * (friction / friction_impulse.norm()))
                }
                Mode::Slips(along) if after.dot(&(along - normal)) > DIRECTIONLESS_SLIP * friction => Mode::Sticks,
                _ => continue,
            };
            (modes[i], corrected) = (instead, true);
        }
        corrected
    }
}

/// The unknowns of linear equations, whose right-hand sides stand in the last column; `None` where friction jams them.
fn eliminated(rows: &mut [[f64; UNKNOWNS + 1]; UNKNOWNS], count: usize) -> Option<[f64; UNKNOWNS]> {
    let largest = (0..count).map(|i| rows[i][i].abs()).fold(0.0, f64::max);
    (0..count).for_each(|i| rows[i][i] += GIVE * largest);
    for pivot in 0..count {
        if rows[pivot][pivot] < 0.5 * GIVE * largest {
            return None;
        }
        for row in pivot + 1..count {
            let factor = rows[row][pivot] / rows[pivot][pivot];
            for column in (pivot + 1..count).chain([UNKNOWNS]) {
                rows[row][column] -= factor * rows[pivot][column];
            }
        }
    }
    let mut found = [0.0; UNKNOWNS];
    for i in (0..count).rev() {
        let known: f64 = (i + 1..count).map(|j| rows[i][j] * found[j]).sum();
        found[i] = (rows[i][UNKNOWNS] - known) / rows[i][i];
    }
    Some(found)
}
