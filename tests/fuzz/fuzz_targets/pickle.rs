//! Any container of arrays: what it is, its values, and every accessor on a few of them.
#![no_main]

use std::io::Cursor;
use std::path::Path;

use cromosim_arrays::{Container, Entry, Limits, Value};
use libfuzzer_sys::fuzz_target;

fn walk(entry: &Entry, left: &mut usize) {
    *left = left.saturating_sub(1);
    if *left == 0 {
        return;
    }
    let _ = (entry.text(), entry.texts(), entry.float(), entry.integer(), entry.shape());
    match entry.value() {
        Value::Dict(_) => entry.pairs().into_iter().flatten().for_each(|(_, child)| walk(&child, left)),
        Value::List(_) | Value::Tuple(_) => entry.items().into_iter().flatten().for_each(|child| walk(&child, left)),
        _ => {
            if let Ok(shape) = entry.shape() {
                let any = vec![None; shape.len()];
                let _ = (entry.floats(&any, "any"), entry.integers(&any, "any"));
            }
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let limits = Limits { decoded_bytes: 64 << 20, opcodes: 1_000_000, ..Limits::default() };
    if let Ok(mut container) = Container::new(Cursor::new(bytes), Path::new("fuzz.pkl"), limits)
        && let Ok(root) = container.root()
    {
        walk(&root, &mut 100);
    }
    // With entries that are skipped, whatever they hold.
    let skipped: &[&[&str]] = &[&["a", "b"], &["stageii_debug_details", "cfg"]];
    if let Ok(mut container) = Container::without(Cursor::new(bytes), Path::new("fuzz.pkl"), limits, skipped)
        && let Ok(root) = container.root()
    {
        walk(&root, &mut 100);
    }
});
