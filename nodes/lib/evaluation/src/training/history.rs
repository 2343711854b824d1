//! A training's losses, step by step.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use cromosim_learned::train::Progress;

use crate::EvaluationError;

const HEAD: &str = "step,training_loss,validation_loss,learning_rate\n";

/// Losses by step, as CSV; a training that goes on goes on in its file.
pub(super) struct History {
    path: PathBuf,
    file: File,
}

impl History {
    /// Keeps the rows up to the step that a training goes on from; later rows come again.
    pub fn open(path: PathBuf, step: u64) -> Result<Self, EvaluationError> {
        match Self::kept(&path, step) {
            Ok(file) => Ok(Self { path, file }),
            Err(source) => Err(EvaluationError::Write { path, source }),
        }
    }

    fn kept(path: &Path, step: u64) -> io::Result<File> {
        let before = if step == 0 {
            String::new()
        } else {
            fs::read_to_string(path).unwrap_or_default()
        };
        let rows = before.lines().skip(1).filter(|row| {
            row.split(',')
                .next()
                .and_then(|cell| cell.parse::<u64>().ok())
                .is_some_and(|at| at <= step)
        });
        let text = rows.fold(HEAD.to_owned(), |text, row| text + row + "\n");
        fs::write(path, text)?;
        OpenOptions::new().append(true).open(path)
    }

    /// Adds a row.
    pub fn add(&mut self, progress: &Progress) -> Result<(), EvaluationError> {
        let Progress {
            step,
            loss,
            learning_rate,
            validation_loss,
            ..
        } = progress;
        writeln!(
            self.file,
            "{step},{loss},{},{learning_rate}",
            validation_loss.unwrap_or(f64::NAN)
        )
        .map_err(|source| EvaluationError::Write {
            path: self.path.clone(),
            source,
        })
    }
}
