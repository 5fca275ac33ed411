//! Models as the device keeps them, uploaded once: splats one after the other with the number of their body, the
//! coefficients of their harmonics beyond the first as halves, and the corners of meshes.

use super::{Device, DeviceError};
use crate::render::Mesh;
use nalgebra::Point3;
use splat::{Shape, SplatCloud};
use std::ops::Range;

/// Bytes of a splat, without its harmonics.
const SPLAT: u64 = 64;
/// Bytes of a corner: place, normal, colour.
pub(super) const CORNER: u64 = 28;

#[derive(Debug)]
pub(super) struct Upload {
    pub(super) splats: wgpu::Buffer,
    pub(super) harmonics: wgpu::Buffer,
    pub(super) corners: wgpu::Buffer,
    /// How many splats there are.
    pub(super) count: u32,
    pub(super) bodies: Vec<Part>,
}

/// One body's part of it.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) instance: u32,
    /// Degree of the harmonics, number of the first splat, and first word of its harmonics.
    pub(super) degree: u32,
    pub(super) first: u32,
    pub(super) harmonics: u32,
    /// Corners of a mesh.
    pub(super) corners: Range<u32>,
}

impl Upload {
    /// Packs the models with their numbers in the picture and sends them.
    pub(super) fn new(device: &Device, models: &[(Shape<'_>, u32)]) -> Result<Self, DeviceError> {
        let count: u64 = models.iter().map(|(shape, _)| splats_of(shape)).sum();
        device.check_room(|| format!("{count} splats"), count * SPLAT)?;
        let words: u64 = models.iter().map(|(shape, _)| splats_of(shape) * words_of(shape)).sum();
        device.check_room(|| format!("the spherical harmonics of {count} splats"), words * 4)?;
        let triangles: u64 = (models.iter())
            .map(|(shape, _)| if let Shape::Mesh(mesh) = shape { mesh.triangles.len() as u64 } else { 0 })
            .sum();
        device.check_room(|| format!("{triangles} triangles"), triangles * 3 * CORNER)?;
        let mut splats = Vec::with_capacity((count * SPLAT) as usize);
        let mut harmonics = Vec::with_capacity((words * 4) as usize);
        let mut corners = Vec::with_capacity((triangles * 3 * CORNER) as usize);
        let mut bodies = Vec::with_capacity(models.len());
        for ((shape, instance), number) in models.iter().zip(0u32..) {
            let mut part = Part {
                instance: *instance,
                degree: 0,
                first: (splats.len() as u64 / SPLAT) as u32,
                harmonics: (harmonics.len() / 4) as u32,
                corners: 0..0,
            };
            match shape {
                Shape::Splats(cloud) => {
                    part.degree = cloud.degree as u32;
                    pack_splats(cloud, number, &mut splats);
                    pack_harmonics(cloud, &mut harmonics);
                }
                Shape::Mesh(mesh) => {
                    let begin = (corners.len() as u64 / CORNER) as u32;
                    pack_mesh(mesh, &mut corners);
                    part.corners = begin..(corners.len() as u64 / CORNER) as u32;
                }
            }
            bodies.push(part);
        }
        let [splats, harmonics] = [splats, harmonics].map(|bytes| device.send(bytes, wgpu::BufferUsages::STORAGE));
        let corners = device.send(corners, wgpu::BufferUsages::VERTEX)?;
        Ok(Self { splats: splats?, harmonics: harmonics?, corners, count: count as u32, bodies })
    }

    pub(super) fn has_meshes(&self) -> bool {
        self.bodies.iter().any(|body| !body.corners.is_empty())
    }
}

fn splats_of(shape: &Shape<'_>) -> u64 {
    if let Shape::Splats(cloud) = shape { cloud.splats.len() as u64 } else { 0 }
}

/// Words of a splat's harmonics beyond the first.
fn words_of(shape: &Shape<'_>) -> u64 {
    if let Shape::Splats(cloud) = shape { (3 * (cloud.coefficients() as u64 - 1)).div_ceil(2) } else { 0 }
}

fn pack_splats(cloud: &SplatCloud, body: u32, out: &mut Vec<u8>) {
    for (splat, colors) in cloud.splats.iter().zip(cloud.harmonics.chunks_exact(cloud.coefficients())) {
        let [r, g, b] = colors[0];
        let turn = splat.rotation.coords;
        let (centre, sigma) = (splat.centre, splat.sigma);
        let numbers = [centre.x, centre.y, centre.z, splat.opacity, turn.x, turn.y, turn.z, turn.w];
        numbers.iter().chain(sigma.iter()).for_each(|number| out.extend(number.to_ne_bytes()));
        out.extend(body.to_ne_bytes());
        [r, g, b, 0.0].iter().for_each(|number| out.extend(number.to_ne_bytes()));
    }
}

fn pack_harmonics(cloud: &SplatCloud, out: &mut Vec<u8>) {
    for colors in cloud.harmonics.chunks_exact(cloud.coefficients()) {
        let halves = colors[1..].iter().flatten().map(|number| half(*number));
        let before = out.len();
        halves.for_each(|half| out.extend(half.to_ne_bytes()));
        // Each splat begins with a word of its own.
        if !(out.len() - before).is_multiple_of(4) {
            out.extend([0; 2]);
        }
    }
}

fn pack_mesh(mesh: &Mesh, out: &mut Vec<u8>) {
    let [r, g, b] = mesh.color;
    for triangle in &mesh.triangles {
        let corners: [Point3<f32>; 3] = triangle.map(|i| mesh.points[i as usize]);
        let normal = (corners[1] - corners[0]).cross(&(corners[2] - corners[0]));
        let normal = normal / normal.norm().max(1e-20);
        for corner in corners {
            corner.iter().chain(normal.iter()).for_each(|number| out.extend(number.to_ne_bytes()));
            out.extend([r, g, b, 0]);
        }
    }
}

/// A number in 16 bits (IEEE 754), rounded to the nearest; what is too large becomes the largest.
fn half(number: f32) -> u16 {
    let sign = (number.to_bits() >> 16 & 0x8000) as u16;
    let size = number.abs().min(65504.0);
    if size < 2.0f32.powi(-14) {
        return sign | (size * 2.0f32.powi(24)).round_ties_even() as u16;
    }
    let bits = size.to_bits();
    let rounded = (bits + 0xfff + (bits >> 13 & 1)) >> 13;
    sign | (rounded - (112 << 10)) as u16
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_those_of_the_standard() {
        for (number, bits) in [
            (0.0, 0),
            (1.0, 0x3c00),
            (-2.0, 0xc000),
            (65504.0, 0x7bff),
            (1e9, 0x7bff),
            (6.103_515_6e-5, 0x0400),
            (5.960_464_5e-8, 0x0001),
            (0.333_333_34, 0x3555),
            (-0.1, 0xae66),
            (1.000_976_6, 0x3c01),
        ] {
            assert_eq!(half(number), bits, "{number}");
        }
    }
}
