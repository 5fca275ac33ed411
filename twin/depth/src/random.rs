//! Random numbers that depend on a counter alone, so that pixels can be worked on in any order: the mixing function of `SplitMix64`
//! (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", OOPSLA 2014).

/// A stream of numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Random(u64);

/// Distance of two counters' states: the golden ratio, as the source has it.
const STEP: u64 = 0x9e37_79b9_7f4a_7c15;

impl Random {
    /// The stream of these counters.
    pub(crate) fn of(counters: [u64; 4]) -> Self {
        Self(counters.iter().fold(0, |state, counter| mixed(state ^ counter.wrapping_mul(STEP))))
    }

    /// The next number, from 0 to below 1.
    pub(crate) fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(STEP);
        (mixed(self.0) >> 40) as f32 / (1u64 << 24) as f32
    }

    /// The next number, from -1 to below 1.
    pub(crate) fn signed(&mut self) -> f32 {
        2.0 * self.unit() - 1.0
    }
}

fn mixed(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}
