//! What an evaluation leaves in its folder.

use std::fs;
use std::path::Path;

use anyhow::Context;
use cromosim_charts::{Chart, Page};

/// Width of pictures, pixels.
const WIDTH: u32 = 1600;

/// Texts by name, report.html, and the pictures as PNG.
pub fn write(
    folder: &Path,
    texts: &[(&str, String)],
    page: &Page,
    charts: &[(String, Chart)],
) -> anyhow::Result<()> {
    fs::create_dir_all(folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
    // Whole or not at all, each of them.
    let put = |name: &str, bytes: &[u8]| {
        let (place, partial) = (folder.join(name), folder.join(format!(".{name}.partial")));
        let written = fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, &place));
        written.with_context(|| format!("{}: cannot be written", place.display()))
    };
    put("report.html", page.html().as_bytes())?;
    for (name, chart) in charts {
        put(name, &chart.png(WIDTH).with_context(|| name.clone())?)?;
    }
    texts
        .iter()
        .try_for_each(|(name, text)| put(name, text.as_bytes()))
}
