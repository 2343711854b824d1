//! How far simulators are from measured IMUs: root mean square errors on people and positions that
//! no network has seen, and of rigid bodies whose readings are known or measured.

mod cases;
mod errors;
mod imusim;
mod method;
mod practice;
mod protocol;
mod results;
mod rigid;
mod tables;
mod truth_source;

use std::path::PathBuf;

use cromosim_learned::{LearnedSimulator, MappingFile};
use rayon::prelude::*;

pub use method::Method;
pub use protocol::{Protocol, Study};
pub use results::{FidelityResults, MethodResults, PositionResults, StudyResults};
pub use rigid::{
    AnalyticSource, PhysicsSource, PictureResults, PoseErrors, PracticeResults, RigidMethodResults,
    RigidPartResults, RigidPicture, RigidStudy, RigidStudyResults, SeenResults, StatedResults,
};
pub use truth_source::TruthSource;

use crate::EvaluationError;
use crate::observer::{self, Observer};
use crate::training_data::{DataFolder, DataSource};
use crate::wanted::not_there;
use cases::Case;
use errors::SquaredErrors;
use rigid::{RigidOutcome, check_recordings, run_rigid_study};

/// What a comparison is run on.
pub struct FidelityOptions {
    /// Where the protocol's files are, and the body.
    pub data: DataFolder,
    /// A folder of models that `cromosim train` wrote, by the protocol's names; without, the models
    /// that come with the suite.
    pub models: Option<PathBuf>,
    /// One draw of person and device for each motion and site.
    pub quick: bool,
}

/// Scores all methods on all recordings of a protocol.
///
/// # Errors
/// Files that cannot be read, and [`EvaluationError::Interrupted`].
pub fn evaluate_fidelity(
    protocol: &Protocol,
    options: &FidelityOptions,
    observer: &dyn Observer,
) -> Result<FidelityResults, EvaluationError> {
    for study in &protocol.rigid {
        check_recordings(study, &options.data)?;
    }
    let mut results = FidelityResults::new(protocol, options.quick);
    for study in &protocol.studies {
        if study.optional && !options.data.folder.is_dir() {
            let folder = options.data.folder.display();
            let sources = study.test.iter();
            let mut files =
                sources.flat_map(|source| source.motions.iter().chain(&source.recordings));
            let wanted = files.next().map(|file| options.data.folder.join(file));
            let reason = wanted.map_or_else(
                || format!("no folder {folder}"),
                |file| not_there(&file, &format!("no folder {folder}")).to_string(),
            );
            results.skip(&study.name, &reason);
            continue;
        }
        let scored = run_study(study, protocol.seed, options, observer)?;
        results.studies.push(scored);
    }
    let (data, seed) = (&options.data, protocol.seed);
    for study in &protocol.rigid {
        match run_rigid_study(study, data, seed, options.quick, observer)? {
            RigidOutcome::Scored(scored) => results.rigid.push(*scored),
            RigidOutcome::Skipped(reason) => results.skip(&study.name, &reason),
        }
    }
    Ok(results)
}

/// All methods on all recordings of a study.
fn run_study(
    study: &Study,
    seed: u64,
    options: &FidelityOptions,
    observer: &dyn Observer,
) -> Result<StudyResults, EvaluationError> {
    let learned = match &options.models {
        _ if study.model == "none" => None,
        Some(folder) => Some(LearnedSimulator::read(&folder.join(&study.model))?),
        None => Some(LearnedSimulator::named(&study.model)?),
    };
    let cases = |sources: &[DataSource], seed: u64| {
        cases::cases(sources, &options.data, seed, options.quick, observer)
    };
    let test = cases(&study.test, seed)?;
    let mapping = match &learned {
        Some(networks) => {
            cases::fit_mapping(&cases(&study.mapping, seed.wrapping_add(1))?, networks)?
        }
        None => MappingFile::default(),
    };
    observer.begin(
        &format!("study {}, recordings", study.name),
        test.len() as u64,
    );
    let one = |case: &Case| -> Result<Vec<Option<SquaredErrors>>, EvaluationError> {
        observer::check(observer)?;
        let errors = |method: Method| {
            let readings = case.simulate(method, learned.as_ref(), &mapping)?;
            Ok(readings.map(|readings| SquaredErrors::between(&readings, case.measured())))
        };
        let errors = Method::ALL
            .into_iter()
            .map(errors)
            .collect::<Result<_, EvaluationError>>()?;
        observer.advance(1);
        Ok(errors)
    };
    let errors: Vec<Vec<Option<SquaredErrors>>> = test
        .par_iter()
        .map(one)
        .collect::<Result<_, EvaluationError>>()?;
    observer.end();
    Ok(StudyResults::new(study, &test, &errors, seed))
}
