//! `cromosim evaluate har`: the whole chain in its quick form.
#![allow(clippy::unwrap_used)]

mod common;

use std::fmt::Write as _;
use std::fs;
use std::io::{Cursor, Write as _};
use std::path::Path;
use std::process::Command;

use common::{CROMOSIM, refuses, shared_data, succeed, text};
use serde_json::Value;
use zip::write::SimpleFileOptions;

fn results(folder: &Path) -> Value {
    serde_json::from_slice(&fs::read(folder.join("results.json")).unwrap()).unwrap()
}

fn quick(folder: &Path, data: &Path, out: &str, threads: &str, further: &[&str]) -> String {
    let mut command = Command::new(CROMOSIM);
    command
        .args(["evaluate", "har", "--quick", "--out", out, "--data"])
        .arg(data)
        .args(further);
    let output = command
        .env("RAYON_NUM_THREADS", threads)
        .current_dir(folder)
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", text(&output));
    text(&output)
}

#[test]
fn the_quick_form_tests_everybody_and_gives_the_same_bytes() {
    let Some(data) = shared_data() else { return };
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let said = quick(here, &data, "one", "1", &[]);
    assert!(
        said.contains("| real (R2R) |")
            && said.contains("| real, turned copies |")
            && said.contains("no networks were given"),
        "{said}"
    );
    let results = results(&here.join("one"));
    let cells = results["cells"].as_array().unwrap();
    // R2R without and with turned copies, and the chosen Mix2R at both shares; V2R and Mix2R with
    // mapping and with effects.
    assert_eq!(cells.len(), 3 * 2 + 4);
    for cell in cells {
        let tested: Vec<&str> = cell["subjects"]
            .as_array()
            .unwrap()
            .iter()
            .map(|score| score["subject"].as_str().unwrap())
            .collect();
        assert_eq!(tested, ["s01", "s02", "s03"]);
        let mean = cell["mean"].as_f64().unwrap();
        assert!(
            (0.0..=1.0).contains(&mean) && cell["interval"][0].as_f64().unwrap() <= mean,
            "{cell}"
        );
        for run in cell["runs"].as_array().unwrap() {
            assert!(
                !run["known"].as_array().unwrap().contains(&run["subject"]),
                "{run}"
            );
            // All windows of the person are in the confusion.
            let counted: u64 = run["confusion"]
                .as_array()
                .unwrap()
                .iter()
                .flat_map(|row| row.as_array().unwrap())
                .filter_map(Value::as_u64)
                .sum();
            let person = results["subjects"]
                .as_array()
                .unwrap()
                .iter()
                .find(|person| person["subject"] == run["subject"])
                .unwrap();
            let windows: u64 = person["windows"]
                .as_array()
                .unwrap()
                .iter()
                .filter_map(Value::as_u64)
                .sum();
            assert_eq!(counted, windows);
        }
    }
    assert_eq!(
        results["virtual_side"]["windows"][0],
        serde_json::json!([20, 20, 20, 20, 20])
    );
    let tables = fs::read_to_string(here.join("one/tables.md")).unwrap();
    assert!(
        said.contains(&tables) && tables.contains("| 50 % (1) |"),
        "{tables}"
    );

    quick(here, &data, "two", "2", &[]);
    for name in ["results.json", "tables.md"] {
        let [one, two] = ["one", "two"].map(|run| fs::read(here.join(run).join(name)).unwrap());
        assert!(one == two, "{name} differs on another number of threads");
    }
    let data = data.display().to_string();
    refuses(
        here,
        &[
            "evaluate", "har", "--quick", "--out", "one", "--data", &data,
        ],
        &["one/results.json", "--force"],
    );
    let another = [
        "evaluate", "har", "--quick", "--out", "one", "--data", &data, "--force", "--seed", "2",
    ];
    succeed(here, &another);
    assert_ne!(self::results(&here.join("one"))["cells"], results["cells"]);
}

/// Sitting and walking, for half of the rows each.
fn movement(row: usize, rows: usize, person: usize) -> ([f64; 3], [f64; 3]) {
    let t = row as f64 / 50.0;
    if row < rows / 2 {
        return ([0.1 * t.sin(), 9.7, 0.2], [0.01, 0.0, 0.01]);
    }
    let step = (t * (11.0 + 0.3 * person as f64)).sin();
    (
        [3.0 * step, 9.0 + 2.0 * step, 1.0],
        [step, 0.5 * step, -0.2],
    )
}

fn pamap2(person: usize) -> String {
    let (rows, mut text) = (1000, String::new());
    for row in 0..rows {
        let ([a, b, c], [x, y, z]) = movement(row, rows, person);
        let imu = format!("30 {a} {b} {c} {a} {b} {c} {x} {y} {z} 1 2 3 1 0 0 0");
        writeln!(
            text,
            "{:.2} {} NaN {imu} {imu} {imu}",
            0.02 * row as f64,
            if row < rows / 2 { 2 } else { 4 }
        )
        .unwrap();
    }
    text
}

fn realworld(folder: &Path, person: usize, activity: &str) -> String {
    let data = folder.join(format!("proband{person}/data"));
    fs::create_dir_all(&data).unwrap();
    for (sensor, file, table) in [(0, "acc", "acc"), (1, "gyr", "Gyroscope")] {
        let mut writer = zip::ZipWriter::new(Cursor::new(Vec::new()));
        for position in ["thigh", "forearm"] {
            let mut text = "id,attr_time,attr_x,attr_y,attr_z\n".to_owned();
            for row in 0..400 {
                let both = movement(
                    row + if activity == "walking" { 1000 } else { 0 },
                    1000,
                    person,
                );
                let [x, y, z] = [both.0, both.1][sensor];
                writeln!(
                    text,
                    "{row},{},{x},{y},{z}",
                    1_435_995_800_000_u64 + 20 * row as u64
                )
                .unwrap();
            }
            writer
                .start_file(
                    format!("{table}_{activity}_{position}.csv"),
                    SimpleFileOptions::default(),
                )
                .unwrap();
            writer.write_all(text.as_bytes()).unwrap();
        }
        fs::write(
            data.join(format!("{file}_{activity}_csv.zip")),
            writer.finish().unwrap().into_inner(),
        )
        .unwrap();
    }
    data.join(format!("acc_{activity}_csv.zip"))
        .display()
        .to_string()
}

#[test]
fn look_alikes_of_pamap2_and_realworld_take_the_same_way() {
    let Some(data) = shared_data() else { return };
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let mut files = Vec::new();
    for person in 1..=3 {
        files.push(format!("subject10{person}.dat"));
        fs::write(here.join(&files[person - 1]), pamap2(person)).unwrap();
    }
    let clips = |name: &str| data.join("mocap_cmu_har").join(name).display().to_string();
    let clips = [clips("02_01.npz"), clips("14_28.npz")];
    let given = |files: &[String]| -> Vec<String> {
        ["--real".to_owned()]
            .into_iter()
            .chain(files.to_vec())
            .chain(["--motions".to_owned()])
            .chain(clips.clone())
            .collect()
    };
    let words = given(&files);
    let said = quick(
        here,
        &data,
        "pamap2",
        "2",
        &words.iter().map(String::as_str).collect::<Vec<_>>(),
    );
    assert!(
        said.contains("PAMAP2: 3 people") && said.contains("hand, chest, ankle; SEATED, WALKING"),
        "{said}"
    );
    // Sitting and walking of these are told apart by anything.
    let found = results(&here.join("pamap2"));
    assert!(
        found["cells"][1]["mean"].as_f64().unwrap() > 0.8,
        "{}",
        found["cells"][1]["mean"]
    );
    assert_eq!(
        found["virtual_side"]["windows"][0],
        serde_json::json!([20, 20])
    );

    let files: Vec<String> = (1..=3)
        .flat_map(|person| ["sitting", "walking"].map(|activity| realworld(here, person, activity)))
        .collect();
    let words = given(&files);
    let said = quick(
        here,
        &data,
        "realworld",
        "2",
        &words.iter().map(String::as_str).collect::<Vec<_>>(),
    );
    assert!(
        said.contains("RealWorld (HAR): 3 people")
            && said.contains("forearm, thigh; SEATED, WALKING"),
        "{said}"
    );
    let people: Vec<&str> = Vec::from_iter(["proband1", "proband2", "proband3"]);
    let found = results(&here.join("realworld"));
    assert_eq!(
        found["subjects"]
            .as_array()
            .unwrap()
            .iter()
            .map(|person| person["subject"].as_str().unwrap())
            .collect::<Vec<_>>(),
        people
    );

    // Classes of one's own have no virtual side, and a map of activities may name the five
    // otherwise.
    fs::write(
        here.join("map.yaml"),
        "{sitting: SEATED, walking: STROLLING}",
    )
    .unwrap();
    let words: Vec<String> = words
        .into_iter()
        .chain(["--activities".to_owned(), "map.yaml".to_owned()])
        .collect();
    quick(
        here,
        &data,
        "own",
        "2",
        &words.iter().map(String::as_str).collect::<Vec<_>>(),
    );
    let found = results(&here.join("own"));
    assert_eq!(
        (&found["classes"], &found["virtual_side"]["windows"][0]),
        (
            &serde_json::json!(["SEATED", "STROLLING"]),
            &serde_json::json!([20, 0])
        )
    );
}

#[test]
fn what_cannot_be_used_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let here = folder.path();
    let run = |further: &[&str], words: &[&str]| {
        refuses(
            here,
            &[&["evaluate", "har", "--out", "out"], further].concat(),
            words,
        )
    };
    run(&["--data", "nowhere"], &["nowhere/har_spsw", "--data"]);
    fs::write(here.join("a.txt"), "no recording").unwrap();
    run(
        &["--real", "a.txt"],
        &["a.txt", "no recording of a data set"],
    );
    for person in 1..=2 {
        fs::write(here.join(format!("s{person}.dat")), pamap2(person)).unwrap();
    }
    run(
        &["--real", "s1.dat", "s2.dat"],
        &["s1.dat", "at least 3 people"],
    );
    run(
        &["--real", "s1.dat", "--learned", "nowhere"],
        &["nowhere: neither a folder", "motion_capture"],
    );
    fs::write(here.join("map.yaml"), "{sitting: SEATED}").unwrap();
    run(
        &["--real", "s1.dat", "--activities", "map.yaml"],
        &["map.yaml: 1 classes"],
    );
    fs::write(here.join("s3.dat"), pamap2(3)).unwrap();
    run(
        &["--real", "s1.dat", "s2.dat", "s3.dat", "--motions", "a.txt"],
        &["a.txt"],
    );
    assert!(!here.join("out").exists());
}
