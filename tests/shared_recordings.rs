//! Real recordings, which are not part of the project: they lie beside the workspace in `../shared/recordings`, or in the folder
//! that `THUD_SHARED` names; where they are absent the tests that need them say so and are skipped.

use std::path::{Path, PathBuf};

/// A file or folder of them; `None` and a word about it where there are none.
pub fn find(name: &str) -> Option<PathBuf> {
    let shared = std::env::var_os("THUD_SHARED")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared"), PathBuf::from);
    let folder = shared.join("recordings");
    if !folder.is_dir() {
        eprintln!("SKIPPED: the real recordings are not at {}", folder.display());
        return None;
    }
    Some(folder.join(name))
}
