//! From depth to geometry: pictures of known cameras fused into one surface, and the planes in it.
//!
//! World frame and camera frame (z forward, x right, y down) in metres; triangles counter-clockwise from outside.
//!
//! | module | owns |
//! |---|---|
//! | `surface` | a coloured mesh |
//! | `fuse` | depth pictures into a surface |
//! | `plane` | the largest plane, the levels of a scene, and its table |

pub mod fuse;
pub mod plane;
mod surface;
#[cfg(test)]
mod test_boxes;

pub use surface::Surface;
