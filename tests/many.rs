//! `simulate` of many motions: folders, patterns and lists, parts of them, and runs that go on where
//! another ended.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use common::{CROMOSIM, cromosim_in, refuses, succeed, text};
use cromosim_body::{BodyModel, ShapedBody};
use cromosim_motion::{embedded_walk, write_bvh};

/// Motions of different lengths in motions/, one of them in a folder below.
fn motions(folder: &Path, count: usize) {
    fs::create_dir_all(folder.join("motions/below")).unwrap();
    let body = ShapedBody::new(BodyModel::embedded(), &embedded_walk().betas).unwrap();
    for number in 0..count {
        let part = embedded_walk()
            .slice(0.3 * number as f64, Some(1.0))
            .unwrap();
        let name = if number == 1 {
            "below/m0".to_owned()
        } else {
            format!("m{number}")
        };
        let path = folder.join(format!("motions/{name}.bvh"));
        fs::write(path, write_bvh(&part, &body)).unwrap();
    }
}

/// Every file below a folder but manifests, by name.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut folders = vec![folder.to_owned()];
    while let Some(next) = folders.pop() {
        for entry in fs::read_dir(next).unwrap() {
            let path = entry.unwrap().path();
            let name = path.strip_prefix(folder).unwrap().display().to_string();
            if path.is_dir() {
                folders.push(path);
            } else if !name.starts_with("manifest") {
                found.insert(name, fs::read(path).unwrap());
            }
        }
    }
    found
}

const SIMULATE: [&str; 5] = [
    "simulate",
    "--format",
    "parquet",
    "--device",
    "consumer_mems",
];

fn simulate<'a>(inputs: &'a str, out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&SIMULATE[..], &[inputs, "--out", out], more].concat()
}

#[test]
fn folders_patterns_lists_and_parts_give_the_same_files() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    motions(here, 5);
    let said = succeed(here, &simulate("motions", "whole", &[]));
    assert!(
        said.ends_with("whole: 5 files written, 0 failed; whole/manifest.jsonl\n"),
        "{said}"
    );
    let whole = files(&here.join("whole"));
    let names: Vec<&str> = whole.keys().map(String::as_str).collect();
    let expected = [
        "below/m0.parquet",
        "m0.parquet",
        "m2.parquet",
        "m3.parquet",
        "m4.parquet",
    ];
    assert_eq!(names, expected);
    succeed(here, &simulate("motions/**/*.bvh", "pattern", &[]));
    assert!(whole == files(&here.join("pattern")));
    fs::write(here.join("list.txt"), "# all of them\nmotions\n").unwrap();
    succeed(here, &simulate("@list.txt", "list", &[]));
    assert!(whole == files(&here.join("list")));
    for part in ["1/3", "2/3", "3/3"] {
        succeed(here, &simulate("motions", "parts", &["--shard", part]));
    }
    assert!(whole == files(&here.join("parts")));
    // A run over all finds the parts done, whatever their number was.
    let said = succeed(here, &simulate("motions", "parts", &[]));
    assert!(
        said.contains("0 files written, 5 were there already"),
        "{said}"
    );
    let manifest = |name: &str| fs::read(here.join(name)).unwrap();
    assert!(manifest("whole/manifest.jsonl") == manifest("parts/manifest.jsonl"));
}

#[test]
fn a_damaged_input_is_told_of_in_the_end_and_stops_no_other() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    motions(here, 3);
    fs::write(here.join("motions/m1.bvh"), "HIERARCHY\nROOT hips\n{\n").unwrap();
    let output = cromosim_in(here, &simulate("motions", "out", &[]));
    let said = text(&output);
    assert_eq!(output.status.code(), Some(2), "{said}");
    assert!(said.contains("error: motions/m1.bvh, line"), "{said}");
    assert!(
        said.contains("1 of 4 files failed (above); the others are written"),
        "{said}"
    );
    assert_eq!(files(&here.join("out")).len(), 3);
    let manifest = fs::read_to_string(here.join("out/manifest.jsonl")).unwrap();
    assert_eq!(manifest.lines().count(), 5);
    assert_eq!(
        manifest.matches("\"error\":\"motions/m1.bvh, line").count(),
        1
    );
    // Mended, it alone is simulated.
    fs::copy(here.join("motions/m2.bvh"), here.join("motions/m1.bvh")).unwrap();
    let said = succeed(here, &simulate("motions", "out", &[]));
    assert!(
        said.contains("out/m1.parquet: ") && !said.contains("m2.parquet"),
        "{said}"
    );
    assert!(
        said.contains("1 files written, 3 were there already, 0 failed"),
        "{said}"
    );
}

#[test]
fn what_is_missing_cut_or_older_is_written_anew() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    motions(here, 5);
    succeed(here, &simulate("motions", "out", &[]));
    let whole = files(&here.join("out"));
    let manifest = fs::read(here.join("out/manifest.jsonl")).unwrap();
    fs::remove_file(here.join("out/m2.parquet")).unwrap();
    fs::write(here.join("out/m3.parquet"), "cut").unwrap();
    let late = std::time::SystemTime::now() + Duration::from_secs(60);
    let input = fs::File::options()
        .append(true)
        .open(here.join("motions/m4.bvh"))
        .unwrap();
    input.set_modified(late).unwrap();
    let said = succeed(here, &simulate("motions", "out", &[]));
    assert!(
        said.contains("3 files written, 2 were there already"),
        "{said}"
    );
    assert!(whole == files(&here.join("out")));
    assert!(manifest == fs::read(here.join("out/manifest.jsonl")).unwrap());
    refuses(
        here,
        &simulate("motions", "out", &["--seed", "1"]),
        &["out/manifest.jsonl", "seed: 0 there, 1 here", "--force"],
    );
    assert!(whole == files(&here.join("out")), "nothing was touched");
    succeed(
        here,
        &simulate("motions", "out", &["--seed", "1", "--force"]),
    );
    assert!(whole != files(&here.join("out")));
    fs::write(here.join("out/manifest.jsonl"), "{}\n").unwrap();
    let damaged = ["out/manifest.jsonl", "line 1", "--force"];
    refuses(
        here,
        &simulate("motions", "out", &["--seed", "1"]),
        &damaged,
    );
}

#[test]
fn a_killed_run_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    motions(here, 20);
    succeed(here, &simulate("motions", "whole", &[]));
    let mut killed = Command::new(CROMOSIM)
        .args(simulate("motions", "out", &[]))
        .current_dir(here)
        .env("RAYON_NUM_THREADS", "1")
        .stdout(Stdio::null())
        .spawn()
        .unwrap();
    let begun = Instant::now();
    while files_there(&here.join("out")) < 3 && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(2));
    }
    killed.kill().unwrap();
    killed.wait().unwrap();
    let done = files_there(&here.join("out"));
    assert!(done >= 3);
    // What a write that was cut off leaves.
    let manifest = here.join("out/manifest.jsonl");
    let mut torn = fs::read_to_string(&manifest).unwrap();
    torn += "{\"input\":\"motions/m19";
    fs::write(&manifest, torn).unwrap();
    let said = succeed(here, &simulate("motions", "out", &[]));
    // Killed at the end, it had nothing left.
    assert!(done == 20 || said.contains("were there already"), "{said}");
    let (whole, mut out) = (files(&here.join("whole")), files(&here.join("out")));
    out.retain(|name, _| !name.ends_with(".partial"));
    assert!(whole == out);
    let manifest = |name: &str| fs::read(here.join(name)).unwrap();
    assert!(manifest("whole/manifest.jsonl") == manifest("out/manifest.jsonl"));
}

/// Complete files, while others are being written.
fn files_there(folder: &Path) -> usize {
    let Ok(entries) = fs::read_dir(folder) else {
        return 0;
    };
    let names =
        entries.filter_map(|entry| Some(entry.ok()?.file_name().to_string_lossy().into_owned()));
    names.filter(|name| name.ends_with(".parquet")).count()
}

/// Four times the inputs need no more memory.
#[test]
#[cfg(target_os = "linux")]
fn memory_does_not_grow_with_the_number_of_inputs() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    motions(here, 8);
    let peak_kb = |copies: usize| {
        let set = here.join(format!("set{copies}"));
        for copy in 0..copies {
            let to = set.join(copy.to_string());
            fs::create_dir_all(&to).unwrap();
            for name in ["m0.bvh", "m2.bvh", "m3.bvh", "m4.bvh"] {
                fs::copy(here.join("motions").join(name), to.join(name)).unwrap();
            }
        }
        let mut child = Command::new(CROMOSIM)
            .args(simulate(
                set.to_str().unwrap(),
                &format!("out{copies}"),
                &[],
            ))
            .current_dir(here)
            .env("RAYON_NUM_THREADS", "2")
            .stdout(Stdio::null())
            .spawn()
            .unwrap();
        let status = format!("/proc/{}/status", child.id());
        let mut peak = 0;
        while child.try_wait().unwrap().is_none() {
            let told = fs::read_to_string(&status).unwrap_or_default();
            let line = told.lines().find(|line| line.starts_with("VmHWM:"));
            let kb = line.and_then(|line| line.split_whitespace().nth(1)?.parse().ok());
            peak = peak.max(kb.unwrap_or(0));
            std::thread::sleep(Duration::from_millis(1));
        }
        assert!(child.wait().unwrap().success());
        peak
    };
    let (few, many): (u64, u64) = (peak_kb(4), peak_kb(32));
    assert!(
        few > 0 && many < few + few / 2,
        "{few} kB of 16 files, {many} kB of 128"
    );
}

#[test]
fn what_is_no_set_of_inputs_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    motions(here, 2);
    fs::create_dir(here.join("empty")).unwrap();
    let refused = |inputs: &[&str], words: &[&str]| {
        refuses(
            here,
            &[&SIMULATE[..], &["--out", "out"], inputs].concat(),
            words,
        );
    };
    refused(&["empty"], &["empty: no motion file there"]);
    refused(&["@none.txt"], &["none.txt: cannot be read"]);
    refused(
        &["motions/m0.bvh", "motions/below/m0.bvh"],
        &["both become m0"],
    );
    let rigid = [
        "simulate", "--rigid", "x.tum", "--rate", "9", "--shard", "1/2",
    ];
    refuses(
        here,
        &[&rigid[..], &["--out", "out"]].concat(),
        &["--shard", "--rigid"],
    );
    assert!(!here.join("out").exists());
    let shard = cromosim_in(here, &simulate("motions", "out", &["--shard", "3/2"]));
    assert_eq!(shard.status.code(), Some(2));
    assert!(text(&shard).contains("expected I/N"), "{}", text(&shard));
}

/// What Slurm runs for each task of an array, one of them killed before it did anything.
#[test]
fn tasks_of_a_slurm_array_give_the_same_files() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    motions(here, 5);
    succeed(here, &simulate("motions", "whole", &[]));
    let script = common::root().join("nodes/lib/python/examples/slurm_simulate.sh");
    let task = |number: usize, count: usize| {
        let output = Command::new("bash")
            .arg(&script)
            .args(["motions", "tasks", "--device", "consumer_mems"])
            .current_dir(here)
            .env("CROMOSIM_BINARY", CROMOSIM)
            .env("SLURM_CPUS_PER_TASK", "2")
            .env("SLURM_ARRAY_TASK_ID", number.to_string())
            .env("SLURM_ARRAY_TASK_COUNT", count.to_string())
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", text(&output));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    task(1, 3);
    task(3, 3);
    assert_eq!(files(&here.join("tasks")).len(), 3);
    let again = [task(1, 2), task(2, 2)].concat();
    assert_eq!(
        again.matches(".parquet: ").count(),
        2,
        "what is missing: {again}"
    );
    assert!(files(&here.join("whole")) == files(&here.join("tasks")));
}

/// Poses that estimators took from videos, of every kind of file and all people in them.
#[test]
fn poses_of_many_videos_become_columns_of_every_person() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let poses = common::root().join("nodes/lib/motion/tests/data/poses");
    fs::create_dir_all(here.join("videos/below")).unwrap();
    // People and rows of each: five placements, and each person as long as they were seen.
    let videos = [
        ("chain_wham.pkl", "walk_0.pkl", 2, 1681),
        ("chain_wham.pkl", "below/walk_1.pkl", 2, 1681),
        ("vibe.joblib", "vibe.joblib", 2, 125),
        ("phalp.pkl", "phalp.pkl", 2, 120),
        ("slahmr.npz", "slahmr.npz", 2, 105),
        ("gvhmr.pt", "gvhmr.pt", 1, 85),
    ];
    for (sample, name, ..) in videos {
        fs::copy(poses.join(sample), here.join("videos").join(name)).unwrap();
    }
    let all = ["--person", "all"];
    for part in ["1/2", "2/2"] {
        let more = [&all[..], &["--shard", part]].concat();
        succeed(here, &simulate("videos", "out", &more));
    }
    let written = files(&here.join("out"));
    assert_eq!(written.len(), videos.len(), "{:?}", written.keys());
    for (_, name, people, rows) in videos {
        let column = Path::new(name).with_extension("parquet");
        let said = succeed(here, &["inspect", &format!("out/{}", column.display())]);
        let header = format!("{} IMUs", 5 * people);
        assert!(said.contains(&header), "{name}: {said}");
        let readings: usize = said
            .split_whitespace()
            .zip(said.split_whitespace().skip(1))
            .filter(|(_, word)| *word == "readings,")
            .map(|(count, _)| count.parse::<usize>().unwrap())
            .sum();
        assert_eq!(readings, rows, "{name}: {said}");
    }
    fs::create_dir(here.join("alone")).unwrap();
    succeed(
        here,
        &simulate("videos/walk_0.pkl", "alone/walk_0.parquet", &all),
    );
    assert!(written["walk_0.parquet"] == files(&here.join("alone"))["walk_0.parquet"]);
    assert!(
        written["walk_0.parquet"] != written["below/walk_1.parquet"],
        "the recording's name"
    );
}
