//! Mount and board from the pixels of all pictures at once: Gauss-Newton steps in which every picture has, besides the twelve numbers
//! of all, six of its own, the arm's error there. They are normal with the variances of [`super::variance`] and are eliminated
//! picture by picture, so that a picture counts for what the arm is worth and not for its number of corners.

use super::chain::{Chain, Twelve, link};
use super::variance::{ArmSigma, Information, Observation, normal_equations};
use super::view::View;
use nalgebra::{Isometry3, Vector6};
use twin::pose_fit::Equations;

/// A picture with what does not change from step to step.
#[derive(Debug, Clone)]
pub struct Prepared<'a> {
    pub view: &'a View,
    /// What the arm says: `M`.
    pub link: Isometry3<f64>,
    /// The board in the camera's frame, by this picture alone.
    pub board: Isometry3<f64>,
    /// What its corners count.
    pub weights: Vec<f64>,
}

/// Mount and board, and how sure they are.
#[derive(Debug, Clone)]
pub struct Refined {
    pub chain: Chain,
    /// Information on the twelve numbers there.
    pub information: Information,
    /// The arm's error.
    pub sigma: ArmSigma,
    /// What each picture says at the answer.
    pub observations: Vec<Observation>,
}

const MAX_STEPS: usize = 40;
/// A step less than this is none, in sigmas.
const ARRIVED: f64 = 1e-4;
/// Where the search for the arm's error begins.
const START: ArmSigma = ArmSigma { rotation: 3e-3, position: 1e-3 };

impl Prepared<'_> {
    /// The picture about a chain and an error of the arm; `pixel` is one sigma of a corner.
    fn observation(&self, chain: &Chain, error: &Vector6<f64>, pixel: f64) -> Option<Observation> {
        let pose = chain.camera_from_board_with(&self.link, error);
        let Equations { gradient, information } = self.view.equations(&pose, &self.weights)?;
        let by_error = chain.error_slopes(&self.link);
        let information = by_error.transpose() * information * by_error / (pixel * pixel);
        let gradient = by_error.transpose() * gradient / (pixel * pixel);
        let noise = information.cholesky()?.inverse();
        let slopes = by_error.try_inverse()? * chain.slopes(&self.link);
        Some(Observation { value: error - noise * gradient, noise, slopes })
    }

    /// Prepared as a picture is.
    pub fn new<'a>(view: &'a View, chain_mount: shared_mem::hand_eye::Mount, board: Isometry3<f64>) -> Prepared<'a> {
        let weights = vec![1.0; view.seen.len()];
        Prepared { view, link: link(chain_mount, &view.base_from_end_effector), board, weights }
    }
}

/// The answer from a start; `pixel` is one sigma of a corner along a row and along a column.
pub fn refined(pictures: &[&Prepared<'_>], start: &Chain, pixel: f64) -> Option<Refined> {
    let mut chain = *start;
    let mut errors: Vec<Vector6<f64>> = pictures.iter().map(|p| chain.error_of(&p.link, &p.board)).collect();
    let mut sigma = START;
    for round in 0..MAX_STEPS {
        let observed = pictures.iter().zip(&errors).map(|(p, error)| p.observation(&chain, error, pixel));
        let observations = observed.collect::<Option<Vec<_>>>()?;
        sigma = sigma.most_likely(&observations);
        let (information, right) = normal_equations(&observations, &sigma)?;
        let step: Twelve = information.cholesky()?.solve(&right);
        let far = step.dot(&(information * step)).sqrt();
        if round > 2 && far < ARRIVED {
            return Some(Refined { chain, information, sigma, observations });
        }
        chain = chain.stepped(&step);
        errors = (observations.iter())
            .map(|seen| {
                let left = seen.value - seen.slopes * step;
                let share = sigma.with(&seen.noise).cholesky().map(|c| c.solve(&left)).unwrap_or_default();
                left - seen.noise * share
            })
            .collect();
    }
    None
}

impl Refined {
    /// Squared length of what a picture leaves, in sigmas: of one that took part with what it has pulled to its side taken out, of
    /// one that did not with the answer's own uncertainty. Six degrees of freedom.
    pub fn distance(&self, seen: &Observation, took_part: bool) -> Option<f64> {
        let all = self.sigma.with(&seen.noise);
        let weight = all.cholesky()?.inverse();
        let others = if took_part {
            self.information - seen.slopes.transpose() * weight * seen.slopes
        } else {
            self.information
        };
        let others = others.cholesky()?;
        let step =
            if took_part { -others.solve(&(seen.slopes.transpose() * weight * seen.value)) } else { Twelve::zeros() };
        let left = seen.value - seen.slopes * step;
        let spread = all + seen.slopes * others.solve(&seen.slopes.transpose());
        Some(left.dot(&spread.cholesky()?.solve(&left)))
    }

    /// What a picture says about the answer that it had no part in.
    pub fn observation(&self, picture: &Prepared<'_>, pixel: f64) -> Option<Observation> {
        picture.observation(&self.chain, &self.chain.error_of(&picture.link, &picture.board), pixel)
    }

    /// Mount and board without one of the pictures, to first order.
    pub fn without(&self, seen: &Observation) -> Option<Chain> {
        let weight = self.sigma.with(&seen.noise).cholesky()?.inverse();
        let others = self.information - seen.slopes.transpose() * weight * seen.slopes;
        let step = -others.cholesky()?.solve(&(seen.slopes.transpose() * weight * seen.value));
        Some(self.chain.stepped(&step))
    }
}
