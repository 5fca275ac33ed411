//! What is left between robot and twin over a clip.

/// Measured less predicted of one channel through one clip.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trace {
    /// File of the clip.
    pub clip: String,
    /// What was measured: `joint2`, `x`, `yaw`.
    pub channel: String,
    /// SI unit of the values, or `σ` where they are in units of the noise.
    pub unit: String,
    /// One sigma of the noise, in that unit.
    pub sigma: f64,
    /// Seconds from the clip's start and the residual, before.
    pub before: Vec<[f64; 2]>,
    /// The same after.
    pub after: Vec<[f64; 2]>,
}
