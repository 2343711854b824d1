//! Files by patterns with `*` in their names.

use std::path::{Path, PathBuf};

use crate::EvaluationError;

/// The files that patterns name, relative to a folder; those of one pattern in alphabetical order.
pub(crate) fn matching_files(
    patterns: &[String],
    folder: &Path,
) -> Result<Vec<PathBuf>, EvaluationError> {
    let mut found = Vec::new();
    for pattern in patterns {
        let path = folder.join(pattern);
        if !pattern.contains('*') {
            found.push(path);
            continue;
        }
        let parent = match path.parent().unwrap_or(folder) {
            empty if empty.as_os_str().is_empty() => Path::new("."),
            parent => parent,
        };
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        let entries = std::fs::read_dir(parent).map_err(|source| EvaluationError::Read {
            path: parent.to_owned(),
            source,
        })?;
        let mut matching: Vec<PathBuf> = entries
            .filter_map(|entry| Some(entry.ok()?.path()))
            .filter(|path| {
                path.file_name()
                    .is_some_and(|own| matches(&name, &own.to_string_lossy()))
            })
            .collect();
        if matching.is_empty() {
            return Err(EvaluationError::NoMatch {
                folder: parent.to_owned(),
                pattern: name.into_owned(),
            });
        }
        matching.sort();
        found.extend(matching);
    }
    Ok(found)
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
