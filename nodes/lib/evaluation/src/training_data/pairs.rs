//! All pairs of a training.

use cromosim_imu::Scheme;
use cromosim_learned::Pair;

use super::drawn::draw_wearers;
use super::recorded::recorded_pieces;
use super::source::{DataFolder, DataSource};
use crate::EvaluationError;
use crate::observer::Observer;

/// All pairs of data sources, in their order; motions differentiated by the spline. `seed` is the
/// training's.
///
/// # Errors
/// Files that cannot be read, and [`EvaluationError::Interrupted`].
pub fn training_pairs(
    sources: &[DataSource],
    seed: u64,
    data: &DataFolder,
    observer: &dyn Observer,
) -> Result<Vec<Pair>, EvaluationError> {
    let mut all = Vec::new();
    for (index, source) in sources.iter().enumerate() {
        if source.motions.is_empty() {
            for piece in recorded_pieces(source, data)? {
                all.push(piece.pair(&source.subject)?);
            }
        } else {
            let seed = seed.wrapping_mul(1_000_003).wrapping_add(index as u64);
            all.extend(draw_wearers(
                source,
                data,
                seed,
                observer,
                |worn, names| Ok(worn.pair(names, worn.motion(Scheme::Spline)?)?),
            )?);
        }
    }
    Ok(all)
}

/// Pairs that are learned from, and those of the validation subjects.
pub fn split_pairs(pairs: Vec<Pair>, validation: &[String]) -> (Vec<Pair>, Vec<Pair>) {
    pairs
        .into_iter()
        .partition(|pair| !validation.contains(&pair.subject))
}
