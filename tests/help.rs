//! Help as a user sees it: `-h` fits a screen, `--help` has what it leaves out, and options stand
//! under headings.
#![allow(clippy::unwrap_used)]

mod common;

use std::collections::BTreeMap;
use std::process::Command;

use common::CROMOSIM;

/// Columns of the screen.
const COLUMNS: usize = 100;
/// Lines of the screen.
const LINES: usize = 40;
/// As many options as one finds in a list without headings.
const UNGROUPED: usize = 10;

fn help(command: &[String], flag: &str) -> String {
    let output = Command::new(CROMOSIM)
        .args(command)
        .arg(flag)
        .env("COLUMNS", COLUMNS.to_string())
        .output()
        .unwrap();
    assert!(output.status.success(), "{command:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// The entries of a help's section: lines indented by two.
fn entries<'a>(help: &'a str, heading: &str) -> Vec<&'a str> {
    let behind = help.lines().skip_while(|line| *line != heading).skip(1);
    let section = behind.take_while(|line| line.is_empty() || line.starts_with(' '));
    section
        .filter(|line| line.starts_with("  ") && !line.starts_with("   "))
        .map(str::trim)
        .collect()
}

/// Every command that has a help of clap's, the program itself among them.
fn commands() -> Vec<Vec<String>> {
    let mut found: Vec<Vec<String>> = vec![Vec::new()];
    let mut next = 0;
    while let Some(command) = found.get(next).cloned() {
        for entry in entries(&help(&command, "-h"), "Commands:") {
            let name = entry.split(' ').next().unwrap();
            if name != "help" {
                found.push(command.iter().cloned().chain([name.to_owned()]).collect());
            }
        }
        next += 1;
    }
    found
}

/// The long options of a help, by their heading.
fn options(help: &str) -> BTreeMap<String, Vec<String>> {
    let mut found: BTreeMap<String, Vec<String>> = BTreeMap::new();
    let mut heading = "";
    for line in help.lines() {
        if !line.starts_with(' ') && line.ends_with(':') {
            heading = line.trim_end_matches(':');
        }
        let option = line.trim_start();
        let option = option.split_once(", --").map_or(option, |(_, long)| long);
        let option = option.trim_start_matches("--");
        // Not the list of an option's values.
        if line.trim_start().starts_with('-') && line.contains("--") {
            let name = option.split([' ', '=', '[']).next().unwrap();
            let options = found.entry(heading.to_owned()).or_default();
            options.push(name.to_owned());
        }
    }
    found
}

#[test]
fn short_help_fits_a_screen() {
    let commands = commands();
    assert!(commands.len() >= 19, "{commands:?}");
    let mut too_long = Vec::new();
    for command in &commands {
        let help = help(command, "-h");
        let (lines, widest) = (
            help.lines().count(),
            help.lines().map(|line| line.chars().count()).max().unwrap(),
        );
        if lines > LINES || widest > COLUMNS {
            too_long.push(format!(
                "{}: {lines} lines, widest {widest}\n{help}",
                command.join(" ")
            ));
        }
    }
    assert!(too_long.is_empty(), "{}", too_long.join("\n"));
}

#[test]
fn long_help_has_all_that_short_help_has() {
    for command in commands() {
        let [short, long] = ["-h", "--help"].map(|flag| options(&help(&command, flag)));
        let [short, long] = [short, long].map(|help| help.into_values().flatten());
        let long: Vec<String> = long.collect();
        for option in short {
            assert!(long.contains(&option), "{command:?}: {option}");
        }
    }
}

#[test]
fn many_options_stand_under_headings() {
    for command in commands() {
        let options = options(&help(&command, "--help"));
        let plain = options.get("Options").map_or(0, Vec::len);
        assert!(plain <= UNGROUPED, "{command:?}: {options:?}");
        // What belongs to reading motions stands together, and nothing else beside it.
        let reading = ["up-axis", "unit", "start", "person", "shape", "source-body"];
        for (heading, options) in &options {
            let has = |name: &&str| options.iter().any(|option| option == name);
            let count = reading.iter().filter(|name| has(name)).count();
            assert!(
                count == 0 || (heading == "Motion files" && count == reading.len()),
                "{command:?}, {heading}: {options:?}"
            );
            assert!(heading != "Motion files" || !has(&"force"), "{command:?}");
        }
    }
}

#[test]
fn short_help_of_nodes_fits_a_screen() {
    for node in [
        "replay",
        "smpl_state",
        "virtual_imu",
        "recorder",
        "gap_monitor",
    ] {
        let node = ["node", node].map(str::to_owned);
        let [short, long] = ["-h", "--help"].map(|flag| help(&node, flag));
        let widest = short.lines().map(|line| line.chars().count()).max();
        assert!(
            short.lines().count() <= LINES && widest.unwrap() <= COLUMNS,
            "{short}"
        );
        // Every parameter of the long help has its line.
        for line in entries(&long, "Parameters [default]:") {
            let name = line.split(' ').next().unwrap();
            let known = name.starts_with("qos_overrides") || short.contains(&format!("  {name} ["));
            assert!(known, "{name}: {short}");
        }
    }
}
