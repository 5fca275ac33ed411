//! A folder with the scan of a robot: one PLY file for each link.

use super::{SplatCloud, SplatError};
use std::path::Path;

/// The number of the hand, which moves with the flange of the seven-jointed arm that it belongs to.
const HAND: usize = 8;

/// Name of the file for a link; 0 is the base, 8 the hand.
pub fn link_file(link: usize) -> String {
    if link >= HAND { "hand.ply".into() } else { format!("link{link}.ply") }
}

/// The splats of every link that the folder has, each with the link's number: a name holds `link0` to `link7` or `hand`.
///
/// # Errors
/// [`SplatError`] when there is none, or one cannot be used.
pub fn read_links(folder: &Path) -> Result<Vec<(usize, SplatCloud)>, SplatError> {
    let read = |source| SplatError::Folder { path: folder.to_owned(), source };
    let mut files: Vec<_> = std::fs::read_dir(folder).map_err(read)?.filter_map(|e| Some(e.ok()?.path())).collect();
    files.sort();
    let mut out = Vec::new();
    for path in files.iter().filter(|path| path.extension().is_some_and(|e| e == "ply")) {
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or("");
        let link =
            (0..HAND).find(|link| name.contains(&format!("link{link}"))).or(name.contains("hand").then_some(HAND));
        if let Some(link) = link {
            out.push((link, SplatCloud::read(path)?));
        }
    }
    if out.is_empty() { Err(SplatError::NoLinks { folder: folder.to_owned() }) } else { Ok(out) }
}
