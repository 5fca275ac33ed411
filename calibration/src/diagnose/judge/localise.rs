//! Where the gap lies: the share of every cell of stage, channel and regime in the squared residual beyond the noise.

use super::gap::Residuals;
use crate::answer::diagnosis::Place;
use inference::likelihood::{Evidence, Group};
use std::collections::BTreeMap;

/// Cells with less than this share are left out.
const MIN_SHARE: f64 = 0.005;

/// Cells, largest first. A residual's noise alone would square to 1.
pub fn localise(evidence: &Evidence<'_>, residuals: &Residuals) -> Vec<Place> {
    let mut cells: BTreeMap<(String, String, &'static str), f64> = BTreeMap::new();
    for (clip, residuals) in &residuals.clips {
        for (row, residual) in evidence.rows(*clip).iter().zip(residuals) {
            let channel = &evidence.channels()[row.channel];
            if channel.group == Group::Contact {
                continue;
            }
            let key = (row.stage.name().to_owned(), channel.place.clone(), row.regime);
            *cells.entry(key).or_default() += residual * residual - 1.0;
        }
    }
    let total: f64 = cells.values().filter(|excess| **excess > 0.0).sum();
    let place = |((stage, channel, regime), excess): ((String, String, &'static str), f64)| Place {
        stage,
        channel,
        regime: regime.to_owned(),
        share: excess.max(0.0) / total.max(f64::MIN_POSITIVE),
    };
    let mut places: Vec<Place> = cells.into_iter().map(place).filter(|place| place.share >= MIN_SHARE).collect();
    places.sort_by(|a, b| b.share.total_cmp(&a.share));
    places
}
