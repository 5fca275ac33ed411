//! One patch: all places where two pieces touch, and the impulses there. A block of the solver ([`super::World::step`]).
//!
//! Law: a place presses as much as it must to part as fast as asked, and never pulls; of places that leave the shares open the
//! load is affine over the patch (what [`crate::sliding`] has under a base). Friction at each place stands against the slip
//! there, up to the coefficient times the place's load, so that a patch resists turns about its normal; a pad adds to that
//! 2/3 of its radius times its load. A patch that can hold fast as a whole does so exactly, by one inverse of its mobility.
//!
//! Six numbers describe how the second body moves against the first at the patch's origin, in axes `t1`, `t2`, `n`:
//! slip (2), turn about the normal, parting, tilts about `t1` and `t2`. World frame, impulses in N s.

use super::touch::{MOST_PLACES, Touching, tangents};
use nalgebra::{Matrix2, Matrix3, Matrix6, Point3, SMatrix, SVector, Vector2, Vector3, Vector6};

/// Freedoms of the two trees of a patch together.
pub(super) const MOST_COLUMNS: usize = 28;
/// A sunken place leaves by this share of its depth in a step, and no faster than [`PUSH_OUT`] [m/s].
const RECOVERY: f64 = 0.1;
const PUSH_OUT: f64 = 0.1;
/// Places nearer than this touch as they are [m]: what would bring them nearer or farther fights against friction.
const TOUCHING: f64 = 2e-6;
/// Give of a place, as a share of the patch's mobility: what shares the load where rigid bodies leave it open.
const GIVE: f64 = 1e-9;
/// The same of a patch that holds fast: bodies with few freedoms cannot answer to everything.
const STIFF: f64 = 1e-9;
/// Places that lay nearer than this to each other a step ago are one [m].
const SAME_PLACE: f64 = 3e-3;
/// Places all nearer to their middle than this are one, which friction does not keep from turning [m].
const LINE: f64 = 1e-5;
/// Changes of the set of places that press, at most [1].
const ACTIVE_SET_CHANGES: usize = 12;
/// Sweeps over the friction of places that slip [1].
const FRICTION_SWEEPS: usize = 2;

/// How one freedom moves the patch, and what an impulse at the patch gives to it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Column {
    /// Index into the world's velocities.
    pub(super) freedom: usize,
    pub(super) motion: Vector6<f64>,
    pub(super) answer: Vector6<f64>,
}

/// What two pieces know of each other from the step before.
#[derive(Debug, Clone, Copy)]
pub(super) struct Memory {
    places: [(Point3<f64>, f64, Vector3<f64>); MOST_PLACES],
    count: usize,
    spin: f64,
}

#[derive(Debug, Clone, Copy)]
struct PatchPoint {
    x: f64,
    y: f64,
    /// Least speed of parting [m/s].
    parting: f64,
    /// Impulse for a slip of one.
    slip_mass: f64,
    /// Impulses along the normal and across it [N s].
    load: f64,
    tangential: Vector2<f64>,
}

/// The patch within one step.
#[derive(Debug, Clone, Copy)]
pub(super) struct Patch {
    pub(super) origin: Point3<f64>,
    /// `t1`, `t2`, `n` as rows.
    pub(super) axes: Matrix3<f64>,
    friction: f64,
    /// Lever of a pad's friction against turns [m].
    lever: f64,
    spots: [PatchPoint; MOST_PLACES],
    count: usize,
    spin: f64,
    columns: [Column; MOST_COLUMNS],
    used: usize,
    /// Motion that no freedom makes.
    moved: Vector6<f64>,
    mobility: Matrix6<f64>,
    /// Of the whole patch when it holds fast, with what it takes to share the load; `None` for places on one line.
    fast: Option<Fast>,
    /// Inverse of the mobility of slips and of the turn about the normal.
    still: Option<Matrix3<f64>>,
    presses: SMatrix<f64, MOST_PLACES, MOST_PLACES>,
}

#[derive(Debug, Clone, Copy)]
struct Fast {
    inverse: Matrix6<f64>,
    goal: Vector6<f64>,
    shares: Matrix3<f64>,
    give: f64,
}

impl Memory {
    pub(super) const NONE: Self = Self {
        places: [(Point3::new(0.0, 0.0, 0.0), 0.0, Vector3::new(0.0, 0.0, 0.0)); MOST_PLACES],
        count: 0,
        spin: 0.0,
    };

    /// Impulse that pressed the two together [N s].
    pub(super) fn load(&self) -> f64 {
        self.places[..self.count].iter().map(|(_, load, _)| load).sum()
    }
}

impl Patch {
    /// With the impulses of the step before where places are still there.
    pub(super) fn new(touching: &Touching, friction: f64, pad_radius: f64, memory: &Memory, dt: f64) -> Self {
        let normal = touching.normal;
        let [first, second] = tangents(&normal);
        let axes = Matrix3::from_rows(&[first.transpose(), second.transpose(), normal.transpose()]);
        let places = touching.places();
        let origin = Point3::from(places.iter().map(|p| p.at.coords).sum::<Vector3<f64>>() / places.len() as f64);
        let none = PatchPoint { x: 0.0, y: 0.0, parting: 0.0, slip_mass: 0.0, load: 0.0, tangential: Vector2::zeros() };
        let mut spots = [none; MOST_PLACES];
        for (spot, place) in spots.iter_mut().zip(places) {
            let from = axes * (place.at - origin);
            let parting = match place.gap {
                gap if gap > TOUCHING => -gap / dt,
                gap if gap < -TOUCHING => (-gap * RECOVERY / dt).min(PUSH_OUT),
                _ => 0.0,
            };
            let known = memory.places[..memory.count].iter();
            let distance = |known: &&(Point3<f64>, f64, Vector3<f64>)| (known.0 - place.at).norm_squared();
            let before = known
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                .filter(|known| distance(known) < SAME_PLACE * SAME_PLACE)
                .map_or((0.0, Vector2::zeros()), |(_, load, tangential)| (*load, (axes * tangential).xy()));
            *spot = PatchPoint { x: from.x, y: from.y, parting, load: before.0, tangential: before.1, ..none };
        }
        let zero = Column { freedom: 0, motion: Vector6::zeros(), answer: Vector6::zeros() };
        Self {
            origin,
            axes,
            friction,
            lever: pad_radius * 2.0 / 3.0,
            spots,
            count: places.len(),
            spin: memory.spin,
            columns: [zero; MOST_COLUMNS],
            used: 0,
            moved: Vector6::zeros(),
            mobility: Matrix6::zeros(),
            fast: None,
            still: None,
            presses: SMatrix::zeros(),
        }
    }

    pub(super) fn add_moved(&mut self, motion: Vector6<f64>) {
        self.moved += motion;
    }

    pub(super) fn columns_mut(&mut self) -> &mut [Column] {
        &mut self.columns[..self.used]
    }

    /// Adds a freedom; nothing happens where there is no room, which [`super::tree`] has seen to.
    pub(super) fn push(&mut self, freedom: usize) {
        if let Some(column) = self.columns.get_mut(self.used) {
            *column = Column { freedom, motion: Vector6::zeros(), answer: Vector6::zeros() };
            self.used += 1;
        }
    }

    /// Once all columns are there: what the blocks need, and the impulses of before given to the bodies.
    pub(super) fn begin(&mut self, velocities: &mut [f64]) {
        self.mobility = Matrix6::zeros();
        for column in &self.columns[..self.used] {
            self.mobility += column.answer * column.motion.transpose();
        }
        let planar = self.mobility.fixed_view::<3, 3>(0, 0).into_owned();
        let normal = self.mobility.fixed_view::<3, 3>(3, 3).into_owned();
        for i in 0..self.count {
            let PatchPoint { x, y, .. } = self.spots[i];
            let rows = SMatrix::<f64, 2, 3>::new(1.0, 0.0, -y, 0.0, 1.0, x);
            let slips: Matrix2<f64> = rows * planar * rows.transpose();
            let half = 0.5 * slips.trace();
            let most = half + (half * half - slips.determinant()).max(0.0).sqrt();
            self.spots[i].slip_mass = if most > 0.0 { 1.0 / most } else { 0.0 };
            for j in 0..self.count {
                self.presses[(i, j)] = row(&self.spots[i]).dot(&(normal * row(&self.spots[j])));
            }
        }
        self.fast = self.fast_block();
        self.still = stiffened(planar).try_inverse();
        let impulse = self.impulse();
        self.push_bodies(&impulse, velocities);
    }

    fn fast_block(&self) -> Option<Fast> {
        let spots = &self.spots[..self.count];
        let (mut squares, mut product) = (Matrix3::zeros(), Vector3::zeros());
        for spot in spots {
            squares += row(spot) * row(spot).transpose();
            product += row(spot) * spot.parting;
        }
        let size = squares[(1, 1)] + squares[(2, 2)];
        if squares.determinant() < 1e-6 * squares[(0, 0)] * size * size {
            return None;
        }
        let shares = squares.try_inverse()?;
        let tilt = shares * product;
        // A patch whose places ask for what no rigid body can do holds nothing fast.
        if spots.iter().any(|spot| (row(spot).dot(&tilt) - spot.parting).abs() > 1e-3) {
            return None;
        }
        let mut yielding = self.mobility;
        let mut normal = yielding.fixed_view_mut::<3, 3>(3, 3);
        normal += shares * self.give();
        let inverse = stiffened(yielding).try_inverse()?;
        Some(Fast { inverse, goal: Vector6::new(0.0, 0.0, 0.0, tilt.x, tilt.y, tilt.z), shares, give: self.give() })
    }

    pub(super) fn impulse(&self) -> Vector6<f64> {
        let mut sum = Vector6::zeros();
        sum[2] = self.spin;
        for PatchPoint { x, y, load, tangential, .. } in &self.spots[..self.count] {
            sum += Vector6::new(
                tangential.x,
                tangential.y,
                x * tangential.y - y * tangential.x,
                *load,
                y * load,
                -x * load,
            );
        }
        sum
    }

    /// Velocity with which a place yields to a load of one.
    fn give(&self) -> f64 {
        GIVE * (0..self.count).map(|i| self.presses[(i, i)]).sum::<f64>() / self.count as f64
    }

    fn push_bodies(&self, change: &Vector6<f64>, velocities: &mut [f64]) {
        for column in &self.columns[..self.used] {
            velocities[column.freedom] += column.answer.dot(change);
        }
    }

    /// Finds the impulses that go with what everything else does now; the largest change of a velocity [m/s].
    pub(super) fn relax(&mut self, velocities: &mut [f64]) -> f64 {
        let mut motion = self.moved;
        for column in &self.columns[..self.used] {
            motion += column.motion * velocities[column.freedom];
        }
        let before = self.impulse();
        if !self.hold_fast(&before, &motion) {
            self.press(&mut motion);
            if !self.hold_still(&mut motion) {
                self.project_friction(&mut motion);
            }
        }
        let change = self.impulse() - before;
        self.push_bodies(&change, velocities);
        let moved = self.mobility * change;
        moved.fixed_rows::<2>(0).amax().max(moved[3].abs())
    }

    /// Takes the impulses with which nothing slips, tilts or turns, if there are any.
    fn hold_fast(&mut self, before: &Vector6<f64>, motion: &Vector6<f64>) -> bool {
        let Some(fast) = &self.fast else { return false };
        let mut lacking = fast.goal - motion;
        let sag = fast.shares * before.fixed_rows::<3>(3) * fast.give;
        lacking.fixed_rows_mut::<3>(3).axpy(-1.0, &sag, 1.0);
        let wanted = before + fast.inverse * lacking;
        let affine = fast.shares * wanted.fixed_rows::<3>(3);
        let mut loads = [0.0; MOST_PLACES];
        for (spot, load) in self.spots[..self.count].iter().zip(&mut loads) {
            *load = row(spot).dot(&affine);
            if *load < 0.0 {
                return false;
            }
        }
        self.share(&wanted.fixed_rows::<3>(0).into_owned(), &loads)
    }

    /// Takes the friction with which nothing slips or turns about the normal under the loads there are, if there is any.
    fn hold_still(&mut self, motion: &mut Vector6<f64>) -> bool {
        let Some(inverse) = self.still else { return false };
        let before = self.impulse().fixed_rows::<3>(0).into_owned();
        let wanted = before - inverse * motion.fixed_rows::<3>(0);
        let loads: [f64; MOST_PLACES] = std::array::from_fn(|i| if i < self.count { self.spots[i].load } else { 0.0 });
        let holds = self.share(&wanted, &loads);
        if holds {
            let change = wanted - before;
            *motion += self.mobility.fixed_columns::<3>(0) * change;
        }
        holds
    }

    /// Shares friction out to places by their load, as places that yield a little before they slip do; nothing happens where
    /// one of them would have to bear more than its cone.
    fn share(&mut self, friction: &Vector3<f64>, loads: &[f64; MOST_PLACES]) -> bool {
        let spots = &self.spots[..self.count];
        let total: f64 = loads[..self.count].iter().sum();
        if total <= 0.0 {
            return false;
        }
        let weighted = spots.iter().zip(loads).map(|(spot, load)| Vector2::new(spot.x, spot.y) * *load);
        let middle = weighted.sum::<Vector2<f64>>() / total;
        let from_middle = |spot: &PatchPoint| Vector2::new(spot.x, spot.y) - middle;
        let spread: f64 = spots.iter().zip(loads).map(|(spot, load)| load * from_middle(spot).norm_squared()).sum();
        let pad = total * self.lever * self.lever;
        if spread + pad <= total * LINE * LINE {
            return false;
        }
        let push = friction.xy();
        let (mean, turning) = (push / total, (friction.z - middle.perp(&push)) / (spread + pad));
        let shares: [Vector2<f64>; MOST_PLACES] = std::array::from_fn(|i| {
            let from = if i < self.count { from_middle(&self.spots[i]) } else { Vector2::zeros() };
            mean + turning * Vector2::new(-from.y, from.x)
        });
        let cone = self.friction * self.friction;
        if shares[..self.count].iter().any(|share| share.norm_squared() > cone)
            || turning.abs() * self.lever > self.friction
        {
            return false;
        }
        for (i, spot) in self.spots[..self.count].iter_mut().enumerate() {
            (spot.load, spot.tangential) = (loads[i], shares[i] * loads[i]);
        }
        self.spin = turning * pad;
        true
    }

    /// Loads with which no place parts slower than it must and none pulls, friction as it is.
    fn press(&mut self, motion: &mut Vector6<f64>) {
        let n = self.count;
        let before: SVector<f64, MOST_PLACES> = SVector::from_fn(|i, _| if i < n { self.spots[i].load } else { 0.0 });
        let answered = self.presses * before;
        let tilt = motion.fixed_rows::<3>(3).into_owned();
        let lacking = |i: usize| self.spots[i].parting - row(&self.spots[i]).dot(&tilt) + answered[i];
        let lacking: [f64; MOST_PLACES] = std::array::from_fn(|i| if i < n { lacking(i) } else { 0.0 });
        let give = self.give();
        let mut pressing: [bool; MOST_PLACES] = std::array::from_fn(|i| i < n && lacking[i] > 0.0);
        let mut loads = SVector::<f64, MOST_PLACES>::zeros();
        for _ in 0..ACTIVE_SET_CHANGES {
            loads = self.loads(&pressing, &lacking, give);
            let pulling = (0..n).filter(|i| loads[*i] < 0.0).min_by(|a, b| loads[*a].total_cmp(&loads[*b]));
            if let Some(i) = pulling {
                pressing[i] = false;
                continue;
            }
            let short = |i: usize| lacking[i] - self.presses.row(i).tr_dot(&loads);
            let sinking = (0..n).filter(|i| !pressing[*i]).max_by(|a, b| short(*a).total_cmp(&short(*b)));
            match sinking.filter(|i| short(*i) > 1e-9) {
                Some(i) => pressing[i] = true,
                None => break,
            }
        }
        let mut change = Vector6::zeros();
        for i in 0..n {
            let load = loads[i].max(0.0);
            change.fixed_rows_mut::<3>(3).axpy(load - self.spots[i].load, &row(&self.spots[i]), 1.0);
            self.spots[i].load = load;
        }
        *motion += self.mobility * change;
    }

    /// The loads of the places that press (Cholesky).
    fn loads(
        &self,
        pressing: &[bool; MOST_PLACES],
        lacking: &[f64; MOST_PLACES],
        give: f64,
    ) -> SVector<f64, MOST_PLACES> {
        let mut chosen = [0; MOST_PLACES];
        let mut n = 0;
        for i in (0..self.count).filter(|i| pressing[*i]) {
            chosen[n] = i;
            n += 1;
        }
        let mut lower = [[0.0; MOST_PLACES]; MOST_PLACES];
        let mut part = [0.0; MOST_PLACES];
        for i in 0..n {
            for j in 0..=i {
                let known: f64 = (0..j).map(|k| lower[i][k] * lower[j][k]).sum();
                let entry = self.presses[(chosen[i], chosen[j])] - known;
                lower[i][j] = if i == j { (entry + give).max(0.1 * give).sqrt() } else { entry / lower[j][j] };
            }
            let known: f64 = (0..i).map(|k| lower[i][k] * part[k]).sum();
            part[i] = (lacking[chosen[i]] - known) / lower[i][i];
        }
        let mut loads = SVector::zeros();
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|k| lower[k][i] * part[k]).sum();
            part[i] = (part[i] - known) / lower[i][i];
            loads[chosen[i]] = part[i];
        }
        loads
    }

    /// Friction of each place against its slip, up to its cone.
    fn project_friction(&mut self, motion: &mut Vector6<f64>) {
        for _ in 0..FRICTION_SWEEPS {
            for i in 0..self.count {
                let PatchPoint { x, y, slip_mass, load, tangential, .. } = self.spots[i];
                let slip = Vector2::new(motion[0] - motion[2] * y, motion[1] + motion[2] * x);
                let (wanted, limit) = (tangential - slip * slip_mass, self.friction * load);
                let size = wanted.norm();
                let now = if size > limit { wanted * (limit / size) } else { wanted };
                self.spots[i].tangential = now;
                let change = now - tangential;
                let turning = x * change.y - y * change.x;
                *motion += self.mobility * Vector6::new(change.x, change.y, turning, 0.0, 0.0, 0.0);
            }
            let turn_mobility = self.mobility[(2, 2)];
            if self.lever > 0.0 && turn_mobility > 0.0 {
                let limit = self.friction * self.lever * self.spots[..self.count].iter().map(|s| s.load).sum::<f64>();
                let now = (self.spin - motion[2] / turn_mobility).clamp(-limit, limit);
                *motion += self.mobility.column(2) * (now - self.spin);
                self.spin = now;
            }
        }
    }

    /// For the next step.
    pub(super) fn remember(&self) -> Memory {
        let mut memory = Memory { count: self.count, spin: self.spin, ..Memory::NONE };
        for (kept, spot) in memory.places.iter_mut().zip(&self.spots[..self.count]) {
            let back = |v: Vector3<f64>| self.axes.tr_mul(&v);
            let at = self.origin + back(Vector3::new(spot.x, spot.y, 0.0));
            *kept = (at, spot.load, back(Vector3::new(spot.tangential.x, spot.tangential.y, 0.0)));
        }
        memory
    }
}

/// A velocity at a patch's origin and an angular velocity as its six numbers; `axes` as in [`Patch::axes`].
pub(super) fn motion_in(axes: &Matrix3<f64>, velocity: &Vector3<f64>, spin: &Vector3<f64>) -> Vector6<f64> {
    let (v, w) = (axes * velocity, axes * spin);
    Vector6::new(v.x, v.y, w.z, v.z, w.x, w.y)
}

/// A mobility that can be inverted although the bodies have few freedoms.
fn stiffened<const N: usize>(mut mobility: SMatrix<f64, N, N>) -> SMatrix<f64, N, N> {
    let least = STIFF * mobility.trace();
    (0..N).for_each(|i| mobility[(i, i)] += STIFF * mobility[(i, i)] + 1e-3 * least);
    mobility
}

/// How parting and the two tilts part a place.
fn row(spot: &PatchPoint) -> Vector3<f64> {
    Vector3::new(1.0, spot.y, -spot.x)
}
