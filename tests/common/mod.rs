//! What the tests of the whole suite share.
#![allow(dead_code)]

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use cromosim_learned::{Direction, Input, LearnedSimulator, Network, NetworkShape};

/// The command line program under test.
pub const CROMOSIM: &str = env!("CARGO_BIN_EXE_cromosim");

/// Runs `cromosim` in a folder and waits.
pub fn cromosim_in(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(CROMOSIM)
        .args(arguments)
        .current_dir(folder)
        .output()
        .expect("cromosim starts")
}

/// Runs `cromosim`, which must succeed; gives its standard output.
pub fn succeed(folder: &Path, arguments: &[&str]) -> String {
    let output = cromosim_in(folder, arguments);
    assert!(
        output.status.success(),
        "cromosim {arguments:?} failed: {}",
        text(&output)
    );
    String::from_utf8_lossy(&output.stdout).into_owned()
}

/// Runs `cromosim`, which must refuse: exit code 2, and one line with these words.
pub fn refuses(folder: &Path, arguments: &[&str], words: &[&str]) {
    let output = cromosim_in(folder, arguments);
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(
        output.status.code(),
        Some(2),
        "{arguments:?}: {}",
        text(&output)
    );
    assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    assert!(
        words.iter().all(|word| said.contains(word)),
        "{arguments:?}: {said}"
    );
}

/// Random networks that say much, in a new folder.
pub fn write_networks(input: Input, folder: &Path) {
    let direction = if input == Input::Streaming {
        Direction::Forward
    } else {
        Direction::Both
    };
    let inputs = input.channels();
    let shape = NetworkShape {
        inputs,
        channels: 12,
        kernel: 5,
        convolutions: 3,
        hidden: 16,
        layers: 2,
        direction,
        outputs: 3,
    };
    let network = |seed| Network::new(shape.clone(), seed).expect("a sound shape");
    std::fs::create_dir(folder).expect("a new folder");
    let simulator =
        LearnedSimulator::new(input, [network(1), network(2)]).expect("networks that fit");
    simulator
        .write(folder, &BTreeMap::new())
        .expect("files that can be written");
}

/// Both outputs.
pub fn text(output: &Output) -> String {
    format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    )
}

/// The repository.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Says that a test cannot run here; with CROMOSIM_REQUIRE_ALL=1 that is a failure.
pub fn skipped(why: &str) {
    // Past the test harness, which swallows what passing tests print.
    let _ = writeln!(std::io::stderr(), "skipped: {why}");
    assert!(
        std::env::var_os("CROMOSIM_REQUIRE_ALL").is_none_or(|value| value != "1"),
        "skipped, but CROMOSIM_REQUIRE_ALL=1: {why}"
    );
}

/// The shared third-party data, where they are.
pub fn shared_data() -> Option<PathBuf> {
    let path = std::env::var_os("CROMOSIM_DATA")
        .map_or_else(|| root().join("../shared/data"), PathBuf::from);
    if path.is_dir() {
        return Some(path);
    }
    skipped(&format!(
        "no shared data at {} (CROMOSIM_DATA names another place)",
        path.display()
    ));
    None
}

/// A Python with the packages of tests/interop/requirements.txt.
pub fn python() -> Option<PathBuf> {
    let python = std::env::var_os("CROMOSIM_PYTHON").map(PathBuf::from);
    if python.is_none() {
        skipped(
            "CROMOSIM_PYTHON names no Python with tests/interop/requirements.txt (.ci/run makes one)",
        );
    }
    python
}

/// A real motion in a minimal BVH: a hip, a chain of two limbs; enough for readers, too little for
/// a body.
pub const TINY_BVH: &str = "HIERARCHY
ROOT Hips
{
  OFFSET 0 0 0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Chest
  {
    OFFSET 0 10 0
    CHANNELS 3 Zrotation Xrotation Yrotation
    End Site
    {
      OFFSET 0 10 0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.01
0 90 0 0 0 0 0 0 0
0 90 0 0 0 0 0 0 0
";

/// Writes a body file again with every length `factor` times as long.
pub fn taller(from: &Path, to: &Path, factor: f64) {
    let mut npz = cromosim_arrays::NpzReader::open(from).expect("a body");
    let mut writer = cromosim_arrays::NpzWriter::new(std::fs::File::create(to).expect("writable"));
    for key in npz.keys() {
        let shape = npz.header(&key).expect("sound").expect("there").shape;
        let any = vec![None; shape.len()];
        if matches!(key.as_str(), "f" | "kintree_table") {
            let array = npz
                .integers(&key, &any, "integers")
                .expect("integers")
                .expect("there");
            let values: Vec<u32> = array.values.iter().map(|value| *value as u32).collect();
            writer
                .integers(&key, &array.shape, &values)
                .expect("writable");
            continue;
        }
        let Ok(Some(array)) = npz.floats(&key, &any, "numbers") else {
            continue;
        };
        let scale = if matches!(key.as_str(), "v_template" | "shapedirs" | "posedirs") {
            factor
        } else {
            1.0
        };
        let values: Vec<f64> = array.values.iter().map(|value| value * scale).collect();
        writer
            .floats(&key, &array.shape, &values)
            .expect("writable");
    }
    writer.finish().expect("writable");
}
