//! What a picture says about one place of the outline.

/// The outline seen in the picture lies `offset` before this place, against `direction`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pull {
    /// How far the place lies beyond the outline seen, along `direction` [pixel].
    pub offset: f64,
    /// Unit vector in the picture along which the offset grows.
    pub direction: [f64; 2],
    /// How clear the picture is there, 0 to 1.
    pub weight: f64,
    /// How much larger the offset would be if what is seen were explained otherwise [pixel].
    pub doubt: f64,
}
