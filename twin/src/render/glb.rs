//! Reads the triangles of a glTF 2.0 binary (Khronos specification, section 4.4): positions, indices and base colours;
//! nodes at the identity, as `franka-description` writes them. Metres.

use super::Mesh;
use nalgebra::Point3;
use serde::Deserialize;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Document {
    accessors: Vec<Accessor>,
    buffer_views: Vec<BufferView>,
    meshes: Vec<MeshEntry>,
    #[serde(default)]
    materials: Vec<Material>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Accessor {
    buffer_view: usize,
    #[serde(default)]
    byte_offset: usize,
    component_type: u32,
    count: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct BufferView {
    #[serde(default)]
    byte_offset: usize,
    byte_length: usize,
}

#[derive(Deserialize)]
struct MeshEntry {
    primitives: Vec<Primitive>,
}

#[derive(Deserialize)]
struct Primitive {
    attributes: Attributes,
    indices: usize,
    material: Option<usize>,
}

#[derive(Deserialize)]
#[serde(rename_all = "UPPERCASE")]
struct Attributes {
    position: usize,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Material {
    pbr_metallic_roughness: Option<Pbr>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Pbr {
    base_color_factor: Option<[f32; 4]>,
}

/// Colour of a part without a material.
const PLAIN: [u8; 3] = [200; 3];
/// glTF's code of `u16`, `u32` and `f32`.
const U16: u32 = 5123;
const U32: u32 = 5125;
const F32: u32 = 5126;

/// One mesh for every colour in the file; `None` when the bytes are no such file.
pub(super) fn read(bytes: &[u8]) -> Option<Vec<Mesh>> {
    let word = |at: usize| Some(u32::from_le_bytes(bytes.get(at..at + 4)?.try_into().ok()?) as usize);
    let json_end = 20usize.checked_add(word(12)?)?;
    let document: Document = serde_json::from_slice(bytes.get(20..json_end)?).ok()?;
    let data = bytes.get(json_end + 8..)?;
    let mut meshes = Vec::new();
    for primitive in document.meshes.iter().flat_map(|mesh| &mesh.primitives) {
        let points = (document.elements(data, primitive.attributes.position, F32, 12)?)
            .map(|b| Point3::new(float(b, 0), float(b, 4), float(b, 8)))
            .collect::<Vec<_>>();
        let wide = document.accessors.get(primitive.indices)?.component_type == U32;
        let (kind, size) = if wide { (U32, 4) } else { (U16, 2) };
        let indices: Vec<u32> = document.elements(data, primitive.indices, kind, size)?.map(index).collect();
        if indices.iter().any(|i| *i as usize >= points.len()) {
            return None;
        }
        let triangles = indices.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect();
        let material = primitive.material.and_then(|m| document.materials.get(m)?.pbr_metallic_roughness.as_ref());
        let color = material.and_then(|m| m.base_color_factor).map_or(PLAIN, |c| [c[0], c[1], c[2]].map(srgb));
        meshes.push(Mesh { points, triangles, color });
    }
    Some(meshes)
}

impl Document {
    fn elements<'a>(
        &self,
        data: &'a [u8],
        accessor: usize,
        kind: u32,
        size: usize,
    ) -> Option<impl Iterator<Item = &'a [u8]>> {
        let accessor = self.accessors.get(accessor).filter(|a| a.component_type == kind)?;
        let view = self.buffer_views.get(accessor.buffer_view)?;
        let from = view.byte_offset.checked_add(accessor.byte_offset)?;
        let length = accessor.count.checked_mul(size)?;
        (accessor.byte_offset.checked_add(length)? <= view.byte_length).then_some(())?;
        Some(data.get(from..from.checked_add(length)?)?.chunks_exact(size))
    }
}

fn float(bytes: &[u8], at: usize) -> f32 {
    bytes.get(at..at + 4).and_then(|b| b.try_into().ok()).map_or(0.0, f32::from_le_bytes)
}

fn index(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0, |value, byte| value << 8 | u32::from(*byte))
}

/// From linear light, as glTF stores a base colour, to a picture's value.
fn srgb(linear: f32) -> u8 {
    let value = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn every_link_of_the_fr3_is_read_with_its_colours() {
        for bytes in franka_description::FR3.links {
            let meshes = read(bytes).expect("a glb");
            assert!(meshes.iter().map(|m| m.triangles.len()).sum::<usize>() > 1000);
            assert!(meshes.iter().any(|m| m.color == [255; 3]), "no white part");
        }
    }

    proptest! {
        #[test]
        fn a_damaged_file_is_refused_or_read_but_never_a_panic(
            cut in 0usize..22788, at in 0usize..2000, value in any::<u8>(),
        ) {
            let mut bytes = franka_description::FR3.links[1].to_vec();
            bytes[at] = value;
            bytes.truncate(cut);
            for mesh in read(&bytes).unwrap_or_default() {
                prop_assert!(mesh.triangles.iter().flatten().all(|i| (*i as usize) < mesh.points.len()));
            }
        }
    }
}
