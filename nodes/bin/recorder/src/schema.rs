//! Schema text of types that this suite does not know, from an installed ROS 2.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use cromosim_bag::Topic;
use cromosim_msgs::known_type;

/// A topic with the best description of its type that is to be had: the suite's own, that of an
/// installed ROS 2 (`AMENT_PREFIX_PATH`), or none, which readers that know the type accept.
pub fn describe(name: &str, type_name: &str) -> Topic {
    if known_type(type_name).is_some() {
        return Topic::named(name, type_name);
    }
    let prefixes: Vec<PathBuf> = std::env::var_os("AMENT_PREFIX_PATH")
        .map(|paths| std::env::split_paths(&paths).collect())
        .unwrap_or_default();
    let text = installed(type_name, &prefixes);
    if text.is_none() {
        log::warn!(
            "{name}: no definition of {type_name} is known (AMENT_PREFIX_PATH has none either); it is recorded without one"
        );
    }
    Topic::with_schema(name, type_name, &text.unwrap_or_default())
}

/// The text of a type and, after lines of 80 `=`, of the types in it.
fn installed(type_name: &str, prefixes: &[PathBuf]) -> Option<String> {
    let mut text = read(type_name, prefixes)?;
    let mut seen = BTreeSet::from([type_name.to_owned()]);
    let mut open = parts_of(type_name, &text);
    while let Some(part) = open.pop() {
        if !seen.insert(part.clone()) {
            continue;
        }
        let definition = read(&part, prefixes)?;
        let (package, name) = (part.split('/').next()?, part.rsplit('/').next()?);
        text += &format!("\n{}\nMSG: {package}/{name}\n{definition}", "=".repeat(80));
        open.extend(parts_of(&part, &definition));
    }
    Some(text)
}

fn read(type_name: &str, prefixes: &[PathBuf]) -> Option<String> {
    let [package, kind, name] = type_name.split('/').collect::<Vec<_>>()[..] else {
        return None;
    };
    let relative = Path::new("share")
        .join(package)
        .join(kind)
        .join(format!("{name}.msg"));
    prefixes
        .iter()
        .find_map(|prefix| std::fs::read_to_string(prefix.join(&relative)).ok())
}

/// The full names of the messages that are fields of a definition.
fn parts_of(type_name: &str, text: &str) -> Vec<String> {
    let package = type_name.split('/').next().unwrap_or_default();
    let own = text
        .lines()
        .take_while(|line| !line.starts_with("===="))
        .filter_map(|line| {
            let field = line.split('#').next()?.split_whitespace().next()?;
            let base = field.split(['[', '<']).next()?;
            match base.split('/').collect::<Vec<_>>()[..] {
                [package, name] => Some(format!("{package}/msg/{name}")),
                [package, "msg", name] => Some(format!("{package}/msg/{name}")),
                ["Header"] => Some("std_msgs/msg/Header".to_owned()),
                [name] if name.starts_with(|first: char| first.is_ascii_uppercase()) => {
                    Some(format!("{package}/msg/{name}"))
                }
                _ => None,
            }
        });
    own.collect()
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    #[test]
    fn an_installed_type_comes_with_all_its_parts() {
        let folder = tempfile::tempdir().unwrap();
        let write = |package: &str, name: &str, text: &str| {
            let place = folder.path().join("share").join(package).join("msg");
            std::fs::create_dir_all(&place).unwrap();
            std::fs::write(place.join(format!("{name}.msg")), text).unwrap();
        };
        write(
            "zoo",
            "Cage",
            "uint8 OPEN=1\nstd_msgs/Header header\nAnimal[<=3] animals # Lion inside\nstring<=5 name\n",
        );
        write(
            "zoo",
            "Animal",
            "Cage_x[] nothing\n"
                .replace("Cage_x[] nothing\n", "float32 weight\n")
                .as_str(),
        );
        write(
            "std_msgs",
            "Header",
            "builtin_interfaces/Time stamp\nstring frame_id\n",
        );
        write("builtin_interfaces", "Time", "int32 sec\nuint32 nanosec\n");
        let text = installed("zoo/msg/Cage", &[folder.path().to_owned()]).unwrap();
        for part in [
            "MSG: zoo/Animal\n",
            "MSG: std_msgs/Header\n",
            "MSG: builtin_interfaces/Time\n",
        ] {
            assert_eq!(text.matches(part).count(), 1, "{text}");
        }
        assert_eq!(text.matches(&"=".repeat(80)).count(), 3);
        assert!(installed("zoo/msg/Elephant", &[folder.path().to_owned()]).is_none());
    }
}
