//! What an evaluation leaves in its folder.

use std::fs;
use std::path::Path;

use cromosim_charts::{Chart, Page};

use crate::EvaluationError;
use crate::error::At;

/// Width of pictures, pixels.
const WIDTH: u32 = 1600;

/// An evaluation's results, ready to be read.
pub struct Report {
    /// The tables, as Markdown.
    pub tables: String,
    /// Contents of further files by their names, results.json for example.
    pub texts: Vec<(&'static str, String)>,
    /// The page, report.html.
    pub page: Page,
    /// Pictures by their file's name.
    pub charts: Vec<(String, Chart)>,
}

impl Report {
    /// Writes report.html, the pictures as PNG, and the texts (tables.md among them) into a folder,
    /// which is created; each file whole or not at all.
    ///
    /// # Errors
    /// [`EvaluationError::CreateFolder`], [`EvaluationError::Write`], and those of pictures.
    pub fn write(&self, folder: &Path) -> Result<(), EvaluationError> {
        fs::create_dir_all(folder).map_err(|source| EvaluationError::CreateFolder {
            path: folder.to_owned(),
            source,
        })?;
        let put = |name: &str, bytes: &[u8]| {
            let (path, partial) = (folder.join(name), folder.join(format!(".{name}.partial")));
            fs::write(&partial, bytes)
                .and_then(|()| fs::rename(&partial, &path))
                .map_err(|source| EvaluationError::Write { path, source })
        };
        put("report.html", self.page.html().as_bytes())?;
        for (name, chart) in &self.charts {
            put(name, &chart.png(WIDTH).at(|| name.clone())?)?;
        }
        put("tables.md", self.tables.as_bytes())?;
        self.texts
            .iter()
            .try_for_each(|(name, text)| put(name, text.as_bytes()))
    }
}

/// A value as JSON with a line's end.
pub(crate) fn json(value: &impl serde::Serialize) -> Result<String, EvaluationError> {
    serde_json::to_string_pretty(value)
        .map(|text| text + "\n")
        .map_err(EvaluationError::Json)
}
