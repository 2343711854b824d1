//! People and devices that are drawn at random, on motions of a data source.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use cromosim_body::BodyModel;
use cromosim_imu::Placement;
use cromosim_learned::{DrawnWearer, PairNames, WearerRanges};
use rayon::prelude::*;

use super::clips::read_motion_clip;
use super::source::{DataFolder, DataSource};
use crate::EvaluationError;
use crate::error::At;
use crate::observer::{self, Observer};
use crate::seeds::mixed_seed;

/// The rate that placements of drawn devices stand for, Hz.
const RATE_HZ: f64 = 100.0;

/// Draws people and devices of a source, and makes something of each; motions are worked on in
/// parallel, the order of the result is that of the files.
///
/// # Errors
/// Files that cannot be read, sites that the body does not have, what `make` refuses, and
/// [`EvaluationError::Interrupted`].
pub fn draw_wearers<T: Send>(
    source: &DataSource,
    data: &DataFolder,
    seed: u64,
    observer: &dyn Observer,
    make: impl Fn(DrawnWearer, PairNames) -> Result<T, EvaluationError> + Sync,
) -> Result<Vec<T>, EvaluationError> {
    let files = source.motion_files(&data.folder)?;
    let draws = Draws {
        source,
        skeleton_map: data.skeleton_map.as_deref(),
        model: data.model(),
        placements: source
            .sites
            .iter()
            .map(|site| placement_at(site))
            .collect::<Result<_, _>>()?,
        wearing: source.wearing(),
        seed,
    };
    observer.begin(
        &format!("subject {}, motions", source.subject),
        files.len() as u64,
    );
    let one = |(number, path): (usize, &PathBuf)| -> Result<Vec<T>, EvaluationError> {
        observer::check(observer)?;
        let made = draws.on_motion(number, path, &make)?;
        observer.advance(1);
        Ok(made)
    };
    let made: Result<Vec<Vec<T>>, EvaluationError> =
        files.par_iter().enumerate().map(one).collect();
    observer.end();
    Ok(made?.into_iter().flatten().collect())
}

/// What all draws of a source share.
struct Draws<'a> {
    source: &'a DataSource,
    skeleton_map: Option<&'a str>,
    model: Arc<BodyModel>,
    placements: Vec<Placement>,
    wearing: WearerRanges,
    seed: u64,
}

impl Draws<'_> {
    /// All draws on one motion file; `number` is its place among the source's files.
    fn on_motion<T>(
        &self,
        number: usize,
        path: &Path,
        make: impl Fn(DrawnWearer, PairNames) -> Result<T, EvaluationError>,
    ) -> Result<Vec<T>, EvaluationError> {
        let motion = read_motion_clip(path, &self.model, self.skeleton_map)?;
        let mut made = Vec::new();
        for (index, placement) in self.placements.iter().enumerate() {
            for repeat in 0..self.source.repeats {
                let names = PairNames {
                    name: format!("{} {} {repeat}", motion.name, placement.name()),
                    subject: self.source.subject.clone(),
                    position: placement.name().to_owned(),
                };
                let seed = mixed_seed(&[self.seed, number as u64, index as u64, repeat]);
                let worn = self
                    .wearing
                    .draw(&self.model, &motion.known(), placement, seed)
                    .at(|| format!("{}, site {}", path.display(), placement.name()))?;
                made.push(make(worn, names).at(|| path.display().to_string())?);
            }
        }
        Ok(made)
    }
}

/// A placement named as its site.
fn placement_at(site: &str) -> Result<Placement, EvaluationError> {
    Placement::at_site(site, site, RATE_HZ).map_err(|(field, problem)| EvaluationError::Site {
        site: site.to_owned(),
        field,
        problem: problem.to_string(),
    })
}
