//! From a scan to assets of a simulation: pictures with known poses in, closed coloured meshes out. No network is trained and no
//! graphics device needed: signed distance and colour stand on a grid, whose derivatives are written by hand.
//!
//! | module | owns |
//! |---|---|
//! | `remark` | what is said beside a result |
//! | [`scan`] | pictures, masks, depth, poses; COLMAP, nerfstudio, robot-held cameras |
//! | [`field`] | signed distance and colour at the nodes of a box |
//! | `sweep` | signed distance from signs |
//! | [`computed`] | depth of pictures that were taken without |
//! | `closing` | gaps filled that are narrower than the grid shows |
//! | [`views`] | views read, the blurred ones left out, every eighth held out |
//! | `splats` | views as splats are trained on them, and the picture of splats |
//! | [`object`] | one object: where it starts, the optimisation, what was left uncertain |
//! | [`scene`] | what stands around: fused depth, levels, splats |
//! | [`mesh`] | its surface as triangles: closed, checked, reduced; volume and inertia |
//! | [`articulated`] | two states of an object with a part that moves: the joint and both parts |
//! | [`assets`] | files: meshes, URDF, cell.toml block, report page |
//!
//! Lengths are metres. Camera axes: x right, y down, z forwards.

pub mod articulated;
pub mod assets;
mod closing;
pub mod computed;
pub mod field;
pub mod mesh;
pub mod object;
mod remark;
pub mod scan;
pub mod scene;
mod splats;
mod sweep;
pub mod views;

pub use remark::Remark;
