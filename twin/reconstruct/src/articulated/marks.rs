//! Marks of a person or of a network in pictures of a scan, as a JSON file: docs/reconstruct.md says what stands in it.

use super::MarkedView;
use crate::scan::{Scan, ScanError, View};
use nalgebra::Isometry3;
use serde::Deserialize;
use shared_mem::budget::Budget;
use shared_mem::input;
use shared_mem::json;
use shared_mem::msg::image::PixelEncoding;
use shared_mem::recording::{Picture, read_picture};
use std::path::{Path, PathBuf};

/// Limits that a joint can have [rad or m].
const LIMITS: std::ops::RangeInclusive<f64> = -10.0..=10.0;

/// What was marked.
#[derive(Debug, Clone, PartialEq)]
pub struct Marks {
    /// Whether the part turns about the axis; else it slides along it.
    pub turns: bool,
    /// Least and largest position [rad or m]; 0 is the state of the scan.
    pub limits: [f64; 2],
    /// The scan whose pictures these are, where the file says it.
    pub scan: Option<PathBuf>,
    path: PathBuf,
    views: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    #[serde(rename = "type")]
    kind: Kind,
    limits: [f64; 2],
    scan: Option<PathBuf>,
    views: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Kind {
    Revolute,
    Prismatic,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    picture: String,
    mask: PathBuf,
    axis: Option<[[f64; 2]; 2]>,
}

impl Marks {
    /// Reads the file.
    ///
    /// # Errors
    /// [`ScanError`] in one line.
    pub fn read(path: &Path) -> Result<Self, ScanError> {
        let bytes = input::bytes(path, input::Kind::Configuration)?;
        let file: File = json::read(&bytes, &Budget::of(bytes.len() as u64))
            .map_err(|what| ScanError::content(path, format!("{what}; docs/reconstruct.md has its keys")))?;
        let [lower, upper] = file.limits;
        let fine =
            file.limits.iter().all(|limit| LIMITS.contains(limit)) && lower <= 0.0 && upper >= 0.0 && lower < upper;
        if !fine {
            let what = format!(
                "`limits` are [{lower}, {upper}]; give radians or metres around 0, which is the state of the scan"
            );
            return Err(ScanError::content(path, what));
        }
        let turns = matches!(file.kind, Kind::Revolute);
        let scan = file.scan.map(|scan| path.parent().unwrap_or(Path::new("")).join(scan));
        Ok(Self { turns, limits: file.limits, scan, path: path.to_owned(), views: file.views })
    }

    /// The marked pictures of a scan in metres, for a mesh in a frame of its own.
    ///
    /// # Errors
    /// [`ScanError`] when a picture is not in the scan, or a mask is missing, damaged or of another size.
    pub fn views(&self, scan: &Scan, mesh_from_scan: &Isometry3<f64>) -> Result<Vec<MarkedView>, ScanError> {
        let folder = self.path.parent().unwrap_or(Path::new(""));
        let view = |entry: &Entry| {
            let view = named(scan, &entry.picture).map_err(|what| ScanError::content(&self.path, what))?;
            Ok(MarkedView {
                name: view.name.clone(),
                camera: view.camera,
                mesh_from_camera: mesh_from_scan * view.scan_from_camera,
                part: mask(&folder.join(&entry.mask), [view.camera.width, view.camera.height])?,
                axis: entry.axis,
            })
        };
        self.views.iter().map(view).collect()
    }
}

/// The view of a picture: of its whole path, or of its name where no other has it.
fn named<'a>(scan: &'a Scan, picture: &str) -> Result<&'a View, String> {
    if let Some(view) = scan.views.iter().find(|view| view.name == picture) {
        return Ok(view);
    }
    let mut bare = scan.views.iter().filter(|view| Path::new(&view.name).file_name() == Some(picture.as_ref()));
    match (bare.next(), bare.next()) {
        (Some(view), None) => Ok(view),
        (Some(one), Some(other)) => {
            Err(format!("`{picture}` could be `{}` or `{}`: give the whole path", one.name, other.name))
        }
        (None, _) => Err(format!(
            "the scan {} has no picture `{picture}`; its first is `{}`",
            scan.folder.display(),
            scan.views.first().map_or("", |view| view.name.as_str())
        )),
    }
}

/// White pixels are the part.
fn mask(path: &Path, size: [u32; 2]) -> Result<Vec<bool>, ScanError> {
    let Picture::Pixels { header, pixels } = read_picture(path)? else {
        return Err(ScanError::content(path, "is neither a PNG nor a JPEG picture"));
    };
    if [header.width, header.height] != size || header.encoding != PixelEncoding::Rgb8 {
        let [width, height] = size;
        return Err(ScanError::content(path, format!("is no mask of {width} x {height} pixels with 8 bits a channel")));
    }
    Ok(pixels.chunks_exact(3).map(|pixel| pixel[0] >= 128).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn limits_that_leave_the_scan_out_and_keys_that_are_not_known_are_refused_in_one_line() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("marks.json");
        let read = |text: &str| {
            std::fs::write(&path, text).expect("a file");
            Marks::read(&path).map_err(|error| error.to_string())
        };
        let view = r#"{"picture": "a.png", "mask": "m.png", "axis": [[1, 2], [3, 4]]}"#;
        let fine = read(&format!(r#"{{"type": "revolute", "limits": [0, 1.5], "scan": "s", "views": [{view}]}}"#));
        assert_eq!(fine.map(|marks| (marks.turns, marks.scan)), Ok((true, Some(folder.path().join("s")))));
        for (text, said) in [
            (r#"{"type": "revolute", "limits": [0.5, 1.5], "views": []}"#, "around 0"),
            (r#"{"type": "ball", "limits": [0, 1.5], "views": []}"#, "ball"),
            (r#"{"type": "revolute", "limits": [0, 1], "views": [], "hinge": 1}"#, "hinge"),
        ] {
            let error = read(text).expect_err("not readable");
            assert!(error.contains(said) && !error.contains('\n'), "{error}");
        }
    }
}
