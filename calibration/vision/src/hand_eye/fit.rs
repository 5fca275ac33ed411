//! From pictures to mount and board: start, robust refinement, pictures that do not fit left out one by one, intervals, and what
//! the pictures leave open.

use super::chain::Chain;
use super::closed_form;
use super::refine::{Prepared, Refined, refined};
use super::variance::ArmSigma;
use super::view::View;
use inference::statistics;
use nalgebra::{Isometry3, Matrix6, SMatrix, Vector3};
use shared_mem::hand_eye::Mount;
use shared_mem::statistics::median;

/// Mount and board from a set of pictures.
#[derive(Debug, Clone)]
pub struct Fit {
    pub chain: Chain,
    /// Covariance of the mount: turn about the camera's origin [rad], then shift [m], axes of the frame it is mounted in.
    pub covariance: Matrix6<f64>,
    /// Half the 90 % interval of each of the six numbers [rad, m].
    pub half_width: [f64; 6],
    /// The arm's error.
    pub arm: ArmSigma,
    /// One sigma of a corner along a row [pixel].
    pub pixel: f64,
    /// What became of each picture, in their order.
    pub views: Vec<Judged>,
    /// Directions that the pictures leave open; empty where the mount is identified.
    pub open: Vec<Open>,
    /// How far the pictures' turns are spread about their three main axes [rad], the most first.
    pub spread: [f64; 3],
}

/// A direction of the mount that the pictures leave open.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Open {
    /// Its turn and its shift, of length one with a radian as long as half a metre.
    pub direction: [f64; 6],
    /// Half the 90 % interval along it [rad, m].
    pub half_width: [f64; 2],
}

/// What became of a picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Judged {
    /// Whether it took part.
    pub used: bool,
    /// Root mean square of what is left with the arm's pose as it was said [pixel].
    pub rms: f64,
    /// The same with mount and board of the other pictures [pixel].
    pub held_out_rms: f64,
    /// The same with the board placed by this picture alone [pixel]: the corners' noise.
    pub own_rms: f64,
    /// The arm's pose against what mount and board say [rad, m].
    pub off: [f64; 2],
    /// The chance of so much in a picture that fits.
    pub chance: f64,
}

/// Fewer pictures leave no degree of freedom over.
pub const FEWEST: usize = 3;
/// A picture this improbable among so many does not fit [chance of one false alarm in all pictures].
const IMPROBABLE: f64 = 0.01;
/// A mount less certain than this is not identified: a ruler and a protractor do as well [m, rad].
const LIMIT: [f64; 2] = [0.01, 0.035];
/// Turns between pictures spread less than this are about no axis [rad].
pub(super) const TURNED: f64 = 0.09;
/// A turn by this counts as much as a shift by one [rad/m].
const LEVER: f64 = 0.5;
/// Level of the intervals.
const LEVEL: f64 = 0.9;

/// Why there is no answer.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum NoFit {
    /// Too few pictures show the board.
    #[error("{0} pictures show the board; {FEWEST} at least are needed, ten to twenty from different sides are good")]
    Few(usize),
    /// All pictures are from one orientation.
    #[error(
        "no two pictures differ in how the end effector is turned; turn it by 20 degrees and more about two axes between them"
    )]
    Alike,
    /// No mount explains most of the pictures, and they are all turned about one axis.
    #[error(
        "the end effector turns about one axis only; turn it by 20 degrees and more about a second one between the pictures"
    )]
    OneAxis,
    /// No mount explains most of the pictures.
    #[error(
        "no mount explains most of the pictures: check that each O_T_EE belongs to its picture, the board's size, and who holds the camera"
    )]
    Inconsistent,
}

/// Finds the mount.
///
/// # Errors
/// [`NoFit`] in one line: what is missing.
pub fn fit(mount: Mount, views: &[View]) -> Result<Fit, NoFit> {
    let alone: Vec<Option<(Isometry3<f64>, f64)>> = views.iter().map(View::board).collect();
    let usable = alone.iter().flatten().count();
    if usable < FEWEST {
        return Err(NoFit::Few(usable));
    }
    let rough = median(alone.iter().flatten().map(|(_, sigma)| *sigma)).map_or(1e-6, |sigma| sigma.max(1e-6));
    let pairs = views.iter().zip(&alone).filter_map(|(view, alone)| alone.map(|(board, _)| (view, board)));
    let mut prepared: Vec<Prepared<'_>> = pairs.map(|(view, board)| Prepared::new(view, mount, board)).collect();
    for picture in &mut prepared {
        picture.weights = picture.view.weights(&picture.board, rough);
    }
    let pixel = pixel_sigma(&prepared).max(1e-6);
    let pictures: Vec<closed_form::Pair> = prepared.iter().map(|p| (p.link, p.board)).collect();
    let (start, fits) = closed_form::start(mount, &pictures).ok_or(NoFit::Alike)?;
    let links: Vec<Isometry3<f64>> = prepared.iter().map(|picture| picture.link).collect();
    let none = if spread(&links)[1] < TURNED { NoFit::OneAxis } else { NoFit::Inconsistent };
    if 2 * fits.iter().filter(|fits| **fits).count() <= fits.len() {
        return Err(none);
    }
    let (found, used) = chosen(&prepared, start, fits, pixel).ok_or(none)?;
    Ok(answer(&prepared, &alone, &found, &used, pixel))
}

/// One sigma of the corners, by what each picture leaves by itself: six numbers are fitted in each.
fn pixel_sigma(prepared: &[Prepared<'_>]) -> f64 {
    let (mut squares, mut free) = (0.0, 0.0);
    for picture in prepared {
        let residuals = picture.view.residuals(&picture.board);
        squares += residuals.iter().zip(&picture.weights).map(|(r, w)| w * w * r * r).sum::<f64>();
        free += 2.0 * picture.weights.iter().sum::<f64>() - 6.0;
    }
    (squares / free.max(1.0)).sqrt()
}

/// Degrees of freedom of a variance of the arm, of which there are two.
const fn free(pictures: usize) -> usize {
    (3 * pictures).saturating_sub(6)
}

/// The pictures that fit: the worst one leaves until all do, and those that were left come back if they fit after all.
fn chosen(prepared: &[Prepared<'_>], start: Chain, mut used: Vec<bool>, pixel: f64) -> Option<(Refined, Vec<bool>)> {
    let mut chain = start;
    for _ in 0..2 * prepared.len() {
        let within: Vec<&Prepared<'_>> =
            prepared.iter().zip(&used).filter(|(_, used)| **used).map(|(p, _)| p).collect();
        let found = refined(&within, &chain, pixel)?;
        chain = found.chain;
        let chances = chances(prepared, &found, &used, pixel);
        let bar = IMPROBABLE / prepared.len() as f64;
        let worst = (0..used.len()).filter(|k| used[*k]).min_by(|a, b| chances[*a].total_cmp(&chances[*b]))?;
        let best = (0..used.len()).filter(|k| !used[*k]).max_by(|a, b| chances[*a].total_cmp(&chances[*b]));
        if chances[worst] < bar && 2 * (within.len() - 1) > prepared.len() && within.len() > FEWEST + 1 {
            used[worst] = false;
        } else if let Some(best) = best.filter(|best| chances[*best] > 2.0 * bar) {
            used[best] = true;
        } else {
            return Some((found, used));
        }
    }
    None
}

/// For each picture, how probable so much is in one that fits.
fn chances(prepared: &[Prepared<'_>], found: &Refined, used: &[bool], pixel: f64) -> Vec<f64> {
    let count = used.iter().filter(|used| **used).count();
    let mut of_used = found.observations.iter();
    let chance = |(picture, used): (&Prepared<'_>, &bool)| {
        let distance = if *used {
            found.distance(of_used.next()?, true)?
        } else {
            found.distance(&found.observation(picture, pixel)?, false)?
        };
        Some(statistics::beyond_f(distance / 6.0, 6, free(count - usize::from(*used))))
    };
    prepared.iter().zip(used).map(chance).map(|chance| chance.unwrap_or(0.0)).collect()
}

fn answer(
    prepared: &[Prepared<'_>],
    alone: &[Option<(Isometry3<f64>, f64)>],
    found: &Refined,
    used: &[bool],
    pixel: f64,
) -> Fit {
    let count = used.iter().filter(|used| **used).count();
    let t = statistics::student(LEVEL, free(count));
    let covariance = found.information.try_inverse().unwrap_or_else(|| SMatrix::identity() * f64::INFINITY);
    let covariance: Matrix6<f64> = covariance.fixed_view::<6, 6>(0, 0).into_owned();
    let chances = chances(prepared, found, used, pixel);
    let mut of_used = found.observations.iter();
    let mut judged = prepared.iter().zip(used).zip(chances).map(|((picture, used), chance)| {
        let without = if *used { of_used.next().and_then(|seen| found.without(seen)) } else { Some(found.chain) };
        let rms = |board: &Isometry3<f64>| picture.view.rms(board, &picture.weights);
        let said = found.chain.camera_from_board(&picture.link);
        let error = found.chain.error_of(&picture.link, &picture.board);
        Judged {
            used: *used,
            rms: rms(&said),
            held_out_rms: without.map_or(f64::INFINITY, |chain| rms(&chain.camera_from_board(&picture.link))),
            own_rms: rms(&picture.board),
            off: [error.fixed_rows::<3>(0).norm(), error.fixed_rows::<3>(3).norm()],
            chance,
        }
    });
    let nothing = Judged {
        used: false,
        rms: f64::INFINITY,
        held_out_rms: f64::INFINITY,
        own_rms: f64::INFINITY,
        off: [f64::INFINITY; 2],
        chance: 0.0,
    };
    let views = alone.iter().map(|alone| alone.and_then(|_| judged.next()).unwrap_or(nothing)).collect();
    let links: Vec<Isometry3<f64>> = prepared.iter().zip(used).filter(|(_, u)| **u).map(|(p, _)| p.link).collect();
    Fit {
        chain: found.chain,
        covariance,
        half_width: std::array::from_fn(|k| t * covariance[(k, k)].max(0.0).sqrt()),
        arm: found.sigma,
        pixel,
        views,
        open: open(&covariance, t),
        spread: spread(&links),
    }
}

/// Directions of the mount in which the information leaves more open than the limit.
fn open(covariance: &Matrix6<f64>, t: f64) -> Vec<Open> {
    let scale = Matrix6::from_diagonal(&[LEVER, LEVER, LEVER, 1.0, 1.0, 1.0].into());
    let eigen = (scale * covariance * scale).symmetric_eigen();
    let mut found: Vec<Open> = (0..6)
        .filter_map(|k| {
            let sigma = t * eigen.eigenvalues[k].max(0.0).sqrt();
            let along = eigen.eigenvectors.column(k);
            let half_width = [along.fixed_rows::<3>(0).norm() * sigma / LEVER, along.fixed_rows::<3>(3).norm() * sigma];
            let is_open = half_width[0] > LIMIT[1] || half_width[1] > LIMIT[0];
            is_open.then(|| Open { direction: std::array::from_fn(|i| along[i]), half_width })
        })
        .collect();
    found.sort_by(|a, b| (b.half_width[0] + b.half_width[1]).total_cmp(&(a.half_width[0] + a.half_width[1])));
    found
}

/// How far the turns between pictures are spread about their three main axes: root mean squares [rad].
fn spread(links: &[Isometry3<f64>]) -> [f64; 3] {
    let pairs = (0..links.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let turns: Vec<Vector3<f64>> =
        pairs.map(|(i, j)| (links[j].rotation * links[i].rotation.inverse()).scaled_axis()).collect();
    let outer = turns.iter().map(|turn| turn * turn.transpose()).sum::<nalgebra::Matrix3<f64>>();
    let mut eigen: Vec<f64> =
        (outer / turns.len().max(1) as f64).symmetric_eigenvalues().iter().map(|v| v.max(0.0).sqrt()).collect();
    eigen.sort_by(|a, b| b.total_cmp(a));
    [eigen[0], eigen[1], eigen[2]]
}
