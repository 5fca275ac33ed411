//! What a stage of a clip says of an effect by itself: a small linear regression of what was measured in that stage, with a standard
//! error, and no roll-out. What happened before the stage is not in it: neither the hit nor the object's friction, mass or gains.
//! Base frame, SI.
//!
//! | module | the stage, and what is regressed |
//! |---|---|
//! | [`rest`] | the object stands: how far it leans and how high it is |
//! | [`contact`] | the tool pushes the object: the gap that is seen between two that touch |
//! | `regression` | least squares over rows of clips, clips being the units |
//! | `reported` | in which ways reports may be off, and the effects of each |
//! | `corrected` | clips as they would have been recorded without effects that are given |

pub mod contact;
mod corrected;
mod regression;
mod reported;
pub mod rest;
#[cfg(test)]
mod test_witness;

use corrected::{Corrected, corrected};
use rayon::prelude::*;
use regression::{Regression, Sample};
use reported::Off;
use serde::Serialize;
use shared_mem::cell::{Cell, ClipKind};
use shared_mem::recording::Clip;
use shared_mem::theta::Theta;

/// Standard errors from zero beyond which a witness counts (a choice): of some nine witnesses a session fewer than one in a thousand
/// lies so far out by chance.
pub const SIGNIFICANT: f64 = 4.0;
/// A clip's rows may be off by this share of the tracker's noise, all alike: edges of markers, faces that are not quite even
/// (a choice).
const SHARED_SHARE_OF_NOISE: f64 = 0.15;

/// A number of an effect, as one stage shows it.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Witness {
    /// Name of the effect in the registry.
    pub effect: &'static str,
    /// Which of its numbers, in words: `rotation about x`.
    pub number: &'static str,
    /// The stage that it was measured in.
    pub stage: &'static str,
    /// [`Self::unit`].
    pub value: f64,
    /// One standard error, clips being the units.
    pub error: f64,
    /// `value / error`.
    pub t: f64,
    /// SI; `1` without.
    pub unit: &'static str,
    /// How many clips it comes from.
    pub clips: usize,
    /// Effects that would show in this stage in the same way.
    pub confusable_with: Vec<&'static str>,
    /// What to draw it over.
    pub against: Axis,
    /// What was measured.
    pub measured: Axis,
    /// A place on both axes for each clip: what is measured less what the other numbers of the regression explain, so that the points
    /// lie on a line through the origin with [`Self::value`] as its slope, or on a level one where [`Self::against`] is the clip.
    pub points: Vec<[f64; 2]>,
}

/// An axis of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Axis {
    pub name: &'static str,
    /// SI; `1` without.
    pub unit: &'static str,
}

/// Clips one after the other.
pub const CLIPS: Axis = Axis { name: "clip", unit: "1" };

impl Witness {
    /// Whether it is more than chance.
    pub fn is_significant(&self) -> bool {
        self.t.abs() > SIGNIFICANT
    }

    /// Whether its points lie on a level line instead of one through the origin.
    pub fn is_level(&self) -> bool {
        self.against == CLIPS
    }
}

/// A number of a regression that is shown.
struct Shown {
    /// What it is a number of.
    off: Off,
    number: &'static str,
    unit: &'static str,
    /// What would show in the same way.
    alike: &'static [Off],
    against: Axis,
    measured: Axis,
    /// Whether both axes are turned round, so that what grows with the effect points up.
    turned: bool,
}

impl Shown {
    /// The witness of number `k` of a regression over samples.
    fn of(self, stage: &'static str, k: usize, samples: &[Sample], found: &Regression) -> Option<Witness> {
        let (value, error) = (found.values[k], found.errors[k]);
        let sign = if self.turned { -1.0 } else { 1.0 };
        let means = found.by_clip(samples, k);
        let level = self.against == CLIPS;
        let point = |(place, [x, rest]): (usize, [f64; 2])| {
            let explained = value * x + rest;
            if level { [place as f64 + 1.0, explained] } else { [sign * x, sign * explained] }
        };
        // Of a regressor that is turned round the slope stays.
        let points: Vec<[f64; 2]> = means.into_iter().enumerate().map(point).collect();
        let Self { off, number, unit, alike, against, measured, .. } = self;
        let mut effects = off.effects().chain(alike.iter().flat_map(|other| other.effects()));
        let (effect, confusable_with) = (effects.next()?, effects.collect());
        let (clips, t) = (points.len(), value / error);
        Some(Witness {
            effect,
            number,
            stage,
            value,
            error,
            t,
            unit,
            clips,
            confusable_with,
            against,
            measured,
            points,
        })
    }
}

/// All witnesses of recorded strokes; none of clips without an arm that hits an object.
pub fn witnesses(cell: &Cell, clips: &[Clip]) -> Vec<Witness> {
    beyond(cell, clips, &Theta::default())
}

/// What witnesses say beyond the effects of `known`: clips are corrected for what a camera, a tool or encoders are known to be off by, so a
/// witness that agrees with them is zero within its error.
pub fn beyond(cell: &Cell, clips: &[Clip], known: &Theta) -> Vec<Witness> {
    let strokes = clips.par_iter().filter(|clip| clip.kind == ClipKind::ControlHitSlide);
    let Some(strokes) = strokes.map(|clip| corrected(cell, clip, known)).collect::<Option<Vec<Corrected>>>() else {
        return Vec::new();
    };
    [rest::witnesses(cell, &strokes), contact::witnesses(cell, &strokes)].concat()
}
