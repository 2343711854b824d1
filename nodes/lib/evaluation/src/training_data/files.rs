//! Files by patterns with `*` in their names.

use std::fs::ReadDir;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::EvaluationError;
use crate::wanted::not_there;

/// The files that patterns name, relative to a folder; those of one pattern in alphabetical order.
pub(crate) fn matching_files(
    patterns: &[String],
    folder: &Path,
) -> Result<Vec<PathBuf>, EvaluationError> {
    let mut found = Vec::new();
    for pattern in patterns {
        let path = folder.join(pattern);
        if !pattern.contains('*') {
            if !path.exists() {
                return Err(not_there(&path, "not there"));
            }
            found.push(path);
            continue;
        }
        let parent = match path.parent().unwrap_or(folder) {
            empty if empty.as_os_str().is_empty() => Path::new("."),
            parent => parent,
        };
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let entries = entries(parent)?;
        let mut matching: Vec<PathBuf> = entries
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| {
                path.file_name()
                    .is_some_and(|own| matches(&name, &own.to_string_lossy()))
            })
            .collect();
        if matching.is_empty() {
            return Err(not_there(parent, &format!("no file matches {name}")));
        }
        matching.sort();
        found.extend(matching);
    }
    Ok(found)
}

/// What is in a folder of the data.
pub(crate) fn entries(folder: &Path) -> Result<ReadDir, EvaluationError> {
    std::fs::read_dir(folder).map_err(|source| match source.kind() {
        ErrorKind::NotFound => not_there(folder, "not there"),
        _ => EvaluationError::Read {
            path: folder.to_owned(),
            source,
        },
    })
}

/// Whether a name is the pattern with any text in place of each `*`.
fn matches(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((head, rest)) => {
            let Some(tail) = name.strip_prefix(head) else {
                return false;
            };
            (0..=tail.len())
                .filter(|at| tail.is_char_boundary(*at))
                .any(|at| matches(rest, &tail[at..]))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn patterns_match_names() {
        for (pattern, name, expected) in [
            ("02_*.npz", "02_01.npz", true),
            ("02_*.npz", "03_01.npz", false),
            ("*", "a", true),
            ("a*b*c", "abc", true),
            ("a*b", "ac", false),
        ] {
            assert_eq!(matches(pattern, name), expected, "{pattern} {name}");
        }
    }
}
