//! Particle swarm (Kennedy & Eberhart 1995) with the constriction of Clerc & Kennedy 2002, global best, reflecting walls.

use super::search::Search;
use rand::{RngExt as _, SeedableRng as _};
use rand_pcg::Pcg64;

const PARTICLES: usize = 40;
/// Share of its velocity that a particle keeps, and how strongly it is drawn to its own and to the common best place
/// (Clerc & Kennedy's values for a sum of attractions of 4.1).
const INERTIA: f64 = 0.729_84;
const ATTRACTION: f64 = 1.496_18;
/// The swarm has arrived when it is no wider than this share of the bounds.
const MAX_FINAL_WIDTH: f64 = 1e-7;
/// Fastest a particle goes, in widths of the bounds per round.
const MAX_SPEED: f64 = 0.5;

#[derive(Debug, Clone)]
struct Particle {
    place: Vec<f64>,
    velocity: Vec<f64>,
    best: Vec<f64>,
    best_cost: f64,
}

/// A particle swarm.
#[derive(Debug, Clone)]
pub struct Swarm {
    particles: Vec<Particle>,
    best: Vec<f64>,
    best_cost: f64,
    random: Pcg64,
}

impl Swarm {
    /// One particle at `start`, the others anywhere; coordinates in units of the bounds.
    pub fn new(start: &[f64], seed: u64) -> Self {
        let mut random = Pcg64::seed_from_u64(seed);
        let particles = (0..PARTICLES)
            .map(|i| {
                let anywhere: Vec<f64> = start.iter().map(|_| random.random()).collect();
                let place = if i == 0 { start.to_vec() } else { anywhere };
                let velocity = start.iter().map(|_| 0.5 * (random.random::<f64>() - 0.5)).collect();
                Particle { best: place.clone(), place, velocity, best_cost: f64::INFINITY }
            })
            .collect();
        Self { particles, best: start.to_vec(), best_cost: f64::INFINITY, random }
    }
}

impl Search for Swarm {
    fn ask(&mut self) -> Vec<Vec<f64>> {
        self.particles.iter().map(|particle| particle.place.clone()).collect()
    }

    fn tell(&mut self, costs: &[f64]) {
        for (particle, cost) in self.particles.iter_mut().zip(costs) {
            if *cost < particle.best_cost {
                (particle.best_cost, particle.best) = (*cost, particle.place.clone());
            }
            if *cost < self.best_cost {
                (self.best_cost, self.best) = (*cost, particle.place.clone());
            }
        }
        for particle in &mut self.particles {
            for k in 0..particle.place.len() {
                let [own, common]: [f64; 2] = [self.random.random(), self.random.random()];
                let place = particle.place[k];
                let drawn = own * (particle.best[k] - place) + common * (self.best[k] - place);
                let velocity = (INERTIA * particle.velocity[k] + ATTRACTION * drawn).clamp(-MAX_SPEED, MAX_SPEED);
                (particle.place[k], particle.velocity[k]) = reflected(place + velocity, velocity);
            }
        }
    }

    fn arrived(&self) -> bool {
        let far =
            |particle: &Particle| particle.place.iter().zip(&self.best).any(|(a, b)| (a - b).abs() > MAX_FINAL_WIDTH);
        !self.particles.iter().any(far)
    }
}

/// A particle that would leave the bounds comes back from the wall, slower.
fn reflected(place: f64, velocity: f64) -> (f64, f64) {
    if place < 0.0 {
        ((-place).min(1.0), -0.5 * velocity)
    } else if place > 1.0 {
        ((2.0 - place).max(0.0), -0.5 * velocity)
    } else {
        (place, velocity)
    }
}
