//! Where evaluations read from and write to.

use std::path::{Path, PathBuf};

use crate::files::refuse_existing;

/// The folder with the third-party data: what is given, else CROMOSIM_DATA, else ../shared/data.
pub fn data_folder(given: Option<&Path>) -> PathBuf {
    let stated = || std::env::var_os("CROMOSIM_DATA").map(PathBuf::from);
    given
        .map(Path::to_owned)
        .or_else(stated)
        .unwrap_or_else(|| PathBuf::from("../shared/data"))
}

/// Refuses a folder that holds results already, unless `force`.
pub fn refuse_results(out: &Path, names: &[&str], force: bool) -> anyhow::Result<()> {
    let mut places = names.iter().map(|name| out.join(name));
    places.try_for_each(|path| refuse_existing(&path, force))
}
