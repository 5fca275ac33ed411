//! SuperSplat's compressed PLY: 16 bytes a splat, within the bounds of chunks of 256 (layout as PlayCanvas documents it:
//! position and scale 11-10-11 bits, rotation 2-10-10-10 with its largest part left out, colour and opacity 8-8-8-8).

use super::cloud::{Splat, SplatCloud};
use super::harmonics::FIRST;
use super::ply::{File, Read, degree};
use super::ply_rows::{Element, Kind, float, word};
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};

const CHUNK: usize = 256;

/// Bounds of a chunk: position, logarithm of scale, colour; lowest and highest.
struct Bounds([[[f32; 3]; 2]; 3]);

/// The splats of such a file.
pub(super) fn read(file: &File<'_>) -> Result<Read, String> {
    let chunks = file.element("chunk").ok_or("it has no table `chunk`")?;
    let vertices = file.element("vertex").ok_or("it has no table `vertex`")?;
    let places = bounds_columns(chunks)?;
    let packed = |name: &str| vertices.column(name, Kind::Word).ok_or_else(|| format!("it has no column `{name}`"));
    let columns =
        [packed("packed_position")?, packed("packed_rotation")?, packed("packed_scale")?, packed("packed_color")?];
    if chunks.count < vertices.count.div_ceil(CHUNK) {
        return Err(format!("it has {} chunks for {} splats, of which each holds 256", chunks.count, vertices.count));
    }
    let bounds: Vec<Bounds> = file
        .rows(chunks)
        .map(|row| {
            Bounds(places.map(|ends| ends.map(|three| three.map(|at| at.map_or(f32::NAN, |at| float(row, at))))))
        })
        .collect();
    let harmonics = file.element("sh");
    if let Some(sh) = harmonics.filter(|sh| sh.count != vertices.count) {
        return Err(format!("it has {} rows of colours for {} splats", sh.count, vertices.count));
    }
    let rest = harmonics.map_or(0, |sh| sh.stride());
    let degree = degree(rest)?;
    if degree > 3 {
        return Err(format!("its colours are of degree {degree}, and compressed ones go up to 3"));
    }
    let mut cloud = SplatCloud { degree, ..SplatCloud::default() };
    let mut more = harmonics.map(|sh| file.rows(sh));
    for (number, row) in file.rows(vertices).enumerate() {
        let [position, rotation, scale, color] = columns.map(|at| word(row, at));
        let Bounds([place, size, light]) = &bounds[number / CHUNK];
        let [r, g, b] = [color >> 24, color >> 16 & 255, color >> 8 & 255].map(|v| v as f32 / 255.0);
        // Chunks without colour bounds hold colours as they are.
        let color_of = if light[0][0].is_nan() { [r, g, b] } else { between(light, [r, g, b]) };
        cloud.splats.push(Splat {
            centre: Point3::from(between(place, unpack(position))),
            rotation: turn(rotation),
            sigma: Vector3::from(between(size, unpack(scale))).map(f32::exp),
            opacity: (color & 255) as f32 / 255.0,
        });
        cloud.harmonics.push(color_of.map(|v| (v - 0.5) / FIRST as f32));
        if let Some(row) = more.as_mut().and_then(Iterator::next) {
            let third = rest / 3;
            let value = |at: usize| f32::from(row[at]) * (8.0 / 255.0) - 4.0;
            cloud.harmonics.extend((0..third).map(|k| [value(k), value(third + k), value(2 * third + k)]));
        }
    }
    Ok(Read { cloud, remarks: Vec::new() })
}

type Columns = [[[Option<usize>; 3]; 2]; 3];

fn bounds_columns(chunks: &Element) -> Result<Columns, String> {
    let names = [["x", "y", "z"], ["scale_x", "scale_y", "scale_z"], ["r", "g", "b"]];
    let columns = names
        .map(|three| ["min", "max"].map(|end| three.map(|name| chunks.column(&format!("{end}_{name}"), Kind::Float))));
    let missing = columns[..2].iter().flatten().flatten().any(Option::is_none);
    if missing { Err("its chunks lack bounds of position or scale".into()) } else { Ok(columns) }
}

fn unpack(value: u32) -> [f32; 3] {
    [(value >> 21) as f32 / 2047.0, (value >> 11 & 1023) as f32 / 1023.0, (value & 2047) as f32 / 2047.0]
}

fn between(ends: &[[f32; 3]; 2], share: [f32; 3]) -> [f32; 3] {
    std::array::from_fn(|i| ends[0][i] * (1.0 - share[i]) + ends[1][i] * share[i])
}

/// The two top bits name the largest of w, x, y, z; the others follow in that order.
fn turn(value: u32) -> UnitQuaternion<f32> {
    let part = |shift: u32| ((value >> shift & 1023) as f32 / 1023.0 - 0.5) * std::f32::consts::SQRT_2;
    let [a, b, c] = [part(20), part(10), part(0)];
    let most = (1.0 - (a * a + b * b + c * c)).max(0.0).sqrt();
    let q = match value >> 30 {
        0 => Quaternion::new(most, a, b, c),
        1 => Quaternion::new(a, most, b, c),
        2 => Quaternion::new(a, b, most, c),
        _ => Quaternion::new(a, b, c, most),
    };
    UnitQuaternion::from_quaternion(q)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rotation_survives_its_ten_bits() {
        for q in [[1.0f32, 0.0, 0.0, 0.0], [0.1, -0.7, 0.3, 0.64], [0.2, 0.3, 0.9, -0.1], [-0.3, 0.1, 0.2, 0.92]] {
            let q = UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
            let parts = [q.w, q.i, q.j, q.k];
            let most = (0..4).max_by(|a, b| parts[*a].abs().total_cmp(&parts[*b].abs())).expect("four");
            let sign = parts[most].signum();
            let mut packed = most as u32;
            for part in (0..4).filter(|i| *i != most).map(|i| parts[i] * sign) {
                packed = packed << 10 | ((part / std::f32::consts::SQRT_2 + 0.5) * 1023.0).round() as u32;
            }
            assert!(turn(packed).angle_to(&q) < 3e-3, "{parts:?} {}", turn(packed).angle_to(&q));
        }
    }
}
