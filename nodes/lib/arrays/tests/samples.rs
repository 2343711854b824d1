//! Files as tools write them.
#![allow(clippy::unwrap_used, missing_docs)]
use cromosim_arrays::{Container, Entry, Value};
use std::path::Path;

fn walk(entry: &Entry, out: &mut String, depth: usize) {
    out.push_str(&format!("{} = {:?}\n", entry.key(), entry.value()));
    if depth > 8 {
        return;
    }
    if let Ok(pairs) = entry.pairs() {
        pairs.iter().for_each(|(_, e)| walk(e, out, depth + 1));
    } else if matches!(entry.value(), Value::List(_) | Value::Tuple(_)) {
        entry.items().unwrap().iter().for_each(|e| walk(e, out, depth + 1));
    }
}

#[test]
fn all() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data");
    for file in std::fs::read_dir(folder).unwrap() {
        let path = file.unwrap().path();
        let mut out = String::new();
        match Container::open(&path) {
            Ok(mut c) => match c.root() {
                Ok(r) => walk(&r, &mut out, 0),
                Err(e) => out = e.to_string(),
            },
            Err(e) => out = format!("FAILED {e}"),
        }
        println!("== {}\n{out}", path.file_name().unwrap().to_string_lossy());
    }
}
