//! How a study of rigid bodies is run.

use std::path::PathBuf;

use rayon::prelude::*;

use super::case::{CaseErrors, RigidCase, Seen, analytic_cases, physics_cases, recorded_cases};
use super::definition::RigidStudy;
use super::method::RigidMethod;
use super::picture::PictureResults;
use super::pose_errors::PoseErrors;
use super::results::RigidStudyResults;
use crate::EvaluationError;
use crate::observer::{self, Observer};
use crate::training_data::{DataFolder, matching_files};

/// Where `quick`, so many recordings of a study.
const QUICK_RECORDINGS: usize = 2;

/// What became of a study.
pub(in crate::fidelity) enum RigidOutcome {
    /// It was run.
    Scored(Box<RigidStudyResults>),
    /// It was not, and why.
    Skipped(String),
}

/// Whether all recordings are there that a study must have: said before any other study is run.
///
/// # Errors
/// The first one that cannot be read.
pub(in crate::fidelity) fn check_recordings(
    study: &RigidStudy,
    data: &DataFolder,
) -> Result<(), EvaluationError> {
    if study.optional || study.recordings.is_empty() {
        return Ok(());
    }
    files(study, data).map(|_| ())
}

/// All methods on all bodies of a study.
///
/// # Errors
/// Files that cannot be read where the study is not optional, and [`EvaluationError::Interrupted`].
pub(in crate::fidelity) fn run_rigid_study(
    study: &RigidStudy,
    data: &DataFolder,
    seed: u64,
    quick: bool,
    observer: &dyn Observer,
) -> Result<RigidOutcome, EvaluationError> {
    let seen = |errors: PoseErrors, rate_hz: f64, repeats: u64| Seen {
        errors,
        rate_hz,
        repeats: if quick { 1 } else { repeats },
        seed,
        quick,
    };
    let cases = match (&study.physics, &study.analytic) {
        (Some(source), _) => physics_cases(seen(source.errors, source.rate_hz, source.repeats))?,
        (_, Some(source)) => analytic_cases(seen(source.errors, source.rate_hz, source.repeats))?,
        _ => match files(study, data) {
            Err(error) if study.optional => return Ok(RigidOutcome::Skipped(error.to_string())),
            found => recordings(&found?, quick)?,
        },
    };
    if cases.is_empty() {
        let reason = "no recording has poses without a gap for long enough".to_owned();
        return Ok(RigidOutcome::Skipped(reason));
    }
    let rate_hz = cases
        .iter()
        .map(RigidCase::rate_hz)
        .fold(f64::INFINITY, f64::min);
    let methods = RigidMethod::all(rate_hz);
    let steps = cases.len() as u64;
    observer.begin(&format!("study {}, bodies", study.name), steps);
    let one = |case: &RigidCase| -> Result<Vec<CaseErrors>, EvaluationError> {
        observer::check(observer)?;
        let errors = methods.iter().map(|method| case.errors(*method)).collect();
        observer.advance(1);
        errors
    };
    let errors: Vec<Vec<CaseErrors>> = cases.par_iter().map(one).collect::<Result<_, _>>()?;
    observer.end();
    let mut results = RigidStudyResults::new(study, &cases, &methods, &errors, seed);
    let wanted = study
        .physics
        .as_ref()
        .and_then(|source| source.picture.as_ref());
    if let Some(wanted) = wanted {
        results.picture = PictureResults::new(wanted, &cases, results.practice.cutoff_hz)?;
    }
    Ok(RigidOutcome::Scored(Box::new(results)))
}

/// The recordings' files, all of which are there.
fn files(study: &RigidStudy, data: &DataFolder) -> Result<Vec<PathBuf>, EvaluationError> {
    let files = matching_files(&study.recordings, &data.folder)?;
    for path in &files {
        std::fs::metadata(path).map_err(|source| EvaluationError::Read {
            path: path.clone(),
            source,
        })?;
    }
    Ok(files)
}

fn recordings(files: &[PathBuf], quick: bool) -> Result<Vec<RigidCase>, EvaluationError> {
    let count = if quick { QUICK_RECORDINGS } else { files.len() };
    let cases: Vec<Vec<RigidCase>> = files
        .par_iter()
        .take(count)
        .map(|path| recorded_cases(path))
        .collect::<Result<_, _>>()?;
    Ok(cases.into_iter().flatten().collect())
}
