//! Files beside a cell.toml, as it may name them.

use std::path::{Path, PathBuf};

/// A path as cell.toml `out` may name it: from its folder where the file lies there or below, else from anywhere.
pub(super) fn relative(path: &Path, out: &Path) -> PathBuf {
    let folder = out.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let whole =
        |path: &Path| path.canonicalize().or_else(|_| std::path::absolute(path)).unwrap_or_else(|_| path.to_owned());
    let path = whole(path);
    path.strip_prefix(whole(folder)).map_or_else(|_| path.clone(), Path::to_owned)
}
