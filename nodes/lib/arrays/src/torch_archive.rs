//! torch's zip archives.

use std::collections::HashMap;
use std::io::{Read, Seek};
use std::path::Path;

use zip::ZipArchive;

use crate::ArraysError;
use crate::blob::Blob;
use crate::error::invalid;
use crate::limits::{Budget, Limits};
use crate::npz::read_entry;
use crate::pickle;
use crate::value::Value;

/// A torch archive: `FOLDER/data.pkl`, and of each storage `FOLDER/data/KEY`.
pub(crate) fn read_torch<R: Read + Seek>(
    mut archive: ZipArchive<R>,
    pickle: &str,
    path: &Path,
    limits: Limits,
) -> Result<Value, ArraysError> {
    let folder = pickle.strip_suffix("data.pkl").unwrap_or_default();
    let mut left = limits.decoded_bytes;
    let mut read = |name: &str| -> Result<Option<Vec<u8>>, String> {
        let Some((bytes, whole)) = read_entry(&mut archive, name, left)
            .map_err(|error| format!("entry {name}: {error}"))?
        else {
            return Ok(None);
        };
        left = if whole {
            left - bytes.len() as u64
        } else {
            return Err(Budget::new(limits, 0).too_much());
        };
        Ok(Some(bytes))
    };
    let failed = |reason: String| ArraysError::Unreadable {
        path: path.to_owned(),
        key: pickle.to_owned(),
        source: invalid(reason),
    };
    if read(&format!("{folder}byteorder"))
        .map_err(failed)?
        .is_some_and(|order| order.starts_with(b"big"))
    {
        return Err(failed(
            "torch wrote it on a big-endian machine, which this reader does not know".to_owned(),
        ));
    }
    let content = Blob::from(
        read(pickle)
            .map_err(failed)?
            .ok_or_else(|| failed("missing".to_owned()))?,
    );
    let mut known: HashMap<String, Blob> = HashMap::new();
    let mut storage = |key: &str| -> Result<Blob, String> {
        if let Some(bytes) = known.get(key) {
            return Ok(bytes.clone());
        }
        let bytes = read(&format!("{folder}data/{key}"))?
            .ok_or_else(|| format!("storage {key} is missing"))?;
        let bytes = Blob::from(bytes);
        known.insert(key.to_owned(), bytes.clone());
        Ok(bytes)
    };
    let mut budget = Budget::new(limits, content.len() as u64);
    let value = pickle::read_zipped(&content, &mut budget, &mut storage);
    value.map_err(|fault| fault.into_error(path, pickle))
}
