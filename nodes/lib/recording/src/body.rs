//! Whose body a bag's poses are of.

use std::sync::Arc;

use cromosim_bag::BagReader;
use cromosim_body::BodyModel;

use crate::RecordingError;

/// The body that a bag's SMPL messages are for: the given one, or the embedded one unless the bag's
/// metadata say that it was made on another.
///
/// # Errors
/// [`RecordingError::ForeignBody`].
pub fn body_for_bag(
    reader: &BagReader,
    given: Option<&Arc<BodyModel>>,
) -> Result<Arc<BodyModel>, RecordingError> {
    if let Some(model) = given {
        return Ok(model.clone());
    }
    let model = BodyModel::embedded();
    match reader
        .metadata("cromosim")
        .and_then(|values| values.get("body"))
    {
        Some(body) if body != model.id() => Err(RecordingError::ForeignBody {
            path: reader.path().to_owned(),
            body: body.clone(),
        }),
        _ => Ok(model),
    }
}
