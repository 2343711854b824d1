//! Files, folders, patterns and lists, as the inputs that they stand for.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use crate::RecordingError;

/// Endings of motion files, which are taken from folders and patterns.
const ENDINGS: [&str; 10] = [
    "bvh", "amc", "mvnx", "c3d", "trc", "npz", "pkl", "joblib", "pt", "pth",
];
/// What AMASS has beside its motions: people's shapes.
const NO_MOTIONS: [&str; 3] = ["shape.npz", "neutral_stagei.npz", "neutral_stagei.pkl"];

/// One of many inputs.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BatchInput {
    /// The file.
    pub path: PathBuf,
    /// What its output is called, without an ending; below a folder or a pattern's fixed part with
    /// the folders between.
    pub name: String,
}

/// Whether an argument stands for any number of files: a folder, `@LIST`, or a pattern with `*`,
/// `?` or `[` that is no file's name.
pub fn is_of_many(argument: &Path) -> bool {
    let text = argument.to_string_lossy();
    argument.is_dir() || (!argument.exists() && (text.starts_with('@') || is_pattern(&text)))
}

fn is_pattern(text: &str) -> bool {
    text.contains(['*', '?', '['])
}

/// The inputs that arguments stand for, each once, in their order; those of a folder or pattern by
/// name. A list names a file, folder or pattern a line; empty lines and those that begin with `#`
/// are passed over.
///
/// # Errors
/// A folder or list that cannot be read, a pattern that is none, nothing found, and two files whose
/// outputs would have the same name.
pub fn expand(arguments: &[PathBuf]) -> Result<Vec<BatchInput>, RecordingError> {
    let mut found = Vec::new();
    for argument in arguments {
        let text = argument.to_string_lossy();
        match text.strip_prefix('@').filter(|_| !argument.exists()) {
            Some(list) => of_list(Path::new(list), &mut found)?,
            None => of_argument(argument, &mut found)?,
        }
    }
    let mut names: BTreeMap<&str, &Path> = BTreeMap::new();
    let mut is_new = Vec::with_capacity(found.len());
    for input in &found {
        let other = names.insert(&input.name, &input.path);
        is_new.push(other.is_none());
        if let Some(other) = other.filter(|other| *other != input.path) {
            return Err(RecordingError::SameOutput {
                files: [other.to_owned(), input.path.clone()],
                name: input.name.clone(),
            });
        }
    }
    drop(names);
    let mut is_new = is_new.into_iter();
    found.retain(|_| is_new.next().unwrap_or(true));
    Ok(found)
}

fn of_list(list: &Path, found: &mut Vec<BatchInput>) -> Result<(), RecordingError> {
    let text = cromosim_spatial::read_text(list).map_err(cannot_read(list))?;
    let lines = text.lines().map(str::trim);
    for line in lines.filter(|line| !line.is_empty() && !line.starts_with('#')) {
        of_argument(Path::new(line), found)?;
    }
    Ok(())
}

fn of_argument(argument: &Path, found: &mut Vec<BatchInput>) -> Result<(), RecordingError> {
    let text = argument.to_string_lossy();
    let before = found.len();
    if argument.is_dir() {
        let mut files = BTreeSet::new();
        walk(argument, &mut files, &mut BTreeSet::new())?;
        found.extend(files.into_iter().map(|path| below(argument, path)));
    } else if is_of_many(argument) {
        let unsuitable = |problem: String| RecordingError::Unsuitable {
            path: argument.to_owned(),
            problem,
        };
        let paths = glob::glob(&text).map_err(|error| unsuitable(error.to_string()))?;
        let fixed = fixed_part(argument);
        for path in paths {
            let path = path.map_err(|error| cannot_read(error.path())(error.into()))?;
            if path.is_file() && is_motion(&path) {
                found.push(below(&fixed, path));
            }
        }
    } else {
        let name = argument.file_stem().unwrap_or_default();
        found.push(BatchInput {
            path: argument.to_owned(),
            name: name.to_string_lossy().into_owned(),
        });
        return Ok(());
    }
    if found.len() == before {
        return Err(RecordingError::Unsuitable {
            path: argument.to_owned(),
            problem: format!("no motion file there (.{})", ENDINGS.join(", .")),
        });
    }
    Ok(())
}

/// The folders of a pattern before the first that is no name.
fn fixed_part(pattern: &Path) -> PathBuf {
    let parts = pattern.components();
    parts
        .take_while(|part| !is_pattern(&part.as_os_str().to_string_lossy()))
        .collect()
}

fn below(folder: &Path, path: PathBuf) -> BatchInput {
    let name = path
        .strip_prefix(folder)
        .unwrap_or(&path)
        .with_extension("");
    BatchInput {
        name: name.to_string_lossy().into_owned(),
        path,
    }
}

fn is_motion(path: &Path) -> bool {
    let ending = path.extension().unwrap_or_default();
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    ENDINGS
        .iter()
        .any(|known| ending.eq_ignore_ascii_case(known))
        && !NO_MOTIONS.contains(&name.as_ref())
        && !name.starts_with('.')
}

/// Motion files below a folder; `seen` are the folders that were looked at, so that links that
/// lead back end.
fn walk(
    folder: &Path,
    files: &mut BTreeSet<PathBuf>,
    seen: &mut BTreeSet<PathBuf>,
) -> Result<(), RecordingError> {
    let place = fs::canonicalize(folder).map_err(cannot_read(folder))?;
    if !seen.insert(place) {
        return Ok(());
    }
    for entry in fs::read_dir(folder).map_err(cannot_read(folder))? {
        let path = entry.map_err(cannot_read(folder))?.path();
        if path.is_dir() {
            walk(&path, files, seen)?;
        } else if path.is_file() && is_motion(&path) {
            files.insert(path);
        }
    }
    Ok(())
}

fn cannot_read(path: &Path) -> impl Fn(std::io::Error) -> RecordingError + use<> {
    let path = path.to_owned();
    move |source| RecordingError::Read {
        path: path.clone(),
        source,
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn folders_patterns_and_lists_stand_for_files() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in [
            "a/1.bvh",
            "a/b/1.bvh",
            "a/b/2.v2.npz",
            "a/shape.npz",
            "a/notes.txt",
            "c.trc",
        ] {
            fs::create_dir_all(at(name).parent().unwrap()).unwrap();
            fs::write(at(name), "").unwrap();
        }
        let names = |arguments: &[PathBuf]| -> Vec<String> {
            let inputs = expand(arguments).unwrap().into_iter();
            inputs.map(|input| input.name).collect()
        };
        let all = ["1", "b/1", "b/2.v2"];
        assert_eq!(names(&[at("a")]), all);
        assert_eq!(names(&[at("a/**/*")]), all);
        assert_eq!(names(&[at("*/*/*.bvh")]), ["a/b/1"]);
        let list = format!(
            "# ours\n{}\n\n{}\n",
            at("c.trc").display(),
            at("a").display()
        );
        fs::write(at("list.txt"), list).unwrap();
        let list = PathBuf::from(format!("@{}", at("list.txt").display()));
        assert_eq!(
            names(std::slice::from_ref(&list)),
            ["c", "1", "b/1", "b/2.v2"]
        );
        assert_eq!(names(&[list, at("c.trc")]).len(), 4, "each once");
        #[cfg(unix)]
        std::os::unix::fs::symlink(at("a"), at("a/b/back")).unwrap();
        assert_eq!(names(&[at("a")]), all, "links that lead back end");
    }

    #[test]
    fn what_stands_for_nothing_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        for name in ["a/1.bvh", "b/1.bvh"] {
            fs::create_dir_all(at(name).parent().unwrap()).unwrap();
            fs::write(at(name), "").unwrap();
        }
        fs::create_dir(at("empty")).unwrap();
        let refused = |arguments: &[PathBuf], words: &str| {
            let error = expand(arguments).unwrap_err().to_string();
            assert!(error.contains(words) && !error.contains('\n'), "{error}");
        };
        refused(&[at("empty")], "no motion file there");
        refused(&[at("*.c3d")], "no motion file there");
        refused(&[at("a[*.bvh")], "a[*.bvh");
        refused(&[PathBuf::from("@none.txt")], "none.txt: cannot be read");
        refused(&[at("a/1.bvh"), at("b/1.bvh")], "would both become 1");
    }
}
