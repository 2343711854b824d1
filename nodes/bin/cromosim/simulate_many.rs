//! Many motions of one call: each becomes a file of its own, and what is done already is left alone.
//!
//! As many motions are at work as there are cores, in their order, and each is written before the
//! next is read: memory does not grow with their number.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;

use anyhow::{Context, bail};
use cromosim_recording::batch::{BatchInput, Manifest, Outcome, expand};
use indicatif::ProgressBar;
use serde_json::json;

use crate::output::{remark, say};
use crate::progress;
use crate::simulate_arguments::Arguments;
use crate::simulate_setup::{Output, Setup, Written};
use crate::simulated_file::simulate_one;

/// Runs `simulate MOTIONS` of several motions, or of what may be several.
pub fn run(arguments: &Arguments, mut setup: Setup) -> anyhow::Result<()> {
    let folder = &arguments.out;
    let shard = arguments.shard;
    let inputs = expand(&arguments.motions)?.into_iter().enumerate();
    let inputs = inputs.filter(|(number, _)| shard.is_none_or(|shard| shard.holds(*number)));
    let all: Vec<BatchInput> = inputs.map(|(_, input)| input).collect();
    fs::create_dir_all(folder).with_context(|| format!("{}: cannot be made", folder.display()))?;
    let settings = setup.manifest_settings(arguments)?;
    let manifest = Manifest::open(folder, shard, settings, setup.force)?;
    setup.force |= manifest.replaces();
    let output = |input: &BatchInput| format!("{}.{}", input.name, setup.format.ending());
    let is_left = |input: &&BatchInput| !manifest.is_done(&input.path, &output(input));
    let left: Vec<BatchInput> = all.iter().filter(is_left).cloned().collect();
    let bar = progress::bar(left.len() as u64, "simulating, files");
    let done = Mutex::new(Done::new(manifest));
    let next = AtomicUsize::new(0);
    thread::scope(|scope| {
        for _ in 0..rayon::current_num_threads().min(left.len()) {
            scope.spawn(|| {
                while let Some(number) = take(&next, left.len(), &setup) {
                    let input = &left[number];
                    let output = output(input);
                    let written = simulate_input(&setup, input, &folder.join(&output));
                    if setup.interrupt.is_set() && written.is_err() {
                        return;
                    }
                    let mut done = done.lock().unwrap_or_else(PoisonError::into_inner);
                    done.add(number, outcome(folder, input, output, written), &bar);
                }
            });
        }
    });
    bar.finish_and_clear();
    let done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.end(&setup, (folder, &all, left.len()), output)
}

/// The number of the next input; none after the last, and after a signal.
fn take(next: &AtomicUsize, count: usize, setup: &Setup) -> Option<usize> {
    let number = next.fetch_add(1, Ordering::Relaxed);
    (number < count && !setup.interrupt.is_set()).then_some(number)
}

fn simulate_input(setup: &Setup, input: &BatchInput, out: &Path) -> anyhow::Result<Written> {
    let people = setup.read(Some(&input.path))?;
    if let Some(parent) = out.parent() {
        fs::create_dir_all(parent)
            .with_context(|| format!("{}: cannot be made", parent.display()))?;
    }
    let output = Output {
        path: out,
        recording: &input.name,
    };
    simulate_one(setup, &people, output, &ProgressBar::hidden())
}

/// What became of an input, and what is said of it.
fn outcome(
    folder: &Path,
    input: &BatchInput,
    output: String,
    written: anyhow::Result<Written>,
) -> (Outcome, String) {
    let path = input.path.display().to_string();
    match written {
        Ok(Written { count, line }) => {
            let bytes = fs::metadata(folder.join(&output)).map_or(0, |found| found.len());
            let outcome = Outcome::Written {
                input: path,
                output,
                bytes,
                count,
            };
            (outcome, line)
        }
        Err(error) => {
            let error = format!("{error:#}");
            let outcome = Outcome::Failed {
                input: path,
                output,
                error: error.clone(),
            };
            (outcome, error)
        }
    }
}

/// What is done so far.
struct Done {
    manifest: Manifest,
    /// Those that are done before one that was begun earlier: few, since they are begun in order.
    waiting: BTreeMap<usize, (Outcome, String)>,
    /// The first that is not done.
    next: usize,
    written: usize,
    errors: Vec<String>,
    /// What went wrong with the manifest or standard output.
    broken: anyhow::Result<()>,
}

impl Done {
    fn new(manifest: Manifest) -> Self {
        Self {
            manifest,
            waiting: BTreeMap::new(),
            next: 0,
            written: 0,
            errors: Vec::new(),
            broken: Ok(()),
        }
    }

    /// Notes and says what is done, in the inputs' order.
    fn add(&mut self, number: usize, one: (Outcome, String), bar: &ProgressBar) {
        bar.inc(1);
        self.waiting.insert(number, one);
        while let Some((outcome, line)) = self.waiting.remove(&self.next) {
            self.next += 1;
            let is_written = matches!(outcome, Outcome::Written { .. });
            let added = self.manifest.add(outcome);
            if self.broken.is_ok() {
                self.broken = added.map_err(Into::into);
            }
            if is_written {
                self.written += 1;
                if self.broken.is_ok() {
                    self.broken = bar.suspend(|| say!("{line}"));
                }
            } else {
                self.errors.push(line);
            }
        }
    }

    /// Says in the end what became of all; an error where something failed.
    fn end(
        mut self,
        setup: &Setup,
        (folder, all, left): (&Path, &[BatchInput], usize),
        output: impl Fn(&BatchInput) -> String,
    ) -> anyhow::Result<()> {
        for (_, (outcome, _)) in std::mem::take(&mut self.waiting) {
            self.written += usize::from(matches!(outcome, Outcome::Written { .. }));
            self.manifest.add(outcome)?;
        }
        self.broken?;
        let there = all.len() - left;
        if setup.interrupt.is_set() {
            bail!(
                "interrupted; {} of {} files are written, and the same command goes on",
                there + self.written,
                all.len()
            );
        }
        let outputs: Vec<String> = all.iter().map(output).collect();
        let manifest: PathBuf = self.manifest.finish(outputs.iter().map(String::as_str))?;
        for error in &self.errors {
            remark!("error: {error}");
        }
        let failed = self.errors.len();
        let out = folder.display();
        if setup.json {
            say!(
                "{}",
                json!({"out": out.to_string(), "written": self.written, "there_already": there, "failed": failed,
                    "manifest": manifest.display().to_string()})
            )?;
        } else {
            let there = match there {
                0 => String::new(),
                there => format!("{there} were there already, "),
            };
            let manifest = manifest.display();
            say!(
                "{out}: {} files written, {there}{failed} failed; {manifest}",
                self.written
            )?;
        }
        if !self.errors.is_empty() {
            bail!(
                "{} of {} files failed (above); the others are written",
                self.errors.len(),
                all.len()
            );
        }
        Ok(())
    }
}
