//! PLY: the header of any file, and the columns of 3D Gaussian splats as their first implementation writes them (Kerbl et al.
//! 2023): `x y z f_dc_* f_rest_* opacity scale_* rot_*`, in any order, `float` or `double`; opacity as a logit, scales as
//! logarithms, rotations `w, x, y, z`. 2D splats (Huang et al. 2024) have two scales: along the normal they have no extent.

use super::cloud::{Splat, SplatCloud};
use super::ply_rows::{self, Column, Element, Format, Kind};
use nalgebra::{Point3, Quaternion, UnitQuaternion, Vector3};
use std::borrow::Cow;

/// Longest header that is looked for [bytes].
const LONGEST: usize = 1 << 16;
/// Highest degree of the colours that is drawn, and that is read.
const MAX_DEGREE: usize = 3;
const HIGHEST: usize = 8;
/// Thickness of a splat that has none, of its smaller extent: a rotation needs three axes.
const THIN: f32 = 1e-3;

/// A file: what its header says, and its rows.
#[derive(Debug)]
pub(super) struct File<'a> {
    elements: Vec<Element>,
    /// Binary and little-endian.
    rows: Cow<'a, [u8]>,
    /// What is missing at its end, where it was cut.
    pub(super) cut: Option<String>,
}

/// Splats, and what is to be said about them.
#[derive(Debug, Default)]
pub(super) struct Read {
    pub(super) cloud: SplatCloud,
    pub(super) remarks: Vec<String>,
}

/// The header's text, and where the rows begin. Lines end as the first one does: the bytes of a row may be anything.
fn header(bytes: &[u8]) -> Result<(&str, usize), String> {
    let end: &[u8] = match bytes {
        [b'p', b'l', b'y', b'\r', b'\n', ..] => b"\r\n",
        [b'p', b'l', b'y', b'\r', ..] => b"\r",
        [b'p', b'l', b'y', ..] => b"\n",
        _ => return Err("it is no PLY file".into()),
    };
    let last = [end, b"end_header"].concat();
    let head = &bytes[..bytes.len().min(LONGEST)];
    // Blanks may follow, and the end of a line.
    let begin = |at: usize| {
        let rest = &head[at + last.len()..];
        let blanks = rest.iter().take_while(|byte| matches!(byte, b' ' | b'\t') || **byte == b'\r' && end == b"\n");
        let blanks = blanks.count();
        rest[blanks..].starts_with(end).then_some(at + last.len() + blanks + end.len())
    };
    let ends = head.windows(last.len()).enumerate().filter(|(_, window)| *window == last);
    let (at, begin) = ends.filter_map(|(at, _)| Some((at, begin(at)?))).next().ok_or("its header has no end")?;
    let text = std::str::from_utf8(&head[..at]).map_err(|_| "its header is no text")?;
    Ok((text, begin))
}

impl<'a> File<'a> {
    pub(super) fn parse(bytes: &'a [u8]) -> Result<Self, String> {
        let (text, begin) = header(bytes)?;
        let (mut elements, mut format) = (Vec::<Element>::new(), None);
        for line in text.split(['\r', '\n']).skip(1) {
            let words: Vec<&str> = line.split_whitespace().collect();
            match words[..] {
                ["format", name, ..] => format = Some(Format::parse(name)?),
                ["element", name, count] => {
                    let count: usize = count.parse().map_err(|_| format!("it has `{count}` rows of {name}"))?;
                    elements.push(Element { name: name.into(), count, claimed: count, columns: Vec::new(), begin: 0 });
                }
                ["property", kind, name] => {
                    let kind = Kind::parse(kind).ok_or_else(|| format!("column {name} is of unknown type {kind}"))?;
                    let element = elements.last_mut().ok_or("a column stands before any table")?;
                    element.columns.push((name.into(), kind));
                }
                ["property", "list", ..] if elements.last().is_none_or(|element| element.count > 0) => {
                    return Err("it holds lists: it is a mesh, no splats".into());
                }
                _ => {}
            }
        }
        let format = format.ok_or("its header does not say its format")?;
        let body = &bytes[begin..];
        let mut end = 0usize;
        for element in &mut elements {
            let least = format.least(element);
            let size = element.count.checked_mul(least).and_then(|size| end.checked_add(size));
            let whole = size.ok_or("it claims more rows than any file holds")?;
            if whole > body.len() {
                element.count = body.len().saturating_sub(end) / least.max(1);
            }
            end = whole;
        }
        let rows = match format {
            Format::Little => Cow::Borrowed(body),
            Format::Big => Cow::Owned(ply_rows::turned(&elements, body)),
            Format::Ascii => Cow::Owned(ply_rows::parsed(&mut elements, body)?),
        };
        let cut = elements.iter().find(|element| element.count < element.claimed).map(|element| {
            let Element { name, count, claimed, .. } = element;
            format!("it is cut short: {count} of {claimed} rows of its table `{name}` are there")
        });
        let mut begin = 0;
        for element in &mut elements {
            element.begin = begin;
            begin += element.count * element.stride();
        }
        Ok(Self { elements, rows, cut })
    }

    /// Whether at least half of the splats that it claims are there, and all that belongs to them.
    pub(super) fn is_half_there(&self) -> bool {
        let is_whole = |name: &str| self.element(name).is_none_or(|element| element.count == element.claimed);
        let is_half = self.element("vertex").is_some_and(|splats| 2 * splats.count >= splats.claimed);
        // Colours of a compressed file stand behind all of its splats.
        let has_colours = self.element("sh").is_none() || is_whole("vertex");
        is_half && has_colours && is_whole("chunk") && is_whole("sh")
    }

    /// The rows of one of its tables.
    pub(super) fn rows(&self, of: &Element) -> impl Iterator<Item = &[u8]> {
        let stride = of.stride();
        self.rows[of.begin..of.begin + of.count * stride].chunks_exact(stride.max(1))
    }

    pub(super) fn element(&self, name: &str) -> Option<&Element> {
        self.elements.iter().find(|element| element.name == name)
    }
}

/// The splats of a file with the usual columns.
pub(super) fn read(file: &File<'_>) -> Result<Read, String> {
    let vertices = file.element("vertex").ok_or("it has no table `vertex`")?;
    let column = |name: &str| {
        let found = vertices.find(name).filter(|column| matches!(column.kind, Kind::Float | Kind::Double));
        found.ok_or_else(|| format!("it has no column `{name}` of floats or doubles: no splats"))
    };
    let columns = |names: [&str; 3]| -> Result<[Column; 3], String> {
        Ok([column(names[0])?, column(names[1])?, column(names[2])?])
    };
    let place = columns(["x", "y", "z"])?;
    let scale = [column("scale_0")?, column("scale_1")?];
    let thickness = vertices.has("scale_2").then(|| column("scale_2")).transpose()?;
    let first = columns(["f_dc_0", "f_dc_1", "f_dc_2"])?;
    let turn = [column("rot_0")?, column("rot_1")?, column("rot_2")?, column("rot_3")?];
    let opacity = column("opacity")?;
    let names = (0..).map(|n| format!("f_rest_{n}")).take_while(|name| vertices.has(name));
    let rest = names.map(|name| column(&name)).collect::<Result<Vec<_>, _>>()?;
    let whole = degree(rest.len())?;
    let (degree, third) = (whole.min(MAX_DEGREE), rest.len() / 3);
    let more = (degree + 1).pow(2) - 1;
    let mut read = Read { cloud: SplatCloud { degree, ..SplatCloud::default() }, remarks: Vec::new() };
    if degree < whole {
        read.remarks
            .push(format!("its colours are of degree {whole}, and those above degree {MAX_DEGREE} were left out"));
    }
    if thickness.is_none() {
        read.remarks.push("its splats have two scales: they were read as discs without thickness".into());
    }
    for row in file.rows(vertices) {
        let three = |of: [Column; 3]| of.map(|column| column.value(row));
        let [w, x, y, z] = turn.map(|column| column.value(row));
        let turn = Quaternion::new(w, x, y, z);
        // A rotation without length says nothing, and a splat that is a ball needs none.
        let rotation =
            if turn.norm() == 0.0 { UnitQuaternion::identity() } else { UnitQuaternion::from_quaternion(turn) };
        let [a, b] = scale.map(|column| column.value(row).exp());
        let c = thickness.map_or(THIN * a.min(b), |column| column.value(row).exp());
        read.cloud.splats.push(Splat {
            centre: Point3::from(three(place)),
            rotation,
            sigma: Vector3::new(a, b, c),
            opacity: 1.0 / (1.0 + (-opacity.value(row)).exp()),
        });
        read.cloud.harmonics.push(three(first));
        // All of red, then green, then blue.
        let coefficient = |k: usize| three([rest[k], rest[third + k], rest[2 * third + k]]);
        read.cloud.harmonics.extend((0..more).map(coefficient));
    }
    Ok(read)
}

/// The degree with so many coefficients beyond the first, three colours together.
pub(super) fn degree(rest: usize) -> Result<usize, String> {
    (0..=HIGHEST)
        .find(|degree| 3 * ((degree + 1).pow(2) - 1) == rest)
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
