//! Walls inside crates: no circle between files, functions that fit on a screen, files in a
//! sitting.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use crate::circles::circles;
use crate::modules::{Crate, Need};
use crate::source::{functions, tokens, without_tests};
use crate::{files_below, root};

/// Lines of a function with its signature, as rustfmt's defaults lay it out: one screen.
const LONGEST_FUNCTION: usize = 60;
/// Lines of a file with its tests.
const LONGEST_FILE: usize = 600;

/// The root files of all crates: `lib.rs`, `main.rs`.
fn crate_roots() -> Vec<String> {
    let mut roots: Vec<String> = ["nodes/lib", "nodes/bin", "msgs"]
        .into_iter()
        .flat_map(files_below)
        .filter(|file| file.ends_with("/src/lib.rs") || file.ends_with("/src/main.rs"))
        .collect();
    roots.push("nodes/bin/cromosim/main.rs".to_owned());
    roots
}

/// Every circle of a crate: its files, each with what it needs of the others.
fn circles_of(root: &Path) -> Vec<String> {
    let read = Crate::read(root);
    let needs = read.needs();
    let edges: Vec<(usize, usize)> = needs.iter().map(|need| (need.from, need.to)).collect();
    let name = |file: usize| read.files[file].display();
    let describe = |circle: &Vec<usize>| {
        let mut text = format!("a circle of {} files:\n", circle.len());
        for from in circle {
            text += &format!("  {}\n", name(*from));
            for to in circle {
                let of_pair = |need: &&Need| need.from == *from && need.to == *to;
                let taken: BTreeSet<&str> = needs
                    .iter()
                    .filter(of_pair)
                    .map(|need| need.name.as_str())
                    .collect();
                if !taken.is_empty() {
                    text += &format!("    needs {} for {taken:?}\n", name(*to));
                }
            }
        }
        text
    };
    circles(read.files.len(), &edges)
        .iter()
        .map(describe)
        .collect()
}

/// No file needs another that needs it, be it by a third: names in `use` declarations and paths,
/// and methods of a type whose implementation stands in several files. Declaring a module and
/// re-exporting its items (`pub use`) is no need; tests are not looked at.
#[test]
fn no_file_needs_another_that_needs_it() {
    let mut found = Vec::new();
    for file in crate_roots() {
        found.extend(circles_of(&root().join(file)));
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// A crate in a folder of its own, from its files' names and texts.
fn write_crate(name: &str, files: &[(&str, &str)]) -> std::path::PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    for (file, text) in files {
        let path = folder.join(file);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    folder.join("lib.rs")
}

#[test]
fn a_circle_is_seen_through_imports_paths_and_methods() {
    let by_import = write_crate(
        "by_import",
        &[
            ("lib.rs", "mod a;\nmod b;\nmod c;\npub use a::A;"),
            (
                "a.rs",
                "use crate::b::{self, B as Other};\npub struct A(Other);",
            ),
            (
                "b.rs",
                "pub struct B;\nfn f() -> usize { super::c::count() }",
            ),
            ("c.rs", "pub fn count() -> usize { size_of::<crate::A>() }"),
        ],
    );
    let found = circles_of(&by_import);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!(found[0].starts_with("a circle of 3 files"), "{found:?}");
    let by_method = write_crate(
        "by_method",
        &[
            ("lib.rs", "mod home;\nmod away;"),
            (
                "home.rs",
                "pub struct T;\nimpl T { fn f(&self) { self.g() } }",
            ),
            (
                "away.rs",
                "use crate::home::T;\nimpl T { pub fn g(&self) {} }",
            ),
        ],
    );
    assert_eq!(circles_of(&by_method).len(), 1);
}

#[test]
fn declarations_reexports_comments_and_tests_are_no_needs() {
    let tree = write_crate(
        "tree",
        &[
            ("lib.rs", "mod inner;\nmod leaf;\npub use inner::Twig;"),
            (
                "inner/mod.rs",
                "mod twig;\npub use twig::Twig;\n#[cfg(test)]\nmod tests { use super::twig::*; }",
            ),
            (
                "inner/twig.rs",
                "//! See [`crate::Twig`].\nuse crate::leaf::Leaf; // crate::inner\npub struct Twig(Leaf);",
            ),
            (
                "leaf.rs",
                "pub struct Leaf;\n#[cfg(test)]\nuse crate::Twig;\nconst TEXT: &str = \"crate::Twig\";",
            ),
        ],
    );
    assert_eq!(circles_of(&tree), [""; 0]);
    let needs = Crate::read(&tree).needs();
    assert_eq!(
        needs.len(),
        1,
        "the twig needs the leaf, and that is all: {needs:?}"
    );
}

/// Rust files that are shipped, not tests or benchmarks.
fn production_files() -> Vec<String> {
    let aside = [
        "/tests/",
        "/benches/",
        "/examples/",
        "/tests.rs",
        "_tests.rs",
    ];
    ["nodes", "msgs"]
        .into_iter()
        .flat_map(files_below)
        .filter(|file| file.ends_with(".rs") && !aside.iter().any(|part| file.contains(part)))
        .collect()
}

#[test]
fn functions_fit_on_a_screen() {
    let mut long = Vec::new();
    for file in production_files() {
        let text = fs::read_to_string(root().join(&file)).unwrap();
        for function in functions(&without_tests(tokens(&text))) {
            if function.lines > LONGEST_FUNCTION {
                let (line, name, lines) = (function.line, function.name, function.lines);
                long.push(format!("{file}:{line} {name}: {lines} lines"));
            }
        }
    }
    assert!(
        long.is_empty(),
        "at most {LONGEST_FUNCTION} lines a function:\n{}",
        long.join("\n")
    );
}

#[test]
fn functions_are_measured_from_their_name_to_their_end() {
    let text = "#[inline]\nfn short() -> [u8; 2] { [b'{', 1] }\n\n#[test]\nfn left_out() {\n}\n\
                impl A {\n    pub fn long<'a>(\n        x: &'a str,\n    ) {\n        r#\"}\"#;\n        '}';\n    }\n}\ntrait T { fn none(&self); }";
    let found = functions(&without_tests(tokens(text)));
    let found: Vec<_> = found
        .iter()
        .map(|f| (f.name.as_str(), f.line, f.lines))
        .collect();
    assert_eq!(found, [("short", 2, 1), ("long", 8, 6)]);
}

#[test]
fn files_are_read_in_a_sitting() {
    let long: Vec<String> = ["nodes", "msgs", "tests"]
        .into_iter()
        .flat_map(files_below)
        // What the fuzz targets' build made is nobody's reading.
        .filter(|file| file.ends_with(".rs") && !file.starts_with("tests/fuzz/target/"))
        .map(|file| {
            let text = fs::read_to_string(root().join(&file)).unwrap();
            (text.lines().count(), file)
        })
        .filter(|(lines, file)| *lines > LONGEST_FILE && !STILL_LONG_FILES.contains(&file.as_str()))
        .map(|(lines, file)| format!("{file}: {lines} lines"))
        .collect();
    assert!(
        long.is_empty(),
        "at most {LONGEST_FILE} lines a file:\n{}",
        long.join("\n")
    );
}

/// Files that are not divided yet.
const STILL_LONG_FILES: &[&str] = &[];
