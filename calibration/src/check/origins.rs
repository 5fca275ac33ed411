//! Where the clips come from: those of two sources are no session of one cell.

use super::remark::{Fault, Remark};
use shared_mem::recording::{Clip, Provenance};

/// Where clips come from, each with its file.
pub(super) fn provenance(clips: &[(String, Clip)]) -> Provenance {
    Provenance::of_clips(clips.iter().map(|(file, clip)| (file.as_str(), &clip.origins)))
}

/// What there is to say about clips of several sources.
pub(super) fn remark(clips: &[(String, Clip)]) -> Option<Remark> {
    let mixture = provenance(clips).mixture()?;
    let files = clips.iter().filter(|(_, clip)| !clip.origins.is_unknown()).map(|(file, _)| file.clone()).collect();
    let what = format!("the clips come from several cells ({mixture})");
    let remedy =
        "keep the clips of each in a session of its own, or say with `--mix` that they are to be taken together";
    Some(Remark { clips: files, ..Remark::new(Fault::MixedOrigins, "", "origin", what).mended_by(remedy) })
}
