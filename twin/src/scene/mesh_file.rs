//! Reads the object's mesh from obj, stl (text and binary) or ply (text and little-endian binary): corners and
//! triangles, nothing else. Lengths in the file are metres.

use super::ObjectShape;
use nalgebra::{Point3, Vector3};
use shared_mem::input::{self, InputError};
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// Sizes that an object on a table can have [m]; what lies outside was drawn in another unit.
const LARGEST: f64 = 10.0;
const SMALLEST: f64 = 1e-3;

/// Corners and triangles as they stand in a file.
type Surface = (Vec<Point3<f64>>, Vec<[u32; 3]>);

/// A mesh file cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum MeshFileError {
    /// Missing, no file, or too large.
    #[error("{0} (`object.mesh` in cell.toml)")]
    Input(#[from] InputError),
    /// The links of an object that moves in itself, or their names.
    #[error("{0}")]
    Links(String),
    /// Not what its name says, or empty.
    #[error("{}: {what}; use a triangulated obj, stl or ply in metres", path.display())]
    Content {
        path: PathBuf,
        /// What is wrong.
        what: String,
    },
}

/// Reads a mesh and moves its geometric centre, the middle of its bounding box, to the origin.
pub(crate) fn read(path: &Path) -> Result<ObjectShape, MeshFileError> {
    let bytes = input::bytes(path, input::Kind::Mesh)?;
    let ending = path.extension().and_then(|e| e.to_str()).unwrap_or("").to_ascii_lowercase();
    let surface = match ending.as_str() {
        "obj" => obj(&bytes),
        "stl" => stl(&bytes),
        "ply" => ply(&bytes),
        _ => Err(format!("`.{ending}` is no mesh format known here")),
    };
    surface.and_then(centred).map_err(|what| MeshFileError::Content { path: path.to_owned(), what })
}

/// Corners [m], around the middle of their box, and triangles of a mesh.
///
/// # Errors
/// [`MeshFileError`] as for the object of a cell.
pub fn read_surface(path: &Path) -> Result<Surface, MeshFileError> {
    match read(path)? {
        ObjectShape::Mesh { points, triangles } => Ok((points, triangles)),
        ObjectShape::Box { .. } => Ok(Surface::default()),
    }
}

fn centred((mut points, triangles): Surface) -> Result<ObjectShape, String> {
    let count = points.len();
    if count < 4 || triangles.is_empty() {
        return Err(format!("it holds {count} corners and {} triangles", triangles.len()));
    }
    if triangles.iter().flatten().any(|i| *i as usize >= count) {
        return Err("a face names a corner that does not exist".into());
    }
    if points.iter().any(|p| !p.coords.iter().all(|v| v.is_finite())) {
        return Err("a corner is not a number".into());
    }
    let low = points.iter().fold(Vector3::repeat(f64::INFINITY), |m, p| m.inf(&p.coords));
    let high = points.iter().fold(Vector3::repeat(f64::NEG_INFINITY), |m, p| m.sup(&p.coords));
    let largest = (high - low).max();
    if largest > LARGEST {
        return Err(format!("it is {largest:.0} m large; was it drawn in millimetres? scale it by 0.001"));
    }
    if largest < SMALLEST {
        return Err(format!("it is {:.3} mm large; scale it to metres", largest * 1e3));
    }
    for p in &mut points {
        *p -= (low + high) * 0.5;
    }
    let mut triangles = triangles;
    if volume(&points, &triangles) < 0.0 {
        tracing::warn!("the mesh is inside out; its faces are turned around");
        triangles.iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
    }
    let gaps = open_edges(&points, &triangles);
    if gaps > 0 {
        tracing::warn!("the mesh is open at {gaps} edges; the physics takes its convex hull, which is closed");
    }
    Ok(ObjectShape::Mesh { points, triangles })
}

/// Volume inside a closed surface [m³]; negative when its faces look inwards.
fn volume(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> f64 {
    let corners = |t: &[u32; 3]| t.map(|i| points[i as usize].coords);
    triangles.iter().map(corners).map(|[a, b, c]| a.dot(&b.cross(&c)) / 6.0).sum()
}

/// Centroid of the volume inside a surface [m]; `None` where it is open or as good as flat, and so has none.
pub(super) fn centroid(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> Option<Vector3<f64>> {
    let whole = volume(points, triangles);
    if whole < SMALLEST.powi(3) || open_edges(points, triangles) > 0 {
        return None;
    }
    // Of the tetrahedra between the origin and each face.
    let corners = |t: &[u32; 3]| t.map(|i| points[i as usize].coords);
    let moment = |[a, b, c]: [Vector3<f64>; 3]| (a + b + c) * (a.dot(&b.cross(&c)) / 24.0);
    Some(triangles.iter().map(corners).map(moment).sum::<Vector3<f64>>() / whole)
}

/// Edges that belong to an odd number of faces. Corners at one place are one corner: an stl repeats them.
pub(crate) fn open_edges(points: &[Point3<f64>], triangles: &[[u32; 3]]) -> usize {
    let place = |i: u32| points[i as usize].coords.map(|v| (v * 1e7).round() as i64);
    let mut edges: HashMap<[[i64; 3]; 2], usize> = HashMap::new();
    for triangle in triangles {
        for i in 0..3 {
            let (a, b) = (place(triangle[i]).into(), place(triangle[(i + 1) % 3]).into());
            *edges.entry(if a < b { [a, b] } else { [b, a] }).or_default() += 1;
        }
    }
    edges.values().filter(|count| !count.is_multiple_of(2)).count()
}

/// Wavefront: `v x y z` and `f a b c ..` with optional `/texture/normal`, from 1 or counted from the end.
fn obj(bytes: &[u8]) -> Result<Surface, String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "it is not text")?;
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        let bad = || format!("line {} makes no sense", number + 1);
        match words.next() {
            Some("v") => points.push(point(&mut words).ok_or_else(bad)?),
            Some("f") => {
                let corner = |word: &str| -> Option<u32> {
                    let index: i64 = word.split('/').next()?.parse().ok()?;
                    let from_zero = if index < 0 { index + points.len() as i64 } else { index - 1 };
                    u32::try_from(from_zero).ok()
                };
                let face: Vec<u32> = words.map(corner).collect::<Option<_>>().ok_or_else(bad)?;
                fan(&face, &mut triangles);
            }
            _ => {}
        }
    }
    Ok((points, triangles))
}

/// Stereolithography. The size decides which of the two forms it is: binary files may begin with "solid" too.
fn stl(bytes: &[u8]) -> Result<Surface, String> {
    let count = bytes.get(80..84).map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]) as usize);
    let mut corners = Vec::new();
    if let Some(count) = count
        && count.checked_mul(50).and_then(|size| size.checked_add(84)) == Some(bytes.len())
    {
        for facet in bytes[84..].chunks_exact(50) {
            corners.extend(facet[12..48].chunks_exact(12).map(|c| {
                Point3::from([0, 4, 8].map(|o| f64::from(f32::from_le_bytes([c[o], c[o + 1], c[o + 2], c[o + 3]]))))
            }));
        }
    } else {
        let text = std::str::from_utf8(bytes).map_err(|_| "it is neither a binary nor a text stl")?;
        for line in text.lines() {
            let mut words = line.split_whitespace();
            if words.next() == Some("vertex") {
                corners.push(point(&mut words).ok_or("a vertex line makes no sense")?);
            }
        }
    }
    u32::try_from(corners.len()).map_err(|_| "it is too large")?;
    Ok(welded(&corners))
}

/// Triangles whose corners are listed one after the other, each place once: an stl repeats it for every face around it.
fn welded(corners: &[Point3<f64>]) -> Surface {
    let (mut points, mut known) = (Vec::new(), HashMap::new());
    let mut index = |corner: &Point3<f64>| {
        *known.entry([corner.x.to_bits(), corner.y.to_bits(), corner.z.to_bits()]).or_insert_with(|| {
            points.push(*corner);
            points.len() as u32 - 1
        })
    };
    let triangles = corners.chunks_exact(3).map(|t| [index(&t[0]), index(&t[1]), index(&t[2])]).collect();
    (points, triangles)
}

/// One property of a ply element: how many bytes a value takes (text ignores it) and, for lists, a count before it.
struct Property {
    name: String,
    kind: Scalar,
    list_count: Option<Scalar>,
}

#[derive(Clone, Copy)]
enum Scalar {
    Int(usize),
    Float(usize),
}

impl Scalar {
    /// Size of a value in a binary file [bytes].
    fn bytes(self) -> usize {
        let (Self::Int(size) | Self::Float(size)) = self;
        size
    }
}

/// A table of a ply: so many rows with the same properties.
struct Element {
    name: String,
    count: usize,
    properties: Vec<Property>,
}

fn ply(bytes: &[u8]) -> Result<Surface, String> {
    let marker = b"end_header";
    let end = bytes.windows(marker.len()).position(|w| w == marker).ok_or("it has no `end_header`")? + marker.len();
    let header = std::str::from_utf8(&bytes[..end]).map_err(|_| "its header is not text")?;
    let body_start = end + bytes[end..].iter().position(|b| *b == b'\n').map_or(0, |p| p + 1);
    let binary = match header.lines().find(|l| l.starts_with("format")).unwrap_or("") {
        l if l.contains("ascii") => false,
        l if l.contains("binary_little_endian") => true,
        _ => return Err("its format is neither ascii nor binary_little_endian".into()),
    };
    let mut values = PlyValues { rest: &bytes[body_start..], binary };
    let (mut points, mut triangles) = (Vec::new(), Vec::new());
    for element in ply_elements(header)? {
        values.expect(&element)?;
        for _ in 0..element.count {
            let mut xyz = [0.0; 3];
            for property in &element.properties {
                let axis = ["x", "y", "z"].iter().position(|axis| *axis == property.name);
                match (element.name.as_str(), property.list_count, axis) {
                    ("vertex", None, Some(axis)) => xyz[axis] = values.next(property.kind)?,
                    ("face", Some(count), None) if property.name.starts_with("vertex_ind") => {
                        let corners = values.list(count, property.kind)?;
                        fan(&corners.iter().map(|v| *v as u32).collect::<Vec<_>>(), &mut triangles);
                    }
                    (_, Some(count), _) => drop(values.list(count, property.kind)?),
                    (_, None, _) => drop(values.next(property.kind)?),
                }
            }
            if element.name == "vertex" {
                points.push(Point3::from(xyz));
            }
        }
    }
    Ok((points, triangles))
}

fn ply_elements(header: &str) -> Result<Vec<Element>, String> {
    let mut elements: Vec<Element> = Vec::new();
    for line in header.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        let bad = || format!("its header line `{line}` makes no sense");
        match words.as_slice() {
            ["element", name, count] => {
                let count = count.parse().map_err(|_| bad())?;
                elements.push(Element { name: (*name).to_owned(), count, properties: Vec::new() });
            }
            ["property", "list", count, kind, name] => elements.last_mut().ok_or_else(bad)?.properties.push(Property {
                name: (*name).to_owned(),
                kind: scalar(kind).ok_or_else(bad)?,
                list_count: Some(scalar(count).ok_or_else(bad)?),
            }),
            ["property", kind, name] => elements.last_mut().ok_or_else(bad)?.properties.push(Property {
                name: (*name).to_owned(),
                kind: scalar(kind).ok_or_else(bad)?,
                list_count: None,
            }),
            _ => {}
        }
    }
    Ok(elements)
}

fn scalar(name: &str) -> Option<Scalar> {
    Some(match name {
        "char" | "uchar" | "int8" | "uint8" => Scalar::Int(1),
        "short" | "ushort" | "int16" | "uint16" => Scalar::Int(2),
        "int" | "uint" | "int32" | "uint32" => Scalar::Int(4),
        "float" | "float32" => Scalar::Float(4),
        "double" | "float64" => Scalar::Float(8),
        _ => return None,
    })
}

/// The numbers behind a ply header, one after the other.
struct PlyValues<'a> {
    rest: &'a [u8],
    binary: bool,
}

impl PlyValues<'_> {
    /// Fails where the file is too short for the rows of a table, of which each takes at least a byte.
    fn expect(&self, element: &Element) -> Result<(), String> {
        // Text takes a digit and what parts it from the next one.
        let size = |kind: Scalar| if self.binary { kind.bytes() } else { 2 };
        let of = |property: &Property| size(property.list_count.unwrap_or(property.kind));
        let row: usize = element.properties.iter().map(of).sum();
        let Element { name, count, .. } = element;
        if row == 0 && *count > 0 {
            return Err(format!("its table `{name}` has {count} rows without columns"));
        }
        // The last number of a text needs nothing behind it.
        if count.checked_mul(row).is_none_or(|needed| needed > self.rest.len() + 1) {
            let left = self.rest.len();
            return Err(format!("its header says {count} rows of `{name}`, and only {left} bytes are left for them"));
        }
        Ok(())
    }

    /// A count and as many values.
    fn list(&mut self, count: Scalar, kind: Scalar) -> Result<Vec<f64>, String> {
        let count = self.next(count)?;
        if !(count >= 0.0 && count <= self.rest.len() as f64) {
            return Err(format!("a list claims {count} values, and {} bytes are left", self.rest.len()));
        }
        (0..count as usize).map(|_| self.next(kind)).collect()
    }

    fn next(&mut self, kind: Scalar) -> Result<f64, String> {
        let cut = || "it ends in the middle".to_owned();
        if !self.binary {
            let start = self.rest.iter().position(|b| !b.is_ascii_whitespace()).ok_or_else(cut)?;
            let word = &self.rest[start..];
            let word = &word[..word.iter().position(u8::is_ascii_whitespace).unwrap_or(word.len())];
            self.rest = &self.rest[start + word.len()..];
            let text = std::str::from_utf8(word).unwrap_or("");
            return text.parse().map_err(|_| format!("`{text}` is no number"));
        }
        let size = kind.bytes();
        let (value, rest) = self.rest.split_at_checked(size).ok_or_else(cut)?;
        self.rest = rest;
        let mut eight = [0; 8];
        eight[..size].copy_from_slice(value);
        Ok(match kind {
            Scalar::Int(_) => u64::from_le_bytes(eight) as f64, // indices and counts: never negative
            Scalar::Float(4) => f64::from(f32::from_le_bytes([eight[0], eight[1], eight[2], eight[3]])),
            Scalar::Float(_) => f64::from_le_bytes(eight),
        })
    }
}

fn point<'a>(words: &mut impl Iterator<Item = &'a str>) -> Option<Point3<f64>> {
    let mut next = || words.next()?.parse::<f64>().ok();
    Some(Point3::new(next()?, next()?, next()?))
}

fn fan(face: &[u32], triangles: &mut Vec<[u32; 3]>) {
    triangles.extend((2..face.len()).map(|i| [face[0], face[i - 1], face[i]]));
}

#[cfg(test)]
mod tests;
