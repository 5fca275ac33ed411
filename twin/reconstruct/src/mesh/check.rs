//! Whether a mesh is the surface of a body: each edge between two triangles that look the same way, each corner within one ring of
//! triangles. Its genus is the number of its handles: 0 of a box, 1 of a mug.

use super::Mesh;
use std::collections::HashMap;

/// Why a mesh is no surface of a body.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Flaw {
    /// There is nothing.
    #[error("the mesh has no triangles")]
    Empty,
    /// Edges of one triangle alone, or of more than two.
    #[error("the mesh is open or branches at {0} edges")]
    Open(usize),
    /// Corners where two surfaces touch.
    #[error("the mesh touches itself at {0} corners")]
    Pinched(usize),
}

/// The kind of a closed surface.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct Topology {
    pub corners: usize,
    pub triangles: usize,
    /// Handles, of all parts together.
    pub genus: i64,
    /// Parts that are not connected.
    pub parts: usize,
}

impl Topology {
    /// Looks at a mesh.
    ///
    /// # Errors
    /// [`Flaw`] when it is not closed or not oriented.
    pub fn of(mesh: &Mesh) -> Result<Self, Flaw> {
        if mesh.triangles.is_empty() {
            return Err(Flaw::Empty);
        }
        let mut edges: HashMap<(u32, u32), u32> = HashMap::with_capacity(3 * mesh.triangles.len());
        for triangle in &mesh.triangles {
            for i in 0..3 {
                *edges.entry((triangle[i], triangle[(i + 1) % 3])).or_default() += 1;
            }
        }
        let open = edges.iter().filter(|((a, b), count)| **count != 1 || !edges.contains_key(&(*b, *a))).count();
        if open > 0 {
            return Err(Flaw::Open(open));
        }
        let (pinched, corners) = pinched(mesh);
        if pinched > 0 {
            return Err(Flaw::Pinched(pinched));
        }
        let parts = parts(mesh);
        let characteristic = corners as i64 - edges.len() as i64 / 2 + mesh.triangles.len() as i64;
        let genus = parts as i64 - characteristic / 2;
        Ok(Self { corners, triangles: mesh.triangles.len(), genus, parts })
    }
}

/// Corners whose triangles are more than one ring, and corners that triangles have.
fn pinched(mesh: &Mesh) -> (usize, usize) {
    let mut around: Vec<Vec<(u32, u32)>> = vec![Vec::new(); mesh.points.len()];
    for triangle in &mesh.triangles {
        for i in 0..3 {
            around[triangle[i] as usize].push((triangle[(i + 1) % 3], triangle[(i + 2) % 3]));
        }
    }
    let is_ring = |spokes: &Vec<(u32, u32)>| {
        let first = spokes[0].0;
        let (mut at, mut count) = (first, 0);
        while let Some((_, next)) = spokes.iter().find(|(from, _)| *from == at) {
            (at, count) = (*next, count + 1);
            if at == first || count > spokes.len() {
                break;
            }
        }
        count == spokes.len()
    };
    let used = around.iter().filter(|spokes| !spokes.is_empty());
    (used.clone().filter(|spokes| !is_ring(spokes)).count(), used.count())
}

fn parts(mesh: &Mesh) -> usize {
    let mut beside: Vec<Vec<u32>> = vec![Vec::new(); mesh.points.len()];
    for [a, b, c] in &mesh.triangles {
        beside[*a as usize].push(*b);
        beside[*b as usize].push(*c);
        beside[*c as usize].push(*a);
    }
    let mut seen = vec![false; mesh.points.len()];
    let mut parts = 0;
    for start in 0..mesh.points.len() {
        if seen[start] || beside[start].is_empty() {
            continue;
        }
        parts += 1;
        seen[start] = true;
        let mut open = vec![start as u32];
        while let Some(at) = open.pop() {
            for next in &beside[at as usize] {
                if !std::mem::replace(&mut seen[*next as usize], true) {
                    open.push(*next);
                }
            }
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::Point3;

    fn tetrahedron() -> Mesh {
        let points =
            vec![Point3::origin(), Point3::new(1.0, 0.0, 0.0), Point3::new(0.0, 1.0, 0.0), Point3::new(0.0, 0.0, 1.0)];
        Mesh { points, triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]] }
    }

    #[test]
    fn what_is_wrong_with_a_mesh_is_named() {
        let topology = Topology::of(&tetrahedron()).expect("closed");
        assert_eq!((topology.genus, topology.parts, topology.corners), (0, 1, 4));
        let mut open = tetrahedron();
        open.triangles.pop();
        assert_eq!(Topology::of(&open), Err(Flaw::Open(3)));
        let mut turned = tetrahedron();
        turned.triangles[0].swap(0, 1);
        assert!(matches!(Topology::of(&turned), Err(Flaw::Open(_))));
        // A second one that shares a corner with the first.
        let mut pinched = tetrahedron();
        pinched.points.extend([Point3::new(-1.0, 0.0, 0.0), Point3::new(0.0, -1.0, 0.0), Point3::new(0.0, 0.0, -1.0)]);
        pinched.triangles.extend([[0, 4, 5], [0, 6, 4], [0, 5, 6], [4, 6, 5]]);
        assert_eq!(Topology::of(&pinched), Err(Flaw::Pinched(1)));
        assert_eq!(Topology::of(&Mesh::default()), Err(Flaw::Empty));
    }
}
