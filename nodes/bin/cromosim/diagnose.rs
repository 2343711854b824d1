//! `cromosim diagnose`: where the gap between simulated and real lies, which effects cause it, how
//! far it shrinks.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, bail};
use clap::Args;
use cromosim_body::BodyModel;
use cromosim_gap::{
    DiagnoseOptions, Diagnosis, Evidence, MagnetometerDiagnosis, OfRecording, PlacementAnswer,
    PlacementDiagnosis, Progress, SCHEMA,
};
use cromosim_imu::{EffectKind, EffectsFile};
use cromosim_spatial::{in_plain_words, meant};
use rayon::prelude::*;
use serde::Deserialize;
use serde_json::Value;

use crate::diagnose_recordings::{OneRecording, Selected, file_names, of_recording, select};
use crate::files::refuse_existing;
use crate::list;
use crate::memory;
use crate::named::Named;
use crate::output::{self, remark, say};
use crate::progress::{self, Interrupt};
use crate::topic_arguments::TopicArguments;

/// The files in DIR.
const FILES: [&str; 4] = [
    "diagnosis.json",
    "effects.yaml",
    "report.html",
    "diagnosis.rrd",
];

/// Heading of the help.
const SEARCH: &str = "What is searched";

/// Say which effects separate a recording's real IMUs from their simulation, and how far the gap
/// falls with them
#[derive(Args)]
#[command(after_long_help = "\
The recording (MCAP, ROS 2) holds /reference/NAME (geometry_msgs/msg/PoseStamped) or SMPL states with an attachment placements.yaml, and
/imu/NAME/data_raw (sensor_msgs/msg/Imu); --reference-topic and --imu-topic name others. DIR gets diagnosis.json, effects.yaml (for `cromosim simulate --reference RECORDING --effects`),
report.html and diagnosis.rrd (for Rerun). The exit code is 0 when a diagnosis was made, whatever it says.

Of several recordings, what is the device's or its mount's is fitted to all of them, while clock, biases and reference are each recording's own;
DIR says of each how far its gap falls, also when it is left out of the fit. effects.yaml holds each session, and `simulate` takes that which a
recording belongs to by its time.

A config FILE, every line of it optional:
  placements: [wrist, ankle]     # only these
  without: [lever_arm]           # effects taken out of the library; --without replaces the list
  seed: 7                        # --seed wins")]
pub struct Arguments {
    /// The recording: .mcap, or rosbag2 directory
    ///
    /// Several of the same devices are diagnosed together
    #[arg(required_unless_present = "list_effects", value_name = "RECORDING")]
    recordings: Vec<PathBuf>,
    /// The folder for the four files; is made where it is missing
    #[arg(long, value_name = "DIR", required_unless_present = "list_effects")]
    out: Option<PathBuf>,
    /// List the effects of the library with their parameters, and do nothing else
    #[arg(long, exclusive = true)]
    list_effects: bool,
    /// Replace the files of an earlier diagnosis in DIR
    #[arg(long)]
    force: bool,
    /// Print diagnosis.json rather than the verdicts
    #[arg(long)]
    json: bool,
    /// Settings (YAML), see below with --help
    #[arg(long, value_name = "FILE", help_heading = SEARCH)]
    config: Option<PathBuf>,
    /// Take an effect out of the library; may be given again
    #[arg(
        long,
        value_name = "EFFECT",
        help_heading = SEARCH,
        hide_possible_values = true,
        value_parser = Named(list::effect_names)
    )]
    without: Vec<String>,
    /// The namespace of the recordings' topics, where there are several
    ///
    /// /robot1, or that of a person
    #[arg(long, value_name = "NAME", help_heading = SEARCH)]
    namespace: Option<String>,
    #[command(flatten)]
    topics: TopicArguments,
    /// Body model (npz or pickle) of a recording of SMPL states
    ///
    /// Rather than the embedded one
    #[arg(long, value_name = "FILE", help_heading = SEARCH)]
    body: Option<PathBuf>,
    /// Seed of the noise in comparisons [default: 0]
    ///
    /// With the noisy simulation
    #[arg(long, help_heading = SEARCH)]
    seed: Option<u64>,
}

/// Runs the command.
pub fn run(arguments: &Arguments) -> anyhow::Result<()> {
    let Some(out) = &arguments.out else {
        return list::effects();
    };
    memory::share_one_pool();
    let config = arguments
        .config
        .as_deref()
        .map(Config::read)
        .transpose()?
        .unwrap_or_default();
    let options = options(arguments, &config)?;
    check_folder(out, arguments.force)?;
    let body = arguments.body.as_deref().map(BodyModel::read).transpose()?;
    let Selected {
        placements,
        mut notes,
        mut failures,
    } = select(
        &arguments.recordings,
        body.as_ref(),
        &config.placements,
        (arguments.namespace.as_deref(), &arguments.topics.map()?),
    )?;

    let mut answers = BTreeMap::new();
    for (name, result) in diagnose_all(placements, &options) {
        match result {
            Ok(found) => {
                failures.extend(found.errors);
                let of_placement = |note: &String| format!("placement {name}: {note}");
                notes.extend(found.notes.iter().map(of_placement));
                answers.insert(name, found.answer);
            }
            Err(error) => failures.push(error),
        }
    }
    if answers.is_empty() {
        let files = arguments.recordings.iter();
        let files: Vec<String> = files.map(|file| file.display().to_string()).collect();
        bail!("{}: {}", files.join(", "), failures.join("; "));
    }
    for note in &notes {
        remark!("warning: {note}");
    }
    for failure in &failures {
        remark!("error: {failure}; the others are diagnosed");
    }
    let (diagnosis, effects, evidence) = split(answers);
    // What was found is said even where its files cannot be written.
    let written = write(out, &arguments.recordings, &diagnosis, &effects, &evidence);
    if arguments.json {
        return output::print(format_args!("{}", json(&diagnosis)?)).and(written);
    }
    print(&diagnosis).and(written)?;
    print_files(out)
}

/// What is taken out of the library, and the seed: the command line wins over the file.
fn options(arguments: &Arguments, config: &Config) -> anyhow::Result<DiagnoseOptions> {
    let (names, place) = match (&arguments.config, arguments.without.is_empty()) {
        (Some(file), true) => (&config.without, format!("{}: without", file.display())),
        _ => (&arguments.without, "--without".to_owned()),
    };
    let excluded = names
        .iter()
        .map(|name| effect(name, &place))
        .collect::<anyhow::Result<_>>()?;
    Ok(DiagnoseOptions {
        excluded,
        seed: arguments.seed.or(config.seed).unwrap_or(0),
        ..DiagnoseOptions::default()
    })
}

/// What is said of a placement.
struct Answered {
    answer: PlacementAnswer,
    /// What is wrong with some of its recordings.
    errors: Vec<String>,
    /// What a user should know of the others.
    notes: Vec<String>,
}

/// Each placement on whatever core is free; its recordings are let go once it has its answer.
fn diagnose_all(
    placements: BTreeMap<String, Vec<OneRecording>>,
    options: &DiagnoseOptions,
) -> Vec<(String, Result<Answered, String>)> {
    // Until the files are written a signal may end the process as it likes: there is nothing to
    // clear away.
    let doing = match placements.len() {
        1 => "diagnosing".to_owned(),
        count => format!("diagnosing {count} placements"),
    };
    let bar = progress::shares(placements.len(), &doing);
    let diagnose = |(name, recorded): (String, Vec<OneRecording>)| {
        let one = bar.of_one();
        let told = DiagnoseOptions {
            progress: Progress::new(move |share| one.reached(share)),
            ..options.clone()
        };
        (name, diagnose_placement(recorded, &told))
    };
    let in_order: Vec<(String, Vec<OneRecording>)> = placements.into_iter().collect();
    let results = in_order.into_par_iter().map(diagnose).collect();
    bar.finish();
    results
}

fn diagnose_placement(
    recorded: Vec<OneRecording>,
    options: &DiagnoseOptions,
) -> Result<Answered, String> {
    let named: Vec<_> = recorded
        .iter()
        .map(|one| (one.file.as_str(), &one.record))
        .collect();
    let text = |(file, error): &OfRecording| of_recording(file, &error.to_string());
    match cromosim_gap::diagnose_together(&named, options) {
        Ok((answer, errors)) => Ok(Answered {
            answer,
            errors: errors.iter().map(text).collect(),
            notes: recorded.iter().flat_map(|one| one.notes.clone()).collect(),
        }),
        Err(error) => Err(text(&error)),
    }
}

fn split(
    answers: BTreeMap<String, PlacementAnswer>,
) -> (Diagnosis, EffectsFile, BTreeMap<String, Evidence>) {
    let mut diagnosis = Diagnosis {
        schema: SCHEMA.to_owned(),
        placements: BTreeMap::new(),
    };
    let (mut effects, mut evidence) = (EffectsFile::default(), BTreeMap::new());
    for (name, answer) in answers {
        diagnosis.placements.insert(name.clone(), answer.diagnosis);
        effects.placements.insert(name.clone(), answer.effects);
        evidence.insert(name, answer.evidence);
    }
    (diagnosis, effects, evidence)
}

/// Settings from a file.
#[derive(Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct Config {
    placements: Vec<String>,
    without: Vec<String>,
    seed: Option<u64>,
}

impl Config {
    fn read(file: &Path) -> anyhow::Result<Self> {
        let text = cromosim_spatial::read_text(file)
            .with_context(|| format!("{}: cannot be read", file.display()))?;
        Self::parse(&text).map_err(|error| anyhow!("{}: {}", file.display(), in_plain_words(error)))
    }

    /// An empty file sets nothing.
    fn parse(text: &str) -> Result<Self, serde_norway::Error> {
        serde_norway::from_str::<Option<Self>>(text).map(Option::unwrap_or_default)
    }
}

/// The effect of a name, or an error that says which name is nearest.
fn effect(name: &str, place: &str) -> anyhow::Result<EffectKind> {
    EffectKind::from_name(name).ok_or_else(|| {
        let meant = meant(name, EffectKind::ALL.map(EffectKind::name));
        anyhow!("{place} {name}: no such effect{meant}")
    })
}

/// Says before the work what would stop its files after it.
fn check_folder(folder: &Path, force: bool) -> anyhow::Result<()> {
    if let Some(file) = folder
        .ancestors()
        .find(|place| place.exists())
        .filter(|place| !place.is_dir())
    {
        bail!(
            "{}: --out: {} is no folder",
            folder.display(),
            file.display()
        );
    }
    match FILES
        .iter()
        .map(|name| folder.join(name))
        .find(|path| path.is_dir())
    {
        Some(path) => bail!(
            "{}: is a folder and cannot be replaced by a file",
            path.display()
        ),
        None => FILES
            .iter()
            .try_for_each(|name| refuse_existing(&folder.join(name), force)),
    }
}

/// Files under temporary names; those that have not got their own when this is dropped are removed,
/// and so is a folder made for them.
struct Staged {
    folder: PathBuf,
    made: bool,
    names: Vec<&'static str>,
}

impl Staged {
    fn new(folder: &Path) -> anyhow::Result<Self> {
        let made = !folder.exists();
        fs::create_dir_all(folder)
            .with_context(|| format!("{}: cannot be made", folder.display()))?;
        Ok(Self {
            folder: folder.to_owned(),
            made,
            names: Vec::new(),
        })
    }

    /// Where a file is written first.
    fn temporary(&self, name: &str) -> PathBuf {
        self.folder
            .join(format!(".{name}.{}.tmp", std::process::id()))
    }

    fn add(
        &mut self,
        name: &'static str,
        write: impl FnOnce(&Path) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        self.names.push(name);
        write(&self.temporary(name))
            .with_context(|| format!("{}: cannot be written", self.folder.join(name).display()))
    }

    /// Gives all files their names.
    fn finish(mut self) -> anyhow::Result<()> {
        for name in self.names.clone() {
            let path = self.folder.join(name);
            fs::rename(self.temporary(name), &path)
                .with_context(|| format!("{}: cannot be written", path.display()))?;
            self.names.retain(|other| *other != name);
            self.made = false;
        }
        Ok(())
    }
}

impl Drop for Staged {
    fn drop(&mut self) {
        // What cannot be removed is nothing that an error on top would mend.
        self.names
            .iter()
            .for_each(|name| drop(fs::remove_file(self.temporary(name))));
        if self.made {
            drop(fs::remove_dir(&self.folder));
        }
    }
}

fn write(
    folder: &Path,
    recordings: &[PathBuf],
    diagnosis: &Diagnosis,
    effects: &EffectsFile,
    evidence: &BTreeMap<String, Evidence>,
) -> anyhow::Result<()> {
    let interrupt = Interrupt::watch()?;
    let recording = file_names(recordings).join(", ");
    let texts = [
        json(diagnosis)?,
        effects.to_yaml(),
        cromosim_gap::report::html(
            diagnosis,
            evidence,
            &format!("Gap diagnosis of {recording}"),
        ),
    ];
    let mut staged = Staged::new(folder)?;
    for (name, text) in FILES.into_iter().zip(texts) {
        staged.add(name, |path| Ok(fs::write(path, text)?))?;
        interrupt.check()?;
    }
    #[cfg(feature = "view")]
    staged.add(FILES[3], |path| {
        crate::diagnose_view::write_rrd(path, diagnosis, evidence)
    })?;
    interrupt.check()?;
    staged.finish()?;
    if cfg!(not(feature = "view")) {
        // One of an earlier diagnosis would speak of other causes.
        drop(fs::remove_file(folder.join(FILES[3])));
    }
    Ok(())
}

/// diagnosis.json.
fn json(diagnosis: &Diagnosis) -> anyhow::Result<String> {
    Ok(serde_json::to_string_pretty(diagnosis)? + "\n")
}

/// Which files were written.
fn print_files(folder: &Path) -> anyhow::Result<()> {
    let folder = folder.display();
    if cfg!(feature = "view") {
        say!("\n{folder}: {}", FILES.join(", "))?;
    } else {
        say!(
            "\n{folder}: {}; {} is left out, as this cromosim was built without its feature `view`",
            FILES[..3].join(", "),
            FILES[3]
        )?;
    }
    Ok(())
}

/// What was found, for people.
fn print(diagnosis: &Diagnosis) -> anyhow::Result<()> {
    for (name, placement) in &diagnosis.placements {
        let PlacementDiagnosis {
            verdict, causes, ..
        } = placement;
        say!("{name}: {verdict}")?;
        for cause in causes {
            let (effect, probability, share) =
                (&cause.effect, cause.probability, 100.0 * cause.gap_share);
            say!(
                "  {effect:<20} probability {probability:.2}, {share:5.1} % of the gap; {}",
                parameters(&cause.effect, &cause.parameters, &cause.standard_errors)
            )?;
        }
        for kept in &placement.calibration {
            say!(
                "  {:<20} no cause, but kept; {}",
                kept.effect,
                parameters(&kept.effect, &kept.parameters, &kept.standard_errors)
            )?;
        }
        if let Some(response) = &placement.reference_response {
            say!(
                "  {:<20} no cause, but kept; the readings hold so many times the reference's motion: {}",
                "reference_response",
                response.in_words()
            )?;
        }
        if let Some(magnetometer) = &placement.magnetometer {
            print_magnetometer(magnetometer)?;
        }
        for one in &placement.recordings {
            let (gap, left_out) = (&one.gap, &one.left_out);
            say!(
                "  {}: {:.3} -> {:.3} m/s2 and {:.4} -> {:.4} rad/s; with the device as the other recordings show it {:.3} m/s2 and {:.4} rad/s",
                one.recording,
                gap.before.accel_rmse,
                gap.after.accel_rmse,
                gap.before.gyro_rmse,
                gap.after.gyro_rmse,
                left_out.accel_rmse,
                left_out.gyro_rmse
            )?;
        }
    }
    Ok(())
}

fn print_magnetometer(found: &MagnetometerDiagnosis) -> anyhow::Result<()> {
    say!("  magnetometer: {}", found.verdict)?;
    for cause in &found.causes {
        say!(
            "    {:<18} {:5.1} % of its gap; {}",
            cause.effect,
            100.0 * cause.gap_share,
            parameters(&cause.effect, &cause.parameters, &cause.standard_errors)
        )?;
    }
    for one in &found.unidentifiable {
        say!(
            "    {:<18} not to be told; {} would",
            one.effect,
            one.would_tell
        )?;
    }
    Ok(())
}

/// `offset [0.0502, 0.0001, -0.0611] m +- [0.0003, 0.0003, 0.0003]`.
fn parameters(
    effect: &str,
    parameters: &BTreeMap<String, Value>,
    standard_errors: &BTreeMap<String, Value>,
) -> String {
    let specs = EffectKind::from_name(effect).map_or(&[][..], |kind| kind.spec().parameters);
    let one = |(name, value): (&String, &Value)| {
        let unit = specs
            .iter()
            .find(|spec| spec.name == *name)
            .map_or("", |spec| spec.unit);
        let unit = if unit.is_empty() {
            String::new()
        } else {
            format!(" {unit}")
        };
        let error = standard_errors
            .get(name)
            .map(|error| format!(" +- {}", short(error, 2)))
            .unwrap_or_default();
        format!("{name} {}{unit}{error}", short(value, 4))
    };
    parameters.iter().map(one).collect::<Vec<_>>().join(", ")
}

/// Numbers with so many significant digits.
fn short(value: &Value, digits: i32) -> String {
    match value {
        Value::Array(values) => format!(
            "[{}]",
            values
                .iter()
                .map(|value| short(value, digits))
                .collect::<Vec<_>>()
                .join(", ")
        ),
        Value::String(word) => word.clone(),
        Value::Number(number) => {
            let number = number.as_f64().unwrap_or(f64::NAN);
            let magnitude = if number == 0.0 {
                0
            } else {
                number.abs().log10().floor() as i32
            };
            if number == 0.0 || (-4..9).contains(&magnitude) {
                format!("{number:.*}", (digits - 1 - magnitude).clamp(0, 9) as usize)
            } else {
                format!("{number:.*e}", digits as usize - 1)
            }
        }
        other => other.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::Config;

    #[test]
    fn config_takes_both_forms_of_lists() {
        let list = |names: &[&str]| {
            names
                .iter()
                .map(|name| (*name).to_owned())
                .collect::<Vec<_>>()
        };
        let expected = || Config {
            placements: list(&["wrist", "left"]),
            without: list(&["low_pass"]),
            seed: Some(7),
        };
        for text in [
            "placements: [wrist, 'left']\nwithout:\n  - low_pass  # why\nseed: 7\n",
            "# c\nseed: 7\nplacements:\n- wrist\n- \"left\"\nwithout: [low_pass]",
        ] {
            assert_eq!(Config::parse(text).expect(text), expected(), "{text}");
        }
        assert_eq!(Config::parse("").expect("empty"), Config::default());
    }

    #[test]
    fn config_names_the_line_of_what_is_wrong() {
        for (text, line, part) in [
            ("seed: 7\nwihtout: []", 2, "wihtout"),
            ("seed: seven", 1, "seven"),
            ("without: lever_arm", 1, "sequence"),
            ("- wrist", 1, "sequence"),
            ("seed: 1\nseed: 2", 1, "duplicate field `seed`"),
            ("without: [a, {b: c}]", 1, "string"),
            ("what", 1, "what"),
        ] {
            let error = Config::parse(text).expect_err(text);
            let (found, problem) = (
                error.location().map_or(0, |location| location.line()),
                error.to_string(),
            );
            assert!(
                found == line && problem.contains(part),
                "{text}: line {found}: {problem}"
            );
        }
    }
}
