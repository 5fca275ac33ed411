//! PLY: the header of any binary little-endian file, and the columns of 3D Gaussian splats as their first
//! implementation writes them (Kerbl et al. 2023): `x y z f_dc_* f_rest_* opacity scale_* rot_*`, all `float`; opacity
//! as a logit, scales as logarithms, rotations `w, x, y, z`.

use super::cloud::{Splat, SplatCloud};
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};

/// Longest header that is looked for [bytes].
const LONGEST: usize = 1 << 16;

/// What the header says.
#[derive(Debug)]
pub(super) struct Header {
    elements: Vec<Element>,
}

/// One table of the file.
#[derive(Debug)]
pub(super) struct Element {
    name: String,
    /// Rows.
    pub(super) count: usize,
    /// Names and sizes of the columns [bytes].
    columns: Vec<(String, Kind)>,
    /// Where it begins [bytes].
    begin: usize,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Byte,
    Short,
    Word,
    Float,
    Double,
}

impl Kind {
    fn parse(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "uchar" | "int8" | "uint8" => Self::Byte,
            "short" | "ushort" | "int16" | "uint16" => Self::Short,
            "int" | "uint" | "int32" | "uint32" => Self::Word,
            "float" | "float32" => Self::Float,
            "double" | "float64" => Self::Double,
            _ => return None,
        })
    }

    fn bytes(self) -> usize {
        match self {
            Self::Byte => 1,
            Self::Short => 2,
            Self::Word | Self::Float => 4,
            Self::Double => 8,
        }
    }
}

impl Header {
    pub(super) fn parse(bytes: &[u8]) -> Result<Self, String> {
        const END: &[u8] = b"end_header\n";
        if !bytes.starts_with(b"ply") {
            return Err("it is no PLY file".into());
        }
        let head = &bytes[..bytes.len().min(LONGEST)];
        let end = head.windows(END.len()).position(|window| window == END).ok_or("its header has no end")?;
        let text = std::str::from_utf8(&head[..end]).map_err(|_| "its header is no text")?;
        let mut elements: Vec<Element> = Vec::new();
        for line in text.lines().skip(1) {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[..] {
                ["format", format, _] if format != "binary_little_endian" => {
                    return Err(format!("its format is {format}, not binary_little_endian"));
                }
                ["element", name, count] => {
                    let count = count.parse().map_err(|_| format!("it has `{count}` rows of {name}"))?;
                    elements.push(Element { name: name.into(), count, columns: Vec::new(), begin: 0 });
                }
                ["property", kind, name] => {
                    let kind = Kind::parse(kind).ok_or_else(|| format!("column {name} is of unknown type {kind}"))?;
                    let element = elements.last_mut().ok_or("a column stands before any table")?;
                    element.columns.push((name.into(), kind));
                }
                ["property", "list", ..] => return Err("it holds lists: it is a mesh, no splats".into()),
                _ => {}
            }
        }
        let mut begin = end + END.len();
        for element in &mut elements {
            element.begin = begin;
            let size = element.count.checked_mul(element.stride()).and_then(|size| begin.checked_add(size));
            begin = size.ok_or("it claims more rows than any file holds")?;
        }
        if begin > bytes.len() {
            return Err(format!("it is cut short: {} bytes of {begin}", bytes.len()));
        }
        Ok(Self { elements })
    }

    pub(super) fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }
}

impl Element {
    pub(super) fn stride(&self) -> usize {
        self.columns.iter().map(|(_, kind)| kind.bytes()).sum()
    }

    /// Where a column of this type begins within a row [bytes].
    pub(super) fn column(&self, wanted: &str, kind: Kind) -> Option<usize> {
        let mut at = 0;
        for (name, own) in &self.columns {
            if name == wanted {
                return (*own == kind).then_some(at);
            }
            at += own.bytes();
        }
        None
    }

    /// The rows; the header made sure that all are there.
    pub(super) fn rows<'a>(&self, bytes: &'a [u8]) -> impl Iterator<Item = &'a [u8]> {
        let stride = self.stride();
        bytes[self.begin..self.begin + self.count * stride].chunks_exact(stride.max(1))
    }
}

/// Four bytes of a row as a number.
pub(super) fn float(row: &[u8], at: usize) -> f32 {
    f32::from_bits(word(row, at))
}

/// Four bytes of a row as an unsigned number.
pub(super) fn word(row: &[u8], at: usize) -> u32 {
    row.get(at..at + 4).and_then(|b| b.try_into().ok()).map_or(0, u32::from_le_bytes)
}

/// The splats of a file with the usual columns.
pub(super) fn read(header: &Header, bytes: &[u8]) -> Result<SplatCloud, String> {
    let vertices = header.element("vertex").ok_or("it has no table `vertex`")?;
    let column = |name: &str| {
        vertices.column(name, Kind::Float).ok_or_else(|| format!("it has no column `{name}` of floats: no splats"))
    };
    let columns = |names: [&str; 3]| -> Result<[usize; 3], String> {
        Ok([column(names[0])?, column(names[1])?, column(names[2])?])
    };
    let place = columns(["x", "y", "z"])?;
    let scale = columns(["scale_0", "scale_1", "scale_2"])?;
    let first = columns(["f_dc_0", "f_dc_1", "f_dc_2"])?;
    let turn = [column("rot_0")?, column("rot_1")?, column("rot_2")?, column("rot_3")?];
    let opacity = column("opacity")?;
    let rest: Vec<usize> = (0..45).map_while(|n| column(&format!("f_rest_{n}")).ok()).collect();
    let degree = degree(rest.len())?;
    let more = rest.len() / 3;
    let mut cloud = SplatCloud { degree, ..SplatCloud::default() };
    for row in vertices.rows(bytes) {
        let three = |at: [usize; 3]| at.map(|at| float(row, at));
        let [w, x, y, z] = turn.map(|at| float(row, at));
        let turn = Quaternion::new(w, x, y, z);
        // A rotation without length says nothing, and a splat that is a ball needs none.
        let rotation =
            if turn.norm() == 0.0 { UnitQuaternion::identity() } else { UnitQuaternion::from_quaternion(turn) };
        cloud.splats.push(Splat {
            centre: Point3::from(three(place)),
            rotation,
            sigma: Vector3::from(three(scale)).map(f32::exp),
            opacity: 1.0 / (1.0 + (-float(row, opacity)).exp()),
        });
        cloud.harmonics.push(three(first));
        // All of red, then green, then blue.
        cloud.harmonics.extend((0..more).map(|k| three([rest[k], rest[more + k], rest[2 * more + k]])));
    }
    Ok(cloud)
}

/// The degree with so many coefficients beyond the first, three colours together.
pub(super) fn degree(rest: usize) -> Result<usize, String> {
    [0, 9, 24, 45]
        .iter()
        .position(|known| *known == rest)
        .ok_or_else(|| format!("it has {rest} columns `f_rest_*`; degrees 0 to 3 have 0, 9, 24 or 45"))
}

/// A file with these splats, in the usual columns.
pub(super) fn write(cloud: &SplatCloud) -> Vec<u8> {
    let rest = 3 * (cloud.coefficients() - 1);
    let mut header = format!("ply\nformat binary_little_endian 1.0\nelement vertex {}\n", cloud.splats.len());
    let names = ["x", "y", "z", "f_dc_0", "f_dc_1", "f_dc_2"].map(str::to_owned).into_iter();
    let more = (0..rest).map(|n| format!("f_rest_{n}"));
    let last = ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"].map(str::to_owned);
    names.chain(more).chain(last).for_each(|name| header += &format!("property float {name}\n"));
    let mut out = (header + "end_header\n").into_bytes();
    for (splat, colors) in cloud.splats.iter().zip(cloud.harmonics.chunks_exact(cloud.coefficients())) {
        let opacity = splat.opacity.clamp(1e-6, 1.0 - 1e-6);
        let turn = splat.rotation.quaternion();
        let rest = (0..3).flat_map(|c| colors[1..].iter().map(move |color| color[c]));
        (splat.centre.iter().copied())
            .chain(colors[0])
            .chain(rest)
            .chain([(opacity / (1.0 - opacity)).ln()])
            .chain(splat.sigma.iter().map(|sigma| sigma.max(1e-30).ln()))
            .chain([turn.w, turn.i, turn.j, turn.k])
            .for_each(|value| out.extend(value.to_le_bytes()));
    }
    out
}
