//! Every command of the README is run as a newcomer would, from top to bottom in one fresh folder,
//! and links lead somewhere.
//!
//! A block fenced as `sh` is one bash script. The folder holds links to the repository's `bags` and
//! `config`, and `cromosim` is on the path; `cargo run --` stands for it. What one block writes is
//! there for the next.
#![allow(clippy::unwrap_used)]

mod common;

use std::fs;
use std::os::unix::fs::{PermissionsExt, symlink};
use std::path::Path;
use std::process::Command;

use common::{CROMOSIM, root};
use cromosim_ros::testing::{environment, in_private_network};

/// Lines that are not run: they would build the workspace once more, or test it inside its own
/// test.
const NOT_RUN: [&str; 2] = ["cargo test --workspace", "cargo install --path ."];

/// The blocks of a Markdown text: language (all that stands behind the fence) and content.
fn blocks(markdown: &str) -> Vec<(String, String)> {
    let mut blocks: Vec<(String, String)> = Vec::new();
    let mut inside = false;
    for line in markdown.lines() {
        if let Some(language) = line.strip_prefix("```") {
            if !inside {
                blocks.push((language.trim().to_owned(), String::new()));
            }
            inside = !inside;
        } else if let (true, Some((_, content))) = (inside, blocks.last_mut()) {
            *content += &format!("{line}\n");
        }
    }
    blocks
}

/// The block as it is run.
fn script(block: &str) -> String {
    let line = |line: &str| {
        let command = line.split(" #").next().unwrap_or_default().trim();
        if NOT_RUN.contains(&command) {
            println!("not run: {command}");
            return String::new();
        }
        match line.strip_prefix("cargo run -- ") {
            Some(rest) => format!("cromosim {rest}\n"),
            None => format!("{line}\n"),
        }
    };
    block.lines().map(line).collect()
}

/// Puts `cromosim` on the path of the scripts; without Rerun, the demo runs without its viewer.
fn install(folder: &Path) -> String {
    let bin = folder.join(".bin");
    fs::create_dir(&bin).unwrap();
    let program = bin.join("cromosim");
    let no_viewer = if cfg!(feature = "view") {
        ""
    } else {
        "--no-viewer"
    };
    let text = format!(
        "#!/bin/bash\nif [ \"$1\" = demo ]; then exec '{CROMOSIM}' \"$@\" {no_viewer}; fi\nexec '{CROMOSIM}' \"$@\"\n"
    );
    fs::write(&program, text).unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    format!("{}:{}", bin.display(), std::env::var("PATH").unwrap())
}

#[test]
fn every_command_of_the_readme_works() {
    in_private_network("every_command_of_the_readme_works", || {
        let folder = tempfile::tempdir().unwrap();
        for name in ["bags", "config"] {
            symlink(root().join(name), folder.path().join(name)).unwrap();
        }
        let path = install(folder.path());
        let readme = fs::read_to_string(root().join("README.md")).unwrap();
        let mut run = 0;
        for (language, block) in blocks(&readme) {
            if language != "sh" {
                assert!(
                    !language.starts_with("sh"),
                    "a block is run, or not of `sh`: {language}"
                );
                continue;
            }
            let text = script(&block);
            let output = Command::new("bash")
                .args(["-euo", "pipefail", "-c"])
                .arg(format!(
                    "trap 'echo \"failed: $BASH_COMMAND\" >&2' ERR\n{text}"
                ))
                .current_dir(folder.path())
                .env("PATH", &path)
                .envs(environment())
                .output()
                .unwrap();
            let said = common::text(&output);
            println!("{text}{said}");
            assert!(output.status.success(), "{block}\n{said}");
            said_numbers(&block, &said);
            run += 1;
        }
        assert!(run >= 8, "{run} blocks were run");
    });
}

/// What comments say of comparisons is so, to the digits that they give:
/// `# right_wrist: RMSE 0.545 m/s2, 0.116 rad/s`.
fn said_numbers(block: &str, said: &str) {
    let numbers = |text: &str| -> Vec<String> {
        text.split(", ")
            .filter_map(|value| value.split_whitespace().next())
            .map(str::to_owned)
            .collect()
    };
    let rows: Vec<Vec<String>> = said
        .lines()
        .filter_map(|line| line.split_once("RMSE of the difference "))
        .map(|(_, values)| numbers(values))
        .collect();
    let near = |promised: &String, found: &String| {
        let decimals = promised.split('.').nth(1).map_or(0, str::len) as i32;
        let [promised, found] = [promised, found].map(|text| text.parse::<f64>().unwrap());
        (promised - found).abs() <= 0.500_001 * 10_f64.powi(-decimals)
    };
    for comment in block.lines().filter_map(|line| line.split_once(": RMSE ")) {
        let promised = numbers(comment.1);
        let kept = |row: &Vec<String>| promised.iter().zip(row).all(|(a, b)| near(a, b));
        assert!(
            rows.iter().any(kept),
            "promised {promised:?}, found {rows:?}"
        );
    }
}

#[test]
fn links_lead_somewhere() {
    let mut pages = vec![
        "README.md".to_owned(),
        "ARCHITECTURE.md".to_owned(),
        "CONTRIBUTING.md".to_owned(),
        "bags/README.md".to_owned(),
        "config/README.md".to_owned(),
        "msgs/README.md".to_owned(),
        "nodes/lib/README.md".to_owned(),
        "nodes/bin/README.md".to_owned(),
    ];
    for folder in ["nodes/lib", "nodes/bin"] {
        for entry in fs::read_dir(root().join(folder)).unwrap() {
            let name = entry.unwrap().file_name().into_string().unwrap();
            pages.push(format!("{folder}/{name}/README.md"));
        }
    }
    let mut broken = Vec::new();
    for page in pages {
        let Ok(text) = fs::read_to_string(root().join(&page)) else {
            continue;
        };
        let folder = root().join(&page).parent().unwrap().to_owned();
        for link in links(&text) {
            let file = link.split('#').next().unwrap_or_default();
            if !file.is_empty() && !folder.join(file).exists() {
                broken.push(format!("{page}: {link}"));
            }
            let anchor = link.strip_prefix('#');
            if anchor.is_some_and(|anchor| !anchors(&text).iter().any(|known| known == anchor)) {
                broken.push(format!("{page}: no heading {link}"));
            }
        }
    }
    assert!(broken.is_empty(), "{}", broken.join("\n"));
}

/// Links to files of the repository, and to headings.
fn links(markdown: &str) -> Vec<String> {
    let outside = |link: &str| link.contains("://") || link.starts_with("mailto:");
    markdown
        .split("](")
        .skip(1)
        .filter_map(|rest| rest.split_once(')'))
        .map(|(link, _)| link.to_owned())
        .filter(|link| !outside(link) && !link.contains([' ', '\n']))
        .collect()
}

/// The headings as GitHub names their anchors.
fn anchors(markdown: &str) -> Vec<String> {
    let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    markdown
        .lines()
        .filter(|line| line.starts_with('#'))
        .map(|line| {
            let heading = line.trim_start_matches('#').trim().to_lowercase();
            heading
                .chars()
                .filter(kept)
                .collect::<String>()
                .replace(' ', "-")
        })
        .collect()
}

#[test]
fn blocks_become_scripts() {
    let text =
        "a\n```sh\ncargo run -- demo   # x\ncargo test --workspace\n```\n```yaml\na: 1\n```\n";
    let found = blocks(text);
    assert_eq!(found[1], ("yaml".to_owned(), "a: 1\n".to_owned()));
    assert_eq!(script(&found[0].1), "cromosim demo   # x\n");
}
