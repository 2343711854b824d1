//! From a file to a motion, by the file's content.

use std::fs::File;
use std::io::Read;
use std::path::Path;
use std::sync::Arc;

use cromosim_body::BodyModel;

use crate::bvh::shortened;
use crate::{MotionError, MotionOptions, SmplMotion, parse_bvh, retarget};

/// Larger files are refused: a thousand hours of BVH at 120 Hz are smaller.
const MAX_BYTES: u64 = 4 << 30;

/// Reads a motion file and retargets it to the embedded body. What the file is, is told by its content, not by its name's ending: BVH
/// begins with HIERARCHY.
///
/// # Errors
/// One line that names the file and the place: unreadable, no motion file, wrong content ([`MotionError`]).
pub fn read_motion(path: &Path, options: &MotionOptions) -> Result<SmplMotion, MotionError> {
    read_motion_for(path, &BodyModel::embedded(), options)
}

/// As [`read_motion`], for another body.
///
/// # Errors
/// As [`read_motion`].
pub fn read_motion_for(path: &Path, body: &Arc<BodyModel>, options: &MotionOptions) -> Result<SmplMotion, MotionError> {
    let bytes = read_bytes(path)?;
    let text = String::from_utf8_lossy(&bytes);
    let start = text.trim_start_matches('\u{feff}').trim_start();
    if !start.get(..9).is_some_and(|word| word.eq_ignore_ascii_case("HIERARCHY")) {
        let found =
            if bytes.is_empty() { "an empty file".to_owned() } else { format!("\"{}\"", shortened(start.get(..60).unwrap_or(start))) };
        return Err(MotionError::UnknownFormat { path: path.to_owned(), found });
    }
    let clip = parse_bvh(&text, &path.display().to_string())?;
    retarget(&clip, body, options)?.slice(options.start_s, options.duration_s)
}

fn read_bytes(path: &Path) -> Result<Vec<u8>, MotionError> {
    let unreadable = |source| MotionError::Read { path: path.to_owned(), source };
    let file = File::open(path).map_err(unreadable)?;
    let bytes = file.metadata().map_err(unreadable)?.len();
    if bytes > MAX_BYTES {
        return Err(MotionError::TooLarge { path: path.to_owned(), bytes, limit: MAX_BYTES });
    }
    // A pipe or device says that it has no bytes: the limit holds for what comes out of it, too.
    let mut content = Vec::new();
    file.take(MAX_BYTES + 1).read_to_end(&mut content).map_err(unreadable)?;
    if content.len() as u64 > MAX_BYTES {
        return Err(MotionError::TooLarge { path: path.to_owned(), bytes: content.len() as u64, limit: MAX_BYTES });
    }
    Ok(content)
}
