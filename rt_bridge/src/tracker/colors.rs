//! What the object looks like beside what surrounds it: two histograms of colour, learnt while the object is seen.

/// Steps of each of red, green and blue.
const STEPS_PER_CHANNEL: usize = 16;
/// One pixel's colour says no more than this, as a logarithm of odds: neighbours agree too often to be independent.
const MAX_LOG_ODDS: f32 = 2.0;
/// Share of a picture in a histogram that is no more than chance.
const CHANCE: f32 = 1e-3;
/// Share of the newest picture once colours are known.
const NEW: f32 = 0.15;

/// The colour of a pixel, in steps.
pub(super) type Bin = u16;
/// No colour was taken.
pub(super) const NO_COLOR: Bin = Bin::MAX;

/// The step a colour belongs to.
#[inline]
pub(super) fn bin([r, g, b]: [u8; 3]) -> Bin {
    u16::from(r >> 4) << 8 | u16::from(g >> 4) << 4 | u16::from(b >> 4)
}

/// Histograms of object and surroundings, and what they say of each colour.
#[derive(Debug, Clone)]
pub(super) struct Colors {
    object: Vec<f32>,
    around: Vec<f32>,
    odds: Vec<f32>,
    known: bool,
}

impl Colors {
    pub(super) fn new() -> Self {
        let bins = STEPS_PER_CHANNEL * STEPS_PER_CHANNEL * STEPS_PER_CHANNEL;
        Self { object: vec![0.0; bins], around: vec![0.0; bins], odds: vec![0.0; bins], known: false }
    }

    /// Whether anything was learnt.
    pub(super) fn are_known(&self) -> bool {
        self.known
    }

    /// Logarithm of the odds that a pixel of this colour is the object's.
    #[inline]
    pub(super) fn odds(&self, bin: Bin) -> f32 {
        self.odds.get(usize::from(bin)).copied().unwrap_or(0.0)
    }

    /// Learns from one picture: colours, and whether each is the object's.
    pub(super) fn learn(&mut self, pixels: impl Iterator<Item = (Bin, bool)>) {
        let mut counts = [vec![0.0_f32; self.odds.len()], vec![0.0_f32; self.odds.len()]];
        let mut sums = [0.0_f32; 2];
        for (bin, is_object) in pixels.filter(|(bin, _)| *bin != NO_COLOR) {
            counts[usize::from(is_object)][usize::from(bin)] += 1.0;
            sums[usize::from(is_object)] += 1.0;
        }
        if sums[0] < 20.0 || sums[1] < 20.0 {
            return;
        }
        let share = if self.known { NEW } else { 1.0 };
        self.known = true;
        let [around, object] = &counts;
        for bin in 0..self.odds.len() {
            self.object[bin] += share * (object[bin] / sums[1] - self.object[bin]);
            self.around[bin] += share * (around[bin] / sums[0] - self.around[bin]);
            let odds = ((self.object[bin] + CHANCE) / (self.around[bin] + CHANCE)).ln();
            self.odds[bin] = odds.clamp(-MAX_LOG_ODDS, MAX_LOG_ODDS);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_colour_speaks_for_where_it_was_seen_and_an_unknown_one_for_nothing() {
        let mut colors = Colors::new();
        let [orange, wood, grey] = [[220, 110, 40], [196, 172, 140], [128; 3]].map(bin);
        assert_eq!(colors.odds(orange), 0.0);
        colors.learn((0..200).map(|i| if i % 2 == 0 { (orange, true) } else { (wood, false) }));
        assert!(colors.odds(orange) > 1.9 && colors.odds(wood) < -1.9);
        assert_eq!((colors.odds(grey), colors.odds(NO_COLOR)), (0.0, 0.0));
    }
}
