//! The impulses at all places that touch a free body within one step, found together: each place gives way as it must and
//! pulls at nothing, and friction stops a slip or reaches Coulomb's cone.
//!
//! Sweeps over the places (projected Gauss-Seidel) find them. They begin at a guess that is the answer already where
//! every place slips on the way it slipped before, as it mostly does: the pushes are then the unknowns of linear
//! equations. Base frame, SI. Called by [`super::tumble`].

use crate::sliding::FreeBody;
use nalgebra::{Matrix3, Point3, Vector3};

/// Sweeps over the places, and the change of velocity [m/s] below which they end early.
const SWEEPS: usize = 40;
const SETTLED: f64 = 1e-6;
/// Most places whose pushes are guessed: a box that leans on an edge or stands on a face, with both ends of a tool.
const GUESSED: usize = 6;
/// Share of the largest coefficient below which the equations leave a push open: four corners of a face do.
const OPEN: f64 = 1e-6;
/// A slip slower than this has no direction [m/s].
const STICKS: f64 = 1e-6;

/// One place that touches within the step.
#[derive(Clone, Copy)]
pub(super) struct Contact {
    /// From the centre of mass, world axes.
    pub(super) lever: Vector3<f64>,
    /// Away from table or tool.
    pub(super) normal: Vector3<f64>,
    /// Of table or tool.
    pub(super) surface_velocity: Vector3<f64>,
    /// Least speed along the normal, relative to the surface, after the step [m/s].
    pub(super) least_parting: f64,
    pub(super) friction: f64,
}

/// The same with what it takes to find its impulse.
#[derive(Clone, Copy)]
struct Place {
    contact: Contact,
    /// Impulse for one unit of velocity: along the normal, and across it in the most mobile direction.
    normal_mass: f64,
    slip_mass: f64,
    impulse: Vector3<f64>,
}

/// A body in the middle of a step, and at most `N` places that touch it.
pub(super) struct Impulses<'a, const N: usize> {
    body: &'a mut FreeBody,
    inverse_mass: f64,
    inverse_inertia: Matrix3<f64>,
    places: [Place; N],
    count: usize,
}

impl Contact {
    /// A table that holds against what comes down on it.
    pub(super) const NONE: Self = Self {
        lever: Vector3::new(0.0, 0.0, 0.0),
        normal: Vector3::new(0.0, 0.0, 1.0),
        surface_velocity: Vector3::new(0.0, 0.0, 0.0),
        least_parting: 0.0,
        friction: 0.0,
    };

    /// Impulse for a push of one, at a place that moves like `relative`.
    fn per_push(&self, relative: &Vector3<f64>) -> Vector3<f64> {
        let slip = relative - self.normal * relative.dot(&self.normal);
        let speed = slip.norm();
        if speed > STICKS { self.normal - slip * (self.friction / speed) } else { self.normal }
    }
}

impl Place {
    const NONE: Self =
        Self { contact: Contact::NONE, normal_mass: 1.0, slip_mass: 1.0, impulse: Vector3::new(0.0, 0.0, 0.0) };

    /// The impulse with which the place gives way as it must and rubs as it can, from its velocity relative to the surface.
    #[inline]
    fn relaxed(&self, relative: &Vector3<f64>) -> Vector3<f64> {
        let Contact { normal, least_parting, friction, .. } = &self.contact;
        let (parting, before) = (relative.dot(normal), self.impulse.dot(normal));
        let push = (before + (least_parting - parting) * self.normal_mass).max(0.0);
        let slip = relative - normal * parting;
        let wanted = self.impulse - normal * before - slip * self.slip_mass;
        let (limit, square) = (friction * push, wanted.norm_squared());
        let rubbing = if square > limit * limit { wanted * (limit / square.sqrt()) } else { wanted };
        normal * push + rubbing
    }
}

impl<'a, const N: usize> Impulses<'a, N> {
    pub(super) fn on(body: &'a mut FreeBody, inverse_mass: f64, inverse_inertia: Matrix3<f64>) -> Self {
        Self { body, inverse_mass, inverse_inertia, places: [Place::NONE; N], count: 0 }
    }

    pub(super) fn centre(&self) -> Point3<f64> {
        self.body.centre
    }

    pub(super) fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// What was found, in the order in which the places were added [N s].
    pub(super) fn iter(&self) -> impl Iterator<Item = Vector3<f64>> + '_ {
        self.places[..self.count].iter().map(|place| place.impulse)
    }

    pub(super) fn velocity_at(&self, lever: &Vector3<f64>) -> Vector3<f64> {
        self.body.velocity + self.body.angular_velocity.cross(lever)
    }

    /// Adds a place, as long as there is room.
    pub(super) fn add(&mut self, contact: Contact) {
        if self.count == N {
            return;
        }
        let cross = contact.lever.cross_matrix();
        let mobility =
            cross.transpose() * self.inverse_inertia * cross + Matrix3::from_diagonal_element(self.inverse_mass);
        let normal_mobility = contact.normal.dot(&(mobility * contact.normal));
        // The larger eigenvalue of the mobility across the normal, from trace and determinant of that 2 x 2 block.
        let [x, y, z] = [mobility.column(0), mobility.column(1), mobility.column(2)];
        let cofactors = Vector3::new(
            contact.normal.dot(&y.cross(&z)),
            contact.normal.dot(&z.cross(&x)),
            contact.normal.dot(&x.cross(&y)),
        );
        let (half_trace, determinant) = (0.5 * (mobility.trace() - normal_mobility), contact.normal.dot(&cofactors));
        let slip_mobility = half_trace + (half_trace * half_trace - determinant).max(0.0).sqrt();
        self.places[self.count] = Place {
            contact,
            normal_mass: 1.0 / normal_mobility,
            slip_mass: 1.0 / slip_mobility,
            impulse: Vector3::zeros(),
        };
        self.count += 1;
    }

    /// Finds the impulses and gives them to the body.
    pub(super) fn settle(&mut self) {
        self.guess();
        for _ in 0..SWEEPS {
            let mut largest: f64 = 0.0;
            for i in 0..self.count {
                let relative = self.relative(i);
                let change = self.places[i].relaxed(&relative) - self.places[i].impulse;
                self.push(i, &change);
                largest = largest.max(change.amax() * self.inverse_mass);
            }
            if largest < SETTLED {
                break;
            }
        }
    }

    /// Velocity of a place relative to its surface.
    fn relative(&self, i: usize) -> Vector3<f64> {
        self.velocity_at(&self.places[i].contact.lever) - self.places[i].contact.surface_velocity
    }

    fn push(&mut self, i: usize, change: &Vector3<f64>) {
        let place = &mut self.places[i];
        place.impulse += change;
        self.body.velocity += change * self.inverse_mass;
        self.body.angular_velocity += self.inverse_inertia * place.contact.lever.cross(change);
    }

    /// Impulses for the sweeps to begin with; none where there is no simple answer.
    fn guess(&mut self) {
        if self.count < 2 || self.count > GUESSED {
            return;
        }
        let mut equations = Equations { rows: [[0.0; GUESSED + 1]; GUESSED], count: self.count };
        let (mut per_push, mut pushed) = ([Vector3::zeros(); GUESSED], [false; GUESSED]);
        for i in 0..self.count {
            let (contact, relative) = (&self.places[i].contact, self.relative(i));
            let lacking = contact.least_parting - relative.dot(&contact.normal);
            (per_push[i], pushed[i]) = (contact.per_push(&relative), lacking > 0.0);
            equations.rows[i][GUESSED] = lacking;
            let (linear, angular) =
                (per_push[i] * self.inverse_mass, self.inverse_inertia * contact.lever.cross(&per_push[i]));
            for (row, other) in self.places[..self.count].iter().map(|place| &place.contact).enumerate() {
                equations.rows[row][i] = other.normal.dot(&(linear + angular.cross(&other.lever)));
            }
        }
        // A place that would have to pull is left out, and the others are asked again.
        for _ in 0..self.count {
            let Some(pushes) = equations.solve(&pushed) else { return };
            let pulling = (0..self.count).filter(|i| pushes[*i] < 0.0).min_by(|a, b| pushes[*a].total_cmp(&pushes[*b]));
            match pulling {
                Some(i) => pushed[i] = false,
                None => {
                    (0..self.count).filter(|i| pushed[*i]).for_each(|i| self.push(i, &(per_push[i] * pushes[i])));
                    return;
                }
            }
        }
    }
}

/// Linear equations for the pushes: what each does to the parting speeds, and in the last column what these lack.
struct Equations {
    rows: [[f64; GUESSED + 1]; GUESSED],
    count: usize,
}

impl Equations {
    /// The pushes of the places that take part, 0 for the others, by elimination; `None` where that leaves one open.
    fn solve(&self, part: &[bool; GUESSED]) -> Option<[f64; GUESSED]> {
        let mut rows = self.rows;
        let largest = (0..self.count).map(|i| rows[i][i].abs()).fold(0.0, f64::max);
        let parts = || (0..self.count).filter(|i| part[*i]);
        for pivot in parts() {
            if rows[pivot][pivot] < OPEN * largest {
                return None;
            }
            for row in parts().filter(|row| *row > pivot) {
                let factor = rows[row][pivot] / rows[pivot][pivot];
                for column in parts().filter(|column| *column > pivot).chain([GUESSED]) {
                    rows[row][column] -= factor * rows[pivot][column];
                }
            }
        }
        let mut pushes = [0.0; GUESSED];
        for i in parts().rev() {
            let known: f64 = parts().filter(|j| *j > i).map(|j| rows[i][j] * pushes[j]).sum();
            pushes[i] = (rows[i][GUESSED] - known) / rows[i][i];
        }
        Some(pushes)
    }
}
