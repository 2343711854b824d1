//! `cromosim compare A B`: what differs between two diagnoses, or between the IMUs of two
//! recordings.

use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail, ensure};
use clap::Args;
use cromosim_bag::BagReader;
use cromosim_gap::{Diagnosis, SCHEMA};
use cromosim_recording::compare::{compare_diagnoses, compare_recordings};
use cromosim_recording::{TopicMap, open_mapped};
use cromosim_spatial::in_plain_words;

use crate::files::{refuse_existing, write_whole};
use crate::output::{print, say};
use crate::progress::working;

/// Say what differs between two diagnoses, or between the IMUs of two recordings
#[derive(Args)]
pub struct Arguments {
    /// A diagnosis or a recording
    ///
    /// diagnosis.json, or the folder of one; .mcap, or a rosbag2 directory
    a: PathBuf,
    /// Another of the same kind
    b: PathBuf,
    /// The namespace (/robot1, or that of a person) of the recordings' topics, where they are in several
    #[arg(long, value_name = "NAME")]
    namespace: Option<String>,
    /// An IMU on another topic than /imu/NAME/data_raw; may be given again
    ///
    /// Where a recording has no such topic, its IMU of that NAME is on /imu/NAME/data_raw. Once given, these are all that is
    /// compared
    #[arg(long, value_name = "[NAME=]TOPIC")]
    imu_topic: Vec<String>,
    /// Write what is found to this file too, as JSON
    #[arg(long, value_name = "FILE.json")]
    out: Option<PathBuf>,
    /// Replace FILE.json where it exists
    #[arg(long, requires = "out")]
    force: bool,
    /// Print what is found as JSON, the same as in FILE.json
    #[arg(long)]
    json: bool,
}

/// What one side is.
enum Side {
    Diagnosis(Diagnosis),
    Recording(BagReader),
}

impl Side {
    fn kind(&self) -> &'static str {
        match self {
            Self::Diagnosis(_) => "a diagnosis",
            Self::Recording(_) => "a recording",
        }
    }
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    if let Some(path) = &arguments.out {
        refuse_existing(path, arguments.force)?;
    }
    let topics = TopicMap::parse(&[], &arguments.imu_topic)?;
    let namespace = arguments.namespace.as_deref();
    let (a, b) = (
        open(&arguments.a, namespace, &topics)?,
        open(&arguments.b, namespace, &topics)?,
    );
    let found = match (&a, &b) {
        (Side::Diagnosis(a), Side::Diagnosis(b)) => compare_diagnoses(a, b)?,
        (Side::Recording(a), Side::Recording(b)) => {
            working("comparing", || compare_recordings(a, b, &topics))?
        }
        _ => {
            bail!(
                "{} is {} and {} is {}; two of a kind can be compared",
                arguments.a.display(),
                a.kind(),
                arguments.b.display(),
                b.kind()
            )
        }
    };
    let text =
        serde_json::to_string_pretty(&found.json).context("what was found is no JSON")? + "\n";
    if let Some(path) = &arguments.out {
        write_whole(path, arguments.force, |file| {
            file.write_all(text.as_bytes())
                .with_context(|| format!("{}: cannot be written", path.display()))
        })?;
    }
    if arguments.json {
        return print(format_args!("{text}"));
    }
    say!("A  {}\nB  {}", arguments.a.display(), arguments.b.display())?;
    print(format_args!("{}", found.text))?;
    Ok(())
}

/// Opens a side by its content.
fn open(path: &Path, namespace: Option<&str>, topics: &TopicMap) -> anyhow::Result<Side> {
    let recording = || Ok(Side::Recording(open_mapped(path, namespace, topics)?.0));
    if path.is_dir() {
        let file = path.join("diagnosis.json");
        return if file.is_file() {
            read_diagnosis(&file)
        } else {
            recording()
        };
    }
    let mut head = Vec::new();
    cromosim_spatial::open_file(path)
        .and_then(|file| file.take(64).read_to_end(&mut head))
        .with_context(|| format!("{}: cannot be read", path.display()))?;
    match head.iter().find(|byte| !byte.is_ascii_whitespace()) {
        None => bail!("{}: the file is empty", path.display()),
        Some(b'{') => read_diagnosis(path),
        Some(_) => recording(),
    }
}

fn read_diagnosis(path: &Path) -> anyhow::Result<Side> {
    let text = cromosim_spatial::read_text(path)
        .with_context(|| format!("{}: cannot be read", path.display()))?;
    let diagnosis: Diagnosis = serde_json::from_str(&text).map_err(|error| {
        anyhow!(
            "{}: no diagnosis: {}",
            path.display(),
            in_plain_words(error)
        )
    })?;
    ensure!(
        diagnosis.schema == SCHEMA,
        "{}: expected the schema '{SCHEMA}', found '{}'",
        path.display(),
        diagnosis.schema
    );
    Ok(Side::Diagnosis(diagnosis))
}
